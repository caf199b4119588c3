#include <algorithm>

#include "formats/ini/ini.h"

namespace smoothpost::ini {

namespace {

bool arrow(const std::string& word) { return word == "=>" || word == "<=" || word == "<=>"; }

/// [SECTION]KEY, or [SECTION](KEY), is that value of the INI file.
std::string replaced(const std::string& word, const File& ini) {
  const auto close = word.find(']');
  if (word.size() < 4 || word.front() != '[' || close == std::string::npos) return word;
  std::string key = word.substr(close + 1);
  if (key.size() > 2 && key.front() == '(' && key.back() == ')')
    key = key.substr(1, key.size() - 2);
  const Entry* entry = ini.find(word.substr(1, close - 1), key);
  return entry == nullptr ? word : entry->value;
}

PinValue value_of(const std::string& word, const SourceLocation& where) {
  PinValue value{PinValue::Kind::unreadable, 0.0, word, where};
  if (const auto number = leading_number(word)) {
    value.kind = PinValue::Kind::number;
    value.value = *number;
  }
  return value;
}

}  // namespace

void Hal::add(std::string_view text, const std::string& file, int first_line, const File& ini) {
  constexpr std::size_t kMost = 20000;
  SourceLocation where{file, first_line - 1, 1};
  while (!text.empty() && pins_.size() + signals_.size() + connections_.size() < kMost) {
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++where.line;
    line = line.substr(0, line.find('#'));
    std::vector<std::string> part = words(line);
    // "setp pin=value" is the same as "setp pin value".
    if (part.size() == 2 && (part[0] == "setp" || part[0] == "sets")) {
      const auto equals = part[1].find('=');
      if (equals != std::string::npos)
        part = {part[0], part[1].substr(0, equals), part[1].substr(equals + 1)};
    }
    if (part.size() < 3) continue;
    if (part[0] == "setp") pins_.push_back({part[1], value_of(replaced(part[2], ini), where)});
    if (part[0] == "sets") signals_.push_back({part[1], value_of(replaced(part[2], ini), where)});
    if (part[0] != "net") continue;
    for (std::size_t i = 2; i < part.size(); ++i)
      if (!arrow(part[i])) connections_.push_back({part[i], part[1], where});
  }
}

PinValue Hal::pin(std::string_view name) const {
  const auto last = [](const std::vector<Setting>& list, std::string_view wanted) {
    const auto found = std::find_if(list.rbegin(), list.rend(),
                                    [&](const Setting& s) { return s.name == wanted; });
    return found == list.rend() ? nullptr : &found->value;
  };
  for (const Connection& c : connections_) {
    if (c.pin != name) continue;
    if (const PinValue* value = last(signals_, c.signal)) return *value;
    return {PinValue::Kind::signal, 0.0, c.signal, c.where};
  }
  if (const PinValue* value = last(pins_, name)) return *value;
  return {};
}

}  // namespace smoothpost::ini
