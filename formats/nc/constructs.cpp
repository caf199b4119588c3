#include "formats/nc/constructs.h"

#include <algorithm>
#include <array>

#include "formats/nc/number.h"

namespace smoothpost::nc {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_name_character(char c) { return is_letter(c) || detail::is_digit(c) || c == '_'; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }

std::uint32_t to_length(std::size_t n) { return static_cast<std::uint32_t>(n); }

/// Index behind the bracket that closes the one at `begin`, or the end of the text.
std::size_t behind_bracket(std::string_view text, std::size_t begin) {
  int depth = 0;
  for (std::size_t i = begin; i < text.size(); ++i) {
    if (text[i] == '[') ++depth;
    if (text[i] == ']' && --depth == 0) return i + 1;
  }
  return text.size();
}

std::size_t behind_number(std::string_view text, std::size_t begin) {
  std::size_t i = begin;
  while (i < text.size() && (detail::is_digit(text[i]) || text[i] == '.' || text[i] == '-' ||
                             text[i] == '+' || text[i] == ',')) {
    ++i;
  }
  return i;
}

/// Index behind a parameter such as #12, ##3, #<name> or #[1+2] that starts at `begin`.
std::size_t behind_parameter(std::string_view text, std::size_t begin) {
  std::size_t i = begin;
  while (i < text.size() && text[i] == '#') ++i;
  if (i < text.size() && text[i] == '[') return behind_bracket(text, i);
  if (i < text.size() && text[i] == '<') {
    const std::size_t close = text.find('>', i);
    return close == std::string_view::npos ? text.size() : close + 1;
  }
  return std::max(behind_number(text, i), begin + 1);
}

/// Words by which other controllers switch their tool-centre-point or tilted-plane mode.
bool is_tcp_name(std::string_view name) {
  static constexpr std::array<std::string_view, 12> kNames = {
      "TRAORI", "TRAFOOF", "CYCLE800", "TCPM", "TCPMOF", "TCPMON",
      "ORIWKS", "ORIMKS",  "TRANSMIT", "RTCP", "RTCPON", "RTCPOF"};
  std::string text;
  for (const char c : name) text.push_back(upper(c));
  return std::find(kNames.begin(), kNames.end(), text) != kNames.end();
}

ConstructSpan measure_name(std::string_view rest) {
  std::size_t end = 0;
  while (end < rest.size() && is_name_character(rest[end])) ++end;
  // A function, as in SIN[30] or XSIN[30].
  if (end < rest.size() && rest[end] == '[') {
    return {Construct::expression, to_length(behind_bracket(rest, end))};
  }
  const Construct kind = is_tcp_name(rest.substr(0, end)) ? Construct::tcp_mode : Construct::name;
  return {kind, length_to_comment(rest)};
}

ConstructSpan measure_letter(std::string_view rest) {
  if (rest.size() > 1 && is_name_character(rest[1]) && !detail::is_digit(rest[1])) {
    return measure_name(rest);
  }
  std::size_t i = 1;
  while (i < rest.size() && detail::is_blank(rest[i])) ++i;
  if (i == rest.size()) return {Construct::letter_alone, 1};
  if (rest[i] == '[') return {Construct::expression, to_length(behind_bracket(rest, i))};
  if (rest[i] == '#') return {Construct::parameter, to_length(behind_parameter(rest, i))};
  if (rest[i] == '=') return {Construct::assignment, length_to_comment(rest)};
  const std::size_t end = behind_number(rest, i);
  if (end == i) {
    std::size_t name = i;
    while (name < rest.size() && is_letter(rest[name])) ++name;
    if (name > i && name < rest.size() && rest[name] == '[') {
      return {Construct::expression, to_length(behind_bracket(rest, name))};
    }
    return {Construct::letter_alone, 1};
  }
  if (end < rest.size() && rest[end] == '=') {
    return {Construct::assignment, length_to_comment(rest)};
  }
  if (end < rest.size() && rest[end] == '#') {
    return {Construct::parameter, to_length(behind_parameter(rest, end))};
  }
  if (end < rest.size() && rest[end] == '[') {
    return {Construct::expression, to_length(behind_bracket(rest, end))};
  }
  return {Construct::bad_number, to_length(end)};
}

std::size_t behind_foreign(std::string_view rest) {
  static constexpr std::string_view kKnown = " \t()[]#;/%\"=@^$.+-";
  std::size_t i = 1;
  while (i < rest.size() && !is_letter(rest[i]) && !detail::is_digit(rest[i]) &&
         kKnown.find(rest[i]) == std::string_view::npos) {
    ++i;
  }
  return i;
}

/// The text with bytes outside printable ASCII as \xNN, at most 40 characters of it.
std::string shown(std::string_view text) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string out;
  for (const char c : text) {
    if (out.size() >= 40) return out + "...";
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 32 && byte < 127) {
      out.push_back(c);
    } else {
      out += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

struct ConstructText {
  const char* code;
  const char* what;
  const char* remedy;
};

constexpr std::array<ConstructText, 19> kTexts = {{
    {"NC101", "a character that is not part of the NC language",
     "remove it or put it in a comment"},
    {"NC102", "a comment is not closed on its line", "write the missing )"},
    {"NC103", "a comment inside a comment", "remove the inner ( ; controllers refuse it"},
    {"NC104", "a word without a number", "write the number behind the letter"},
    {"NC105", "not a number", "write digits with one decimal point and no exponent, as in X-1.25"},
    {"NC106", "a number without a letter", "write the letter of the word in front of it"},
    {"NC107", "a % that does not stand alone on its line", "put the % on a line of its own"},
    {"NC108", "a / that is not at the start of the line", "block delete stands first on a line"},
    {"NC109", "a ) without a comment before it", "remove it or write the missing ("},
    {"NC110", "a line number that is not at the start of the line", "write N first, once"},
    {"NC120", "an expression or function stands where none is read",
     "write a letter before it, or let the CAM post write plain numbers"},
    {"NC121", "a parameter (#) is not read here", "let the CAM post write plain numbers"},
    {"NC122", "an O word behind other words of its line, or one of LinuxCNC in another dialect",
     "write it on a line of its own, or name the program's control by --input-dialect"},
    {"NC123", "quoted text is not read in this version", "write it as a ( comment )"},
    {"NC124", "an assignment or address with = is not read in this version",
     "let the CAM post write words such as X1.5, or name the program's control by --input-dialect"},
    {"NC125", "a command of another controller's language is not read in this version",
     "name the program's control by --input-dialect, or post for LinuxCNC (RS274NGC)"},
    {"NC126", "polar coordinates (@, ^) are not read in this version",
     "let the CAM post write X and Y words"},
    {"NC127", "the choice of a spindle ($) is not read in this version",
     "let the CAM post write for one spindle"},
    {"NC128", "a tool-centre-point or tilted-plane mode of another controller",
     "name the program's control by --input-dialect, or post for M428/M429 or with joint words"},
}};

}  // namespace

std::uint32_t length_to_comment(std::string_view rest) {
  std::size_t end = std::min(rest.find_first_of("(;", 1), rest.size());
  while (end > 1 && detail::is_blank(rest[end - 1])) --end;
  return to_length(end);
}

const char* code_of(Construct kind) { return kTexts[static_cast<std::size_t>(kind)].code; }

std::string describe(Construct kind, std::string_view text) {
  const ConstructText& row = kTexts[static_cast<std::size_t>(kind)];
  return std::string(row.what) + ": \"" + shown(text) + "\"; " + row.remedy;
}

ConstructSpan measure_construct(std::string_view rest) {
  const char c = rest.front();
  if (is_letter(c)) return measure_letter(rest);
  if (c == '_') return measure_name(rest);
  if (detail::is_digit(c) || c == '.' || c == '+' || c == '-') {
    return {Construct::number_alone, to_length(std::max(behind_number(rest, 0), std::size_t{1}))};
  }
  switch (c) {
    case '(': {
      const std::size_t stop = rest.find_first_of("()", 1);
      if (stop == std::string_view::npos) return {Construct::open_comment, to_length(rest.size())};
      const std::size_t close = rest.find(')', stop);
      if (close == std::string_view::npos) return {Construct::open_comment, to_length(rest.size())};
      return {Construct::nested_comment, to_length(close + 1)};
    }
    case ')':
      return {Construct::close_parenthesis, 1};
    case '[':
    case ']':
      return {Construct::expression,
              to_length(c == '[' ? behind_bracket(rest, 0) : std::size_t{1})};
    case '#':
      return {Construct::parameter, length_to_comment(rest)};
    case '"': {
      const std::size_t close = rest.find('"', 1);
      return {Construct::quoted_text,
              to_length(close == std::string_view::npos ? rest.size() : close + 1)};
    }
    case '=':
      return {Construct::assignment, length_to_comment(rest)};
    case '@':
    case '^':
      return {Construct::polar, to_length(behind_number(rest, 1))};
    case '$':
      return {Construct::spindle_choice, to_length(behind_number(rest, 1))};
    case '%':
      return {Construct::misplaced_percent, length_to_comment(rest)};
    case '/':
      return {Construct::misplaced_slash, 1};
    default:
      return {Construct::foreign_character, to_length(behind_foreign(rest))};
  }
}

}  // namespace smoothpost::nc
