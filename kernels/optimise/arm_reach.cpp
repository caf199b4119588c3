#include "kernels/optimise/arm_reach.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr double kInside = 1e-9;  // share of |U| + |V| that a nearest pose stays inside the border

/// The point of two lines nearest to both; they cross in a spherical wrist.
Vec3 crossing(const ChainJoint& a, const ChainJoint& b) {
  const double cosine = a.direction.dot(b.direction);
  const Vec3 between = b.origin - a.origin;
  const double along =
      (between.dot(a.direction) - cosine * between.dot(b.direction)) / (1.0 - cosine * cosine);
  return a.origin + along * a.direction;
}

}  // namespace

ArmReach::ArmReach(const SixR& arm) {
  const ScrewChain& chain = arm.chain();
  const auto& j = chain.joints;
  Mat3 base;
  base.col(2) = j[0].direction;
  base.col(1) = (j[1].direction - j[1].direction.dot(j[0].direction) * j[0].direction).normalized();
  base.col(0) = base.col(1).cross(base.col(2));
  to_arm_ = base.transpose() * chain.workpiece_home.linear();
  shift_ = base.transpose() * (chain.workpiece_home.translation() - j[0].origin);

  const Vec3 centre = crossing(j[3], j[4]);
  wrist_ = chain.tool_home.inverse() * centre;
  const Vec3 second = base.transpose() * (j[1].origin - j[0].origin);
  const Vec3 third = base.transpose() * (j[2].origin - j[0].origin);
  const Vec3 wrist = base.transpose() * (centre - j[0].origin);
  second_ = {second.z(), second.x()};
  up_ = {third.z() - second.z(), third.x() - second.x()};
  out_ = {wrist.z() - third.z(), wrist.x() - third.x()};
  front_ = second_.x < -1e-6 ? -1.0 : 1.0;
  offset_ = wrist.y();
  upper_ = std::hypot(up_.z, up_.x);
  fore_ = std::hypot(out_.z, out_.x);
  elbow_turn_ = j[1].direction.dot(j[2].direction) > 0.0 ? 1.0 : -1.0;
  // U × V about y, and with V a quarter turn on.
  bend_ = {(up_.z * out_.x - up_.x * out_.z) / (upper_ * fore_),
           elbow_turn_ * (up_.z * out_.z + up_.x * out_.x) / (upper_ * fore_)};
  const Vec3 &e4 = j[3].direction, &e5 = j[4].direction, &e6 = j[5].direction;
  hand_ = {e5.dot(e4.cross(e6)), e5.dot(e4.cross(e5.cross(e6)))};
}

ArmReach::Nearest ArmReach::nearest(const Pose& X_WT, int side) const {
  const Vec3 wrist = to_arm_ * (X_WT * wrist_) + shift_;
  const double radius = std::hypot(wrist.x(), wrist.y());
  const double sign = side == 0 ? front_ : -front_;
  const double inside = std::max(0.0, radius * radius - offset_ * offset_);
  const double beside = std::max(0.0, std::abs(offset_) - radius);
  const Planar reach{wrist.z() - second_.z, sign * std::sqrt(inside) - second_.x};
  const double distance = std::hypot(reach.z, reach.x);
  const double longest = length(), shortest = std::abs(upper_ - fore_);
  const double lack = std::max({0.0, distance - longest, shortest - distance}) + beside;
  Nearest out{lack / longest, X_WT};
  if (lack <= 0.0) return out;

  const double margin = kInside * longest;
  const double target = std::clamp(distance, shortest + margin, longest - margin);
  const double scale = distance > 0.0 ? target / distance : 0.0;
  const Planar moved{second_.z + (distance > 0.0 ? scale * reach.z : target),
                     second_.x + scale * reach.x};
  const double q1 = radius > 0.0 ? std::atan2(wrist.y(), wrist.x()) -
                                       std::atan2(offset_, sign * std::sqrt(inside))
                                 : 0.0;
  const Vec3 nearer(std::cos(q1) * moved.x - std::sin(q1) * offset_,
                    std::sin(q1) * moved.x + std::cos(q1) * offset_, moved.z);
  out.tool.translation() += to_arm_.transpose() * (nearer - wrist);
  return out;
}

double ArmReach::singular(const JointVector& q) const {
  const Posture p = posture(q);
  return std::min({p.elbow, p.wrist, p.shoulder});
}

ArmReach::Posture ArmReach::posture(const JointVector& q) const {
  require(q.size() == 6, "ArmReach: one value per joint");
  const double elbow = std::abs(bend_[0] * std::cos(q[2]) + bend_[1] * std::sin(q[2]));
  const double wrist = std::abs(hand_[0] * std::cos(q[4]) + hand_[1] * std::sin(q[4]));
  // X of the wrist centre: A + e^(iq2) (U + e^(i s q3) V).
  const double c3 = std::cos(q[2]), s3 = elbow_turn_ * std::sin(q[2]);
  const Planar span{up_.z + out_.z * c3 - out_.x * s3, up_.x + out_.z * s3 + out_.x * c3};
  const double x = second_.x + span.z * std::sin(q[1]) + span.x * std::cos(q[1]);
  return {wrist, elbow, std::min(1.0, std::abs(x) / length())};
}

Vec3 ArmReach::centre() const { return to_arm_.transpose() * (Vec3(0.0, 0.0, second_.z) - shift_); }

double ArmReach::radius() const {
  return std::hypot(std::abs(second_.x) + length(), offset_) + wrist_.norm();
}

}  // namespace smoothpost
