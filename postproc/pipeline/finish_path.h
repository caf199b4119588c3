#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "kernels/core/check.h"
#include "kernels/core/mesh.h"
#include "kernels/core/progress.h"
#include "kernels/core/result.h"
#include "kernels/core/tool_path.h"
#include "postproc/pipeline/finish_cut.h"
#include "postproc/pipeline/finish_mill.h"

// From the mesh of a printed part to the tool path that finishes its walls.
namespace smoothpost {

/// Whether the machine can be there.
using ReachTest = std::function<bool(const CutterLocation&)>;

struct FinishSettings {
  double pitch = 1.0;  ///< mm, between layers
  std::optional<double>
      from;  ///< mm, height of the first layer; nothing: half a pitch above the foot
  std::optional<double> to;  ///< mm, no layer above; nothing: the top
  double depth = 0.7;        ///< mm, of the cut: the stock is that much larger all around
  std::optional<double> depth_tolerance;  ///< mm, that it may be off; nothing: a tenth of it
  double feed = 10.0;                     ///< mm/s
  double rpm = 10000.0;
  EndMill mill;
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
  bool outer_only = false;             ///< contours that no other one is around
  double tool_length = 0.0;            ///< mm
  /// Makes a test from the part's stock: places that fail it are left out. Nothing: no test.
  std::function<ReachTest(const TriangleMesh& stock)> reach_with;
};

/// What of contours no cut is made of, mm, by its reason.
struct LeftOut {
  double flat = 0.0;       ///< walls too far from upright
  double buried = 0.0;     ///< inside of another body of the mesh
  double mill = 0.0;       ///< the mill would cut into another wall
  double reach = 0.0;      ///< the machine cannot be there
  double too_short = 0.0;  ///< pieces between edges
  double rough = 0.0;      ///< no smooth curve is near it
};

struct FinishLayer {
  double height = 0.0;  ///< mm
  std::size_t contours = 0, cuts = 0;
  double length = 0.0;  ///< mm, of the contours
  LeftOut left_out;
};

struct FinishPath {
  ToolPath path;  ///< points on the cuts' curves; line i + 1 is point i
  std::vector<FinishCut> cuts;
  std::vector<FinishLayer> layers;
  TriangleMesh stock;  ///< the body to be printed
  Checks checks;       ///< depth_of_cut, contour_deviation, axis_to_normal, mill_room
  std::size_t fitted = 0, samples = 0;  ///< points with a normal of a quadric, and all
};

/// Slices a part and makes the cuts that finish its walls.
///
/// The tool's tip goes along the nominal contours, its axis is the smoothed outward normal; what is
/// printed is the part offset by `depth` (offset_body). Contours are resampled by arc length,
/// points and normals taken from the surface that the mesh stands for (SurfaceNormals; with two
/// rings where the mesh is noisy), split at creases and where the wall is too flat for the machine,
/// and smoothed to C⁴: tip and axis are the smoothest quintic splines (smooth_cut) within their
/// tolerances; a contour that no such curve follows is parted where it turns most. Where a contour
/// is inside of another body of the mesh (buried()), the mill would cut into another wall (a hollow
/// corner), or reach_with() says no, the contour is left out. An arc of `lead` in the plane of
/// contour and normal leads onto the contour and away from it, smaller where the mill has no room
/// for it. A closed contour starts next to where the one before did. A helix goes once round the
/// first layer, then climbs a pitch a turn (its points are those of the surface next to the blend
/// of two contours), and ends with the last layer all round.
///
/// The stock is the offset of the surface that the mesh stands for: of the mesh with its sides
/// halved until they are within a fiftieth of the depth (refine_surface). Where
/// contours say that triangles are wound inside out, they are turned (turn_outwards).
///
/// Checks: depth_of_cut, least, mean and greatest over the contours, measured along the tool axis
/// in the stock (depth_in); contour_deviation and axis_to_normal, what smoothing has changed;
/// mill_room, how far the mill cuts into the part, leads included.
/// Failures: RG132 nothing to finish; RG133 a helix that cannot be smoothed inside its tolerance;
///   RG130, RG131; RG139 a part that no helix goes round. Warnings: RG134 walls left out, RG135
///   stock that folds, RG136 open contours, RG137 triangles that are wound the wrong way, RG140
///   contours that were parted, RG141 the heights at which reach_with() left walls out.
/// Cost: about 50 µs a path point.   Units: mm, rad, the part's own coordinates (W).
Result<FinishPath> make_finish_path(const TriangleMesh& part, const FinishSettings& settings,
                                    const std::string& file_name, const Progress& progress);

}  // namespace smoothpost
