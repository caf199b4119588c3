#include "kernels/spline/quaternion_spline.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/contract.h"

using namespace smoothpost;

namespace {

double angle(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return a.angularDistance(b);
}

/// Random places and rotations up to 1.2 rad apart, signs at random.
QuaternionKnots random_knots(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  QuaternionKnots knots;
  Eigen::Quaterniond q =
      Eigen::Quaterniond(unit(random), unit(random), unit(random), 2.0).normalized();
  for (int i = 0; i < count; ++i) {
    knots.u.push_back(i == 0 ? -1.0 : knots.u.back() + 1.25 + unit(random));
    const Vec3 axis = Vec3(unit(random), unit(random), 1.5).normalized();
    q = q * Eigen::Quaterniond(Eigen::AngleAxisd(1.2 * unit(random), axis));
    const bool flip = unit(random) < 0.0;
    knots.values.push_back(flip ? Eigen::Quaterniond(-q.coeffs()) : q);
  }
  return knots;
}

}  // namespace

TEST_CASE("quaternion_spline: signs are continuous and rotations the same", "[kernels][spline]") {
  std::mt19937 random(11);
  for (int k = 0; k < 50; ++k) {
    const QuaternionKnots given = random_knots(random, 9);
    const QuaternionKnots knots = with_continuous_signs(given);
    for (std::size_t i = 0; i < knots.u.size(); ++i) {
      CHECK(angle(knots.values[i], given.values[i]) < 1e-7);
      if (i > 0) CHECK(knots.values[i].dot(knots.values[i - 1]) >= 0.0);
    }
  }
}

TEST_CASE("quaternion_spline: slerp is exact at the places and of constant rate",
          "[kernels][spline]") {
  std::mt19937 random(12);
  for (int k = 0; k < 50; ++k) {
    const QuaternionKnots knots = random_knots(random, 5);
    for (std::size_t i = 0; i < knots.u.size(); ++i)
      CHECK(angle(slerp_at(knots, knots.u[i]), knots.values[i]) < 1e-7);
    for (std::size_t i = 0; i + 1 < knots.u.size(); ++i) {
      const double h = (knots.u[i + 1] - knots.u[i]) / 16.0;
      const double whole = angle(knots.values[i], knots.values[i + 1]);
      CHECK(whole < 1.2 + 1e-9);  // the short way
      for (int j = 0; j < 16; ++j) {
        const double a = knots.u[i] + h * j;
        CHECK(angle(slerp_at(knots, a), slerp_at(knots, a + h)) ==
              Approx(whole / 16.0).margin(1e-7));
      }
    }
  }
}

TEST_CASE("quaternion_spline: exact at the places and twice continuously differentiable",
          "[kernels][spline]") {
  std::mt19937 random(13);
  for (int k = 0; k < 50; ++k) {
    const QuaternionKnots knots = random_knots(random, 8);
    const QuaternionSpline spline(knots);
    const QuaternionKnots continuous = with_continuous_signs(knots);
    constexpr double h = 1e-4;
    for (std::size_t i = 0; i < knots.u.size(); ++i) {
      const double u = knots.u[i];
      CHECK((spline.at(u).coeffs() - continuous.values[i].coeffs()).norm() < 1e-12);
      if (i == 0 || i + 1 == knots.u.size()) continue;
      // One-sided differences of second order in h on either side of the place.
      const auto c = [&](int j) { return spline.at(u + j * h).coeffs(); };
      const Eigen::Vector4d right = (-1.5 * c(0) + 2.0 * c(1) - 0.5 * c(2)) / h;
      const Eigen::Vector4d left = (1.5 * c(0) - 2.0 * c(-1) + 0.5 * c(-2)) / h;
      CHECK((right - left).norm() < 1e-5);
      const Eigen::Vector4d bend_right = (2.0 * c(0) - 5.0 * c(1) + 4.0 * c(2) - c(3)) / (h * h);
      const Eigen::Vector4d bend_left = (2.0 * c(0) - 5.0 * c(-1) + 4.0 * c(-2) - c(-3)) / (h * h);
      CHECK((bend_right - bend_left).norm() < 1e-3);
    }
  }
}

TEST_CASE("quaternion_spline: two places are joined by their great circle", "[kernels][spline]") {
  const Eigen::Quaterniond a(Eigen::AngleAxisd(0.3, Vec3::UnitX()));
  const Eigen::Quaterniond b(Eigen::AngleAxisd(1.1, Vec3::UnitX()));
  const QuaternionSpline spline({{0.0, 2.0}, {a, Eigen::Quaterniond(-b.coeffs())}});
  for (int i = 0; i <= 20; ++i) CHECK(spline.at(0.1 * i).vec().tail<2>().norm() < 1e-15);
  CHECK(angle(spline.at(1.0), Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vec3::UnitX()))) < 1e-7);
}

TEST_CASE("quaternion_spline: preconditions", "[kernels][spline]") {
  const Eigen::Quaterniond one = Eigen::Quaterniond::Identity();
  CHECK_THROWS_AS(with_continuous_signs({{0.0}, {one}}), ContractViolation);
  CHECK_THROWS_AS(with_continuous_signs({{0.0, 1.0}, {one}}), ContractViolation);
  CHECK_THROWS_AS(with_continuous_signs({{1.0, 1.0}, {one, one}}), ContractViolation);
  CHECK_THROWS_AS(slerp_at({{0.0}, {one}}, 0.0), ContractViolation);
}
