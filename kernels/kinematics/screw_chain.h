#pragma once

#include <vector>

#include "kernels/core/joints.h"
#include "kernels/core/pose.h"
#include "kernels/core/tool_path.h"

namespace smoothpost {

enum class JointKind { linear, rotary };
enum class ChainSide { tool, workpiece };

/// One joint of a machine: a screw in M at the pose where every joint is 0. Its positive motion is
/// the physical motion of the side that it moves (head or table).
struct ChainJoint {
  JointKind kind = JointKind::linear;
  ChainSide side = ChainSide::tool;
  Vec3 direction = Vec3::UnitX();  ///< unit
  Vec3 origin = Vec3::Zero();      ///< a point on a rotary joint's axis, mm
  double lower = 0.0;              ///< mm or rad
  double upper = 0.0;
  double home = 0.0;
  bool cyclic = false;
  bool redundant = false;  ///< held by the five-axis closed form
};

/// Joints in machine-file order; within each side that is from the base outwards.
struct ScrewChain {
  std::vector<ChainJoint> joints;
  Pose workpiece_home = Pose::Identity();  ///< X_MW with every joint 0
  Pose tool_home = Pose::Identity();       ///< X_MT with every joint 0; its origin is the tool tip
  Vec3 tool_axis = Vec3::UnitZ();          ///< unit, in T, from tip to holder
  int size() const { return static_cast<int>(joints.size()); }
};

/// Tool pose in the workpiece.
///
/// Definition, with S_i the screw of joint i (rotary with direction w through o: v = −w × o):
///   X_WT = (Π_workpiece e^[S_i]q_i · X_MW(0))⁻¹ · Π_tool e^[S_i]q_i · X_MT(0),
/// which is the workpiece chain reversed with negated screws, then the tool chain, then the tool.
///
/// Guarantees: golden numbers of seven reference machines; home pose at q = 0; an orthonormal
/// rotation.
/// Units: mm, rad.   Cost: O(joints), a sine and cosine per rotary joint, no allocation.
/// @pre q.size() == chain.size()   @throws ContractViolation if not.
///
/// Implements [Yu2023] Eq. (1), (A2), (A3) (product of exponentials).
/// Differences from the paper:
///  - physical joint values on both sides; the paper's bed joints are their negatives
///    (θ1 = −d_bed, θ2 = −φ_bed);
///  - Table 1 and the home pose M contradict each other in the sign of L3; chains are data here,
///    and both consistent readings are golden tests.
Pose forward(const ScrewChain& chain, const JointVector& q);

/// Tip (mm) and unit tool axis of forward(), without the full rotation.
/// Guarantee: equals forward() to round-off.   Cost: about half of forward(), no allocation.
/// @pre q.size() == chain.size()   @throws ContractViolation if not.
CutterLocation forward_location(const ScrewChain& chain, const JointVector& q);

using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxJoints>;

/// Geometric Jacobian in W, columns in machine-file order: rows 0-2 angular velocity of the tool
/// (rad per joint unit), rows 3-5 velocity of the tip (mm per joint unit). Signs are those of the
/// physical joints.
///
/// Definition: a tool joint with direction w and a point o of its axis, both carried along by the
/// joints before it, gives (w, w × (p − o)) or (0, w); a workpiece joint gives the negative; all
/// seen in W.
///
/// Guarantees: golden numbers; equals central differences of forward().
/// Cost: O(joints²), no allocation.
/// @pre q.size() == chain.size()   @throws ContractViolation if not.
///
/// Implements [Yu2023] Eq. (A4)-(A8).
/// Differences from the paper: Eq. (A8) prints q' = v + w × (−q), Eq. (A5) prints θ for θ'. The tip
/// velocity is v + w × p; the central difference test shows it.
Jacobian jacobian(const ScrewChain& chain, const JointVector& q);

/// Upper bounds of |d²tip/dτ²| (mm) and |d²axis/dτ²| (1) while the joints go linearly from `from`
/// to `to` over τ ∈ [0, 1]. Holds everywhere on the motion, not only at samples.
struct SecondDerivativeBound {
  double tip = 0.0;
  double axis = 0.0;
};

/// See SecondDerivativeBound: tip and axis stay within an eighth of it of the motion's chord.
///
/// Derivation. Walk the chain from the tip inwards: x ← x + q·d for a linear joint; for a rotary
/// joint with rate w = Δq·direction x ← o + y with y = R(x − o), and then
///   x'   → R x' + w×y,
///   x''  → R x'' + 2 w×R x' + w×(w×y),
///   x''' → R x''' + 3 w×R x'' + 3 w×(w×R x') + w×(w×(w×y)).
/// So with V ≥ |x'|, A ≥ |x''|, J ≥ |x'''| over the motion, ρ ≥ distance from x to the axis,
///   V → V + wρ,   A → A + 2wV + w²ρ,   J → J + 3wA + 3w²V + w³ρ   (old values on the right).
/// By the mean value theorem V may be replaced by |x'(½)| + A/2 and A by |x''(½)| + J/2 at each
/// step, and ρ = distance at τ = ½, plus V/2; the values at ½ are exact. The outermost isometry
/// changes nothing. The tool axis is the same without origins and linear joints, where ρ ≤ 1.
///
/// Guarantees (tests): never below dense second differences; within 10 times the true maximum on
/// typical motions, and nearly exact for short ones.
/// Cost: O(joints), a sine and cosine per rotary joint, no allocation.
/// @pre from.size() == to.size() == chain.size()   @throws ContractViolation if not.
SecondDerivativeBound second_derivative_bound(const ScrewChain& chain, const JointVector& from,
                                              const JointVector& to);

}  // namespace smoothpost
