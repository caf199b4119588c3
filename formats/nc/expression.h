#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace smoothpost::nc {

/// Whose expressions are read.
enum class ExpressionRules : std::uint8_t { linuxcnc, fanuc };

/// The value of a parameter, or why it has none. A variable of the Fanuc family that was never
/// assigned is vacant: its value is a NaN.
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
///
/// Under the rules of the Fanuc family there are no names, `**` and EXISTS; AND binds like `*`, OR
/// and XOR like `+`, and all three take 0 and 1 only; EQ and NE are exact; FIX and FUP go towards 0
/// and away from it; `#0` and variables without a value are vacant: 0 in a computation, equal only
/// to each other under EQ and NE.
/// @param values  nullptr: only the text is checked, the value has no meaning
Evaluated evaluate_value(std::string_view text, const ParameterValues* values,
                         ExpressionRules rules = ExpressionRules::linuxcnc);

/// Reads an assignment at the start of `text`, which begins with #.
EvaluatedAssignment evaluate_assignment(std::string_view text, const ParameterValues* values,
                                        ExpressionRules rules = ExpressionRules::linuxcnc);

/// Whether a value other than a plain number begins `text`: [, #, a function, or one behind signs.
bool begins_expression(std::string_view text);

}  // namespace smoothpost::nc
