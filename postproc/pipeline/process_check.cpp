#include "postproc/pipeline/process_check.h"

#include <cstdlib>

namespace smoothpost {

std::vector<ProcessStates> programmed_states(const InterpretedInput& input, bool keep_links,
                                             const MachineDefinition& machine) {
  ToolPath whole = input.path;
  const auto cuts = find_cuts(whole, {keep_links, machine.links.micro_joint, {}});
  const bool ours = follows_power(machine);
  std::vector<ProcessStates> wanted(cuts.size() + 1);
  for (const Cut& cut : cuts) {
    auto& states = wanted[static_cast<std::size_t>(cut.number)];
    states = states_at(input.path.events, cut.first - 1);
    std::erase_if(states, [&machine, ours](const auto& s) {
      return !machine.has_event(s.second) || (ours && s.second == event_name::kPower);
    });
  }
  return wanted;
}

Check process_check(const ReadBack& read, const LineMap& map, const std::vector<Cut>& cuts,
                    const std::vector<ProcessStates>& wanted, const MachineDefinition& machine) {
  Check c;
  c.name = "process_as_programmed";
  c.unit = "cuts";
  const bool ours = follows_power(machine);
  ProcessStates states;
  std::size_t event = 0;
  auto cut = cuts.begin();
  for (std::size_t i = 0; i < read.moves.size() && i < map.size(); ++i) {
    for (; event < read.events.size() && read.events[event].before <= i; ++event)
      if (!ours || read.events[event].name != event_name::kPower)
        note_state(read.events[event].name, states);
    if (map[i].role != MoveRole::path) continue;
    while (cut != cuts.end() && (cut->omitted || cut->last < map[i].segment)) ++cut;
    if (cut == cuts.end()) break;
    if (map[i].segment < cut->first) continue;
    if (!cut->after_rewind && states != wanted[static_cast<std::size_t>(cut->number)]) {
      c.value += 1.0;
      if (c.output_line == 0) c.output_line = read.moves[i].line;
    }
    ++cut;
  }
  c.ok = c.value == 0.0;
  if (!c.ok)
    c.note = "spindle, coolant, gas or power are not as the input has them when this cut starts";
  return c;
}

namespace {

/// Process states after one event after the other, with every tool change a state of its own; only
/// what the machine has words for.
class RunningStates {
 public:
  explicit RunningStates(const MachineDefinition& machine)
      : machine_(machine), ours_(follows_power(machine)) {}
  void note(const std::string& event) {
    if (!state_group(event).empty() && !ends_state(event) &&
        (!machine_.has_event(event) || (ours_ && event == event_name::kPower)))
      states_.erase(state_group(event));  // as if it had none
    else
      note_state(event, states_);
    if (event == event_name::kToolChange && machine_.has_event(event))
      states_[state_group(event)] += " " + std::to_string(++tools_);
  }
  const ProcessStates& states() const { return states_; }

 private:
  const MachineDefinition& machine_;
  bool ours_ = false;
  int tools_ = 0;
  ProcessStates states_;
};

/// Numbers for states; each number's groups.
class StateNumbers {
 public:
  std::uint32_t of(ProcessStates states, bool beam) {
    if (beam) states["beam"] = event_name::kBeamOn;
    const auto next = static_cast<std::uint32_t>(known_.size());
    return known_.emplace(std::move(states), next).first->second;
  }
  std::vector<std::vector<std::uint32_t>> parts() const {
    std::map<std::string, std::size_t> groups;
    std::map<std::string, std::uint32_t> events;
    for (const auto& [states, number] : known_)
      for (const auto& [group, event] : states) {
        groups.emplace(group, groups.size());
        events.emplace(event, static_cast<std::uint32_t>(events.size()) + 1U);
      }
    std::vector<std::vector<std::uint32_t>> parts(known_.size(),
                                                  std::vector<std::uint32_t>(groups.size(), 0U));
    for (const auto& [states, number] : known_)
      for (const auto& [group, event] : states) parts[number][groups.at(group)] = events.at(event);
    return parts;
  }

 private:
  std::map<ProcessStates, std::uint32_t> known_;
};

/// Stretches with the beam on that a motion parts from the one before; `moves(i)`: motion i goes
/// somewhere.
template <class Motions, class Moves>
int beam_stretches(const Motions& motions, const Moves& moves) {
  int count = 0;
  bool on = false;
  for (std::size_t i = 1; i < motions.size(); ++i) {
    if (!moves(i)) continue;
    if (motions[i].beam && !on) ++count;
    on = motions[i].beam;
  }
  return count;
}

}  // namespace

ProcessNumbers process_numbers(const ReadBack& read, const ToolPath& input,
                               const MachineDefinition& machine) {
  StateNumbers numbers;
  ProcessNumbers out;
  RunningStates program(machine);
  std::size_t event = 0;
  for (std::size_t i = 0; i < read.moves.size(); ++i) {
    for (; event < read.events.size() && read.events[event].before <= i; ++event)
      program.note(read.events[event].name);
    out.program.push_back(numbers.of(program.states(), read.moves[i].beam));
  }
  RunningStates wanted(machine);
  event = 0;
  for (std::size_t k = 0; k < input.points.size(); ++k) {
    for (; event < input.events.size() && input.events[event].point < k; ++event)
      if (input.events[event].kind == PathEvent::Kind::process)
        wanted.note(input.events[event].event.name);
    out.input.push_back(numbers.of(wanted.states(), input.points[k].beam));
  }
  for (; event < input.events.size(); ++event)
    if (input.events[event].kind == PathEvent::Kind::process)
      wanted.note(input.events[event].event.name);
  out.input.push_back(numbers.of(wanted.states(), false));
  out.parts = numbers.parts();
  return out;
}

Check process_complete_check(const ReadBack& program, const ToolPath& input,
                             const MachineDefinition& machine) {
  RunningStates got(machine), wanted(machine);
  for (const auto& e : program.events) got.note(e.name);
  for (const auto& e : input.events)
    if (e.kind == PathEvent::Kind::process) wanted.note(e.event.name);
  Check c;
  c.name = "process_complete";
  c.unit = "states";
  for (const auto& [group, event] : got.states()) {
    if (group == "tool" || group == event_name::kPower || wanted.states().count(group) > 0)
      continue;
    c.value += 1.0;
    c.output_line = program.last_line;
    c.note = group + " is still on at the end of the program; the input has it off";
  }
  const int on = beam_stretches(program.moves, [&](std::size_t i) {
    return program.moves[i].to != program.moves[i - 1].to ||
           program.moves[i].interpolation == MoveInterpolation::tool;
  });
  const int programmed = beam_stretches(input.points, [&](std::size_t k) {
    const CutterLocation &a = input.points[k - 1].location, &b = input.points[k].location;
    return input.points[k].is_arc || a.tip != b.tip || a.axis != b.axis;
  });
  if (on != programmed) {
    c.value += std::abs(on - programmed);
    c.note = "the beam is on in " + std::to_string(on) + " stretches, in the input in " +
             std::to_string(programmed);
  }
  c.ok = c.value == 0.0;
  return c;
}

bool follows_power(const MachineDefinition& machine) {
  return !machine.power.speed.empty() && machine.power.by_program &&
         machine.has_event(event_name::kPower);
}

Check power_check(const PowerFollowing& power, const MachineDefinition& machine) {
  Check c;
  c.name = "power_follows_speed";
  c.unit = "%";
  c.value = power.error;
  c.limit = machine.power.error;
  c.ok = c.value <= c.limit;
  c.planned = true;
  c.input_line = power.input_line;
  if (!c.ok)
    c.note =
        "the speed changes too much inside one block: [process.power] error_percent is below what "
        "blocks of this length can follow";
  return c;
}

}  // namespace smoothpost
