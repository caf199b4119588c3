#pragma once

#include <string_view>
#include <vector>

#include "formats/nc/expression.h"
#include "formats/nc/siemens_variables.h"

namespace smoothpost::nc {

/// Reads the longest expression of the Sinumerik language at the start of `text`: numbers (also
/// 1.5EX-3), variables, elements of arrays A[R1,2], ( ), `* / DIV MOD`, `+ -`, signs, and the
/// functions SIN COS TAN ASIN ACOS ATAN2 SQRT ABS POT TRUNC ROUND LN EXP; degrees. An operand that
/// stands behind a blank without an operator ends it.
/// @param values  nullptr: only the text is checked, the value has no meaning
Evaluated evaluate_siemens(std::string_view text, const SiemensVariables* values);

/// The same for a condition: NOT, AND before XOR before OR, and weakest of all == <> < > <= >=, as
/// the control orders them. True is 1, false 0; any number but 0 is true.
Evaluated evaluate_siemens_condition(std::string_view text, const SiemensVariables* values);

/// The values between the brackets of NAME[i,j], and the place behind them.
struct SiemensIndices {
  std::vector<double> values;
  Evaluated end;  ///< `length` counts from the bracket; the problem, when there is one
};

/// Reads them at the start of `text`, which begins with [.
SiemensIndices siemens_indices(std::string_view text, const SiemensVariables* values);

}  // namespace smoothpost::nc
