#include "kernels/kinematics/branch_tracking.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/kinematics/track_candidates.h"
#include "kernels/kinematics/turn_search.h"

namespace smoothpost {
namespace {

constexpr double kTurn = 2.0 * kPi;
// The most turns that are looked for at all, whatever the limits say.
constexpr double kMostTurns = 16384.0;
// The first search looks for at least this many turns of the first rotary, and at most this many of
// the second.
constexpr double kFewestTurns = 8.0;
constexpr double kSecondTurns = 4.0;

/// How many turns of each rotary are searched.
struct TurnWindow {
  double first = kFewestTurns;
  double second = kSecondTurns;
};

/// The joint's range, cut to `turns` turns about `start` where it is wider.
TurnLimits limits_about(const ChainJoint& joint, double start, double turns) {
  TurnLimits limits{joint.lower, joint.upper, start};
  const double width = kTurn * turns;
  if (!(joint.upper - joint.lower > width)) return limits;
  double middle = std::max(start, joint.lower + 0.5 * width);
  middle = std::min(middle, joint.upper - 0.5 * width);
  limits.lower = middle - 0.5 * width;
  limits.upper = middle + 0.5 * width;
  return limits;
}

TurnWindow first_window(const std::vector<TrackingPoint>& points, std::size_t memory) {
  const auto links = static_cast<double>(
      std::count_if(points.begin(), points.end(), [](const TrackingPoint& p) { return !p.cut; }));
  TurnWindow window;
  window.first = static_cast<double>(memory) / (2.0 * kSecondTurns * std::max(links, 1.0));
  window.first = std::clamp(std::floor(window.first), kFewestTurns, kMostTurns);
  return window;
}

double range_in_turns(const ChainJoint& joint) { return (joint.upper - joint.lower) / kTurn; }

struct Tracker {
  const RotaryPair& pair;
  const std::vector<TrackingPoint>& points;
  const BranchTrackingSettings& settings;
  const TrackCandidates& candidates;

  const ChainJoint& rotary(int r) const { return pair.chain().joints[joint_of(r)]; }
  int joint_of(int r) const { return r == 0 ? pair.first_rotary() : pair.second_rotary(); }
  double step() const { return std::min(settings.continuity, kPi); }

  TurnSearchResult search() const {
    TurnWindow window = first_window(points, settings.turn_memory);
    for (;;) {
      TurnSearchSettings search;
      search.step = step();
      search.rotary[0] = limits_about(rotary(0), settings.held[joint_of(0)], window.first);
      search.rotary[1] = limits_about(rotary(1), settings.held[joint_of(1)], window.second);
      TurnSearchResult result = search_turns(candidates, points, search);
      const bool whole = window.first >= std::min(range_in_turns(rotary(0)), kMostTurns) &&
                         window.second >= std::min(range_in_turns(rotary(1)), kMostTurns);
      if (result.dead_ends.empty() || whole) return result;
      window.first = std::min(4.0 * window.first, kMostTurns);
      window.second = std::min(4.0 * window.second, kMostTurns);
    }
  }

  void take(const TurnSearchResult& found, BranchTracking& out) const {
    out.cost = found.cost;
    out.q.reserve(points.size());
    out.branch.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      JointVector q = settings.held;
      q[joint_of(0)] = found.rotary[i][0];
      q[joint_of(1)] = found.rotary[i][1];
      const auto solved = pair.with_linears(points[i].location.tip, q);
      require(solved.has_value(), "a chosen candidate has its linears");
      out.q.push_back(*solved);
      const TrackLayer& layer = candidates.layers[i];
      out.branch.push_back(candidates.candidates[layer.begin + found.candidate[i]].branch);
    }
  }

  /// Where the state before the dead end could have gone: the candidate of the same branch or
  /// track, otherwise the first.
  const TrackCandidate& continuation(const DeadEnd& end) const {
    const TrackLayer& before = candidates.layers[end.point - 1];
    const TrackLayer& layer = candidates.layers[end.point];
    const TrackCandidate& from = candidates.candidates[before.begin + end.candidate];
    const bool by_track = before.pole && layer.pole;
    for (std::size_t k = 0; k < layer.count; ++k) {
      const TrackCandidate& to = candidates.candidates[layer.begin + k];
      if (by_track ? to.track == from.track : to.branch == from.branch) return to;
    }
    return candidates.candidates[layer.begin];
  }

  /// Value of a rotary at its nearest turn.
  static double nearest(double angle, double from) {
    return angle + kTurn * std::round((from - angle) / kTurn);
  }

  Rewind explain(const DeadEnd& end) const {
    const TrackCandidate& to = continuation(end);
    Rewind rewind{end.point, points[end.point].line, joint_of(0), ""};
    const std::array<double, 2> angles{to.first, to.second};
    for (int r = 0; r < 2; ++r) {
      const double value = nearest(angles[r], end.from[r]);
      const double change = std::abs(value - end.from[r]);
      if (change <= step() * (1.0 + 1e-12) + 1e-12) continue;
      rewind.joint = joint_of(r);
      rewind.reason = "joint " + std::to_string(joint_of(r) + 1) + " would turn by " +
                      describe_number(change * kDegreesPerRadian) +
                      " degrees in one motion of a cut, at most " +
                      describe_number(step() * kDegreesPerRadian) +
                      " degrees are taken as continuous";
      return rewind;
    }
    for (int r = 0; r < 2; ++r) {
      const double value = nearest(angles[r], end.from[r]);
      const TurnRange turns = turns_within(value, rotary(r).lower, rotary(r).upper);
      if (turns.first <= 0 && turns.last >= 0) continue;
      rewind.joint = joint_of(r);
      rewind.reason = describe_breach(pair.chain(), {joint_of(r), value}) +
                      ", and the cut leaves no motion to turn back on";
      return rewind;
    }
    explain_linear(end, to, rewind);
    return rewind;
  }

  void explain_linear(const DeadEnd& end, const TrackCandidate& to, Rewind& rewind) const {
    JointVector q = settings.held;
    q[joint_of(0)] = to.first;
    q[joint_of(1)] = to.second;
    const auto solved = pair.with_linears(points[end.point].location.tip, q);
    if (!solved) return;
    const auto breach = linear_breach(pair.chain(), *solved);
    if (!breach) return;
    rewind.joint = breach->joint;
    rewind.reason = describe_breach(pair.chain(), *breach) +
                    " on the branch that the cut is on, and the cut leaves no motion to change it";
  }
};

}  // namespace

BranchTracking track_branches(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                              const BranchTrackingSettings& settings) {
  require(settings.held.size() == pair.chain().size(), "one held value per joint");
  require(settings.continuity > 0.0, "continuity is positive");
  require(settings.pole_cap >= 0.0 && settings.pole_cap < 0.5, "pole cap is in [0, 0.5) rad");
  BranchTracking out;
  if (points.empty()) return out;
  const TrackCandidates candidates = track_candidates(pair, points, settings);
  if (candidates.failure.status != BranchTracking::Status::ok) return candidates.failure;
  const Tracker tracker{pair, points, settings, candidates};
  const TurnSearchResult found = tracker.search();
  if (found.dead_ends.empty()) {
    tracker.take(found, out);
    return out;
  }
  out.status = BranchTracking::Status::rewind_needed;
  for (const DeadEnd& end : found.dead_ends) out.rewinds.push_back(tracker.explain(end));
  out.point = out.rewinds.front().point;
  out.joint = out.rewinds.front().joint;
  out.reason = out.rewinds.front().reason;
  return out;
}

}  // namespace smoothpost
