#include "kernels/geometry/turn_outwards.h"

#include <catch2/catch.hpp>

#include "tests/kernels/geometry/parts.h"

using namespace smoothpost;

TEST_CASE("turn_outwards: a box inside out is turned and nothing else", "[kernels][geometry]") {
  const test::Soup right = test::box({0, 0, 0}, {10, 10, 10});
  const test::Soup wrong = test::turned_over(test::box({20, 0, 0}, {30, 10, 10}));
  // A ring: its inner wall has the body outside of it.
  const test::Soup ring = test::together({test::ellipse_wall(15, 15, 10, 60, 4),
                                          test::turned_over(test::ellipse_wall(8, 8, 10, 40, 4))});
  test::Soup beside = ring;
  for (Vec3& v : beside) v += Vec3(60, 0, 0);
  OrientedSurface surface = test::surface_of(test::together({right, wrong, beside}));
  const OrientedSurface before = surface;
  auto tree = build_triangle_tree(surface.mesh);
  REQUIRE(tree.ok());
  SliceSettings settings;
  settings.first = 2;
  settings.last = 8;
  const auto layers = slice_surface(surface, settings);
  REQUIRE(layers.ok());
  CHECK(turn_outwards(surface, tree.value(), layers.value()) == 12);
  for (std::size_t i = 0; i < surface.mesh.triangles.size(); ++i) {
    const auto& t = surface.mesh.triangles[i];
    const auto& old = before.mesh.triangles[i];
    const double x = surface.mesh.vertices[t[0]].x();
    CHECK((t == old) == !(x >= 20 && x <= 30));
    // Neighbours are still across the sides that they are named for.
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t n = surface.neighbour[i][k];
      if (n == OrientedSurface::kNone) continue;
      const auto& other = surface.mesh.triangles[n];
      const auto has = [&](std::uint32_t v) {
        return other[0] == v || other[1] == v || other[2] == v;
      };
      CHECK(has(t[k]));
      CHECK(has(t[(k + 1) % 3]));
    }
  }
  // As its contours say now.
  const auto again = slice_surface(surface, settings);
  REQUIRE(again.ok());
  for (const SliceLayer& layer : again.value())
    for (const SliceContour& contour : layer.contours) CHECK_FALSE(contour.against_mesh);
}
