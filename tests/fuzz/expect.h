#pragma once

#include <cmath>

namespace smoothpost::fuzz {

/// Stops the fuzzer with the input at hand unless `holds`.
inline void expect(bool holds) {
  if (!holds) __builtin_trap();
}

}  // namespace smoothpost::fuzz
