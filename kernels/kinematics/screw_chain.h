#pragma once

#include <vector>

#include "kernels/core/joints.h"
#include "kernels/core/pose.h"
#include "kernels/core/tool_path.h"

namespace smoothpost {

enum class JointKind { linear, rotary };
enum class ChainSide { tool, workpiece };

/// One joint of a machine: a screw in M at the pose where every joint is 0. Its positive motion is the
/// physical motion of the side that it moves (head or table).
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

/// Tool pose in the workpiece:
///   X_WT = (Π_workpiece e^[S_i]q_i · X_MW(0))⁻¹ · Π_tool e^[S_i]q_i · X_MT(0),
/// which is the workpiece chain reversed with negated screws, then the tool chain, then the tool pose.
/// @pre q.size() == chain.size()   Cost: O(joints), no allocation.
Pose forward(const ScrewChain& chain, const JointVector& q);

/// Tip and tool axis of forward(), without the full rotation.
CutterLocation forward_location(const ScrewChain& chain, const JointVector& q);

using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxJoints>;

/// Geometric Jacobian in W, columns in machine-file order: rows 0-2 angular velocity of the tool (rad per
/// joint unit), rows 3-5 velocity of the tip (mm per joint unit). Signs are those of the physical joints.
Jacobian jacobian(const ScrewChain& chain, const JointVector& q);

/// Upper bounds of |d²tip/dτ²| (mm) and |d²axis/dτ²| (1) while the joints go linearly from `from` to `to`
/// over τ ∈ [0, 1]. Holds everywhere on the motion, not only at samples.
struct SecondDerivativeBound {
  double tip = 0.0;
  double axis = 0.0;
};
SecondDerivativeBound second_derivative_bound(const ScrewChain& chain, const JointVector& from,
                                              const JointVector& to);

}  // namespace smoothpost
