#pragma once

#include <string>
#include <string_view>

#include "formats/nc/expression.h"

namespace smoothpost::nc {

/// The text of a (PRINT,..), (DEBUG,..) or (LOG,..) comment as LinuxCNC shows it: `#n`, `##n` and
/// `#<name>` become their values with six decimals, or with as many as the last %d (0), %f (6) or
/// %.nf before them says; a parameter without a value becomes ######. Other text stays.
std::string with_values(std::string_view text, const ParameterValues& values);

}  // namespace smoothpost::nc
