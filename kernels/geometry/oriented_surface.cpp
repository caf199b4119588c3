#include "kernels/geometry/oriented_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/core/contract.h"
#include "kernels/geometry/mesh_edges.h"

namespace smoothpost {

namespace {

constexpr std::uint32_t kNone = OrientedSurface::kNone;

/// Joins numbered things to sets.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Indices of the triangles that are kept, ascending.
std::vector<std::uint32_t> without_doubles(const TriangleMesh& mesh) {
  struct Key {
    std::array<std::uint32_t, 3> vertices;  // ascending
    bool even;                              // the triangle runs in their order
    std::uint32_t triangle;
  };
  std::vector<Key> keys;
  keys.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    const auto least = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
    std::array<std::uint32_t, 3> v{t[least], t[(least + 1) % 3], t[(least + 2) % 3]};
    const bool even = v[1] < v[2];
    if (!even) std::swap(v[1], v[2]);
    keys.push_back({v, even, static_cast<std::uint32_t>(i)});
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return a.vertices != b.vertices ? a.vertices < b.vertices : a.triangle < b.triangle;
  });
  std::vector<std::uint32_t> kept;
  for (std::size_t begin = 0, end = 0; begin < keys.size(); begin = end) {
    bool both = false;
    for (end = begin; end < keys.size() && keys[end].vertices == keys[begin].vertices; ++end)
      both = both || keys[end].even != keys[begin].even;
    if (!both) kept.push_back(keys[begin].triangle);
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

class Orienter {
 public:
  explicit Orienter(const TriangleMesh& mesh) : input_(mesh) {}

  OrientedSurface run() {
    out_.triangle = without_doubles(input_);
    out_.dropped = input_.triangles.size() - out_.triangle.size();
    TriangleMesh kept;
    kept.vertices = input_.vertices;
    kept.triangles.reserve(out_.triangle.size());
    for (const std::uint32_t i : out_.triangle) kept.triangles.push_back(input_.triangles[i]);
    triangles_ = std::move(kept.triangles);
    kept.triangles = triangles_;
    links_.assign(triangles_.size(), {Link{}, Link{}, Link{}});
    for_each_edge(kept, [&](const MeshEdge* begin, const MeshEdge* end) { link(begin, end); });
    wind_alike();
    make_vertices();
    return std::move(out_);
  }

 private:
  /// What lies across a side.
  struct Link {
    std::uint32_t triangle = kNone;
    std::uint8_t side = 0;
    bool against = true;  // wound against it, as it should be
  };

  void join(const MeshEdge& a, const MeshEdge& b) {
    links_[a.triangle][a.side] = {b.triangle, b.side, a.forward != b.forward};
    links_[b.triangle][b.side] = {a.triangle, a.side, a.forward != b.forward};
  }

  void link(const MeshEdge* begin, const MeshEdge* end) {
    if (end - begin == 2) join(begin[0], begin[1]);
    if (end - begin > 2) link_around(begin, end);
  }

  // An edge of more than two sides, from the smaller to the larger vertex: the body of a forward
  // side lies towards smaller angles, that of a backward one towards larger.
  void link_around(const MeshEdge* begin, const MeshEdge* end) {
    const MeshEdge& first = *begin;
    const auto& t = triangles_[first.triangle];
    const std::uint32_t at = std::min(t[first.side], t[(first.side + 1U) % 3U]);
    const Vec3& origin = input_.vertices[at];
    const Vec3 along = input_.vertices[first.other] - origin;
    if (!(along.norm() > 0.0)) return;
    const Vec3 x = along.unitOrthogonal();
    const Vec3 y = along.normalized().cross(x);
    std::vector<std::pair<double, MeshEdge>> around;
    for (const MeshEdge* e = begin; e != end; ++e) {
      const Vec3 d = input_.vertices[triangles_[e->triangle][(e->side + 2U) % 3U]] - origin;
      around.emplace_back(std::atan2(d.dot(y), d.dot(x)), *e);
    }
    std::stable_sort(around.begin(), around.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t i = 0; i < around.size(); ++i) {
      const auto& before = around[(i + around.size() - 1) % around.size()];
      if (around[i].second.forward && !before.second.forward) join(before.second, around[i].second);
    }
  }

  double area(std::size_t i) const {
    const auto& t = triangles_[i];
    const Vec3& a = input_.vertices[t[0]];
    return 0.5 * (input_.vertices[t[1]] - a).cross(input_.vertices[t[2]] - a).norm();
  }

  void wind_alike() {
    const std::size_t n = triangles_.size();
    std::vector<std::uint8_t> state(n, 0);  // 0 not seen, 1 as given, 2 turned
    std::vector<std::uint32_t> set;
    for (std::size_t seed = 0; seed < n; ++seed) {
      if (state[seed] != 0) continue;
      set.assign(1, static_cast<std::uint32_t>(seed));
      state[seed] = 1;
      double as_given = 0.0;
      double turned = 0.0;
      for (std::size_t next = 0; next < set.size(); ++next) {
        const std::uint32_t i = set[next];
        (state[i] == 1 ? as_given : turned) += area(i);
        for (const Link& link : links_[i]) {
          if (link.triangle == kNone || state[link.triangle] != 0) continue;
          state[link.triangle] = link.against ? state[i] : static_cast<std::uint8_t>(3 - state[i]);
          set.push_back(link.triangle);
        }
      }
      if (turned > as_given)
        for (const std::uint32_t i : set) state[i] = static_cast<std::uint8_t>(3 - state[i]);
    }
    for (std::size_t i = 0; i < n; ++i)
      for (Link& link : links_[i])
        if (link.triangle != kNone && link.against != (state[i] == state[link.triangle]))
          link.triangle = kNone;
    turn(state);
  }

  // Side k of a turned triangle (corner 0, 2, 1) is side 2 − k of the one before.
  void turn(const std::vector<std::uint8_t>& state) {
    for (std::size_t i = 0; i < triangles_.size(); ++i)
      for (Link& link : links_[i])
        if (link.triangle != kNone && state[link.triangle] == 2)
          link.side = static_cast<std::uint8_t>(2 - link.side);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      if (state[i] != 2) continue;
      std::swap(triangles_[i][1], triangles_[i][2]);
      std::swap(links_[i][0], links_[i][2]);
      ++out_.turned;
    }
  }

  void make_vertices() {
    do {
      number_corners();
    } while (part_doubled_sides());
    find_neighbours();
  }

  // Of the vertices as they are now: no edge has more than one side each way.
  void find_neighbours() {
    out_.neighbour.assign(triangles_.size(), {kNone, kNone, kNone});
    for_each_edge(out_.mesh, [&](const MeshEdge* begin, const MeshEdge* end) {
      if (end - begin == 2) {
        out_.neighbour[begin[0].triangle][begin[0].side] = begin[1].triangle;
        out_.neighbour[begin[1].triangle][begin[1].side] = begin[0].triangle;
      } else {
        ++out_.open_sides;
      }
    });
  }

  void number_corners() {
    const std::size_t n = triangles_.size();
    Sets corners(3 * n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const Link& link = links_[i][k];
        if (link.triangle == kNone) continue;
        const std::uint32_t other = 3 * link.triangle;
        const auto here = static_cast<std::uint32_t>(3 * i);
        corners.join(here + static_cast<std::uint32_t>(k), other + (link.side + 1U) % 3U);
        corners.join(here + static_cast<std::uint32_t>((k + 1) % 3), other + link.side);
      }
    std::vector<std::uint32_t> vertex(3 * n, kNone);
    out_.mesh.vertices.clear();
    out_.mesh.triangles.resize(n);
    for (std::size_t c = 0; c < 3 * n; ++c) {
      const std::uint32_t root = corners.root(static_cast<std::uint32_t>(c));
      if (vertex[root] == kNone) {
        vertex[root] = static_cast<std::uint32_t>(out_.mesh.vertices.size());
        out_.mesh.vertices.push_back(input_.vertices[triangles_[c / 3][c % 3]]);
      }
      out_.mesh.triangles[c / 3][c % 3] = vertex[root];
    }
  }

  // A fan that winds around its vertex more than once may pass the same edge twice: there a
  // triangle is taken out of it, to stand alone.
  bool part_doubled_sides() {
    std::vector<std::uint32_t> alone;
    for_each_edge(out_.mesh, [&](const MeshEdge* begin, const MeshEdge* end) {
      std::array<bool, 2> seen{};
      for (const MeshEdge* e = begin; e != end; ++e) {
        if (seen[e->forward]) alone.push_back(e->triangle);
        seen[e->forward] = true;
      }
    });
    for (const std::uint32_t i : alone)
      for (Link& link : links_[i]) {
        if (link.triangle == kNone) continue;
        links_[link.triangle][link.side].triangle = kNone;
        link.triangle = kNone;
      }
    return !alone.empty();
  }

  const TriangleMesh& input_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::array<Link, 3>> links_;
  OrientedSurface out_;
};

}  // namespace

OrientedSurface orient_surface(const TriangleMesh& mesh) {
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) require(v < mesh.vertices.size(), "vertex index out of range");
  for (const Vec3& v : mesh.vertices) require(v.allFinite(), "coordinate is not finite");
  require(mesh.triangles.size() < kNone / 3, "too many triangles");
  return Orienter(mesh).run();
}

}  // namespace smoothpost
