#include "formats/heidenhain/source.h"

#include <algorithm>

#include "formats/nc/number.h"

namespace smoothpost::conversational {
namespace {

using nc::detail::is_blank;
using nc::detail::is_digit;

std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// The next line of `text`, taken from its front with its line end.
std::string_view take_line(std::string_view& text, char line_end) {
  const std::size_t end = std::min(text.find(line_end), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(text.size(), end + 1));
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

/// The line without block number and skip mark.
std::string_view without_number(std::string_view line) {
  line = without_blanks(line);
  std::size_t digits = 0;
  while (digits < line.size() && is_digit(line[digits])) ++digits;
  if (digits > 0 && (digits == line.size() || is_blank(line[digits])))
    line = without_blanks(line.substr(digits));
  if (!line.empty() && line.front() == '/') line = without_blanks(line.substr(1));
  return line;
}

bool is_comment(std::string_view line) {
  return !line.empty() && (line.front() == ';' || line.front() == '*');
}

/// Where the comment begins, outside of quotes.
std::size_t comment_start(std::string_view line) {
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    if (line[i] == ';' && !quoted) return i;
  }
  return line.size();
}

}  // namespace

Source::Source(std::string_view text)
    : text_(text), line_end_(text.find('\n') == std::string_view::npos ? '\r' : '\n') {
  std::string_view rest = text;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (rest.substr(0, 3) == kByteOrderMark) rest.remove_prefix(3);
  bool goes_on = false;
  while (!rest.empty()) {
    const auto begin = static_cast<std::uint32_t>(rest.data() - text.data());
    const std::string_view line = without_blanks(take_line(rest, line_end_));
    ++lines_;
    if (line.empty() && !goes_on) continue;
    const bool marked = !line.empty() && line.back() == '~';
    if (!goes_on) starts_.push_back({begin, lines_});
    goes_on = marked && (goes_on || !is_comment(without_number(line)));
  }
}

std::size_t Source::length(std::size_t index) const {
  const std::size_t end = index + 1 < starts_.size() ? starts_[index + 1].begin : text_.size();
  return end - starts_[index].begin;
}

Statement Source::read(std::size_t index) {
  const Start start = starts_[index];
  std::string_view rest = text_.substr(start.begin, length(index));
  parts_.clear();
  joined_.clear();
  Statement out;
  std::uint32_t line_number = start.line;
  const std::string_view first = take_line(rest, line_end_);
  std::string_view line = without_number(first);
  const auto column_in = [](std::string_view whole, std::string_view part) {
    return static_cast<std::uint32_t>(part.data() - whole.data()) + 1;
  };
  if (is_comment(line)) {
    parts_.push_back({0, {line_number, column_in(first, line)}});
    line.remove_prefix(1);
    line = without_blanks(line);
    if (!line.empty() && line.front() == '-' && first.find('*') != std::string_view::npos)
      line = without_blanks(line.substr(1));
    out.comment = line;
    return out;
  }
  const bool several = !line.empty() && line.back() == '~';
  if (!several) {
    parts_.push_back({0, {line_number, column_in(first, line)}});
    const std::size_t end = comment_start(line);
    out.text = without_blanks(line.substr(0, end));
    if (end < line.size()) out.comment = without_blanks(line.substr(end + 1));
    return out;
  }
  add_line(line, out.comment, {line_number, column_in(first, line)});
  while (!rest.empty()) {
    const std::string_view whole = take_line(rest, line_end_);
    ++line_number;
    line = without_blanks(whole);
    if (line.empty()) continue;
    add_line(line, out.comment, {line_number, column_in(whole, line)});
  }
  out.text = without_blanks(joined_);
  return out;
}

/// One line of a block of several.
void Source::add_line(std::string_view line, std::string_view& comment, nc::TextPlace place) {
  if (!line.empty() && line.back() == '~') line = without_blanks(line.substr(0, line.size() - 1));
  const std::size_t end = comment_start(line);
  if (end < line.size() && comment.empty()) comment = without_blanks(line.substr(end + 1));
  if (!joined_.empty()) joined_.push_back(' ');
  parts_.push_back({joined_.size(), place});
  joined_ += without_blanks(line.substr(0, end));
}

nc::TextPlace Source::place(std::size_t offset) const {
  std::size_t i = parts_.size();
  while (i > 1 && parts_[i - 1].offset > offset) --i;
  if (i == 0) return {1, 1};
  nc::TextPlace place = parts_[i - 1].place;
  place.column += static_cast<std::uint32_t>(offset - std::min(offset, parts_[i - 1].offset));
  return place;
}

}  // namespace smoothpost::conversational
