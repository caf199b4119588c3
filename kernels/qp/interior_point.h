#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "kernels/qp/piece_limits.h"
#include "kernels/qp/piece_recursion.h"
#include "kernels/qp/qp_solver.h"

// Internal to kernels/qp.
namespace smoothpost {

/// Mehrotra's predictor-corrector over the pieces of one programme; see banded_solver.h.
///
/// With g the limited values (g = Ay along the path y), slacks s = ±(g − limit) + wτ and
/// multipliers z, λ, one Newton system is
///   H dy + Aᵀ(∓dz + dλ) = −(gradient of the Lagrangian),   s·dz + z·ds = −rc,   A dy = b − g.
/// It is solved with s + δz for s and with −δ·dλ in the equations, so that no weight 1/(s/z + δ) of
/// the recursion is above 1/δ: more would swamp the little that a smooth spline costs. What that
/// leaves of the true system is solved for again, a few times: an active limit's multiplier then is
/// an unknown of its own and never the product of a huge weight and a tiny difference.
template <int M, int K>
class InteriorPoint {
  using Recursion = PieceRecursion<M, K>;
  using Limits = PieceLimits<M, K>;
  using Local = typename Recursion::Local;
  using LocalMatrix = typename Recursion::LocalMatrix;
  using State = typename Recursion::State;
  using Term = typename Recursion::Factor::Term;
  using Path = typename Limits::Path;
  using Array = Eigen::ArrayXd;
  static constexpr int kStates = Recursion::kStates;

  static constexpr double kDelta = 1e-6;
  static constexpr int kMostCorrections = 4;
  static constexpr double kCorrected = 1e-2;  // of the mean complementarity
  static constexpr double kProximal = 1e-13;
  // Of the way to the nearest limit. Short steps that end nearer let Mehrotra's corrector go round
  // in circles between two limits.
  static constexpr double kBoundaryShare = 0.99;
  static constexpr double kNearlyWhole = 0.9;
  static constexpr double kStartSlack = 1e-3;  // least ones of a start that is given
  static constexpr double kStartProduct = 1e-5;
  static constexpr int kHopelessRounds = 3;
  static constexpr double kHopelessMultiplier = 1e12;

  /// All lower or all upper limits: slack = sign·(g − limit) + relax·τ ≥ 0.
  struct Side {
    double sign = 1.0;
    Array limit, has, s, z, ds, dz;
    Array miss;     ///< of the slacks
    Array product;  ///< right side of the complementarity
    Array inverse;  ///< 1/(s + δz)
    Array error;    ///< of the complementarity in the present direction
  };

 public:
  InteriorPoint(const QuadraticProgram& qp, const QpSettings& settings)
      : qp_(qp),
        settings_(settings),
        spans_(qp.layout.spans()),
        recursion_(qp.layout),
        limits_(qp),
        path_(spans_),
        dpath_(spans_),
        fix_(spans_),
        border_(spans_) {
    permute_objective();
    size_vectors();
  }

  QpSolution run() {
    QpSolution out;
    out.solver = QpSolver::banded;
    start();
    bool done = false;
    int iteration = 0;
    for (; iteration < settings_.max_iterations; ++iteration) {
      done = converged();
      if (done || hopeless_ >= kHopelessRounds || !step()) break;
    }
    out.iterations = iteration;
    fill(out);
    out.status = done                                    ? QpStatus::optimal
                 : iteration == settings_.max_iterations ? QpStatus::iteration_limit
                                                         : QpStatus::failed;
    return out;
  }

 private:
  void permute_objective() {
    hessian_.resize(static_cast<std::size_t>(spans_));
    gradient_.resize(static_cast<std::size_t>(spans_));
    for (int p = 0; p < M * K; ++p) place_[p] = Recursion::position(p / K, p % K);
    for (int i = 0; i < spans_; ++i) {
      auto& h = hessian_[static_cast<std::size_t>(i)];
      auto& g = gradient_[static_cast<std::size_t>(i)];
      for (int p = 0; p < M * K; ++p) {
        g[place_[p]] = qp_.gradient(p, i);
        for (int q = 0; q < M * K; ++q) h(place_[p], place_[q]) = qp_.hessian(p, i * M * K + q);
      }
    }
    slope_ = gradient_;
    int most = 0;
    for (int i = 0; i <= spans_; ++i) {
      first_square_.push_back(squares_.size());
      if (i < spans_) add_squares(hessian_[static_cast<std::size_t>(i)]);
      most = std::max(most, limits_.stage_size(i) + M * K);
    }
    first_square_.push_back(squares_.size());
    terms_.resize(static_cast<std::size_t>(most));
  }

  // UDUᵀ of a positive semidefinite matrix; what rounding leaves of a column that it lacks is
  // dropped.
  void add_squares(LocalMatrix h) {
    const double least = 1e-14 * h.diagonal().maxCoeff();
    for (int j = M * K - 1; j >= 0; --j) {
      const double d = h(j, j);
      if (d <= least) continue;
      Term square{d, j, Local::Unit(j)};
      square.a.head(j) = h.col(j).head(j) / d;
      h.topLeftCorner(j, j).noalias() -= d * square.a.head(j) * square.a.head(j).transpose();
      squares_.push_back(square);
    }
  }

  void size_vectors() {
    const Eigen::Index n = limits_.size();
    relax_ = Array::Zero(n);
    for (Side& side : sides_) {
      side.has = Array::Zero(n);
      side.limit = side.s = side.z = side.ds = side.dz = side.miss = side.product = side.inverse =
          side.error = side.has;
    }
    sides_[1].sign = -1.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      const bool bound = limits_.is_bound(k);
      const int from = limits_.source(k);
      const double lower = (bound ? qp_.lower : qp_.row_lower)[from];
      const double upper = (bound ? qp_.upper : qp_.row_upper)[from];
      if (qp_.relaxation)
        relax_[k] = (bound ? qp_.relaxation->bound_weight : qp_.relaxation->row_weight)[from];
      if (lower == upper && relax_[k] == 0.0) {
        equations_.push_back(k);
        target_.push_back(lower);
        continue;
      }
      set_limit(sides_[0], k, lower);
      set_limit(sides_[1], k, upper);
    }
    count_ = sides_[0].has.sum() + sides_[1].has.sum() + (qp_.relaxation ? 1.0 : 0.0);
    g_ = dg_ = fix_g_ = weight_ = linear_ = lambda_ = dlambda_ = Array::Zero(n);
    if (qp_.relaxation) border_g_ = border_weight_ = Array::Zero(n);
  }

  static void set_limit(Side& side, Eigen::Index k, double limit) {
    if (!std::isfinite(limit)) return;
    side.has[k] = 1.0;
    side.limit[k] = limit;
  }

  // ---- the method

  void start() {
    if (settings_.start && fits(*settings_.start)) {
      take_start(*settings_.start);
      return;
    }
    update();
    // Least squares towards the middle of every range, with the objective.
    weight_.setOnes();
    for (Eigen::Index k = 0; k < g_.size(); ++k) {
      const double above = g_[k] - sides_[0].limit[k], below = sides_[1].limit[k] - g_[k];
      linear_[k] = 0.0;
      if (sides_[0].has[k] > 0.0 && sides_[1].has[k] > 0.0)
        linear_[k] = 0.5 * (above - below);
      else if (sides_[0].has[k] > 0.0)
        linear_[k] = std::min(0.0, above - 1.0);
      else if (sides_[1].has[k] > 0.0)
        linear_[k] = std::max(0.0, 1.0 - below);
    }
    for (std::size_t e = 0; e < equations_.size(); ++e) {
      weight_[equations_[e]] = 1.0 / kDelta;
      linear_[equations_[e]] = (g_[equations_[e]] - target_[e]) / kDelta;
    }
    factor();
    solve(Slope::at_path);
    path_.add(1.0, fix_);
    update();
    start_slacks();
  }

  bool fits(const QpSolution& s) const {
    return !qp_.relaxation && s.x.size() == qp_.layout.size() &&
           s.bound_lower.size() == s.x.size() && s.bound_upper.size() == s.x.size() &&
           s.row_lower.size() == qp_.row_count() && s.row_upper.size() == qp_.row_count();
  }

  void take_start(const QpSolution& from) {
    for (int i = 0; i < spans_; ++i)
      for (int p = 0; p < M * K; ++p)
        path_.y[static_cast<std::size_t>(i)][place_[p]] = from.x[qp_.layout.local_index(i, p)];
    path_.end = recursion_.advance(spans_ - 1, path_.y.back());
    update();
    for (Eigen::Index k = 0; k < limits_.size(); ++k) {
      const bool bound = limits_.is_bound(k);
      const int at = limits_.source(k);
      const double z[] = {(bound ? from.bound_lower : from.row_lower)[at],
                          (bound ? from.bound_upper : from.row_upper)[at]};
      lambda_[k] = z[1] - z[0];
      for (std::size_t i = 0; i < 2; ++i) {
        Side& side = sides_[i];
        side.s[k] = 1.0;
        if (side.has[k] == 0.0) continue;
        lambda_[k] = 0.0;
        side.s[k] = std::max(side.sign * (g_[k] - side.limit[k]), kStartSlack);
        side.z[k] = std::max(z[i], kStartProduct / side.s[k]);
      }
    }
  }

  void start_slacks() {
    if (qp_.relaxation) {
      double worst = 0.0;
      for (const Side& side : sides_)
        for (Eigen::Index k = 0; k < g_.size(); ++k)
          if (side.has[k] > 0.0 && relax_[k] > 0.0)
            worst = std::max(worst, side.sign * (side.limit[k] - g_[k]) / relax_[k]);
      tau_ = std::max(worst, qp_.relaxation->lower) + 0.1;
      tau_slack_ = tau_ - qp_.relaxation->lower;
    }
    constexpr double kLeastSlack = 0.1;
    const double mu = std::max(1e-3, (1.0 + std::abs(objective())) / std::max(1.0, count_));
    for (Side& side : sides_) {
      side.s = (side.sign * (g_ - side.limit) + relax_ * tau_).max(kLeastSlack);
      side.z = side.has * mu / side.s;
    }
    tau_dual_ = qp_.relaxation ? mu / tau_slack_ : 0.0;
  }

  /// Slope of the objective and limited values of the present path.
  void update() {
    for (std::size_t i = 0; i < hessian_.size(); ++i) {
      slope_[i].noalias() = hessian_[i] * path_.y[i];
      slope_[i] += gradient_[i];
    }
    limits_.values(path_, g_);
  }

  double objective() const {
    double value = qp_.constant;
    for (std::size_t i = 0; i < slope_.size(); ++i)
      value += 0.5 * path_.y[i].dot(slope_[i] + gradient_[i]);
    return value;
  }

  double mu_after(double alpha) const {
    double sum = (tau_slack_ + alpha * dtau_) * (tau_dual_ + alpha * dtau_dual_);
    for (const Side& side : sides_)
      sum += ((side.s + alpha * side.ds) * (side.z + alpha * side.dz) * side.has).sum();
    return sum / std::max(1.0, count_);
  }

  double mu() const {
    double sum = tau_slack_ * tau_dual_;
    for (const Side& side : sides_) sum += (side.s * side.z * side.has).sum();
    return sum / std::max(1.0, count_);
  }

  static double largest(const Array& a) { return a.size() > 0 ? a.abs().maxCoeff() : 0.0; }

  bool converged() {
    double primal = 0.0, multiplier = 0.0;
    for (Side& side : sides_) {
      if (qp_.relaxation)
        side.miss = side.has * (side.sign * (g_ - side.limit) + relax_ * tau_ - side.s);
      else
        side.miss = side.has * (side.sign * (g_ - side.limit) - side.s);
      primal = std::max(primal, largest(side.miss));
      multiplier = std::max(multiplier, largest(side.z));
    }
    for (std::size_t e = 0; e < equations_.size(); ++e)
      primal = std::max(primal, std::abs(g_[equations_[e]] - target_[e]));
    const double value = 1.0 + std::abs(objective()) + (qp_.relaxation ? std::abs(tau_) : 0.0);
    const double gap = mu() * count_;
    const double tolerance = settings_.tolerance;
    // Complementary or with multipliers without end, and not feasible: a proof that there is no
    // solution.
    const bool stuck =
        primal > tolerance && (gap <= tolerance * value || multiplier > kHopelessMultiplier);
    hopeless_ = stuck ? hopeless_ + 1 : 0;
    if (primal > 0.1 * tolerance || gap > 0.1 * tolerance * value) return false;
    return dual_left_ <= 0.1 * tolerance;
  }

  // ---- one linear system

  void set_weights() {
    for (Side& side : sides_) side.inverse = side.has / (side.s + kDelta * side.z);
    weight_ = sides_[0].z * sides_[0].inverse + sides_[1].z * sides_[1].inverse;
    for (const Eigen::Index k : equations_) weight_[k] = 1.0 / kDelta;
  }

  void factor() {
    recursion_.factor(kProximal, [this](int i, typename Recursion::Factor& w) {
      const std::size_t at = static_cast<std::size_t>(i);
      Term* end = std::copy(squares_.data() + first_square_[at],
                            squares_.data() + first_square_[at + 1], terms_.data());
      w.add(terms_.data(), limits_.terms(i, weight_, end));
    });
  }

  enum class Slope { none, at_path, at_end };
  // fix_, fix_g_: least of the quadratic model with linear terms linear_ on the limited values and,
  // if wanted, the slope of the objective at path_ or at the end of the direction.
  void solve(Slope slope) {
    Local end = Local::Zero();
    limits_.add_linear(spans_, linear_, end);
    const auto vector = [&](int i) {
      const std::size_t at = static_cast<std::size_t>(i);
      Local w = slope == Slope::none ? Local(Local::Zero()) : slope_[at];
      if (slope == Slope::at_end) w.noalias() += hessian_[at] * dpath_.y[at];
      limits_.add_linear(i, linear_, w);
      return w;
    };
    const auto take = [&](int i, const Local& y) { fix_.y[static_cast<std::size_t>(i)] = y; };
    fix_.end = recursion_.solve(end.template head<kStates>(), vector, take);
    limits_.values(fix_, fix_g_);
  }

  void clear_direction() {
    dpath_.clear();
    dg_.setZero();
    dlambda_.setZero();
    dtau_ = 0.0;
    no_direction_ = true;
    for (Side& side : sides_) side.dz.setZero();
  }

  // Brings the direction nearer to the solution of the Newton system. Returns what the
  // regularisation leaves of the limits.
  double correct() {
    double tau_right = 0.0;
    for (Side& side : sides_) {
      if (qp_.relaxation)
        side.error = -side.inverse * (side.product + side.s * side.dz +
                                      side.z * (side.sign * dg_ + relax_ * dtau_ + side.miss));
      else
        side.error = -side.inverse *
                     (side.product + side.s * side.dz + side.z * (side.sign * dg_ + side.miss));
      if (qp_.relaxation) tau_right += (relax_ * (side.z + side.dz + side.error)).sum();
    }
    linear_ = lambda_ + dlambda_ - (sides_[0].z + sides_[0].dz + sides_[0].error) +
              (sides_[1].z + sides_[1].dz + sides_[1].error);
    for (std::size_t e = 0; e < equations_.size(); ++e) {
      const Eigen::Index k = equations_[e];
      linear_[k] += (g_[k] + dg_[k] - target_[e]) / kDelta;
    }
    solve(no_direction_ ? Slope::at_path : Slope::at_end);
    no_direction_ = false;
    const double fix_tau = qp_.relaxation ? tau_step(tau_right) : 0.0;
    dpath_.add(1.0, fix_);
    dg_ += fix_g_;
    dtau_ += fix_tau;
    double left = 0.0;
    for (Side& side : sides_) {
      if (qp_.relaxation)
        side.error -= side.z * side.inverse * (side.sign * fix_g_ + relax_ * fix_tau);
      else
        side.error -= side.z * side.inverse * (side.sign * fix_g_);
      side.dz += side.error;
      left = std::max(left, largest(side.error));
    }
    for (std::size_t e = 0; e < equations_.size(); ++e) {
      const Eigen::Index k = equations_[e];
      const double fix_lambda = (g_[k] + dg_[k] - target_[e]) / kDelta;
      dlambda_[k] += fix_lambda;
      left = std::max(left, std::abs(fix_lambda));
    }
    dtau_dual_ = qp_.relaxation ? -(tau_product_ + tau_dual_ * dtau_) / tau_slack_ : 0.0;
    return kDelta * left;
  }

  // The steps of the slacks.
  void finish_direction() {
    for (Side& side : sides_) {
      if (qp_.relaxation)
        side.ds = side.has * (side.sign * dg_ + relax_ * dtau_ + side.miss);
      else
        side.ds = side.has * (side.sign * dg_ + side.miss);
    }
  }

  // The path by which all moves when τ grows by 1.
  void find_border() {
    border_weight_.setZero();
    border_own_ = tau_dual_ / tau_slack_;
    for (const Side& side : sides_) {
      border_weight_ += side.sign * relax_ * side.z * side.inverse;
      border_own_ += (relax_.square() * side.z * side.inverse).sum();
    }
    linear_ = border_weight_;
    solve(Slope::none);
    border_ = fix_;
    border_g_ = fix_g_;
  }

  // Eliminates τ: `right` is Σ w(z + dz + error), fix_ becomes the correction with τ's share.
  double tau_step(double right) {
    const double dual_step = -(tau_product_ + tau_dual_ * dtau_) / tau_slack_;
    const double error = right - qp_.relaxation->cost + tau_dual_ + dual_step;
    const double fix_tau = (error - (border_weight_ * fix_g_).sum()) /
                           (border_own_ + (border_weight_ * border_g_).sum());
    fix_.add(fix_tau, border_);
    fix_g_ += fix_tau * border_g_;
    return fix_tau;
  }

  // ---- one step

  double step_to_boundary() const {
    double alpha = 1.0;
    for (const Side& side : sides_) {
      if (side.s.size() == 0) continue;
      // z is 0 where there is no limit
      const double fastest =
          std::min((side.ds / side.s).minCoeff(), (side.dz / (side.z + 1.0 - side.has)).minCoeff());
      if (fastest < -1.0) alpha = std::min(alpha, -1.0 / fastest);
    }
    if (qp_.relaxation) {
      if (dtau_ < 0.0) alpha = std::min(alpha, -tau_slack_ / dtau_);
      if (dtau_dual_ < 0.0) alpha = std::min(alpha, -tau_dual_ / dtau_dual_);
    }
    return alpha;
  }

  bool step() {
    set_weights();
    factor();
    if (qp_.relaxation) find_border();
    const double now = mu();
    clear_direction();
    for (Side& side : sides_) side.product = side.s * side.z;
    tau_product_ = tau_slack_ * tau_dual_;
    if (count_ > 0.0) {
      correct();
      finish_direction();
      const double after = mu_after(step_to_boundary());
      const double target = now * std::pow(std::max(0.0, after / now), 3);
      for (Side& side : sides_)
        side.product = side.has * (side.s * side.z + side.ds * side.dz - target);
      tau_product_ = tau_slack_ * tau_dual_ + dtau_ * dtau_dual_ - target;
    }
    const double enough = std::max(1e-3 * settings_.tolerance, kCorrected * now);
    for (int round = 0; round < kMostCorrections; ++round)
      if (correct() < enough) break;
    finish_direction();
    if (!dg_.isFinite().all() || !std::isfinite(dtau_)) return false;
    const double reach = step_to_boundary();
    const double share =
        reach > kNearlyWhole ? std::max(kBoundaryShare, 1.0 - now) : kBoundaryShare;
    const double alpha = reach >= 1.0 ? 1.0 : share * reach;
    if (alpha < 1e-10) return false;
    move(alpha);
    return true;
  }

  void move(double alpha) {
    path_.add(alpha, dpath_);
    for (Side& side : sides_) {
      side.s += alpha * side.ds;
      side.z += alpha * side.dz;
    }
    lambda_ += alpha * dlambda_;
    dual_left_ *= 1.0 - alpha;
    tau_ += alpha * dtau_;
    tau_slack_ += alpha * dtau_;
    tau_dual_ += alpha * dtau_dual_;
    update();
  }

  void fill(QpSolution& out) const {
    const SplineLayout& layout = qp_.layout;
    out.x.resize(layout.size());
    for (int i = 0; i < spans_; ++i)
      for (int p = 0; p < M * K; ++p)
        out.x[layout.local_index(i, p)] = path_.y[static_cast<std::size_t>(i)][place_[p]];
    fill_tail(out.x);
    out.bound_lower = out.bound_upper = Eigen::VectorXd::Zero(layout.size());
    out.row_lower = out.row_upper = Eigen::VectorXd::Zero(qp_.row_count());
    for (Eigen::Index k = 0; k < limits_.size(); ++k) {
      const bool bound = limits_.is_bound(k);
      const int to = limits_.source(k);
      // λ of an equation is 0 elsewhere, as z is for equations.
      (bound ? out.bound_lower : out.row_lower)[to] = sides_[0].z[k] + std::max(0.0, -lambda_[k]);
      (bound ? out.bound_upper : out.row_upper)[to] = sides_[1].z[k] + std::max(0.0, lambda_[k]);
    }
    out.tau = tau_;
    out.objective = objective_value(qp_, out.x);
  }

  // The variables behind the last piece, by the layout's equations.
  void fill_tail(Eigen::VectorXd& x) const {
    const SplineLayout& layout = qp_.layout;
    for (int c = 0; c < M; ++c)
      for (int level = layout.levels - 1; level >= 0; --level) {
        const std::vector<double> h = derivative_steps(layout.knots, level + 1);
        const double scale = layout.scale(c, level + 1) / layout.scale(c, level);
        for (int j = spans_ - 1; j + 1 < layout.count(level); ++j)
          x[layout.index(c, level, j + 1)] =
              x[layout.index(c, level, j)] +
              h[static_cast<std::size_t>(j)] * scale * x[layout.index(c, level + 1, j)];
      }
  }

  const QuadraticProgram& qp_;
  const QpSettings& settings_;
  int spans_;
  Recursion recursion_;
  Limits limits_;
  int place_[M * K] = {};
  std::vector<LocalMatrix> hessian_;
  std::vector<Term> squares_;  ///< of all pieces, whose sum is the Hessian
  std::vector<std::size_t> first_square_;
  std::vector<Term> terms_;  ///< of one stage
  std::vector<Local> gradient_, slope_;
  std::vector<Eigen::Index> equations_;  ///< limits that are equations
  std::vector<double> target_;
  std::array<Side, 2> sides_;
  Array relax_, g_, dg_, fix_g_, border_g_, border_weight_, weight_, linear_;
  Array lambda_, dlambda_;  ///< of equations; 0 elsewhere
  Path path_, dpath_, fix_, border_;
  bool no_direction_ = true;  ///< dpath_ is 0
  int hopeless_ = 0;
  double dual_left_ = 1.0;  ///< of the first gradient of the Lagrangian: every step takes its share
  double count_ = 0.0;      ///< of products s·z
  double tau_ = 0.0, tau_slack_ = 1.0, tau_dual_ = 0.0, tau_product_ = 0.0;
  double dtau_ = 0.0, dtau_dual_ = 0.0, border_own_ = 0.0;
};

/// Of 1 to 3 channels, degree K − 1.
template <int K>
QpSolution run_interior_point(const QuadraticProgram& qp, const QpSettings& settings) {
  switch (qp.layout.channels) {
    case 1:
      return InteriorPoint<1, K>(qp, settings).run();
    case 2:
      return InteriorPoint<2, K>(qp, settings).run();
    default:
      return InteriorPoint<3, K>(qp, settings).run();
  }
}

}  // namespace smoothpost
