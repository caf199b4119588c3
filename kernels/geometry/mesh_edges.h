#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "kernels/core/mesh.h"

namespace smoothpost {

/// A side of a triangle, in the bucket of its smaller vertex.
struct MeshEdge {
  std::uint32_t other = 0;  ///< the larger vertex
  std::uint32_t triangle = 0;
  std::uint8_t side = 0;  ///< from corner `side` to the next one
  bool forward = true;    ///< runs from the smaller to the larger vertex
};

/// Calls `visit(begin, end)` with the triangle sides of every edge of the mesh, edges in the order
/// of their smaller and larger vertex, sides in the order of triangles. Sides between equal
/// vertices are no edge. Cost: linear for meshes with bounded vertex degree; 16 bytes per side.
template <class Visit>
void for_each_edge(const TriangleMesh& mesh, Visit visit) {
  std::vector<std::uint32_t> first(mesh.vertices.size() + 1, 0);
  const auto for_each_side = [&](auto use) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& t = mesh.triangles[i];
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      for (std::uint8_t side = 0; side < 3; ++side) {
        const auto from = t[side];
        const auto to = t[(side + 1) % 3];
        use(std::min(from, to),
            MeshEdge{std::max(from, to), static_cast<std::uint32_t>(i), side, from < to});
      }
    }
  };
  for_each_side([&](std::uint32_t vertex, const MeshEdge&) { ++first[vertex + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<MeshEdge> edges(first.back());
  auto next = first;
  for_each_side([&](std::uint32_t vertex, const MeshEdge& edge) { edges[next[vertex]++] = edge; });
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    MeshEdge* begin = edges.data() + first[v];
    MeshEdge* const end = edges.data() + first[v + 1];
    std::sort(begin, end, [](const MeshEdge& x, const MeshEdge& y) {
      return x.other != y.other         ? x.other < y.other
             : x.triangle != y.triangle ? x.triangle < y.triangle
                                        : x.side < y.side;
    });
    while (begin != end) {
      MeshEdge* run = begin;
      while (run != end && run->other == begin->other) ++run;
      visit(static_cast<const MeshEdge*>(begin), static_cast<const MeshEdge*>(run));
      begin = run;
    }
  }
}

}  // namespace smoothpost
