#include "machines/dialects/program_reading.h"

#include <algorithm>
#include <charconv>

namespace smoothpost {

std::vector<std::string_view> text_lines(std::string_view text) {
  std::vector<std::string_view> lines;
  std::size_t at = 0;
  while (at < text.size()) {
    const auto end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    lines.push_back(line);
    at = end + 1;
  }
  return lines;
}

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::optional<double> whole_number(std::string_view text) {
  constexpr std::size_t kLongest = 30;
  if (text.empty() || text.size() > kLongest) return std::nullopt;
  const bool negative = text.front() == '-';
  if (negative || text.front() == '+') text.remove_prefix(1);
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto digits = std::count_if(text.begin(), text.end(), digit);
  const auto points = std::count(text.begin(), text.end(), '.');
  if (digits == 0 || points > 1 || digits + points != static_cast<std::ptrdiff_t>(text.size()))
    return std::nullopt;
  double value = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  return negative && value != 0.0 ? -value : value;
}

namespace {

ProcessTable without_semicolons(ProcessTable table) {
  for (auto& row : table.events)
    while (!row.text.empty() && (row.text.back() == ';' || row.text.back() == ' '))
      row.text.pop_back();
  return table;
}

}  // namespace

ProgramReading::ProgramReading(const MachineDefinition& machine, const std::string& file,
                               const char* code)
    : machine_(machine),
      file_(file),
      code_(code),
      table_(without_semicolons(machine.process)),
      events_(table_) {
  joints_ = JointVector::Zero(machine.size());
  for (const auto& line : machine.dialect.start) start_lines_.push_back(packed_statement(line));
  for (const auto& line : machine.dialect.end) end_lines_.push_back(packed_statement(line));
}

void ProgramReading::error(TextPlace at, const char* code, std::string text) {
  constexpr std::size_t kMost = 100;
  if (diagnostics.size() >= kMost) return;
  Diagnostic d;
  d.code = code;
  d.text = std::move(text);
  d.where = {file_, static_cast<int>(at.line), static_cast<int>(at.column)};
  diagnostics.push_back(std::move(d));
}

bool ProgramReading::read_event(TextPlace at, std::string_view statement,
                                EventReader::Place place) {
  const auto event = events_.find(statement, place);
  if (event) add_event(at, *event, 0.0);
  if (event || !is_message(statement)) return event.has_value();
  add_event(at, event_name::kMessage, 0.0);
  return true;
}

bool ProgramReading::is_message(std::string_view statement) const {
  const std::string packed = packed_statement(statement);
  for (const auto& row : table_.events) {
    const auto open = row.text.find('{'), close = row.text.find('}');
    if (row.event != event_name::kMessage || open == std::string::npos || close < open) continue;
    const std::string before = packed_statement(row.text.substr(0, open));
    const std::string behind = packed_statement(row.text.substr(close + 1));
    if (behind.empty() || packed.size() < before.size() + behind.size() ||
        packed.compare(0, before.size(), before) != 0 ||
        packed.compare(packed.size() - behind.size(), behind.size(), behind) != 0)
      continue;
    const auto value = std::string_view(packed).substr(
        before.size(), packed.size() - before.size() - behind.size());
    if (value.find(behind[0]) == std::string_view::npos) return true;
  }
  return false;
}

void ProgramReading::add_event(TextPlace at, std::string name, double seconds) {
  if (name == event_name::kBeamOn || name == event_name::kPierce) beam_ = true;
  if (name == event_name::kBeamOff) beam_ = false;
  result.events.push_back({result.moves.size(), std::move(name), seconds, beam_, at.line});
}

bool ProgramReading::is_own_line(std::string_view statement) {
  const std::string packed = packed_statement(statement);
  const auto has = [&packed](const std::vector<std::string>& lines) {
    return std::find(lines.begin(), lines.end(), packed) != lines.end();
  };
  if (result.moves.empty() && has(start_lines_)) return true;
  if (!has(end_lines_)) return false;
  ended_ = true;
  return true;
}

ReadBackMove ProgramReading::new_move(TextPlace at) const {
  ReadBackMove move;
  move.line = at.line;
  move.beam = beam_;
  move.to = JointVector::Zero(machine_.size());
  return move;
}

void ProgramReading::set_joint(int j, double value) {
  joints_[j] = value;
  known_ |= JointMask{1} << j;
}

bool ProgramReading::is_rotary(int j) const {
  return machine_.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
}

}  // namespace smoothpost
