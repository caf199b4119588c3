#include "kernels/kinematics/track_candidates.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "kernels/core/units.h"

namespace smoothpost {
namespace {

constexpr double kTurn = 2.0 * kPi;
// Positions may pass a limit by this (mm or rad): the rounding of a value that lies on it.
constexpr double kSlack = 1e-9;
// Tool axes this close to a pole (rad) are at it, whatever the cap.
constexpr double kAtPole = 1e-9;

double wrapped(double angle) {
  const double a = std::remainder(angle, kTurn);
  return a <= -kPi ? kPi : a;
}

// Tracks of a pole run: held 0-1, ahead 2-3, through 4-15.
constexpr std::uint8_t kAhead = 2;
constexpr std::uint8_t kThrough = 4;

/// Values that the first rotary may have on one side of a pole run, by branch.
struct RunEnd {
  std::array<double, 2> first{};
  std::array<bool, 2> valid{false, false};
};

class CandidateBuilder {
 public:
  CandidateBuilder(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                   const BranchTrackingSettings& settings)
      : pair_(pair), points_(points), settings_(settings) {}

  TrackCandidates build() {
    out_.layers.resize(points_.size());
    out_.candidates.reserve(2 * points_.size());
    if (const auto breach = held_breach()) {
      fail_over_limit(0, *breach);
      return std::move(out_);
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto pole = pair_.nearest_pole(points_[i].location.axis, settings_.held);
      if (pole && pole->angle <= std::max(settings_.pole_cap, kAtPole)) {
        if (poles_.empty()) run_begin_ = i;
        poles_.push_back(pole->second);
        continue;
      }
      if (!add_branches(i) || !close_run(i)) return std::move(out_);
    }
    close_run(points_.size());
    return std::move(out_);
  }

 private:
  const ScrewChain& chain() const { return pair_.chain(); }

  std::optional<LimitBreach> held_breach() const {
    for (int j = 0; j < chain().size(); ++j) {
      const ChainJoint& joint = chain().joints[j];
      const double value = settings_.held[j];
      if (joint.redundant && (value < joint.lower - kSlack || value > joint.upper + kSlack))
        return LimitBreach{j, value};
    }
    return std::nullopt;
  }

  std::optional<LimitBreach> rotary_breach(int j, double angle) const {
    const ChainJoint& joint = chain().joints[j];
    const TurnRange turns = turns_within(angle, joint.lower, joint.upper);
    if (turns.first <= turns.last) return std::nullopt;
    // The turn nearest to the range.
    const double middle = 0.5 * (joint.lower + joint.upper);
    return LimitBreach{j, angle + kTurn * std::round((middle - angle) / kTurn)};
  }

  std::optional<LimitBreach> any_breach(const JointVector& q) const {
    if (auto breach = rotary_breach(pair_.first_rotary(), q[pair_.first_rotary()])) return breach;
    if (auto breach = rotary_breach(pair_.second_rotary(), q[pair_.second_rotary()])) return breach;
    return linear_breach(chain(), q);
  }

  void fail_over_limit(std::size_t point, const LimitBreach& breach) {
    out_.failure.status = BranchTracking::Status::over_limit;
    out_.failure.point = point;
    out_.failure.joint = breach.joint;
    out_.failure.reason = describe_breach(chain(), breach);
  }

  void fail_unreachable(std::size_t point) {
    const Vec3& axis = points_[point].location.axis;
    out_.failure.status = BranchTracking::Status::unreachable;
    out_.failure.point = point;
    out_.failure.reason = "the rotary joints " + std::to_string(pair_.first_rotary() + 1) +
                          " and " + std::to_string(pair_.second_rotary() + 1) +
                          " cannot bring the tool to the axis (" + describe_number(axis.x()) +
                          ", " + describe_number(axis.y()) + ", " + describe_number(axis.z()) + ")";
  }

  /// The branches of an ordinary point; false when it has none.
  bool add_branches(std::size_t i) {
    const RotaryPairSolutions solutions = pair_.solve(points_[i].location, settings_.held);
    TrackLayer& layer = out_.layers[i];
    layer.begin = out_.candidates.size();
    layer.count = 2;
    bool any = false;
    for (int b = 0; b < 2; ++b) {
      TrackCandidate candidate;
      candidate.branch = static_cast<std::uint8_t>(b);
      if (solutions.valid[b]) {
        candidate.first = solutions.q[b][pair_.first_rotary()];
        candidate.second = solutions.q[b][pair_.second_rotary()];
        candidate.valid = !any_breach(solutions.q[b]);
        any = any || candidate.valid;
      }
      out_.candidates.push_back(candidate);
    }
    if (any) return true;
    if (!solutions.valid[0] && !solutions.valid[1]) {
      fail_unreachable(i);
      return false;
    }
    explain_branches(i, solutions);
    return false;
  }

  void explain_branches(std::size_t i, const RotaryPairSolutions& solutions) {
    for (int b = 0; b < 2; ++b) {
      if (!solutions.valid[b]) continue;
      const auto breach = any_breach(solutions.q[b]);
      const std::string before = out_.failure.reason;
      fail_over_limit(i, *breach);
      if (!before.empty())
        out_.failure.reason = before + "; with the other branch " + out_.failure.reason;
    }
  }

  RunEnd end_of(std::size_t i) const {
    RunEnd end;
    const TrackLayer& layer = out_.layers[i];
    for (int b = 0; b < 2; ++b) {
      end.first[b] = out_.candidates[layer.begin + b].first;
      end.valid[b] = out_.candidates[layer.begin + b].valid;
    }
    return end;
  }

  bool has_link(std::size_t from, std::size_t to) const {
    for (std::size_t i = from; i <= to && i < points_.size(); ++i)
      if (!points_[i].cut) return true;
    return false;
  }

  /// Gives the points of the open run, which ends before point `next`, their candidates.
  bool close_run(std::size_t next) {
    if (poles_.empty()) return true;
    const bool has_before = run_begin_ > 0;
    const bool has_after = next < points_.size();
    const RunEnd before = has_before ? end_of(run_begin_ - 1) : start_value();
    const RunEnd after = has_after ? end_of(next) : RunEnd{};
    const bool link = has_link(has_before ? run_begin_ : run_begin_ + 1, next);
    for (std::size_t i = run_begin_; i < next; ++i) {
      out_.layers[i] = {out_.candidates.size(), 0, true};
      // Without a link, a run between two tilted points goes through and one at the start begins as
      // it ends.
      if (has_before && has_after && !link) add_through(i, before, after);
      if (link || !has_after || (has_before && out_.layers[i].count == 0)) add_held(i, before);
      if (link || !has_before) add_ahead(i, after, link);
      if (!check_pole_layer(i)) return false;
    }
    poles_.clear();
    return true;
  }

  RunEnd start_value() const {
    const int j = pair_.first_rotary();
    const ChainJoint& joint = chain().joints[j];
    RunEnd start;
    start.first[0] = wrapped(std::min(std::max(settings_.held[j], joint.lower), joint.upper));
    start.valid[0] = true;
    return start;
  }

  void add_held(std::size_t i, const RunEnd& before) {
    for (std::uint8_t b = 0; b < 2; ++b)
      if (before.valid[b]) add_pole(i, {before.first[b], 0.0, b, b, false, false, false});
  }

  void add_ahead(std::size_t i, const RunEnd& after, bool link) {
    for (std::uint8_t b = 0; b < 2; ++b) {
      const auto track = static_cast<std::uint8_t>(kAhead + b);
      if (after.valid[b]) add_pole(i, {after.first[b], 0.0, b, track, false, link, false});
    }
  }

  /// The tracks that go linearly from a value before the run to one behind it, by up to a turn
  /// either way: on the motions between points at the pole, or when these are too few also on the
  /// motions into and out of the run.
  void add_through(std::size_t i, const RunEnd& before, const RunEnd& after) {
    const auto count = static_cast<double>(poles_.size());
    const auto place = static_cast<double>(i - run_begin_);
    const double step = std::min(settings_.continuity, kPi);
    for (int pair = 0; pair < 4; ++pair) {
      const int b = pair / 2;
      const int c = pair % 2;
      if (!before.valid[b] || !after.valid[c]) continue;
      const double nearest = wrapped(after.first[c] - before.first[b]);
      for (int turn = -1; turn <= 1; ++turn) {
        const double whole = nearest + kTurn * turn;
        const bool inside = std::abs(whole) <= (count - 1.0) * step;
        if (!inside && std::abs(whole) > (count + 1.0) * step) continue;
        const double share =
            inside ? place / std::max(count - 1.0, 1.0) : (place + 1.0) / (count + 1.0);
        const auto track = static_cast<std::uint8_t>(kThrough + 3 * pair + turn + 1);
        add_pole(i, {wrapped(before.first[b] + share * whole), 0.0, static_cast<std::uint8_t>(c),
                     track, false, false});
      }
    }
  }

  void add_pole(std::size_t i, TrackCandidate candidate) {
    candidate.second = poles_[i - run_begin_];
    candidate.valid = !pole_breach(i, candidate);
    out_.candidates.push_back(candidate);
    ++out_.layers[i].count;
  }

  std::optional<LimitBreach> pole_breach(std::size_t i, const TrackCandidate& candidate) const {
    JointVector q = settings_.held;
    q[pair_.first_rotary()] = candidate.first;
    q[pair_.second_rotary()] = candidate.second;
    const auto solved = pair_.with_linears(points_[i].location.tip, q);
    if (!solved) return LimitBreach{pair_.second_rotary(), candidate.second};
    return any_breach(*solved);
  }

  /// False, with the failure, when no track has this point within the limits.
  bool check_pole_layer(std::size_t i) {
    const TrackLayer& layer = out_.layers[i];
    for (std::size_t k = 0; k < layer.count; ++k)
      if (out_.candidates[layer.begin + k].valid) return true;
    const auto breach = pole_breach(i, out_.candidates[layer.begin]);
    fail_over_limit(i, *breach);
    return false;
  }

  const RotaryPair& pair_;
  const std::vector<TrackingPoint>& points_;
  const BranchTrackingSettings& settings_;
  TrackCandidates out_;
  std::size_t run_begin_ = 0;  ///< first point of the open run
  std::vector<double> poles_;  ///< the second rotary's value at its points; empty: no run is open
};

}  // namespace

TrackCandidates track_candidates(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                                 const BranchTrackingSettings& settings) {
  return CandidateBuilder(pair, points, settings).build();
}

TurnRange turns_within(double angle, double lower, double upper) {
  // Far beyond any number of turns that is ever searched, and safe to convert.
  constexpr double kMost = 1e6;
  const double first = std::ceil((lower - kSlack - angle) / kTurn);
  const double last = std::floor((upper + kSlack - angle) / kTurn);
  return {static_cast<int>(std::clamp(first, -kMost, kMost)),
          static_cast<int>(std::clamp(last, -kMost, kMost))};
}

std::optional<LimitBreach> linear_breach(const ScrewChain& chain, const JointVector& q) {
  for (int j = 0; j < chain.size(); ++j) {
    const ChainJoint& joint = chain.joints[j];
    if (joint.kind != JointKind::linear || joint.redundant) continue;
    if (q[j] < joint.lower - kSlack || q[j] > joint.upper + kSlack) return LimitBreach{j, q[j]};
  }
  return std::nullopt;
}

std::string describe_number(double value) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value + 0.0,
                                 std::chars_format::fixed, 3);
  const std::string out(text.data(), end.ptr);
  return out == "-0.000" ? "0.000" : out;
}

std::string describe_breach(const ScrewChain& chain, const LimitBreach& breach) {
  const ChainJoint& joint = chain.joints[breach.joint];
  const bool rotary = joint.kind == JointKind::rotary;
  const double scale = rotary ? kDegreesPerRadian : 1.0;
  const std::string unit = rotary ? " degrees" : " mm";
  const bool above = breach.value > joint.upper;
  return "joint " + std::to_string(breach.joint + 1) + " would be at " +
         describe_number(scale * breach.value) + unit + ", its " + (above ? "upper" : "lower") +
         " limit is " + describe_number(scale * (above ? joint.upper : joint.lower)) + unit;
}

}  // namespace smoothpost
