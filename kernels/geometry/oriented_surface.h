#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/core/mesh.h"

namespace smoothpost {

/// A mesh as a surface: triangles wound alike wherever they hang together, every side with at most
/// one neighbour, every vertex the middle of one fan. Places where the input is no surface are cut
/// open there, not repaired: vertices are doubled, sides have no neighbour.
struct OrientedSurface {
  static constexpr std::uint32_t kNone = 0xffffffffU;

  TriangleMesh mesh;                    ///< vertices in mm
  std::vector<std::uint32_t> triangle;  ///< of the input, one a triangle
  /// Across the side from corner k to corner k + 1; kNone: the side is open.
  std::vector<std::array<std::uint32_t, 3>> neighbour;

  std::size_t dropped = 0;     ///< triangles with two equal vertices, and doubled ones
  std::size_t turned = 0;      ///< triangles that are wound the other way than in the input
  std::size_t open_sides = 0;  ///< without a neighbour
};

/// The surface that a welded mesh is.
///
/// Sides of an edge with two triangles are neighbours. At an edge of more, sides are sorted by
/// angle about it, and one that has its body behind it is joined with the next one through that
/// body: two bodies that touch in an edge stay two bodies. Of triangles over the same three
/// vertices equal ones are kept once, and opposite ones (two bodies that touch in a face) not at
/// all. The winding of each connected set is that of most of its area; sides that then still run
/// alike (a Möbius band) are open.
///
/// Guarantees (tests): no edge of the result has more than two sides; neighbours are mutual and
///   wound against each other; a closed, consistent mesh is passed unchanged.
/// Units: mm.   Cost: n log n, about 0.6 µs a triangle; deterministic, one thread.
/// @pre vertex indices in range, coordinates finite   @throws ContractViolation if not.
OrientedSurface orient_surface(const TriangleMesh& mesh);

}  // namespace smoothpost
