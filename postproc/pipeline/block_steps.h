#pragma once

#include <functional>

#include "machines/definition/machine.h"

namespace smoothpost {

/// The time (s) that a block of a smooth path has where nothing asks for a shorter one:
/// dialect.block_ms, or what makes the execution fastest on this control. LinuxCNC in exact-path
/// mode stops at every end of a block that turns a rotary (measured: docs/controllers/linuxcnc.md),
/// so that the longest blocks are the fastest: kLongBlock. On controls that were not measured:
/// kShortBlock. Never below cycle.min_block.
double usual_block_time(const MachineDefinition& machine);

inline constexpr double kShortBlock = 0.010;  ///< s
inline constexpr double kLongBlock = 0.250;   ///< s

/// The next step of a path of which `rest` is left: at most `usual`, such that holds(step); the
/// longest up to a sixteenth, and no stump is left at the end. Never below `least`, whether it
/// holds or not (the program is verified as a whole). Units: those of the path.
/// Cost: some 4 to 8 calls of holds().
double longest_step(double rest, double usual, double least,
                    const std::function<bool(double)>& holds);

}  // namespace smoothpost
