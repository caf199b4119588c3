#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include "formats/nc/expression.h"

namespace smoothpost::nc {

/// R parameters and declared variables of one run of a Sinumerik program, by upper-case name.
/// An R parameter that was never assigned is 0; another variable must have been declared.
class SiemensVariables {
 public:
  std::optional<double> value(const std::string& name) const;
  void assign(const std::string& name, double value) { values_[name] = value; }

 private:
  std::unordered_map<std::string, double> values_;
};

/// Reads the longest expression of the Sinumerik language at the start of `text`: numbers (also
/// 1.5EX-3), variables, ( ), `* / DIV MOD`, `+ -`, signs, and the functions SIN COS TAN ASIN ACOS
/// ATAN2 SQRT ABS POT TRUNC ROUND LN EXP; degrees. An operand that stands behind a blank without an
/// operator ends it.
/// @param values  nullptr: only the text is checked, the value has no meaning
Evaluated evaluate_siemens(std::string_view text, const SiemensVariables* values);

/// The same for a condition: NOT, AND before XOR before OR, and weakest of all == <> < > <= >=, as
/// the control orders them. True is 1, false 0; any number but 0 is true.
Evaluated evaluate_siemens_condition(std::string_view text, const SiemensVariables* values);

}  // namespace smoothpost::nc
