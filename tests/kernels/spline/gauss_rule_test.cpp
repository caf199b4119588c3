#include "kernels/spline/gauss_rule.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

double rule_of_power(const GaussRule& rule, int power) {
  double sum = 0.0;
  for (std::size_t g = 0; g < static_cast<std::size_t>(rule.points); ++g)
    sum += rule.weights[g] * std::pow(rule.nodes[g], power);
  return sum;
}

TEST_CASE("gauss_rule: exact to degree 2 n - 1 and not beyond", "[spline]") {
  for (int points = 1; points <= kMaxGaussPoints; ++points) {
    const GaussRule& rule = gauss_rule(points);
    REQUIRE(rule.points == points);
    for (int power = 0; power < 2 * points; ++power)
      CHECK(std::abs(rule_of_power(rule, power) - 1.0 / (power + 1)) < 1e-15);
    if (points <= 8)
      CHECK(std::abs(rule_of_power(rule, 2 * points) - 1.0 / (2 * points + 1)) > 1e-11);
  }
}

TEST_CASE("gauss_rule: nodes ascend inside and are symmetric", "[spline]") {
  for (int points = 1; points <= kMaxGaussPoints; ++points) {
    const GaussRule& rule = gauss_rule(points);
    double before = 0.0;
    for (std::size_t g = 0; g < static_cast<std::size_t>(points); ++g) {
      CHECK(rule.nodes[g] > before);
      before = rule.nodes[g];
      CHECK(rule.weights[g] > 0.0);
      CHECK(rule.nodes[g] + rule.nodes[static_cast<std::size_t>(points) - 1 - g] == Approx(1.0));
    }
    CHECK(before < 1.0);
  }
  CHECK(gauss_rule(2).nodes[0] == Approx(0.5 - 0.5 / std::sqrt(3.0)).epsilon(1e-15));
}

TEST_CASE("gauss_rule: preconditions", "[spline]") {
  CHECK_THROWS_AS(gauss_rule(0), ContractViolation);
  CHECK_THROWS_AS(gauss_rule(kMaxGaussPoints + 1), ContractViolation);
}

}  // namespace
}  // namespace smoothpost
