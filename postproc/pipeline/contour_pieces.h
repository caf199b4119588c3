#pragma once

#include <optional>
#include <vector>

#include "kernels/core/units.h"
#include "postproc/pipeline/contour_line.h"

// What of a contour one cut can make.
namespace smoothpost {

/// A place of the part's surface along a contour, with its outward normal.
struct SurfacePoint {
  Vec3 point = Vec3::Zero();    ///< mm
  Vec3 normal = Vec3::UnitX();  ///< unit
  bool on_contour = true;       ///< not of a lead
};

struct ContourPiece {
  std::vector<SurfacePoint> samples;
  bool closed = false;  ///< the last sample is the first again
};

/// Normals of neighbouring samples that differ by more are those of two walls.
inline constexpr double kCornerTurn = 25.0 * kRadiansPerDegree;
/// Shorter pieces are left out, mm.
inline constexpr double kShortestPiece = 1.0;

/// Whether a wall is too far from upright for a tool along its normal: by more than `steepest`
/// (rad).
bool too_flat(const SurfacePoint& point, double steepest);

struct SampledContour {
  const ContourLine& line;
  bool closed = false;
  double start = 0.0;     ///< mm: the place of the first sample
  double spacing = 0.25;  ///< mm
  std::vector<bool> out;  ///< one a sample: not to be cut
};

/// Parts a sampled contour at corners and where samples are out. Next to a corner a piece goes on
/// to the corner itself. `samples`: one at start, start + spacing … once round or to the end; of a
/// closed contour the last is the first again. The length of pieces that are too short is added to
/// `too_short`, mm.
std::vector<ContourPiece> split_contour(const SampledContour& contour,
                                        std::vector<SurfacePoint> samples, double& too_short);

/// A quarter of a circle of `radius` that leads to the first sample (`at_end`: from the last one
/// away), in the plane of direction and normal, tangent to the contour, with that sample's normal;
/// without the sample itself.
/// @pre at least two samples, radius > 0
std::vector<SurfacePoint> lead_of(const std::vector<SurfacePoint>& samples, double radius,
                                  double spacing, bool at_end);

/// The place i at which samples i − 1 and i differ most in normal and direction: where a piece that
/// no smooth curve follows is to be parted. Of a piece of three samples or fewer nothing.
std::optional<std::size_t> sharpest(const std::vector<SurfacePoint>& samples);

}  // namespace smoothpost
