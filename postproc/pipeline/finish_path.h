#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kernels/core/check.h"
#include "kernels/core/mesh.h"
#include "kernels/core/progress.h"
#include "kernels/core/result.h"
#include "kernels/core/tool_path.h"
#include "kernels/kinematics/joint_jet.h"
#include "kernels/spline/spline_jets.h"

// From the mesh of a printed part to the tool path that finishes its walls.
namespace smoothpost {

struct FinishSettings {
  double pitch = 1.0;  ///< mm, between layers
  std::optional<double>
      from;  ///< mm, height of the first layer; nothing: half a pitch above the foot
  std::optional<double> to;  ///< mm, no layer above; nothing: the top
  double depth = 0.7;        ///< mm, of the cut: the stock is that much larger all around
  double feed = 10.0;        ///< mm/s
  double rpm = 10000.0;
  double lead = 3.0;             ///< mm, radius of the arcs that lead in and out
  double overlap = 1.0;          ///< mm, that a closed contour is cut twice
  double step = 0.25;            ///< mm, of arc length, between samples; path points may be closer
  double tip_tolerance = 0.005;  ///< mm, of the smoothed contour against the sampled one
  double axis_tolerance = 0.0174532925199433;  ///< rad (1°), of the tool axis against the normal
  double chord_tip = 0.001;                    ///< mm, of straight motion between path points
  double chord_axis = 8.7e-5;                  ///< rad, of the axis' great circle between them
  double steepest = 1.39626340159546;  ///< rad (80°): walls whose normal is that far from level or
                                       ///< farther are left out
  bool alternate = true;               ///< every second layer runs the other way round
  bool helical = false;                ///< one cut that climbs from layer to layer, once round each
  double tool_length = 0.0;            ///< mm
};

/// One cut: along (a part of) a contour with the arcs that lead in and out, as smooth curves.
struct FinishCut {
  SplineJets<3> tip;   ///< mm, W, over u = s/scale: unit pieces
  SplineJets<3> axis;  ///< to be normalised, likewise
  double scale = 1.0;  ///< mm of s a piece
  int pieces = 0;
  std::vector<double> s;  ///< of the path points, ascending from 0: mm along the sampled contour
  std::size_t first_point = 0;  ///< index of the cut's start in ToolPath::points
  std::size_t layer = 0;
  bool closed = false;
  double turning = 0.0;  ///< rad, that the axis turns about the vertical from start to end
  double length() const { return s.back(); }

  /// Tip and unit tool axis with their derivatives by s.   Cost: 0.1 µs.
  LocationJet location(double place) const;
};

struct FinishLayer {
  double height = 0.0;  ///< mm
  std::size_t contours = 0, cuts = 0;
  double length = 0.0;    ///< mm, of the contours
  double left_out = 0.0;  ///< mm, of them
};

struct FinishPath {
  ToolPath path;  ///< points on the cuts' curves; line i + 1 is point i
  std::vector<FinishCut> cuts;
  std::vector<FinishLayer> layers;
  TriangleMesh stock;                   ///< the body to be printed
  Checks checks;                        ///< depth_of_cut, contour_deviation, axis_to_normal
  std::size_t fitted = 0, samples = 0;  ///< points with a normal of a quadric, and all
};

/// Slices a part and makes the cuts that finish its walls.
///
/// The tool's tip goes along the nominal contours, its axis is the smoothed outward normal; what is
/// printed is the part offset by `depth` (offset_body). Contours are resampled by arc length,
/// points and normals taken from the surface that the mesh stands for (SurfaceNormals; with two
/// rings where the mesh is noisy), split at creases and where the wall is too flat for the machine,
/// and smoothed to C⁴: tip and axis are the smoothest quintic splines (fit_tip) within their
/// tolerances. An arc of `lead` in the plane of contour and normal leads onto the contour and away
/// from it. A closed contour starts next to where the one before did. A helix goes once round the
/// first layer, then climbs a pitch a turn (its points are those of the surface next to the blend
/// of two contours), and ends with the last layer all round.
///
/// Checks: depth_of_cut, least, mean and greatest over the contours, measured in the stock;
/// contour_deviation and axis_to_normal, what smoothing has changed.
/// Failures: RG132 nothing to finish; RG133 a contour that cannot be smoothed inside its tolerance;
///   RG130, RG131; RG139 a part that no helix goes round. Warnings: RG134 walls left out, RG135
///   stock that folds, RG136 open contours, RG137 triangles that are wound the wrong way.
/// Cost: about 30 µs a path point.   Units: mm, rad, the part's own coordinates (W).
Result<FinishPath> make_finish_path(const TriangleMesh& part, const FinishSettings& settings,
                                    const std::string& file_name, const Progress& progress);

}  // namespace smoothpost
