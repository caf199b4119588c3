#pragma once

#include <limits>
#include <string>
#include <vector>

#include "kernels/core/progress.h"
#include "kernels/core/result.h"
#include "kernels/schedule/feed_profile.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/joint_stretch.h"

namespace smoothpost {

/// A stretch between two stops with its time law.
struct ScheduledStretch {
  JointStretch joints;
  FeedProfile profile;   ///< of joints' parameter s
  double slowing = 1.0;  ///< all its times are those of `profile` times this
  double duration() const { return slowing * profile.duration(); }
  double time_at(double s) const { return slowing * profile.time(s); }

  /// Position, velocity, acceleration and jerk of every joint at time t of the stretch.
  struct Motion {
    JointVector position, velocity, acceleration, jerk;
  };
  Motion at(double t) const;
  /// Of the tip, mm/s, at time t.
  double tip_speed(double t) const;
};

/// A part of the path that is slower than programmed, and the limit that keeps it so.
struct SlowedBy {
  int joint = -1;
  FeedWitness::Kind limit = FeedWitness::Kind::none;
  std::uint32_t first_line = 0, last_line = 0;  ///< of the input
  double factor = 1.0;                          ///< least tip speed over the programmed one
  std::uint32_t first_segment = 0;
};

struct FeedSchedule {
  std::vector<ScheduledStretch> stretches;  ///< in path order
  std::vector<SlowedBy> slowed_by;          ///< in path order; ramps at stops are none
  std::vector<JointPeaks> peaks;            ///< in joint order, over all stretches
  double time = 0.0;                        ///< s, of all stretches
  std::size_t stops = 0;                    ///< inside runs
  /// mm/s, least speed of the tip with the beam on, between the ramps of each stretch, and its line
  /// of the input; infinity: the beam is never on.
  double slowest_cut = std::numeric_limits<double>::infinity();
  std::uint32_t slowest_cut_line = 0;
};

struct ScheduleInput {
  StretchesInput path;
  const std::vector<Cut>& cuts;
  std::string file_name;  ///< for messages
};

/// The feed of a whole plan under every joint's velocity, acceleration and jerk limit
/// (schedule_feed on each stretch of joint_stretches), times tolerance.limit_share (velocities that
/// are assumed also times kAssumedShare). recipe.schedule says what else:
///  - jerk: as fast as the limits allow, never above the programmed feed;
///  - constant: at most the largest constant feed of each cut that every joint's limits allow
///    (largest_constant_feed), with ramps at stops;
///  - programmed: the programmed feed, with ramps at stops. A blended corner that turns the tip by
///    20° or more and cannot be passed at that feed becomes a stop in the middle of its blend;
///    where else the feed breaks a limit, KN152 with lines, joints and factors.
/// No block between two samples is shorter than cycle.min_block.
/// Fails with KN160 where a stretch has no time law, with its witness.
/// Stretches are solved on all threads (TBB) with the same result on any number; `progress` is only
/// called from the caller's.   Cost: about 16 µs a collocation point.
Result<FeedSchedule> schedule_plan(const ScheduleInput& input, const Progress& progress);

/// The plan's samples with the time of the way to each (JointSample::time).
std::vector<JointSample> timed_samples(std::vector<JointSample> samples,
                                       const FeedSchedule& schedule);

/// "velocity", "acceleration", "jerk", "feed" or "turn rate".
const char* word(FeedWitness::Kind limit);

/// What was slowed down, for the user: a note KN161 with the line that lost most; nothing when the
/// path runs at its programmed feed but for ramps at stops.
Diagnostics schedule_notes(const FeedSchedule& schedule, const MachineDefinition& machine,
                           const std::string& file_name);

/// What joints and tip may do on a machine, as the schedule takes it.
FeedLimits feed_limits(const MachineDefinition& machine);
/// How finely: elements by the time that a joint takes to its largest acceleration.
FeedSettings feed_settings(const MachineDefinition& machine);

}  // namespace smoothpost
