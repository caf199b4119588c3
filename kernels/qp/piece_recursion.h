#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "kernels/qp/quadratic_program.h"

// Internal to kernels/qp.
namespace smoothpost {

/// Σ d_j u_j u_jᵀ with u_j the columns of a unit upper triangle: a positive semidefinite matrix
/// UDUᵀ that only ever grows by positive terms. Entries of very different size keep their digits,
/// as in a Cholesky factor, where the sum itself would keep those of the largest alone.
template <int N>
struct GrowingFactor {
  using Vector = Eigen::Matrix<double, N, 1>;
  Eigen::Matrix<double, N, N> u = Eigen::Matrix<double, N, N>::Identity();
  Vector d = Vector::Zero();

  /// weight·a·aᵀ, a zero behind `last`.
  struct Term {
    double weight = 0.0;  ///< ≥ 0
    std::ptrdiff_t last = N - 1;
    Vector a;
  };

  /// Adds terms, which are used up. Agee and Turner's update: no square roots; the weight left for
  /// the columns before j is weight·d_j/(d_j + weight·a_j²). All terms go through a column before
  /// any goes on to the next: as one after the other to the bit, but a term's divisions do not wait
  /// for those of the one before.
  void add(Term* first, Term* end) { add_columns<N - 1>(first, end); }

 private:
  template <int J>
  void add_columns(Term* first, Term* end) {
    double* column = &u(0, J);
    double dj = d[J];
    double uj[J + 1];
    for (int i = 0; i < J; ++i) uj[i] = column[i];
    for (Term* term = first; term != end; ++term) {
      if (term->last < J) continue;
      double* a = term->a.data();
      const double p = a[J];
      const double share = term->weight * p;
      const double grown = dj + share * p;
      if (p == 0.0 || !(term->weight > 0.0) || grown == 0.0) continue;
      const double inverse = 1.0 / grown;
      const double b = share * inverse;
      term->weight *= dj * inverse;
      dj = grown;
      for (int i = 0; i < J; ++i) {
        a[i] -= p * uj[i];
        uj[i] += b * a[i];
      }
    }
    for (int i = 0; i < J; ++i) column[i] = uj[i];
    d[J] = dj;
    if constexpr (J > 0) add_columns<J - 1>(first, end);
  }
};

/// Linear-quadratic problems along the pieces of a spline programme: minimise
///   Σ_i (½ yᵢᵀ Wᵢ yᵢ + wᵢᵀ yᵢ) + ½ xᵀ W_S x + w_Sᵀ x
/// over the local variables yᵢ = (state, new number of every channel) of each piece and the state x
/// behind the last, subject to the layout's equations. M channels, K = degree + 1.
///
/// Order in y: local variable 0 of every channel, local variable 1 of every channel, …; the last M
/// are the new ones, the others the state. In this order both steps of the recursion are free on
/// the factors UDUᵀ of the costs to go: the layout's equations shift the columns by M and leave
/// them triangular, and the minimum over the new variables drops the last M columns.
template <int M, int K>
class PieceRecursion {
 public:
  static constexpr int kStates = M * (K - 1);
  static constexpr int kLocal = M * K;
  using Local = Eigen::Matrix<double, kLocal, 1>;
  using LocalMatrix = Eigen::Matrix<double, kLocal, kLocal>;
  using State = Eigen::Matrix<double, kStates, 1>;
  using New = Eigen::Matrix<double, M, 1>;
  using Factor = GrowingFactor<kLocal>;

  explicit PieceRecursion(const SplineLayout& layout)
      : levels_(layout.levels), pieces_(static_cast<std::size_t>(layout.spans())) {
    for (int level = 1; level <= levels_; ++level) {
      const std::vector<double> h = derivative_steps(layout.knots, level);
      for (int i = 0; i < layout.spans(); ++i)
        for (int c = 0; c < M; ++c)
          pieces_[static_cast<std::size_t>(i)].step[(level - 1) * M + c] =
              h[static_cast<std::size_t>(i)] * layout.scale(c, level) / layout.scale(c, level - 1);
    }
  }

  int spans() const { return static_cast<int>(pieces_.size()); }

  /// Position in y of local variable p (0 … K − 1) of a channel.
  static constexpr int position(int channel, int p) { return p * M + channel; }

  /// The state behind piece i:   Sy, x_q = y_q + step_q·y_{q+1} below the top level, else y_{q+1}.
  State advance(int i, const Local& y) const {
    const State& step = pieces_[static_cast<std::size_t>(i)].step;
    State next;
    for (int q = 0; q < kStates; ++q)
      next[q] = q < levels_ * M ? y[q] + step[q] * y[q + M] : y[q + M];
    return next;
  }

  /// Sᵀ p for the matrix S of advance().
  Local pull_back(int i, const State& p) const {
    const State& step = pieces_[static_cast<std::size_t>(i)].step;
    Local w;
    w.template tail<M>().setZero();
    for (int q = 0; q < kStates; ++q) w[q] = q < levels_ * M ? p[q] : 0.0;
    for (int q = 0; q < kStates; ++q) w[q + M] += q < levels_ * M ? step[q] * p[q] : p[q];
    return w;
  }

  /// Factors the costs to go. grow(stage, factor) adds the matrix of a stage (spans: the state
  /// behind the last piece, in the first kStates variables) to a factor. `proximal`, > 0, is added
  /// to variables that nothing else may hold.
  template <class Grow>
  void factor(double proximal, const Grow& grow) {
    Factor w;
    w.d.setConstant(proximal);
    grow(spans(), w);
    for (int i = spans() - 1; i >= 0; --i) {
      Piece& piece = pieces_[static_cast<std::size_t>(i)];
      shift(piece.step, w);
      w.d.template head<M>().setConstant(proximal);
      grow(i, w);
      piece.gain = w.u.template rightCols<M>();
      piece.inverse = w.d.template tail<M>().cwiseInverse();
    }
    start_ = w;
  }

  /// The minimiser for linear terms `vector(i)` of the pieces and `end`; calls take(i, y).
  /// @return the state behind the last piece
  template <class VectorOf, class Take>
  State solve(const State& end, const VectorOf& vector, const Take& take) {
    State p = end;
    for (int i = spans() - 1; i >= 0; --i) {
      Piece& piece = pieces_[static_cast<std::size_t>(i)];
      Local w = vector(i) + pull_back(i, p);
      for (int c = M - 1; c >= 0; --c) {
        const double v = w[kStates + c];
        piece.feed[c] = v * piece.inverse[c];
        for (int q = 0; q < kStates + c; ++q) w[q] -= v * piece.gain(q, c);
      }
      p = w.template head<kStates>();
    }
    State x = at_start(p);
    Local y;
    for (int i = 0; i < spans(); ++i) {
      const Piece& piece = pieces_[static_cast<std::size_t>(i)];
      y.template head<kStates>() = x;
      for (int c = 0; c < M; ++c) {
        double sum = piece.feed[c];
        for (int q = 0; q < kStates + c; ++q) sum += piece.gain(q, c) * y[q];
        y[kStates + c] = -sum;
      }
      take(i, y);
      x = advance(i, y);
    }
    return x;
  }

 private:
  struct Piece {
    State step = State::Ones();             ///< of the levels below the top one
    Eigen::Matrix<double, kLocal, M> gain;  ///< the last columns of U
    New inverse, feed;
  };

  // w becomes Sᵀ(w without its last M variables)S.
  void shift(const State& step, Factor& w) const {
    for (int j = kStates - 1; j >= 0; --j) {
      const auto left = [&](int q) { return q < levels_ * M ? step[q] : 1.0; };
      const double scale = 1.0 / left(j);
      double* to = &w.u(0, j + M);
      const double* from = &w.u(0, j);
      to[j + M] = 1.0;
      for (int q = j + M - 1; q >= 0; --q) {
        double value = q >= M ? left(q - M) * from[q - M] : 0.0;
        if (q <= j && q < levels_ * M) value += from[q];
        to[q] = scale * value;
      }
      w.d[j + M] = w.d[j] * left(j) * left(j);
    }
    w.u.template leftCols<M>().setIdentity();
  }

  // −(UDUᵀ)⁻¹ p at the first piece.
  State at_start(const State& p) const {
    State x = -p;
    for (int j = kStates - 1; j >= 0; --j)
      for (int q = 0; q < j; ++q) x[q] -= start_.u(q, j) * x[j];
    for (int j = 0; j < kStates; ++j) {
      x[j] /= start_.d[j];
      for (int q = 0; q < j; ++q) x[j] -= start_.u(q, j) * x[q];
    }
    return x;
  }

  int levels_;
  std::vector<Piece> pieces_;
  Factor start_;
};

}  // namespace smoothpost
