#pragma once

#include <functional>
#include <string>
#include <vector>

#include "kernels/kinematics/screw_chain.h"
#include "machines/definition/machine.h"
#include "machines/dialects/dialect.h"

// How far a control that rounds corners, or lays a smooth curve of its own through the points,
// leaves the straight moves of a program. For dialects that turn the tool as ToolTurn::slerp.
//
// Rounding, what is assumed. Moves 0 and 1 meet in corner C with unit directions T0, T1 and turn by
// the constant vectors w0, w1 (rad per mm of way, axes of W). The tip and the rotation vector from
// the corner's rotation make one point of R^6; straight, it goes along -u (T0, w0) to the corner
// and on along u (T1, w1). The control leaves this way at u = r' at the earliest, r' ≤ r, and stays
// in the triangle of the three points: at every instant it is at
//   p = -a r' (T0, w0) + b r' (T1, w1),   a, b ≥ 0, a + b ≤ 1, b - a not falling.
// (A parabola has a = (1-s)², b = s².) Match p with the place u = r' (b - a) of the straight way:
// that is a monotone matching, one for tip and rotation, and the two differ there by
//   min(a, b) r' (T1 - T0, w1 - w0),   min(a, b) ≤ 1/2,
// so the tip by at most r |T1 - T0| / 2 = r sin(θ/2), θ the turning angle, and the rotation by at
// most r |w1 - w0| / 2, because rotations differ by no more than their vectors do.
//
// Splines, what is assumed: the control's curve through the points stays within twice the bound
// below of the straight moves, at equal parameter. The bound is that of the cubic with the
// Catmull-Rom tangents of chord length: on a move of length h with tangents m0, m1 and chord d,
//   p - chord = t(1-t)² (m0 - d) - t²(1-t) (m1 - d),   |p - chord| ≤ max(|m0 - d|, |m1 - d|) / 4,
//   m0 - d = h²/(h' + h) (T' - T) with the move before (length h', direction T'), m1 - d likewise;
// the same with w for the rotation. At the end of a block the tangent follows from the other end
// (parabola, or no second derivative), which the maximum covers.
namespace smoothpost {

/// How far a control may leave the straight interpolation of a move.
struct BlendAllowance {
  double tip = 0.0;       ///< mm
  double rotation = 0.0;  ///< rad
};

/// Sets `blend` and `spline` of the moves, as machine.dialect.path_mode says, so that the
/// allowances above stay inside the controller's share of tolerance.tip and tolerance.axis, with
/// room for the printed digits. Call it behind everything that changes moves or actions.
///  - "exact": nothing.
///  - "blend": the largest radius, at most 0.49 of the shorter of the two moves and 20 mm, at
///    corners of at most 120 deg between two feed moves of the tool on the path, with nothing
///    between them but comments and events that the robot does not stop for.
///  - "spline": chains of two such moves or more whose inner corners keep the allowance and turn by
///    at most 45 deg. Between two chains at least one move stays straight.
/// `chain` is of tool length 0 with the part placed. Guarantees (tests): allowances of the planned
/// moves within the share, before and behind rounding to the digits; corners that stop the robot
/// stay exact. Cost: linear in moves and actions.
void plan_blending(MachineProgram& program, const MachineDefinition& machine,
                   const ScrewChain& chain);

/// What a certificate of such a program takes for granted, for its `assumes`; empty: "exact".
std::string blending_assumption(const std::string& path_mode);

/// For every move of a program that was read back (in W, as the pipeline's into_part leaves it):
/// how far the control's rounding or spline may leave the move. 0 for exact moves; INFINITY where a
/// rounding has no bound (towards a joint move, from an unknown place, of a move without length).
/// `tool_length`: mm, in use during move i. Guarantees (tests): covers parabolas and other curves
/// of the triangle by a monotone matching, and the Catmull-Rom curve at equal parameter.
/// Cost: linear.
std::vector<BlendAllowance> blend_allowances(const ReadBack& read, const ScrewChain& chain,
                                             const std::function<double(std::size_t)>& tool_length);

}  // namespace smoothpost
