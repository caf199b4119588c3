#pragma once

#include <array>
#include <optional>

#include "kernels/kinematics/jet.h"
#include "kernels/kinematics/screw_chain.h"

namespace smoothpost {

/// A cutting head: three linear axes that carry two rotaries that carry a redundant linear axis
/// along the tool, with a fixed workpiece (TTT RRT; the laser of paper B).
///
/// With C the tip in W and q1 … q6 the joints in the order linear, rotary, standoff,
///   Σ d_i q_i = X_MW C − y,   y = o1 + R1(q4)(o2 + R2(q5)(t + q6 d6 − o2) − o1),
/// so at given tip and rotaries the linear axes are affine in the standoff: q_i = a_i + b_i q6.
struct HeadGeometry {
  std::array<int, 3> linear{};  ///< joint indices, in machine-file order
  int first_rotary = 0;
  int second_rotary = 0;
  int standoff = 0;

  Vec3 axis1, origin1, axis2, origin2;  ///< in M
  Vec3 tip;                             ///< of a tool of length 0 with every joint 0, in M
  Vec3 along;                           ///< d6, unit, in M with every joint 0
  Vec3 tool_axis;                       ///< likewise, from tip to holder
  Mat3 to_joints = Mat3::Identity();    ///< inverse of (d1 d2 d3)
  Pose part = Pose::Identity();         ///< X_MW

  /// Nothing unless the chain is of this kind: those six joints in that order, all on the tool
  /// side, the last one redundant and along the tool, and otherwise as RotaryPair::from() asks.
  static std::optional<HeadGeometry> from(const ScrewChain& chain);
};

/// The linear axes at one place of a path, with three derivatives: q_i = a_i + b_i·q6.
struct LinearsByStandoff {
  VectorJet a;  ///< row i: joint linear[i] with q6 = 0
  VectorJet b;  ///< what one mm of standoff adds, per mm
};

/// Guarantees (tests): values equal RotaryPair::with_linears, derivatives equal central
/// differences.
/// @param tip  C in W, mm   @param q4, q5  rotaries, rad; all with derivatives by one parameter
/// Units: mm, rad and their derivatives by the parameter.   Cost: about 1000 flops, no allocation.
/// Implements [Ding2025] Eq. (2), (46)-(48) for any arms between the axes. Differences from the
/// paper: Eq. (46) has the opposite sign of q6 of (2)-(3); here the sign and L0 follow from the
/// axis' direction and the tool tip.
LinearsByStandoff linears_by_standoff(const HeadGeometry& head, const VectorJet& tip, const Jet& q4,
                                      const Jet& q5);

/// The tool axis in W with derivatives.   Cost: half of that.
/// Guarantees (tests): equals forward_location, golden derivatives of paper B.
VectorJet axis_jet(const HeadGeometry& head, const Jet& q4, const Jet& q5);

}  // namespace smoothpost
