#include "formats/cl/statement.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace smoothpost::cl {
namespace {

constexpr bool is_blank(char c) { return c == ' ' || c == '\t'; }
constexpr bool is_newline(char c) { return c == '\n' || c == '\r'; }
constexpr bool is_letter(char c) { return upper(c) >= 'A' && upper(c) <= 'Z'; }
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Characters of words and numbers.
constexpr std::array<bool, 256> kToken = [] {
  std::array<bool, 256> table{};
  for (int c = 0; c < 256; ++c) {
    const char letter = static_cast<char>(c);
    table[static_cast<std::size_t>(c)] = is_letter(letter) || is_digit(letter) || letter == '_' ||
                                         letter == '.' || letter == '+' || letter == '-';
  }
  return table;
}();
constexpr bool is_token(char c) { return kToken[static_cast<unsigned char>(c)]; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Whether the line's code part goes on in the next line: its last sign is a single `$`.
bool continues(std::string_view line) {
  const std::size_t comment = line.find("$$");
  line = trimmed(line.substr(0, comment));
  return comment == std::string_view::npos && !line.empty() && line.back() == '$';
}

struct Number {
  double value = 0.0;
  bool good = false;
  bool huge = false;
};

Number read_number(std::string_view token) {
  const std::size_t sign = token.front() == '+' || token.front() == '-' ? 1 : 0;
  if (token.size() == sign || !(is_digit(token[sign]) || token[sign] == '.')) return {};
  if (token.front() == '+') token.remove_prefix(1);
  Number number;
  const auto [end, error] =
      std::from_chars(token.data(), token.data() + token.size(), number.value);
  number.huge = error == std::errc::result_out_of_range;
  number.good = error == std::errc() && end == token.data() + token.size();
  return number;
}

bool has_letter(std::string_view token) {
  for (const char c : token)
    if (is_letter(c) || c == '_') return true;
  return false;
}

}  // namespace

std::string quoted(std::string_view text) {
  std::string out = "`";
  for (const char c : text.substr(0, 40))
    out += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  return out + (text.size() > 40 ? "...`" : "`");
}

Scanner::Scanner(std::string_view text, DiagnosticLog* log) : text_(text), log_(log) {
  if (text_.substr(0, 3) == "\xef\xbb\xbf") line_begin_ = at_ = 3;
}

bool Scanner::at_line_end() const { return at_end() || is_newline(text_[at_]); }

void Scanner::skip_blanks() {
  while (!at_end() && is_blank(text_[at_])) ++at_;
}

/// Over the line end at `at_`, if there is one.
void Scanner::end_line() {
  if (at_end()) return;
  const bool pair = text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n';
  at_ += pair ? 2 : 1;
  line_begin_ = at_;
  ++line_;
}

std::size_t Scanner::line_end(std::size_t from) const {
  const std::size_t end = text_.find_first_of("\r\n", from);
  return end == std::string_view::npos ? text_.size() : end;
}

TextPlace Scanner::place(std::size_t at) const {
  return {line_, static_cast<std::uint32_t>(at - line_begin_) + 1};
}

bool Scanner::begins_with(std::size_t at, std::string_view upper_case) const {
  return same_word(text_.substr(std::min(at, text_.size()), upper_case.size()), upper_case);
}

bool Scanner::next() {
  statement_.kind = Statement::Kind::statement;
  statement_.info = nullptr;
  statement_.items.clear();
  statement_.major = statement_.text = statement_.trailing = {};
  while (true) {
    skip_blanks();
    if (at_end()) return false;
    if (!is_newline(text_[at_])) break;
    end_line();
  }
  begin_ = at_;
  statement_.place = place(at_);
  value_before_ = comma_before_ = false;
  const char c = text_[at_];
  if (c == '$' && text_.substr(at_, 2) == "$$" && !scan_vendor_comment()) {
    scan_comment();
  } else if (is_letter(text_[at_])) {
    scan_major();
  } else if (is_digit(c) || c == '-' || c == '+' || c == '.') {
    statement_.kind = Statement::Kind::values;
    scan_items();
  } else {
    fail("CL101", quoted(text_.substr(at_, 1)) + " begins no statement; comments begin with $$",
         at_);
    skip_statement();
  }
  end_ = at_;
  end_line();
  return true;
}

void Scanner::scan_comment() {
  statement_.kind = Statement::Kind::comment;
  const std::size_t end = line_end(at_);
  statement_.text = trimmed(text_.substr(at_ + 2, end - at_ - 2));
  at_ = end;
}

/// `$$-> CSYS / ...`: goes to its word.
bool Scanner::scan_vendor_comment() {
  std::size_t at = at_ + 2;
  const auto over_blanks = [&] {
    while (at < text_.size() && is_blank(text_[at])) ++at;
  };
  over_blanks();
  if (text_.substr(at, 2) != "->") return false;
  at += 2;
  over_blanks();
  if (!begins_with(at, "CSYS")) return false;
  const std::size_t word = at;
  at += 4;
  over_blanks();
  if (at >= text_.size() || text_[at] != '/') return false;
  at_ = begin_ = word;
  return true;
}

void Scanner::scan_major() {
  const std::size_t begin = at_;
  word_.clear();
  while (!at_end()) {
    const char c = text_[at_];
    const bool dash = c == '-' && at_ + 1 < text_.size() && is_letter(text_[at_ + 1]);
    if (!is_letter(c) && !is_digit(c) && c != '_' && !dash) break;
    word_ += upper(c);
    ++at_;
  }
  join_tool_path();
  statement_.major = text_.substr(begin, at_ - begin);
  statement_.info = find_word(word_);
  if (statement_.info == nullptr) {
    // PPRINT and its like may be followed by their text without a blank.
    const WordInfo* prefix = find_word(std::string_view(word_).substr(0, 6));
    if (prefix != nullptr && prefix->rest == Rest::line) {
      statement_.info = prefix;
      statement_.major = text_.substr(begin, 6);
      return scan_text(begin + 6);
    }
    const std::size_t letters = word_.find_last_not_of("0123456789") + 1;
    if (letters < word_.size() && find_word(std::string_view(word_).substr(0, letters))) {
      fail("CL103", "`/` is expected behind " + word_.substr(0, letters), begin + letters);
    } else if (skip_blanks(); !at_end() && text_[at_] == '=') {
      fail_at_sign(at_);
    }
    return skip_statement();
  }
  const Rest rest = statement_.info->rest;
  if (rest == Rest::line) return scan_text(at_);
  if (rest == Rest::free) return skip_statement();
  skip_blanks();
  value_before_ = true;
  if (!at_end() && text_[at_] == '/') {
    ++at_;
    value_before_ = false;
  } else if (!at_line_end() && text_[at_] != ',' && text_[at_] != '$') {
    fail("CL103",
         "`/` is expected behind " + word_ + ", not " + quoted(text_.substr(at_, 1)) +
             "; one statement stands on a line",
         at_);
    return skip_statement();
  }
  scan_items();
}

/// NX writes the word TOOL PATH with a blank.
void Scanner::join_tool_path() {
  if (word_ != "TOOL") return;
  std::size_t at = at_;
  while (at < text_.size() && is_blank(text_[at])) ++at;
  if (at == at_ || !begins_with(at, "PATH")) return;
  at_ = at + 4;
  word_ = "TOOLPATH";
}

void Scanner::scan_text(std::size_t begin) {
  const std::size_t end = line_end(begin);
  std::string_view text = trimmed(text_.substr(begin, end - begin));
  if (!text.empty() && text.front() == '/') text = trimmed(text.substr(1));
  statement_.text = text;
  at_ = end;
}

void Scanner::push(Item::Kind kind) {
  Item item;
  item.kind = kind;
  item.text = text_.substr(std::min(at_, text_.size()), 1);
  item.place = place(at_);
  statement_.items.push_back(item);
}

/// Values up to the end of the statement.
void Scanner::scan_items() {
  while (statement_.kind != Statement::Kind::bad) {
    if (at_line_end()) break;
    const char c = text_[at_];
    if (statement_.items.size() > kMostItems) {
      fail("CL105",
           "a statement of more than " + std::to_string(kMostItems) +
               " values; a `$` at the end of a line continues a statement",
           at_);
      return skip_statement();
    }
    if (is_blank(c)) {
      ++at_;
    } else if (is_token(c)) {
      scan_token();
    } else if (c == ',') {
      if (!value_before_) push(Item::Kind::empty);
      value_before_ = false;
      comma_before_ = true;
      ++at_;
    } else if (c == '/' || c == '(') {
      push(c == '/' ? Item::Kind::slash : Item::Kind::open);
      value_before_ = comma_before_ = false;
      ++at_;
    } else if (c == ')') {
      push(Item::Kind::close);
      value_before_ = true;
      ++at_;
    } else if (c == '$') {
      if (!scan_dollar()) return;
    } else {
      fail_at_sign(at_);
      return skip_statement();
    }
  }
  if (comma_before_ && statement_.kind != Statement::Kind::bad) push(Item::Kind::empty);
}

void Scanner::scan_token() {
  const std::size_t begin = at_;
  while (!at_end() && is_token(text_[at_])) ++at_;
  const std::string_view token = text_.substr(begin, at_ - begin);
  if (value_before_) {
    fail("CL103", "`,` is expected before " + quoted(token), begin);
    return skip_statement();
  }
  Item item;
  item.text = token;
  item.place = place(begin);
  const Number number = read_number(token);
  if (number.good) {
    item.kind = Item::Kind::number;
    item.value = number.value;
  } else if (number.huge) {
    fail("CL102", quoted(token) + " is beyond the range of numbers", begin);
    return skip_statement();
  } else if (has_letter(token)) {
    item.kind = Item::Kind::word;
  } else {
    fail("CL102",
         quoted(token) + " is not a number; write digits with one decimal point, such as -12.5",
         begin);
    return skip_statement();
  }
  statement_.items.push_back(item);
  value_before_ = true;
  comma_before_ = false;
}

/// At a `$`: a comment or the end of the text ends the statement (false), a continuation goes on.
bool Scanner::scan_dollar() {
  if (text_.substr(at_, 2) == "$$") {
    const std::size_t end = line_end(at_);
    statement_.trailing = trimmed(text_.substr(at_ + 2, end - at_ - 2));
    if (comma_before_) push(Item::Kind::empty);
    at_ = end;
    return false;
  }
  const std::size_t dollar = at_++;
  skip_blanks();
  if (at_end()) {
    fail("CL104", "the text ends behind a `$` that continues the statement", dollar);
    return false;
  }
  if (!is_newline(text_[at_])) {
    fail("CL104", "a `$` that is not at the end of its line; comments begin with $$", dollar);
    skip_statement();
    return false;
  }
  end_line();
  return true;
}

/// To the end of the statement's last line.
void Scanner::skip_statement() {
  while (true) {
    const std::size_t end = line_end(at_);
    const bool more = continues(text_.substr(at_, end - at_));
    at_ = end;
    if (!more || at_end()) return;
    end_line();
  }
}

/// A sign that has no place in a statement.
void Scanner::fail_at_sign(std::size_t at) {
  const std::string sign = quoted(text_.substr(at, 1));
  fail("CL101",
       text_[at] == '='
           ? sign +
                 " is not part of CL data: names and definitions of APT source are not read; let "
                 "the CAM system write cutter locations"
           : sign + " is not part of CL data; remove it or put it behind $$",
       at);
}

void Scanner::fail(const char* code, std::string text, std::size_t at) {
  statement_.kind = Statement::Kind::bad;
  statement_.items.clear();
  if (log_ != nullptr) log_->error(code, std::move(text), place(at));
}

std::string Scanner::written() const {
  std::string out;
  std::size_t at = begin_;
  while (at < end_) {
    const std::size_t end = std::min(line_end(at), end_);
    std::string_view line = text_.substr(at, end - at);
    if (statement_.info == nullptr || statement_.info->rest != Rest::line) {
      line = line.substr(0, line.find("$$"));
      line = trimmed(line);
      if (!line.empty() && line.back() == '$') line.remove_suffix(1);
    }
    out += trimmed(line);
    at = text_.find_first_not_of("\r\n", end);
    if (at == std::string_view::npos) break;
  }
  return out;
}

}  // namespace smoothpost::cl
