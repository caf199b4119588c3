#include "machines/dialects/event_text.h"

#include <algorithm>

#include "formats/nc/event_words.h"

namespace smoothpost {

namespace {

Diagnostic unmapped_event(const MachineDefinition& machine, const MachineAction& action) {
  Diagnostic d;
  d.code = "PR201";
  d.where.line = static_cast<int>(action.input_line);
  d.where.column = static_cast<int>(action.event.column);
  std::string values;
  for (const auto& [key, value] : action.event.parameters) values += " " + key + "=" + value;
  d.text = "event " + action.event.name + values + " has no words on machine " + machine.name +
           ": its [process.events] has no row " + action.event.name +
           ". Add the row if the machine can do it, choose another machine, or set "
           "process.unmapped = \"comment\" to keep it as a comment";
  return d;
}

}  // namespace

std::string plain_text(std::string_view text, std::size_t length) {
  std::string out;
  for (const char c : text) {
    if (out.size() == length) break;
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U) continue;  // the rest of a UTF-8 sequence
    out += byte >= 0x80U ? '?' : byte < 0x20U || byte == 0x7FU ? ' ' : c;
  }
  return out;
}

std::vector<std::string> remark_lines(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  while (text.size() > width) {
    const auto blank = text.rfind(' ', width);
    const auto end = blank == std::string_view::npos || blank == 0 ? width : blank;
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(end);
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  }
  lines.emplace_back(text);
  return lines;
}

std::optional<EventText> event_text(const MachineDefinition& machine, const MachineAction& action,
                                    Diagnostics& diagnostics) {
  EventText out;
  const auto row = std::find_if(machine.process.events.begin(), machine.process.events.end(),
                                [&](const EventWords& e) { return e.event == action.event.name; });
  if (row == machine.process.events.end()) {
    if (machine.process.unmapped == UnmappedWords::refuse) {
      diagnostics.push_back(unmapped_event(machine, action));
      return std::nullopt;
    }
    out.text = "unmapped event: " + action.event.name;
    out.is_comment = true;
    return out;
  }
  constexpr std::size_t kMaxValue = 80;
  nc::EventParameters values = action.event.parameters;
  for (auto& [name, value] : values) {
    value = plain_text(value, kMaxValue);
    std::replace(value.begin(), value.end(), '"', '\'');
    std::replace(value.begin(), value.end(), ';', ',');
    std::replace(value.begin(), value.end(), '(', '[');
    std::replace(value.begin(), value.end(), ')', ']');
  }
  auto text = nc::render_event(*row, values);
  if (!text.ok()) {
    for (auto d : text.diagnostics()) {
      d.where.line = static_cast<int>(action.input_line);
      diagnostics.push_back(std::move(d));
    }
    return std::nullopt;
  }
  out.text = std::move(text.value());
  out.on_the_fly = row->on_the_fly;
  out.dwell = row->dwell;
  return out;
}

std::string packed_statement(std::string_view text) {
  std::string out;
  bool quoted = false;
  for (const char c : text) {
    if (c == '"') quoted = !quoted;
    if (!quoted && (c == ' ' || c == '\t')) continue;
    out += !quoted && c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
  }
  return out;
}

EventReader::EventReader(const ProcessTable& table) {
  for (const auto& words : table.events) {
    Row row;
    row.event = words.event;
    row.on_the_fly = words.on_the_fly;
    // Values are taken out first: a name is not a statement's word.
    std::string text = words.text;
    for (auto open = text.find('{'); open != std::string::npos; open = text.find('{', open)) {
      const auto close = text.find('}', open);
      if (close == std::string::npos) break;
      text.replace(open, close - open + 1, "\x01");
    }
    const std::string packed = packed_statement(text);
    std::size_t begin = 0;
    for (;;) {
      const auto end = packed.find('\x01', begin);
      row.fixed.push_back(packed.substr(begin, end - begin));
      row.characters += row.fixed.back().size();
      if (end == std::string::npos) break;
      begin = end + 1;
    }
    rows_.push_back(std::move(row));
  }
}

bool EventReader::fits(const Row& row, std::string_view packed) {
  const std::string& first = row.fixed.front();
  if (packed.substr(0, first.size()) != first) return false;
  if (row.fixed.size() == 1) return packed.size() == first.size();
  std::size_t at = first.size();
  bool quoted = false;
  for (std::size_t i = 1; i < row.fixed.size(); ++i) {
    const std::string& fixed = row.fixed[i];
    const bool last = i + 1 == row.fixed.size();
    if (last && packed.size() < at + fixed.size()) return false;
    const auto found = last ? packed.size() - fixed.size() : packed.find(fixed, at + 1);
    if (found == std::string_view::npos || found <= at) return false;
    if (packed.substr(found, fixed.size()) != fixed) return false;
    // A value is one number, or text inside quotes; never more words of the line.
    const auto value = packed.substr(at, found - at);
    for (const char c : row.fixed[i - 1]) quoted = quoted != (c == '"');
    if (value.find_first_not_of("+-.0123456789") != std::string_view::npos && !quoted) return false;
    if (value.find('"') != std::string_view::npos) return false;
    at = found + fixed.size();
  }
  return true;
}

std::optional<std::string> EventReader::find(std::string_view statement, Place place) const {
  const std::string packed = packed_statement(statement);
  const Row* best = nullptr;
  const auto suits = [place](const Row& row) {
    return place == Place::any || row.on_the_fly == (place == Place::on_the_fly);
  };
  for (const auto& row : rows_) {
    if (!fits(row, packed)) continue;
    if (best == nullptr || (suits(row) && !suits(*best)) ||
        (suits(row) == suits(*best) && row.characters > best->characters))
      best = &row;
  }
  if (best == nullptr) return std::nullopt;
  return best->event;
}

}  // namespace smoothpost
