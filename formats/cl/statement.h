#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/cl/diagnostic_log.h"
#include "formats/cl/words.h"

namespace smoothpost::cl {

/// A part of a statement behind its major word.
struct Item {
  enum class Kind : std::uint8_t { number, word, empty, slash, open, close } kind = Kind::empty;
  double value = 0.0;     ///< of a number, as written
  std::string_view text;  ///< of a number or word, as written
  TextPlace place;
};

/// One statement, comment or line of values of the text.
struct Statement {
  enum class Kind : std::uint8_t {
    statement,
    comment,  ///< $$ on a line of its own: only `text`
    values,   ///< a line that begins with a number: only `items` (Creo's points of an arc)
    bad       ///< a fault was told; `info` is known when the word was
  } kind = Kind::statement;
  const WordInfo* info = nullptr;  ///< row of the major word; nullptr: a word that nobody knows
  std::string_view major;          ///< as written; valid as long as the text
  std::vector<Item> items;         ///< Rest::items; the slash behind the major word left out
  std::string_view text;           ///< Rest::line and comments, without blanks at the ends
  std::string_view trailing;       ///< $$ comment behind the statement
  TextPlace place;

  Word word() const { return info == nullptr ? Word::unknown : info->word; }
};

/// Splits CL text into statements, in one pass with the memory of the longest statement.
///
/// Blanks count for nothing but in text and inside numbers. `$` at the end of a line continues the
/// statement, `$$` begins a comment. A comment `$$-> CSYS / ...` is the statement CSYS (Creo). LF,
/// CR LF and CR end a line; a UTF-8 byte order mark is passed over.
/// Codes: CL101 to CL105, told to `log` unless it is nullptr.
class Scanner {
 public:
  static constexpr std::size_t kMostItems = 1000;

  /// The text outlives the scanner.
  Scanner(std::string_view text, DiagnosticLog* log);

  /// Goes to the next statement; false at the end of the text.
  bool next();
  const Statement& statement() const { return statement_; }

  /// The present statement in one line, without continuation marks and comments.
  std::string written() const;

  /// Line of the place reached, from 1.
  std::uint32_t line() const { return line_; }

 private:
  bool at_end() const { return at_ >= text_.size(); }
  bool at_line_end() const;
  void skip_blanks();
  void end_line();
  std::size_t line_end(std::size_t from) const;
  TextPlace place(std::size_t at) const;
  bool begins_with(std::size_t at, std::string_view upper_case) const;

  void scan_comment();
  bool scan_vendor_comment();
  void scan_major();
  void join_tool_path();
  void scan_text(std::size_t begin);
  void scan_items();
  void scan_token();
  bool scan_dollar();
  void push(Item::Kind kind);
  void skip_statement();
  void fail_at_sign(std::size_t at);
  void fail(const char* code, std::string text, std::size_t at);

  std::string_view text_;
  DiagnosticLog* log_;
  Statement statement_;
  std::string word_;
  std::size_t at_ = 0;
  std::size_t line_begin_ = 0;
  std::size_t begin_ = 0;  ///< of the statement
  std::size_t end_ = 0;    ///< of the statement
  std::uint32_t line_ = 1;
  bool value_before_ = false;  ///< a separator is due before the next value
  bool comma_before_ = false;  ///< a value is due
};

/// `text` in backticks for a message: cut to 40 bytes, control characters replaced.
std::string quoted(std::string_view text);

}  // namespace smoothpost::cl
