#include "postproc/pipeline/controller_blending.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/core/units.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kLargestBlend = 20.0;      // mm
constexpr double kSmallestBlend = 1e-3;     // mm: less is not worth the words
constexpr double kShareOfMove = 0.49;       // of the shorter move, that one corner may take
constexpr double kNoLength = 1e-9;          // mm
constexpr double kLargestTurn = 3.0;        // rad of one move: beyond, its sense is not certain
constexpr double kSharpest = 1.7320508;     // |T1 - T0| of 120 deg
constexpr double kSharpestSpline = 0.7654;  // |T1 - T0| of 45 deg
constexpr std::size_t kMostEvents = 8;      // at one place, on the fly
constexpr double kCoarse = 10.0;            // a move this many printed steps long, at least

/// A move of the tool, or what is known of it.
struct Leg {
  bool known = false;
  double length = 0.0;  // mm
  Vec3 direction = Vec3::Zero();
  Vec3 turn = Vec3::Zero();  // rotation vector of the whole move
  Vec3 rate() const { return turn / length; }
};

Leg leg_between(const Pose& from, const Pose& to) {
  Leg leg;
  const Vec3 way = to.translation() - from.translation();
  leg.length = way.norm();
  leg.turn = rotation_log(to.linear() * from.linear().transpose());
  leg.known = leg.length > kNoLength && leg.turn.norm() <= kLargestTurn;
  if (leg.known) leg.direction = way / leg.length;
  return leg;
}

/// The legs of all moves; `Move` is MachineMove or ReadBackMove.
template <typename Move, typename ToolLength>
std::vector<Leg> legs_of(const std::vector<Move>& moves, const ScrewChain& chain,
                         const ToolLength& tool_length) {
  std::vector<Leg> legs(moves.size());
  for (std::size_t i = 1; i < moves.size(); ++i) {
    if (moves[i].interpolation != MoveInterpolation::tool) continue;
    const Move& before = moves[i - 1];
    const bool by_tool = before.interpolation == MoveInterpolation::tool;
    if (!by_tool && before.to.size() != chain.size()) continue;
    legs[i] = leg_between(by_tool ? before.tool : tip_pose(chain, before.to, tool_length(i)),
                          moves[i].tool);
  }
  return legs;
}

/// What a corner of 1 mm radius, or a spline, makes of the change from one leg to the next.
struct Change {
  double direction = 2.0;  // |T1 - T0|
  double rate = 0.0;       // |w1 - w0|, rad/mm
};

Change change_between(const Leg& a, const Leg& b) {
  return {(b.direction - a.direction).norm(), (b.rate() - a.rate()).norm()};
}

BlendAllowance rounded(const Change& change, double radius) {
  return {0.5 * radius * change.direction, 0.5 * radius * change.rate};
}

/// Twice a quarter of |m - d| at a corner, on the side of the leg of length `own`.
BlendAllowance splined(const Change& change, double own, double other) {
  const double bend = 0.5 * own * own / (own + other);
  return {bend * change.direction, bend * change.rate};
}

void widen(BlendAllowance& allowance, const BlendAllowance& by) {
  allowance.tip = std::max(allowance.tip, by.tip);
  allowance.rotation = std::max(allowance.rotation, by.rotation);
}

class BlendPlanner {
 public:
  BlendPlanner(MachineProgram& program, const MachineDefinition& machine, const ScrewChain& chain)
      : program_(program), machine_(machine) {
    legs_ = legs_of(program.moves, chain,
                    [&program](std::size_t i) { return program.moves[i].tool_length; });
    const auto& tolerance = machine.tolerance;
    share_.tip = tolerance.tip * tolerance.budget.controller;
    share_.rotation = tolerance.axis * tolerance.budget.controller;
    const double unit = machine.dialect.units == "inch" ? kMillimetresPerInch : 1.0;
    step_ = std::numbers::sqrt3 * unit * std::pow(10.0, -machine.dialect.digits_length);
    turn_step_ = 3.0 * kRadiansPerDegree * std::pow(10.0, -machine.dialect.digits_angle);
    find_joined();
  }

  void plan_corners() {
    for (std::size_t i = 1; i < program_.moves.size(); ++i)
      if (joined_[i]) program_.moves[i - 1].blend = radius_at(i);
  }

  void plan_chains() {
    std::size_t first = 1;
    while (first < program_.moves.size()) {
      std::size_t last = first;
      while (last + 1 < program_.moves.size() && joined_[last + 1] && is_smooth(last + 1)) ++last;
      if (last > first)
        for (std::size_t i = first; i <= last; ++i) program_.moves[i].spline = true;
      // The move behind a chain stays straight and keeps it from the next one.
      first = last > first ? last + 2 : last + 1;
    }
  }

 private:
  bool qualifies(std::size_t i) const {
    const MachineMove& move = program_.moves[i];
    return move.role == MoveRole::path && !move.rapid && move.duration > 0.0 &&
           move.interpolation == MoveInterpolation::tool && legs_[i].known &&
           legs_[i].length >= kCoarse * step_;
  }

  // joined_[i]: the robot need not stop between moves i-1 and i.
  void find_joined() {
    const auto& moves = program_.moves;
    joined_.assign(moves.size() + 1, false);
    for (std::size_t i = 2; i < moves.size(); ++i)
      joined_[i] =
          qualifies(i - 1) && qualifies(i) && moves[i].tool_length == moves[i - 1].tool_length;
    std::vector<std::size_t> events(moves.size() + 1, 0);
    for (const auto& action : program_.actions) {
      if (action.before > moves.size() || action.kind == MachineAction::Kind::comment) continue;
      if (!runs_through(action) || ++events[action.before] > kMostEvents)
        joined_[action.before] = false;
    }
  }

  bool runs_through(const MachineAction& action) const {
    if (action.kind != MachineAction::Kind::event) return false;
    for (const auto& row : machine_.process.events)
      if (row.event == action.event.name) return row.on_the_fly && row.dwell == 0.0;
    return machine_.process.unmapped == UnmappedWords::comment;
  }

  // As the text may have it: every printed end is off by half a step.
  Change printed_change(std::size_t i) const {
    Change change = change_between(legs_[i - 1], legs_[i]);
    constexpr double kMargin = 1.1;  // lengths of ten steps: the second order
    for (const Leg& leg : {legs_[i - 1], legs_[i]}) {
      const double off = kMargin * step_ / leg.length;
      change.direction += off;
      change.rate += kMargin * (turn_step_ + leg.turn.norm() * off) / leg.length;
    }
    return change;
  }

  double radius_at(std::size_t i) const {
    const Change change = printed_change(i);
    if (change.direction > kSharpest) return 0.0;
    const BlendAllowance of_one = rounded(change, 1.0);
    double radius = std::min(kLargestBlend,
                             kShareOfMove * std::min(legs_[i - 1].length, legs_[i].length) - step_);
    radius = std::min(radius, share_.tip / of_one.tip);
    radius = std::min(radius, share_.rotation / of_one.rotation);
    return radius >= kSmallestBlend ? radius : 0.0;
  }

  bool is_smooth(std::size_t i) const {
    const Change change = printed_change(i);
    if (change.direction > kSharpestSpline) return false;
    const double before = legs_[i - 1].length + step_;
    const double behind = legs_[i].length + step_;
    BlendAllowance most = splined(change, before, behind);
    widen(most, splined(change, behind, before));
    return most.tip <= share_.tip && most.rotation <= share_.rotation;
  }

  MachineProgram& program_;
  const MachineDefinition& machine_;
  std::vector<Leg> legs_;
  std::vector<bool> joined_;
  BlendAllowance share_;
  double step_ = 0.0;       // mm, that a move's vector may change in printing
  double turn_step_ = 0.0;  // rad, its turn
};

constexpr BlendAllowance kNoBound = {INFINITY, INFINITY};

/// The corner at the end of move i: what lies within its radius on either side.
void add_corner(const std::vector<Leg>& legs, std::size_t i, double radius,
                std::vector<BlendAllowance>& out) {
  const bool known = i + 1 < legs.size() && legs[i].known && legs[i + 1].known;
  const BlendAllowance corner =
      known ? rounded(change_between(legs[i], legs[i + 1]), radius) : kNoBound;
  widen(out[i], corner);
  if (i + 1 == legs.size()) return;
  widen(out[i + 1], corner);
  if (!known) return;
  double left = radius - legs[i].length;
  for (std::size_t k = i; k-- > 0 && left > 0.0; left -= legs[k].length) widen(out[k], corner);
  left = radius - legs[i + 1].length;
  for (std::size_t k = i + 2; k < legs.size() && left > 0.0; ++k) {
    widen(out[k], corner);
    left -= legs[k].length;
  }
}

}  // namespace

void plan_blending(MachineProgram& program, const MachineDefinition& machine,
                   const ScrewChain& chain) {
  for (MachineMove& move : program.moves) {
    move.blend = 0.0;
    move.spline = false;
  }
  if (machine.dialect.path_mode == "blend") BlendPlanner(program, machine, chain).plan_corners();
  if (machine.dialect.path_mode == "spline") BlendPlanner(program, machine, chain).plan_chains();
}

std::string blending_assumption(const std::string& path_mode) {
  if (path_mode == "blend")
    return "the control rounds a corner no farther from it than the distance that the program "
           "states, "
           "inside the triangle of the corner and the two places where the rounding begins and "
           "ends, "
           "tip and rotation together and never backwards";
  if (path_mode == "spline")
    return "the control's own spline stays within twice the bound of the Catmull-Rom curve through "
           "the points";
  return {};
}

std::vector<BlendAllowance> blend_allowances(
    const ReadBack& read, const ScrewChain& chain,
    const std::function<double(std::size_t)>& tool_length) {
  const auto& moves = read.moves;
  std::vector<BlendAllowance> out(moves.size());
  const std::vector<Leg> legs = legs_of(moves, chain, tool_length);
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (moves[i].blend > 0.0) add_corner(legs, i, moves[i].blend, out);
    if (!moves[i].spline) continue;
    if (!legs[i].known) {
      widen(out[i], kNoBound);
      continue;
    }
    const auto bend_towards = [&](std::size_t k) {
      widen(out[i], legs[k].known
                        ? splined(change_between(legs[i], legs[k]), legs[i].length, legs[k].length)
                        : kNoBound);
    };
    if (i > 0 && moves[i - 1].spline) bend_towards(i - 1);
    if (i + 1 < moves.size() && moves[i + 1].spline) bend_towards(i + 1);
  }
  return out;
}

}  // namespace smoothpost
