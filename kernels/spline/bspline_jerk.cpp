#include "kernels/spline/bspline_jerk.h"

#include <algorithm>
#include <cstdlib>

#include "kernels/core/contract.h"
#include "kernels/spline/gauss_rule.h"
#include "kernels/spline/spline_piece.h"

namespace smoothpost {
namespace {

constexpr int kMaxOrder = kMaxSplineDegree + 1;
/// Lower triangle of the Gram matrix of one piece: element (a, b), a ≥ b, at [b·kMaxOrder + a − b].
using PieceGram = std::array<double, kMaxOrder * kMaxOrder>;

PieceGram piece_gram(const SplineKnots& knots, int span, int order) {
  const int k = knots.degree;
  const double length = knots.values[span + k + 1] - knots.values[span + k];
  const GaussRule& rule = gauss_rule(k - order + 1);
  const PieceSlopes slopes = piece_slopes(knots, span, order);
  PieceGram gram{};
  for (int g = 0; g < rule.points; ++g) {
    BasisRow row = piece_basis(knots, span, k - order, length * rule.nodes[g]);
    lower_level(slopes, order, 0, row);
    const double* w = row.weights.data();
    for (int b = 0; b <= k; ++b) {
      const double share = w[b] * length * rule.weights[g];
      for (int a = b; a <= k; ++a) gram[b * kMaxOrder + a - b] += share * w[a];
    }
  }
  return gram;
}

bool is_unit_spaced(const SplineKnots& knots) {
  const int k = knots.degree;
  const int spans = knots.spans();
  if (spans < 1) return false;
  const double* u = knots.values.data();
  for (int i = 0; i <= k; ++i)
    if (u[i] != 0.0 || u[spans + k + i] != spans) return false;
  for (int i = 1; i < spans; ++i)
    if (u[k + i] != i) return false;
  return true;
}

// Columns of the jerk matrix of unit spans: those before the first inner knot that is simple, and
// those whose band reaches the clamped end. The rest is the row of the cardinal spline.
constexpr int kHeadColumns = 5;
constexpr int kTailColumns = 10;

}  // namespace

double SymmetricBand::at(int i, int j) const {
  require(std::min(i, j) >= 0 && std::max(i, j) < size(), "SymmetricBand::at: inside");
  const int d = std::abs(i - j);
  return d <= half_width() ? band(d, std::min(i, j)) : 0.0;
}

Eigen::VectorXd SymmetricBand::times(const Eigen::VectorXd& x) const {
  require(x.size() == size(), "SymmetricBand::times: as long as the matrix");
  Eigen::VectorXd y = Eigen::VectorXd::Zero(size());
  for (int j = 0; j < size(); ++j) {
    y[j] += band(0, j) * x[j];
    for (int d = 1; d <= half_width() && j + d < size(); ++d) {
      y[j + d] += band(d, j) * x[j];
      y[j] += band(d, j) * x[j + d];
    }
  }
  return y;
}

SymmetricBand derivative_gram(const SplineKnots& knots, int order) {
  const int k = knots.degree;
  require(order >= 0 && order <= k, "derivative_gram: order between 0 and the degree");
  knot_span(knots, knots.first());  // asks for clamped knots
  SymmetricBand gram{Eigen::MatrixXd::Zero(k + 1, knots.controls())};
  PieceGram piece{};
  for (int span = 0; span < knots.spans(); ++span) {
    if (!(knots.values[span + k] < knots.values[span + k + 1])) continue;
    if (!piece_repeats(knots, span)) piece = piece_gram(knots, span, order);
    for (int b = 0; b <= k; ++b) {
      double* column = gram.band.data() + (span + b) * (k + 1);
      for (int d = 0; b + d <= k; ++d) column[d] += piece[b * kMaxOrder + d];
    }
  }
  return gram;
}

SymmetricBand jerk_gram_unit_spans(const SplineKnots& knots) {
  require(knots.degree == 5, "jerk_gram_unit_spans: degree 5");
  require(is_unit_spaced(knots), "jerk_gram_unit_spans: clamped unit spans");
  const int n = knots.controls();
  if (n < kHeadColumns + kTailColumns) return derivative_gram(knots, 3);
  static const SymmetricBand ends =
      derivative_gram(clamped_knots(5, kHeadColumns + kTailColumns - 5), 3);
  static const Eigen::Matrix<double, 6, 1> cardinal =
      (Eigen::Matrix<double, 6, 1>() << 23.0 / 5, -11.0 / 4, 0, 5.0 / 8, -1.0 / 6, -1.0 / 120)
          .finished();
  SymmetricBand gram;
  gram.band.resize(6, n);
  gram.band.leftCols<kHeadColumns>() = ends.band.leftCols<kHeadColumns>();
  for (int j = kHeadColumns; j < n - kTailColumns; ++j) gram.band.col(j) = cardinal;
  gram.band.rightCols<kTailColumns>() = ends.band.rightCols<kTailColumns>();
  return gram;
}

}  // namespace smoothpost
