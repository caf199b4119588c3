#include "machines/dialects/rapid_items.h"

#include <algorithm>

#include "machines/dialects/event_text.h"

namespace smoothpost::rapid {

namespace {

constexpr std::size_t kMostTriggers = 8;

// A backslash and ! have a meaning in RAPID, in texts and outside.
std::optional<EventText> words_of(const MachineDefinition& machine, const MachineAction& action,
                                  Diagnostics& diagnostics) {
  if (action.kind != MachineAction::Kind::event) return std::nullopt;
  MachineAction plain = action;
  for (auto& [name, value] : plain.event.parameters) {
    std::replace(value.begin(), value.end(), '\\', '/');
    std::replace(value.begin(), value.end(), '!', '.');
  }
  return event_text(machine, plain, diagnostics);
}

std::optional<Signal> trigger_of(const std::optional<EventText>& event) {
  if (!event || !event->on_the_fly || event->dwell > 0.0) return std::nullopt;
  return signal_of(event->text);
}

Diagnostic stop_warning(const MachineAction& action, const std::string& text) {
  Diagnostic d;
  d.code = "PR222";
  d.severity = Severity::warning;
  d.where.line = static_cast<int>(action.input_line);
  d.text = "event " + action.event.name + " (" + text.substr(0, 64) +
           ") is to act on the fly and the robot stops for it: only SetDO, SetGO and SetAO "
           "name,number can be set by a motion, at most 8 at one place, and only by MoveL";
  return d;
}

// In reverse.
void put_statements(const MachineAction& action, const std::optional<EventText>& event,
                    std::vector<Item>& items) {
  if (event) {
    if (event->dwell > 0.0) items.push_back({Item::Kind::wait, "", {}, event->dwell});
    items.push_back({Item::Kind::statement, event->text, {}, 0.0});
  } else if (action.kind == MachineAction::Kind::dwell) {
    items.push_back({Item::Kind::wait, "", {}, action.seconds});
  } else {
    items.push_back({Item::Kind::label, action.text, {}, 0.0});
  }
}

/// Actions first to last, all in front of move `before`.
struct Place {
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t before = 0;
};

// From the last to the first: a trigger has no statement behind it in its place.
std::vector<Item> items_at(const MachineDefinition& machine, const MachineProgram& program,
                           const Place& place, Diagnostics& diagnostics) {
  std::vector<std::optional<EventText>> words;
  for (std::size_t k = place.first; k < place.last; ++k)
    words.push_back(words_of(machine, program.actions[k], diagnostics));
  std::vector<Item> items;
  bool by_motion = place.before < program.moves.size() &&
                   program.moves[place.before].interpolation == MoveInterpolation::tool;
  bool stands = place.before == 0 ||
                program.moves[place.before - 1].interpolation == MoveInterpolation::joints;
  std::size_t triggers = 0;
  for (std::size_t k = place.last; k-- > place.first;) {
    const auto& action = program.actions[k];
    const auto& event = words[k - place.first];
    if (action.kind == MachineAction::Kind::event && !event) continue;
    if (action.kind == MachineAction::Kind::comment || (event && event->is_comment)) {
      items.push_back({Item::Kind::comment, event ? event->text : action.text, {}, 0.0});
      continue;
    }
    const auto signal = trigger_of(event);
    if (signal && by_motion && triggers < kMostTriggers) {
      items.push_back({Item::Kind::trigger, "", *signal, 0.0});
      ++triggers;
      continue;
    }
    if (event && event->on_the_fly && !stands)
      diagnostics.push_back(stop_warning(action, event->text));
    put_statements(action, event, items);
    by_motion = false;
    stands = true;
  }
  std::reverse(items.begin(), items.end());
  return items;
}

}  // namespace

std::vector<std::vector<Item>> items_of(const MachineDefinition& machine,
                                        const MachineProgram& program, Diagnostics& diagnostics) {
  std::vector<std::vector<Item>> out;
  out.reserve(program.moves.size() + 1);
  Place place;
  for (place.before = 0; place.before <= program.moves.size(); ++place.before) {
    place.first = place.last;
    while (place.last < program.actions.size() &&
           program.actions[place.last].before == place.before)
      ++place.last;
    out.push_back(items_at(machine, program, place, diagnostics));
  }
  return out;
}

bool has_stop(const std::vector<Item>& items) {
  return std::any_of(items.begin(), items.end(), [](const Item& item) {
    return item.kind != Item::Kind::comment && item.kind != Item::Kind::trigger;
  });
}

}  // namespace smoothpost::rapid
