// Whether bodies and meshes meet, against CGAL's predicates over exact rationals: a polyhedron in a
// round body and one around it enclose the answer.
#include "kernels/collision/mesh_search.h"
#include "tests/kernels/collision/exact.h"
#include "tests/kernels/collision/oracles.h"

using namespace smoothpost;

#ifdef SMOOTHPOST_EXACT_ORACLE

namespace {

bool meets(const test::Polyhedron& body, const TriangleMesh& mesh, const Vec3& middle) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (test::meets(body, test::corners_of(mesh, i), middle)) return true;
  return false;
}

}  // namespace

TEST_CASE("exact_intersection: bodies meet triangles when the polyhedron inside of them does",
          "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(61);
  constexpr std::size_t kSides = 16;
  int inner = 0;
  int outer = 0;
  int between = 0;
  for (int i = 0; i < 400; ++i) {
    FrustumSize f;
    f.from = test::random_vector(random, 10.0);
    f.to = f.from + test::random_direction(random) * test::uniform(random, 5.0, 30.0);
    f.radius_from = test::uniform(random, 1.0, 10.0);
    f.radius_to = test::uniform(random, 1.0, 10.0);
    const auto mesh = test::random_triangles(random, 3, 15.0, i % 2 ? 3.0 : 12.0);
    const MeshShape shape = test::mesh_of(mesh);
    const Vec3 middle = 0.5 * (f.from + f.to);
    const auto found =
        mesh_margin(*shape.tree, ConvexShape::frustum(f), Pose::Identity(),
                    {.clearance = 0.0, .want = std::numeric_limits<double>::infinity()});
    if (meets(test::prism(f, kSides, 1.0 - 1e-9, -1e-9), mesh, middle)) {
      REQUIRE(found.distance == 0.0);
      ++inner;
    } else if (!meets(test::prism(f, kSides, (1.0 + 1e-9) / std::cos(kPi / kSides), 1e-9), mesh,
                      middle)) {
      REQUIRE(found.lower > 0.0);
      ++outer;
    } else {
      ++between;
    }
  }
  CHECK(inner > 80);
  CHECK(outer > 80);
  CHECK(between < 40);
}

#endif
