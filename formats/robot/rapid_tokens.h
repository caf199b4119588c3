#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace smoothpost::rapid {

/// The smallest pieces of RAPID text. Internal to formats/robot.
struct Token {
  enum class Kind : std::uint8_t {
    word,    ///< a name or keyword
    number,  ///< with its sign; `number` is its value
    text,    ///< "..."; `text` without the quotes
    symbol,  ///< one of ; , [ ] ( ) \ : or :=
    bad,     ///< `text` says what is wrong
    end
  } kind = Kind::end;
  std::string_view source;  ///< as written
  std::string text;         ///< word: in upper case
  double number = 0.0;
  std::uint32_t line = 1;
  std::uint32_t column = 1;
  bool blank_before = false;

  bool is(std::string_view symbol_or_word) const {
    return (kind == Kind::symbol || kind == Kind::word) && text == symbol_or_word;
  }
};

/// Takes text apart; comments (! to the end of the line) and blanks are left out.
class Tokens {
 public:
  explicit Tokens(std::string_view text) : text_(text) {}

  /// The next token; `end` for ever behind the last one. Every other token moves forward.
  Token next();
  std::uint32_t line() const { return line_; }

 private:
  void skip_blanks();
  Token name(Token token);
  Token number(Token token);
  Token quoted(Token token);
  Token symbol(Token token);
  Token bad(Token token, std::size_t length, const char* what);
  char at(std::size_t offset) const {
    return at_ + offset < text_.size() ? text_[at_ + offset] : '\0';
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_begin_ = 0;
  std::uint32_t line_ = 1;
};

}  // namespace smoothpost::rapid
