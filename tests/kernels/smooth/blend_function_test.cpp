#include "kernels/smooth/blend_function.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/spline/acr_spline.h"

namespace smoothpost {
namespace {

struct Named {
  std::string name;
  BlendFunction g;
};

std::vector<Named> functions() {
  std::vector<Named> all;
  for (const double kappa : {0.4, 0.45, 0.5, 0.55, 0.6})
    for (const double lambda : {-0.5, 0.0, 0.5, 1.2, 2.09, 2.5})
      all.push_back({"acr " + std::to_string(kappa) + " " + std::to_string(lambda),
                     BlendFunction::acr({kappa, lambda})});
  for (const double c1 : {-1.09, -0.35, 0.0, 1.0, 2.8, 5.9, 6.56})
    all.push_back({"ramp " + std::to_string(c1), BlendFunction::ramp(c1)});
  return all;
}

std::array<double, 4> values(const BlendFunction& g, double u) {
  const BlendValue v = g.at(u);
  return {v.value, v.d1, v.d2, v.d3};
}

std::vector<double> inner(const BlendFunction& g, int n, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> u(-g.reach(), g.reach());
  std::vector<double> all;
  for (int i = 0; i < n; ++i) all.push_back(u(engine));
  return all;
}

}  // namespace

TEST_CASE("blend_function: the limits", "[kernels][smooth]") {
  for (const auto& [name, g] : functions()) {
    INFO(name);
    for (const double outside : {0.0, 1e-15, 0.1, 100.0}) {
      const double u = g.reach() + outside;
      CHECK(values(g, -u) == std::array<double, 4>{0, 0, 0, 0});
      CHECK(values(g, u) == std::array<double, 4>{u, 1, 0, 0});
    }
    // From inside: the fourth derivative is the first that may jump.
    const double near = 1e-6;
    const BlendValue low = g.at(-g.reach() + near);
    const BlendValue high = g.at(g.reach() - near);
    CHECK(std::abs(low.value) < 1e-20);
    CHECK(std::abs(low.d1) < 1e-14);
    CHECK(std::abs(low.d2) < 1e-9);
    CHECK(std::abs(low.d3) < 1e-3);
    CHECK(std::abs(high.value - (g.reach() - near)) < 1e-15);
    CHECK(std::abs(high.d1 - 1.0) < 1e-14);
    CHECK(std::abs(high.d2) < 1e-9);
    CHECK(std::abs(high.d3) < 1e-3);
  }
}

TEST_CASE("blend_function: C3 at every inner knot", "[kernels][smooth]") {
  // Knots of acr are b(k) − a(k) of its control points; ramp has a seam of two formulas instead.
  for (const auto& [name, g] : functions()) {
    INFO(name);
    std::vector<double> knots = {0.0, -0.75, 0.75};
    if (g.is_acr()) {
      knots = {0.0};
      for (std::size_t j = 3; j <= 7; ++j)
        knots.push_back(kAcrCornerWeights[10 - j] - kAcrCornerWeights[j]);
    }
    for (const double knot : knots) {
      const auto left = values(g, knot - 1e-9);
      const auto right = values(g, knot + 1e-9);
      for (std::size_t k = 0; k < 4; ++k) CHECK(std::abs(left[k] - right[k]) < 1e-5);
    }
  }
}

TEST_CASE("blend_function: g(u) - u equals g(-u)", "[kernels][smooth]") {
  for (const auto& [name, g] : functions()) {
    INFO(name);
    for (const double u : inner(g, 200, 31)) {
      const BlendValue a = g.at(u);
      const BlendValue b = g.at(-u);
      REQUIRE(std::abs(a.value - u - b.value) < 1e-14);
      REQUIRE(std::abs(a.d1 - 1.0 + b.d1) < 1e-14);
      REQUIRE(a.d2 == b.d2);
      REQUIRE(a.d3 == -b.d3);
    }
  }
}

TEST_CASE("blend_function: g before the vertex is below g(0) and falls at least linearly",
          "[kernels][smooth]") {
  for (const auto& [name, g] : functions()) {
    INFO(name);
    CHECK(g.at(0.0).value == Approx(g.at_zero()).margin(1e-15));
    for (int i = 0; i <= 2000; ++i) {
      const double share = i / 2000.0;
      const double value = std::abs(g.at(-share * g.reach()).value);
      REQUIRE(value <= g.at_zero() * (1.0 - share) + 1e-15);
    }
  }
}

TEST_CASE("blend_function: the slope stays near 0 to 1", "[kernels][smooth]") {
  for (const auto& [name, g] : functions()) {
    INFO(name);
    double low = 0.0;
    double least = 0.0;
    for (const double u : inner(g, 2000, 32)) {
      const BlendValue v = g.at(u);
      low = std::min(low, std::min(v.d1, 1.0 - v.d1));
      least = std::min(least, v.value);
    }
    if (g.is_acr())
      CHECK(low > -0.1);  // kMostSlope of corner_path.cpp
    else
      CHECK(low > -1e-14);
    if (name == "acr 0.500000 0.500000") {
      CHECK(low == Approx(-0.0325).margin(1e-4));
      CHECK(least == Approx(-0.0059).margin(1e-4));
    }
  }
}

TEST_CASE("blend_function: sigma of acr is monotone for every allowed shape", "[kernels][smooth]") {
  double slowest = 1e9;
  for (double kappa = 0.4; kappa < 0.601; kappa += 0.0125)
    for (double lambda = -0.5; lambda < 2.501; lambda += 0.125)
      for (std::size_t i = 2; i < 8; ++i) {
        Eigen::Vector4d p;
        for (std::size_t k = 0; k < 4; ++k)
          p[static_cast<Eigen::Index>(k)] =
              kAcrCornerWeights[11 - i - k] - kAcrCornerWeights[i - 1 + k];
        const Septic sigma = acr_span({kappa, lambda}, p);
        for (int j = 0; j <= 100; ++j) slowest = std::min(slowest, evaluate(sigma, j / 100.0).d1);
      }
  CHECK(slowest > 0.2);
}

TEST_CASE("blend_function: acr equals the spline through acr_corner_points as a curve",
          "[kernels][smooth][paper]") {
  const Vec3 t0 = Vec3(1, 2, -1).normalized();
  const Vec3 t1 = Vec3(-1, 1, 3).normalized();
  const double h = 1.7;
  const auto q = acr_corner_points(Vec3::Zero(), t0, t1, h);
  for (const auto& shape : {AcrShape{0.5, 0.5}, {0.5, 0.0}, {0.4777, -5.4e-4}, {0.509, 2.06}}) {
    const BlendFunction g = BlendFunction::acr(shape);
    double worst = 0.0;
    for (int i = 0; i <= 600; ++i) {
      const Vec3 r = acr_spline(q, shape, 2.0 + i / 100.0);
      // σ from r = σ·T0 + h·g·(T1 − T0): coordinates of r along T0 and T1.
      const double c = t0.dot(t1);
      const double b = (r.dot(t1) - c * r.dot(t0)) / (1.0 - c * c);
      const double a = (r.dot(t0) - c * r.dot(t1)) / (1.0 - c * c);
      const double sigma = a + b;
      const Vec3 ours = sigma * t0 + h * g.at(sigma / h).value * (t1 - t0);
      worst = std::max(worst, (ours - r).norm());
    }
    CHECK(worst < 5e-14);
  }
}

TEST_CASE("blend_function: ramp is convex", "[kernels][smooth]") {
  for (double c1 = -1.09; c1 <= 6.56; c1 += 0.05) {
    const BlendFunction g = BlendFunction::ramp(c1);
    for (const double u : inner(g, 100, 33)) REQUIRE(g.at(u).d2 >= 0.0);
  }
}

TEST_CASE("blend_function: ramp in closed form", "[kernels][smooth]") {
  const BlendFunction g = BlendFunction::ramp(0.0);
  CHECK(g.at_zero() == Approx(5.0 / 32.0).epsilon(1e-15));
  for (const double u : inner(g, 500, 34)) {
    const double u2 = u * u;
    REQUIRE(std::abs(g.at(u).value - (5 + 16 * u + 15 * u2 - 5 * u2 * u2 + u2 * u2 * u2) / 32) <
            1e-15);
    REQUIRE(std::abs(g.at(u).d2 - 15.0 / 16.0 * (1 - u2) * (1 - u2)) < 1e-15);
  }
}

TEST_CASE("blend_function: derivatives equal central differences", "[kernels][smooth]") {
  constexpr double kStep = 1e-5;
  for (const auto& [name, g] : functions()) {
    INFO(name);
    for (const double u : inner(g, 200, 35)) {
      const auto low = values(g, u - kStep);
      const auto high = values(g, u + kStep);
      const auto d = values(g, u);
      for (std::size_t k = 0; k < 3; ++k)
        REQUIRE(std::abs((high[k] - low[k]) / (2.0 * kStep) - d[k + 1]) < 3e-3);
    }
  }
}

TEST_CASE("blend_function: second_derivative_bound is never below a dense scan",
          "[kernels][smooth]") {
  for (const auto& [name, g] : functions()) {
    INFO(name);
    double most = 0.0;
    for (int i = -5000; i <= 5000; ++i)
      most = std::max(most, std::abs(g.at(i * g.reach() / 5000.0).d2));
    CHECK(g.second_derivative_bound() >= most);
    CHECK(g.second_derivative_bound() <= 3.0 * most);
  }
}

TEST_CASE("acr_fit: no other pair does better", "[kernels][smooth][paper]") {
  // The measure from its definition: ∫ |Q(t) − line(t)|² dt on the span Q2 … Q3, by Simpson.
  const auto cost = [](double turn, const AcrShape& shape) {
    const Vec3 t1(std::cos(turn), std::sin(turn), 0.0);
    const auto q = acr_corner_points(Vec3::Zero(), Vec3::UnitX(), t1, 1.0);
    double sum = 0.0;
    for (int i = 0; i <= 200; ++i) {
      const double t = i / 200.0;
      const double weight = i == 0 || i == 200 ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
      sum += weight * (acr_spline(q, shape, 2.0 + t) - (q[2] + t * (q[3] - q[2]))).squaredNorm();
    }
    return sum / 600.0;
  };
  for (double degrees = 1.0; degrees < 180.0; degrees += 8.9) {
    const double turn = radians_from_degrees(degrees);
    const AcrShape best = acr_fit(turn);
    CHECK(best.kappa > 0.50);
    CHECK(best.kappa < 0.52);
    CHECK(best.lambda > 2.03);
    CHECK(best.lambda < 2.11);
    const double least = cost(turn, best);
    for (const double step : {-1e-3, 1e-3}) {
      CHECK(cost(turn, {best.kappa + step, best.lambda}) > least);
      CHECK(cost(turn, {best.kappa, best.lambda + 10 * step}) > least);
      CHECK(cost(turn, {best.kappa + step, best.lambda + 10 * step}) > least);
      CHECK(cost(turn, {best.kappa + step, best.lambda - 10 * step}) > least);
    }
  }
}

TEST_CASE("ramp_c1: near the least peak of the third derivative", "[kernels][smooth]") {
  CHECK(ramp_c1(0.0) == -0.35);
  CHECK(ramp_c1(kPi) == Approx(0.0372 * 180 - 1.3));
  CHECK(ramp_c1(radians_from_degrees(90.0)) == Approx(2.048));
}

TEST_CASE("blend_function: preconditions", "[kernels][smooth]") {
  CHECK_THROWS_AS(BlendFunction::acr({0.39, 0.5}), ContractViolation);
  CHECK_THROWS_AS(BlendFunction::acr({0.61, 0.5}), ContractViolation);
  CHECK_THROWS_AS(BlendFunction::acr({0.5, -0.51}), ContractViolation);
  CHECK_THROWS_AS(BlendFunction::acr({0.5, 2.51}), ContractViolation);
  CHECK_THROWS_AS(BlendFunction::acr({std::nan(""), 0.5}), ContractViolation);
  CHECK_THROWS_AS(BlendFunction::ramp(-1.1), ContractViolation);
  CHECK_THROWS_AS(BlendFunction::ramp(6.57), ContractViolation);
  CHECK_THROWS_AS(acr_fit(0.0), ContractViolation);
  CHECK_THROWS_AS(acr_fit(kPi), ContractViolation);
}

}  // namespace smoothpost
