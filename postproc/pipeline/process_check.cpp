#include "postproc/pipeline/process_check.h"

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

ProcessNumbers process_numbers(const ReadBack& read, const ToolPath& input,
                               const MachineDefinition& machine) {
  const bool ours = follows_power(machine);
  std::map<std::pair<ProcessStates, bool>, std::uint32_t> known;
  const auto number = [&](ProcessStates states, bool beam) {
    std::erase_if(states, [&](const auto& s) {
      return !machine.has_event(s.second) || (ours && s.second == event_name::kPower);
    });
    const auto next = static_cast<std::uint32_t>(known.size());
    return known.emplace(std::pair(std::move(states), beam), next).first->second;
  };
  ProcessNumbers out;
  ProcessStates states;
  std::size_t event = 0;
  for (std::size_t i = 0; i < read.moves.size(); ++i) {
    for (; event < read.events.size() && read.events[event].before <= i; ++event)
      note_state(read.events[event].name, states);
    out.program.push_back(number(states, read.moves[i].beam));
  }
  states.clear();
  event = 0;
  for (std::size_t k = 0; k < input.points.size(); ++k) {
    for (; event < input.events.size() && input.events[event].point < k; ++event)
      if (input.events[event].kind == PathEvent::Kind::process)
        note_state(input.events[event].event.name, states);
    out.input.push_back(number(states, input.points[k].beam));
  }
  return out;
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
