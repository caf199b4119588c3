#include "kernels/geometry/offset_body.h"

#include <catch2/catch.hpp>

#include "kernels/geometry/triangle_tree.h"
#include "tests/kernels/geometry/parts.h"

using namespace smoothpost;
using test::surface_of;

TEST_CASE("offset_body: a box gives the larger box", "[kernels][geometry]") {
  for (const double d : {0.7, -0.4}) {
    const OffsetBody body = offset_body(surface_of(test::box({0, 1, 2}, {10, 7, 5})), d);
    const MeshReport report = describe(body.mesh);
    CHECK((report.min - Vec3(0 - d, 1 - d, 2 - d)).norm() < 1e-9);
    CHECK((report.max - Vec3(10 + d, 7 + d, 5 + d)).norm() < 1e-9);
    CHECK(report.signed_volume == Approx((10 + 2 * d) * (6 + 2 * d) * (3 + 2 * d)));
    CHECK(body.folded.count == 0);
    CHECK(body.largest_miss < 1e-9);
  }
}

TEST_CASE("offset_body: smooth surfaces move along their normal", "[kernels][geometry]") {
  SECTION("sphere") {
    const OffsetBody body = offset_body(surface_of(test::sphere({1, 2, 3}, 20.0, 90)), 0.7);
    for (const Vec3& v : body.mesh.vertices)
      CHECK((v - Vec3(1, 2, 3)).norm() == Approx(20.7).margin(2e-3));
    CHECK(body.folded.count == 0);
  }
  SECTION("elliptic body: walls and caps") {
    const OrientedSurface part = surface_of(test::ellipse_body(50, 35, 40, 384, 50));
    const OffsetBody body = offset_body(part, 0.7);
    const auto tree = build_triangle_tree(body.mesh);
    REQUIRE(tree.ok());
    for (std::size_t i = 0; i < part.mesh.triangles.size(); i += 7) {
      const auto& t = part.mesh.triangles[i];
      const Vec3 middle =
          (part.mesh.vertices[t[0]] + part.mesh.vertices[t[1]] + part.mesh.vertices[t[2]]) / 3.0;
      // Depth of cut at a point of the part: how deep it lies in the body.
      CHECK(-tree.value().closest(middle).signed_distance == Approx(0.7).margin(1e-4));
    }
    CHECK(body.folded.count == 0);
  }
}

TEST_CASE("offset_body: a groove too narrow for it folds", "[kernels][geometry]") {
  // Profile of a block with a groove of the given width, extruded along z.
  const auto block = [](double width) {
    const double w = 0.5 * width;
    const std::array<Vec3, 8> p{Vec3(-10, 0, 0), Vec3(10, 0, 0), Vec3(10, 8, 0), Vec3(w, 8, 0),
                                Vec3(w, 3, 0),   Vec3(-w, 3, 0), Vec3(-w, 8, 0), Vec3(-10, 8, 0)};
    return test::sheet(
        [&](double u, double v) {
          const auto i = static_cast<std::size_t>(std::lround(8 * u)) % 8;
          return Vec3(p[i] + Vec3(0, 0, 30 * v));
        },
        8, 1);
  };
  CHECK(offset_body(surface_of(block(1.0)), 0.7).folded.count == 2);  // the groove's floor
  CHECK(offset_body(surface_of(block(2.0)), 0.7).folded.count == 0);
}
