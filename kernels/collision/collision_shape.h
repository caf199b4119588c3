#pragma once

#include <memory>
#include <vector>

#include "kernels/collision/convex_shape.h"
#include "kernels/core/body.h"
#include "kernels/core/result.h"
#include "kernels/geometry/triangle_tree.h"

namespace smoothpost {

/// The triangles of a mesh as a body.
///
/// The body is the triangles with area (TriangleTree leaves the others out) and, when the tree is
/// solid(), what they enclose, whichever way round the whole mesh is wound. Of a mesh with an edge
/// that does not belong to two triangles wound against each other only the triangles count: nothing
/// tells its inside.
struct MeshShape {
  std::shared_ptr<const TriangleTree> tree;
  std::vector<Vec3> seeds;  ///< a vertex of every connected piece, mm
};

/// A body for collision checks: convex, or a mesh. Cheap to copy.
class CollisionShape {
 public:
  CollisionShape(ConvexShape convex);  // NOLINT(google-explicit-constructor)
  CollisionShape(MeshShape mesh);      // NOLINT(google-explicit-constructor)

  /// One of the two is not null.
  const ConvexShape* convex() const { return convex_.get(); }
  const MeshShape* mesh() const { return mesh_.get(); }
  /// Balls whose convex hull contains the body.
  const std::vector<Ball>& balls() const { return convex_ ? convex_->balls() : mesh_balls_; }

 private:
  std::shared_ptr<const ConvexShape> convex_;
  std::shared_ptr<const MeshShape> mesh_;
  std::vector<Ball> mesh_balls_;
};

/// A mesh with a tree that is there already.
/// @pre the tree is of this mesh, not null   @throws ContractViolation if it has other triangles.
MeshShape mesh_shape(std::shared_ptr<const TriangleTree> tree, const TriangleMesh& mesh);

/// A mesh with its tree.   @return RG101, RG102 as build_triangle_tree()
Result<MeshShape> mesh_shape(const TriangleMesh& mesh);

/// The shape of a machine's body, mm in M with every joint at 0.
/// @return of a mesh RG101, RG102 as build_triangle_tree()
/// @pre as the constructors of ConvexShape; a mesh is loaded   @throws ContractViolation if not.
Result<CollisionShape> shape_of(const Body& body);

}  // namespace smoothpost
