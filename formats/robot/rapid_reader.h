#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/diagnostic.h"

// ABB RAPID, the statement subset that we write and read back. Words and names in any case.
//   file = "MODULE" name {declaration} procedure {procedure} "ENDMODULE"
//   declaration = ("CONST" | "PERS" | "VAR") type name [":=" value] ";"
//   procedure = "PROC" name "(" ")" {[name ":"] statement ";"} "ENDPROC"
//   statement = "MoveAbsJ" target [\NoEOffs] "," speed [\T] "," zone "," tool [\WObj]
//             | "MoveL" target "," speed [\T] "," zone "," tool [\WObj]
//             | "TriggL" target "," speed [\T] "," trigger [\T2 ... \T8] "," zone "," tool [\WObj]
//             | "TriggIO" trigger "," distance [\Start | \Time] signal "," value
//             | "TriggEquip" trigger "," distance [\Start] "," lag signal "," value
//             | "ConfL" (\On | \Off) | "ConfJ" (\On | \Off) | "SingArea" (\Wrist | \Off)
//             | "WaitTime" [\InPos ","] seconds | "Stop" | name [value {"," value}]
//   signal = (\DOp | \GOp | \AOp) ":=" name
namespace smoothpost::rapid {

/// A literal or a name.
struct Value {
  enum class Kind : std::uint8_t { number, boolean, text, name, aggregate } kind = Kind::number;
  double number = 0.0;  ///< boolean: 1 or 0
  std::string text;     ///< text: without quotes; name: in upper case
  std::vector<Value> items;
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

/// One argument of a statement, in the order of the text.
struct Argument {
  std::string option;  ///< \Option in upper case; empty: an argument without name
  std::optional<Value> value;
};

struct Statement {
  enum class Kind : std::uint8_t {
    move,      ///< MoveL, MoveAbsJ, TriggL
    trigger,   ///< TriggIO, TriggEquip
    mode,      ///< ConfL, ConfJ, SingArea
    wait,      ///< WaitTime
    stop,      ///< Stop
    procedure  ///< every other instruction or procedure, such as SetDO
  } kind = Kind::procedure;
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  std::string text;   ///< as written, without comments and ; and line ends
  std::string name;   ///< of the instruction or procedure, in upper case
  std::string label;  ///< in front of it, in upper case; empty: none
  std::vector<Argument> arguments;

  bool has(std::string_view option) const;
  const Value* find(std::string_view option) const;
  /// The n-th argument without name, from 0; nullptr when there are fewer.
  const Value* positional(std::size_t n) const;
};

struct Declaration {
  std::string storage;  ///< CONST, PERS or VAR
  std::string type;     ///< in upper case
  std::string name;     ///< in upper case
  std::optional<Value> value;
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

struct Procedure {
  std::string name;  ///< in upper case
  std::vector<Statement> statements;
  std::uint32_t line = 0;
};

struct RapidProgram {
  std::string name;
  std::vector<Declaration> declarations;
  std::vector<Procedure> procedures;
  std::uint32_t line_count = 0;
  std::uint32_t end_line = 0;  ///< of ENDMODULE
};

struct ParsedRapid {
  RapidProgram program;
  Diagnostics diagnostics;
};

/// Reads a module. Faults are NC330 (structure, names), NC331 (statement), NC332 (value of a data
/// type: shape, quaternion that is not of length 1 within 1e-4) with line and column; collected, at
/// most 100. Names have a letter first, then letters, digits and _, at most 32 characters; a text
/// has at most 80. Nothing outside the subset is accepted: no expressions, no assignments, no
/// loops, no GOTO, no other motion.
///
/// Guarantees (tests): values as written; refuses malformed programs; every prefix and mutation
/// ends in values or diagnostics.   Cost: linear in the text, but for its names (n log n).
ParsedRapid parse(std::string_view text, const std::string& file_name);

}  // namespace smoothpost::rapid
