#pragma once

#include <cstddef>

#include "kernels/geometry/oriented_surface.h"
#include "kernels/geometry/surface_normal.h"

namespace smoothpost {

struct RefineSettings {
  double tolerance = 0.01;  ///< mm, that a side may be off the surface in its middle
  int most_levels = 5;      ///< halvings of a side, at most
  std::size_t most_triangles = 2'000'000;
};

/// A surface whose triangles follow the surface that the mesh stands for more closely.
///
/// Sides whose middle is farther than `tolerance` from the quadrics of SurfaceNormals at both of
/// its triangles are halved, level by level, and the middle moves there by the shortest d with
/// nᵢ·d = the distance from the quadric of side i, nᵢ its normal: so at an edge it stays on both
/// surfaces. Where no quadric is trusted (planes, scans without a noise) the middle stays. Vertices
/// of the input do not move; no side of two triangles is opened.
/// Stops early at most_triangles.
///
/// Guarantees (tests): a cylinder of 10° facets comes within the tolerance of the cylinder, its
/// rims too; a box is passed unchanged.
/// Result: `triangle` as in the input: triangles of the file that it came from.
/// Units: mm.   Cost: 15 µs a side that may be off.   @pre `normals` of `surface`, tolerance > 0
/// @throws ContractViolation if not.
OrientedSurface refine_surface(const OrientedSurface& surface, const SurfaceNormals& normals,
                               const RefineSettings& settings);

}  // namespace smoothpost
