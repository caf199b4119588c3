#pragma once

#include <span>

#include "kernels/kinematics/six_r.h"

namespace smoothpost::paper_a {

/// Where the paper's path lies before the robot of machines/robot_6r: the middle of the path,
/// (250, 220, 240) mm, is 150 mm over the middle of the workpiece frame; the path's axes are those
/// of the workpiece, and the tool frame is turned by `spin` (rad) about the tool. The paper gives
/// no placement; the peaks depend on it, their growth with the sampling does not.
struct Placement {
  Vec3 middle = Vec3(250, 220, 240);
  Vec3 over = Vec3(0, 0, 150);
  double spin = 0.0;
};

/// Largest third difference of any joint over dt³ (rad/s³) along poses dt (s) apart, each pose
/// solved in closed form on the branch of the first one nearest to the joints' middle.
/// @return a negative number if a pose is out of reach
double peak_joint_jerk(const SixR& arm, std::span<const Pose> poses, double dt,
                       const Placement& placement);

}  // namespace smoothpost::paper_a
