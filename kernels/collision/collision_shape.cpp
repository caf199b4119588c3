#include "kernels/collision/collision_shape.h"

#include <numeric>
#include <utility>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

/// A vertex of every set of triangles that hang together through vertices, in the order of the
/// triangles.
std::vector<Vec3> seeds_of(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 1; k < 3; ++k) parent[root(t[k])] = root(t[0]);
  std::vector<Vec3> seeds;
  std::vector<char> seen(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles) {
    char& known = seen[root(t[0])];
    if (!known) seeds.push_back(mesh.vertices[t[0]]);
    known = 1;
  }
  return seeds;
}

}  // namespace

CollisionShape::CollisionShape(ConvexShape convex)
    : convex_(std::make_shared<const ConvexShape>(std::move(convex))) {}

CollisionShape::CollisionShape(MeshShape mesh)
    : mesh_(std::make_shared<const MeshShape>(std::move(mesh))) {
  const TriangleTree* tree = mesh_->tree.get();
  require(tree != nullptr, "a mesh has its tree");
  for (int i = 0; i < 8; ++i)
    mesh_balls_.push_back(
        {Vec3((i & 1 ? tree->max() : tree->min()).x(), (i & 2 ? tree->max() : tree->min()).y(),
              (i & 4 ? tree->max() : tree->min()).z()),
         0.0});
}

MeshShape mesh_shape(std::shared_ptr<const TriangleTree> tree, const TriangleMesh& mesh) {
  require(tree != nullptr, "a mesh has its tree");
  require(tree->size() <= mesh.triangles.size(), "the tree of this mesh");
  return {std::move(tree), seeds_of(mesh)};
}

Result<MeshShape> mesh_shape(const TriangleMesh& mesh) {
  auto tree = build_triangle_tree(mesh);
  if (!tree.ok()) return Result<MeshShape>::failure(tree.diagnostics());
  return mesh_shape(std::make_shared<const TriangleTree>(std::move(tree.value())), mesh);
}

Result<CollisionShape> shape_of(const Body& body) {
  switch (body.shape) {
    case BodyShape::frustum:
    case BodyShape::cylinder:
      return CollisionShape(ConvexShape::frustum({.from = body.from,
                                                  .to = body.to,
                                                  .radius_from = body.radius_from,
                                                  .radius_to = body.radius_to}));
    case BodyShape::capsule:
      return CollisionShape(ConvexShape::capsule(body.from, body.to, body.radius_from));
    case BodyShape::box:
      return CollisionShape(ConvexShape::box(body.from, body.to));
    case BodyShape::hull:
      return CollisionShape(ConvexShape::hull(body.points));
    case BodyShape::mesh:
      break;
  }
  require(body.mesh != nullptr, "a mesh is loaded");
  auto mesh = mesh_shape(*body.mesh);
  if (!mesh.ok()) return Result<CollisionShape>::failure(mesh.diagnostics());
  return CollisionShape(std::move(mesh.value()));
}

}  // namespace smoothpost
