#include <algorithm>
#include <optional>

#include "machines/definition/sections.h"

namespace smoothpost::machine_file {

namespace {

bool is_lower_name(std::string_view name) {
  return is_name(name) &&
         std::none_of(name.begin(), name.end(), [](char c) { return c >= 'A' && c <= 'Z'; });
}

/// What is wrong with the text of a row; empty: nothing.
std::string text_problem(std::string_view text) {
  if (text.find_first_not_of(" \t") == std::string_view::npos)
    return "has no words: remove the row, or set process.unmapped";
  for (const char c : text)
    if (static_cast<unsigned char>(c) < 0x20U && c != '\t') return "has to be one line";
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '}') return "has a } without {";
    if (text[at] != '{') continue;
    const std::size_t close = text.find('}', at);
    if (close == std::string_view::npos) return "has a { without }";
    if (!is_lower_name(text.substr(at + 1, close - at - 1)))
      return "has something else than a value's name in braces, such as {rpm}";
    at = close;
  }
  return "";
}

void check_text(const EventWords& words, const SourceLocation& where, Problems& problems) {
  const std::string problem = text_problem(words.text);
  if (!problem.empty())
    problems.error("MF120", "the text of event " + words.event.substr(0, 64) + " " + problem,
                   where);
}

EventWords read_event_table(const TomlEntry& entry, Problems& problems) {
  TableReader reader(&entry.value.table, "event " + entry.key.substr(0, 64), entry.value.where,
                     problems);
  EventWords words;
  words.event = entry.key;
  if (const auto text = reader.required().text("text")) {
    words.text = *text;
    check_text(words, reader.where("text"), problems);
  }
  words.on_the_fly = reader.choice("motion", {"stop", "on_the_fly"}) == "on_the_fly";
  words.latency = reader.number_or("latency_ms", 0.0, Bound::not_negative) * 1e-3;
  words.dwell = reader.number_or("dwell_s", 0.0, Bound::not_negative);
  reader.finish();
  return words;
}

std::optional<EventWords> read_event(const TomlEntry& entry, Problems& problems) {
  if (!is_lower_name(entry.key)) {
    problems.error("MF120", "an event's name is small letters, digits and _", entry.where);
    return std::nullopt;
  }
  if (entry.value.kind == TomlKind::table) return read_event_table(entry, problems);
  if (entry.value.kind != TomlKind::string) {
    problems.error("MF106",
                   "event " + entry.key.substr(0, 64) + " is " + to_string(entry.value.kind) +
                       " and has to be a string or a table",
                   entry.value.where);
    return std::nullopt;
  }
  EventWords words;
  words.event = entry.key;
  words.text = entry.value.string;
  check_text(words, entry.value.where, problems);
  return words;
}

void warn_of_same_words(const std::vector<EventWords>& events, const TomlTable& table,
                        Problems& problems) {
  for (std::size_t i = 0; i < events.size() && i < 200; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (events[i].text.empty() || events[i].text != events[j].text) continue;
      problems.warning("MF122",
                       "events " + events[j].event.substr(0, 64) + " and " +
                           events[i].event.substr(0, 64) + " have the same words " +
                           events[i].text.substr(0, 64) +
                           ": a program of this machine cannot be read back unambiguously",
                       table.find(events[i].event)->where);
      break;
    }
}

}  // namespace

ProcessTable read_process(TableReader& reader, Problems& problems) {
  ProcessTable process;
  const auto unmapped = reader.choice("unmapped", {"refuse", "comment"});
  if (unmapped == "comment") process.unmapped = UnmappedWords::comment;
  const TomlEntry* events = reader.entry("events");
  if (events == nullptr) return process;
  if (events->value.kind != TomlKind::table) {
    problems.error("MF106",
                   "process.events is " + to_string(events->value.kind) + " and has to be a table",
                   events->value.where);
    return process;
  }
  for (const auto& entry : events->value.table.entries())
    if (auto words = read_event(entry, problems)) process.events.push_back(std::move(*words));
  warn_of_same_words(process.events, events->value.table, problems);
  return process;
}

PowerTable read_power(TableReader reader) {
  PowerTable power;
  const auto speed = reader.required().numbers("speed_mm_per_s");
  const auto percent = reader.required().numbers("percent");
  const auto rises = [](const std::vector<double>& values, bool strictly) {
    for (std::size_t i = 1; i < values.size(); ++i)
      if (strictly ? values[i] <= values[i - 1] : values[i] < values[i - 1]) return false;
    return true;
  };
  if (speed && percent) {
    power.speed = *speed;
    power.percent = *percent;
    if (speed->size() != percent->size() || speed->size() < 2)
      reader.error("MF117",
                   "speed_mm_per_s has " + std::to_string(speed->size()) + " numbers and percent " +
                       std::to_string(percent->size()) + ": they need the same count, at least 2",
                   blame(reader, {"speed_mm_per_s", "percent"}));
    if (!rises(*speed, true) || (!speed->empty() && speed->front() < 0.0))
      reader.error("MF117", "speed_mm_per_s has to rise strictly from at least 0",
                   "speed_mm_per_s");
    if (!rises(*percent, false))
      reader.error("MF117", "percent has to rise or stay along the list", "percent");
    for (const double value : *percent)
      if (value < 0.0 || value > 100.0) {
        reader.error("MF108", "percent has " + to_text(value) + ": powers are from 0 to 100",
                     "percent");
        break;
      }
  }
  power.min_percent = reader.number_or("min_percent", 0.0, Bound::not_negative);
  if (power.min_percent > 100.0)
    reader.error("MF108", "min_percent is " + to_text(power.min_percent) + ": at most 100",
                 "min_percent");
  power.min_cut_speed = reader.number_or("min_cut_speed_mm_per_s", 0.0, Bound::not_negative);
  power.by_program = reader.choice("follows", {"program", "control"}) != "control";
  power.error = reader.number_or("error_percent", 30.0, Bound::positive);
  reader.finish();
  return power;
}

}  // namespace smoothpost::machine_file
