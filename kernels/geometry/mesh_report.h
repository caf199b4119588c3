#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "kernels/core/diagnostic.h"
#include "kernels/core/mesh.h"
#include "kernels/geometry/weld.h"

// What a mesh is as a surface: its boundaries, which of its components are wound inside out, where
// it passes through itself. What it is made of is MeshReport (weld.h). Nothing is repaired.
namespace smoothpost {

/// Edges of one triangle each that are connected through vertices: the rim of a hole, or of a
/// sheet. Rims that meet in a vertex are one boundary.
struct MeshBoundary {
  std::size_t edges = 0;
  double perimeter = 0.0;      ///< mm
  Vec3 centre = Vec3::Zero();  ///< of its bounding box, mm
  std::size_t triangle = 0;    ///< the first triangle with such an edge
};

struct SurfaceReport {
  static constexpr std::size_t kNamed = MeshFinding::kNamed;

  std::size_t boundaries = 0;
  std::vector<MeshBoundary> longest_boundaries;  ///< at most kNamed, longest perimeter first

  /// Sets of triangles connected through edges.
  std::size_t components = 0;
  /// Components of which every edge has two triangles, wound with each other: they enclose a volume
  /// and have an outside.
  std::size_t closed_components = 0;
  /// Closed components of negative volume inside an odd number of other closed components: the
  /// walls of cavities, rightly wound.
  std::size_t cavities = 0;
  /// Closed components of negative volume that are no cavities; the first triangle of each.
  MeshFinding inside_out;
  /// Closed components of negative volume that could not be told apart within the budget.
  std::size_t undecided = 0;

  /// Pairs of triangles that pass through each other: see report_surface().
  std::size_t crossings = 0;
  /// The first kNamed of them, lower triangle first, sorted.
  std::vector<std::pair<std::size_t, std::size_t>> crossing_triangles;
  /// False when the budget ran out, so that `crossings` is a lower bound, or when the library was
  /// built without CGAL.
  bool crossings_complete = false;
};

struct SurfaceBudget {
  std::size_t neighbours = 20'000'000;    ///< pairs of triangles whose boxes meet
  std::size_t solid_angles = 50'000'000;  ///< triangles seen from a point, to find cavities
};

/// Boundaries, orientation of components and self-intersections of a mesh.
///
/// Two triangles *cross* when their relative interiors have a point in common: one passes through
/// the other, or they lie in a plane and overlap. Not crossings are therefore neighbours along an
/// edge or vertex, faces and edges that only touch (a box that stands on another, a T-joint), and
/// a surface that passes through another exactly along edges of both. Left out are triangles
/// without area (MeshReport::degenerate) and pairs with the same three vertices
/// (MeshReport::duplicate).
///
/// Guarantees: crossings by exact predicates (CGAL), the same as by integer separating axes on
///   lattices; every boundary edge is one of MeshReport::open; the same report on any number of
///   threads.
/// Units: mm.   Cost: n log n and the pairs of neighbours, about 6 µs a triangle (2.1 s for 330,000
///   triangles with 100,000 non-manifold edges); never more than `budget` allows. One thread.
/// @pre vertex indices in range, coordinates finite   @throws ContractViolation if not.
///
/// Implements [Guigue2003] §3 (docs/references.bib) for the crossing of two triangles.
/// Differences from the paper: touching is no crossing, so ≤ becomes < in its two last tests, and
///   triangles in a plane are compared by separating edges.
SurfaceReport report_surface(const TriangleMesh& mesh, const SurfaceBudget& budget = {});

/// The findings of a report as STL127..STL129: counts and first triangles (counted from 1).
Diagnostics surface_findings(const SurfaceReport& report, const std::string& file_name);

}  // namespace smoothpost
