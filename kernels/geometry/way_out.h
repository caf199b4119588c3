#pragma once

#include <optional>

#include "kernels/geometry/triangle_tree.h"

namespace smoothpost {

/// How far it is along a ray from a point in a body to where the ray leaves it, mm.
///
/// A point is in the body when the triangles wind around it more often than not: the sum over the
/// triangles that the ray crosses from there to infinity, +1 where it passes to their outer side,
/// −1 where to their inner, is positive. So a body whose surface passes through itself (an offset
/// that folds) is the union of what it encloses, and is left once. Nothing: `from` is not in the
/// body. Of an open mesh the answer means little: see TriangleTree::solid(). Guarantees (tests):
/// box, sphere and overlapping boxes; through edges and vertices of a mesh. Units: mm.   Cost:
/// about that of TriangleTree::closest.
/// @pre all finite, direction of unit length   @throws ContractViolation if not.
std::optional<double> way_out(const TriangleTree& tree, const Vec3& from, const Vec3& direction);

}  // namespace smoothpost
