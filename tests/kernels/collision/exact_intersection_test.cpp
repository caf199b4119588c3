// Whether bodies and meshes meet, against CGAL's predicates over exact rationals: a polyhedron in a
// round body and one around it enclose the answer.
#if defined(__has_include)
#if __has_include(<CGAL/Triangle_3.h>)
#define SMOOTHPOST_EXACT_ORACLE 1
#endif
#endif

#ifdef SMOOTHPOST_EXACT_ORACLE
#include <CGAL/MP_Float.h>
#include <CGAL/Quotient.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Triangle_3.h>
#include <CGAL/intersections.h>
#endif

#include "kernels/collision/mesh_search.h"
#include "tests/kernels/collision/oracles.h"

using namespace smoothpost;

#ifdef SMOOTHPOST_EXACT_ORACLE

namespace {

using Exact = CGAL::Simple_cartesian<CGAL::Quotient<CGAL::MP_Float>>;

Exact::Point_3 exact(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

/// A convex polyhedron by its corners and triangles.
struct Polyhedron {
  std::vector<Vec3> corners;
  std::vector<std::array<std::size_t, 3>> faces;
};

/// Between two regular polygons: in the frustum when `scale` = 1, around it for 1/cos(π/n).
Polyhedron prism(const FrustumSize& f, std::size_t n, double scale, double longer) {
  Polyhedron out;
  const Vec3 axis = (f.to - f.from).normalized();
  const Vec3 u = axis.unitOrthogonal();
  for (int end = 0; end < 2; ++end)
    for (std::size_t k = 0; k < n; ++k) {
      const double a = 2.0 * kPi * static_cast<double>(k) / static_cast<double>(n);
      const double r = scale * (end ? f.radius_to : f.radius_from);
      out.corners.push_back((end ? Vec3(f.to + longer * axis) : Vec3(f.from - longer * axis)) +
                            r * (std::cos(a) * u + std::sin(a) * axis.cross(u)));
    }
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t next = (k + 1) % n;
    out.faces.push_back({k, next, n + next});
    out.faces.push_back({k, n + next, n + k});
    if (k == 0 || next == 0) continue;
    out.faces.push_back({0, next, k});
    out.faces.push_back({n, n + k, n + next});
  }
  return out;
}

/// Exactly: does a triangle of the mesh cut the polyhedron's surface, or lie in it?
bool meets(const Polyhedron& body, const TriangleMesh& mesh, const Vec3& middle) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto t = test::corners_of(mesh, i);
    const Exact::Triangle_3 triangle(exact(t[0]), exact(t[1]), exact(t[2]));
    bool in = true;
    for (const auto& f : body.faces) {
      const auto a = exact(body.corners[f[0]]);
      const auto b = exact(body.corners[f[1]]);
      const auto c = exact(body.corners[f[2]]);
      if (CGAL::do_intersect(triangle, Exact::Triangle_3(a, b, c))) return true;
      in = in &&
           CGAL::orientation(a, b, c, exact(t[0])) == CGAL::orientation(a, b, c, exact(middle));
    }
    if (in) return true;
  }
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
    if (meets(prism(f, kSides, 1.0 - 1e-9, -1e-9), mesh, middle)) {
      REQUIRE(found.distance == 0.0);
      ++inner;
    } else if (!meets(prism(f, kSides, (1.0 + 1e-9) / std::cos(kPi / kSides), 1e-9), mesh,
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
