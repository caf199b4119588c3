#include "postproc/pipeline/block_runs.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "postproc/pipeline/block_steps.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kUsed = 0.8;        // of the chord share: looked at in few places alone
constexpr double kSameFeed = 1e-3;   // relative
constexpr double kOnStretch = 1e-7;  // mm or rad, that a move's end may be off its stretch

}  // namespace

BlockRuns::BlockRuns(MachineProgram& program, const CurveInput& input)
    : program_(program), in_(input) {
  const ToleranceSettings& t = input.machine.tolerance;
  tip_ = kUsed * t.tip * t.budget.chord;
  axis_ = kUsed * t.axis * t.budget.chord;
  for (const PathEvent& event : input.reference.path().events) event_points_.push_back(event.point);
  for (const MachineAction& action : program.actions) action_moves_.push_back(action.before);
  find_places();
}

CurveReport BlockRuns::replace(const Rules& rules) {
  CurveReport out;
  std::vector<MachineMove> moves;
  std::vector<std::size_t> now_at(program_.moves.size() + 1);  // of each old move
  for (std::size_t i = 0; i < program_.moves.size();) {
    std::size_t end = places_[i].on ? longest_run(i, rules) : i + 1;
    if (end > i + 1 && rules.is_worth && !rules.is_worth(i, end)) end = i + 1;
    for (std::size_t k = i; k < end; ++k) now_at[k] = moves.size();
    if (places_[i].on) {
      out.before += end - i;
      ++out.after;
      out.curves += end > i + 1 ? 1U : 0U;
    }
    moves.push_back(end > i + 1 ? rules.joined(i, end) : program_.moves[i]);
    if (end > i + 1) {
      moves.back().from_segment = program_.moves[i].from_segment;
      moves.back().from_share = program_.moves[i].from_share;
      moves.back().duration = duration(i, end);
    }
    i = end;
  }
  now_at.back() = moves.size();
  program_.moves = std::move(moves);
  for (MachineAction& action : program_.actions) action.before = now_at[action.before];
  return out;
}

const ScheduledStretch& BlockRuns::stretch(std::size_t i) const {
  return in_.schedule.stretches[static_cast<std::size_t>(program_.moves[i].stretch)];
}

double BlockRuns::duration(std::size_t first, std::size_t end) const {
  double time = 0.0;
  for (std::size_t i = first; i < end; ++i) time += program_.moves[i].duration;
  return time;
}

void BlockRuns::find_places() {
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

double BlockRuns::s_at(std::size_t i, double time) const {
  const ScheduledStretch& s = stretch(i);
  return s.profile.at(time / s.slowing).s;
}

bool BlockRuns::is_on(std::size_t i, double s, const JointVector& q) const {
  return (stretch(i).joints.joints_at(s) - q).cwiseAbs().maxCoeff() <= kOnStretch;
}

// Whether move `next` may belong to the same run as the one before it.
bool BlockRuns::may_follow(std::size_t next) const {
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

bool BlockRuns::same_state(std::size_t a, std::size_t b) const {
  const std::vector<PathPoint>& points = in_.reference.path().points;
  return points[a].beam == points[b].beam && points[a].kind == points[b].kind &&
         points[a].tool == points[b].tool && points[a].tool_length == points[b].tool_length &&
         std::abs(in_.reference.feed(a) - in_.reference.feed(b)) <=
             kSameFeed * in_.reference.feed(b);
}

// Behind the last move of the run that begins with move `first`.
std::size_t BlockRuns::longest_run(std::size_t first, const Rules& rules) const {
  std::size_t limit = first + 1;
  while (limit < program_.moves.size() && may_follow(limit)) ++limit;
  std::size_t good = first + 1, step = 1;
  std::size_t bad = limit + 1;
  while (good < limit) {
    const std::size_t next = std::min(good + step, limit);
    if (!rules.holds(first, next)) {
      bad = next;
      break;
    }
    good = next;
    step *= 2;
  }
  while (good + 1 < bad && bad <= limit) {
    const std::size_t middle = good + (bad - good) / 2;
    (rules.holds(first, middle) ? good : bad) = middle;
  }
  return good;
}

/// Length of the tip's way of the input that a move stands for, mm.
double BlockRuns::way(std::size_t i) const {
  const MachineMove& m = program_.moves[i];
  double length = 0.0;
  for (std::uint32_t k = m.from_segment; k <= m.segment; ++k)
    length += in_.reference.length(k) *
              ((k == m.segment ? m.to_share : 1.0) - (k == m.from_segment ? m.from_share : 0.0));
  return length;
}

// τ of the run's polynomial that is paired with the end of each of its moves; empty: a run over
// several segments on which the tip stands.
std::vector<double> BlockRuns::pairing(std::size_t first, std::size_t end) const {
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

bool BlockRuns::keeps_time(std::size_t first, std::size_t end,
                           const std::vector<double>& even) const {
  const double time = duration(first, end);
  double passed = 0.0;
  for (std::size_t i = first; i < end; ++i) {
    passed += program_.moves[i].duration;
    if (std::abs(even[i - first] * time - passed) > kShortBlock) return false;
  }
  return true;
}

bool BlockRuns::is_near(std::size_t i, const JointVector& joints, const JointVector& wanted) const {
  const double length = program_.moves[i].tool_length;
  const CutterLocation a = forward_location(in_.chain, joints);
  const CutterLocation b = forward_location(in_.chain, wanted);
  return (a.tip - b.tip - length * (a.axis - b.axis)).norm() <= tip_ &&
         (a.axis - b.axis).norm() <= axis_;
}

}  // namespace smoothpost
