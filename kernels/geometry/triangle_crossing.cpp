#include "kernels/geometry/triangle_crossing.h"

#ifdef SMOOTHPOST_WITH_CGAL

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <utility>

namespace smoothpost {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Corners = std::array<Kernel::Point_3, 3>;
using Signs = std::array<int, 3>;

Kernel::Point_3 point(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

int side(const Kernel::Point_3& a, const Kernel::Point_3& b, const Kernel::Point_3& c,
         const Kernel::Point_3& p) {
  // A determinant that vanishes is what takes exact numbers: neighbours need none.
  if (p == a || p == b || p == c) return 0;
  return static_cast<int>(CGAL::orientation(a, b, c, p));
}

Signs sides(const Corners& plane, const Corners& t) {
  return {side(plane[0], plane[1], plane[2], t[0]), side(plane[0], plane[1], plane[2], t[1]),
          side(plane[0], plane[1], plane[2], t[2])};
}

/// Corners strictly on both sides.
bool is_split(const Signs& s) {
  const auto has = [&](int sign) { return s[0] == sign || s[1] == sign || s[2] == sign; };
  return has(1) && has(-1);
}

/// Turns `t` until its first corner is alone strictly on one side of the plane of `other`, and
/// `other` over when that is its lower side, so that it is the upper one then.
void make_first_alone(Corners& t, Signs s, Corners& other) {
  const auto alone = [&](std::size_t i) {
    const int j = s[(i + 1) % 3];
    const int k = s[(i + 2) % 3];
    return (s[i] > 0 && j <= 0 && k <= 0) || (s[i] < 0 && j >= 0 && k >= 0);
  };
  std::size_t first = 0;
  while (!alone(first)) ++first;
  t = {t[first], t[(first + 1) % 3], t[(first + 2) % 3]};
  if (s[first] < 0) std::swap(other[1], other[2]);
}

/// Overlap of two triangles of one plane: no side of either keeps the other outside.
bool overlap_in_plane(const Corners& a, const Corners& b) {
  using Point = Kernel::Point_2;
  const auto project = [](const Corners& t, int along) {
    const auto flat = [along](const Kernel::Point_3& p) {
      return along == 0   ? Point(p.y(), p.z())
             : along == 1 ? Point(p.z(), p.x())
                          : Point(p.x(), p.y());
    };
    return std::array<Point, 3>{flat(t[0]), flat(t[1]), flat(t[2])};
  };
  const auto keeps_out = [](const std::array<Point, 3>& t, const std::array<Point, 3>& other) {
    const auto inner = CGAL::orientation(t[0], t[1], t[2]);
    for (std::size_t i = 0; i < 3; ++i) {
      bool any_inside = false;
      for (const Point& p : other)
        any_inside = any_inside || CGAL::orientation(t[i], t[(i + 1) % 3], p) == inner;
      if (!any_inside) return true;
    }
    return false;
  };
  // One of the three views does not see the plane edge-on.
  for (int along = 0; along < 3; ++along) {
    const auto p = project(a, along);
    if (CGAL::orientation(p[0], p[1], p[2]) == CGAL::COLLINEAR) continue;
    const auto q = project(b, along);
    return !keeps_out(p, q) && !keeps_out(q, p);
  }
  return false;
}

}  // namespace

bool triangles_cross(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b) {
  Corners p{point(a[0]), point(a[1]), point(a[2])};
  Corners q{point(b[0]), point(b[1]), point(b[2])};
  const Signs s = sides(q, p);
  if (s == Signs{0, 0, 0}) return overlap_in_plane(p, q);
  if (!is_split(s)) return false;
  make_first_alone(p, s, q);
  const Signs t = sides(p, q);
  if (!is_split(t)) return false;
  make_first_alone(q, t, p);
  // Both meet the line of the two planes in a segment; the triangles cross when these overlap.
  return side(p[0], p[1], q[0], q[1]) < 0 && side(p[0], p[2], q[2], q[0]) < 0;
}

}  // namespace smoothpost

#endif
