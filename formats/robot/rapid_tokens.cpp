#include "formats/robot/rapid_tokens.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace smoothpost::rapid {

namespace {

constexpr std::size_t kMostName = 32;
constexpr std::size_t kMostText = 80;

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_control(char c) {
  return static_cast<unsigned char>(c) < 0x20U && c != '\t' && c != '\n' && c != '\r';
}

}  // namespace

void Tokens::skip_blanks() {
  for (; at_ < text_.size(); ++at_) {
    const char c = text_[at_];
    if (c == '!') {
      while (at_ < text_.size() && text_[at_] != '\n' && !is_control(text_[at_])) ++at_;
      if (at_ == text_.size() || text_[at_] != '\n') return;
    }
    if (text_[at_] == '\n') {
      ++line_;
      line_begin_ = at_ + 1;
    } else if (c != ' ' && c != '\t' && c != '\r') {
      return;
    }
  }
}

Token Tokens::next() {
  const std::size_t before = at_;
  skip_blanks();
  Token token;
  token.line = line_;
  token.column = static_cast<std::uint32_t>(at_ - line_begin_ + 1);
  token.blank_before = at_ != before;
  if (at_ == text_.size()) return token;
  const char c = text_[at_];
  if (is_letter(c)) return name(std::move(token));
  const bool sign = c == '-' || c == '+';
  const char first = sign ? at(1) : c;
  if (is_digit(first) || (first == '.' && is_digit(at(sign ? 2 : 1))))
    return number(std::move(token));
  if (c == '"') return quoted(std::move(token));
  return symbol(std::move(token));
}

Token Tokens::bad(Token token, std::size_t length, const char* what) {
  token.kind = Token::Kind::bad;
  token.source = text_.substr(at_, length);
  token.text = what;
  at_ += token.source.size();
  return token;
}

Token Tokens::name(Token token) {
  std::size_t length = 1;
  while (is_letter(at(length)) || is_digit(at(length)) || at(length) == '_') ++length;
  if (length > kMostName)
    return bad(std::move(token), length, "a name has more than 32 characters");
  token.kind = Token::Kind::word;
  token.source = text_.substr(at_, length);
  token.text = token.source;
  for (char& c : token.text)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
  at_ += length;
  return token;
}

Token Tokens::number(Token token) {
  const char* const begin = text_.data() + at_;
  const char* const end = text_.data() + text_.size();
  const char* const digits = *begin == '+' ? begin + 1 : begin;
  const auto [behind, fault] = std::from_chars(digits, end, token.number);
  const auto length = static_cast<std::size_t>(behind - begin);
  if (fault != std::errc() || !std::isfinite(token.number))
    return bad(std::move(token), std::max<std::size_t>(length, 1), "a number is out of range");
  if (is_letter(at(length)) || at(length) == '_' || at(length) == '.')
    return bad(std::move(token), length + 1, "a number ends in something else");
  token.kind = Token::Kind::number;
  token.source = text_.substr(at_, length);
  at_ += length;
  return token;
}

// A quote is written twice inside a text, a backslash too.
Token Tokens::quoted(Token token) {
  std::size_t length = 1;
  for (;; ++length) {
    const char c = at(length);
    if (at_ + length >= text_.size() || c == '\n' || c == '\r' || is_control(c))
      return bad(std::move(token), length, "a text is not closed by \"");
    if (c == '"' || c == '\\') {
      if (at(length + 1) == c)
        ++length;
      else if (c == '"')
        break;
      else
        return bad(std::move(token), length, "a text has a single backslash");
    }
    token.text += c;
  }
  ++length;
  if (token.text.size() > kMostText)
    return bad(std::move(token), length, "a text has more than 80 characters");
  token.kind = Token::Kind::text;
  token.source = text_.substr(at_, length);
  at_ += length;
  return token;
}

Token Tokens::symbol(Token token) {
  constexpr std::string_view kSymbols = ";,[]()\\:";
  if (kSymbols.find(text_[at_]) == std::string_view::npos)
    return bad(std::move(token), 1, "this character has no place here");
  const std::size_t length = at(0) == ':' && at(1) == '=' ? 2 : 1;
  token.kind = Token::Kind::symbol;
  token.source = text_.substr(at_, length);
  token.text = token.source;
  at_ += length;
  return token;
}

}  // namespace smoothpost::rapid
