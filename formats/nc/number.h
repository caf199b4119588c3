#pragma once

#include <cstdint>

namespace smoothpost::nc {

/// A number of NC text: optional sign, digits, at most one point, no exponent; blanks may stand
/// anywhere.
struct ScannedNumber {
  double value = 0.0;
  const char* next =
      nullptr;      ///< behind the last character of the number; the start when there is none
  bool ok = false;  ///< at least one digit was found
};

/// The same as scan_number() for any length and with blanks inside; correctly rounded.
ScannedNumber scan_long_number(const char* begin, const char* end);

namespace detail {
inline constexpr double kPowersOfTen[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                          1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                          1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
inline bool is_digit(char c) { return static_cast<unsigned char>(c - '0') <= 9; }
inline bool is_blank(char c) { return c == ' ' || c == '\t'; }
}  // namespace detail

/// Reads the longest number that starts at `begin` (a sign, digit or point).
///
/// Guarantees: the value is the double nearest to the decimal text (test "number: nearest double");
/// a zero is never negative. Cost: one pass, no allocation up to 18 digits without blanks inside:
/// value = m / 10^d with integers m < 2^53 and d <= 22, both exact, so that one division rounds
/// once.
inline ScannedNumber scan_number(const char* begin, const char* end) {
  using detail::is_digit;
  const char* p = begin;
  bool negative = false;
  if (p != end && (*p == '-' || *p == '+')) {
    negative = *p == '-';
    ++p;
  }
  const char* const digits_begin = p;
  std::uint64_t mantissa = 0;
  while (p != end && is_digit(*p))
    mantissa = mantissa * 10 + static_cast<unsigned char>(*p++ - '0');
  long digits = p - digits_begin;
  long decimals = 0;
  bool point = false;
  if (p != end && *p == '.') {
    point = true;
    const char* const decimals_begin = ++p;
    while (p != end && is_digit(*p)) {
      mantissa = mantissa * 10 + static_cast<unsigned char>(*p++ - '0');
    }
    decimals = p - decimals_begin;
    digits += decimals;
  }
  if (p != end && detail::is_blank(*p)) {
    const char* q = p + 1;
    while (q != end && detail::is_blank(*q)) ++q;
    if (q != end && (is_digit(*q) || (*q == '.' && !point))) return scan_long_number(begin, end);
  }
  if (digits == 0) return {0.0, begin, false};
  if (digits > 18 || mantissa > (std::uint64_t{1} << 53)) return scan_long_number(begin, end);
  const double magnitude = static_cast<double>(mantissa) / detail::kPowersOfTen[decimals];
  return {negative && mantissa != 0 ? -magnitude : magnitude, p, true};
}

}  // namespace smoothpost::nc
