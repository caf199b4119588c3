#pragma once

#include <optional>
#include <vector>

#include "kernels/kinematics/joint_jet.h"
#include "kernels/spline/spline_jets.h"
#include "postproc/pipeline/contour_pieces.h"

// One cut of a finishing path: smooth curves along (a part of) a contour.
namespace smoothpost {

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

struct CutTolerances {
  double tip = 0.005;   ///< mm, of the curve against the samples
  double axis = 0.017;  ///< rad, likewise
  double step = 0.25;   ///< mm: pieces are not shorter
};

/// The smoothest quintic splines (fit_tip) within the tolerances of samples, with pieces of 2 mm,
/// or 1, 0.5 … where that is too long. `s` are the samples' places. Nothing: there are none.
/// @pre at least two samples, no two neighbours at one place
std::optional<FinishCut> smooth_cut(const std::vector<SurfacePoint>& samples,
                                    const CutTolerances& tolerances);

}  // namespace smoothpost
