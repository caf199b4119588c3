#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "formats/nc/expression.h"

namespace smoothpost::nc {

enum class SiemensType : std::uint8_t { real, integer, boolean, text };

/// A variable of DEF or of PROC. `cells` are those of an array, row by row, or one.
struct SiemensVariable {
  SiemensType type = SiemensType::real;
  std::vector<std::size_t> extents;  ///< of an array, at most 3; none: a scalar
  std::vector<double> cells{0.0};
  std::string text;     ///< of a STRING
  bool certain = true;  ///< false: behind ENDFOR, where the counter's value is not stated
};

/// R parameters and declared variables of one run of a Sinumerik program, by upper-case name. R
/// parameters are those of the whole run, 0 before they are assigned; another variable must have
/// been declared in the program or subprogram that uses it.
class SiemensVariables {
 public:
  /// The value of NAME or NAME[i,j]; R[5] is R5.
  ParameterValue value(const std::string& name, const std::vector<double>& indices) const;
  /// The text of a STRING variable; nothing: there is none of that name.
  std::optional<std::string> text(const std::string& name) const;
  /// Rounds to a whole number for INT, to 0 or 1 for BOOL. Gives why it cannot be done, or nothing.
  std::string assign(const std::string& name, const std::vector<double>& indices, double value);
  /// The values from `indices` on, row by row; SET(..).
  std::string assign_row(const std::string& name, const std::vector<double>& indices,
                         const std::vector<double>& values);
  /// REP(value): all cells from `indices` on.
  std::string fill(const std::string& name, const std::vector<double>& indices, double value);
  std::string assign_text(const std::string& name, std::string text);
  /// Gives why it cannot be done: more than 1 000 000 cells in all, or nothing.
  std::string declare(const std::string& name, SiemensVariable variable);
  /// The value is not certain until it is assigned again.
  void forget(const std::string& name);

  /// A call: declared variables are those of the subprogram until leave().
  void enter() { levels_.emplace_back(); }
  void leave();

 private:
  using Level = std::unordered_map<std::string, SiemensVariable>;

  SiemensVariable* find(const std::string& name);
  const SiemensVariable* find(const std::string& name) const;

  Level parameters_;  ///< R
  std::vector<Level> levels_{1};
  std::size_t cells_ = 0;  ///< of all declared variables
};

}  // namespace smoothpost::nc
