#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace smoothpost {

/// One statement about the output, with the place where it is tightest. `value` and `limit` are in
/// `unit` (a unit for people: mm, deg, s); `planned`: true of our plan, not promised of the
/// controller.
struct Check {
  std::string name;
  double value = 0.0;
  double limit = 0.0;
  std::string unit;
  bool ok = true;
  bool planned = false;
  std::uint32_t input_line = 0;
  std::uint32_t output_line = 0;
  double time_s = 0.0;
  std::string note;  ///< what it means or what to do, when the numbers do not say it
};

using Checks = std::vector<Check>;

}  // namespace smoothpost
