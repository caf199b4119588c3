#include "kernels/geometry/way_out.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/contract.h"
#include "tests/kernels/geometry/parts.h"

using namespace smoothpost;

namespace {

TriangleTree tree_of(const test::Soup& soup) {
  auto built = build_triangle_tree(weld(soup));
  REQUIRE(built.ok());
  return std::move(built.value());
}

}  // namespace

TEST_CASE("way_out: out of a box along any direction", "[kernels][geometry][property]") {
  const Vec3 low(-20, -15, 0), high(20, 15, 30);
  const TriangleTree tree = tree_of(test::box(low, high));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0.01, 0.99), component(-1, 1);
  for (int i = 0; i < 500; ++i) {
    Vec3 from, d;
    for (int k = 0; k < 3; ++k) {
      from[k] = low[k] + share(random) * (high[k] - low[k]);
      d[k] = i % 3 == 0 ? 0.0 : component(random);
    }
    if (i % 3 == 0) d[i % 9 / 3] = i % 2 ? 1.0 : -1.0;
    d.normalize();
    double want = INFINITY;
    for (int k = 0; k < 3; ++k)
      if (d[k] != 0.0) want = std::min(want, ((d[k] > 0 ? high[k] : low[k]) - from[k]) / d[k]);
    const auto found = way_out(tree, from, d);
    REQUIRE(found.has_value());
    CHECK(*found == Approx(want).margin(1e-9));
  }
  // Through edges, corners and the diagonals of the faces.
  for (const Vec3& to : {Vec3(20, 15, 30), Vec3(-20, 15, 0), Vec3(20, 0, 30), Vec3(0, 0, 30),
                         Vec3(0, 15, 15), Vec3(20, 15, 15)}) {
    const Vec3 from(0, 0, 15);
    const auto found = way_out(tree, from, (to - from).normalized());
    REQUIRE(found.has_value());
    CHECK(*found == Approx((to - from).norm()).margin(1e-9));
  }
  CHECK_FALSE(way_out(tree, Vec3(21, 0, 10), Vec3::UnitX()).has_value());
  CHECK_FALSE(way_out(tree, Vec3(21, 0, 10), -Vec3::UnitX()).has_value());
  CHECK_THROWS_AS(way_out(tree, Vec3::Zero(), Vec3(2, 0, 0)), ContractViolation);
}

TEST_CASE("way_out: bodies that pass through each other are one", "[kernels][geometry]") {
  const TriangleTree tree =
      tree_of(test::together({test::box({0, 0, 0}, {10, 10, 10}), test::box({6, 2, 2}, {25, 8, 8}),
                              test::box({40, 0, 0}, {50, 10, 10})}));
  CHECK(*way_out(tree, Vec3(1, 5, 5), Vec3::UnitX()) == Approx(24.0));
  CHECK(*way_out(tree, Vec3(1, 9, 5), Vec3::UnitX()) == Approx(9.0));
  CHECK(*way_out(tree, Vec3(20, 5, 5), -Vec3::UnitX()) == Approx(20.0));
  // A sphere's facets, from its middle.
  const TriangleTree ball = tree_of(test::sphere({0, 0, 0}, 20, 80));
  CHECK(*way_out(ball, Vec3(0, 0, 0), Vec3(1, 2, -2) / 3) == Approx(20.0).epsilon(2e-3));
}
