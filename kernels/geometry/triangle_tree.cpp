#include "kernels/geometry/triangle_tree.h"

#include <utility>

#include "kernels/core/contract.h"
#include "kernels/geometry/mesh_edges.h"
#include "kernels/geometry/weld.h"

#ifdef SMOOTHPOST_WITH_CGAL

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>

#include <cmath>
#include <limits>

namespace smoothpost {

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
constexpr std::uint32_t kNone = 0xffffffffU;

/// A triangle of the mesh with its corners beside each other in memory.
struct Facet {
  std::array<Vec3, 3> corner;
};

/// The facet's box in single precision, rounded outwards: what sorting needs, beside the index that
/// is sorted, so that half a million facets are not looked up at each of twenty levels.
struct SmallBox {
  std::array<float, 3> lo, hi;

  explicit SmallBox(const Facet& facet) {
    const auto& [a, b, c] = facet.corner;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      lo[k] = below(std::min({a[i], b[i], c[i]}));
      hi[k] = -below(-std::max({a[i], b[i], c[i]}));
    }
  }

 private:
  static float below(double value) {
    const auto near = static_cast<float>(value);
    if (static_cast<double>(near) <= value) return near;
    return std::nextafter(near, -std::numeric_limits<float>::infinity());
  }
};

/// What CGAL's tree sorts: a facet by its index.
class FacetPrimitive {
 public:
  using Id = std::uint32_t;
  using Point = Kernel::Point_3;
  using Datum = Kernel::Triangle_3;

  FacetPrimitive(const Facet* facets, Id id) : facet_(facets + id), id_(id), box_(facets[id]) {}
  Id id() const { return id_; }
  Datum datum() const {
    return Datum(point(facet_->corner[0]), point(facet_->corner[1]), point(facet_->corner[2]));
  }
  Point reference_point() const { return point(facet_->corner[0]); }
  const Facet& facet() const { return *facet_; }
  const SmallBox& box() const { return box_; }

 private:
  static Point point(const Vec3& v) { return Point(v.x(), v.y(), v.z()); }
  const Facet* facet_;
  Id id_;
  SmallBox box_;
};

using Traits = CGAL::AABB_traits<Kernel, FacetPrimitive>;
using Tree = CGAL::AABB_tree<Traits>;
using Node = CGAL::AABB_node<Traits>;

/// Box of a range of primitives.
struct BoxOfRange {
  template <class Iterator>
  CGAL::Bbox_3 operator()(Iterator first, Iterator beyond) const {
    auto lo = first->box().lo;
    auto hi = first->box().hi;
    for (++first; first != beyond; ++first)
      for (std::size_t k = 0; k < 3; ++k) {
        lo[k] = std::min(lo[k], first->box().lo[k]);
        hi[k] = std::max(hi[k], first->box().hi[k]);
      }
    return {lo[0], lo[1], lo[2], hi[0], hi[1], hi[2]};
  }
};

/// Puts the lower half of a range, along the longest side of its box, first.
struct SplitAtMedian {
  template <class Iterator>
  void operator()(Iterator first, Iterator beyond, const CGAL::Bbox_3& box) const {
    int longest = 0;
    for (int k = 1; k < 3; ++k)
      if (box.max(k) - box.min(k) > box.max(longest) - box.min(longest)) longest = k;
    const auto axis = static_cast<std::size_t>(longest);
    const auto centre = [axis](const FacetPrimitive& p) {
      return p.box().lo[axis] + p.box().hi[axis];
    };
    std::nth_element(first, first + (beyond - first) / 2, beyond,
                     [&](const FacetPrimitive& a, const FacetPrimitive& b) {
                       const float ca = centre(a);
                       const float cb = centre(b);
                       return ca != cb ? ca < cb : a.id() < b.id();
                     });
  }
};

/// Closest point of a triangle and where it lies: 0..2 corner, 3..5 side from corner k − 3, 6
/// inside.
struct OnFacet {
  Vec3 point;
  int region = 6;
};

/// Voronoi regions of the triangle's features, one after the other
/// [Ericson2005, Real-Time Collision Detection, section 5.1.5].
OnFacet closest_on(const Facet& facet, const Vec3& p) {
  const auto& [a, b, c] = facet.corner;
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {a, 0};
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return {b, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return {a + d1 / (d1 - d3) * ab, 3};
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return {c, 2};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return {a + d2 / (d2 - d6) * ac, 5};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
    return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), 4};
  const double share = 1.0 / (va + vb + vc);
  return {a + ab * (vb * share) + ac * (vc * share), 6};
}

/// Descends the tree, the nearer child first, and keeps the best facet.
class ClosestFacet {
 public:
  using Priority = double;

  ClosestFacet(const Vec3& query, const Facet* facets, std::uint32_t hint) : facet_(hint) {
    best_ = closest_on(facets[hint], query);
    squared_ = (query - best_.point).squaredNorm();
  }

  bool go_further() const { return true; }
  void intersection(const Vec3& query, const FacetPrimitive& primitive) {
    const OnFacet candidate = closest_on(primitive.facet(), query);
    const double squared = (query - candidate.point).squaredNorm();
    if (squared >= squared_) return;
    squared_ = squared;
    best_ = candidate;
    facet_ = primitive.id();
  }
  bool do_intersect(const Vec3& query, const Node& node) const {
    return squared_to_box(query, node) < squared_;
  }
  std::pair<bool, Priority> do_intersect_with_priority(const Vec3& query, const Node& node) const {
    const double squared = squared_to_box(query, node);
    return {squared < squared_, -squared};
  }

  std::uint32_t facet() const { return facet_; }
  const OnFacet& best() const { return best_; }

 private:
  static double squared_to_box(const Vec3& query, const Node& node) {
    const auto& box = node.bbox();
    const double x = std::max({box.xmin() - query.x(), 0.0, query.x() - box.xmax()});
    const double y = std::max({box.ymin() - query.y(), 0.0, query.y() - box.ymax()});
    const double z = std::max({box.zmin() - query.z(), 0.0, query.z() - box.zmax()});
    return x * x + y * y + z * z;
  }

  std::uint32_t facet_;
  OnFacet best_;
  double squared_ = 0.0;
};

}  // namespace

struct TriangleTree::Impl {
  std::vector<Facet> facets;
  std::vector<Vec3> normals;                         // unit, by facet
  std::vector<std::uint32_t> triangle;               // facet -> triangle of the mesh
  std::vector<std::uint32_t> facet_of;               // triangle -> facet, kNone when it has no area
  std::vector<std::array<std::uint32_t, 3>> vertex;  // facet -> vertices of the mesh
  std::vector<std::array<std::uint32_t, 3>> edge;    // facet -> edges, side k from corner k
  std::vector<Vec3> edge_normals;                    // sum over the faces, not normalised
  std::vector<char> edge_open;
  std::vector<Vec3> vertex_normals;  // angle-weighted sum, not normalised
  std::vector<char> vertex_open;
  Vec3 min = Vec3::Zero();
  Vec3 max = Vec3::Zero();
  double signed_volume = 0.0;
  bool solid = true;
  Tree tree;

  void take_facets(const TriangleMesh& mesh);
  void take_edges(const TriangleMesh& mesh);
  void take_vertices();
  void build_tree();
  ClosestPoint closest(const Vec3& query, std::uint32_t hint) const;
};

void TriangleTree::Impl::take_facets(const TriangleMesh& mesh) {
  facet_of.assign(mesh.triangles.size(), kNone);
  facets.reserve(mesh.triangles.size());
  normals.reserve(mesh.triangles.size());
  triangle.reserve(mesh.triangles.size());
  vertex.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    for (const auto v : t) {
      require(v < mesh.vertices.size(), "vertex indices in range");
      require(mesh.vertices[v].allFinite(), "finite coordinates");
    }
    if (has_no_area(mesh, i)) continue;
    facet_of[i] = static_cast<std::uint32_t>(facets.size());
    triangle.push_back(static_cast<std::uint32_t>(i));
    vertex.push_back(t);
    facets.push_back({{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}});
    const auto& [a, b, c] = facets.back().corner;
    normals.push_back((b - a).cross(c - a).normalized());
  }
}

void TriangleTree::Impl::take_edges(const TriangleMesh& mesh) {
  edge.resize(facets.size());
  edge_normals.reserve(facets.size() * 3 / 2 + 3);
  edge_open.reserve(facets.size() * 3 / 2 + 3);
  vertex_open.assign(mesh.vertices.size(), 0);
  for_each_edge(mesh, [&](const MeshEdge* begin, const MeshEdge* end) {
    const auto index = static_cast<std::uint32_t>(edge_normals.size());
    const bool open = end - begin == 1;
    if (end - begin != 2 || begin->forward == (begin + 1)->forward) solid = false;
    Vec3 sum = Vec3::Zero();
    for (const MeshEdge* side = begin; side != end; ++side) {
      const auto facet = facet_of[side->triangle];
      if (facet == kNone) continue;
      edge[facet][side->side] = index;
      sum += normals[facet];
    }
    edge_normals.push_back(sum);
    edge_open.push_back(open);
    if (open)
      for (int k = 0; k < 2; ++k)
        vertex_open[mesh.triangles[begin->triangle][(begin->side + k) % 3]] = 1;
  });
}

void TriangleTree::Impl::take_vertices() {
  vertex_normals.assign(vertex_open.size(), Vec3::Zero());
  for (std::size_t f = 0; f < facets.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const auto& corner = facets[f].corner;
      const Vec3 u = corner[(k + 1) % 3] - corner[k];
      const Vec3 v = corner[(k + 2) % 3] - corner[k];
      vertex_normals[vertex[f][k]] += std::atan2(u.cross(v).norm(), u.dot(v)) * normals[f];
    }
}

void TriangleTree::Impl::build_tree() {
  for (std::uint32_t i = 0; i < facets.size(); ++i) tree.insert(FacetPrimitive(facets.data(), i));
  tree.do_not_accelerate_distance_queries();
  tree.custom_build(BoxOfRange(), SplitAtMedian());
  min = Vec3::Constant(std::numeric_limits<double>::infinity());
  max = -min;
  for (const Facet& facet : facets)
    for (const Vec3& v : facet.corner) {
      min = min.cwiseMin(v);
      max = max.cwiseMax(v);
    }
  const Vec3 centre = 0.5 * (min + max);
  for (const Facet& facet : facets) {
    const auto& [a, b, c] = facet.corner;
    signed_volume += (a - centre).dot((b - centre).cross(c - centre)) / 6.0;
  }
}

ClosestPoint TriangleTree::Impl::closest(const Vec3& query, std::uint32_t hint) const {
  ClosestFacet search(query, facets.data(), hint);
  tree.traversal_with_priority(query, search);
  const auto facet = search.facet();
  const int region = search.best().region;
  ClosestPoint out;
  out.point = search.best().point;
  out.triangle = triangle[facet];
  out.normal = normals[facet];
  Vec3 pseudo = Vec3::Zero();
  if (region < 3) {
    out.feature = MeshFeature::vertex;
    pseudo = vertex_normals[vertex[facet][region]];
    out.on_boundary = vertex_open[vertex[facet][region]] != 0;
  } else if (region < 6) {
    out.feature = MeshFeature::edge;
    pseudo = edge_normals[edge[facet][region - 3]];
    out.on_boundary = edge_open[edge[facet][region - 3]] != 0;
  }
  // Faces folded onto each other cancel: then the face's own normal has to do.
  const double length = pseudo.norm();
  if (length > 1e-9) out.normal = pseudo / length;
  const Vec3 away = query - out.point;
  out.signed_distance = away.dot(out.normal) < 0.0 ? -away.norm() : away.norm();
  return out;
}

TriangleTree::TriangleTree(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TriangleTree::TriangleTree(TriangleTree&&) noexcept = default;
TriangleTree& TriangleTree::operator=(TriangleTree&&) noexcept = default;
TriangleTree::~TriangleTree() = default;

ClosestPoint TriangleTree::closest(const Vec3& query) const {
  require(query.allFinite(), "finite query point");
  return impl_->closest(query, 0);
}

ClosestPoint TriangleTree::closest(const Vec3& query, std::uint32_t hint) const {
  require(query.allFinite(), "finite query point");
  require(hint < impl_->facet_of.size(), "hint is a triangle of the mesh");
  const auto facet = impl_->facet_of[hint];
  return impl_->closest(query, facet == kNone ? 0 : facet);
}

// A part of one triangle points to its facet, a larger one to its node; the node knows neither
// itself nor its children's kind without the number of triangles (CGAL's AABB_node).
TreePart TriangleTree::whole() const {
  const auto size = static_cast<std::uint32_t>(impl_->facets.size());
  if (size == 1) return {impl_->facets.data(), 1};
  return {impl_->tree.root_node(), size};
}

std::pair<TreePart, TreePart> TriangleTree::halves(const TreePart& part) const {
  const Node& node = *static_cast<const Node*>(part.at_);
  switch (part.size_) {
    case 2:
      return {{&node.left_data().facet(), 1}, {&node.right_data().facet(), 1}};
    case 3:
      return {{&node.left_data().facet(), 1}, {&node.right_child(), 2}};
    default:
      const std::uint32_t half = part.size_ / 2;
      return {{&node.left_child(), half}, {&node.right_child(), part.size_ - half}};
  }
}

MeshBox TriangleTree::box(const TreePart& part) const {
  if (part.size_ == 1) {
    const auto& c = corners(part);
    const Vec3 lo = c[0].cwiseMin(c[1]).cwiseMin(c[2]);
    const Vec3 hi = c[0].cwiseMax(c[1]).cwiseMax(c[2]);
    return {0.5 * (lo + hi), 0.5 * (hi - lo)};
  }
  const CGAL::Bbox_3& b = static_cast<const Node*>(part.at_)->bbox();
  return {0.5 * Vec3(b.xmin() + b.xmax(), b.ymin() + b.ymax(), b.zmin() + b.zmax()),
          0.5 * Vec3(b.xmax() - b.xmin(), b.ymax() - b.ymin(), b.zmax() - b.zmin())};
}

const std::array<Vec3, 3>& TriangleTree::corners(const TreePart& part) const {
  return static_cast<const Facet*>(part.at_)->corner;
}

std::uint32_t TriangleTree::triangle(const TreePart& part) const {
  return impl_->triangle[static_cast<const Facet*>(part.at_) - impl_->facets.data()];
}

std::optional<TreePart> TriangleTree::part_of(std::uint32_t triangle) const {
  require(triangle < impl_->facet_of.size(), "a triangle of the mesh");
  const auto facet = impl_->facet_of[triangle];
  if (facet == kNone) return std::nullopt;
  return TreePart(impl_->facets.data() + facet, 1);
}

const Vec3& TriangleTree::min() const { return impl_->min; }
const Vec3& TriangleTree::max() const { return impl_->max; }
std::size_t TriangleTree::size() const { return impl_->facets.size(); }
bool TriangleTree::solid() const { return impl_->solid; }
bool TriangleTree::open() const {
  return std::find(impl_->edge_open.begin(), impl_->edge_open.end(), 1) != impl_->edge_open.end();
}
double TriangleTree::signed_volume() const { return impl_->signed_volume; }

bool triangle_tree_available() { return true; }

Result<TriangleTree> build_triangle_tree(const TriangleMesh& mesh) {
  auto impl = std::make_unique<TriangleTree::Impl>();
  impl->take_facets(mesh);
  if (impl->facets.empty())
    return Result<TriangleTree>::failure(
        {Severity::error,
         "RG102",
         "the part has no triangle with area: nothing to measure against",
         {}});
  impl->take_edges(mesh);
  impl->take_vertices();
  impl->build_tree();
  return TriangleTree(std::move(impl));
}

}  // namespace smoothpost

#else  // without CGAL

namespace smoothpost {

struct TriangleTree::Impl {
  Vec3 zero = Vec3::Zero();
  std::array<Vec3, 3> corners = {zero, zero, zero};
};

TriangleTree::TriangleTree(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TriangleTree::TriangleTree(TriangleTree&&) noexcept = default;
TriangleTree& TriangleTree::operator=(TriangleTree&&) noexcept = default;
TriangleTree::~TriangleTree() = default;

// No tree can exist: build_triangle_tree() never makes one.
ClosestPoint TriangleTree::closest(const Vec3&) const {
  require(false, "built with SMOOTHPOST_WITH_CGAL");
  return {};
}
ClosestPoint TriangleTree::closest(const Vec3& query, std::uint32_t) const {
  return closest(query);
}
const Vec3& TriangleTree::min() const { return impl_->zero; }
const Vec3& TriangleTree::max() const { return impl_->zero; }
std::size_t TriangleTree::size() const { return 0; }
bool TriangleTree::solid() const { return false; }
TreePart TriangleTree::whole() const { return {nullptr, 0}; }
std::pair<TreePart, TreePart> TriangleTree::halves(const TreePart& part) const {
  return {part, part};
}
MeshBox TriangleTree::box(const TreePart&) const { return {}; }
const std::array<Vec3, 3>& TriangleTree::corners(const TreePart&) const { return impl_->corners; }
std::uint32_t TriangleTree::triangle(const TreePart&) const { return 0; }
std::optional<TreePart> TriangleTree::part_of(std::uint32_t) const { return std::nullopt; }
bool TriangleTree::open() const { return false; }
double TriangleTree::signed_volume() const { return 0.0; }

bool triangle_tree_available() { return false; }

Result<TriangleTree> build_triangle_tree(const TriangleMesh&) {
  return Result<TriangleTree>::failure({Severity::error,
                                        "RG101",
                                        "this build has no CGAL (SMOOTHPOST_WITH_CGAL=OFF): the "
                                        "part cannot be compared with the program; "
                                        "leave the part out or use a build with CGAL",
                                        {}});
}

}  // namespace smoothpost

#endif
