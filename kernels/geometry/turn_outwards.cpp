#include "kernels/geometry/turn_outwards.h"

#include <utility>

namespace smoothpost {

namespace {

/// The number of the connected set of each triangle.
std::vector<std::uint32_t> sets_of(const OrientedSurface& surface, std::uint32_t& count) {
  std::vector<std::uint32_t> set(surface.mesh.triangles.size(), OrientedSurface::kNone);
  std::vector<std::uint32_t> open;
  count = 0;
  for (std::uint32_t first = 0; first < set.size(); ++first) {
    if (set[first] != OrientedSurface::kNone) continue;
    open.assign(1, first);
    set[first] = count;
    while (!open.empty()) {
      const std::uint32_t at = open.back();
      open.pop_back();
      for (const std::uint32_t next : surface.neighbour[at])
        if (next != OrientedSurface::kNone && set[next] == OrientedSurface::kNone) {
          set[next] = count;
          open.push_back(next);
        }
    }
    ++count;
  }
  return set;
}

}  // namespace

std::size_t turn_outwards(OrientedSurface& surface, const TriangleTree& tree,
                          const std::vector<SliceLayer>& layers) {
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> set = sets_of(surface, count);
  std::vector<double> against(count, 0.0);
  for (const SliceLayer& layer : layers)
    for (const SliceContour& contour : layer.contours) {
      if (!contour.closed) continue;
      const Vec3 middle = 0.5 * (contour.points[0] + contour.points[1]);
      against[set[tree.closest(middle).triangle]] +=
          contour.against_mesh ? length(contour) : -length(contour);
    }
  std::size_t turned = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (!(against[set[i]] > 0.0)) continue;
    std::swap(surface.mesh.triangles[i][1], surface.mesh.triangles[i][2]);
    std::swap(surface.neighbour[i][0], surface.neighbour[i][2]);
    ++turned;
  }
  return turned;
}

}  // namespace smoothpost
