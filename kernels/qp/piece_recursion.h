#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "kernels/qp/quadratic_program.h"

namespace smoothpost {

/// Linear-quadratic problems along the pieces of a spline programme: minimise
///   Σ_i (½ yᵢᵀ Wᵢ yᵢ + wᵢᵀ yᵢ) + ½ xᵀ W_S x + w_Sᵀ x
/// over the local variables yᵢ = (state, new number of every channel) of each piece and the state x
/// behind the last, subject to the layout's equations. M channels, K = degree + 1.
///
/// Order in y: states channel by channel (K − 1 each), then one new number a channel.
template <int M, int K>
class PieceRecursion {
 public:
  static constexpr int kStates = M * (K - 1);
  static constexpr int kLocal = M * K;
  using Local = Eigen::Matrix<double, kLocal, 1>;
  using LocalMatrix = Eigen::Matrix<double, kLocal, kLocal>;
  using State = Eigen::Matrix<double, kStates, 1>;
  using StateMatrix = Eigen::Matrix<double, kStates, kStates>;
  using New = Eigen::Matrix<double, M, 1>;

  explicit PieceRecursion(const SplineLayout& layout)
      : levels_(layout.levels), step_(static_cast<std::size_t>(layout.spans())) {
    for (int level = 1; level <= levels_; ++level) {
      const std::vector<double> h = derivative_steps(layout.knots, level);
      for (int i = 0; i < layout.spans(); ++i)
        for (int c = 0; c < M; ++c)
          step_[static_cast<std::size_t>(i)](level - 1, c) =
              h[static_cast<std::size_t>(i)] * layout.scale(c, level) / layout.scale(c, level - 1);
    }
    gain_.resize(step_.size());
    pivot_.resize(step_.size());
    feed_.resize(step_.size());
  }

  int spans() const { return static_cast<int>(step_.size()); }

  /// Position in y of local variable p (0 … K − 1) of a channel.
  static constexpr int position(int channel, int p) {
    return p < K - 1 ? channel * (K - 1) + p : kStates + channel;
  }

  /// The state behind piece i.
  State advance(int i, const Local& y) const {
    State next;
    const auto& h = step_[static_cast<std::size_t>(i)];
    for (int c = 0; c < M; ++c)
      for (int p = 0; p < K - 1; ++p)
        next[c * (K - 1) + p] = p < levels_ ? y[position(c, p)] + h(p, c) * y[position(c, p + 1)]
                                            : y[position(c, p + 1)];
    return next;
  }

  /// Sᵀ p for the matrix S of advance().
  Local pull_back(int i, const State& p) const {
    Local w = Local::Zero();
    const auto& h = step_[static_cast<std::size_t>(i)];
    for (int c = 0; c < M; ++c)
      for (int q = 0; q < K - 1; ++q) {
        const double value = p[c * (K - 1) + q];
        if (q < levels_) {
          w[position(c, q)] += value;
          w[position(c, q + 1)] += h(q, c) * value;
        } else {
          w[position(c, q + 1)] += value;
        }
      }
    return w;
  }

  /// Factors the matrices: W_S, then Wᵢ from the last piece to the first by `matrix(i)`.
  /// False when a pivot is not positive.
  template <class MatrixOf>
  bool factor(const StateMatrix& end, const MatrixOf& matrix) {
    StateMatrix p = end;
    LocalMatrix w;
    for (int i = spans() - 1; i >= 0; --i) {
      const std::size_t at = static_cast<std::size_t>(i);
      w = matrix(i);
      add_congruence(i, p, w);
      const Eigen::Matrix<double, M, M> corner = w.template bottomRightCorner<M, M>();
      pivot_[at].compute(corner);
      if (pivot_[at].info() != Eigen::Success) return false;
      const Eigen::Matrix<double, M, kStates> side = w.template bottomLeftCorner<M, kStates>();
      gain_[at] = pivot_[at].solve(side);
      p.noalias() = w.template topLeftCorner<kStates, kStates>() - side.transpose() * gain_[at];
    }
    start_.compute(p);
    return start_.info() == Eigen::Success;
  }

  /// The minimiser for linear terms `vector(i)` of the pieces and `end`; calls take(i, y).
  /// @return the state behind the last piece
  template <class VectorOf, class Take>
  State solve(const State& end, const VectorOf& vector, const Take& take) {
    State p = end;
    for (int i = spans() - 1; i >= 0; --i) {
      const std::size_t at = static_cast<std::size_t>(i);
      const Local w = vector(i) + pull_back(i, p);
      const New side = w.template tail<M>();
      feed_[at] = pivot_[at].solve(side);
      p = w.template head<kStates>() - gain_[at].transpose() * side;
    }
    State x = start_.solve(-p);
    Local y;
    for (int i = 0; i < spans(); ++i) {
      const std::size_t at = static_cast<std::size_t>(i);
      y.template head<kStates>() = x;
      y.template tail<M>() = -feed_[at] - gain_[at] * x;
      take(i, y);
      x = advance(i, y);
    }
    return x;
  }

 private:
  // w += Sᵀ p S.
  void add_congruence(int i, const StateMatrix& p, LocalMatrix& w) const {
    Eigen::Matrix<double, kStates, kLocal> t;
    const auto& h = step_[static_cast<std::size_t>(i)];
    for (int c = 0; c < M; ++c)
      for (int q = 0; q < K; ++q) {
        auto column = t.col(position(c, q));
        const bool own = q < levels_;  // α: q stays in its own place
        const double left = q == 0 ? 0.0 : (q - 1 < levels_ ? h(q - 1, c) : 1.0);
        if (own && q > 0)
          column = p.col(c * (K - 1) + q) + left * p.col(c * (K - 1) + q - 1);
        else if (own)
          column = p.col(c * (K - 1));
        else
          column = left * p.col(c * (K - 1) + q - 1);
      }
    for (int c = 0; c < M; ++c)
      for (int q = 0; q < K; ++q) {
        auto row = w.row(position(c, q));
        const bool own = q < levels_;
        const double left = q == 0 ? 0.0 : (q - 1 < levels_ ? h(q - 1, c) : 1.0);
        if (own) row += t.row(c * (K - 1) + q);
        if (q > 0) row += left * t.row(c * (K - 1) + q - 1);
      }
  }

  int levels_;
  std::vector<Eigen::Matrix<double, K, M>> step_;  ///< (level − 1, channel)
  std::vector<Eigen::Matrix<double, M, kStates>> gain_;
  std::vector<Eigen::LLT<Eigen::Matrix<double, M, M>>> pivot_;
  std::vector<New> feed_;
  Eigen::LDLT<StateMatrix> start_;
};

}  // namespace smoothpost
