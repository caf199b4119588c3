#pragma once

#include <cstdint>

#include "machines/dialects/dialect.h"
#include "postproc/pipeline/feed_schedule.h"
#include "postproc/pipeline/reference_path.h"

// The beam's power by the speed of the tip, as commands of the program.
namespace smoothpost {

/// What the commands of follow_power() reach.
struct PowerFollowing {
  double error = 0.0;  ///< percent: largest distance of the power in force from that of the speed
  std::uint32_t input_line = 0;  ///< where
  std::size_t commands = 0;
};

/// Puts `power` commands before the blocks of a program on which the beam is on, so that the power
/// in force is that of the tip's speed.
///
/// The power of a speed v is table(v) of [process.power]; after a power that the input itself
/// commands, P at programmed feed F, it is P·table(v)/table(F). A block wants all powers of the
/// speeds at its start, middle and end by the schedule. One command serves as many blocks as lie
/// within power.error of it, and is the middle of what they want; it is given anew after a label, a
/// power of the input (which it replaces) and a link. Where one block alone wants more than
/// 2·power.error apart, the error is what it is and is returned.
/// Guarantee (test): the error returned is that of the definition, from the text.
/// Cost: O(moves).   @pre machine.power has a table, machine has the event `power`
PowerFollowing follow_power(MachineProgram& program, const ReferencePath& reference,
                            const FeedSchedule& schedule, const MachineDefinition& machine);

}  // namespace smoothpost
