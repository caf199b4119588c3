#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace smoothpost::conversational {

/// Reads the words of one block from left to right. Letters count without regard to case; blanks
/// may stand between words and between an address and its value.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  /// Passes over blanks.
  bool at_end();
  /// The next byte in upper case, or the one `ahead` of it; 0 at the end. The first one is never a
  /// blank.
  char peek(std::size_t ahead = 0);
  std::size_t offset() const { return at_; }

  /// Takes a word written in upper case here; a letter at its end must not be followed by another.
  bool take(std::string_view word);
  /// Whether take() would, without taking.
  bool sees(std::string_view word);
  /// Takes one byte.
  bool take_byte(char byte);

  /// Digits with at most one point or comma, without sign.
  std::optional<double> number();
  /// The text between quotes.
  std::optional<std::string> quoted();
  /// A whole number without sign.
  std::optional<long> whole();

  /// What stands here up to the next blank, at most 32 bytes: for messages.
  std::string token();
  std::string_view rest();

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace smoothpost::conversational
