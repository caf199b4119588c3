#pragma once

#include <string>

namespace smoothpost {

/// Appends `value` in fixed notation with at most `decimals` decimals: rounded half away from zero,
/// trailing zeros and a trailing point dropped, never "-0", never an exponent, no locale.
/// @pre |value| · 10^decimals < 9e15, 0 ≤ decimals ≤ 9   @throws ContractViolation
void append_decimal(std::string& out, double value, int decimals);

/// The value that append_decimal prints.
double rounded_decimal(double value, int decimals);

}  // namespace smoothpost
