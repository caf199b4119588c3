#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/core/diagnostic.h"

// KUKA Robot Language, the statement subset that we write and read back: one statement a line.
//   file = {"&" text} "DEF" id "(" ")" {statement} "END"
//   statement = declaration | assignment | call | motion | trigger | wait | "HALT" | interrupt
//             | spline
//   motion = ("PTP" | "LIN") aggregate ["C_PTP" | "C_DIS" | "C_VEL" | "C_ORI"]
//   spline = "SPLINE" [with] {{trigger} "SPL" aggregate [with]} "ENDSPLINE", triggers by PATH
//   with = "WITH" "$VEL.CP" "=" number
//   trigger = "TRIGGER" "WHEN" ("DISTANCE" "=" ("0" | "1") | "PATH" "=" number ["ONSTART"])
//             "DELAY" "=" number "DO" statement
//   wait = "WAIT" "SEC" number
namespace smoothpost::krl {

/// {A1 10,A2 -90}: keys in upper case with their numbers, in the order of the text.
struct Aggregate {
  std::vector<std::pair<std::string, double>> values;

  std::optional<double> find(std::string_view key) const;
};

struct Statement {
  enum class Kind : std::uint8_t {
    declaration,  ///< DECL REAL name
    assignment,   ///< target = value
    call,         ///< name(...)
    motion,
    spline_begin,
    spline_end,
    trigger,  ///< `body` is what it does
    wait_seconds,
    halt,
    interrupt  ///< INTERRUPT ON n, [GLOBAL] INTERRUPT DECL ...
  } kind = Kind::assignment;
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  std::string text;  ///< as written, without comment and outer blanks
  std::string
      name;  ///< assignment: target; call, declaration: name; motion: PTP, LIN, SPL. Upper case
  std::string value;  ///< assignment: right side; call: what stands in the parentheses. As written
  Aggregate aggregate;           ///< motion, or an assignment of one
  std::optional<double> number;  ///< wait; trigger: delay; an assignment of one number
  int distance = 0;              ///< trigger: 0 start point, 1 end point of the next motion
  bool by_path = false;          ///< trigger: PATH instead of DISTANCE
  double path = 0.0;             ///< trigger by PATH: mm from that point, negative before it
  std::optional<double> speed;   ///< SPLINE, SPL: the number of WITH $VEL.CP=
  std::string blend;             ///< motion: C_DIS ... or empty
  std::string body;              ///< trigger: the statement behind DO
};

struct KrlProgram {
  std::string name;
  std::vector<Statement> statements;
  std::uint32_t line_count = 0;
  std::uint32_t end_line = 0;  ///< of END
};

struct ParsedKrl {
  KrlProgram program;
  Diagnostics diagnostics;
};

/// Reads a .src file. Faults are NC320 (structure), NC321 (statement), NC322 (aggregate) with line
/// and column; all of them are collected. Nothing outside the subset is accepted: no nested calls
/// in aggregates, no keys of two families in one aggregate, no key twice, no exponent in a number.
///
/// Guarantees (tests): values as written; refuses malformed programs; every prefix and mutation
/// ends in values or diagnostics.   Cost: linear in the text.
ParsedKrl parse(std::string_view text, const std::string& file_name);

}  // namespace smoothpost::krl
