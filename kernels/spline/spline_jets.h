#pragma once

#include <algorithm>
#include <vector>

#include "kernels/core/contract.h"
#include "kernels/spline/bspline_basis.h"

namespace smoothpost {

/// A quintic B-spline curve of N components as the polynomials of its pieces: for places that are
/// asked for very often.
///
/// Guarantee (test): value and derivatives of SplineCurve::at to round-off.
/// Cost: making it 1 µs a piece and component; jet() about 30 ns for N = 3, no allocation.
template <int N>
class SplineJets {
 public:
  /// Column r is the r-th derivative.
  using Jets = Eigen::Matrix<double, N, 4>;

  SplineJets() = default;
  /// @pre degree 5, clamped knots with simple inner ones, N components
  /// @throws ContractViolation if the degree or the components are others.
  explicit SplineJets(const SplineCurve& curve) {
    require(curve.knots.degree == 5 && curve.controls.rows() == N, "a quintic of N components");
    const std::vector<double>& knots = curve.knots.values;
    start_.assign(knots.begin() + 5, knots.end() - 6);
    end_ = curve.knots.last();
    constexpr double kFactorial[] = {1, 1, 2, 6, 24, 120};
    for (const double u : start_) {
      Piece piece;
      for (int order = 0; order < 6; ++order)
        piece.col(order) = curve.at(u, order) / kFactorial[order];
      pieces_.push_back(piece);
    }
  }

  double last() const { return end_; }

  /// Value and derivatives by u at u, which is clamped to the curve's range, times scale^−r: those
  /// by scale·u.
  Jets jet(double u, double scale = 1.0) const {
    u = std::clamp(u, start_.front(), end_);
    const auto next = std::upper_bound(start_.begin(), start_.end(), u);
    const auto i = static_cast<std::size_t>(next - start_.begin() - 1);
    const Piece& c = pieces_[i];
    const double x = u - start_[i];
    Jets out;
    out.col(0) =
        ((((c.col(5) * x + c.col(4)) * x + c.col(3)) * x + c.col(2)) * x + c.col(1)) * x + c.col(0);
    const double a = 1.0 / scale;
    out.col(1) =
        a * ((((5 * c.col(5) * x + 4 * c.col(4)) * x + 3 * c.col(3)) * x + 2 * c.col(2)) * x +
             c.col(1));
    out.col(2) =
        a * a * (((20 * c.col(5) * x + 12 * c.col(4)) * x + 6 * c.col(3)) * x + 2 * c.col(2));
    out.col(3) = a * a * a * ((60 * c.col(5) * x + 24 * c.col(4)) * x + 6 * c.col(3));
    return out;
  }

 private:
  using Piece = Eigen::Matrix<double, N, 6>;
  std::vector<double> start_;
  std::vector<Piece> pieces_;
  double end_ = 0.0;
};

}  // namespace smoothpost
