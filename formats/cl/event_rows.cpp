#include "formats/cl/event_rows.h"

#include <algorithm>

#include "formats/cl/words.h"

namespace smoothpost::cl {
namespace {

constexpr bool is_blank(char c) { return c == ' ' || c == '\t'; }

/// The part before the first `/` or `,` without blanks, in upper case.
std::string major_of(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, text.find_first_of("/,{")))
    if (!is_blank(c)) out += upper(c);
  return out;
}

/// Compares a statement with the text of one row.
class Comparison {
 public:
  Comparison(std::string_view row, std::string_view statement) : row_(row), text_(statement) {}

  bool fits(std::vector<std::pair<std::string, std::string>>& values) {
    while (true) {
      skip(row_);
      skip(text_);
      if (row_.empty()) return text_.empty();
      if (row_.front() == '{') {
        if (!take_value(values)) return false;
        continue;
      }
      if (text_.empty() || upper(row_.front()) != upper(text_.front())) return false;
      row_.remove_prefix(1);
      text_.remove_prefix(1);
    }
  }

 private:
  static void skip(std::string_view& text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  }

  bool take_value(std::vector<std::pair<std::string, std::string>>& values) {
    const std::size_t close = row_.find('}');
    if (close == std::string_view::npos) return false;
    const std::string name(row_.substr(1, close - 1));
    row_.remove_prefix(close + 1);
    const std::size_t end = name == "text" ? text_.size() : std::min(text_.find(','), text_.size());
    std::string_view value = text_.substr(0, end);
    text_.remove_prefix(end);
    while (!value.empty() && is_blank(value.back())) value.remove_suffix(1);
    if (value.empty()) return false;
    values.emplace_back(name, value);
    return true;
  }

  std::string_view row_;
  std::string_view text_;
};

}  // namespace

EventRows::EventRows(const ProcessTable& table) : table_(table) {
  for (const EventWords& row : table.events) majors_.push_back(major_of(row.text));
}

bool EventRows::knows(std::string_view major) const {
  if (majors_.empty()) return false;
  const std::string name = major_of(major);
  return std::find(majors_.begin(), majors_.end(), name) != majors_.end();
}

EventRows::Match EventRows::find(std::string_view statement) const {
  const std::string major = major_of(statement);
  for (std::size_t i = 0; i < majors_.size(); ++i) {
    if (majors_[i] != major) continue;
    Match match;
    if (!Comparison(table_.events[i].text, statement).fits(match.values)) continue;
    match.row = &table_.events[i];
    return match;
  }
  return {};
}

}  // namespace smoothpost::cl
