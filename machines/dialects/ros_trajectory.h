#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::ros_trajectory {

/// Prints trajectory_msgs/JointTrajectory as YAML: one point with positions (rad, m) and its time
/// for each move. What machine.dialect.name is decides between the fields of ROS 2 (ros_trajectory)
/// and ROS 1 (ros1_trajectory). The first point is the machine's home, at the time that a tenth of
/// the velocity limits takes for the whole range; rapids last as long as a quarter of them allows.
/// An event is a comment "# at T words" for whoever plays the message; a dwell repeats the point
/// behind "# wait S".
/// Errors: PR201, PR203 (tool moves, path mode).
/// Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a message without knowledge of what emit() was given. No move comes back as a rapid:
/// each has its time. Errors: NC349.
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;
extern const Dialect kRos1Dialect;

}  // namespace smoothpost::ros_trajectory
