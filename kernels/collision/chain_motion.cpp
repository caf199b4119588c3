#include "kernels/collision/chain_motion.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

/// A hair more than the arithmetic's own rounding: relative, and mm.
constexpr double kRelative = 1.0 + 1e-12;
constexpr double kAbsolute = 1e-10;

/// The joint before `joint` on its side, −1 for the base.
int inner_joint(const ScrewChain& chain, int joint) {
  const auto at = [&](int i) -> const ChainJoint& {
    return chain.joints[static_cast<std::size_t>(i)];
  };
  for (int i = joint - 1; i >= 0; --i)
    if (at(i).side == at(joint).side) return i;
  return -1;
}

struct RotaryStep {
  Vec3 axis = Vec3::UnitZ();  ///< with the step's sign
  Vec3 origin = Vec3::Zero();
  Mat3 turn = Mat3::Identity();  ///< at τ = ½
  double rate = 0.0;             ///< over the motion
};

/// A moving point at τ = ½ with what holds over the whole motion.
struct MovingPoint {
  Vec3 x = Vec3::Zero();
  Vec3 x1 = Vec3::Zero();  ///< dx/dτ
  double v = 0.0;
  double a = 0.0;

  void add(const Vec3& rate) {
    v += rate.norm();
    x1 += rate;
    v = std::min(v, x1.norm() + 0.5 * a);
  }
  /// Returns the largest distance from the axis during the motion.
  double turn(const RotaryStep& step) {
    const Vec3 y = step.turn * (x - step.origin);
    const double distance = step.axis.cross(y).norm() + 0.5 * v;
    if (step.rate != 0.0) {
      const double w = std::abs(step.rate);
      a += 2.0 * w * v + w * w * distance;
      v += w * distance;
    }
    x1 = step.turn * x1 + step.rate * step.axis.cross(y);
    x = step.origin + y;
    v = std::min(v, x1.norm() + 0.5 * a);
    return distance;
  }
};

}  // namespace

ChainPath path_between(const ScrewChain& chain, int first, int second) {
  require(first >= -1 && first < chain.size() && second >= -1 && second < chain.size(),
          "links of the chain");
  const auto inwards = [&](int joint) {
    std::vector<int> out;
    for (; joint >= 0; joint = inner_joint(chain, joint)) out.push_back(joint);
    return out;
  };
  std::vector<int> of_first = inwards(first);
  std::vector<int> of_second = inwards(second);
  while (!of_first.empty() && !of_second.empty() && of_first.back() == of_second.back()) {
    of_first.pop_back();
    of_second.pop_back();
  }
  ChainPath path;
  for (const int joint : of_first) path.push_back({joint, 1.0});
  for (auto it = of_second.rbegin(); it != of_second.rend(); ++it) path.push_back({*it, -1.0});
  return path;
}

LinkPoses link_poses(const ScrewChain& chain, const JointVector& q) {
  require(q.size() == chain.size() && chain.size() <= kMaxJoints, "one value per joint");
  LinkPoses poses;
  poses[0] = Pose::Identity();
  std::array<Pose, 2> outer = {Pose::Identity(), Pose::Identity()};
  for (int i = 0; i < chain.size(); ++i) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(i)];
    Pose& pose = outer[joint.side == ChainSide::tool ? 0 : 1];
    if (joint.kind == JointKind::linear) {
      pose.translation() += pose.linear() * (q[i] * joint.direction);
    } else {
      const Mat3 turn = rotation_about(joint.direction, q[i]);
      pose.translation() += pose.linear() * (joint.origin - turn * joint.origin);
      pose.linear() = (pose.linear() * turn).eval();
    }
    poses[static_cast<std::size_t>(i) + 1] = pose;
  }
  return poses;
}

double displacement(const std::vector<Ball>& balls, const Pose& from, const Pose& to) {
  const Mat3 turn = to.linear() - from.linear();
  const Vec3 shift = to.translation() - from.translation();
  const double spread = turn.norm() * std::sqrt(0.5);
  double out = 0.0;
  for (const Ball& ball : balls)
    out = std::max(out, (turn * ball.centre + shift).norm() + ball.radius * spread);
  return kRelative * out + kAbsolute;
}

MovementBound movement_bound(const ScrewChain& chain, const ChainPath& path,
                             const std::vector<Ball>& balls, const JointVector& from,
                             const JointVector& to) {
  require(from.size() == chain.size() && to.size() == chain.size(), "one value per joint");
  MovementBound out;
  out.lever = JointVector::Zero(chain.size());
  std::array<RotaryStep, kMaxJoints> steps;
  double spin = 0.0;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const int i = path[k].joint;
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(i)];
    if (joint.kind == JointKind::linear) {
      out.lever[i] = 1.0;
      continue;
    }
    const double middle = path[k].sign * (0.5 * from[i] + 0.5 * to[i]);
    steps[k] = {joint.direction, joint.origin, rotation_about(joint.direction, middle),
                path[k].sign * (to[i] - from[i])};
    spin += std::abs(to[i] - from[i]);
  }
  for (const Ball& ball : balls) {
    MovingPoint point;
    point.x = ball.centre;
    Vec3 pending = Vec3::Zero();
    for (std::size_t k = 0; k < path.size(); ++k) {
      const int i = path[k].joint;
      const ChainJoint& joint = chain.joints[static_cast<std::size_t>(i)];
      if (joint.kind == JointKind::linear) {
        point.x += path[k].sign * (0.5 * from[i] + 0.5 * to[i]) * joint.direction;
        pending += path[k].sign * (to[i] - from[i]) * joint.direction;
        continue;
      }
      point.add(pending);
      pending.setZero();
      const double lever = point.turn(steps[k]) + ball.radius;
      out.lever[i] = std::max(out.lever[i], kRelative * lever + kAbsolute);
    }
    point.add(pending);
    out.travel = std::max(out.travel, point.v + ball.radius * spin);
  }
  out.travel = kRelative * out.travel + kAbsolute;
  return out;
}

}  // namespace smoothpost
