#include "kernels/spline/acr_basis.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "kernels/core/contract.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

/// Eq. (6) and (7) of the paper with Eq. (7) as the rows of a table, lowest power first.
constexpr std::array<std::array<double, 8>, 6> kPrinted = {{
    {0, -1, 0, 0, 20, -45, 36, -10},  // l0
    {0, 0, 0, 0, 15, -39, 34, -10},   // l1
    {0, 0, 1, 0, -10, 20, -15, 4},    // m0
    {0, 0, -2, 0, 25, -54, 43, -12},  // m1
    {0, 0, 1, 0, -20, 48, -41, 12},   // m2
    {1, 0, 0, 0, -35, 84, -70, 20},   // n1
}};

double power_sum(const std::array<double, 8>& c, double t) {
  double sum = 0.0;
  for (int k = 0; k < 8; ++k) sum += c[static_cast<std::size_t>(k)] * std::pow(t, k);
  return sum;
}

Eigen::Vector4d printed_basis(const AcrShape& s, double t) {
  std::array<double, 6> v{};
  for (std::size_t i = 0; i < 6; ++i) v[i] = power_sum(kPrinted[i], t);
  const auto [l0, l1, m0, m1, m2, n1] = v;
  return {s.kappa * l0 + s.lambda * m0, s.kappa * l1 + s.lambda * m1 + n1,
          -s.kappa * l0 + s.lambda * m2 + (1 - n1), -s.kappa * l1 - s.lambda * (m0 + m1 + m2)};
}

struct Sample {
  AcrShape shape;
  double t = 0.0;
};

/// 2000 shapes and parameters, far beyond what corners use.
std::vector<Sample> samples() {
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> shape(-3.0, 3.0);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Sample> all;
  for (int i = 0; i < 2000; ++i) all.push_back({{shape(engine), shape(engine)}, unit(engine)});
  return all;
}

}  // namespace

TEST_CASE("acr_basis: Eq. (6) and (7) of the paper", "[kernels][spline][paper]") {
  double worst = 0.0;
  for (const Sample& s : samples())
    worst = std::max(worst, (acr_basis(s.shape, s.t) - printed_basis(s.shape, s.t)).norm());
  CHECK(worst < 1e-12);
}

TEST_CASE("acr_basis: golden coefficients and values", "[kernels][spline][paper]") {
  const auto path = test::shared_path("reference/paper_a.json");
  if (!path) {
    WARN("no shared reference files: skipped");
    return;
  }
  const auto golden = nlohmann::json::parse(std::ifstream(*path)).at("basis");
  const std::array<const char*, 6> names = {"l0", "l1", "m0", "m1", "m2", "n1"};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto& row = golden.at("monomial_coeffs_t0_to_t7").at(names[i]);
    for (std::size_t k = 0; k < 8; ++k) CHECK(row.at(k).get<double>() == kPrinted[i][k]);
  }
  const Eigen::Vector4d b = acr_basis({0.48, 0.3}, 0.3);
  const auto& expected = golden.at("b_at_t_0_3_kappa_0_48_lambda_0_3");
  for (int i = 0; i < 4; ++i)
    CHECK(b[i] == Approx(expected.at(static_cast<std::size_t>(i)).get<double>()).margin(5e-9));
}

TEST_CASE("acr_basis: interpolation", "[kernels][spline][paper]") {
  for (const Sample& s : samples()) {
    REQUIRE(acr_basis(s.shape, 0.0) == Eigen::Vector4d(0, 1, 0, 0));
    REQUIRE((acr_basis(s.shape, 1.0) - Eigen::Vector4d(0, 0, 1, 0)).norm() < 1e-12);
  }
}

TEST_CASE("acr_basis: partition of unity", "[kernels][spline][paper]") {
  for (const Sample& s : samples()) {
    REQUIRE(std::abs(acr_basis(s.shape, s.t).sum() - 1.0) < 1e-12);
    for (int order = 1; order <= 3; ++order)
      REQUIRE(std::abs(acr_basis(s.shape, s.t, order).sum()) < 1e-9);
  }
}

TEST_CASE("acr_basis: mirror symmetry", "[kernels][spline][paper]") {
  for (const Sample& s : samples()) {
    const Eigen::Vector4d mirrored = acr_basis(s.shape, 1.0 - s.t).reverse();
    REQUIRE((acr_basis(s.shape, s.t) - mirrored).norm() < 1e-12);
  }
}

TEST_CASE("acr_basis: knot derivatives", "[kernels][spline][paper]") {
  for (const Sample& s : samples()) {
    const double k = s.shape.kappa;
    const double l = s.shape.lambda;
    REQUIRE((acr_basis(s.shape, 0.0, 1) - Eigen::Vector4d(-k, 0, k, 0)).norm() < 1e-15);
    REQUIRE((acr_basis(s.shape, 1.0, 1) - Eigen::Vector4d(0, -k, 0, k)).norm() < 1e-12);
    REQUIRE((acr_basis(s.shape, 0.0, 2) - Eigen::Vector4d(2 * l, -4 * l, 2 * l, 0)).norm() < 1e-14);
    REQUIRE((acr_basis(s.shape, 1.0, 2) - Eigen::Vector4d(0, 2 * l, -4 * l, 2 * l)).norm() < 1e-11);
    REQUIRE(acr_basis(s.shape, 0.0, 3).norm() < 1e-15);
    REQUIRE(acr_basis(s.shape, 1.0, 3).norm() < 2e-10);
  }
}

TEST_CASE("acr_basis: straight lines at constant speed when kappa is a half", "[kernels][spline]") {
  const Eigen::Vector4d line(-1.0, 0.0, 1.0, 2.0);
  for (const Sample& s : samples())
    REQUIRE(std::abs(acr_basis({0.5, s.shape.lambda}, s.t).dot(line) - s.t) < 1e-12);
}

TEST_CASE("acr_basis: parabolas when kappa and lambda are a half", "[kernels][spline]") {
  const Eigen::Vector4d parabola(1.0, 0.0, 1.0, 4.0);
  for (const Sample& s : samples())
    REQUIRE(std::abs(acr_basis({0.5, 0.5}, s.t).dot(parabola) - s.t * s.t) < 1e-12);
}

TEST_CASE("acr_basis: kappa and lambda 0 stop the curve at its knots", "[kernels][spline][paper]") {
  for (int order = 1; order <= 3; ++order) {
    CHECK(acr_basis({0.0, 0.0}, 0.0, order).norm() == 0.0);
    CHECK(acr_basis({0.0, 0.0}, 1.0, order).norm() < 1e-11);
  }
}

TEST_CASE("acr_basis: derivatives equal central differences", "[kernels][spline]") {
  constexpr double kStep = 1e-5;
  for (const Sample& s : samples()) {
    const double t = std::clamp(s.t, kStep, 1.0 - kStep);
    for (int order = 1; order <= 3; ++order) {
      const Eigen::Vector4d difference =
          (acr_basis(s.shape, t + kStep, order - 1) - acr_basis(s.shape, t - kStep, order - 1)) /
          (2.0 * kStep);
      REQUIRE((difference - acr_basis(s.shape, t, order)).norm() < 1e-5);
    }
  }
}

TEST_CASE("acr_span: equals acr_basis times the points", "[kernels][spline]") {
  std::mt19937_64 engine(12);
  std::uniform_real_distribution<double> value(-10.0, 10.0);
  double worst = 0.0;
  for (const Sample& s : samples()) {
    const Eigen::Vector4d p(value(engine), value(engine), value(engine), value(engine));
    const SepticValue v = evaluate(acr_span(s.shape, p), s.t);
    const std::array<double, 4> got = {v.value, v.d1, v.d2, v.d3};
    for (int order = 0; order <= 3; ++order) {
      const double expected = acr_basis(s.shape, s.t, order).dot(p);
      worst = std::max(
          worst, std::abs(got[static_cast<std::size_t>(order)] - expected) / std::pow(10.0, order));
    }
  }
  CHECK(worst < 1e-10);
}

TEST_CASE("acr_basis: preconditions", "[kernels][spline]") {
  CHECK_THROWS_AS(acr_basis({}, -1e-9), ContractViolation);
  CHECK_THROWS_AS(acr_basis({}, 1.0 + 1e-9), ContractViolation);
  CHECK_THROWS_AS(acr_basis({}, std::nan("")), ContractViolation);
  CHECK_THROWS_AS(acr_basis({}, 0.5, -1), ContractViolation);
  CHECK_THROWS_AS(acr_basis({}, 0.5, 4), ContractViolation);
}

}  // namespace smoothpost
