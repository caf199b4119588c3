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
  double cycle = 0.001;                ///< s, of the control: every rest lies on one

  double duration() const {
    return items.empty() ? 0.0 : items.back().start + items.back().duration;
  }
  /// The last item that has begun at `time` (1e-9 s early counts), not before item `from`.
  /// @pre items
  std::size_t item_at(double time, std::size_t from = 0) const;
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
/// the limits of feed_limits(), feeds not faster than their printed time. Everything between two
/// rests is slowed, and every dwell longer, by less than a cycle, so that rests lie on cycles.
/// Guarantees (tests): items meet in position, velocity and acceleration; differences at 1 ms keep
/// every limit. Cost: one small schedule for each move that the schedule does not know.
Timeline timeline_of(const TimelineInput& input);

/// Decimals of an axis in a joint stream (mm or deg): seven of a length and eight of an angle, more
/// (nine at most) where half a digit of four rows, 4·10^−d/cycle³, were over 5 % of the jerk limit.
int stream_decimals(const AxisDefinition& axis, double cycle);

/// The joints at the machine's cycle time as CSV: `t_s`, one column per axis with its unit (X_mm,
/// C_deg), then x_mm,y_mm,z_mm,i,j,k of the tool in the part and beam (0/1). Row k is the position
/// at k cycles; its beam is that of the cycle behind it, and where the beam changes inside that
/// cycle the new state, so up to a cycle early. The last row is the last cycle, at rest, beam 0.
std::string trajectory_csv(const Timeline& timeline, const MachineDefinition& machine,
                           const ScrewChain& chain, double tool_length);

}  // namespace smoothpost
