#pragma once

#include <cstdint>
#include <optional>

#include "kernels/collision/collision_shape.h"

// Least margins between a body and a mesh: branch and bound over the mesh's tree.
namespace smoothpost {

/// Mesh points nearer to `centre` than `radius` are not asked to keep a distance.
struct ExemptBall {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;
};

/// What is asked of a body and a mesh.
///
/// The margin of a mesh point x from a body C is
///   dist(x, C) − clearance                                        without an exempt ball,
///   max(dist(x, C) − clearance, exempt.radius − |x − centre|)     with one;
/// that of the mesh is the least one of its points.
struct MarginQuery {
  double clearance = 0.0;                           ///< mm
  std::optional<ExemptBall> exempt = std::nullopt;  ///< in the mesh's frame
  double want = 0.0;  ///< margins from here on are all the same to the caller
  /// The caller decides whether the margin is below 0, and whether it is at least `need`: any
  /// negative margin will do, and of one above `need` half of it, or `need`.
  bool decide = false;
  double need = 0.0;
  /// A triangle that may be near; changes no answer.
  std::optional<std::uint32_t> hint = std::nullopt;
};

/// lower ≤ least margin ≤ upper. Where no margin below `want` was found there is no witness, upper
/// = want, and lower = want too. Otherwise `upper` is the witness' margin, and upper − lower is at
/// most kMarginTolerance, with an exempt ball exempt_tolerance(upper). With `decide` less is
/// promised: lower ≥ min(max(need, upper/2), upper − kExemptTolerance) when upper ≥ need, and
/// nothing of lower when upper < 0.
struct MarginBounds {
  double lower = 0.0;
  double upper = 0.0;
  bool found = false;
  double distance = 0.0;  ///< of the witness from the body, ≥ 0
  Vec3 on_body = Vec3::Zero();
  Vec3 on_mesh = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< unit, from the mesh to the body
  std::uint32_t triangle = 0;   ///< of the mesh
};

inline constexpr double kMarginTolerance = 1e-6;  ///< mm
inline constexpr double kExemptTolerance = 2e-3;  ///< mm
/// max(kExemptTolerance, 5 %), mm: what is left undecided where the exempt ball's surface matters.
double exempt_tolerance(double margin);

/// Least margin of a mesh from a convex body; all in the mesh's frame.
///
/// A part of the tree is left out when its box is behind a plane that separates it from the body by
/// what is wanted; a triangle when its corners are; what remains is measured by convex_distance().
/// A triangle that the ball's surface cuts is halved until linear bounds of both terms of the
/// margin over a piece decide.
///
/// Guarantees (tests): the definition, against every triangle by another method; without an exempt
/// ball bit by bit the same answer with any hint and any `want` above it. Units: mm.   Cost: 20-60
/// parts of the tree, 1-10 µs; no allocation without an exempt ball.
/// @param pose  X_mesh_body
MarginBounds mesh_margin(const TriangleTree& tree, const ConvexShape& body, const Pose& pose,
                         const MarginQuery& query);

/// The same for a body that is a mesh itself (the triangles of it, not what they enclose).
MarginBounds mesh_margin(const TriangleTree& tree, const TriangleTree& body, const Pose& pose,
                         const MarginQuery& query);

/// Whether a point lies inside of what a solid mesh encloses; false for a mesh that is not solid.
/// @param hint  a triangle that may be near   @pre as TriangleTree::closest()
bool inside(const TriangleTree& tree, const Vec3& point, std::uint32_t hint = 0);

}  // namespace smoothpost
