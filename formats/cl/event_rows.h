#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/core/process.h"

namespace smoothpost::cl {

/// Rows of a process table that are CL statements, such as `AUXFUN/{n}` or `INSERT/GAS ON`.
///
/// A statement is that of a row when they are equal without blanks and without regard to case; a
/// value in braces takes what stands there up to the next comma, `{text}` everything up to the end.
/// Rows of NC words never fit: no statement begins as they do. Of several rows the first one of the
/// table counts. Cost: linear in the rows of one major word.
class EventRows {
 public:
  explicit EventRows(const ProcessTable& table);

  struct Match {
    const EventWords* row = nullptr;
    std::vector<std::pair<std::string, std::string>> values;
  };

  /// Whether a row begins with this major word (any case).
  bool knows(std::string_view major) const;

  /// The row of a statement written in one line; `row` is nullptr when there is none.
  Match find(std::string_view statement) const;

 private:
  const ProcessTable& table_;
  std::vector<std::string> majors_;  ///< by row, upper case, without blanks
};

}  // namespace smoothpost::cl
