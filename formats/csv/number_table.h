#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/result.h"

namespace smoothpost {

/// A table of numbers with a name for each column, as written.
struct NumberTable {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;  ///< one number per column
  std::vector<int> lines;                 ///< of the rows in the file

  /// Index of a column, or −1.
  int column(std::string_view name) const;
};

/// Reads comma-separated numbers below a header line; `#` starts a comment, blank lines are left
/// out, LF and CRLF. CSV101 no header, CSV103 a column twice, CSV105 fields too many or too few,
/// CSV106 no number, CSV107 beyond 1,000,000, CSV114 no row; CSV116 after 100 errors.
/// Cost: linear.   @param largest_rows  more rows are an error CSV105
Result<NumberTable> read_number_table(std::string_view text, const std::string& file_name,
                                      std::size_t largest_rows = 100000);

}  // namespace smoothpost
