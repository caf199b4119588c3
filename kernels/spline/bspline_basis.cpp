#include "kernels/spline/bspline_basis.h"

#include <algorithm>

#include "kernels/core/contract.h"
#include "kernels/spline/spline_piece.h"

namespace smoothpost {
namespace {

bool clamped(const SplineKnots& knots) {
  const int k = knots.degree;
  if (k < 0 || k > kMaxSplineDegree || knots.spans() < 1) return false;
  const std::vector<double>& u = knots.values;
  return u.front() == u[k] && u[knots.controls()] == u.back() && u.front() < u.back();
}

double piece_start(const SplineKnots& knots, int span) { return knots.values[span + knots.degree]; }

}  // namespace

SplineKnots clamped_knots(int degree, int spans) {
  require(degree >= 1 && degree <= kMaxSplineDegree, "clamped_knots: degree between 1 and 7");
  require(spans >= 1, "clamped_knots: at least one span");
  SplineKnots knots{degree, std::vector<double>(spans + 2 * degree + 1, 0.0)};
  for (int i = 1; i < spans; ++i) knots.values[degree + i] = i;
  std::fill(knots.values.end() - degree - 1, knots.values.end(), static_cast<double>(spans));
  return knots;
}

SplineKnots derivative_knots(const SplineKnots& knots, int order) {
  require(order >= 0 && order <= knots.degree, "derivative_knots: order between 0 and the degree");
  require(clamped(knots), "derivative_knots: clamped knots");
  return {knots.degree - order, {knots.values.begin() + order, knots.values.end() - order}};
}

int knot_span(const SplineKnots& knots, double u) {
  require(clamped(knots), "knot_span: clamped knots");
  require(u >= knots.first() && u <= knots.last(), "knot_span: u inside the knots");
  const double* inner = knots.values.data() + knots.degree;  // inner[i] starts piece i
  const int spans = knots.spans();
  const double steps = u - inner[0];
  if (steps < spans) {
    const int guess = static_cast<int>(steps);
    if (inner[guess] <= u && u < inner[guess + 1]) return guess;
  }
  if (u == inner[spans])
    return static_cast<int>(std::lower_bound(inner, inner + spans, u) - inner) - 1;
  return static_cast<int>(std::upper_bound(inner, inner + spans, u) - inner) - 1;
}

BasisRow bspline_basis(const SplineKnots& knots, double u, int order) {
  require(order >= 0 && order <= knots.degree, "bspline_basis: order between 0 and the degree");
  const int span = knot_span(knots, u);
  BasisRow row = piece_basis(knots, span, knots.degree - order, u - piece_start(knots, span));
  if (order > 0) lower_level(piece_slopes(knots, span, order), order, 0, row);
  return row;
}

double bspline_value(const SplineKnots& knots, const Eigen::VectorXd& controls, double u,
                     int order) {
  require(controls.size() == knots.controls(), "bspline_value: as many controls as the knots have");
  const BasisRow row = bspline_basis(knots, u, order);
  return row.weights.dot(controls.segment(row.first, row.weights.size()));
}

std::vector<double> derivative_steps(const SplineKnots& knots, int level) {
  require(clamped(knots), "derivative_steps: clamped knots");
  require(level >= 1 && level <= knots.degree, "derivative_steps: level between 1 and the degree");
  std::vector<double> steps(knots.controls() - level);
  for (int j = 0; j < static_cast<int>(steps.size()); ++j)
    steps[j] = derivative_step(knots, level, j);
  return steps;
}

Eigen::VectorXd derivative_controls(const SplineKnots& knots, const Eigen::VectorXd& controls,
                                    int order) {
  require(clamped(knots), "derivative_controls: clamped knots");
  require(controls.size() == knots.controls(), "derivative_controls: as many controls as knots");
  require(order >= 0 && order <= knots.degree,
          "derivative_controls: order between 0 and the degree");
  Eigen::VectorXd t = controls;
  for (int level = 1; level <= order; ++level)
    for (int j = 0; j < knots.controls() - level; ++j)
      t[j] = (t[j + 1] - t[j]) / derivative_step(knots, level, j);
  t.conservativeResize(knots.controls() - order);
  return t;
}

Eigen::VectorXd SplineCurve::at(double u, int order) const {
  require(controls.cols() == knots.controls(), "SplineCurve::at: as many controls as the knots");
  const BasisRow row = bspline_basis(knots, u, order);
  return controls.middleCols(row.first, row.weights.size()) * row.weights;
}

BasisRow lifted_basis(const SplineKnots& knots, double u, int order, int levels) {
  const int k = knots.degree;
  require(order >= 0 && order <= k, "lifted_basis: order between 0 and the degree");
  require(levels >= 0 && levels <= k, "lifted_basis: levels between 0 and the degree");
  const int span = knot_span(knots, u);
  return piece_lifted(knots, span, u - piece_start(knots, span), order, levels);
}

}  // namespace smoothpost
