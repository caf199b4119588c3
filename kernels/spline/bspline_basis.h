#pragma once

#include <vector>

#include "kernels/core/pose.h"

namespace smoothpost {

inline constexpr int kMaxSplineDegree = 7;

/// Knots u_0 ≤ … ≤ u_{n+k+1} of a B-spline of degree k with n + 1 control points. Only knots that
/// are clamped (the first and the last k + 1 of them equal) define a spline on the whole of
/// [u_0, u_{n+k+1}]; every function here asks for that.
struct SplineKnots {
  int degree = 5;
  std::vector<double> values;

  int controls() const { return static_cast<int>(values.size()) - degree - 1; }
  /// Pieces between knots; exact when the inner knots are simple.
  int spans() const { return controls() - degree; }
  double first() const { return values.front(); }
  double last() const { return values.back(); }
};

/// Clamped knots with unit spans: 0 (k + 1 times), 1, …, spans − 1, spans (k + 1 times).
/// @pre 1 ≤ degree ≤ kMaxSplineDegree, spans ≥ 1   @throws ContractViolation if not.
SplineKnots clamped_knots(int degree, int spans);

/// The knots of the derivative of that order: the first and last `order` knots taken away.
/// @pre 0 ≤ order ≤ degree
SplineKnots derivative_knots(const SplineKnots& knots, int order);

/// What the control points first … first + k of a spline weigh at one place.
struct BasisRow {
  int first = 0;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxSplineDegree + 1, 1> weights;
};

/// The index of the piece that holds u: knots u_{k+i} ≤ u < u_{k+i+1}, at the end the last piece.
/// Its control points are i … i + k.   Cost: log n; O(1) on unit spans.
/// @pre knots clamped, u inside   @throws ContractViolation if not.
int knot_span(const SplineKnots& knots, double u);

/// The k + 1 basis functions that are not 0 at u, or their derivatives by u.
///
/// Definition (Cox-de Boor): N_{i,0}(u) = 1 on [u_i, u_{i+1}), else 0, and
///   N_{i,r}(u) = (u − u_i)/(u_{i+r} − u_i)·N_{i,r−1}(u)
///              + (u_{i+r+1} − u)/(u_{i+r+1} − u_{i+1})·N_{i+1,r−1}(u),   0/0 := 0.
/// Guarantees (tests): partition of unity, not negative, derivatives equal central differences and
/// sum to 0, golden values; continuous to order k − 1 at simple knots (a quintic spline is C⁴, not
/// only C³ as the paper says).
/// Cost: k² operations, no allocation.   @pre as knot_span(), 0 ≤ order ≤ k
/// Implements [Ding2025] Eq. (4)-(6).
BasisRow bspline_basis(const SplineKnots& knots, double u, int order = 0);

/// Value of a spline, or its derivative of that order, at u.   @pre controls.size() fits the knots
double bspline_value(const SplineKnots& knots, const Eigen::VectorXd& controls, double u,
                     int order = 0);

/// The steps h^l_j = (u_{j+k+1} − u_{j+l})/(k − l + 1), j = 0 … n − l, of derivative `level` = l ≥
/// 1:
///   T^l_j = (T^{l−1}_{j+1} − T^{l−1}_j)/h^l_j.
/// Implements [Ding2025] Eq. (12), (24)-(26). Differences from the paper: Eq. (12) prints
/// u_{j+k+1} − u_{j+1} for every l, which makes the third derivative 0.48 times the true one even
/// on uniform knots; (24)-(26) hold on uniform knots only; there are n + 1 − l control points, not
/// n − k and fewer (test: derivative control points are those of the derivative).
std::vector<double> derivative_steps(const SplineKnots& knots, int level);

/// Control points T^l of the derivative of order `order`; order 0: the same.
Eigen::VectorXd derivative_controls(const SplineKnots& knots, const Eigen::VectorXd& controls,
                                    int order);

/// A vector of splines on the same knots: row c of `controls` is component c.
struct SplineCurve {
  SplineKnots knots;
  Eigen::MatrixXd controls;

  /// Value (order 0) or derivative by u of every component.   @pre as bspline_basis()
  Eigen::VectorXd at(double u, int order = 0) const;
};

/// Weights at u of the variables of piece i in the lifted form of a spline: with L = `levels` the
/// k + 1 numbers
///   T^0_i, T^1_i, …, T^{L−1}_i, T^L_i, …, T^L_{i+k−L}
/// determine the piece as its k + 1 control points do; every weight is not negative for order 0.
/// Guarantee (test): equals bspline_basis on the control points.   Cost: k·L, no allocation.
/// @pre as bspline_basis(), 0 ≤ levels ≤ k, order ≤ k
BasisRow lifted_basis(const SplineKnots& knots, double u, int order, int levels);

}  // namespace smoothpost
