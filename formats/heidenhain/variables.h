#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

#include "formats/heidenhain/scanner.h"

namespace smoothpost::conversational {

/// A Q parameter: Q12, QL3, QR3.
struct VariableName {
  char kind = 0;  ///< 0, L or R
  long number = 0;
  std::string text() const;
};

/// A value, or why there is none and where in the block.
struct Value {
  double value = 0.0;
  std::string problem;
  std::size_t offset = 0;
  bool ok() const { return problem.empty(); }
};

/// The Q parameters that the program has set. A parameter that it never set is an error where it is
/// used: the control would take what an earlier program left in it.
class Variables {
 public:
  /// Takes a name from the block; numbers go up to 1999.
  static std::optional<VariableName> take_name(Scanner& scanner);

  void set(const VariableName& name, double value) { values_[key(name)] = value; }
  std::optional<double> find(const VariableName& name) const;

  /// [sign] number or [sign] Q parameter: the value of a word.
  Value factor(Scanner& scanner) const;

  /// Operators from strong to weak: functions and sign; ^; * / DIV; + - LEN ANG; equal ones from
  /// left to right. Functions take what stands behind them: SIN COS TAN ASIN ACOS ATAN (degrees)
  /// SQRT SQ ABS INT FRAC NEG SGN LN LOG EXP; a LEN b = √(a² + b²), a ANG b = the angle of a
  /// opposite b adjacent, 0 to 360. At most 64 brackets deep.
  Value formula(Scanner& scanner) const;

 private:
  static std::uint32_t key(const VariableName& name);
  std::unordered_map<std::uint32_t, double> values_;
};

}  // namespace smoothpost::conversational
