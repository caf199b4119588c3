#include "formats/heidenhain/scanner.h"

#include <algorithm>
#include <charconv>

#include "formats/nc/number.h"

namespace smoothpost::conversational {
namespace {

constexpr std::size_t kLongestNumber = 40;

char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }
bool is_letter(char c) { return upper(c) >= 'A' && upper(c) <= 'Z'; }

}  // namespace

bool Scanner::at_end() {
  while (at_ < text_.size() && nc::detail::is_blank(text_[at_])) ++at_;
  return at_ == text_.size();
}

char Scanner::peek(std::size_t ahead) {
  at_end();
  return at_ + ahead < text_.size() ? upper(text_[at_ + ahead]) : '\0';
}

bool Scanner::sees(std::string_view word) {
  at_end();
  if (text_.size() - at_ < word.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i)
    if (upper(text_[at_ + i]) != word[i]) return false;
  const std::size_t next = at_ + word.size();
  return !is_letter(word.back()) || next == text_.size() || !is_letter(text_[next]);
}

bool Scanner::take(std::string_view word) {
  if (!sees(word)) return false;
  at_ += word.size();
  return true;
}

bool Scanner::take_byte(char byte) {
  if (peek() != byte) return false;
  ++at_;
  return true;
}

std::optional<double> Scanner::number() {
  at_end();
  std::string digits;
  std::size_t end = at_;
  bool point = false;
  bool any = false;
  for (; end < text_.size() && digits.size() < kLongestNumber; ++end) {
    const char c = text_[end];
    if (nc::detail::is_digit(c)) {
      any = true;
      digits.push_back(c);
    } else if ((c == '.' || c == ',') && !point) {
      point = true;
      digits.push_back('.');
    } else {
      break;
    }
  }
  if (!any || digits.size() == kLongestNumber) return {};
  double value = 0.0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value,
                                    std::chars_format::fixed);
  if (read.ec != std::errc{}) return {};
  at_ = end;
  return value;
}

std::optional<std::string> Scanner::quoted() {
  if (peek() != '"') return {};
  const std::size_t close = text_.find('"', at_ + 1);
  if (close == std::string_view::npos) return {};
  std::string out(text_.substr(at_ + 1, close - at_ - 1));
  at_ = close + 1;
  return out;
}

std::optional<long> Scanner::whole() {
  at_end();
  long value = 0;
  const auto read = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
  if (read.ec != std::errc{} || value < 0) return {};
  at_ = static_cast<std::size_t>(read.ptr - text_.data());
  return value;
}

std::string Scanner::token() {
  constexpr std::size_t kMost = 32;
  at_end();
  const std::size_t end = std::min(text_.find_first_of(" \t", at_), text_.size());
  std::string out;
  for (const char c : text_.substr(at_, std::min(end - at_, kMost)))
    out.push_back(c >= ' ' && c <= '~' ? c : '?');
  return out;
}

std::string_view Scanner::rest() {
  at_end();
  return text_.substr(at_);
}

}  // namespace smoothpost::conversational
