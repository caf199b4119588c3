#include "machines/dialects/decimal.h"

#include <array>
#include <cmath>
#include <cstdint>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr std::array<double, 10> kPowers = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};

std::int64_t scaled(double value, int decimals) {
  require(decimals >= 0 && decimals <= 9, "0 to 9 decimals");
  const double product = value * kPowers[static_cast<std::size_t>(decimals)];
  require(std::abs(product) < 9e15, "the number fits its decimals");
  return static_cast<std::int64_t>(std::round(product));
}

}  // namespace

void append_decimal(std::string& out, double value, int decimals) {
  std::int64_t digits = scaled(value, decimals);
  if (digits < 0) {
    out += '-';
    digits = -digits;
  }
  std::array<char, 24> buffer{};
  std::size_t at = buffer.size();
  int fraction = decimals;
  while (fraction > 0 && digits % 10 == 0) {
    digits /= 10;
    --fraction;
  }
  for (int i = 0; i < fraction; ++i) {
    buffer[--at] = static_cast<char>('0' + digits % 10);
    digits /= 10;
  }
  if (fraction > 0) buffer[--at] = '.';
  do {
    buffer[--at] = static_cast<char>('0' + digits % 10);
    digits /= 10;
  } while (digits > 0);
  out.append(buffer.data() + at, buffer.size() - at);
}

double rounded_decimal(double value, int decimals) {
  return static_cast<double>(scaled(value, decimals)) / kPowers[static_cast<std::size_t>(decimals)];
}

}  // namespace smoothpost
