#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nc/expression.h"

namespace smoothpost::nc {

/// What a line of program flow does: the O words of RS274NGC (IF and WHILE of siemens too), then
/// the macro statements of the Fanuc family, then the jumps, loops and calls of siemens.
enum class FlowKind : std::uint8_t {
  sub,
  endsub,
  call,
  give_back,  ///< return
  loop_while,
  endwhile,
  loop_do,
  repeat,
  endrepeat,
  branch_if,
  elseif,
  otherwise,  ///< else
  endif,
  leave,  ///< break
  next,   ///< continue
  macro_goto,
  macro_if_goto,
  macro_if_then,
  macro_while,
  macro_do,
  macro_end,
  label_goto,  ///< siemens GOTO, GOTOF, GOTOB
  label_if_goto,
  label_case,   ///< CASE (v) OF 1 GOTOF A 2 GOTOF B DEFAULT GOTOF C
  counted_for,  ///< FOR R1=1 TO 5
  endfor,
  endless_loop,  ///< LOOP
  endloop,
  repeat_until,  ///< REPEAT, at whose end UNTIL stands
  until,
  repeat_part,  ///< REPEAT label, REPEATB label: a part of the program once more
  program_call  ///< L100, NAME(args), CALL "NAME"
};

/// A jump of CASE. Offsets count in the text of its line.
struct CaseJump {
  std::size_t value = static_cast<std::size_t>(-1);  ///< where its constant begins; DEFAULT: none
  std::string label;
  int direction = 0;  ///< 1 GOTOF, -1 GOTOB
};

/// A line of program flow, taken apart. Offsets count in the text that was read.
struct FlowText {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  FlowKind kind = FlowKind::call;
  std::string label;                   ///< lower case, no blanks; "100" of o100; loop number of DO
  std::size_t computed_label = kNone;  ///< o#1, o[#1+2]: where its value begins
  std::vector<std::size_t> values;     ///< where the condition, count, arguments begin
  std::size_t target = kNone;          ///< where the number behind GOTO begins; siemens: the value
                                       ///< behind TO of FOR, the count behind P
  std::size_t consequence = kNone;     ///< where the assignment behind THEN or FOR begins
  int direction = 0;                   ///< siemens: 1 GOTOF, -1 GOTOB
  std::string name;             ///< siemens: counter of FOR, program of a call, end label of REPEAT
  bool one_block = false;       ///< siemens REPEATB
  std::vector<CaseJump> cases;  ///< siemens CASE, in their order
  std::size_t length = 0;       ///< bytes of the whole statement
  std::string problem;          ///< empty: it can be read
  std::size_t at = 0;           ///< offset of the fault
  bool ok() const { return problem.empty(); }
};

/// Arguments of one call of RS274NGC.
inline constexpr std::size_t kMostArguments = 30;

/// Reads an O-word line of RS274NGC, from its O to its end without comments:
/// `o<name|n|#p|[e]> keyword [value]...`. Blanks anywhere, any case. Cost: linear.
FlowText read_o_line(std::string_view text);

/// Whether `text` begins with a macro statement of the Fanuc family: IF, WHILE, GOTO, DO, END.
bool begins_macro(std::string_view text);

/// Reads one: `IF [..] GOTO n`, `IF [..] THEN #i=v`, `WHILE [..] DO m`, `DO m`, `END m`, `GOTO n`.
FlowText read_macro_line(std::string_view text);

/// The number that a label or a loop stands for, or that is no such number: -1.
long label_number(double value);

}  // namespace smoothpost::nc
