#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/nc/siemens_expression.h"

namespace smoothpost::nc {

/// Does the assignment at the start of `text`: `NAME=value`, `NAME[i]=value`, `NAME[i]=SET(a,b)`,
/// `NAME[i]=REP(value)`, `NAME="text"`.
/// @param variables  nullptr: only the text is checked
/// Cost: linear in the text and in the cells that REP fills.
Evaluated assign_siemens(std::string_view text, SiemensVariables* variables);

/// Does `DEF REAL a, b=2, c[5]` (REAL, INT, BOOL, STRING[n]; up to three indices) from its DEF on.
/// Later variables may use earlier ones. At most 10 000 cells an array.
/// @param variables  nullptr: only the text is checked
/// @param names      when given, the upper-case names are added
Evaluated declare_siemens(std::string_view text, SiemensVariables* variables,
                          std::vector<std::string>* names);

/// The head of a subprogram: PROC NAME(REAL A, INT B=2) DISPLOF.
struct SiemensProcedure {
  std::string name;
  std::vector<std::pair<std::string, SiemensVariable>> parameters;  ///< with their defaults
  std::string problem;                                              ///< why it cannot be read
};

/// Reads it from its PROC to the end of `text`. VAR (a parameter that gives back), SAVE, texts and
/// arrays as parameters are a problem. Cost: linear.
SiemensProcedure read_siemens_procedure(std::string_view text);

/// The text of "abc"<<R1<<NAME: quoted texts, STRING variables and values, as of MSG( ).
/// Nothing: it has another form, or a value has no meaning.
std::optional<std::string> siemens_text(std::string_view text, const SiemensVariables& variables);

}  // namespace smoothpost::nc
