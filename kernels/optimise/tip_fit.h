#pragma once

#include <vector>

#include "kernels/qp/qp_solver.h"
#include "kernels/spline/bspline_basis.h"

namespace smoothpost {

/// Points that a curve has to pass nearby, each at its own parameter.
struct TipFitProblem {
  SplineKnots knots;         ///< quintic, clamped
  std::vector<double> u;     ///< ascending, from the first knot to the last
  std::vector<Vec3> points;  ///< mm, one a parameter
  double tolerance = 0.0;    ///< mm, > 0: largest distance at each parameter
  bool hybrid = true;        ///< the last word is Ipopt's
  QpSettings solver;
  bool explain = true;  ///< find the place of a failure: one more programme
};

struct TipFit {
  SplineCurve curve;                  ///< 3 components
  std::vector<QpSolution> solutions;  ///< of the three coordinates
  /// A coordinate without a solution: the knots are too far apart for the points. Else −1.
  int failed = -1;
  double place = 0.0;  ///< u where it fails most, with `explain`
};

/// The smoothest curve near given points: per coordinate
///   minimise ∫ (C''')² du   with |C(u_i) − P_i| ≤ tolerance/√3, exact at both ends.
/// Rounded coordinates have third differences far above those of the path they stand for; this is
/// where they are taken out, inside a tolerance that the certificate counts.
/// Guarantees (tests): every point within the tolerance; ends exact; points of a parabola give the
/// parabola; rounding to 1 µm and 5 µm leaves no trace in the third derivative.
/// Cost: three programmes of one channel, linear in pieces and points.
/// Not in the paper (it interpolates: [Ding2025] Eq. (50)-(52), which is singular on uniform
/// knots).
TipFit fit_tip(const TipFitProblem& problem);

}  // namespace smoothpost
