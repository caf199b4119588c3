#pragma once

#include <array>
#include <optional>

#include "kernels/kinematics/jet.h"
#include "kernels/kinematics/screw_chain.h"

// Derivatives of the joints along a path whose derivatives are known: no difference quotients.
namespace smoothpost {

/// Joint values and their derivatives of orders 1 … 3 by one parameter: row j is joint j.
using JointJet = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::ColMajor, kMaxJoints, 4>;

/// Tip (mm, W) and tool axis (unit, W) with derivatives.
struct LocationJet {
  VectorJet tip, axis;
};

/// Tip (mm, W) and rotation R_WT with derivatives.
struct PoseJet {
  VectorJet tip;
  MatrixJet rotation;
};

/// The joints whose derivatives are sought; those of the others are given.
using FreeJoints = std::array<bool, kMaxJoints>;

/// Tip and tool axis of moving joints: forward_location() with derivatives.
/// Guarantees (tests): equals central differences of forward_location.
/// Cost: O(joints), about 0.4 µs, no allocation.
/// @pre q.rows() == chain.size()   @throws ContractViolation if not.
LocationJet forward_jet(const ScrewChain& chain, const JointJet& q);

/// The derivatives of the free joints when the tool follows `target`.
///
/// Definition. Order by order: with the derivatives below order r known and that of order r put to
/// 0, forward kinematics give the r-th derivative of tip and axis (rotation) but for the part that
/// is linear in the sought ones, whose matrix is the Jacobian at q.col(0) for every r.
///
/// @param q  column 0: joint values at which the tool is at `target` (its values are not compared);
///           columns 1 … 3: derivatives of the joints that are not free
/// Returns nothing where the free joints cannot be told apart or are more than the conditions
/// (a singular place: the Jacobian of the free joints, with 100 mm for a radian of the tool, has a
/// pivot below 1e-9 of the largest). What the joints cannot follow (axis of fewer than two free
/// rotaries) is left out in the sense of least squares.
///
/// Guarantees (tests): forward_jet of the result is the target's to 1e-9 relative; equals central
/// differences of the inverse.   Units: mm, rad, per parameter.
/// Cost: about 2 µs, no allocation.   @pre as for forward_jet
///
/// Implements the implicit derivative of FK(q(s)) = X(s), three times (docs/equations.md).
std::optional<JointJet> joint_jet(const ScrewChain& chain, const JointJet& q,
                                  const FreeJoints& free, const LocationJet& target);
std::optional<JointJet> joint_jet(const ScrewChain& chain, const JointJet& q,
                                  const FreeJoints& free, const PoseJet& target);

}  // namespace smoothpost
