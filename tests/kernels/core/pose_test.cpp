#include "kernels/core/pose.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

using namespace smoothpost;

namespace {
Vec3 random_unit(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  return Vec3(normal(rng), normal(rng), normal(rng)).normalized();
}
}  // namespace

TEST_CASE("rotation_exp and rotation_log: inverse of each other", "[kernels][core]") {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> exponent(-12.0, std::log10(kPi - 1e-9));
  for (int i = 0; i < 5000; ++i) {
    const Vec3 w = std::pow(10.0, exponent(rng)) * random_unit(rng);
    const Mat3 r = rotation_exp(w);
    REQUIRE((r * r.transpose() - Mat3::Identity()).norm() < 1e-14);
    REQUIRE((rotation_log(r) - w).norm() <= 1e-7 * std::max(1e-2, w.norm()));
    REQUIRE((rotation_exp(rotation_log(r)) - r).norm() < 1e-12);
  }
}

TEST_CASE("rotation_log: half a turn", "[kernels][core]") {
  const Vec3 w = rotation_log(rotation_about(Vec3(0, 0.6, 0.8), kPi));
  CHECK((w - kPi * Vec3(0, 0.6, 0.8)).norm() < 1e-9);
  CHECK(rotation_log(Mat3::Identity()).norm() == 0.0);
}

TEST_CASE("great_circle: constant rate in the plane of the two vectors", "[kernels][core]") {
  std::mt19937 rng(11);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 a = random_unit(rng), b = random_unit(rng);
    const double angle = angle_between(a, b);
    for (double t : {0.0, 0.25, 0.5, 1.0}) {
      const Vec3 p = great_circle(a, b, t);
      REQUIRE(p.norm() == Approx(1.0).margin(1e-14));
      REQUIRE(angle_between(a, p) == Approx(t * angle).margin(1e-9));
      REQUIRE(std::abs(p.dot(a.cross(b))) < 1e-12);
    }
  }
  const Vec3 half = great_circle(Vec3::UnitZ(), -Vec3::UnitZ(), 0.5);
  CHECK(std::abs(half.z()) < 1e-12);
}

TEST_CASE("angle_between: accurate where acos is not", "[kernels][core]") {
  const double tiny = 1e-9;
  CHECK(angle_between(Vec3::UnitX(), Vec3(std::cos(tiny), std::sin(tiny), 0)) ==
        Approx(tiny).epsilon(1e-6));
}

TEST_CASE("same_sign: the same rotation in the reference's half sphere", "[kernels][core]") {
  std::mt19937 rng(3);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Quaterniond q(rotation_exp(2.5 * random_unit(rng)));
    const Eigen::Quaterniond reference(rotation_exp(2.5 * random_unit(rng)));
    const auto chosen = same_sign(q, reference);
    REQUIRE(chosen.dot(reference) >= 0.0);
    REQUIRE((chosen.toRotationMatrix() - q.toRotationMatrix()).norm() < 1e-14);
  }
}

TEST_CASE("rotation_about: precondition", "[kernels][core]") {
  CHECK_THROWS_AS(rotation_about(Vec3(0, 0, 2), 1.0), ContractViolation);
}
