#include "kernels/spline/acr_spline.h"

#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "kernels/core/contract.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

class Points {
 public:
  explicit Points(std::uint64_t seed) : engine_(seed) {}
  Vec3 point() { return {value_(engine_), value_(engine_), value_(engine_)}; }
  std::vector<Vec3> sequence(std::size_t n) {
    std::vector<Vec3> all(n);
    for (Vec3& p : all) p = point();
    return all;
  }
  double value() { return value_(engine_); }

 private:
  std::mt19937_64 engine_;
  std::uniform_real_distribution<double> value_{-10.0, 10.0};
};

Vec3 vec3(const nlohmann::json& v) {
  return Vec3(v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>());
}

nlohmann::json golden() {
  const auto path = test::shared_path("reference/paper_a.json");
  if (path) return nlohmann::json::parse(std::ifstream(*path));
  WARN("no shared reference files: skipped");
  return nullptr;
}

constexpr double kDigits = 2e-9;  // the golden numbers carry ten to thirteen digits

}  // namespace

TEST_CASE("acr_spline: passes through its points", "[kernels][spline][paper]") {
  Points points(21);
  for (int n = 0; n < 200; ++n) {
    const auto p = points.sequence(11);
    for (std::size_t i = 1; i <= 9; ++i)
      REQUIRE((acr_spline(p, {0.48, 0.3}, static_cast<double>(i)) - p[i]).norm() < 1e-11);
  }
}

TEST_CASE("acr_spline: C3 at every knot whatever the distance of the points",
          "[kernels][spline][paper]") {
  Points points(22);
  for (int n = 0; n < 200; ++n) {
    const auto p = points.sequence(11);
    const AcrShape shape{0.3 + 0.03 * points.value(), 0.2 * points.value()};
    for (std::size_t i = 2; i <= 8; ++i) {
      const auto x = static_cast<double>(i);
      for (int order = 0; order <= 3; ++order) {
        // From the left: the span that ends in the knot, as a spline of its own.
        const std::span<const Vec3> before(p.data() + i - 2, 4);
        const Vec3 left = acr_spline(before, shape, 2.0, order);
        REQUIRE((left - acr_spline(p, shape, x, order)).norm() < 2e-9);
      }
    }
  }
}

TEST_CASE("acr_spline: invariant under rigid motion", "[kernels][spline]") {
  Points points(23);
  for (int n = 0; n < 200; ++n) {
    const auto p = points.sequence(6);
    Pose motion = Pose::Identity();
    motion.linear() = rotation_exp(0.2 * points.point());
    motion.translation() = points.point();
    std::vector<Vec3> moved;
    for (const Vec3& q : p) moved.push_back(motion * q);
    const double x = 2.5 + 0.14 * points.value();
    REQUIRE((acr_spline(moved, {0.5, 0.5}, x) - motion * acr_spline(p, {0.5, 0.5}, x)).norm() <
            1e-12);
    REQUIRE(
        (acr_spline(moved, {0.5, 0.5}, x, 2) - motion.linear() * acr_spline(p, {0.5, 0.5}, x, 2))
            .norm() < 1e-10);
  }
}

TEST_CASE("acr_spline: preconditions", "[kernels][spline]") {
  Points points(24);
  const auto p = points.sequence(6);
  CHECK_THROWS_AS(acr_spline(std::span(p).first(3), {}, 1.0), ContractViolation);
  CHECK_THROWS_AS(acr_spline(p, {}, 0.999), ContractViolation);
  CHECK_THROWS_AS(acr_spline(p, {}, 4.001), ContractViolation);
  CHECK_THROWS_AS(acr_spline(p, {}, 2.0, 4), ContractViolation);
  CHECK_NOTHROW(acr_spline(p, {}, 4.0));
}

TEST_CASE("acr_corner_points: Eq. (14) of the paper", "[kernels][spline][paper]") {
  const Vec3 vertex(3, -2, 5);
  const Vec3 t0 = Vec3(1, 2, -1).normalized();
  const Vec3 t1 = Vec3(-1, 1, 3).normalized();
  const double length = 0.7;  // L
  const double sine = 0.5 * (t1 - t0).norm();
  const auto q = acr_corner_points(vertex, t0, t1, 2.0 * length / sine);
  CHECK((q[5] - (vertex + (t1 - t0).normalized() * length)).norm() < 1e-13);
  const Vec3 q3 = vertex - 2.0 * length / sine * t0;
  const Vec3 q7 = vertex + 2.0 * length / sine * t1;
  const Vec3 r1 = q3 / 3.0 + 2.0 / 3.0 * (vertex - t0 * length / sine);
  const Vec3 r2 = q7 / 3.0 + 2.0 / 3.0 * (vertex + t1 * length / sine);
  CHECK((q[3] - q3).norm() < 1e-13);
  CHECK((q[7] - q7).norm() < 1e-13);
  CHECK((q[2] - (1.5 * q3 - 0.5 * vertex)).norm() < 1e-13);
  CHECK((q[8] - (1.5 * q7 - 0.5 * vertex)).norm() < 1e-13);
  CHECK((q[1] - (2.0 * q3 - vertex)).norm() < 1e-13);
  CHECK((q[0] - (2.5 * q3 - 1.5 * vertex)).norm() < 1e-13);
  CHECK((q[10] - (2.5 * q7 - 1.5 * vertex)).norm() < 1e-13);
  CHECK((q[4] - (0.9 * r1 + 0.1 * r2)).norm() < 1e-13);
  CHECK((q[6] - (0.1 * r1 + 0.9 * r2)).norm() < 1e-13);
}

TEST_CASE("acr_corner_points: golden control points of the paper's corners",
          "[kernels][spline][paper]") {
  const auto file = golden();
  if (file.is_null()) return;
  int corners = 0;
  for (const auto& corner : file.at("paper_path")) {
    const bool tip = corner.at("kind") == "position";
    const auto& given = file.at("points").at(tip ? "P" : "Psi");
    const auto i = corner.at("corner").get<std::size_t>();
    const Vec3 p = vec3(given.at(i));
    const Vec3 t0 = (p - vec3(given.at(i - 1))).normalized();
    const Vec3 t1 = (vec3(given.at(i + 1)) - p).normalized();
    const double sine = 0.5 * (t1 - t0).norm();
    CHECK(sine == Approx(corner.at("sin_half_theta").get<double>()).epsilon(1e-10));
    const auto q = acr_corner_points(p, t0, t1, 2.0 * corner.at("L").get<double>() / sine);
    const AcrShape fitted{corner.at("eq").at("kappa").get<double>(),
                          corner.at("eq").at("lam").get<double>()};
    for (std::size_t j = 0; j < 11; ++j)
      CHECK((q[j] - vec3(corner.at("Q").at(j))).norm() < kDigits);
    const auto compare = [&](const nlohmann::json& rows, const AcrShape& shape, double span) {
      for (const auto& row : rows) {
        const double x = span + row.at("t").get<double>();
        const std::array<const char*, 4> names = {"r", "r1", "r2", "r3"};
        for (int order = 0; order <= 3; ++order)
          CHECK((acr_spline(q, shape, x, order) -
                 vec3(row.at(names[static_cast<std::size_t>(order)])))
                    .norm() < kDigits);
      }
    };
    compare(corner.at("curve_eq_span2"), fitted, 2.0);
    compare(corner.at("curve_half_span4"), {0.5, 0.5}, 4.0);
    ++corners;
  }
  CHECK(corners == 12);
}

TEST_CASE("acr_corner_points: preconditions", "[kernels][spline]") {
  const Vec3 x = Vec3::UnitX();
  CHECK_THROWS_AS(acr_corner_points(x, x, x, 0.0), ContractViolation);
  CHECK_THROWS_AS(acr_corner_points(x, 1.001 * x, x, 1.0), ContractViolation);
  CHECK_THROWS_AS(acr_corner_points(x, x, Vec3::Zero(), 1.0), ContractViolation);
}

}  // namespace smoothpost
