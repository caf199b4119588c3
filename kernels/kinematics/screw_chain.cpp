#include "kernels/kinematics/screw_chain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

/// Sine, cosine and 1 − cosine of an angle, the last one accurate near 0.
struct Turn {
  double sine = 0.0;
  double cosine = 1.0;
  double versine = 0.0;
};

Turn turn_of(double angle) {
  Turn turn;
  turn.sine = std::sin(angle);
  turn.cosine = std::cos(angle);
  turn.versine =
      turn.cosine > 0.0 ? turn.sine * turn.sine / (1.0 + turn.cosine) : 1.0 - turn.cosine;
  return turn;
}

/// v turned about the unit vector `axis` ([Yu2023] Eq. (A2), Rodrigues).
Vec3 turned(const Vec3& axis, const Turn& turn, const Vec3& v) {
  const Vec3 across = axis.cross(v);
  return v + turn.sine * across + turn.versine * axis.cross(across);
}

Mat3 matrix_of(const Vec3& axis, const Turn& turn) {
  Mat3 m;
  m.col(0) = turned(axis, turn, Vec3::UnitX());
  m.col(1) = turned(axis, turn, Vec3::UnitY());
  m.col(2) = turned(axis, turn, Vec3::UnitZ());
  return m;
}

/// pose ← e^[S]value · pose.
void apply_left(const ChainJoint& joint, double value, Pose& pose) {
  if (joint.kind == JointKind::linear) {
    pose.translation() += value * joint.direction;
    return;
  }
  const Mat3 rotation = matrix_of(joint.direction, turn_of(value));
  pose.linear() = (rotation * pose.linear()).eval();
  pose.translation() = joint.origin + rotation * (pose.translation() - joint.origin);
}

/// location ← e^[S]value · location.
void apply_left(const ChainJoint& joint, double value, CutterLocation& location) {
  if (joint.kind == JointKind::linear) {
    location.tip += value * joint.direction;
    return;
  }
  const Turn turn = turn_of(value);
  location.axis = turned(joint.direction, turn, location.axis);
  location.tip = joint.origin + turned(joint.direction, turn, location.tip - joint.origin);
}

/// Calls visit(joint index, sign of its screw) along the flattened chain from the tip to the
/// workpiece: tool joints from the last to the first, then workpiece joints from the first to the
/// last, negated.
template <typename Visit>
void from_tip_inwards(const ScrewChain& chain, const Visit& visit) {
  const int n = chain.size();
  for (int i = n - 1; i >= 0; --i)
    if (chain.joints[i].side == ChainSide::tool) visit(i, 1.0);
  for (int i = 0; i < n; ++i)
    if (chain.joints[i].side == ChainSide::workpiece) visit(i, -1.0);
}

/// A vector function of τ at τ = 1/2 with its derivatives, and bounds of them over τ ∈ [0, 1].
struct Motion {
  Vec3 x = Vec3::Zero();
  Vec3 x1 = Vec3::Zero();
  Vec3 x2 = Vec3::Zero();
  double v = 0.0;
  double a = 0.0;
  double j = 0.0;
};

struct RotaryRate {
  double rate = 0.0;     ///< rad over the motion
  double longest = 0.0;  ///< what the distance to the axis cannot exceed anyway
};

/// The recursion of second_derivative_bound() over one rotary joint; `x` counts from its origin.
void through_rotary(const Vec3& axis, const Turn& turn, const RotaryRate& rotary, Motion& m) {
  const Vec3 x = turned(axis, turn, m.x);
  const Vec3 w = rotary.rate * axis;
  const Vec3 wx = w.cross(x);
  if (rotary.rate != 0.0) {
    const double speed = std::abs(rotary.rate);
    const double distance = std::min(axis.cross(x).norm() + 0.5 * m.v, rotary.longest);
    m.j += 3.0 * speed * m.a + 3.0 * speed * speed * m.v + speed * speed * speed * distance;
    m.a += 2.0 * speed * m.v + speed * speed * distance;
    m.v += speed * distance;
  }
  const Vec3 x1 = turned(axis, turn, m.x1);
  m.x2 = turned(axis, turn, m.x2) + 2.0 * w.cross(x1) + w.cross(wx);
  m.x1 = x1 + wx;
  m.x = x;
  m.a = std::min(m.a, m.x2.norm() + 0.5 * m.j);
  m.v = std::min(m.v, m.x1.norm() + 0.5 * m.a);
}

}  // namespace

Pose forward(const ScrewChain& chain, const JointVector& q) {
  require(q.size() == chain.size(), "one value per joint");
  Pose pose = chain.tool_home;
  from_tip_inwards(chain,
                   [&](int i, double sign) { apply_left(chain.joints[i], sign * q[i], pose); });
  return chain.workpiece_home.inverse() * pose;
}

CutterLocation forward_location(const ScrewChain& chain, const JointVector& q) {
  require(q.size() == chain.size(), "one value per joint");
  CutterLocation location;
  location.tip = chain.tool_home.translation();
  location.axis = chain.tool_home.linear() * chain.tool_axis;
  from_tip_inwards(chain,
                   [&](int i, double sign) { apply_left(chain.joints[i], sign * q[i], location); });
  const auto to_workpiece = chain.workpiece_home.linear().transpose();
  location.tip = to_workpiece * (location.tip - chain.workpiece_home.translation());
  location.axis = to_workpiece * location.axis;
  return location;
}

Jacobian jacobian(const ScrewChain& chain, const JointVector& q) {
  require(q.size() == chain.size(), "one value per joint");
  // From the tip inwards: when joint i is met, the columns after it are turned by it and the tip is
  // carried along, so each column ends up seen from the workpiece.
  const int n = chain.size();
  Jacobian columns = Jacobian::Zero(6, n);
  std::array<int, kMaxJoints> met{};
  int count = 0;
  Vec3 tip = chain.tool_home.translation();
  from_tip_inwards(chain, [&](int i, double sign) {
    const ChainJoint& joint = chain.joints[i];
    const Vec3 direction = sign * joint.direction;
    if (joint.kind == JointKind::linear) {
      tip += q[i] * direction;
      columns.col(i).tail<3>() = direction;
    } else {
      const Mat3 rotation = matrix_of(joint.direction, turn_of(sign * q[i]));
      tip = joint.origin + rotation * (tip - joint.origin);
      for (int k = 0; k < count; ++k) {
        columns.col(met[k]).head<3>() = (rotation * columns.col(met[k]).head<3>()).eval();
        columns.col(met[k]).tail<3>() = (rotation * columns.col(met[k]).tail<3>()).eval();
      }
      columns.col(i).head<3>() = direction;
      columns.col(i).tail<3>() = direction.cross(tip - joint.origin);
    }
    met[count++] = i;
  });
  const Mat3 to_workpiece = chain.workpiece_home.linear().transpose();
  for (int i = 0; i < n; ++i) {
    columns.col(i).head<3>() = (to_workpiece * columns.col(i).head<3>()).eval();
    columns.col(i).tail<3>() = (to_workpiece * columns.col(i).tail<3>()).eval();
  }
  return columns;
}

SecondDerivativeBound second_derivative_bound(const ScrewChain& chain, const JointVector& from,
                                              const JointVector& to) {
  require(from.size() == chain.size() && to.size() == chain.size(), "one value per joint");
  Motion tip;
  Motion axis;
  tip.x = chain.tool_home.translation();
  axis.x = chain.tool_home.linear() * chain.tool_axis;
  // Neighbouring linear joints move along one straight line: their rates are added as a vector
  // first.
  Vec3 pending = Vec3::Zero();
  from_tip_inwards(chain, [&](int i, double sign) {
    const ChainJoint& joint = chain.joints[i];
    const double value = sign * (0.5 * from[i] + 0.5 * to[i]);
    const double rate = sign * (to[i] - from[i]);
    if (joint.kind == JointKind::linear) {
      tip.x += value * joint.direction;
      pending += rate * joint.direction;
      return;
    }
    tip.v += pending.norm();
    tip.x1 += pending;
    tip.v = std::min(tip.v, tip.x1.norm() + 0.5 * tip.a);
    pending.setZero();
    tip.x -= joint.origin;
    const Turn turn = turn_of(value);
    through_rotary(joint.direction, turn, {rate, std::numeric_limits<double>::infinity()}, tip);
    tip.x += joint.origin;
    through_rotary(joint.direction, turn, {rate, 1.0}, axis);
  });
  // A hair more than the arithmetic's own rounding.
  constexpr double kRoundOff = 1.0 + 1e-12;
  return {kRoundOff * tip.a, kRoundOff * axis.a};
}

}  // namespace smoothpost
