#include "kernels/geometry/weld.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "kernels/core/contract.h"
#include "kernels/geometry/mesh_edges.h"

namespace smoothpost {

namespace {

constexpr std::uint32_t kEmpty = 0xffffffffU;

/// Places of vertices by their bits: open addressing with linear probing, grown at half load.
class VertexTable {
 public:
  explicit VertexTable(std::size_t expected) {
    slots_.assign(std::bit_ceil(std::max<std::size_t>(16, 2 * expected)), kEmpty);
  }

  /// Index of the vertex with the coordinates of `v`, appended to `vertices` if it is new.
  std::uint32_t find_or_add(const Vec3& v, std::vector<Vec3>& vertices) {
    if (2 * vertices.size() >= slots_.size()) grow(vertices);
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t slot = hash(v) & mask;; slot = (slot + 1) & mask) {
      if (slots_[slot] == kEmpty) {
        slots_[slot] = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(v);
        return slots_[slot];
      }
      if (vertices[slots_[slot]] == v) return slots_[slot];
    }
  }

 private:
  static std::size_t hash(const Vec3& v) {
    std::uint64_t h = 0x9e3779b97f4a7c15ULL;
    for (int k = 0; k < 3; ++k) {
      h ^= std::bit_cast<std::uint64_t>(v[k]);
      h *= 0xff51afd7ed558ccdULL;
      h ^= h >> 32;
    }
    return static_cast<std::size_t>(h);
  }

  void grow(const std::vector<Vec3>& vertices) {
    slots_.assign(2 * slots_.size(), kEmpty);
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      std::size_t slot = hash(vertices[i]) & mask;
      while (slots_[slot] != kEmpty) slot = (slot + 1) & mask;
      slots_[slot] = static_cast<std::uint32_t>(i);
    }
  }

  std::vector<std::uint32_t> slots_;
};

void note(MeshFinding& finding, std::size_t triangle) {
  ++finding.count;
  if (finding.triangles.size() < MeshFinding::kNamed) finding.triangles.push_back(triangle);
}

void count_edges(const TriangleMesh& mesh, MeshReport& report) {
  for_each_edge(mesh, [&](const MeshEdge* begin, const MeshEdge* end) {
    const auto sides = end - begin;
    if (sides == 1) note(report.open, begin->triangle);
    if (sides > 2) note(report.non_manifold, begin->triangle);
    if (sides == 2 && begin[0].forward == begin[1].forward)
      note(report.inconsistent, std::max(begin[0].triangle, begin[1].triangle));
  });
}

/// Triangles in buckets of their smallest vertex, compared as sorted triples inside a bucket.
void count_duplicates(const TriangleMesh& mesh, MeshReport& report) {
  std::vector<std::uint32_t> first(mesh.vertices.size() + 1, 0);
  for (const auto& t : mesh.triangles) ++first[*std::min_element(t.begin(), t.end()) + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::uint32_t> order(mesh.triangles.size());
  auto next = first;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    order[next[*std::min_element(t.begin(), t.end())]++] = static_cast<std::uint32_t>(i);
  }
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> bucket;
  std::vector<std::size_t> duplicates;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    bucket.clear();
    for (auto k = first[v]; k < first[v + 1]; ++k) {
      auto sorted = mesh.triangles[order[k]];
      std::sort(sorted.begin(), sorted.end());
      bucket.emplace_back(sorted, order[k]);
    }
    std::sort(bucket.begin(), bucket.end());
    for (std::size_t k = 1; k < bucket.size(); ++k)
      if (bucket[k].first == bucket[k - 1].first) duplicates.push_back(bucket[k].second);
  }
  std::sort(duplicates.begin(), duplicates.end());
  for (const std::size_t triangle : duplicates) note(report.duplicate, triangle);
}

std::size_t count_components(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::vector<char> used(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles) {
    for (const auto v : t) used[v] = 1;
    const auto a = root(t[0]);
    parent[root(t[1])] = a;
    parent[root(t[2])] = a;
  }
  std::size_t components = 0;
  for (std::uint32_t v = 0; v < parent.size(); ++v) components += used[v] && root(v) == v;
  return components;
}

void measure(const TriangleMesh& mesh, MeshReport& report) {
  const double inf = std::numeric_limits<double>::infinity();
  report.min = Vec3::Constant(inf);
  report.max = Vec3::Constant(-inf);
  for (const auto& t : mesh.triangles)
    for (const auto v : t) {
      report.min = report.min.cwiseMin(mesh.vertices[v]);
      report.max = report.max.cwiseMax(mesh.vertices[v]);
    }
  if (mesh.triangles.empty()) report.min = report.max = Vec3::Zero();
  const Vec3 centre = 0.5 * (report.min + report.max);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vec3 a = mesh.vertices[t[0]] - centre;
    const Vec3 b = mesh.vertices[t[1]] - centre;
    const Vec3 c = mesh.vertices[t[2]] - centre;
    report.area += 0.5 * (b - a).cross(c - a).norm();
    report.signed_volume += a.dot(b.cross(c)) / 6.0;
    if (has_no_area(mesh, i)) note(report.degenerate, i);
  }
}

Diagnostic finding_text(const char* code, const MeshFinding& finding, const std::string& what,
                        const std::string& file) {
  std::string text = std::to_string(finding.count) + " " + what + " (triangle";
  if (finding.triangles.size() > 1) text += 's';
  for (std::size_t i = 0; i < finding.triangles.size(); ++i)
    text += (i ? ", " : " ") + std::to_string(finding.triangles[i] + 1);
  if (finding.count > finding.triangles.size()) text += ", ...";
  return {Severity::warning, code, text + ")", {file, 0, 0}};
}

}  // namespace

TriangleMesh weld(const std::vector<Vec3>& corners) {
  require(corners.size() % 3 == 0, "three corners per triangle");
  require(corners.size() < kEmpty, "fewer than 2^32 - 1 corners");
  TriangleMesh mesh;
  mesh.triangles.resize(corners.size() / 3);
  mesh.vertices.reserve(corners.size() / 5 + 3);
  VertexTable table(corners.size() / 5);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    require(corners[i].allFinite(), "finite coordinates");
    // Adding 0 turns −0 into 0 and changes nothing else.
    const Vec3 v = corners[i] + Vec3::Zero();
    mesh.triangles[i / 3][i % 3] = table.find_or_add(v, mesh.vertices);
  }
  return mesh;
}

bool has_no_area(const TriangleMesh& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return true;
  const Vec3& a = mesh.vertices[t[0]];
  const Vec3& b = mesh.vertices[t[1]];
  const Vec3& c = mesh.vertices[t[2]];
  const double largest = a.cwiseAbs().cwiseMax(b.cwiseAbs()).cwiseMax(c.cwiseAbs()).maxCoeff();
  const double longest =
      std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  // Twice the area is the longest side times the smallest height.
  return (b - a).cross(c - a).norm() <= longest * largest * 0x1p-23;
}

MeshReport describe(const TriangleMesh& mesh) {
  for (const auto& t : mesh.triangles)
    for (const auto v : t) require(v < mesh.vertices.size(), "vertex indices in range");
  MeshReport report;
  report.vertices = mesh.vertices.size();
  report.triangles = mesh.triangles.size();
  measure(mesh, report);
  count_edges(mesh, report);
  count_duplicates(mesh, report);
  report.components = count_components(mesh);
  return report;
}

Diagnostics mesh_findings(const MeshReport& report, const std::string& file_name) {
  Diagnostics out;
  const auto add = [&](const char* code, const MeshFinding& finding, const char* what) {
    if (finding.count) out.push_back(finding_text(code, finding, what, file_name));
  };
  add("STL121", report.degenerate, "triangles without area are left out of distance queries");
  add("STL122", report.duplicate, "triangles stand in the file more than once");
  add("STL123", report.non_manifold, "edges belong to more than two triangles");
  add("STL124", report.inconsistent,
      "edges join two triangles that are wound against each other: one of them is inside out");
  if (report.closed() && report.signed_volume < 0.0)
    out.push_back(
        {Severity::warning,
         "STL125",
         "the closed surface is wound inside out (its volume is negative): outside and inside "
         "are exchanged",
         {file_name, 0, 0}});
  if (report.open.count) {
    out.push_back(finding_text("STL126", report.open,
                               "open edges: the surface is a sheet, not a solid", file_name));
    out.back().severity = Severity::note;
  }
  return out;
}

}  // namespace smoothpost
