#include "kernels/geometry/triangle_tree.h"

#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "kernels/core/contract.h"
#include "kernels/geometry/weld.h"
#include "tests/kernels/geometry/shapes.h"

using namespace smoothpost;

namespace {

#define NEEDS_TREE()                                  \
  if (!triangle_tree_available()) {                   \
    WARN("built without CGAL: nothing to test here"); \
    return;                                           \
  }

/// Distance to a triangle by another way than the library's: the foot in the plane if it is inside,
/// else the nearest of the three sides.
double distance_to(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  double best = std::numeric_limits<double>::infinity();
  const Vec3 foot = p - n * (n.dot(p - a) / n.squaredNorm());
  const auto inside = [&](const Vec3& u, const Vec3& v) {
    return n.dot((v - u).cross(foot - u)) >= 0;
  };
  if (inside(a, b) && inside(b, c) && inside(c, a)) best = (p - foot).norm();
  const std::array<const Vec3*, 4> corners = {&a, &b, &c, &a};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 d = *corners[k + 1] - *corners[k];
    const double t = std::clamp(d.dot(p - *corners[k]) / d.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (p - *corners[k] - t * d).norm());
  }
  return best;
}

Vec3 random_point(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> u(-size, size);
  return {u(random), u(random), u(random)};
}

TriangleTree tree_of(const test::Soup& soup) {
  auto tree = build_triangle_tree(weld(soup));
  REQUIRE(tree.ok());
  return std::move(tree.value());
}

}  // namespace

TEST_CASE("triangle_tree: without CGAL it says so", "[kernels][geometry]") {
  const auto tree = build_triangle_tree(weld(test::box({0, 0, 0}, {1, 1, 1})));
  CHECK(tree.ok() == triangle_tree_available());
  if (!tree.ok()) CHECK(tree.diagnostics().at(0).code == "RG101");
}

TEST_CASE("triangle_tree: distances equal those of every triangle, with any hint",
          "[kernels][geometry]") {
  NEEDS_TREE();
  std::mt19937 random(3);
  int queries = 0;
  for (const int triangles : {1, 2, 3, 4, 50, 400}) {
    test::Soup soup;
    for (int i = 0; i < triangles; ++i) {
      const Vec3 centre = random_point(random, 10.0);
      for (int k = 0; k < 3; ++k) soup.push_back(centre + random_point(random, 2.0));
    }
    const auto mesh = weld(soup);
    auto tree = build_triangle_tree(mesh);
    REQUIRE(tree.ok());
    std::uniform_int_distribution<std::uint32_t> any(0, static_cast<std::uint32_t>(triangles - 1));
    for (int q = 0; q < 300; ++q) {
      const Vec3 p = random_point(random, 14.0);
      double expected = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < soup.size(); i += 3)
        expected = std::min(expected, distance_to(p, soup[i], soup[i + 1], soup[i + 2]));
      const auto found = tree.value().closest(p);
      const auto hinted = tree.value().closest(p, any(random));
      REQUIRE(std::abs(found.signed_distance) == Approx(expected).margin(1e-12));
      REQUIRE(std::abs(hinted.signed_distance) == Approx(expected).margin(1e-12));
      REQUIRE((found.point - p).norm() == Approx(expected).margin(1e-12));
      const auto& t = mesh.triangles[found.triangle];
      REQUIRE(distance_to(found.point, mesh.vertices[t[0]], mesh.vertices[t[1]],
                          mesh.vertices[t[2]]) < 1e-12);
      REQUIRE(found.normal.norm() == Approx(1.0));
      ++queries;
    }
  }
  CHECK(queries == 1800);
}

TEST_CASE("triangle_tree: signed distance of a box", "[kernels][geometry]") {
  NEEDS_TREE();
  const Vec3 half(3, 2, 1);
  const auto tree = tree_of(test::box(-half, half));
  std::mt19937 random(5);
  int inside = 0;
  int features[3] = {0, 0, 0};
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = random_point(random, 5.0);
    // The box's distance by its definition: outside part, or depth below the nearest face.
    const Vec3 over = p.cwiseAbs() - half;
    const double expected = over.cwiseMax(0.0).norm() + std::min(over.maxCoeff(), 0.0);
    const auto found = tree.closest(p);
    REQUIRE(found.signed_distance == Approx(expected).margin(1e-12));
    REQUIRE_FALSE(found.on_boundary);
    inside += expected < 0.0;
    ++features[static_cast<int>(found.feature)];
  }
  CHECK(inside > 50);
  for (const int n : features) CHECK(n > 100);
}

TEST_CASE("triangle_tree: the sign is right at a sharp edge and tip", "[kernels][geometry]") {
  NEEDS_TREE();
  // A needle: seen from beyond the tip, the plane of a single face has points on both sides.
  const Vec3 tip(0, 0, 10);
  const std::array<Vec3, 3> base = {Vec3(1, 0, 0), Vec3(-0.5, 0.9, 0), Vec3(-0.5, -0.9, 0)};
  test::Soup soup = {base[0], base[2], base[1]};
  for (std::size_t k = 0; k < 3; ++k)
    for (const Vec3& v : {base[k], base[(k + 1) % 3], tip}) soup.push_back(v);
  CHECK(describe(weld(soup)).signed_volume > 0.0);
  const auto tree = tree_of(soup);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> angle(0.0, 2.0 * kPi);
  for (int i = 0; i < 500; ++i) {
    const double a = angle(random);
    const Vec3 beyond = tip + Vec3(0.3 * std::cos(a), 0.3 * std::sin(a), 0.5);
    const auto found = tree.closest(beyond);
    REQUIRE(found.feature == MeshFeature::vertex);
    REQUIRE(found.signed_distance > 0.0);
    const Vec3 inside = Vec3(0, 0, 9.0) + 0.01 * Vec3(std::cos(a), std::sin(a), 0.0);
    REQUIRE(tree.closest(inside).signed_distance < 0.0);
  }
}

TEST_CASE("triangle_tree: a sphere's distance and normal", "[kernels][geometry]") {
  NEEDS_TREE();
  const Vec3 centre(100, 200, -50);
  const auto tree = tree_of(test::sphere(centre, 20.0, 90));
  std::mt19937 random(13);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = centre + random_point(random, 30.0);
    const double r = (p - centre).norm();
    if (r < 2.0) continue;
    const auto found = tree.closest(p);
    // Chord height of the facets: 20 (1 − cos 1°) on both angles.
    REQUIRE(found.signed_distance == Approx(r - 20.0).margin(0.01));
    REQUIRE(angle_between(found.normal, (p - centre) / r) < 0.04);
  }
}

TEST_CASE("triangle_tree: the boundary of an open sheet", "[kernels][geometry]") {
  NEEDS_TREE();
  const auto tree =
      tree_of(test::sheet([](double u, double v) { return Vec3(10 * u, 10 * v, 0); }, 4, 4));
  const auto above = tree.closest({5.1, 5.3, 2});
  CHECK(above.signed_distance == Approx(2.0));
  CHECK_FALSE(above.on_boundary);
  const auto below = tree.closest({5.1, 5.3, -2});
  CHECK(below.signed_distance == Approx(-2.0));
  const auto beyond = tree.closest({13, 4.9, 4});
  CHECK(beyond.on_boundary);
  CHECK(beyond.signed_distance == Approx(5.0));
  CHECK(beyond.normal.isApprox(Vec3(0, 0, 1)));
  CHECK(tree.closest({-3, -4, 0}).on_boundary);
  CHECK(tree.min() == Vec3(0, 0, 0));
  CHECK(tree.max() == Vec3(10, 10, 0));
  CHECK(tree.size() == 32);
}

TEST_CASE("triangle_tree: triangles without area are left out, doubled and folded ones are not",
          "[kernels][geometry]") {
  NEEDS_TREE();
  test::Soup soup = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 5}, {0, 0, 5}, {1, 1, 5}};
  auto tree = tree_of(soup);
  CHECK(tree.size() == 1);
  CHECK(tree.closest({0.2, 0.2, 5}).signed_distance == Approx(5.0));
  CHECK(tree.closest({0.2, 0.2, 5}, 1).triangle == 0);
  // The same triangle from both sides: the normals of its edges cancel.
  tree = tree_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {0, 1, 0}, {1, 0, 0}});
  const auto found = tree.closest({-1, 0.5, 1});
  CHECK(std::abs(found.signed_distance) == Approx(std::sqrt(2.0)));
  CHECK(found.normal.norm() == Approx(1.0));
  const auto none = build_triangle_tree(weld({{0, 0, 0}, {0, 0, 0}, {1, 1, 1}}));
  REQUIRE_FALSE(none.ok());
  CHECK(none.diagnostics().at(0).code == "RG102");
}

TEST_CASE("triangle_tree: preconditions", "[kernels][geometry]") {
  NEEDS_TREE();
  const auto tree = tree_of(test::box({0, 0, 0}, {1, 1, 1}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(tree.closest({nan, 0, 0}), ContractViolation);
  CHECK_THROWS_AS(tree.closest({0, 0, 0}, 12), ContractViolation);
  TriangleMesh bad;
  bad.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  bad.triangles = {{0, 1, 3}};
  CHECK_THROWS_AS(build_triangle_tree(bad), ContractViolation);
}
