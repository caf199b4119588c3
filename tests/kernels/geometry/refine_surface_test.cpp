#include "kernels/geometry/refine_surface.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "tests/kernels/geometry/parts.h"

using namespace smoothpost;

namespace {

/// Largest distance of the middles of all sides from the cylinder of that radius: of walls in the
/// part's height, and of its rims.
double off_cylinder(const OrientedSurface& surface, double radius, double height) {
  double most = 0.0;
  for (const auto& t : surface.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& a = surface.mesh.vertices[t[k]];
      const Vec3& b = surface.mesh.vertices[t[(k + 1) % 3]];
      const bool cap = a.z() == b.z() && (a.z() == 0.0 || a.z() == height) &&
                       std::min(a.head<2>().norm(), b.head<2>().norm()) < 0.9 * radius;
      if (!cap) most = std::max(most, std::abs((0.5 * (a + b)).head<2>().norm() - radius));
    }
  return most;
}

}  // namespace

TEST_CASE("refine_surface: a cylinder of coarse facets", "[kernels][geometry]") {
  const OrientedSurface coarse =
      test::surface_of(test::ellipse_body(35, 35, 40, 36, 8));  // 0.13 mm off
  REQUIRE(off_cylinder(coarse, 35, 40) > 0.13);
  const SurfaceNormals normals(coarse);
  RefineSettings settings;
  settings.tolerance = 0.014;
  const OrientedSurface fine = refine_surface(coarse, normals, settings);
  CHECK(off_cylinder(fine, 35, 40) < 2 * settings.tolerance);
  // Closed as before, caps still flat, the file's triangles known.
  CHECK(fine.open_sides == 0);
  const MeshReport report = describe(fine.mesh);
  CHECK(report.closed());
  CHECK(report.min.z() == 0.0);
  CHECK(report.max.z() == 40.0);
  CHECK(report.signed_volume == Approx(kPi * 35 * 35 * 40).epsilon(1e-3));
  for (const std::uint32_t t : fine.triangle) CHECK(t < coarse.mesh.triangles.size());
  // Vertices of the input stay where they are.
  for (const Vec3& v : coarse.mesh.vertices)
    CHECK(std::count(fine.mesh.vertices.begin(), fine.mesh.vertices.end(), v) == 1);
}

TEST_CASE("refine_surface: what is exact already", "[kernels][geometry]") {
  const OrientedSurface box = test::surface_of(test::box({-20, -15, 0}, {20, 15, 30}));
  const SurfaceNormals normals(box);
  const OrientedSurface same = refine_surface(box, normals, {});
  CHECK(same.mesh.triangles == box.mesh.triangles);
  CHECK(same.triangle == box.triangle);
  RefineSettings none;
  none.tolerance = 0.0;
  CHECK_THROWS_AS(refine_surface(box, normals, none), ContractViolation);
  // A limit of triangles ends it.
  const OrientedSurface coarse = test::surface_of(test::ellipse_body(35, 35, 40, 36, 8));
  const SurfaceNormals of_coarse(coarse);
  none.tolerance = 1e-4;
  none.most_triangles = 1000;
  CHECK(refine_surface(coarse, of_coarse, none).mesh.triangles.size() <= 1000);
}
