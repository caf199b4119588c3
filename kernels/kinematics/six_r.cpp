#include "kernels/kinematics/six_r.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kParallel = 1e-9;       // of unit vectors
constexpr double kCrossing = 1e-9;       // mm
constexpr double kShortest = 1e-6;       // mm
constexpr double kNearAxis = 1e-10;      // mm
constexpr double kNearStraight = 1e-12;  // rad
constexpr int kShoulderBit = 1;
constexpr int kElbowBit = 2;
constexpr int kWristBit = 4;

/// A sum of two angles in [−π, π], in (−π, π].
double wrapped(double angle) {
  if (angle > kPi) return angle - 2.0 * kPi;
  if (angle <= -kPi) return angle + 2.0 * kPi;
  return angle;
}

/// Length of a plane vector; mm, so no overflow is near.
double length_of(double x, double y) { return std::sqrt(x * x + y * y); }

bool perpendicular(const Vec3& a, const Vec3& b) { return std::abs(a.dot(b)) < kParallel; }

bool six_rotaries_on_the_tool_side(const ScrewChain& chain) {
  return chain.size() == 6 &&
         std::all_of(chain.joints.begin(), chain.joints.end(), [](const ChainJoint& joint) {
           return joint.kind == JointKind::rotary && joint.side == ChainSide::tool;
         });
}

bool ortho_parallel(const std::vector<ChainJoint>& j) {
  return perpendicular(j[0].direction, j[1].direction) &&
         j[1].direction.cross(j[2].direction).norm() < kParallel &&
         perpendicular(j[2].direction, j[3].direction) &&
         perpendicular(j[3].direction, j[4].direction) &&
         perpendicular(j[4].direction, j[5].direction);
}

/// Distance of a point to a joint's axis, mm.
double distance_to(const ChainJoint& joint, const Vec3& point) {
  return joint.direction.cross(point - joint.origin).norm();
}

/// Where the perpendicular axes of two joints come nearest to each other: a point of the first.
Vec3 crossing_of(const ChainJoint& first, const ChainJoint& second) {
  return first.origin + first.direction.dot(second.origin - first.origin) * first.direction;
}

}  // namespace

/// The target in F, and the wrist's rotation behind the arm.
struct SixR::Target {
  Vec3 wrist = Vec3::Zero();
  Mat3 rotation = Mat3::Identity();
};

/// The first joint, and what the arm has to reach from the second axis.
struct SixR::Shoulder {
  bool valid = false;
  bool singular = false;
  double q1 = 0.0;
  double cosine = 1.0;
  double sine = 0.0;
  Planar reach;           ///< Z + iX − A
  double distance = 0.0;  ///< D
};

/// The triangle |U|, |V|, D; the same for both elbows but for the sign of γ.
struct SixR::Elbow {
  bool valid = false;
  bool singular = false;
  double gamma = 0.0;
  double cosine = 1.0;
  double sine = 0.0;
  Planar span;          ///< (|U| + |V| e^(iγ)), for +γ
  double length = 0.0;  ///< |span|
};

/// One choice of shoulder and elbow.
struct SixR::Arm {
  double q2 = 0.0;
  double q3 = 0.0;
  Planar turn;  ///< e^(i(q2 + s q3 + η))
};

std::optional<SixR> SixR::from(const ScrewChain& chain) {
  if (!six_rotaries_on_the_tool_side(chain) || !ortho_parallel(chain.joints)) return std::nullopt;
  SixR arm;
  arm.chain_ = chain;
  if (!arm.set_arm() || !arm.set_wrist()) return std::nullopt;
  return arm;
}

bool SixR::set_arm() {
  const auto& j = chain_.joints;
  base_.col(2) = j[0].direction;
  base_.col(1) =
      (j[1].direction - j[1].direction.dot(j[0].direction) * j[0].direction).normalized();
  base_.col(0) = base_.col(1).cross(base_.col(2));
  to_arm_ = base_.transpose() * chain_.workpiece_home.linear();
  shift_ = base_.transpose() * (chain_.workpiece_home.translation() - j[0].origin);

  const Vec3 second = base_.transpose() * (j[1].origin - j[0].origin);
  const Vec3 third = base_.transpose() * (j[2].origin - j[0].origin);
  const Vec3 wrist = base_.transpose() * (crossing_of(j[3], j[4]) - j[0].origin);
  const Planar upper{third.z() - second.z(), third.x() - second.x()};
  const Planar fore{wrist.z() - third.z(), wrist.x() - third.x()};
  second_ = {second.z(), second.x()};
  front_ = second_.x < -kShortest ? -1.0 : 1.0;
  offset_ = wrist.y();
  upper_length_ = std::hypot(upper.z, upper.x);
  fore_length_ = std::hypot(fore.z, fore.x);
  if (upper_length_ < kShortest || fore_length_ < kShortest) return false;
  upper_ = {upper.z / upper_length_, upper.x / upper_length_};
  const Planar forward{fore.z / fore_length_, fore.x / fore_length_};
  bend_ = forward * Planar{upper_.z, -upper_.x};
  bend_angle_ = std::atan2(bend_.x, bend_.z);
  elbow_sign_ = j[1].direction.dot(j[2].direction) > 0.0 ? 1.0 : -1.0;
  return true;
}

bool SixR::set_wrist() {
  const auto& j = chain_.joints;
  const Vec3 centre = crossing_of(j[3], j[4]);
  if (distance_to(j[4], centre) > kCrossing || distance_to(j[5], centre) > kCrossing) return false;
  wrist_ = chain_.tool_home.inverse() * centre;

  Mat3 frame;  // z = e4, y = e5
  frame.col(2) = j[3].direction;
  frame.col(1) =
      (j[4].direction - j[4].direction.dot(j[3].direction) * j[3].direction).normalized();
  frame.col(0) = frame.col(1).cross(frame.col(2));
  const Mat3 seen = base_.transpose() * frame;  // Ry(η) Rz(ε)
  const double length = std::hypot(seen(2, 2), seen(0, 2));
  fore_ = {seen(2, 2) / length, seen(0, 2) / length};
  fourth_ = std::atan2(seen(1, 0), seen(1, 1));
  const Vec3 sixth = frame.transpose() * j[5].direction;
  fifth_ = std::atan2(sixth.x(), sixth.z());
  hand_ = chain_.tool_home.linear().transpose() * frame *
          Eigen::AngleAxisd(fifth_, Vec3::UnitY()).toRotationMatrix();
  return true;
}

SixR::Target SixR::target_of(const Pose& X_WT) const {
  Target target;
  const Mat3 tool = to_arm_ * X_WT.linear();
  target.rotation.noalias() = tool * hand_;
  target.wrist = to_arm_ * X_WT.translation() + tool * wrist_ + shift_;
  return target;
}

SixR::Shoulder SixR::shoulder_of(const Vec3& wrist, double side, double near) const {
  Shoulder shoulder;
  const double radius = length_of(wrist.x(), wrist.y());
  const double b = std::abs(offset_);
  if (!(radius >= b - kNearAxis)) return shoulder;
  const double x = side * std::sqrt(std::max(radius - b, 0.0) * (radius + b));
  shoulder.valid = true;
  shoulder.singular = radius <= kNearAxis;
  if (shoulder.singular) {
    shoulder.q1 = wrapped(std::remainder(near, 2.0 * kPi));
    shoulder.cosine = std::cos(near);
    shoulder.sine = std::sin(near);
  } else {
    const double along = wrist.x() * x + wrist.y() * offset_;
    const double across = wrist.y() * x - wrist.x() * offset_;
    const double length = length_of(along, across);
    shoulder.cosine = along / length;
    shoulder.sine = across / length;
    shoulder.q1 = wrapped(std::atan2(across, along));
  }
  shoulder.reach = {wrist.z() - second_.z, x - second_.x};
  shoulder.distance = length_of(shoulder.reach.z, shoulder.reach.x);
  return shoulder;
}

SixR::Elbow SixR::elbow_of(const Shoulder& shoulder) const {
  Elbow elbow;
  const double sum = upper_length_ + fore_length_;
  const double gap = std::abs(upper_length_ - fore_length_);
  const double d = shoulder.distance;
  if (!(d <= sum + kNearAxis && d >= gap - kNearAxis)) return elbow;
  const double p = std::max(sum - d, 0.0) * (sum + d);
  const double q = std::max(d - gap, 0.0) * (d + gap);
  elbow.valid = true;
  elbow.cosine = (q - p) / (p + q);
  elbow.sine = 2.0 * std::sqrt(p * q) / (p + q);
  elbow.gamma = std::atan2(elbow.sine, elbow.cosine);
  elbow.span = {upper_length_ - fore_length_ + fore_length_ * (2.0 * q / (p + q)),
                fore_length_ * elbow.sine};
  elbow.length = length_of(elbow.span.z, elbow.span.x);
  elbow.singular = d <= kNearAxis;
  return elbow;
}

SixR::Arm SixR::arm_of(const Shoulder& shoulder, const Elbow& elbow, double bend,
                       double near) const {
  Arm arm;
  Planar second;
  if (elbow.singular) {
    arm.q2 = wrapped(std::remainder(near, 2.0 * kPi));
    second = {std::cos(near), std::sin(near)};
  } else {
    const Planar span = upper_ * Planar{elbow.span.z, bend * elbow.span.x};
    const Planar turn = shoulder.reach * Planar{span.z, -span.x};
    const double length = shoulder.distance * elbow.length;
    second = {turn.z / length, turn.x / length};
    arm.q2 = wrapped(std::atan2(turn.x, turn.z));
  }
  arm.q3 = wrapped(elbow_sign_ * (bend * elbow.gamma - bend_angle_));
  const Planar third = Planar{elbow.cosine, bend * elbow.sine} * Planar{bend_.z, -bend_.x};
  arm.turn = second * third * fore_;
  return arm;
}

bool SixR::solve_wrist(const Mat3& rotation, const Arm& arm, double near, JointVector& plain,
                       JointVector& flipped) const {
  // n = Ry(−ψ)·rotation = Rz(q4+ε) Ry(q5+δ) Rz(q6)
  const Eigen::RowVector3d n0 = arm.turn.z * rotation.row(0) - arm.turn.x * rotation.row(2);
  const auto n1 = rotation.row(1);
  const double n22 = arm.turn.x * rotation(0, 2) + arm.turn.z * rotation(2, 2);
  double bend = length_of(n0[2], n1[2]);
  double cosine = 1.0;
  double sine = 0.0;
  const bool singular = bend < kNearStraight;
  double fourth = near;
  if (singular) {
    cosine = std::cos(near + fourth_);
    sine = std::sin(near + fourth_);
    bend = cosine * n0[2] + sine * n1[2];
  } else {
    cosine = n0[2] / bend;
    sine = n1[2] / bend;
    fourth = wrapped(std::atan2(n1[2], n0[2]) - fourth_);
  }
  const double fifth = std::atan2(bend, n22);
  const double sixth =
      wrapped(std::atan2(cosine * n1[0] - sine * n0[0], cosine * n1[1] - sine * n0[1]));
  plain[3] = singular ? wrapped(std::remainder(fourth, 2.0 * kPi)) : fourth;
  plain[4] = wrapped(fifth - fifth_);
  plain[5] = sixth;
  flipped = plain;
  if (singular) return true;
  flipped[3] = fourth > 0.0 ? fourth - kPi : fourth + kPi;
  flipped[4] = wrapped(-fifth - fifth_);
  flipped[5] = sixth > 0.0 ? sixth - kPi : sixth + kPi;
  return false;
}

SixRSolutions SixR::solve(const Pose& X_WT, const JointVector& near) const {
  require(near.size() == 6, "one value per joint");
  SixRSolutions solutions;
  const Target target = target_of(X_WT);
  for (int back = 0; back < 2; ++back) {
    const Shoulder shoulder = shoulder_of(target.wrist, back == 0 ? front_ : -front_, near[0]);
    if (!shoulder.valid) continue;
    solutions.shoulder_singular = solutions.shoulder_singular || shoulder.singular;
    const Elbow elbow = elbow_of(shoulder);
    if (!elbow.valid) continue;
    solutions.elbow_singular = solutions.elbow_singular || elbow.singular;
    Mat3 rotation;
    rotation.row(0) =
        shoulder.cosine * target.rotation.row(0) + shoulder.sine * target.rotation.row(1);
    rotation.row(1) =
        shoulder.cosine * target.rotation.row(1) - shoulder.sine * target.rotation.row(0);
    rotation.row(2) = target.rotation.row(2);
    for (int down = 0; down < 2; ++down) {
      const Arm arm = arm_of(shoulder, elbow, down == 0 ? 1.0 : -1.0, near[1]);
      const int branch = back * kShoulderBit + down * kElbowBit;
      JointVector& plain = solutions.q[branch];
      JointVector& flipped = solutions.q[branch + kWristBit];
      plain.resize(6);
      plain[0] = shoulder.q1;
      plain[1] = arm.q2;
      plain[2] = arm.q3;
      solutions.wrist_singular[branch] = solve_wrist(rotation, arm, near[3], plain, flipped);
      solutions.valid[branch] = true;
      solutions.valid[branch + kWristBit] = true;
    }
  }
  return solutions;
}

SixRSolutions SixR::solve(const Pose& X_WT) const { return solve(X_WT, JointVector::Zero(6)); }

int SixR::branch_of(const JointVector& q) const {
  require(q.size() == 6, "one value per joint");
  const auto turn = [](double angle) { return Planar{std::cos(angle), std::sin(angle)}; };
  const Planar bent = turn(elbow_sign_ * q[2]) * bend_;  // e^(iγ)
  const Planar span{upper_length_ + fore_length_ * bent.z, fore_length_ * bent.x};
  const double x = second_.x + (turn(q[1]) * upper_ * span).x;
  return (front_ * x < 0.0 ? kShoulderBit : 0) + (bent.x < 0.0 ? kElbowBit : 0) +
         (std::sin(q[4] + fifth_) < 0.0 ? kWristBit : 0);
}

}  // namespace smoothpost
