#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace smoothpost::nc {

/// Text that is no word, comment or sign of the language that this version reads.
enum class Construct : std::uint8_t {
  foreign_character,      ///< NC101
  open_comment,           ///< NC102
  nested_comment,         ///< NC103
  letter_alone,           ///< NC104
  bad_number,             ///< NC105
  number_alone,           ///< NC106
  misplaced_percent,      ///< NC107
  misplaced_slash,        ///< NC108
  close_parenthesis,      ///< NC109
  misplaced_line_number,  ///< NC110
  expression,             ///< NC120
  parameter,              ///< NC121
  o_word,                 ///< NC122
  quoted_text,            ///< NC123
  assignment,             ///< NC124
  name,                   ///< NC125
  polar,                  ///< NC126
  spindle_choice,         ///< NC127
  tcp_mode                ///< NC128
};

/// What a piece of foreign text is and how many bytes of the line it takes.
struct ConstructSpan {
  Construct kind = Construct::foreign_character;
  std::uint32_t length = 1;
};

/// The stable code of a construct.
const char* code_of(Construct kind);

/// What it is, as written, and what to do, for an engineer.
std::string describe(Construct kind, std::string_view text);

/// The construct at the start of `rest`, the remainder of a line (no line end in it, not empty)
/// whose first character starts neither a blank, a good word, nor a good comment. Cost: linear in
/// the length it returns, which is at least 1.
ConstructSpan measure_construct(std::string_view rest);

/// The span of an O-word line, from its letter to the comment or the end of the line.
std::uint32_t length_to_comment(std::string_view rest);

}  // namespace smoothpost::nc
