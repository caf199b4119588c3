#pragma once

#include <cstddef>
#include <vector>

#include "kernels/geometry/oriented_surface.h"
#include "kernels/geometry/slicing.h"
#include "kernels/geometry/triangle_tree.h"

namespace smoothpost {

/// Turns over the connected sets of triangles of a surface whose contours say so.
///
/// Which side of a closed contour the body is on follows from the contours around it
/// (slice_surface()); a set of triangles connected through sides, most of whose length of closed
/// contours is against its winding, is wound inside out. Sets without a closed contour stay.
/// Returns how many triangles were turned; `tree`, of surface.mesh, and the contours' against_mesh
/// are then those of before.
/// Guarantees (tests): a box inside out is turned, one beside it and a hole's wall are not.
/// Cost: linear, and a query a contour.   @pre `layers` of this surface
std::size_t turn_outwards(OrientedSurface& surface, const TriangleTree& tree,
                          const std::vector<SliceLayer>& layers);

}  // namespace smoothpost
