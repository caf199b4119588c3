#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/core/result.h"
#include "kernels/core/tool_path.h"
#include "kernels/geometry/triangle_tree.h"

namespace smoothpost {

/// What is asked of the cutting points. Lengths mm, angles rad.
struct RegistrationSettings {
  double nominal_gap = 0.0;            ///< distance tip to part while cutting
  double allowed_gap_deviation = 0.5;  ///< largest |gap − nominal|
  double allowed_angle = 0.35;         ///< largest angle between tool axis and surface normal
};

/// Why the cutting points lie, or do not lie, on the part.
enum class RegistrationVerdict : std::uint8_t {
  registered,          ///< every gap and every angle is within what is allowed
  outliers,            ///< at least 95 % are within, the others are not
  unit_ratio,          ///< program or part is 25.4 times too large or too small
  offset,              ///< a constant shift brings the gaps within
  mirrored,            ///< a mirror image (about X, Y or Z = 0, or shifted) fits
  reversed_triangles,  ///< a closed part turned inside out
  tilted_axes,         ///< the gaps fit, the tool axes do not follow the surface
  wrong_part           ///< none of these explains the gaps
};

/// Distances and angles of all cutting points against the part, for the program as it is given.
struct GapStatistics {
  std::size_t points = 0;
  double min = 0.0;              ///< mm, signed
  double max = 0.0;              ///< mm, signed
  double mean_deviation = 0.0;   ///< mean |gap − nominal|, mm
  double worst_deviation = 0.0;  ///< largest |gap − nominal|, mm
  std::size_t worst = 0;         ///< its index in the input
  std::size_t within = 0;        ///< points with |gap − nominal| ≤ allowed
  double worst_angle = 0.0;      ///< axis to normal, rad
  double median_angle = 0.0;     ///< rad
  std::size_t worst_angle_point = 0;
  std::size_t angles_within = 0;
  /// The part is an open sheet whose triangles face away from the tool: a sheet has no outside, so
  /// the side that most tool axes point to was taken as the upper one.
  bool sides_exchanged = false;
};

/// Which of the two has the wrong size when the verdict is unit_ratio.
enum class UnitSuspect : std::uint8_t { none, program, part, either };

struct PartRegistration {
  RegistrationVerdict verdict = RegistrationVerdict::wrong_part;
  GapStatistics gap;  ///< of the program as given: the check on every point
  /// The same statistics after the explanation that fits (unit_ratio, offset, mirrored, reversed).
  GapStatistics explained;
  double program_ratio = 1.0;  ///< the program's points must be multiplied by this to fit the part
  UnitSuspect suspect = UnitSuspect::none;
  int mirror_axis = -1;  ///< 0, 1, 2: X, Y, Z change sign before `offset` is added
  /// mm, to be added to the program's points so that they lie on the part.
  Vec3 offset = Vec3::Zero();
  /// Unit directions in which a shift changes no gap (a flat sheet has two, an extruded one one):
  /// `offset` has no component there, and an error of the work offset along them cannot be seen.
  std::vector<Vec3> unseen;
  std::string sentence;  ///< for a person: what is wrong, the numbers, what to do
};

/// Says whether the cutting points of a program lie on a part, and if not, which ordinary mistake
/// explains it.
///
/// gap(p) = signed distance of the tip to the mesh, for a sheet (TriangleTree::open()) on the
/// tool's side; a point fits when |gap − nominal| ≤ allowed_gap_deviation and angle(tool axis,
/// surface normal) ≤ allowed_angle. `registered` asks this of every point. Explanations are tried
/// in the order: unit ratio, mirror about a coordinate plane, reversed triangles, shift, mirror and
/// shift; the first one that brings at least 95 % of ALL points within both limits is named,
/// otherwise wrong_part.
///
/// The shift t solves min Σ ρ(n·(p + t − c) − nominal)² by damped point-to-plane steps (c, n:
/// closest mesh point and its normal; on the mesh's boundary the full vector counts), from t = 0
/// and from a grid over the box of shifts that keep the points' bounding box inside the mesh's.
/// Directions that no normal sees are left at the start's value and listed in `unseen`.
///
/// Guarantees: deterministic; at most 2000 sampled points per hypothesis, every point for the
///   statistics and for the explanation that is named.
/// What cannot be seen: a shift within a flat sheet's plane or along an extruded sheet, a mirror
///   image of a part that is its own, two parts that agree where the program cuts.
/// Units: mm, rad, the frame of mesh and points the same.
/// Cost: one closest-point query a point when registered; a refusal up to about 700,000 more.
/// @pre points not empty, axes of unit length, settings finite and not negative
/// @throws ContractViolation if not.
PartRegistration register_part(const std::vector<CutterLocation>& points, const TriangleTree& tree,
                               const RegistrationSettings& settings);

/// Distances and angles of all points as register_part() judges them, without explanations.
/// @pre as register_part()   @throws ContractViolation if not.
GapStatistics measure_gaps(const std::vector<CutterLocation>& points, const TriangleTree& tree,
                           const RegistrationSettings& settings);

std::string to_string(RegistrationVerdict verdict);

/// The stable code of a refusal: RG111 outliers, RG112 unit_ratio, RG113 offset, RG114 mirrored,
/// RG115 reversed_triangles, RG116 tilted_axes, RG117 wrong_part; empty for registered.
std::string registration_code(RegistrationVerdict verdict);

}  // namespace smoothpost
