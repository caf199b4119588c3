#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

// From the one to the other, as the rotation vector of a turn about a fixed axis of W.
Vec3 turn_vector(const Pose& from, const Pose& to, ToolTurn turn, const Vec3& axis) {
  if (turn == ToolTurn::slerp) return rotation_log(to.linear() * from.linear().transpose());
  const Vec3 a = from.linear() * axis;
  const Vec3 b = to.linear() * axis;
  const double angle = angle_between(a, b);
  if (angle < 1e-15) return Vec3::Zero();
  const Vec3 normal = a.cross(b);
  return angle * (normal.norm() > 1e-12 ? Vec3(normal.normalized()) : Vec3(a.unitOrthogonal()));
}

}  // namespace

Pose tool_motion(const Pose& from, const Pose& to, double t, ToolTurn turn, const Vec3& axis) {
  Pose pose = from;
  pose.translation() = from.translation() + t * (to.translation() - from.translation());
  pose.linear() = rotation_exp(t * turn_vector(from, to, turn, axis)) * from.linear();
  return pose;
}

double turn_allowance(const Pose& from, const Pose& to, ToolTurn turn) {
  if (turn != ToolTurn::slerp) return 0.0;
  return rotation_log(to.linear() * from.linear().transpose()).squaredNorm() / 8.0;
}

SecondDerivativeBound tool_motion_bound(const Pose& from, const Pose& to, ToolTurn turn,
                                        const Vec3& axis) {
  SecondDerivativeBound bound;
  bound.axis = turn_vector(from, to, turn, axis).squaredNorm();
  return bound;
}

Mat3 input_tool_rotation(const Vec3& tool_axis, std::optional<double> spin) {
  const Mat3 to_axis =
      Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), tool_axis).toRotationMatrix();
  return to_axis * rotation_about(Vec3::UnitZ(), -spin.value_or(0.0));
}

Pose tip_pose(const ScrewChain& chain, const JointVector& q, double tool_length) {
  Pose pose = forward(chain, q);
  pose.translation() -= tool_length * (pose.linear() * chain.tool_axis);
  return pose;
}

Pose holder_pose(const ScrewChain& chain, const Pose& tip, double tool_length) {
  Pose pose = tip;
  pose.translation() += tool_length * (pose.linear() * chain.tool_axis);
  return pose;
}

}  // namespace smoothpost
