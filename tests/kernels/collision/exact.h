#pragma once

// Whether polyhedra meet triangles, by CGAL's predicates over exact rationals: nothing of the
// library's own takes part. SMOOTHPOST_EXACT_ORACLE says that CGAL is there.
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

#include <array>
#include <cmath>
#include <vector>

#include "kernels/collision/convex_shape.h"
#include "kernels/core/mesh.h"
#include "kernels/core/units.h"

namespace smoothpost::test {

using Exact = CGAL::Simple_cartesian<CGAL::Quotient<CGAL::MP_Float>>;

inline Exact::Point_3 exact(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

/// A convex polyhedron by its corners and triangles.
struct Polyhedron {
  std::vector<Vec3> corners;
  std::vector<std::array<std::size_t, 3>> faces;
};

/// Between two regular polygons: in the frustum when `scale` = 1, around it for 1/cos(π/n).
inline Polyhedron prism(const FrustumSize& f, std::size_t n, double scale, double longer) {
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

/// Exactly: does a triangle cut the polyhedron's surface, or lie in it?
/// @param middle  a point inside of the polyhedron
inline bool meets(const Polyhedron& body, const std::array<Vec3, 3>& t, const Vec3& middle) {
  const auto apart = [](const Vec3& low_a, const Vec3& high_a, const Vec3& low_b,
                        const Vec3& high_b) {
    return (low_a.array() > high_b.array()).any() || (low_b.array() > high_a.array()).any();
  };
  const Vec3 low = t[0].cwiseMin(t[1]).cwiseMin(t[2]), high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
  Vec3 body_low = body.corners.front(), body_high = body.corners.front();
  for (const Vec3& c : body.corners) {
    body_low = body_low.cwiseMin(c);
    body_high = body_high.cwiseMax(c);
  }
  if (apart(low, high, body_low, body_high)) return false;
  const Exact::Triangle_3 triangle(exact(t[0]), exact(t[1]), exact(t[2]));
  bool in = true;
  for (const auto& f : body.faces) {
    const Vec3 &a = body.corners[f[0]], &b = body.corners[f[1]], &c = body.corners[f[2]];
    if (!apart(low, high, a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)) &&
        CGAL::do_intersect(triangle, Exact::Triangle_3(exact(a), exact(b), exact(c))))
      return true;
    // In doubles where they are sure.
    const Vec3 n = (b - a).cross(c - a);
    const double side = n.dot(t[0] - a), inside = n.dot(middle - a);
    const double unsure = 1e-9 * n.norm() * ((t[0] - a).norm() + 1.0);
    if (std::abs(side) > unsure)
      in = in && (side > 0.0) == (inside > 0.0);
    else
      in = in && CGAL::orientation(exact(a), exact(b), exact(c), exact(t[0])) ==
                     CGAL::orientation(exact(a), exact(b), exact(c), exact(middle));
  }
  return in;
}

}  // namespace smoothpost::test
#endif
