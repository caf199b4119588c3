#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace smoothpost::nc {

/// The value of a parameter, or why it has none.
struct ParameterValue {
  double value = 0.0;
  std::string problem;
};

/// What `#` in an expression refers to.
class ParameterValues {
 public:
  virtual ~ParameterValues() = default;
  virtual ParameterValue numbered(int index) const = 0;
  /// `name` is in lower case, without blanks.
  virtual ParameterValue named(std::string_view name) const = 0;
};

/// A value read from text, or the first fault.
struct Evaluated {
  double value = 0.0;
  std::size_t length = 0;  ///< bytes that the value takes, when there is no problem
  std::string problem;     ///< empty: the value is good
  std::size_t at = 0;      ///< offset of the fault
  bool ok() const { return problem.empty(); }
};

/// `#index=value` or `#<name>=value`.
struct EvaluatedAssignment {
  int index = 0;     ///< 0: a named parameter
  std::string name;  ///< in lower case, without blanks
  Evaluated value;   ///< length counts from the #
};

/// Reads a value of RS274NGC at the start of `text` as LinuxCNC 2.9 does: number, `[expression]`,
/// `#n`, `#<name>`, function, sign before any of them; blanks anywhere, any case, degrees.
///
/// Operators from strong to weak: `**`; `*` `/` `MOD`; `+` `-`; `EQ NE GT GE LT LE`; `AND OR XOR`;
/// equal ones from left to right. EQ and NE take values within 1e-4 as equal, as the installed
/// interpreter does. MOD is never negative. Guarantees: test "expression: against rs274".
/// @param values  nullptr: only the text is checked, the value has no meaning
Evaluated evaluate_value(std::string_view text, const ParameterValues* values);

/// Reads an assignment at the start of `text`, which begins with #.
EvaluatedAssignment evaluate_assignment(std::string_view text, const ParameterValues* values);

/// Whether a value other than a plain number begins `text`: [, #, a function, or one behind signs.
bool begins_expression(std::string_view text);

}  // namespace smoothpost::nc
