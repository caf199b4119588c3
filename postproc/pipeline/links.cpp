#include "postproc/pipeline/links.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace smoothpost {

namespace {

constexpr double kArmLook = 5.0;       // mm, between the places where a straight way is looked at
constexpr double kArmStep = 0.25;      // rad, of a joint from one to the next
constexpr double kArmJointStep = 5.0;  // mm, between joint moves that stand for a straight one
constexpr double kArmStraight = 0.05;  // mm, that those may leave the line by
constexpr int kMostHalvings = 14;
constexpr double kStraightShare = 0.5;  // of the velocity limits, on feeds along the tool axis

/// Largest value of v·n over the box.
double support(const PartBox& box, const Vec3& n) {
  double value = 0.0;
  for (int i = 0; i < 3; ++i) value += std::max(n[i] * box.lower[i], n[i] * box.upper[i]);
  return value;
}

double farthest(const PartBox& box, const Vec3& p) {
  Vec3 d;
  for (int i = 0; i < 3; ++i)
    d[i] = std::max(std::abs(box.lower[i] - p[i]), std::abs(box.upper[i] - p[i]));
  return d.norm();
}

/// A straight way of an arm's tip in joint moves.
struct StraightSteps {
  struct At {
    double share;
    JointVector q;
  };
  const Inverse& arm;
  Pose start;
  Vec3 way;
  double tool_length;

  /// Appends the joints behind `from` up to `to`.
  void add(const At& from, const At& to, int depth, std::vector<JointVector>& joints) const {
    const bool is_short = (to.share - from.share) * way.norm() <= kArmJointStep;
    std::optional<JointVector> middle;
    const double share = 0.5 * (from.share + to.share);
    if (depth < kMostHalvings && !(is_short && is_straight(from, to)))
      middle = arm.nearest(at(share), 0.5 * (from.q + to.q));
    if (!middle) {
      joints.push_back(to.q);
      return;
    }
    add(from, {share, *middle}, depth + 1, joints);
    add({share, *middle}, to, depth + 1, joints);
  }

 private:
  Pose at(double share) const {
    Pose pose = start;
    pose.translation() += share * way;
    return pose;
  }

  bool is_straight(const At& from, const At& to) const {
    const Pose got = forward(arm.chain(), 0.5 * (from.q + to.q));
    const Pose wanted = at(0.5 * (from.share + to.share));
    const Vec3& axis = arm.chain().tool_axis;
    const Vec3 turn = got.linear() * axis - wanted.linear() * axis;
    return (got.translation() - wanted.translation()).norm() + tool_length * turn.norm() <=
           kArmStraight;
  }
};

CutterLocation tip_of(const ScrewChain& chain, const LinkEnd& end) {
  CutterLocation location = forward_location(chain, end.q);
  location.tip -= end.tool_length * location.axis;
  return location;
}

}  // namespace

double proven_height(const ScrewChain& chain, const std::vector<LinkEnd>& waypoints,
                     const PartBox& part) {
  double height = INFINITY;
  for (std::size_t i = 0; i + 1 < waypoints.size(); ++i) {
    const LinkEnd& from = waypoints[i];
    const LinkEnd& to = waypoints[i + 1];
    const double length = std::max(std::abs(from.tool_length), std::abs(to.tool_length));
    const CutterLocation a = tip_of(chain, from);
    const CutterLocation b = tip_of(chain, to);
    const auto bend = second_derivative_bound(chain, from.q, to.q);
    const double tip_sag = (bend.tip + length * bend.axis) / 8.0;
    const double reach = std::max(farthest(part, a.tip), farthest(part, b.tip)) + tip_sag;
    const double loss = tip_sag + reach * bend.axis / 8.0;
    // The chord's tip and axis are blends of the ends', so its height is at least the least of the
    // four combinations, times the blended axis' length.
    double least = INFINITY;
    for (const Vec3& tip : {a.tip, b.tip})
      for (const Vec3& axis : {a.axis, b.axis})
        least = std::min(least, axis.dot(tip) - support(part, axis));
    height = std::min(height, least - loss);
  }
  return height;
}

LinkPlanner::LinkPlanner(const MachineDefinition& machine, const ScrewChain& chain, double retract,
                         std::optional<PartBox> part)
    : machine_(machine),
      chain_(chain),
      part_(part),
      retract_axis_(machine.axis_by_name(machine.links.retract_axis)),
      retract_(retract) {
  for (int j = 0; j < machine.size(); ++j) {
    const bool rotary = machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
    (rotary ? rotary_ : linear_) |= 1U << j;
  }
  auto inverse = Inverse::from(chain);
  if (inverse && inverse->takes_rotation()) arm_ = std::move(inverse);
}

MachineMove LinkPlanner::move(JointMask joints, const JointVector& to) const {
  MachineMove move;
  move.to = to;
  move.joints = joints;
  move.rapid = true;
  move.role = MoveRole::link;
  return move;
}

void LinkPlanner::add(std::vector<MachineMove>& moves, JointMask joints,
                      const JointVector& to) const {
  if (joints != 0) moves.push_back(move(joints, to));
}

void LinkPlanner::add_straight(std::vector<MachineMove>& moves, const JointVector& from,
                               const JointVector& to) const {
  MachineMove straight = move(linear_, to);
  if (machine_.links.rapid == RapidMotion::independent) {
    straight.rapid = false;
    straight.duration = machine_.cycle.min_block;
    for (int j = 0; j < machine_.size(); ++j)
      straight.duration =
          std::max(straight.duration,
                   std::abs(to[j] - from[j]) /
                       (kStraightShare * machine_.axes[static_cast<std::size_t>(j)].velocity));
  }
  moves.push_back(std::move(straight));
}

std::optional<JointVector> LinkPlanner::along_tool(const JointVector& q, double distance) const {
  const Jacobian jacobian_here = jacobian(chain_, q);
  const Vec3 away = distance * forward_location(chain_, q).axis;
  Eigen::Matrix3d directions;
  std::array<int, 3> column{};
  int n = 0;
  for (int i = 0; i < chain_.size() && n < 3; ++i) {
    const auto& joint = chain_.joints[static_cast<std::size_t>(i)];
    if (joint.kind != JointKind::linear || joint.redundant) continue;
    directions.col(n) = jacobian_here.col(i).tail<3>();
    column[static_cast<std::size_t>(n++)] = i;
  }
  if (n < 3) return {};
  JointVector clear = q;
  const Vec3 step = directions.fullPivLu().solve(away);
  for (int i = 0; i < 3; ++i) clear[column[static_cast<std::size_t>(i)]] += step[i];
  for (const int i : column) {
    const auto& joint = chain_.joints[static_cast<std::size_t>(i)];
    if (clear[i] < joint.lower || clear[i] > joint.upper) return {};
  }
  return clear;
}

bool LinkPlanner::is_cramped(const JointVector& q, const JointVector& clear) const {
  const double way = (forward_location(chain_, clear).tip - forward_location(chain_, q).tip).norm();
  return way < machine_.links.clearance - 1e-6;
}

// Without room for the whole clearance the tool leaves as far as it can.
JointVector LinkPlanner::clear_of(const JointVector& q) const {
  for (double share = 1.0; share > 0.1; share *= 0.5)
    if (const auto clear = along_tool(q, share * machine_.links.clearance)) return *clear;
  return q;
}

Link LinkPlanner::over_plane(const LinkEnd& to) const {
  Link link;
  const JointVector above = clear_of(to.q);
  link.cramped = is_cramped(to.q, above);
  if (retract_axis_ >= 0) {
    JointVector up = above;
    up[retract_axis_] = retract_;
    add(link.approach, retract_bit(), up);
    link.approach.back().machine_coordinates = true;
  }
  link.retracted = link.approach.size();
  JointVector across = above;
  if (retract_axis_ >= 0) across[retract_axis_] = retract_;
  add(link.approach, rotary_, across);
  add(link.approach, linear_ & ~retract_bit(), across);
  add(link.approach, retract_bit(), above);
  if ((above - to.q).norm() > 0.0) add_straight(link.approach, above, to.q);
  return link;
}

Link LinkPlanner::first(const LinkEnd& to) const {
  if (!arm_) return over_plane(to);
  Link link = arm_approach(to);
  link.approach.insert(link.approach.begin(), move(rotary_ | linear_, home_of(machine_)));
  link.retracted = 1;
  return link;
}

Link LinkPlanner::last(const LinkEnd& from) const {
  Link link;
  if (arm_) {
    link.cramped = is_cramped(from.q, arm_clear_of(from));
    link.away = arm_away(from);
    add(link.away, rotary_ | linear_, home_of(machine_));
    return link;
  }
  const JointVector above = clear_of(from.q);
  link.cramped = is_cramped(from.q, above);
  if ((above - from.q).norm() > 0.0) add_straight(link.away, from.q, above);
  JointVector home = home_of(machine_);
  JointVector up = above;
  if (retract_axis_ >= 0) {
    up[retract_axis_] = retract_;
    add(link.away, retract_bit(), up);
    link.away.back().machine_coordinates = true;
    home[retract_axis_] = retract_;
  }
  for (int j = 0; j < machine_.size(); ++j)
    if (rotary_ >> j & 1U) up[j] = home[j];
  add(link.away, rotary_, up);
  add(link.away, linear_ & ~retract_bit(), home);
  return link;
}

Link LinkPlanner::between(const LinkEnd& from, const LinkEnd& to, bool must_retract) const {
  if (arm_) {
    Link link = arm_approach(to);
    link.cramped = link.cramped || is_cramped(from.q, arm_clear_of(from));
    link.away = arm_away(from);
    return link;
  }
  if (!must_retract)
    if (auto link = low(from, to)) return std::move(*link);
  Link link = over_plane(to);
  const JointVector above = clear_of(from.q);
  link.cramped = link.cramped || is_cramped(from.q, above);
  if ((above - from.q).norm() > 0.0) add_straight(link.away, from.q, above);
  return link;
}

// How far along `axis` the tip has to go until the part lies clear of it, seen along both axes.
double LinkPlanner::needed_distance(const LinkEnd& at, const Vec3& axis, const Vec3& other) const {
  const Vec3 tip = tip_of(chain_, at).tip;
  double distance = machine_.links.clearance;
  for (const Vec3& n : {axis, other})
    distance = std::max(distance,
                        (support(*part_, n) + machine_.links.clearance - tip.dot(n)) / axis.dot(n));
  return distance;
}

std::optional<Link> LinkPlanner::low(const LinkEnd& from, const LinkEnd& to) const {
  if (!part_ || retract_axis_ < 0 || from.tool_length != to.tool_length ||
      machine_.links.clearance <= 0.0)
    return {};
  const Vec3 axis_from = forward_location(chain_, from.q).axis;
  const Vec3 axis_to = forward_location(chain_, to.q).axis;
  if (angle_between(axis_from, axis_to) > machine_.links.rotation) return {};
  // On the pole the axis says nothing of the first rotary: what turns is looked at itself.
  double turn = 0.0;
  for (int j = 0; j < machine_.size(); ++j)
    if (rotary_ >> j & 1U) turn = std::max(turn, std::abs(to.q[j] - from.q[j]));
  if (turn > machine_.links.rotation) return {};
  const auto away = along_tool(from.q, needed_distance(from, axis_from, axis_to));
  const auto above = along_tool(to.q, needed_distance(to, axis_to, axis_from));
  if (!away || !above) return {};
  const auto& retract_joint = chain_.joints[static_cast<std::size_t>(retract_axis_)];
  const bool upwards = machine_.links.retract >= 0.5 * (retract_joint.lower + retract_joint.upper);
  const double height = upwards ? std::max((*away)[retract_axis_], (*above)[retract_axis_])
                                : std::min((*away)[retract_axis_], (*above)[retract_axis_]);
  JointVector up = *away;
  up[retract_axis_] = height;
  JointVector turned = up;
  JointVector across = *above;
  across[retract_axis_] = height;
  for (int j = 0; j < machine_.size(); ++j)
    if (rotary_ >> j & 1U) turned[j] = across[j];

  Link link;
  link.low = true;
  add_straight(link.away, from.q, *away);
  add(link.away, retract_bit(), up);
  std::vector<LinkEnd> waypoints{{*away, from.tool_length}, {up, from.tool_length}};
  const auto step = [&](JointMask joints, const JointVector& q) {
    add(link.approach, joints, q);
    waypoints.push_back({q, from.tool_length});
  };
  // Axes that need not arrive together go one after the other, so that their way is known.
  const bool one_by_one = machine_.links.rapid == RapidMotion::independent;
  for (const JointMask group : {rotary_, linear_ & ~retract_bit()}) {
    const JointVector& target = group == rotary_ ? turned : across;
    if (!one_by_one) {
      step(group, target);
      continue;
    }
    JointVector q = waypoints.back().q;
    for (int j = 0; j < machine_.size(); ++j) {
      if (!(group >> j & 1U)) continue;
      q[j] = target[j];
      step(1U << j, q);
    }
  }
  step(retract_bit(), *above);
  if (!(proven_height(chain_, waypoints, *part_) >= 0.5 * machine_.links.clearance)) return {};
  add_straight(link.approach, *above, to.q);
  return link;
}

// Followed from place to place, as a controller does it: where the arm passes near a singular
// posture, its axes would turn far on a short way, and there is no straight way.
std::optional<JointVector> LinkPlanner::moved_tip(const LinkEnd& at, const Vec3& step) const {
  const Pose start = forward(chain_, at.q);
  const int steps = std::max(1, static_cast<int>(std::ceil(step.norm() / kArmLook)));
  JointVector q = at.q;
  for (int k = 1; k <= steps; ++k) {
    Pose pose = start;
    pose.translation() += step * k / steps;
    const auto next = arm_->nearest(pose, q);
    if (!next || (*next - q).lpNorm<Eigen::Infinity>() > kArmStep) return {};
    q = *next;
    for (int j = 0; j < machine_.size(); ++j) {
      const auto& joint = chain_.joints[static_cast<std::size_t>(j)];
      if (q[j] < joint.lower || q[j] > joint.upper) return {};
    }
  }
  return q;
}

JointVector LinkPlanner::arm_clear_of(const LinkEnd& at) const {
  const Vec3 axis = forward_location(chain_, at.q).axis;
  for (double share = 1.0; share > 0.1; share *= 0.5)
    if (const auto q = moved_tip(at, share * machine_.links.clearance * axis)) return *q;
  return at.q;
}

// Straight up to the retract plane, as far as the arm reaches.
JointVector LinkPlanner::arm_above(const LinkEnd& at) const {
  if (!machine_.links.has_plane) return at.q;
  const Vec3 up = chain_.workpiece_home.linear().transpose() * Vec3::UnitZ();
  const double height = (chain_.workpiece_home * tip_of(chain_, at).tip).z();
  const double rise = machine_.links.retract - height;
  if (rise <= 0.0) return at.q;
  for (double share = 1.0; share > 0.1; share *= 0.75)
    if (const auto q = moved_tip(at, share * rise * up)) return *q;
  return at.q;
}

void LinkPlanner::add_arm_straight(std::vector<MachineMove>& moves, const LinkEnd& from,
                                   const JointVector& to) const {
  if ((to - from.q).norm() == 0.0) return;
  if (machine_.dialect.mode == "tcp") {
    moves.push_back(move(0, to));
    moves.back().interpolation = MoveInterpolation::tool;
    return;
  }
  const StraightSteps steps{
      *arm_, forward(chain_, from.q),
      forward(chain_, to).translation() - forward(chain_, from.q).translation(), from.tool_length};
  std::vector<JointVector> joints;
  steps.add({0.0, from.q}, {1.0, to}, 0, joints);
  for (const JointVector& q : joints) moves.push_back(move(rotary_ | linear_, q));
}

Link LinkPlanner::arm_approach(const LinkEnd& to) const {
  Link link;
  const JointVector clear = arm_clear_of(to);
  link.cramped = is_cramped(to.q, clear);
  const JointVector above = arm_above({clear, to.tool_length});
  add(link.approach, rotary_ | linear_, above);
  add_arm_straight(link.approach, {above, to.tool_length}, clear);
  add_arm_straight(link.approach, {clear, to.tool_length}, to.q);
  return link;
}

std::vector<MachineMove> LinkPlanner::arm_away(const LinkEnd& from) const {
  std::vector<MachineMove> moves;
  const JointVector clear = arm_clear_of(from);
  add_arm_straight(moves, from, clear);
  add_arm_straight(moves, {clear, from.tool_length}, arm_above({clear, from.tool_length}));
  return moves;
}

}  // namespace smoothpost
