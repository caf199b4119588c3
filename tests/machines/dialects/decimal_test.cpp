#include "machines/dialects/decimal.h"

#include <catch2/catch.hpp>
#include <charconv>
#include <cmath>
#include <random>

#include "kernels/core/contract.h"

using namespace smoothpost;

namespace {
std::string text(double value, int decimals) {
  std::string out;
  append_decimal(out, value, decimals);
  return out;
}
}  // namespace

TEST_CASE("append_decimal: fixed notation, no trailing zeros, never -0", "[machines][dialects]") {
  CHECK(text(0.0, 4) == "0");
  CHECK(text(-0.00004, 4) == "0");
  CHECK(text(-0.00005, 4) == "-0.0001");
  CHECK(text(1.5, 4) == "1.5");
  CHECK(text(-1.05, 4) == "-1.05");
  CHECK(text(1000000.0, 0) == "1000000");
  CHECK(text(0.000001, 6) == "0.000001");
  CHECK(text(99999.99999, 5) == "99999.99999");
  CHECK_THROWS_AS(text(1e16, 2), ContractViolation);
  CHECK_THROWS_AS(text(NAN, 2), ContractViolation);
  CHECK_THROWS_AS(text(1.0, 10), ContractViolation);
}

TEST_CASE(
    "append_decimal: within half a digit of the value, and rounded_decimal is what is printed",
    "[machines][dialects]") {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> exponent(-9.0, 5.0), sign(-1.0, 1.0);
  std::uniform_int_distribution<int> digits(0, 9);
  for (int i = 0; i < 50000; ++i) {
    const double value = std::copysign(std::pow(10.0, exponent(rng)), sign(rng));
    const int decimals = digits(rng);
    const std::string printed = text(value, decimals);
    double back = 0.0;
    const auto [end, error] =
        std::from_chars(printed.data(), printed.data() + printed.size(), back);
    REQUIRE(error == std::errc());
    REQUIRE(end == printed.data() + printed.size());
    REQUIRE(std::abs(back - value) <= 0.5 * std::pow(10.0, -decimals) * (1 + 1e-9) + 1e-10);
    REQUIRE(back == Approx(rounded_decimal(value, decimals)).epsilon(1e-15).margin(0));
    REQUIRE(printed.find('e') == std::string::npos);
    REQUIRE(printed != "-0");
  }
}
