#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/qp/piece_recursion.h"

// Internal to kernels/qp.
namespace smoothpost {

/// The values of a programme that are limited, in the order of the pieces that they hang on: bounds
/// of variables and rows, as linear forms of the local variables of PieceRecursion. Stage i < spans
/// is piece i; the last stage is the state behind the last piece.
template <int M, int K>
class PieceLimits {
  using Recursion = PieceRecursion<M, K>;
  static constexpr int kStates = Recursion::kStates;

 public:
  using Local = typename Recursion::Local;
  using State = typename Recursion::State;
  using Array = Eigen::ArrayXd;

  /// Local variables of every piece, and the state behind the last.
  struct Path {
    std::vector<Local> y;
    State end = State::Zero();
    explicit Path(int spans) : y(static_cast<std::size_t>(spans), Local::Zero()) {}
    void add(double factor, const Path& other) {
      for (std::size_t i = 0; i < y.size(); ++i) y[i] += factor * other.y[i];
      end += factor * other.end;
    }
    void clear() {
      for (Local& local : y) local.setZero();
      end.setZero();
    }
  };

  explicit PieceLimits(const QuadraticProgram& qp)
      : spans_(qp.layout.spans()), stages_(static_cast<std::size_t>(spans_) + 1) {
    add_bounds(qp);
    add_tail(qp);
    add_rows(qp);
    first_.push_back(0);
    for (const auto& stage : stages_) {
      limits_.insert(limits_.end(), stage.begin(), stage.end());
      first_.push_back(static_cast<int>(limits_.size()));
    }
    stages_.clear();
  }

  Eigen::Index size() const { return static_cast<Eigen::Index>(limits_.size()); }
  /// Whether limit k is a bound of the programme (or one of its rows), and which.
  bool is_bound(Eigen::Index k) const { return limits_[static_cast<std::size_t>(k)].is_bound; }
  int source(Eigen::Index k) const { return limits_[static_cast<std::size_t>(k)].source; }

  /// Values along a path.
  void values(const Path& path, Array& g) const {
    for (int i = 0; i < spans_; ++i) stage_values(i, path.y[static_cast<std::size_t>(i)], g);
    Local tail = Local::Zero();
    tail.template head<kStates>() = path.end;
    stage_values(spans_, tail, g);
  }

  /// w += Σ t_k · (the form of limit k), over the limits of one stage.
  void add_linear(int stage, const Array& t, Local& w) const {
    for (int k = first(stage); k < first(stage + 1); ++k) {
      const Limited& limit = limits_[static_cast<std::size_t>(k)];
      if (limit.position >= 0)
        w[limit.position] += t[k];
      else
        w += t[k] * forms_[static_cast<std::size_t>(limit.form)];
    }
  }

  int stage_size(int stage) const { return first(stage + 1) - first(stage); }

  /// Puts weight_k · form · formᵀ of the limits of one stage behind each other.
  /// @return behind the last one
  typename Recursion::Factor::Term* terms(int stage, const Array& weight,
                                          typename Recursion::Factor::Term* to) const {
    for (int k = first(stage); k < first(stage + 1); ++k, ++to) {
      const Limited& limit = limits_[static_cast<std::size_t>(k)];
      to->weight = weight[k];
      to->last = limit.position >= 0 ? limit.position : M * K - 1;
      if (limit.position >= 0)
        to->a = Local::Unit(limit.position);
      else
        to->a = forms_[static_cast<std::size_t>(limit.form)];
    }
    return to;
  }

 private:
  /// One local variable of a stage, or a form over all of them.
  struct Limited {
    int position = -1;  ///< in the local variables; −1: a form
    int form = -1;
    int source = 0;
    bool is_bound = true;
  };

  int first(int stage) const { return first_[static_cast<std::size_t>(stage)]; }

  void stage_values(int stage, const Local& y, Array& g) const {
    for (int k = first(stage); k < first(stage + 1); ++k) {
      const Limited& limit = limits_[static_cast<std::size_t>(k)];
      g[k] = limit.position >= 0 ? y[limit.position]
                                 : forms_[static_cast<std::size_t>(limit.form)].dot(y);
    }
  }

  static bool limited(const QuadraticProgram& qp, int variable) {
    return std::isfinite(qp.lower[variable]) || std::isfinite(qp.upper[variable]);
  }

  void add_variable(const QuadraticProgram& qp, int stage, int position, int variable) {
    if (limited(qp, variable))
      stages_[static_cast<std::size_t>(stage)].push_back({position, -1, variable, true});
  }

  void add_form(int stage, const Local& form, int source, bool is_bound) {
    stages_[static_cast<std::size_t>(stage)].push_back(
        {-1, static_cast<int>(forms_.size()), source, is_bound});
    forms_.push_back(form);
  }

  void add_bounds(const QuadraticProgram& qp) {
    const SplineLayout& layout = qp.layout;
    const int levels = layout.levels;
    for (int c = 0; c < M; ++c) {
      for (int level = 0; level < levels; ++level)
        for (int j = 0; j <= spans_; ++j)
          add_variable(qp, j, Recursion::position(c, level), layout.index(c, level, j));
      for (int j = 0; j < layout.count(levels); ++j) {
        const int stage = std::max(0, j - (K - 1 - levels));
        add_variable(qp, stage, Recursion::position(c, levels + j - stage),
                     layout.index(c, levels, j));
      }
    }
  }

  // Variables behind the last state's own are combinations of it.
  void add_tail(const QuadraticProgram& qp) {
    const SplineLayout& layout = qp.layout;
    const int levels = layout.levels;
    for (int c = 0; c < M; ++c) {
      std::vector<Local> above;  // of the level above, from its first behind the last piece
      for (int d = 0; d < K - 1 - levels; ++d)
        above.push_back(Local::Unit(Recursion::position(c, levels + d)));
      for (int level = levels - 1; level >= 0; --level) {
        const std::vector<double> h = derivative_steps(layout.knots, level + 1);
        const double scale = layout.scale(c, level + 1) / layout.scale(c, level);
        std::vector<Local> here{Local::Unit(Recursion::position(c, level))};
        for (int j = spans_; j + 1 < layout.count(level); ++j) {
          here.push_back(here.back() + h[static_cast<std::size_t>(j)] * scale *
                                           above[static_cast<std::size_t>(j - spans_)]);
          const int variable = layout.index(c, level, j + 1);
          if (limited(qp, variable)) add_form(spans_, here.back(), variable, true);
        }
        above = std::move(here);
      }
    }
  }

  void add_rows(const QuadraticProgram& qp) {
    for (int r = 0; r < qp.row_count(); ++r) {
      Local form;
      for (int p = 0; p < M * K; ++p) form[Recursion::position(p / K, p % K)] = qp.rows(p, r);
      add_form(qp.row_span[static_cast<std::size_t>(r)], form, r, false);
    }
  }

  int spans_;
  std::vector<std::vector<Limited>> stages_;
  std::vector<Limited> limits_;
  std::vector<int> first_;  ///< of each stage, in limits_
  std::vector<Local> forms_;
};

}  // namespace smoothpost
