#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "kernels/core/check.h"
#include "postproc/pipeline/beam_power.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/interpret.h"
#include "postproc/pipeline/line_map.h"

// What the process does in the output: spindle, coolant, gas, power.
namespace smoothpost {

/// States by group (state_group), with the event that each was set by.
using ProcessStates = std::map<std::string, std::string>;

/// The states in which the input starts each of its cuts, by cut number; only what the machine has
/// words for, and not the power where the program commands it by speed.
std::vector<ProcessStates> programmed_states(const InterpretedInput& input, bool keep_links,
                                             const MachineDefinition& machine);

/// Check process_as_programmed: the states at the start of every cut, from the text, are `wanted`.
Check process_check(const ReadBack& read, const LineMap& map, const std::vector<Cut>& cuts,
                    const std::vector<ProcessStates>& wanted, const MachineDefinition& machine);

/// What the process does along a program and along its input: equal numbers for equal states (with
/// the beam), of each move and of the segment that ends at each point, then behind the input's end.
/// Only what the machine has words for, and not the power where the program commands it by speed.
/// Every tool change makes another state: tools are counted, not named.
struct ProcessNumbers {
  std::vector<std::uint32_t> program;
  std::vector<std::uint32_t> input;
  /// Of each number: what each group (the beam is one) does, as equal or different numbers.
  std::vector<std::vector<std::uint32_t>> parts;
};
ProcessNumbers process_numbers(const ReadBack& read, const ToolPath& input,
                               const MachineDefinition& machine);

/// Check process_complete, for programs without a line map: what the input has turned off at its
/// end is off behind the program's last line, and the beam is on as often as in the input, with a
/// motion on and a motion off each time. Value: groups left on and stretches too many or missing.
/// `program` as process_numbers() was asked with.   Cost: linear in moves, points and events.
Check process_complete_check(const ReadBack& program, const ToolPath& input,
                             const MachineDefinition& machine);

/// True when the program itself commands the beam's power by speed (follow_power).
bool follows_power(const MachineDefinition& machine);

/// Check power_follows_speed, as planned.
Check power_check(const PowerFollowing& power, const MachineDefinition& machine);

}  // namespace smoothpost
