#pragma once

#include <optional>
#include <vector>

#include "kernels/qp/qp_solver.h"
#include "kernels/spline/bspline_basis.h"

namespace smoothpost {

/// Values that splines have to pass nearby, each at its own parameter.
struct NearFitProblem {
  SplineKnots knots;          ///< quintic, clamped
  std::vector<double> u;      ///< ascending, from the first knot to the last
  Eigen::MatrixXd values;     ///< channels × places
  Eigen::VectorXd tolerance;  ///< one a channel, > 0: largest |distance| at each place
  /// First three derivatives by u that the curves have at an end (channels × 3); nothing: free.
  std::optional<Eigen::MatrixXd> start, end;
  std::vector<std::size_t> exact;  ///< places where the tolerance is 0, besides both ends
  bool hybrid = true;              ///< the last word is Ipopt's
  QpSettings solver;
  bool explain = true;  ///< find the place of a failure: one more programme
};

struct NearFit {
  SplineCurve curve;                  ///< one component a channel
  std::vector<QpSolution> solutions;  ///< of the channels
  /// A channel without a solution: the knots are too far apart for the values. Else −1.
  int failed = -1;
  double place = 0.0;  ///< u where it fails most, with `explain`
};

/// The smoothest curves near given values: per channel
///   minimise ∫ (C''')² du   with |C(u_i) − v_i| ≤ tolerance, exact at both ends.
/// Rounded coordinates have third differences far above those of the path they stand for; this is
/// where they are taken out, inside a tolerance that the certificate counts.
/// Guarantees (tests): every value within its tolerance; ends exact, with the derivatives asked
/// for; values of a parabola give the parabola.
/// Cost: one programme of one channel each, linear in pieces and places; unit spans serve best.
/// @throws ContractViolation when sizes differ or a tolerance is not above 0.
NearFit fit_near(const NearFitProblem& problem);

}  // namespace smoothpost
