#pragma once

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
  double steepest = 0.0;  ///< rad
};

/// Parts a sampled contour at corners and where its wall is too flat. Next to a corner a piece goes
/// on to the corner itself. `samples`: one at start, start + spacing … once round or to the end; of
/// a closed contour the last is the first again. What is left out is added to `left_out`, mm.
std::vector<ContourPiece> split_contour(const SampledContour& contour,
                                        std::vector<SurfacePoint> samples, double& left_out);

/// The samples with quarters of circles of `radius` before and behind them, in the plane of
/// direction and normal, tangent to the contour, with the normal of the end that they lead to.
/// @pre at least two samples
std::vector<SurfacePoint> with_leads(const std::vector<SurfacePoint>& samples, double radius,
                                     double spacing);

}  // namespace smoothpost
