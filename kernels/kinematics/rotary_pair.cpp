#include "kernels/kinematics/rotary_pair.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {
namespace {

// An axis closer to the pole than this (as a sine) leaves the first rotary free; a hair less than
// 1e-9 so that a tilt of 1e-9 rad itself is solved.
constexpr double kPoleSine = 1e-9 * (1.0 - 1e-9);
// An axis beyond reach by no more than this (rad) takes the nearest reachable one.
constexpr double kReach = 1e-12;
// Angles between directions of the machine file below this (rad) are rounding.
constexpr double kRounding = 1e-14;
// Least |determinant| of three unit directions, and least sine between rotaries or to the tool.
constexpr double kIndependent = 1e-6;

/// The angle's representative in (−π, π].
double wrapped(double angle) {
  if (angle > kPi) return angle - 2.0 * kPi;
  if (angle <= -kPi) return angle + 2.0 * kPi;
  return angle;
}

Vec3 turned_about_z(double cosine, double sine, const Vec3& v) {
  return Vec3(cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y(), v.z());
}

/// The flattened chain with the held rotaries folded into the screws behind them:
/// e^[S]h · e^[S_i]q = e^[Ad S_i]q · e^[S]h.
struct Flattened {
  struct Joint {
    int joint = 0;
    JointKind kind = JointKind::linear;
    bool held = false;
    Vec3 direction;
    Vec3 origin;
  };
  std::vector<Joint> joints;  ///< free joints and held linears, from the workpiece to the tool
  Vec3 tip;
  Vec3 axis;
};

Flattened flatten(const ScrewChain& chain, const JointVector& held) {
  Flattened out;
  Pose before = Pose::Identity();
  const auto add = [&](int i, double sign) {
    const ChainJoint& joint = chain.joints[i];
    const Vec3 direction = before.linear() * (sign * joint.direction);
    const Vec3 origin = before * joint.origin;
    if (joint.kind == JointKind::rotary && joint.redundant) {
      const Mat3 rotation = rotation_about(direction.normalized(), held[i]);
      before.translation() = origin + rotation * (before.translation() - origin);
      before.linear() = (rotation * before.linear()).eval();
      return;
    }
    out.joints.push_back({i, joint.kind, joint.redundant, direction, origin});
  };
  for (int i = chain.size() - 1; i >= 0; --i)
    if (chain.joints[i].side == ChainSide::workpiece) add(i, -1.0);
  for (int i = 0; i < chain.size(); ++i)
    if (chain.joints[i].side == ChainSide::tool) add(i, 1.0);
  out.tip = before * Vec3(chain.tool_home.translation());
  out.axis = before.linear() * (chain.tool_home.linear() * chain.tool_axis);
  return out;
}

}  // namespace

struct RotaryPair::Rotation {
  double cosine1 = 1.0;  ///< of the first rotary about ẑ
  double sine1 = 0.0;
  double cosine2 = 1.0;  ///< of the second rotary from β0
  double sine2 = 0.0;
  double versine2 = 0.0;
};

/// The tool axis in F and how the second rotary reaches it.
struct RotaryPair::Reach {
  Vec3 axis = Vec3::UnitZ();
  bool possible = false;
  bool at_pole = false;
  double p = 0.0;
  double q = 0.0;
};

namespace {

/// Directions of the linears in F, by group; false when free ones of one group are dependent.
template <typename Geometry>
bool place_linears(const Flattened& flat, const std::array<Mat3, 3>& to_frame, Geometry& g) {
  std::size_t group = 0;
  std::size_t count = 0;
  for (const Flattened::Joint& joint : flat.joints) {
    if (joint.kind == JointKind::rotary) {
      ++group;
      continue;
    }
    const Vec3 direction = to_frame[group] * joint.direction;
    if (joint.held)
      g.held.push_back({joint.joint, static_cast<int>(group), direction});
    else
      g.free[count++] = {joint.joint, static_cast<int>(group), direction};
  }
  const bool one_group = g.free[0].group == g.free[2].group;
  g.group = one_group ? g.free[0].group : -1;
  if (!one_group) return true;
  Mat3 directions;
  for (int i = 0; i < 3; ++i) directions.col(i) = g.free[i].direction;
  if (std::abs(directions.determinant()) < kIndependent) return false;
  g.inverse = directions.inverse();
  return true;
}

/// v turned about e2 = (sine, 0, cosine) of the geometry; `direction` −1 turns it back.
template <typename Geometry, typename Rotation>
Vec3 turned_about_second(const Geometry& g, const Rotation& r, double direction, const Vec3& v) {
  const double s = direction * r.sine2;
  const double along = r.versine2 * (g.sine * v.x() + g.cosine * v.z());
  return Vec3(r.cosine2 * v.x() - s * g.cosine * v.y() + along * g.sine,
              r.cosine2 * v.y() + s * (g.cosine * v.x() - g.sine * v.z()),
              r.cosine2 * v.z() + s * g.sine * v.y() + along * g.cosine);
}

}  // namespace

std::optional<RotaryPair> RotaryPair::from(const ScrewChain& chain) {
  RotaryPair pair;
  int rotaries = 0;
  int linears = 0;
  for (const ChainJoint& joint : chain.joints) {
    if (joint.redundant) {
      pair.held_rotary_ = pair.held_rotary_ || joint.kind == JointKind::rotary;
      continue;
    }
    (joint.kind == JointKind::rotary ? rotaries : linears) += 1;
  }
  if (rotaries != 2 || linears != 3 || chain.size() > kMaxJoints) return std::nullopt;
  pair.chain_ = chain;
  JointVector held = JointVector::Zero(chain.size());
  std::optional<Geometry> geometry = geometry_of(chain, held);
  if (!geometry && pair.held_rotary_) {
    for (int i = 0; i < chain.size(); ++i) held[i] = chain.joints[i].home;
    geometry = geometry_of(chain, held);
  }
  if (!geometry || !linears_independent(*geometry)) return std::nullopt;
  pair.geometry_ = *geometry;
  bool found_first = false;
  for (const Flattened::Joint& joint : flatten(chain, held).joints) {
    if (joint.kind != JointKind::rotary) continue;
    (found_first ? pair.second_ : pair.first_) = joint.joint;
    found_first = true;
  }
  return pair;
}

std::optional<RotaryPair::Geometry> RotaryPair::geometry_of(const ScrewChain& chain,
                                                            const JointVector& held) {
  const Flattened flat = flatten(chain, held);
  std::array<const Flattened::Joint*, 2> rotary{nullptr, nullptr};
  for (const Flattened::Joint& joint : flat.joints) {
    if (joint.kind != JointKind::rotary) continue;
    (rotary[0] == nullptr ? rotary[0] : rotary[1]) = &joint;
  }
  Geometry g;
  const Vec3& e1 = rotary[0]->direction;
  const Vec3& e2 = rotary[1]->direction;
  g.sign = e1.dot(flat.axis) < -1e-9 ? -1.0 : 1.0;
  const Vec3 z = g.sign * e1;
  g.cosine = z.dot(e2);
  const Vec3 x = e2 - g.cosine * z;
  g.sine = x.norm();
  const double along = e2.dot(flat.axis);  // cos θm
  const Vec3 across = e2.cross(flat.axis);
  g.sine_tool = across.norm();
  if (g.sine < kIndependent || g.sine_tool < kIndependent) return std::nullopt;

  const double theta_k = std::atan2(g.sine, g.cosine);
  const double theta_m = std::atan2(g.sine_tool, along);
  const auto unless_rounding = [](double angle) {
    return std::abs(angle) < kRounding ? 0.0 : angle;
  };
  const double gap = unless_rounding(theta_k - theta_m);
  const double far = unless_rounding(kPi - theta_k - theta_m);
  g.near_gap = std::abs(gap);
  g.far_gap = std::abs(far);
  g.sine_gap = std::sin(gap);
  g.near_versine = 2.0 * std::sin(0.5 * gap) * std::sin(0.5 * gap);
  g.far_versine = 2.0 * std::sin(0.5 * far) * std::sin(0.5 * far);
  g.offset = std::atan2(z.dot(across), z.dot(flat.axis - along * e2));
  g.offset = wrapped(unless_rounding(g.offset));

  Mat3 to_frame;
  to_frame.row(0) = x / g.sine;
  to_frame.row(1) = z.cross(x / g.sine);
  to_frame.row(2) = z;
  g.rotation = to_frame * chain.workpiece_home.linear();
  const Vec3 origin = rotary[0]->origin;
  g.shift = to_frame * (chain.workpiece_home.translation() - origin);
  g.second_origin = to_frame * (rotary[1]->origin - origin);

  // Behind the second rotary everything is taken as it lies at β0.
  Mat3 behind = to_frame;
  if (g.offset != 0.0) behind = to_frame * rotation_about(e2.normalized(), g.offset);
  g.tip = behind * (flat.tip - rotary[1]->origin);
  if (!place_linears(flat, {to_frame, to_frame, behind}, g)) return std::nullopt;
  return g;
}

bool RotaryPair::linears_independent(const Geometry& g) {
  if (g.group >= 0) return true;
  // Linears on both sides of a rotary: independent at some rotary angles is what can be asked for
  // here.
  for (const double first : {0.3, 1.1, 2.3, -0.9}) {
    for (const double second : {0.4, -1.0, 1.7, 2.6}) {
      const Rotation r{std::cos(first), std::sin(first), std::cos(second), std::sin(second),
                       1.0 - std::cos(second)};
      JointVector q = JointVector::Zero(kMaxJoints);
      if (solve_linears(g, r, Vec3::Zero(), q)) return true;
    }
  }
  return false;
}

/// P and Q of the class comment from chords: 1 ∓ cos θa = |axis ∓ ẑ|²/2 keeps the relative accuracy
/// at both poles, where 1 − cos would have lost it.
RotaryPair::Reach RotaryPair::reach_of(const Geometry& g, const Vec3& axis) {
  const double norm2 = axis.squaredNorm();
  require(std::abs(norm2 - 1.0) < 2e-6, "tool axis has unit length");
  Reach reach;
  reach.axis = g.rotation * (axis / std::sqrt(norm2));
  const double r2 = reach.axis.x() * reach.axis.x() + reach.axis.y() * reach.axis.y();
  const double z = reach.axis.z();
  reach.p = 0.5 * (r2 + (z - 1.0) * (z - 1.0)) - g.near_versine;
  reach.q = 0.5 * (r2 + (z + 1.0) * (z + 1.0)) - g.far_versine;
  reach.at_pole = r2 < kPoleSine * kPoleSine;
  reach.possible = reach.p >= 0.0 && reach.q >= 0.0;
  if (!reach.possible) {
    // Beyond the boundary: by how much, as an angle.
    const double theta = std::atan2(std::sqrt(r2), z);
    reach.possible = g.near_gap - theta <= kReach && theta - (kPi - g.far_gap) <= kReach;
    reach.p = std::max(reach.p, 0.0);
    reach.q = std::max(reach.q, 0.0);
  }
  if (reach.at_pole && reach.possible) {
    reach.possible = (z > 0.0 ? g.near_gap : g.far_gap) <= kReach + std::sqrt(r2);
    reach.p = z > 0.0 ? 0.0 : 2.0;
    reach.q = 2.0 - reach.p;
  }
  return reach;
}

bool RotaryPair::solve_linears(const Geometry& g, const Rotation& r, const Vec3& tip,
                               JointVector& q) {
  // tip_F = D0 x0 + Rz (D1 x1 + o2 + R2 (D2 x2 + t)); held linears are known x.
  Vec3 target = g.rotation * tip + g.shift;
  Vec3 middle = g.second_origin;
  Vec3 last = g.tip;
  for (const Linear& held : g.held) {
    if (held.group == 0) target -= q[held.joint] * held.direction;
    if (held.group == 1) middle += q[held.joint] * held.direction;
    if (held.group == 2) last += q[held.joint] * held.direction;
  }
  Vec3 x;
  if (g.group == 0) {
    const Vec3 arm = middle + turned_about_second(g, r, 1.0, last);
    x = g.inverse * (target - turned_about_z(r.cosine1, r.sine1, arm));
  } else if (g.group == 1) {
    x = g.inverse * (turned_about_z(r.cosine1, -r.sine1, target) - middle -
                     turned_about_second(g, r, 1.0, last));
  } else if (g.group == 2) {
    const Vec3 arm = turned_about_z(r.cosine1, -r.sine1, target) - middle;
    x = g.inverse * (turned_about_second(g, r, -1.0, arm) - last);
  } else {
    Mat3 directions;
    for (int i = 0; i < 3; ++i) {
      Vec3 d = g.free[i].direction;
      if (g.free[i].group == 2) d = turned_about_second(g, r, 1.0, d);
      if (g.free[i].group >= 1) d = turned_about_z(r.cosine1, r.sine1, d);
      directions.col(i) = d;
    }
    if (std::abs(directions.determinant()) < kIndependent) return false;
    const Vec3 arm = middle + turned_about_second(g, r, 1.0, last);
    x = directions.inverse() * (target - turned_about_z(r.cosine1, r.sine1, arm));
  }
  for (int i = 0; i < 3; ++i) q[g.free[i].joint] = x[i];
  return true;
}

RotaryPairSolutions RotaryPair::solve(const CutterLocation& location,
                                      const JointVector& held) const {
  require(held.size() == chain_.size(), "one held value per joint");
  std::optional<Geometry> at_held;
  if (held_rotary_) at_held = geometry_of(chain_, held);
  RotaryPairSolutions out;
  out.q = {held, held};
  if (held_rotary_ && !at_held) return out;
  const Geometry& g = held_rotary_ ? *at_held : geometry_;
  const Reach reach = reach_of(g, location.axis);
  out.at_pole = reach.at_pole;
  if (!reach.possible) return out;

  const double sum = reach.p + reach.q;  // 2 sin θk sin θm
  const double delta = 2.0 * std::atan2(std::sqrt(reach.p), std::sqrt(reach.q));
  const double sine = 2.0 * std::sqrt(reach.p * reach.q) / sum;
  Rotation r;
  r.cosine2 = (reach.q - reach.p) / sum;
  r.versine2 = 2.0 * reach.p / sum;
  if (reach.at_pole) {
    r.cosine1 = std::cos(g.sign * held[first_]);
    r.sine1 = std::sin(g.sign * held[first_]);
  }
  // The tool axis with the first rotary at 0 is (bx, ∓by, ·).
  const double bx = g.sine_gap + g.sine_tool * g.cosine * r.versine2;
  const double by = g.sine_tool * sine;
  for (int branch = 0; branch < 2; ++branch) {
    const double side = branch == 0 ? 1.0 : -1.0;
    r.sine2 = side * sine;
    JointVector& q = out.q[branch];
    q[second_] = wrapped(g.offset + side * delta);
    if (reach.at_pole) {
      q[first_] = wrapped(std::remainder(held[first_], 2.0 * kPi));
    } else {
      const double y = bx * reach.axis.y() + side * by * reach.axis.x();
      const double x = bx * reach.axis.x() - side * by * reach.axis.y();
      const double length = std::sqrt(x * x + y * y);
      r.cosine1 = x / length;
      r.sine1 = y / length;
      q[first_] = wrapped(g.sign * std::atan2(y, x));
    }
    out.valid[branch] = solve_linears(g, r, location.tip, q);
  }
  return out;
}

std::optional<JointVector> RotaryPair::with_linears(const Vec3& tip, const JointVector& q) const {
  require(q.size() == chain_.size(), "one value per joint");
  std::optional<Geometry> at_held;
  if (held_rotary_) at_held = geometry_of(chain_, q);
  if (held_rotary_ && !at_held) return std::nullopt;
  const Geometry& g = held_rotary_ ? *at_held : geometry_;
  const double first = g.sign * q[first_];
  const double second = q[second_] - g.offset;
  const double half = std::sin(0.5 * second);
  const Rotation r{std::cos(first), std::sin(first), std::cos(second), std::sin(second),
                   2.0 * half * half};
  JointVector out = q;
  if (!solve_linears(g, r, tip, out)) return std::nullopt;
  return out;
}

std::optional<RotaryPole> RotaryPair::nearest_pole(const Vec3& axis,
                                                   const JointVector& held) const {
  require(held.size() == chain_.size(), "one held value per joint");
  std::optional<Geometry> at_held;
  if (held_rotary_) at_held = geometry_of(chain_, held);
  if (held_rotary_ && !at_held) return std::nullopt;
  const Geometry& g = held_rotary_ ? *at_held : geometry_;
  const bool near = g.near_gap <= kReach;
  const bool far = g.far_gap <= kReach;
  if (!near && !far) return std::nullopt;
  const Vec3 a = g.rotation * axis;
  const bool take_near = near && (a.z() >= 0.0 || !far);
  RotaryPole pole;
  pole.axis = (take_near ? 1.0 : -1.0) * g.rotation.row(2).transpose();
  pole.second = take_near ? g.offset : wrapped(g.offset + kPi);
  pole.angle = std::atan2(std::sqrt(a.x() * a.x() + a.y() * a.y()), take_near ? a.z() : -a.z());
  return pole;
}

}  // namespace smoothpost
