#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace smoothpost::nc {

/// The shortest decimal text that reads back as `value`, without exponent: 630 is "630", 0.1 is
/// "0.1".
std::string shortest_text(double value);

/// `value` with at most `decimals` decimals, trailing zeros dropped, never "-0": for messages.
std::string decimal_text(double value, int decimals);

/// The parts, one behind the other: for messages.
std::string joined(std::initializer_list<std::string_view> parts);

}  // namespace smoothpost::nc
