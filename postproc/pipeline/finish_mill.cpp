#include "postproc/pipeline/finish_mill.h"

#include <algorithm>

#include "kernels/geometry/way_out.h"

namespace smoothpost {

namespace {
constexpr double kLeastStep = 0.25;  // of the radius, along the mill
constexpr double kOutside = 0.1;     // mm, from the surface to where is looked
}  // namespace

// A step by what the part is farther away than the radius: nothing between comes nearer than that.
double MillFit::room(const SurfacePoint& at) const {
  double least = INFINITY;
  std::uint32_t hint = 0;
  double t = mill_.radius;
  while (true) {
    const ClosestPoint near = part_.closest(at.point + t * at.normal, hint);
    hint = near.triangle;
    const double room = near.signed_distance - mill_.radius;
    least = std::min(least, room);
    if (t >= mill_.length || room < -kLeastStep * mill_.radius) return least;
    if (room >= mill_.length - t) return least;
    t = std::min(mill_.length, t + std::max(room, kLeastStep * mill_.radius));
  }
}

void DepthOfCut::add(double depth) {
  least = std::min(least, depth);
  greatest = std::max(greatest, depth);
  sum += depth;
  ++count;
}

bool buried(const TriangleTree& mesh, const SurfacePoint& at) {
  const Vec3 outside = at.point + kOutside * at.normal;
  const bool inside = way_out(mesh, outside, at.normal).has_value();
  if (!mesh.open()) return inside;
  const Vec3 across = at.normal.unitOrthogonal();
  return inside + way_out(mesh, outside, across).has_value() +
             way_out(mesh, outside, -across).has_value() >=
         2;
}

double depth_in(const TriangleTree& stock, const Vec3& tip, const Vec3& axis) {
  if (const auto way = way_out(stock, tip, axis)) return *way;
  return -stock.closest(tip).signed_distance;
}

}  // namespace smoothpost
