#include "formats/nc/number.h"

#include <charconv>
#include <string>

namespace smoothpost::nc {

ScannedNumber scan_long_number(const char* begin, const char* end) {
  std::string compact;
  const char* next = begin;
  bool point = false;
  bool digit = false;
  for (const char* p = begin; p != end; ++p) {
    if (detail::is_blank(*p)) continue;
    const bool sign = compact.empty() && p == begin && (*p == '-' || *p == '+');
    if (detail::is_digit(*p)) {
      digit = true;
    } else if (*p == '.' && !point) {
      point = true;
    } else if (!sign) {
      break;
    }
    if (*p != '+') compact.push_back(*p);
    next = p + 1;
  }
  if (!digit) return {0.0, begin, false};
  double value = 0.0;
  const auto result = std::from_chars(compact.data(), compact.data() + compact.size(), value,
                                      std::chars_format::fixed);
  // More than 308 digits before the point: no machine position, and not a double.
  if (result.ec != std::errc{}) return {0.0, begin, false};
  return {value == 0.0 ? 0.0 : value, next, true};
}

}  // namespace smoothpost::nc
