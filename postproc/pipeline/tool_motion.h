#pragma once

#include <optional>

#include "kernels/core/tool_path.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/dialect.h"

// What a controller does between the ends of a move with MoveInterpolation::tool.
namespace smoothpost {

/// The tool pose at share t ∈ [0, 1] of a move: tip on the straight line; the rotation by `turn`.
/// great_circle turns by the least rotation that takes the one tool axis (`axis`, in T) to the
/// other.
Pose tool_motion(const Pose& from, const Pose& to, double t, ToolTurn turn, const Vec3& axis);

/// Bound (rad) of the angle between such a motion and what the control really does on the way.
/// slerp: controls of arms turn by a swivel of s and a rotation of r about the tool, both in
/// proportion. By Baker-Campbell-Hausdorff that leaves the one rotation by s·r/8 to leading order,
/// and s·r ≤ θ²/2 with θ the whole angle; θ²/8 is twice that, for the higher orders.   0 otherwise.
double turn_allowance(const Pose& from, const Pose& to, ToolTurn turn);

/// Bound of |d²/dt²| of tip and axis on such a move: 0 and the square of its rotation angle.
SecondDerivativeBound tool_motion_bound(const Pose& from, const Pose& to, ToolTurn turn,
                                        const Vec3& axis);

/// Rotation from the tool frame of an input with whole rotations (its Z is the tool axis) to the
/// chain's tool frame (the machine's axes at zero): the least rotation that takes Z to `tool_axis`,
/// behind a turn of −spin about Z. X_W,chain = R_input · Rz(spin) · Rᵀ(Z → tool_axis).
Mat3 input_tool_rotation(const Vec3& tool_axis, std::optional<double> spin);

/// The pose of the tip of a tool of `tool_length` when the chain (of tool length 0) is at q.
Pose tip_pose(const ScrewChain& chain, const JointVector& q, double tool_length);

/// The other way round: where a chain of tool length 0 has to be.
Pose holder_pose(const ScrewChain& chain, const Pose& tip, double tool_length);

}  // namespace smoothpost
