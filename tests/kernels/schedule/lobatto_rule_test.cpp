#include "kernels/schedule/lobatto_rule.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "kernels/core/contract.h"

namespace smoothpost {

TEST_CASE("lobatto_rule: exact to degree 2 m - 3 and no further", "[kernels][schedule]") {
  for (int points : {3, 4, 5, 7, 13, 32}) {
    const LobattoRule rule = lobatto_rule(points);
    CHECK(rule.nodes.front() == 0.0);
    CHECK(rule.nodes.back() == 1.0);
    for (int degree = 0; degree <= 2 * points - 2; ++degree) {
      double sum = 0.0;
      for (int i = 0; i < points; ++i)
        sum += rule.weights[i] * std::pow(2.0 * rule.nodes[i] - 1.0, degree);
      const double exact = degree % 2 == 0 ? 1.0 / (degree + 1.0) : 0.0;
      if (degree <= 2 * points - 3) CHECK(std::abs(sum - exact) < 1e-14);
      if (degree == 2 * points - 2 && points < 14) CHECK(std::abs(sum - exact) > 1e-12);
    }
  }
}

TEST_CASE("lobatto_rule: five points in closed form", "[kernels][schedule]") {
  const LobattoRule rule = lobatto_rule(5);
  const double x = 0.5 * std::sqrt(3.0 / 7.0);
  const double nodes[] = {0.0, 0.5 - x, 0.5, 0.5 + x, 1.0};
  const double weights[] = {1.0 / 20, 49.0 / 180, 64.0 / 180, 49.0 / 180, 1.0 / 20};
  for (int i = 0; i < 5; ++i) {
    CHECK(std::abs(rule.nodes[i] - nodes[i]) < 1e-15);
    CHECK(std::abs(rule.weights[i] - weights[i]) < 1e-15);
  }
}

TEST_CASE("lobatto_rule: interpolation of polynomials", "[kernels][schedule]") {
  const LobattoRule rule = lobatto_rule(5);
  const std::vector<double> places = {0.0, 0.1, 0.3, 0.5, 0.77, 1.0};
  const std::vector<double> weights = interpolation_weights(rule.nodes, places);
  for (int degree = 0; degree <= 4; ++degree)
    for (std::size_t i = 0; i < places.size(); ++i) {
      double sum = 0.0;
      for (std::size_t j = 0; j < 5; ++j)
        sum += weights[5 * i + j] * std::pow(rule.nodes[j], degree);
      CHECK(std::abs(sum - std::pow(places[i], degree)) < 1e-14);
    }
}

TEST_CASE("lobatto_rule: preconditions", "[kernels][schedule]") {
  CHECK_THROWS_AS(lobatto_rule(2), ContractViolation);
  CHECK_THROWS_AS(lobatto_rule(33), ContractViolation);
}

}  // namespace smoothpost
