#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/kinematics/inverse.h"
#include "machines/dialects/dialect.h"
#include "postproc/pipeline/feed_schedule.h"

// The whole program in time, for a control that follows our times: cuts by their schedule, links
// from rest to rest, dwells.
namespace smoothpost {

struct TimelineItem {
  double start = 0.0, duration = 0.0;  ///< s
  std::int32_t law = -1;  ///< index of Timeline::laws; −1: the joints stand at `stand`
  double from = 0.0;      ///< s, of the law when the item begins
  JointVector stand;
  bool beam = false;
  std::uint32_t segment = 0;  ///< of the input at its end; 0: a link
  std::uint32_t line = 0;     ///< of the input
  std::int64_t move = -1;     ///< index of MachineProgram::moves; −1: a dwell
};

struct Timeline {
  std::vector<ScheduledStretch> laws;  ///< first those of the schedule, in its order
  std::vector<TimelineItem> items;     ///< one behind the other; empty: not asked for

  double duration() const {
    return items.empty() ? 0.0 : items.back().start + items.back().duration;
  }
  /// Position, velocity, acceleration and jerk of every joint at a time in `item`.
  ScheduledStretch::Motion at(const TimelineItem& item, double time) const;
};

struct TimelineInput {
  const MachineProgram& program;
  const FeedSchedule& schedule;
  const MachineDefinition& machine;
  const ScrewChain& chain;  ///< tool length 0, part placed
  const Inverse& inverse;
  ToolTurn turn = ToolTurn::none;
};

/// Every move of the program from the first one on behind which all joints are known. Moves that
/// the schedule knows (MachineMove::stretch) follow it; others go straight, from rest to rest under
/// the limits of feed_limits(), feeds not faster than their printed time. Cost: one small schedule
/// for each of those.
Timeline timeline_of(const TimelineInput& input);

/// The joints at the machine's cycle time as CSV: `t_s`, one column per axis with its unit (X_mm,
/// C_deg), then x_mm,y_mm,z_mm,i,j,k of the tool in the part and beam (0/1). Seven decimals of mm,
/// eight of degrees: at 1 ms a rounding of half a digit is a jerk of 4·10⁻⁷/10⁻⁹ = 400 mm/s³.
/// The last row is the first cycle at or behind the end.
std::string trajectory_csv(const Timeline& timeline, const MachineDefinition& machine,
                           const ScrewChain& chain, double tool_length);

}  // namespace smoothpost
