#include "postproc/pipeline/curve_blocks.h"

#include <algorithm>
#include <cmath>

#include "kernels/spline/bent_move.h"
#include "postproc/pipeline/block_steps.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kUsed = 0.8;        // of the chord share: looked at in few places alone
constexpr double kSameFeed = 1e-3;   // relative
constexpr double kOnStretch = 1e-7;  // mm or rad, that a move's end may be off its stretch

class CurveMaker {
 public:
  CurveMaker(MachineProgram& program, const CurveInput& input)
      : program_(program),
        in_(input),
        limits_(feed_limits(input.machine)),
        degree_(input.machine.dialect.curves == "cubic" ? 3 : 5) {
    const ToleranceSettings& t = input.machine.tolerance;
    tip_ = kUsed * t.tip * t.budget.chord;
    axis_ = kUsed * t.axis * t.budget.chord;
    for (const PathEvent& event : input.reference.path().events)
      event_points_.push_back(event.point);
    for (const MachineAction& action : program.actions) action_moves_.push_back(action.before);
  }

  CurveReport run() {
    find_places();
    std::vector<MachineMove> moves;
    std::vector<std::size_t> now_at(program_.moves.size() + 1);  // of each old move
    for (std::size_t i = 0; i < program_.moves.size();) {
      const std::size_t end = places_[i].on ? longest_run(i) : i + 1;
      for (std::size_t k = i; k < end; ++k) now_at[k] = moves.size();
      if (places_[i].on) {
        out_.before += end - i;
        ++out_.after;
        out_.curves += end > i + 1 ? 1U : 0U;
      }
      moves.push_back(end > i + 1 ? joined(i, end) : program_.moves[i]);
      i = end;
    }
    now_at.back() = moves.size();
    program_.moves = std::move(moves);
    for (MachineAction& action : program_.actions) action.before = now_at[action.before];
    return out_;
  }

 private:
  /// Where a move stands on its stretch.
  struct Place {
    bool on = false;
    double from = 0.0, to = 0.0;  ///< s
  };

  const ScheduledStretch& stretch(std::size_t i) const {
    return in_.schedule.stretches[static_cast<std::size_t>(program_.moves[i].stretch)];
  }

  void find_places() {
    places_.resize(program_.moves.size());
    for (std::size_t i = 1; i < program_.moves.size(); ++i) {
      const MachineMove& move = program_.moves[i];
      if (move.stretch < 0 || move.role != MoveRole::path || move.rapid ||
          move.interpolation != MoveInterpolation::joints || move.machine_coordinates ||
          !(move.duration > 0.0))
        continue;
      const bool goes_on = program_.moves[i - 1].stretch == move.stretch;
      const double before = goes_on ? program_.moves[i - 1].stretch_time : 0.0;
      Place place{true, s_at(i, before), s_at(i, move.stretch_time)};
      place.on = place.to > place.from && is_on(i, place.from, program_.moves[i - 1].to) &&
                 is_on(i, place.to, move.to);
      places_[i] = place;
    }
  }

  double s_at(std::size_t i, double time) const {
    const ScheduledStretch& s = stretch(i);
    return s.profile.at(time / s.slowing).s;
  }

  bool is_on(std::size_t i, double s, const JointVector& q) const {
    return (stretch(i).joints.joints_at(s) - q).cwiseAbs().maxCoeff() <= kOnStretch;
  }

  // Whether move `next` may belong to the same run as the one before it.
  bool goes_on(std::size_t next) const {
    const MachineMove& a = program_.moves[next - 1];
    const MachineMove& b = program_.moves[next];
    if (!places_[next].on || a.stretch != b.stretch || a.joints != b.joints ||
        a.tool_length != b.tool_length || a.blend > 0.0)
      return false;
    if (std::binary_search(action_moves_.begin(), action_moves_.end(), next)) return false;
    const bool inside = b.from_segment == a.segment && b.from_share == a.to_share;
    const bool behind = b.from_segment == a.segment + 1 && a.to_share == 1.0 && b.from_share == 0.0;
    if (!inside && !behind) return false;
    for (std::size_t point = a.segment; point < b.segment; ++point)
      if (std::binary_search(event_points_.begin(), event_points_.end(), point) ||
          !same_state(point, point + 1))
        return false;
    return true;
  }

  bool same_state(std::size_t a, std::size_t b) const {
    const std::vector<PathPoint>& points = in_.reference.path().points;
    return points[a].beam == points[b].beam && points[a].kind == points[b].kind &&
           points[a].tool == points[b].tool && points[a].tool_length == points[b].tool_length &&
           std::abs(in_.reference.feed(a) - in_.reference.feed(b)) <=
               kSameFeed * in_.reference.feed(b);
  }

  // Behind the last move of the run that begins with move `first`.
  std::size_t longest_run(std::size_t first) const {
    std::size_t limit = first + 1;
    while (limit < program_.moves.size() && goes_on(limit)) ++limit;
    std::size_t good = first + 1, step = 1;
    std::size_t bad = limit + 1;
    while (good < limit) {
      const std::size_t next = std::min(good + step, limit);
      if (!holds(first, next)) {
        bad = next;
        break;
      }
      good = next;
      step *= 2;
    }
    while (good + 1 < bad && bad <= limit) {
      const std::size_t middle = good + (bad - good) / 2;
      (holds(first, middle) ? good : bad) = middle;
    }
    return good;
  }

  /// Length of the tip's way of the input that a move stands for, mm.
  double way(std::size_t i) const {
    const MachineMove& m = program_.moves[i];
    double length = 0.0;
    for (std::uint32_t k = m.from_segment; k <= m.segment; ++k)
      length += in_.reference.length(k) *
                ((k == m.segment ? m.to_share : 1.0) - (k == m.from_segment ? m.from_share : 0.0));
    return length;
  }

  // τ of the run's polynomial that is paired with the end of each of its moves; empty: a run over
  // several segments on which the tip stands.
  std::vector<double> pairing(std::size_t first, std::size_t end) const {
    const MachineMove& a = program_.moves[first];
    const MachineMove& z = program_.moves[end - 1];
    std::vector<double> tau;
    if (a.from_segment == z.segment) {
      for (std::size_t i = first; i < end; ++i)
        tau.push_back((program_.moves[i].to_share - a.from_share) / (z.to_share - a.from_share));
      return tau;
    }
    double length = 0.0;
    for (std::size_t i = first; i < end; ++i) tau.push_back(length += way(i));
    if (!(length > 0.0)) return {};
    for (double& t : tau) t /= length;
    return tau;
  }

  JointBend bend(std::size_t first, std::size_t end) const {
    const double from = places_[first].from, to = places_[end - 1].to;
    return hermite_bend(path_end(first, from, false), path_end(first, to, true), to - from,
                        degree_);
  }

  // As seen from inside the run.
  PathEnd path_end(std::size_t i, double s, bool before) const {
    const JointStretch& joints = stretch(i).joints;
    std::size_t piece = joints.piece_at(s);
    if (before && piece > 0 && s <= joints.breaks[piece]) --piece;
    const PathJet jet = joints.jet(piece, s);
    return {joints.joints_at(s), jet.first, jet.second};
  }

  bool holds(std::size_t first, std::size_t end) const {
    const std::vector<double> paired = pairing(first, end);
    if (paired.empty()) return false;
    const double s0 = places_[first].from, extent = places_[end - 1].to - s0;
    double time = 0.0;
    for (std::size_t i = first; i < end; ++i) time += program_.moves[i].duration;
    const JointBend bent = bend(first, end);
    const BentMove run{program_.moves[first - 1].to, program_.moves[end - 1].to, bent};
    double passed = 0.0, before = 0.0;
    for (std::size_t i = first; i < end; ++i) {
      passed += program_.moves[i].duration;
      const double even = (places_[i].to - s0) / extent;
      if (std::abs(even * time - passed) > kShortBlock) return false;
      const double now = paired[i - first];
      const double middle = 0.5 * (places_[i].from + places_[i].to);
      if (!follows(i, run, 0.5 * (before + now), stretch(i).joints.joints_at(middle)) ||
          !follows(i, run, now, program_.moves[i].to) || !is_slow(run, even, time))
        return false;
      before = now;
    }
    return is_slow(run, 0.0, time);
  }

  bool follows(std::size_t i, const BentMove& run, double tau, const JointVector& wanted) const {
    const double length = program_.moves[i].tool_length;
    const CutterLocation a = forward_location(in_.chain, joints_at(run, tau));
    const CutterLocation b = forward_location(in_.chain, wanted);
    return (a.tip - b.tip - length * (a.axis - b.axis)).norm() <= tip_ &&
           (a.axis - b.axis).norm() <= axis_;
  }

  bool is_slow(const BentMove& run, double tau, double time) const {
    const JointVector rate = rates_at(run, tau).cwiseAbs() / time;
    if ((rate.array() > limits_.velocity.array()).any()) return false;
    const JointVector bend = second_at(run, tau).cwiseAbs() / (time * time);
    return (bend.array() <= limits_.acceleration.array()).all();
  }

  MachineMove joined(std::size_t first, std::size_t end) const {
    MachineMove move = program_.moves[end - 1];
    move.from_segment = program_.moves[first].from_segment;
    move.from_share = program_.moves[first].from_share;
    move.bend = bend(first, end);
    move.duration = 0.0;
    for (std::size_t i = first; i < end; ++i) move.duration += program_.moves[i].duration;
    return move;
  }

  MachineProgram& program_;
  const CurveInput& in_;
  FeedLimits limits_;
  int degree_;
  double tip_ = 0.0, axis_ = 0.0;
  std::vector<std::size_t> event_points_;  ///< ascending, as events are
  std::vector<std::size_t> action_moves_;  ///< ascending, as actions are
  std::vector<Place> places_;
  CurveReport out_;
};

}  // namespace

std::string curve_assumption(const MachineDefinition& machine) {
  return "the control has polynomial interpolation of degree " +
         std::string(machine.dialect.curves == "cubic" ? "3" : "5") +
         " for all axes of a block, and takes every axis along its polynomial by one parameter "
         "(POLY under UPATH)";
}

CurveReport join_into_curves(MachineProgram& program, const CurveInput& input) {
  return CurveMaker(program, input).run();
}

}  // namespace smoothpost
