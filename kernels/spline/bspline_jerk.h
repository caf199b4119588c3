#pragma once

#include <Eigen/Core>

#include "kernels/spline/bspline_basis.h"

namespace smoothpost {

/// A symmetric band matrix: band(d, j) is the element (j + d, j), d = 0 … half_width.
struct SymmetricBand {
  Eigen::MatrixXd band;  ///< (half_width + 1) × size

  int size() const { return static_cast<int>(band.cols()); }
  int half_width() const { return static_cast<int>(band.rows()) - 1; }
  double at(int i, int j) const;
  Eigen::VectorXd times(const Eigen::VectorXd& x) const;
};

/// Gram matrix of the derivatives of that order: G_ij = ∫ N_i⁽ʳ⁾ N_j⁽ʳ⁾ du over the whole spline,
/// by Gauss quadrature that is exact for its degree (k − r + 1 points a piece). Half width k.
/// Guarantees (tests): golden H of clamped knots on [0, 1] and on unit spans, exact rationals of
/// the interior row (23/5, −11/4, 0, 5/8, −1/6, −1/120); every polynomial of degree below r in its
/// null space; equals D_rᵀ·Gram·D_r.
/// Units: (unit of u)^(1−2r). Use unit spans: in u ∈ [0, 1] the numbers are spans⁵ times larger.
/// Cost: linear, (k + 1)² (k − r + 1) operations a piece.
/// Implements [Ding2025] Eq. (13)-(19) for r = 3.
SymmetricBand derivative_gram(const SplineKnots& knots, int order);

/// derivative_gram(knots, 3) of clamped unit spans without quadrature where the matrix is Toeplitz:
/// only the rows near the ends are integrated.   Guarantee (test): equals derivative_gram to 1e-13.
/// Cost: writing 6 numbers a control point.   @pre degree 5, knots of clamped_knots()
SymmetricBand jerk_gram_unit_spans(const SplineKnots& knots);

}  // namespace smoothpost
