#include "formats/ini/ini.h"

#include <cmath>

#include "kernels/core/signed_number.h"

namespace smoothpost::ini {

namespace {

constexpr int kDeepest = 8;

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

class Reader {
 public:
  explicit Reader(const Source& included) : included_(included) {}

  void read(std::string_view text, const std::string& file, int depth) {
    if (text.size() > kMaxBytes)
      return error({file, 0, 0}, "the file is larger than 4 MiB: is it LinuxCNC's INI file?");
    if (++files_ > kMaxFiles || depth > kDeepest)
      return error({file, 0, 0}, "more than 50 files include each other, or deeper than 8");
    std::string joined;
    int number = 0, first = 0;
    while (!text.empty() && !full()) {
      const auto end = text.find('\n');
      std::string_view line = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      ++number;
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      if (joined.empty()) first = number;
      const bool more = !line.empty() && line.back() == '\\' && !text.empty();
      if (more) line.remove_suffix(1);
      joined.append(line);
      if (more) continue;
      statement(trimmed(joined), {file, first, 1}, depth);
      joined.clear();
    }
  }

  Result<File> result() {
    if (has_error(diagnostics_)) return Result<File>::failure(std::move(diagnostics_));
    return {std::move(file_), std::move(diagnostics_)};
  }

 private:
  void error(SourceLocation where, std::string text) {
    if (!full()) diagnostics_.push_back({Severity::error, "MF201", std::move(text), where});
  }
  bool full() const { return diagnostics_.size() >= 50; }

  void statement(std::string_view line, const SourceLocation& where, int depth) {
    constexpr std::string_view kInclude = "#INCLUDE";
    if (line.substr(0, kInclude.size()) == kInclude)
      return include(std::string(trimmed(line.substr(kInclude.size()))), where, depth);
    if (line.empty() || line.front() == '#' || line.front() == ';') return;
    if (line.front() == '[') {
      const auto close = line.find(']');
      if (close == std::string_view::npos)
        return error(where, "a [SECTION] that is not closed: is it LinuxCNC's INI file?");
      file_.sections.push_back({std::string(trimmed(line.substr(1, close - 1))), {}, where});
      return;
    }
    const auto equals = line.find('=');
    if (equals == std::string_view::npos || equals == 0)
      return error(where, "neither [SECTION] nor KEY = value: is it LinuxCNC's INI file?");
    if (file_.sections.empty()) return error(where, "KEY = value before the first [SECTION]");
    file_.sections.back().entries.push_back({std::string(trimmed(line.substr(0, equals))),
                                             std::string(trimmed(line.substr(equals + 1))), where});
  }

  void include(const std::string& name, const SourceLocation& where, int depth) {
    const auto text = included_ ? included_(name) : std::nullopt;
    if (text) return read(*text, name, depth + 1);
    if (!full())
      diagnostics_.push_back({Severity::warning, "MF207",
                              "the included file " + name.substr(0, 200) +
                                  " is not there or outside of the folder of the INI file",
                              where});
  }

  const Source& included_;
  File file_;
  int files_ = 0;
  Diagnostics diagnostics_;
};

}  // namespace

const Section* File::find(std::string_view section) const {
  for (const Section& s : sections)
    if (s.name == section) return &s;
  return nullptr;
}

const Entry* File::find(std::string_view section, std::string_view key) const {
  for (const Section& s : sections) {
    if (s.name != section) continue;
    for (const Entry& e : s.entries)
      if (e.key == key) return &e;
  }
  return nullptr;
}

Result<File> read_ini(std::string_view text, const std::string& file, const Source& included) {
  Reader reader(included);
  reader.read(text, file, 0);
  return reader.result();
}

std::optional<double> leading_number(std::string_view value) {
  constexpr double kLargest = 1e9;
  value = trimmed(value);
  double number = 0.0;
  const char* end = value.data() + value.size();
  const auto [next, fault] = from_signed(value, number);
  if (fault != std::errc() || !(std::abs(number) <= kLargest)) return std::nullopt;
  if (next != end && std::string_view(" \t#;").find(*next) == std::string_view::npos)
    return std::nullopt;
  return number + 0.0;
}

std::vector<std::string> words(std::string_view line) {
  std::vector<std::string> out;
  while (true) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) return out;
    line.remove_prefix(first);
    const auto end = std::min(line.find_first_of(" \t\r"), line.size());
    out.emplace_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

}  // namespace smoothpost::ini
