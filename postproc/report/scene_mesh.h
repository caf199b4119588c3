#pragma once

#include <cstddef>

#include "kernels/core/body.h"
#include "kernels/core/mesh.h"

// Triangles for a drawing.
namespace smoothpost {

/// The mesh with at most about `most` triangles: vertices in one cell of a grid become their mean,
/// the grid as fine as that allows; triangles that collapse are left out. A mesh that is small
/// enough stays as it is. Deterministic. Cost: linear, at most 24 times.
TriangleMesh decimated(const TriangleMesh& mesh, std::size_t most);

/// The surface of a collision shape, in M with every joint at 0; round ones with 24 sides, a hull
/// of more than 64 points as its box. Empty where a mesh was not loaded.
TriangleMesh surface_of(const Body& body);

}  // namespace smoothpost
