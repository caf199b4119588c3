#pragma once

#include <Eigen/Core>

namespace smoothpost {

inline constexpr int kMaxJoints = 12;

/// One value per axis, in the order of the machine file: mm (linear) or rad (rotary). No
/// allocation.
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;

/// Limits per axis, in the order of the machine file: mm or rad, and their derivatives by s.
struct JointLimits {
  JointVector lower;
  JointVector upper;
  JointVector velocity;
  JointVector acceleration;
  JointVector jerk;
};

}  // namespace smoothpost
