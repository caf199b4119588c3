#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "kernels/core/diagnostic.h"
#include "kernels/core/mesh.h"

namespace smoothpost {

/// Joins the corners of a triangle soup that are equal bit by bit (−0 counts as 0) into vertices.
///
/// Guarantees: vertices in order of first appearance; triangle i has the corners 3i, 3i+1, 3i+2; no
///   triangle is dropped, turned or moved; the same soup gives the same mesh.
/// Units: mm in, mm out.   Cost: linear (open addressing), about 0.1 s per million triangles.
/// @param corners  three per triangle, mm
/// @pre corners.size() is a multiple of 3, below 2³² − 1, every coordinate finite.
/// @throws ContractViolation if not.
TriangleMesh weld(const std::vector<Vec3>& corners);

/// How many there are of a kind of defect, and where the first ones are.
struct MeshFinding {
  std::size_t count = 0;
  std::vector<std::size_t> triangles;  ///< a triangle of each of the first kNamed findings
  static constexpr std::size_t kNamed = 5;
};

/// What a welded mesh is made of; nothing is repaired.
struct MeshReport {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  /// Triangles without area: two equal vertices, or a height below the resolution of single
  /// precision (2⁻²³ of the triangle's largest coordinate). They are kept out of the triangle tree.
  MeshFinding degenerate;
  MeshFinding duplicate;       ///< triangles with the same three vertices as an earlier one
  MeshFinding non_manifold;    ///< edges of more than two triangles
  MeshFinding open;            ///< edges of one triangle
  MeshFinding inconsistent;    ///< edges whose two triangles are wound against each other
  std::size_t components = 0;  ///< sets of triangles connected through vertices
  Vec3 min = Vec3::Zero();     ///< bounding box of the vertices that triangles use, mm
  Vec3 max = Vec3::Zero();
  double area = 0.0;  ///< mm²
  /// ⅙ Σ a·(b×c) about the box's centre, mm³; negative for a closed mesh turned inside out. Without
  /// meaning when the mesh is open.
  double signed_volume = 0.0;

  /// Every edge has two triangles (triangles with two equal vertices are left out).
  bool closed() const { return triangles > 0 && open.count == 0 && non_manifold.count == 0; }
};

/// Counts what a mesh is made of (see MeshReport).
/// Cost: linear, about 0.15 s per million triangles.   Units: mm.
/// @pre vertex indices in range   @throws ContractViolation if not.
MeshReport describe(const TriangleMesh& mesh);

/// True for a triangle without area as MeshReport::degenerate defines it.
bool has_no_area(const TriangleMesh& mesh, std::size_t triangle);

/// The findings of a report as STL121..STL126: counts and first triangles (counted from 1).
Diagnostics mesh_findings(const MeshReport& report, const std::string& file_name);

}  // namespace smoothpost
