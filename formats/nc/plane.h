#pragma once

#include <cstddef>

#include "formats/nc/codes.h"

namespace smoothpost::nc {

/// Axes of a plane as places in AxisWords: first, second, and the one along its normal, with the
/// letters of its arc centres.
struct PlaneAxes {
  std::size_t first;
  std::size_t second;
  std::size_t third;
  char first_centre;
  char second_centre;
  char wrong_centre;
  const char* name;
};

/// Of G17, G18 or G19.
inline PlaneAxes plane_axes(GCode plane) {
  if (plane == 180) return {2, 0, 1, 'K', 'I', 'J', "G18 (ZX)"};
  if (plane == 190) return {1, 2, 0, 'J', 'K', 'I', "G19 (YZ)"};
  return {0, 1, 2, 'I', 'J', 'K', "G17 (XY)"};
}

}  // namespace smoothpost::nc
