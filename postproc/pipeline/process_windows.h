#pragma once

#include <cstdint>
#include <vector>

namespace smoothpost {

/// A stretch of a path as places, with what the process does at each.
struct ProcessAlong {
  const std::vector<double>& way;             ///< mm from the start, not falling
  const std::vector<std::uint32_t>& process;  ///< as a number, of each place
  std::uint32_t before = 0;                   ///< of the path before the stretch
  std::uint32_t behind = 0;
  /// Of each number: what each of its parts does. Empty: a number is one part.
  const std::vector<std::vector<std::uint32_t>>& parts;
};

/// What the process may be at places near its changes.
struct ProcessWindows {
  std::vector<std::int32_t> of;  ///< of each place: index into windows; −1: only its own
  std::vector<std::vector<bool>> windows;  ///< by process number
};

/// Around every change, and around both ends of the stretch, within `tolerance` mm of the way each
/// part of the process may be as on either side: two events of one place that come one after the
/// other may stand apart, but a third state may not.
/// @pre way and process of equal size, not empty.   Cost: linear in the places, for few numbers.
ProcessWindows process_windows(const ProcessAlong& along, double tolerance);

}  // namespace smoothpost
