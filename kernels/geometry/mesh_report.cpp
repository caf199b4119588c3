#include "kernels/geometry/mesh_report.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/geometry/mesh_edges.h"
#include "kernels/geometry/triangle_crossing.h"

#ifdef SMOOTHPOST_WITH_CGAL
#include <CGAL/box_intersection_d.h>
#endif

namespace smoothpost {

namespace {

/// Sets that grow together; the smallest member stands for its set.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

struct OpenEdge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::uint32_t triangle = 0;
};

/// A set of triangles connected through edges.
struct Component {
  std::vector<std::uint32_t> triangles;
  bool closed = true;
  double signed_volume = 0.0;
  Vec3 min = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 max = Vec3::Constant(-std::numeric_limits<double>::infinity());
};

class Surface {
 public:
  explicit Surface(const TriangleMesh& mesh) : mesh_(mesh), component_(mesh.triangles.size()) {
    std::vector<char> ragged(mesh.triangles.size(), 0);
    for_each_edge(mesh, [&](const MeshEdge* begin, const MeshEdge* end) {
      const auto sides = end - begin;
      const bool sound = sides == 2 && begin[0].forward != begin[1].forward;
      for (const MeshEdge* e = begin; e != end; ++e) {
        component_.join(begin->triangle, e->triangle);
        if (!sound) ragged[e->triangle] = 1;
      }
      if (sides == 1) {
        const auto& t = mesh.triangles[begin->triangle];
        open_.push_back({t[begin->side], t[(begin->side + 1U) % 3], begin->triangle});
      }
    });
    collect_components(ragged);
  }

  void report_boundaries(SurfaceReport& report) const {
    Sets sets(mesh_.vertices.size());
    for (const OpenEdge& edge : open_) sets.join(edge.from, edge.to);
    struct Rim {
      MeshBoundary boundary;
      Vec3 min;
      Vec3 max;
    };
    std::map<std::uint32_t, Rim> rims;
    for (const OpenEdge& edge : open_) {
      const Vec3& a = mesh_.vertices[edge.from];
      const Vec3& b = mesh_.vertices[edge.to];
      const auto [place, fresh] = rims.try_emplace(sets.root(edge.from), Rim{{}, a, a});
      Rim& rim = place->second;
      MeshBoundary& out = rim.boundary;
      out.triangle = fresh ? edge.triangle : std::min<std::size_t>(out.triangle, edge.triangle);
      ++out.edges;
      out.perimeter += (b - a).norm();
      rim.min = rim.min.cwiseMin(a).cwiseMin(b);
      rim.max = rim.max.cwiseMax(a).cwiseMax(b);
    }
    report.boundaries = rims.size();
    for (auto& [root, rim] : rims) {
      rim.boundary.centre = 0.5 * (rim.min + rim.max);
      report.longest_boundaries.push_back(rim.boundary);
    }
    std::stable_sort(
        report.longest_boundaries.begin(), report.longest_boundaries.end(),
        [](const MeshBoundary& a, const MeshBoundary& b) { return a.perimeter > b.perimeter; });
    if (report.longest_boundaries.size() > SurfaceReport::kNamed)
      report.longest_boundaries.resize(SurfaceReport::kNamed);
  }

  void report_components(SurfaceReport& report, std::size_t budget) const {
    report.components = components_.size();
    for (const Component& c : components_) report.closed_components += c.closed;
    for (const Component& c : components_) {
      if (!c.closed || !(c.signed_volume < 0.0)) continue;
      const auto around = components_around(c, budget);
      if (!around) {
        ++report.undecided;
      } else if (*around % 2 == 1) {
        ++report.cavities;
      } else {
        ++report.inside_out.count;
        if (report.inside_out.triangles.size() < MeshFinding::kNamed)
          report.inside_out.triangles.push_back(c.triangles.front());
      }
    }
  }

 private:
  void collect_components(const std::vector<char>& ragged) {
    std::vector<std::uint32_t> place(mesh_.triangles.size(), 0);
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
      const auto& t = mesh_.triangles[i];
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;  // has no edge
      const std::uint32_t root = component_.root(i);
      if (root == i) {
        place[i] = static_cast<std::uint32_t>(components_.size());
        components_.emplace_back();
      }
      Component& c = components_[place[root]];
      c.triangles.push_back(i);
      c.closed = c.closed && !ragged[i];
      for (const auto v : t) {
        c.min = c.min.cwiseMin(mesh_.vertices[v]);
        c.max = c.max.cwiseMax(mesh_.vertices[v]);
      }
    }
    for (Component& c : components_) {
      const Vec3 centre = 0.5 * (c.min + c.max);
      for (const auto i : c.triangles) {
        const auto corner = [&](std::size_t k) -> Vec3 {
          return mesh_.vertices[mesh_.triangles[i][k]] - centre;
        };
        c.signed_volume += corner(0).dot(corner(1).cross(corner(2))) / 6.0;
      }
    }
  }

  /// How many other closed components enclose `inner`, or nothing when the budget runs out.
  std::optional<std::size_t> components_around(const Component& inner, std::size_t& budget) const {
    const auto& t = mesh_.triangles[inner.triangles.front()];
    const Vec3 seen_from =
        (mesh_.vertices[t[0]] + mesh_.vertices[t[1]] + mesh_.vertices[t[2]]) / 3.0;
    std::size_t around = 0;
    for (const Component& c : components_) {
      if (budget == 0) return std::nullopt;
      --budget;
      if (&c == &inner || !c.closed) continue;
      if ((inner.min - c.min).minCoeff() < 0.0 || (c.max - inner.max).minCoeff() < 0.0) continue;
      if (c.triangles.size() > budget) return std::nullopt;
      budget -= c.triangles.size();
      // The solid angle of a closed surface is 4π times how often it winds around the point.
      double angle = 0.0;
      for (const auto i : c.triangles) angle += solid_angle(mesh_.triangles[i], seen_from);
      if (std::lround(std::abs(angle) / (4.0 * kPi)) % 2 == 1) ++around;
    }
    return around;
  }

  /// Signed solid angle of a triangle from a point, [VanOosterom1983] Eq. (8).
  double solid_angle(const std::array<std::uint32_t, 3>& t, const Vec3& from) const {
    const Vec3 a = mesh_.vertices[t[0]] - from;
    const Vec3 b = mesh_.vertices[t[1]] - from;
    const Vec3 c = mesh_.vertices[t[2]] - from;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    const double below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    return 2.0 * std::atan2(a.dot(b.cross(c)), below);
  }

  const TriangleMesh& mesh_;
  Sets component_;
  std::vector<Component> components_;
  std::vector<OpenEdge> open_;
};

#ifdef SMOOTHPOST_WITH_CGAL

using Box =
    CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t,
                                              CGAL::Box_intersection_d::ID_FROM_BOX_ADDRESS>;

/// Ends the search of CGAL's boxes, which has no other way out.
struct BudgetSpent {};

class CrossingSearch {
 public:
  CrossingSearch(const TriangleMesh& mesh, std::size_t budget, SurfaceReport& report)
      : mesh_(mesh), budget_(budget), report_(report) {}

  void run() {
    std::vector<Box> boxes;
    boxes.reserve(mesh_.triangles.size());
    for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
      if (has_no_area(mesh_, i)) continue;
      const auto t = corners(i);
      const Vec3 lo = t[0].cwiseMin(t[1]).cwiseMin(t[2]);
      const Vec3 hi = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
      boxes.emplace_back(CGAL::Bbox_3(lo.x(), lo.y(), lo.z(), hi.x(), hi.y(), hi.z()), i);
    }
    std::vector<const Box*> order;
    for (const Box& box : boxes) order.push_back(&box);
    try {
      CGAL::box_self_intersection_d(order.begin(), order.end(), [this](const Box* a, const Box* b) {
        test(std::min(a->info(), b->info()), std::max(a->info(), b->info()));
      });
      report_.crossings_complete = true;
    } catch (const BudgetSpent&) {
      report_.crossings_complete = false;
    }
  }

 private:
  std::array<Vec3, 3> corners(std::uint32_t i) const {
    const auto& t = mesh_.triangles[i];
    return {mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]};
  }

  void test(std::uint32_t first, std::uint32_t second) {
    if (budget_ == 0) throw BudgetSpent();
    --budget_;
    const auto& t = mesh_.triangles[first];
    const auto& u = mesh_.triangles[second];
    const auto shared = std::count_if(t.begin(), t.end(), [&](std::uint32_t v) {
      return std::find(u.begin(), u.end(), v) != u.end();
    });
    if (shared == 3 || !triangles_cross(corners(first), corners(second))) return;
    ++report_.crossings;
    auto& named = report_.crossing_triangles;
    const std::pair<std::size_t, std::size_t> pair{first, second};
    named.insert(std::upper_bound(named.begin(), named.end(), pair), pair);
    if (named.size() > SurfaceReport::kNamed) named.pop_back();
  }

  const TriangleMesh& mesh_;
  std::size_t budget_;
  SurfaceReport& report_;
};

void find_crossings(const TriangleMesh& mesh, std::size_t budget, SurfaceReport& report) {
  CrossingSearch(mesh, budget, report).run();
}

#else

void find_crossings(const TriangleMesh&, std::size_t, SurfaceReport&) {}

#endif

std::string fixed(double value, int digits) {
  std::array<char, 64> buffer{};
  const double step = std::pow(10.0, -digits);
  if (std::abs(value) < 0.5 * step) value = 0.0;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::fixed, digits);
  return std::string(buffer.data(), end.ptr);
}

std::string counted(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

Diagnostic boundary_note(const SurfaceReport& report, const std::string& file) {
  const MeshBoundary& longest = report.longest_boundaries.front();
  const Vec3& c = longest.centre;
  std::string text = report.boundaries == 1 ? "one boundary of open edges"
                                            : std::to_string(report.boundaries) +
                                                  " boundaries of open edges; the longest";
  text += " is " + fixed(longest.perimeter, 2) + " mm round (" + counted(longest.edges, "edge") +
          "), about (" + fixed(c.x(), 2) + ", " + fixed(c.y(), 2) + ", " + fixed(c.z(), 2) +
          "), triangle " + std::to_string(longest.triangle + 1);
  return {Severity::note, "STL127", text, {file, 0, 0}};
}

Diagnostic crossing_warning(const SurfaceReport& report, const std::string& file) {
  std::string text = report.crossings_complete ? "" : "at least ";
  text += counted(report.crossings, "pair") + " of triangles pass through each other (";
  for (std::size_t i = 0; i < report.crossing_triangles.size(); ++i)
    text += (i ? "; " : "") + std::to_string(report.crossing_triangles[i].first + 1) + " and " +
            std::to_string(report.crossing_triangles[i].second + 1);
  if (report.crossings > report.crossing_triangles.size()) text += "; ...";
  return {Severity::warning, "STL128", text + ")", {file, 0, 0}};
}

Diagnostic inside_out_warning(const SurfaceReport& report, const std::string& file) {
  std::string text = std::to_string(report.inside_out.count) + " of " +
                     counted(report.closed_components, "closed component") +
                     " wound inside out (triangle";
  if (report.inside_out.triangles.size() > 1) text += 's';
  for (std::size_t i = 0; i < report.inside_out.triangles.size(); ++i)
    text += (i ? ", " : " ") + std::to_string(report.inside_out.triangles[i] + 1);
  if (report.inside_out.count > report.inside_out.triangles.size()) text += ", ...";
  return {Severity::warning, "STL129", text + ")", {file, 0, 0}};
}

}  // namespace

SurfaceReport report_surface(const TriangleMesh& mesh, const SurfaceBudget& budget) {
  for (const auto& t : mesh.triangles)
    for (const auto v : t) require(v < mesh.vertices.size(), "vertex indices in range");
  for (const Vec3& v : mesh.vertices) require(v.allFinite(), "finite coordinates");
  SurfaceReport report;
  {
    const Surface surface(mesh);
    surface.report_boundaries(report);
    surface.report_components(report, budget.solid_angles);
  }
  find_crossings(mesh, budget.neighbours, report);
  return report;
}

Diagnostics surface_findings(const SurfaceReport& report, const std::string& file_name) {
  Diagnostics out;
  if (report.boundaries) out.push_back(boundary_note(report, file_name));
  if (report.crossings) out.push_back(crossing_warning(report, file_name));
  // A mesh of one closed component that is inside out is STL125 already.
  if (report.inside_out.count && report.components > 1)
    out.push_back(inside_out_warning(report, file_name));
  return out;
}

}  // namespace smoothpost
