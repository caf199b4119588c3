#include "kernels/geometry/slicing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "kernels/core/contract.h"

#ifdef SMOOTHPOST_WITH_CGAL
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_slicer.h>
#include <CGAL/Surface_mesh.h>
#endif

namespace smoothpost {

namespace {

Diagnostic error(const char* code, std::string text) {
  Diagnostic d;
  d.code = code;
  d.text = std::move(text);
  return d;
}

}  // namespace

double signed_area(const SliceContour& contour) {
  const auto& p = contour.points;
  double twice = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3 a = p[i] - p[0];
    const Vec3 b = p[(i + 1) % p.size()] - p[0];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

double length(const SliceContour& contour) {
  const auto& p = contour.points;
  double sum = 0.0;
  for (std::size_t i = 1; i < p.size(); ++i) sum += (p[i] - p[i - 1]).norm();
  if (contour.closed && !p.empty()) sum += (p.front() - p.back()).norm();
  return sum;
}

#ifdef SMOOTHPOST_WITH_CGAL

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;
using Polyline = std::vector<Vec3>;

constexpr double kNudge = 2.0 * kVertexGap;
constexpr double kSamePoint = 1e-6;  // mm
constexpr double kNoLength = 1e-9;   // mm, between neighbours of a contour

SurfaceMesh surface_mesh(const TriangleMesh& mesh) {
  SurfaceMesh out;
  out.reserve(static_cast<SurfaceMesh::size_type>(mesh.vertices.size()),
              static_cast<SurfaceMesh::size_type>(3 * mesh.triangles.size() / 2),
              static_cast<SurfaceMesh::size_type>(mesh.triangles.size()));
  for (const Vec3& v : mesh.vertices) out.add_vertex(Point(v.x(), v.y(), v.z()));
  for (const auto& t : mesh.triangles)
    out.add_face(SurfaceMesh::Vertex_index(t[0]), SurfaceMesh::Vertex_index(t[1]),
                 SurfaceMesh::Vertex_index(t[2]));
  return out;
}

/// Joins polylines at common ends; a place where more than two of them end is left alone.
std::vector<Polyline> joined_at_ends(std::vector<Polyline> lines) {
  using Cell = std::pair<std::int64_t, std::int64_t>;
  const auto cell = [](const Vec3& p) {
    return Cell{std::llround(p.x() / kSamePoint), std::llround(p.y() / kSamePoint)};
  };
  struct End {
    std::size_t line;
    bool back;
  };
  std::map<Cell, std::vector<End>> ends;
  for (std::size_t i = 0; i < lines.size(); ++i)
    for (const bool back : {false, true})
      ends[cell(back ? lines[i].back() : lines[i].front())].push_back({i, back});
  const auto other_end = [&](std::size_t line, bool back) -> std::optional<End> {
    const Vec3 p = back ? lines[line].back() : lines[line].front();
    const Cell at = cell(p);
    std::optional<End> found;
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const auto here = ends.find({at.first + dx, at.second + dy});
        if (here == ends.end()) continue;
        for (const End& end : here->second) {
          if (end.line == line && end.back == back) continue;
          const Vec3& q = end.back ? lines[end.line].back() : lines[end.line].front();
          if ((p - q).norm() > kSamePoint) continue;
          if (found) return {};
          found = end;
        }
      }
    return found;
  };
  std::vector<bool> used(lines.size(), false);
  std::vector<Polyline> out;
  for (std::size_t seed = 0; seed < lines.size(); ++seed) {
    if (used[seed]) continue;
    used[seed] = true;
    Polyline line = lines[seed];
    // Forwards from its back, then backwards from its front.
    for (const bool from_back : {true, false}) {
      End at{seed, from_back};
      while (const auto next = other_end(at.line, at.back)) {
        if (used[next->line]) {
          if (from_back && next->line == seed) line.push_back(line.front());
          break;
        }
        used[next->line] = true;
        Polyline more = lines[next->line];
        if (next->back) std::reverse(more.begin(), more.end());
        if (from_back) {
          line.insert(line.end(), more.begin() + 1, more.end());
        } else {
          std::reverse(more.begin(), more.end());
          line.insert(line.begin(), more.begin(), more.end() - 1);
        }
        at = {next->line, !next->back};
      }
    }
    out.push_back(std::move(line));
  }
  return out;
}

class Slicer {
 public:
  explicit Slicer(const OrientedSurface& surface)
      : surface_(surface), mesh_(surface_mesh(surface.mesh)), slicer_(mesh_) {
    heights_.reserve(surface.mesh.vertices.size());
    for (const Vec3& v : surface.mesh.vertices) heights_.push_back(v.z());
    std::sort(heights_.begin(), heights_.end());
  }

  SliceLayer at(double asked) {
    SliceLayer layer;
    layer.asked = asked;
    layer.height = clear_of_vertices(asked);
    std::vector<std::vector<Point>> cut;
    slicer_(Kernel::Plane_3(0.0, 0.0, 1.0, -layer.height), std::back_inserter(cut));
    std::vector<Polyline> closed;
    std::vector<Polyline> open;
    for (const auto& line : cut) sort_out(line, layer.height, closed, open);
    if (open.size() > 1)
      for (Polyline& line : joined_at_ends(std::exchange(open, {})))
        ((line.front() - line.back()).norm() <= kSamePoint ? closed : open)
            .push_back(std::move(line));
    segments_.clear();
    if (!open.empty() || !closed.empty()) find_segments(layer.height);
    for (Polyline& line : closed) add_closed(std::move(line), layer);
    nest(layer);
    for (Polyline& line : open) add_open(std::move(line), layer);
    arrange(layer);
    return layer;
  }

 private:
  double clear_of_vertices(double z) const {
    for (;; z += kNudge) {
      const auto next = std::lower_bound(heights_.begin(), heights_.end(), z - kVertexGap);
      if (next == heights_.end() || *next > z + kVertexGap) return z;
    }
  }

  static void sort_out(const std::vector<Point>& cut, double height, std::vector<Polyline>& closed,
                       std::vector<Polyline>& open) {
    Polyline line;
    for (const Point& p : cut) {
      const Vec3 v(p.x(), p.y(), height);
      if (line.empty() || (v - line.back()).norm() > kNoLength) line.push_back(v);
    }
    if (line.size() < 2) return;
    const bool is_closed = cut.size() > 2 && cut.front() == cut.back();
    if (!is_closed) return open.push_back(std::move(line));
    closed.push_back(std::move(line));
  }

  /// A triangle's cut, the body on its left as the triangle is wound.
  struct Segment {
    Vec3 from, to;
  };

  // The directed cuts of all triangles, by the middle's place.
  void find_segments(double z) {
    const auto& mesh = surface_.mesh;
    for (const auto& t : mesh.triangles) {
      const std::array<Vec3, 3> c{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
      const std::array<bool, 3> above{c[0].z() > z, c[1].z() > z, c[2].z() > z};
      if (above[0] == above[1] && above[1] == above[2]) continue;
      Segment s;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t j = (k + 1) % 3;
        if (above[k] == above[j]) continue;
        const double share = (z - c[k].z()) / (c[j].z() - c[k].z());
        // Counter-clockwise around the normal the boundary comes down where the cut begins: the
        // outside is on the right.
        (above[k] ? s.from : s.to) = c[k] + share * (c[j] - c[k]);
      }
      const Vec3 middle = 0.5 * (s.from + s.to);
      segments_.emplace(key(middle), s);
    }
  }

  static std::pair<std::int64_t, std::int64_t> key(const Vec3& p) {
    return {std::llround(p.x() / kCell), std::llround(p.y() / kCell)};
  }

  // +1 or −1: the step from a to b runs as its triangle's cut does, or against it; 0 not found.
  int direction(const Vec3& a, const Vec3& b) const {
    const Vec3 middle = 0.5 * (a + b);
    const auto [x, y] = key(middle);
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const auto range = segments_.equal_range({x + dx, y + dy});
        for (auto it = range.first; it != range.second; ++it) {
          const Segment& s = it->second;
          if ((0.5 * (s.from + s.to) - middle).head<2>().norm() > 1e-7) continue;
          const double along = (s.to - s.from).head<2>().dot((b - a).head<2>());
          if (along != 0.0) return along > 0.0 ? 1 : -1;
        }
      }
    return 0;
  }

  // Length of the polyline that runs as the mesh is wound, less that against it.
  double along_mesh(const SliceContour& contour) const {
    const auto& p = contour.points;
    double sum = 0.0;
    for (std::size_t i = 0; i + (contour.closed ? 0 : 1) < p.size(); ++i) {
      const Vec3& next = p[(i + 1) % p.size()];
      sum += direction(p[i], next) * (next - p[i]).norm();
    }
    return sum;
  }

  static void add_closed(Polyline line, SliceLayer& layer) {
    while (line.size() > 1 && (line.front() - line.back()).norm() <= kSamePoint) line.pop_back();
    if (line.size() < 3) return;
    SliceContour contour;
    contour.points = std::move(line);
    const auto least = std::min_element(contour.points.begin(), contour.points.end(),
                                        [](const Vec3& a, const Vec3& b) {
                                          return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
                                        });
    std::rotate(contour.points.begin(), least, contour.points.end());
    layer.contours.push_back(std::move(contour));
  }

  void add_open(Polyline line, SliceLayer& layer) const {
    SliceContour contour;
    contour.closed = false;
    contour.points = std::move(line);
    if (along_mesh(contour) < 0.0) std::reverse(contour.points.begin(), contour.points.end());
    layer.contours.push_back(std::move(contour));
  }

  struct Box {
    Eigen::Vector2d lower, upper;
  };

  static bool is_inside(const SliceContour& contour, const Vec3& p) {
    bool inside = false;
    const auto& c = contour.points;
    for (std::size_t i = 0; i < c.size(); ++i) {
      const Vec3& a = c[i];
      const Vec3& b = c[(i + 1) % c.size()];
      if ((a.y() > p.y()) == (b.y() > p.y())) continue;
      const auto turn =
          CGAL::orientation(Kernel::Point_2(a.x(), a.y()), Kernel::Point_2(b.x(), b.y()),
                            Kernel::Point_2(p.x(), p.y()));
      if ((turn == CGAL::LEFT_TURN) == (b.y() > a.y())) inside = !inside;
    }
    return inside;
  }

  // Depth and parent of the closed contours; then the body comes to their left.
  void nest(SliceLayer& layer) const {
    auto& all = layer.contours;
    std::vector<Box> boxes;
    std::vector<double> areas;
    for (const SliceContour& c : all) {
      Box box{c.points[0].head<2>(), c.points[0].head<2>()};
      for (const Vec3& p : c.points) {
        box.lower = box.lower.cwiseMin(p.head<2>());
        box.upper = box.upper.cwiseMax(p.head<2>());
      }
      boxes.push_back(box);
      areas.push_back(std::abs(signed_area(c)));
    }
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Vec3& p = all[i].points[0];
      for (std::size_t j = 0; j < all.size(); ++j) {
        if (i == j || (p.head<2>().array() < boxes[j].lower.array()).any() ||
            (p.head<2>().array() > boxes[j].upper.array()).any() || !is_inside(all[j], p))
          continue;
        ++all[i].depth;
        const int parent = all[i].parent;
        if (parent < 0 || areas[j] < areas[static_cast<std::size_t>(parent)])
          all[i].parent = static_cast<int>(j);
      }
    }
    for (SliceContour& c : all) {
      if ((signed_area(c) > 0.0) == c.hole()) std::reverse(c.points.begin() + 1, c.points.end());
      c.against_mesh = along_mesh(c) < 0.0;
    }
  }

  static void arrange(SliceLayer& layer) {
    auto& all = layer.contours;
    std::vector<std::size_t> order(all.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      if (all[a].closed != all[b].closed) return all[a].closed;
      const Vec3& p = all[a].points[0];
      const Vec3& q = all[b].points[0];
      if (p.x() != q.x()) return p.x() < q.x();
      return p.y() != q.y() ? p.y() < q.y() : a < b;
    });
    std::vector<std::vector<std::size_t>> inside(all.size());
    std::vector<std::size_t> stack;
    for (auto it = order.rbegin(); it != order.rend(); ++it) {
      const int parent = all[*it].parent;
      if (parent < 0)
        stack.push_back(*it);
      else
        inside[static_cast<std::size_t>(parent)].push_back(*it);
    }
    std::vector<SliceContour> sorted;
    std::vector<int> place(all.size(), -1);
    while (!stack.empty()) {
      const std::size_t i = stack.back();
      stack.pop_back();
      place[i] = static_cast<int>(sorted.size());
      if (all[i].parent >= 0) all[i].parent = place[static_cast<std::size_t>(all[i].parent)];
      sorted.push_back(std::move(all[i]));
      stack.insert(stack.end(), inside[i].begin(), inside[i].end());
    }
    all = std::move(sorted);
  }

  static constexpr double kCell = 1e-5;  // mm

  const OrientedSurface& surface_;
  SurfaceMesh mesh_;
  CGAL::Polygon_mesh_slicer<SurfaceMesh, Kernel> slicer_;
  std::vector<double> heights_;
  std::multimap<std::pair<std::int64_t, std::int64_t>, Segment> segments_;
};

}  // namespace

Result<std::vector<SliceLayer>> slice_surface(const OrientedSurface& surface,
                                              const SliceSettings& settings) {
  require(std::isfinite(settings.first) && std::isfinite(settings.last) && settings.pitch > 0.0 &&
              std::isfinite(settings.pitch),
          "heights and pitch of layers");
  if (settings.last < settings.first || surface.mesh.triangles.empty())
    return Result<std::vector<SliceLayer>>(std::vector<SliceLayer>{});
  const double count = std::floor((settings.last - settings.first) / settings.pitch + 1e-9) + 1.0;
  if (count > static_cast<double>(kMostLayers))
    return Result<std::vector<SliceLayer>>::failure(
        error("RG131", std::to_string(count) + " layers are more than " +
                           std::to_string(kMostLayers) + ": choose a larger pitch"));
  Slicer slicer(surface);
  std::vector<SliceLayer> layers;
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
    layers.push_back(slicer.at(settings.first + static_cast<double>(k) * settings.pitch));
  return Result<std::vector<SliceLayer>>(std::move(layers));
}

#else

Result<std::vector<SliceLayer>> slice_surface(const OrientedSurface&, const SliceSettings&) {
  return Result<std::vector<SliceLayer>>::failure(
      error("RG130",
            "parts cannot be sliced: this library was built without CGAL "
            "(SMOOTHPOST_WITH_CGAL=OFF)"));
}

#endif

}  // namespace smoothpost
