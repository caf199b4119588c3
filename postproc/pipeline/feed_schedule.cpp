#include "postproc/pipeline/feed_schedule.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <thread>

#include "kernels/core/units.h"
#include "postproc/pipeline/conversion_notes.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/machine_program.h"
#include "postproc/pipeline/stretch_feed.h"

namespace smoothpost {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kBlockRounds = 1;  // caps for blocks that are too short
// Elements a quarter as long as a joint takes from no acceleration to its largest: 0.2 % slower
// than half of that (findings of the schedule, section 3).
constexpr double kElementShare = 0.25, kShortestElement = 0.007, kLongestElement = 0.030;
constexpr double kBlockReserve = 1e-3;  // by which those caps are lower
constexpr double kPeakStep = 5e-4;      // s, where peaks are looked for
constexpr double kLeastTime = 1e-4;     // s, of a block that goes nowhere
constexpr double kNoBlock = 1e-6;       // of a stretch: no way
constexpr double kFull = 0.995;         // of the programmed feed: not slowed

/// The motion without its position.
ScheduledStretch::Motion derivatives_at(const ScheduledStretch& stretch, const FeedState& state) {
  const double c = 1.0 / stretch.slowing;
  const double v = state.first * c, a = state.second * c * c, j = state.third * c * c * c;
  const PathJet jet = stretch.joints.jet(stretch.joints.piece_at(state.s), state.s);
  ScheduledStretch::Motion m;
  m.velocity = v * jet.first;
  m.acceleration = v * v * jet.second + a * jet.first;
  m.jerk = v * v * v * jet.third + 3.0 * v * a * jet.second + j * jet.first;
  return m;
}

class Scheduler {
 public:
  Scheduler(const ScheduleInput& input, const Progress& progress)
      : in_(input),
        machine_(input.path.machine),
        samples_(input.path.plan.samples),
        limits_(feed_limits(input.path.machine)),
        settings_(feed_settings(input.path.machine)),
        progress_(progress) {}

  Result<FeedSchedule> run() {
    FeedSchedule out;
    std::vector<JointStretch> stretches = joint_stretches(in_.path);
    std::vector<TooFast> overloaded;
    if (machine_.recipe.schedule == "programmed")
      stretches = at_programmed_feed(std::move(stretches), in_.path, limits_, overloaded);
    if (machine_.recipe.schedule == "constant")
      lower_to_constant(stretches, in_.cuts, samples_, limits_);
    if (!overloaded.empty())
      return Result<FeedSchedule>::failure(too_fast_problem(overloaded, machine_, in_.file_name));
    for (JointStretch& stretch : stretches) {
      ScheduledStretch scheduled;
      scheduled.joints = std::move(stretch);
      out.stretches.push_back(std::move(scheduled));
    }
    std::vector<Found> found(out.stretches.size());
    if (!solve_all(out.stretches, found))
      return Result<FeedSchedule>::failure(
          diagnostic("KN105", "cancelled while the feed was scheduled", in_.file_name));
    out.peaks.assign(machine_.axes.size(), {});
    for (std::size_t k = 0; k < found.size(); ++k) {
      problems_.insert(problems_.end(), found[k].problems.begin(), found[k].problems.end());
      if (has_error(problems_)) return Result<FeedSchedule>::failure(std::move(problems_));
      const ScheduledStretch& stretch = out.stretches[k];
      out.time += stretch.duration();
      if (stretch.joints.end != StopCause::path_end) ++out.stops;
      merge(found[k], out);
    }
    return Result<FeedSchedule>(std::move(out), std::move(problems_));
  }

 private:
  /// What one stretch gives to the whole.
  struct Found {
    Diagnostics problems;
    std::vector<SlowedBy> slowed_by;
    std::vector<JointPeaks> peaks;
    double slowest_cut = kInfinity;
    std::uint32_t slowest_cut_line = 0;
  };

  /// Every stretch by itself, on all threads. Only the caller's thread asks for progress. False:
  /// cancelled.
  bool solve_all(std::vector<ScheduledStretch>& stretches, std::vector<Found>& found) const {
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<std::size_t> done = 0;
    std::atomic<bool> going = true;
    const Progress look{[&](const char*, double) {
      if (std::this_thread::get_id() == caller &&
          !progress_("schedule",
                     static_cast<double>(done.load()) / static_cast<double>(stretches.size())))
        going = false;
      return going.load();
    }};
    tbb::parallel_for(std::size_t{0}, stretches.size(), [&](std::size_t k) {
      if (!look("schedule", 0.0)) return;
      solve(stretches[k], found[k], look);
      ++done;
    });
    return going;
  }

  static void merge(const Found& found, FeedSchedule& out) {
    for (const SlowedBy& slow : found.slowed_by) add(out.slowed_by, slow);
    for (std::size_t j = 0; j < found.peaks.size(); ++j) {
      const JointPeaks& peak = found.peaks[j];
      JointPeaks& most = out.peaks[j];
      see(peak.velocity, peak.velocity_line, most.velocity, most.velocity_line);
      see(peak.acceleration, peak.acceleration_line, most.acceleration, most.acceleration_line);
      see(peak.jerk, peak.jerk_line, most.jerk, most.jerk_line);
      most.jerk_square_integral += peak.jerk_square_integral;
    }
    if (found.slowest_cut < out.slowest_cut) {
      out.slowest_cut = found.slowest_cut;
      out.slowest_cut_line = found.slowest_cut_line;
    }
  }

  void solve(ScheduledStretch& stretch, Found& found, const Progress& progress) const {
    if (!(stretch.joints.length() > 0.0)) return;
    std::vector<RateCap> caps;
    FeedResult result;
    for (int round = 0; round <= kBlockRounds; ++round) {
      result = schedule_feed(feed_path(stretch.joints, caps), limits_, {}, {}, settings_, progress);
      if (result.status != FeedStatus::solved && result.status != FeedStatus::constant_map) break;
      const std::vector<RateCap> more = short_blocks(stretch.joints, result.profile);
      if (more.empty() || round == kBlockRounds) break;
      for (const RateCap& cap : more) add(caps, cap);
    }
    if (result.status == FeedStatus::empty) return;
    if (result.status != FeedStatus::solved && result.status != FeedStatus::constant_map) {
      found.problems.push_back(no_law(stretch.joints, result));
      return;
    }
    stretch.profile = std::move(result.profile);
    for (std::size_t i = 1; i < stretch.joints.sample_s.size(); ++i) {
      const double time = block_time(stretch.joints, stretch.profile, i);
      if (moves(stretch.joints, i))
        stretch.slowing = std::max(stretch.slowing, machine_.cycle.min_block / time);
    }
    const std::array<double, 2> inside = between_ramps(stretch.profile);
    tell_bindings(stretch, result, inside, found.slowed_by);
    see_cut_speed(stretch, inside, found);
    found.peaks.assign(machine_.axes.size(), {});
    see_peaks(stretch, found.peaks);
  }

  // Sample i is not at the place of the one before it.
  static bool moves(const JointStretch& stretch, std::size_t i) {
    return stretch.sample_s[i] - stretch.sample_s[i - 1] > kNoBlock * stretch.length();
  }

  static double block_time(const JointStretch& stretch, const FeedProfile& profile, std::size_t i) {
    return profile.time(stretch.sample_s[i]) - profile.time(stretch.sample_s[i - 1]);
  }

  // Caps for blocks that the control would have to make in less than its least time.
  std::vector<RateCap> short_blocks(const JointStretch& stretch, const FeedProfile& profile) const {
    std::vector<RateCap> caps;
    const double least = machine_.cycle.min_block;
    double before = 0.0;
    for (std::size_t i = 1; i < stretch.sample_s.size(); ++i) {
      const double now = profile.time(stretch.sample_s[i]);
      const double way = stretch.sample_s[i] - stretch.sample_s[i - 1];
      if (moves(stretch, i) && now - before < least * (1.0 - 1e-9))
        caps.push_back(
            {stretch.sample_s[i - 1], stretch.sample_s[i], (1.0 - kBlockReserve) * way / least});
      before = now;
    }
    return caps;
  }

  // The same block again: its cap falls a little more.
  static void add(std::vector<RateCap>& caps, const RateCap& cap) {
    for (RateCap& old : caps)
      if (old.from == cap.from) {
        old.rate *= 0.98;
        return;
      }
    caps.insert(
        std::upper_bound(caps.begin(), caps.end(), cap,
                         [](const RateCap& a, const RateCap& b) { return a.from < b.from; }),
        cap);
  }

  std::uint32_t line_at(const JointStretch& stretch, double s) const {
    return stretch.line[stretch.piece_at(s)];
  }

  const std::string& axis_name(int joint) const {
    return machine_.axes[static_cast<std::size_t>(joint)].name;
  }

  Diagnostic no_law(const JointStretch& stretch, const FeedResult& result) const {
    const FeedWitness& w = result.witness;
    std::string why;
    switch (result.status) {
      case FeedStatus::no_limit:
        why = w.joint >= 0 ? "axis " + axis_name(w.joint) + " moves and has no limit above 0"
                           : "the programmed feed is not above 0";
        break;
      case FeedStatus::not_smooth:
        why = "the path jumps by " + four_digits(w.value) + " in its direction or curvature";
        break;
      case FeedStatus::not_finite:
        why = "a derivative of the joints is not finite";
        break;
      default:
        why = "no joint moves at a place where the path goes on";
    }
    return diagnostic("KN160", "there is no time law for the path here: " + why, in_.file_name,
                      static_cast<int>(line_at(stretch, w.s)));
  }

  // --- what was found --------------------------------------------------------------------------

  void tell_bindings(const ScheduledStretch& stretch, const FeedResult& result,
                     const std::array<double, 2>& inside, std::vector<SlowedBy>& slowed_by) const {
    const JointStretch& joints = stretch.joints;
    for (FeedBinding b : result.bindings) {
      b.from = std::max(b.from, inside[0]);
      b.to = std::min(b.to, inside[1]);
      if (b.joint < 0 || b.from >= b.to) continue;
      const double factor = least_share_of_feed(stretch, b);
      if (factor >= kFull) continue;
      add(slowed_by, {b.joint, b.kind, line_at(joints, b.from), line_at(joints, b.to), factor,
                      samples_[joints.first_sample + 1].segment});
    }
  }

  // At the end, or to the last one where that goes on.
  static void add(std::vector<SlowedBy>& all, const SlowedBy& slow) {
    SlowedBy* last = all.empty() ? nullptr : &all.back();
    if (last && last->joint == slow.joint && last->limit == slow.limit &&
        slow.first_line <= last->last_line + 1 && slow.first_line >= last->first_line) {
      last->last_line = std::max(last->last_line, slow.last_line);
      last->factor = std::min(last->factor, slow.factor);
    } else {
      all.push_back(slow);
    }
  }

  // s where the ramp from rest ends and the one to rest begins: the first and last top of the
  // speed.
  static std::array<double, 2> between_ramps(const FeedProfile& profile) {
    const double duration = profile.duration();
    const auto steps = static_cast<int>(std::clamp(duration / kPeakStep, 16.0, 1e6));
    const auto at = [&](int k) { return profile.at(duration * k / steps); };
    int first = 1;  // the first after which the speed does not rise
    while (first <= steps && at(first).second > 0.0) ++first;
    if (first > steps) return {0.0, 0.0};
    int last = steps;  // the last of those before which it does
    for (bool falls = !(at(last).second > 0.0); last > first; --last) {
      const bool fell = !(at(last - 1).second > 0.0);
      if (falls && !fell) break;
      falls = fell;
    }
    return {at(first).s, at(last).s};
  }

  void see_cut_speed(const ScheduledStretch& stretch, const std::array<double, 2>& inside,
                     Found& found) const {
    const JointStretch& joints = stretch.joints;
    if (std::find(joints.beam.begin(), joints.beam.end(), true) == joints.beam.end()) return;
    const double from = stretch.profile.time(inside[0]), to = stretch.profile.time(inside[1]);
    const auto steps = static_cast<int>(std::clamp((to - from) / kPeakStep, 1.0, 1e6));
    for (int k = 0; k <= steps; ++k) {
      const FeedState state = stretch.profile.at(from + (to - from) * k / steps);
      const std::size_t piece = joints.piece_at(state.s);
      const PathJet jet = joints.jet(piece, state.s);
      const double speed = jet.tip_first * state.first / stretch.slowing;
      if (!joints.beam[piece] || jet.tip_first <= 0.0 || speed >= found.slowest_cut) continue;
      found.slowest_cut = speed;
      found.slowest_cut_line = joints.line[piece];
    }
  }

  double least_share_of_feed(const ScheduledStretch& stretch, const FeedBinding& b) const {
    double least = kInfinity;
    for (int k = 0; k <= 4; ++k) {
      const double s = b.from + 0.25 * k * (b.to - b.from);
      const std::size_t piece = stretch.joints.piece_at(s);
      const double speed = stretch.profile.at(stretch.profile.time(s)).first / stretch.slowing;
      const double feed = stretch.joints.feed[piece];
      if (std::isfinite(feed))
        least = std::min(least, speed * stretch.joints.jet(piece, s).tip_first / feed);
    }
    return least;
  }

  void see_peaks(const ScheduledStretch& stretch, std::vector<JointPeaks>& peaks) const {
    const double duration = stretch.duration();
    if (!(duration > 0.0)) return;
    const auto steps = static_cast<std::size_t>(std::ceil(duration / kPeakStep)) + 1;
    const double step = duration / static_cast<double>(steps);
    for (std::size_t k = 0; k <= steps; ++k) {
      const double t = static_cast<double>(k) * step;
      const FeedState state = stretch.profile.at(t / stretch.slowing);
      const ScheduledStretch::Motion m = derivatives_at(stretch, state);
      const std::uint32_t line = line_at(stretch.joints, state.s);
      for (std::size_t j = 0; j < peaks.size(); ++j) {
        JointPeaks& p = peaks[j];
        const auto row = static_cast<Eigen::Index>(j);
        see(std::abs(m.velocity[row]), line, p.velocity, p.velocity_line);
        see(std::abs(m.acceleration[row]), line, p.acceleration, p.acceleration_line);
        see(std::abs(m.jerk[row]), line, p.jerk, p.jerk_line);
        p.jerk_square_integral += step * m.jerk[row] * m.jerk[row];
      }
    }
  }

  static void see(double value, std::uint32_t line, double& most, std::uint32_t& where) {
    if (value <= most) return;
    most = value;
    where = line;
  }

  const ScheduleInput& in_;
  const MachineDefinition& machine_;
  const std::vector<JointSample>& samples_;
  FeedLimits limits_;
  FeedSettings settings_;
  const Progress& progress_;
  Diagnostics problems_;
};

}  // namespace

ScheduledStretch::Motion ScheduledStretch::at(double t) const {
  const FeedState state = profile.at(t / slowing);
  Motion m = derivatives_at(*this, state);
  m.position = joints.joints_at(state.s);
  return m;
}

double ScheduledStretch::tip_speed(double t) const {
  const FeedState state = profile.at(t / slowing);
  return state.first / slowing * joints.jet(joints.piece_at(state.s), state.s).tip_first;
}

const char* word(FeedWitness::Kind limit) {
  switch (limit) {
    case FeedWitness::Kind::velocity:
      return "velocity";
    case FeedWitness::Kind::acceleration:
      return "acceleration";
    case FeedWitness::Kind::jerk:
      return "jerk";
    case FeedWitness::Kind::turn_rate:
      return "turn rate";
    default:
      return "feed";
  }
}

Diagnostics schedule_notes(const FeedSchedule& schedule, const MachineDefinition& machine,
                           const std::string& file_name) {
  Diagnostics notes;
  const auto add = [&](std::string text, std::uint32_t line) {
    notes.push_back(diagnostic("KN161", std::move(text), file_name, static_cast<int>(line)));
    notes.back().severity = Severity::note;
  };
  const auto slowest =
      std::min_element(schedule.slowed_by.begin(), schedule.slowed_by.end(),
                       [](const SlowedBy& a, const SlowedBy& b) { return a.factor < b.factor; });
  if (slowest != schedule.slowed_by.end())
    add("slower than programmed on " + std::to_string(schedule.slowed_by.size()) +
            " stretches, most here: " + four_digits(100.0 * slowest->factor) +
            " % of the feed, for the " + word(slowest->limit) + " limit of axis " +
            machine.axes[static_cast<std::size_t>(slowest->joint)].name +
            " (cuts[].slowed_by in the report has them all)",
        slowest->first_line);
  if (schedule.stops > 0)
    add("the path stops at " + std::to_string(schedule.stops) +
            " places inside its cuts (corners that are not blended, dwells, events)",
        0);
  return notes;
}

FeedLimits feed_limits(const MachineDefinition& machine) {
  const JointLimits limits = limits_of(machine);
  FeedLimits out;
  out.velocity = machine.tolerance.limit_share * limits.velocity;
  out.acceleration = machine.tolerance.limit_share * limits.acceleration;
  out.jerk = machine.tolerance.limit_share * limits.jerk;
  for (int j = 0; j < machine.size(); ++j)
    if (machine.axes[static_cast<std::size_t>(j)].source == LimitSource::assumed)
      out.velocity[j] *= kAssumedShare;
  return out;
}

FeedSettings feed_settings(const MachineDefinition& machine) {
  const FeedLimits limits = feed_limits(machine);
  const double shortest = limits.acceleration.cwiseQuotient(limits.jerk).minCoeff();
  FeedSettings settings;
  settings.element_time = std::clamp(kElementShare * shortest, kShortestElement, kLongestElement);
  settings.smooth_share = 1.0;  // joint_stretches() has looked at that
  return settings;
}

Result<FeedSchedule> schedule_plan(const ScheduleInput& input, const Progress& progress) {
  return Scheduler(input, progress).run();
}

std::vector<JointSample> timed_samples(std::vector<JointSample> samples,
                                       const FeedSchedule& schedule) {
  for (std::size_t k = 0; k < schedule.stretches.size(); ++k) {
    const ScheduledStretch& stretch = schedule.stretches[k];
    if (!(stretch.duration() > 0.0)) continue;
    const JointStretch& joints = stretch.joints;
    double before = 0.0;
    for (std::size_t i = 1; i < joints.sample_s.size(); ++i) {
      JointSample& sample = samples[joints.first_sample + i];
      sample.stretch = static_cast<std::int32_t>(k);
      sample.stretch_time = stretch.time_at(joints.sample_s[i]);
      sample.time = std::max(sample.stretch_time - before, kLeastTime);
      before = sample.stretch_time;
    }
  }
  return samples;
}

}  // namespace smoothpost
