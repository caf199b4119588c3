#include "kernels/qp/banded_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/core/contract.h"
#include "kernels/qp/piece_recursion.h"

namespace smoothpost {

namespace {

constexpr double kEquationWeight = 1e5;  // 1/δ of the user's equations
constexpr int kMostRefinements = 4;
constexpr int kHopelessRounds = 3;
constexpr double kHopelessMultiplier = 1e12;
constexpr double kRefinedBelow = 1e-4;  // mean complementarity
constexpr int kMostAccurate = 2;
constexpr double kProximal = 1e-13;
constexpr double kMostProximal = 1e-3;
constexpr double kBoundaryShare = 0.995;  // of the way to the nearest bound

using Array = Eigen::ArrayXd;

/// A limited value: one local variable of a piece (or of the state behind the last), or a row.
struct Limited {
  int position = -1;  ///< in y; −1: a row
  int row = -1;       ///< column of the row weights
  int source = 0;     ///< index of the programme's bound (position ≥ 0 or tail) or row
  bool is_bound = true;
};

/// Interior point over the pieces of one programme. The constraints are the limited values in the
/// order of their pieces: value g, lower ≤ g ± w·τ ≤ upper.
template <int M, int K>
class InteriorPoint {
  using Recursion = PieceRecursion<M, K>;
  using Local = typename Recursion::Local;
  using LocalMatrix = typename Recursion::LocalMatrix;
  using State = typename Recursion::State;
  using StateMatrix = typename Recursion::StateMatrix;
  static constexpr int kStates = Recursion::kStates;

 public:
  InteriorPoint(const QuadraticProgram& qp, const QpSettings& settings)
      : qp_(qp), settings_(settings), spans_(qp.layout.spans()), recursion_(qp.layout) {
    permute_objective();
    collect_limits();
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
  // ---- the programme in the order of y

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
  }

  bool limited(int variable) const {
    return std::isfinite(qp_.lower[variable]) || std::isfinite(qp_.upper[variable]);
  }

  void add_bound(int stage, int position, int variable) {
    if (!limited(variable)) return;
    Limited limit;
    limit.position = position;
    limit.source = variable;
    by_stage_[static_cast<std::size_t>(stage)].push_back(limit);
  }

  void collect_limits() {
    const SplineLayout& layout = qp_.layout;
    const int levels = layout.levels;
    by_stage_.resize(static_cast<std::size_t>(spans_) + 1);
    for (int c = 0; c < M; ++c) {
      for (int level = 0; level < levels; ++level)
        for (int j = 0; j <= spans_; ++j)
          add_bound(j, Recursion::position(c, level), layout.index(c, level, j));
      for (int j = 0; j < layout.count(levels); ++j) {
        const int stage = std::max(0, j - (K - 1 - levels));
        add_bound(stage, Recursion::position(c, levels + j - stage), layout.index(c, levels, j));
      }
    }
    add_tail();
    for (int r = 0; r < qp_.row_count(); ++r) {
      Limited limit;
      limit.row = static_cast<int>(weights_.size());
      limit.source = r;
      limit.is_bound = false;
      Local w;
      for (int p = 0; p < M * K; ++p) w[place_[p]] = qp_.rows(p, r);
      weights_.push_back(w);
      by_stage_[static_cast<std::size_t>(qp_.row_span[static_cast<std::size_t>(r)])].push_back(
          limit);
    }
    first_.push_back(0);
    for (const auto& stage : by_stage_) {
      limits_.insert(limits_.end(), stage.begin(), stage.end());
      first_.push_back(static_cast<int>(limits_.size()));
    }
    by_stage_.clear();
  }

  // Variables behind the last state's own are combinations of it.
  void add_tail() {
    const SplineLayout& layout = qp_.layout;
    const int levels = layout.levels;
    for (int c = 0; c < M; ++c) {
      // combination[level][j − spans] over the state; the top level's are the state's own.
      std::vector<std::vector<Local>> combination(static_cast<std::size_t>(levels) + 1);
      for (int d = 0; d < K - 1 - levels; ++d) {
        Local w = Local::Zero();
        w[Recursion::position(c, levels + d)] = 1.0;
        combination[static_cast<std::size_t>(levels)].push_back(w);
      }
      for (int level = levels - 1; level >= 0; --level) {
        auto& list = combination[static_cast<std::size_t>(level)];
        Local w = Local::Zero();
        w[Recursion::position(c, level)] = 1.0;
        list.push_back(w);
        const std::vector<double> h = derivative_steps(layout.knots, level + 1);
        for (int j = spans_; j + 1 < layout.count(level); ++j) {
          const double step =
              h[static_cast<std::size_t>(j)] * layout.scale(c, level + 1) / layout.scale(c, level);
          w += step * combination[static_cast<std::size_t>(level) + 1]
                                 [static_cast<std::size_t>(j - spans_)];
          list.push_back(w);
          const int variable = layout.index(c, level, j + 1);
          if (!limited(variable)) continue;
          Limited limit;
          limit.row = static_cast<int>(weights_.size());
          limit.source = variable;
          weights_.push_back(w);
          by_stage_[static_cast<std::size_t>(spans_)].push_back(limit);
        }
      }
    }
  }

  void size_vectors() {
    const Eigen::Index n = static_cast<Eigen::Index>(limits_.size());
    lower_.resize(n);
    upper_.resize(n);
    relax_ = Array::Zero(n);
    equal_.assign(limits_.size(), false);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Limited& limit = limits_[static_cast<std::size_t>(k)];
      const Eigen::VectorXd& lo = limit.is_bound ? qp_.lower : qp_.row_lower;
      const Eigen::VectorXd& hi = limit.is_bound ? qp_.upper : qp_.row_upper;
      lower_[k] = lo[limit.source];
      upper_[k] = hi[limit.source];
      if (qp_.relaxation)
        relax_[k] = (limit.is_bound ? qp_.relaxation->bound_weight
                                    : qp_.relaxation->row_weight)[limit.source];
      equal_[static_cast<std::size_t>(k)] = lower_[k] == upper_[k] && relax_[k] == 0.0;
    }
    has_lower_ = lower_.isFinite().template cast<double>();
    has_upper_ = upper_.isFinite().template cast<double>();
    for (Eigen::Index k = 0; k < n; ++k) {
      if (equal_[static_cast<std::size_t>(k)]) {
        equations_.push_back(static_cast<int>(k));
        has_lower_[k] = has_upper_[k] = 0.0;
      }
      if (has_lower_[k] == 0.0 && !equal_[static_cast<std::size_t>(k)]) lower_[k] = 0.0;
      if (has_upper_[k] == 0.0 && !equal_[static_cast<std::size_t>(k)]) upper_[k] = 0.0;
    }
    sides_ = has_lower_.sum() + has_upper_.sum() + (qp_.relaxation ? 1.0 : 0.0);
    y_.assign(static_cast<std::size_t>(spans_), Local::Zero());
    dy_ = y_;
    border_ = y_;
    fix_ = y_;
    equation_multiplier_ = Array::Zero(static_cast<Eigen::Index>(equations_.size()));
    equation_step_ = equation_multiplier_;
    for (Array* a : {&g_, &dg_, &border_g_, &fix_g_, &sl_, &sh_, &zl_, &zh_, &weight_, &linear_,
                     &rpl_, &rph_, &dsl_, &dsh_, &dzl_, &dzh_, &rcl_, &rch_})
      *a = Array::Zero(n);
  }

  // ---- values of the constraints

  double value_of(const Limited& limit, const Local& y) const {
    return limit.position >= 0 ? y[limit.position]
                               : weights_[static_cast<std::size_t>(limit.row)].dot(y);
  }

  void values_of_piece(int stage, const Local& y, Array& g) const {
    for (int k = first_[static_cast<std::size_t>(stage)];
         k < first_[static_cast<std::size_t>(stage) + 1]; ++k)
      g[k] = value_of(limits_[static_cast<std::size_t>(k)], y);
  }

  static Local as_local(const State& x) {
    Local y = Local::Zero();
    y.template head<kStates>() = x;
    return y;
  }

  void values(const std::vector<Local>& y, const State& end, Array& g) const {
    for (int i = 0; i < spans_; ++i) values_of_piece(i, y[static_cast<std::size_t>(i)], g);
    values_of_piece(spans_, as_local(end), g);
  }

  // ---- one linear system

  template <class Vector>
  void add_linear(int stage, const Array& t, Vector& w) const {
    for (int k = first_[static_cast<std::size_t>(stage)];
         k < first_[static_cast<std::size_t>(stage) + 1]; ++k) {
      const Limited& limit = limits_[static_cast<std::size_t>(k)];
      if (limit.position >= 0)
        w[limit.position] += t[k];
      else
        w += t[k] * weights_[static_cast<std::size_t>(limit.row)];
    }
  }

  void add_matrix(int stage, LocalMatrix& w) const {
    for (int k = first_[static_cast<std::size_t>(stage)];
         k < first_[static_cast<std::size_t>(stage) + 1]; ++k) {
      const Limited& limit = limits_[static_cast<std::size_t>(k)];
      if (limit.position >= 0) {
        w(limit.position, limit.position) += weight_[k];
      } else {
        const Local& a = weights_[static_cast<std::size_t>(limit.row)];
        const Local scaled = weight_[k] * a;
        w.noalias() += scaled * a.transpose();
      }
    }
  }

  // Where stiff rows leave a pivot nothing but rounding, a proximal term ρ·|dx|²/2 holds it up: it
  // shortens the step and moves no solution.
  bool factor() {
    for (double proximal = kProximal; proximal < kMostProximal; proximal *= 1e3)
      if (factor(proximal)) return true;
    return false;
  }

  bool factor(double proximal) {
    LocalMatrix end = LocalMatrix::Zero();
    end.diagonal().array() += proximal;
    add_matrix(spans_, end);
    const auto matrix = [this, proximal](int i) {
      LocalMatrix w = hessian_[static_cast<std::size_t>(i)];
      w.diagonal().array() += proximal;
      add_matrix(i, w);
      return w;
    };
    return recursion_.factor(end.template topLeftCorner<kStates, kStates>(), matrix);
  }

  // Minimises the quadratic model with the gradient of the objective (if wanted) and Σ t_k g_k.
  void solve_linear(const Array& t, bool with_objective, std::vector<Local>& dy, Array& dg) {
    Local end = Local::Zero();
    add_linear(spans_, t, end);
    const auto vector = [&](int i) {
      Local w =
          with_objective ? objective_gradient_[static_cast<std::size_t>(i)] : Local(Local::Zero());
      add_linear(i, t, w);
      return w;
    };
    const auto take = [&](int i, const Local& y) { dy[static_cast<std::size_t>(i)] = y; };
    const State x = recursion_.solve(end.template head<kStates>(), vector, take);
    values(dy, x, dg);
    end_step_ = x;
  }

  // ---- the method

  void start() {
    for (auto& y : y_) y.setZero();
    end_ = State::Zero();
    if (settings_.start && settings_.start->x.size() == qp_.layout.size())
      take_start(settings_.start->x);
    update_objective_gradient();
    values(y_, end_, g_);
    // Least squares towards the middle of every range, with the objective.
    weight_.setOnes();
    linear_.setZero();
    for (Eigen::Index k = 0; k < g_.size(); ++k) {
      if (has_lower_[k] > 0.0 && has_upper_[k] > 0.0)
        linear_[k] = g_[k] - 0.5 * (lower_[k] + upper_[k]);
      else if (has_lower_[k] > 0.0)
        linear_[k] = std::min(0.0, g_[k] - lower_[k] - 1.0);
      else if (has_upper_[k] > 0.0)
        linear_[k] = std::max(0.0, g_[k] - upper_[k] + 1.0);
    }
    for (const int k : equations_) {
      weight_[k] = kEquationWeight;
      linear_[k] = kEquationWeight * (g_[k] - lower_[k]);
    }
    if (factor()) {
      solve_linear(linear_, true, dy_, dg_);
      for (int i = 0; i < spans_; ++i)
        y_[static_cast<std::size_t>(i)] += dy_[static_cast<std::size_t>(i)];
      end_ += end_step_;
      g_ += dg_;
      update_objective_gradient();
    }
    start_slacks();
  }

  void take_start(const Eigen::VectorXd& x) {
    for (int i = 0; i < spans_; ++i)
      for (int p = 0; p < M * K; ++p)
        y_[static_cast<std::size_t>(i)][place_[p]] = x[qp_.layout.local_index(i, p)];
    end_ = recursion_.advance(spans_ - 1, y_.back());
  }

  void start_slacks() {
    double worst = 0.0;
    for (Eigen::Index k = 0; k < g_.size(); ++k) {
      if (relax_[k] <= 0.0) continue;
      if (has_lower_[k] > 0.0) worst = std::max(worst, (lower_[k] - g_[k]) / relax_[k]);
      if (has_upper_[k] > 0.0) worst = std::max(worst, (g_[k] - upper_[k]) / relax_[k]);
    }
    tau_ = 0.0;
    if (qp_.relaxation) {
      tau_ = std::max(worst + 0.1, qp_.relaxation->lower + 0.1);
      tau_slack_ = tau_ - qp_.relaxation->lower;
    }
    constexpr double kLeastSlack = 0.1;
    sl_ = (g_ + relax_ * tau_ - lower_).max(kLeastSlack);
    sh_ = (upper_ + relax_ * tau_ - g_).max(kLeastSlack);
    const double scale = (1.0 + std::abs(objective())) / std::max(1.0, sides_);
    const double mu = std::max(1e-3, scale);
    zl_ = has_lower_ * mu / sl_;
    zh_ = has_upper_ * mu / sh_;
    tau_dual_ = qp_.relaxation ? mu / tau_slack_ : 0.0;
  }

  void update_objective_gradient() {
    objective_gradient_.resize(static_cast<std::size_t>(spans_));
    for (int i = 0; i < spans_; ++i) {
      const std::size_t at = static_cast<std::size_t>(i);
      objective_gradient_[at].noalias() = hessian_[at] * y_[at] + gradient_[at];
    }
  }

  double objective() const {
    double value = qp_.constant;
    for (std::size_t i = 0; i < y_.size(); ++i)
      value += 0.5 * y_[i].dot(objective_gradient_[i] + gradient_[i]);
    return value;
  }

  double mu() const {
    return ((sl_ * zl_ * has_lower_).sum() + (sh_ * zh_ * has_upper_).sum() +
            tau_slack_ * tau_dual_) /
           std::max(1.0, sides_);
  }

  // Largest gradient of the Lagrangian with the layout's equations eliminated.
  double stationarity() const {
    Array t = -(zl_ - zh_);
    for (std::size_t e = 0; e < equations_.size(); ++e)
      t[equations_[e]] = equation_multiplier_[static_cast<Eigen::Index>(e)];
    Local end = Local::Zero();
    add_linear(spans_, t, end);
    State p = end.template head<kStates>();
    double worst = 0.0;
    for (int i = spans_ - 1; i >= 0; --i) {
      Local w = objective_gradient_[static_cast<std::size_t>(i)] + recursion_.pull_back(i, p);
      add_linear(i, t, w);
      worst = std::max(worst, w.template tail<M>().cwiseAbs().maxCoeff());
      p = w.template head<kStates>();
    }
    return std::max(worst, p.cwiseAbs().maxCoeff());
  }

  bool converged() {
    rpl_ = has_lower_ * (g_ + relax_ * tau_ - lower_ - sl_);
    rph_ = has_upper_ * (upper_ + relax_ * tau_ - g_ - sh_);
    double primal = g_.size() > 0 ? std::max(rpl_.abs().maxCoeff(), rph_.abs().maxCoeff()) : 0.0;
    for (const int k : equations_) primal = std::max(primal, std::abs(g_[k] - lower_[k]));
    const double value = std::abs(objective()) + (qp_.relaxation ? std::abs(tau_) : 0.0);
    const double gap = mu() * sides_;
    const double tolerance = settings_.tolerance;
    // Complementary or with multipliers without end, and not feasible: a proof that there is no
    // solution.
    const double multiplier = g_.size() > 0 ? std::max(zl_.maxCoeff(), zh_.maxCoeff()) : 0.0;
    if (primal > tolerance &&
        (gap <= tolerance * (1.0 + value) || multiplier > kHopelessMultiplier))
      ++hopeless_;
    else
      hopeless_ = 0;
    if (primal > 0.1 * tolerance || gap > 0.1 * tolerance * (1.0 + value)) return false;
    // What rounding leaves of the stationarity does not fall any more: the certificate decides.
    return ++accurate_ > kMostAccurate || stationarity() <= tolerance * (1.0 + largest_term());
  }

  double largest_term() const {
    const auto largest = [](const Array& a) { return a.size() > 0 ? a.abs().maxCoeff() : 0.0; };
    double worst = std::max({largest(zl_), largest(zh_), largest(equation_multiplier_)});
    for (const Local& g : objective_gradient_) worst = std::max(worst, g.cwiseAbs().maxCoeff());
    return worst;
  }

  // Newton weights at the present point.
  void set_weights() {
    weight_ = has_lower_ * zl_ / sl_ + has_upper_ * zh_ / sh_;
    for (const int k : equations_) weight_[k] = kEquationWeight;
  }

  // Direction for complementarity right sides rc: s·dz + z·ds = −rc.
  void direction(bool refined) {
    const Array dl = zl_ / sl_, dh = zh_ / sh_;
    linear_ =
        has_lower_ * (rcl_ / sl_ + dl * rpl_ - zl_) - has_upper_ * (rch_ / sh_ + dh * rph_ - zh_);
    double border_right = 0.0, border_own = 0.0;
    if (qp_.relaxation) {
      border_right =
          -qp_.relaxation->cost + (relax_ * (has_lower_ * zl_ + has_upper_ * zh_)).sum() -
          (relax_ * (has_lower_ * (rcl_ / sl_ + dl * rpl_) + has_upper_ * (rch_ / sh_ + dh * rph_)))
              .sum() +
          tau_dual_ - tau_rc_ / tau_slack_;
      border_own =
          (relax_ * relax_ * (has_lower_ * dl + has_upper_ * dh)).sum() + tau_dual_ / tau_slack_;
    }
    equation_step_.setZero();
    const Array fixed = linear_;
    for (int round = 0;; ++round) {
      for (std::size_t e = 0; e < equations_.size(); ++e) {
        const int k = equations_[e];
        const Eigen::Index at = static_cast<Eigen::Index>(e);
        linear_[k] = fixed[k] + equation_multiplier_[at] + equation_step_[at] +
                     kEquationWeight * (g_[k] - lower_[k]);
      }
      solve_linear(linear_, true, dy_, dg_);
      dtau_ = 0.0;
      if (qp_.relaxation) eliminate_tau(border_right, border_own, dl, dh);
      double worst = 0.0;
      for (std::size_t e = 0; e < equations_.size(); ++e) {
        const int k = equations_[e];
        const double miss = g_[k] + dg_[k] - lower_[k];
        equation_step_[static_cast<Eigen::Index>(e)] += kEquationWeight * miss;
        worst = std::max(worst, std::abs(miss));
      }
      if (worst < 1e-3 * settings_.tolerance || round == kMostRefinements) break;
    }
    if (refined) refine(dl, dh);
    slack_steps();
  }

  void slack_steps() {
    dsl_ = has_lower_ * (dg_ + relax_ * dtau_ + rpl_);
    dsh_ = has_upper_ * (-dg_ + relax_ * dtau_ + rph_);
    dzl_ = has_lower_ * (-rcl_ - zl_ * dsl_) / sl_;
    dzh_ = has_upper_ * (-rch_ - zh_ * dsh_) / sh_;
    if (qp_.relaxation) dtau_dual_ = (-tau_rc_ - tau_dual_ * dtau_) / tau_slack_;
  }

  // Late weights are stiff and leave a gradient of the Lagrangian by rounding: solved for once
  // more.
  void refine(const Array& dl, const Array& dh) {
    Array t = linear_ + weight_ * dg_ + relax_ * (has_lower_ * dl - has_upper_ * dh) * dtau_;
    for (std::size_t e = 0; e < equations_.size(); ++e) {
      const Eigen::Index at = static_cast<Eigen::Index>(e);
      t[equations_[e]] = equation_multiplier_[at] + equation_step_[at];
    }
    Local end = Local::Zero();
    add_linear(spans_, t, end);
    const auto vector = [&](int i) {
      const std::size_t at = static_cast<std::size_t>(i);
      Local w = objective_gradient_[at] + hessian_[at] * dy_[at];
      add_linear(i, t, w);
      return w;
    };
    const auto take = [&](int i, const Local& y) { fix_[static_cast<std::size_t>(i)] = y; };
    const State x = recursion_.solve(end.template head<kStates>(), vector, take);
    values(fix_, x, fix_g_);
    for (std::size_t i = 0; i < dy_.size(); ++i) dy_[i] += fix_[i];
    end_step_ += x;
    dg_ += fix_g_;
    for (std::size_t e = 0; e < equations_.size(); ++e)
      equation_step_[static_cast<Eigen::Index>(e)] += kEquationWeight * fix_g_[equations_[e]];
  }

  void eliminate_tau(double right, double own, const Array& dl, const Array& dh) {
    const Array b = relax_ * (has_lower_ * dl - has_upper_ * dh);
    if (!border_ready_) {
      const State keep = end_step_;
      solve_linear(b, false, border_, border_g_);  // the negative of M⁻¹ b
      border_end_ = end_step_;
      end_step_ = keep;
      border_ready_ = true;
    }
    const double schur = own + (b * border_g_).sum();
    dtau_ = (right - (b * dg_).sum()) / schur;
    for (int i = 0; i < spans_; ++i)
      dy_[static_cast<std::size_t>(i)] += dtau_ * border_[static_cast<std::size_t>(i)];
    dg_ += dtau_ * border_g_;
    end_step_ += dtau_ * border_end_;
  }

  static double largest_step(const Array& s, const Array& ds, const Array& has) {
    double alpha = 1.0;
    for (Eigen::Index k = 0; k < s.size(); ++k)
      if (has[k] > 0.0 && ds[k] < 0.0) alpha = std::min(alpha, -s[k] / ds[k]);
    return alpha;
  }

  double step_to_boundary() const {
    double alpha =
        std::min({largest_step(sl_, dsl_, has_lower_), largest_step(sh_, dsh_, has_upper_),
                  largest_step(zl_, dzl_, has_lower_), largest_step(zh_, dzh_, has_upper_)});
    if (qp_.relaxation) {
      if (dtau_ < 0.0) alpha = std::min(alpha, -tau_slack_ / dtau_);
      if (dtau_dual_ < 0.0) alpha = std::min(alpha, -tau_dual_ / dtau_dual_);
    }
    return alpha;
  }

  bool step() {
    set_weights();
    border_ready_ = false;
    if (!factor()) return false;
    const double now = mu();
    rcl_ = sl_ * zl_;
    rch_ = sh_ * zh_;
    tau_rc_ = tau_slack_ * tau_dual_;
    double sigma = 0.0;
    if (sides_ > 0.0) {
      direction(false);
      const double alpha = step_to_boundary();
      const double after = (((sl_ + alpha * dsl_) * (zl_ + alpha * dzl_) * has_lower_).sum() +
                            ((sh_ + alpha * dsh_) * (zh_ + alpha * dzh_) * has_upper_).sum() +
                            (tau_slack_ + alpha * dtau_) * (tau_dual_ + alpha * dtau_dual_)) /
                           sides_;
      sigma = std::pow(std::max(0.0, after / now), 3);
      const double target = sigma * now;
      rcl_ = sl_ * zl_ + dsl_ * dzl_ - target;
      rch_ = sh_ * zh_ + dsh_ * dzh_ - target;
      tau_rc_ = tau_slack_ * tau_dual_ + dtau_ * dtau_dual_ - target;
    }
    direction(now < kRefinedBelow);
    if (!dg_.isFinite().all() || !std::isfinite(dtau_)) return false;
    const double reach = step_to_boundary();
    const double alpha = reach >= 1.0 ? 1.0 : std::max(kBoundaryShare, 1.0 - now) * reach;
    if (alpha < 1e-10) return false;
    move(alpha);
    return true;
  }

  void move(double alpha) {
    for (int i = 0; i < spans_; ++i)
      y_[static_cast<std::size_t>(i)] += alpha * dy_[static_cast<std::size_t>(i)];
    end_ += alpha * end_step_;
    sl_ += alpha * dsl_;
    sh_ += alpha * dsh_;
    zl_ += alpha * dzl_;
    zh_ += alpha * dzh_;
    tau_ += alpha * dtau_;
    tau_slack_ += alpha * dtau_;
    tau_dual_ += alpha * dtau_dual_;
    equation_multiplier_ += alpha * equation_step_;
    update_objective_gradient();
    values(y_, end_, g_);
  }

  void fill(QpSolution& out) const {
    const SplineLayout& layout = qp_.layout;
    out.x.resize(layout.size());
    for (int i = 0; i < spans_; ++i)
      for (int p = 0; p < M * K; ++p)
        out.x[layout.local_index(i, p)] = y_[static_cast<std::size_t>(i)][place_[p]];
    fill_tail(out.x);
    out.bound_lower = out.bound_upper = Eigen::VectorXd::Zero(layout.size());
    out.row_lower = out.row_upper = Eigen::VectorXd::Zero(qp_.row_count());
    for (std::size_t k = 0; k < limits_.size(); ++k) {
      const Eigen::Index at = static_cast<Eigen::Index>(k);
      auto& lo = limits_[k].is_bound ? out.bound_lower : out.row_lower;
      auto& hi = limits_[k].is_bound ? out.bound_upper : out.row_upper;
      lo[limits_[k].source] = has_lower_[at] * zl_[at];
      hi[limits_[k].source] = has_upper_[at] * zh_[at];
    }
    for (std::size_t e = 0; e < equations_.size(); ++e) {
      const Limited& limit = limits_[static_cast<std::size_t>(equations_[e])];
      const double y = equation_multiplier_[static_cast<Eigen::Index>(e)];
      (limit.is_bound ? out.bound_lower : out.row_lower)[limit.source] = std::max(0.0, -y);
      (limit.is_bound ? out.bound_upper : out.row_upper)[limit.source] = std::max(0.0, y);
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
        for (int j = std::max(0, spans_ - 1); j + 1 < layout.count(level); ++j)
          if (j + 1 >= spans_)
            x[layout.index(c, level, j + 1)] =
                x[layout.index(c, level, j)] +
                h[static_cast<std::size_t>(j)] * scale * x[layout.index(c, level + 1, j)];
      }
  }

  const QuadraticProgram& qp_;
  const QpSettings& settings_;
  int spans_;
  Recursion recursion_;
  int place_[M * K] = {};
  std::vector<LocalMatrix> hessian_;
  std::vector<Local> gradient_, objective_gradient_;
  std::vector<std::vector<Limited>> by_stage_;
  std::vector<Limited> limits_;
  std::vector<int> first_;  ///< of each piece and of the state behind the last, in limits_
  std::vector<Local> weights_;
  std::vector<bool> equal_;
  std::vector<int> equations_;
  Array lower_, upper_, relax_, has_lower_, has_upper_;
  Array g_, dg_, border_g_, fix_g_, sl_, sh_, zl_, zh_, weight_, linear_, rpl_, rph_;
  Array dsl_, dsh_, dzl_, dzh_, rcl_, rch_;
  Array equation_multiplier_, equation_step_;
  std::vector<Local> y_, dy_, border_, fix_;
  State end_, end_step_, border_end_;
  bool border_ready_ = false;
  int hopeless_ = 0;
  int accurate_ = 0;
  double sides_ = 0.0;
  double tau_ = 0.0, tau_slack_ = 1.0, tau_dual_ = 0.0, tau_rc_ = 0.0;
  double dtau_ = 0.0, dtau_dual_ = 0.0;
};

template <int K>
QpSolution run_degree(const QuadraticProgram& qp, const QpSettings& settings) {
  switch (qp.layout.channels) {
    case 1:
      return InteriorPoint<1, K>(qp, settings).run();
    case 2:
      return InteriorPoint<2, K>(qp, settings).run();
    default:
      return InteriorPoint<3, K>(qp, settings).run();
  }
}

}  // namespace

QpSolution solve_by_banded(const QuadraticProgram& qp, const QpSettings& settings) {
  const int degree = qp.layout.knots.degree;
  require(degree == 3 || degree == 5, "the banded solver takes cubic and quintic splines");
  require(qp.layout.channels >= 1 && qp.layout.channels <= 3, "1 to 3 channels");
  require(qp.layout.levels < degree, "fewer lifted derivatives than the degree");
  QpSolution out = degree == 5 ? run_degree<6>(qp, settings) : run_degree<4>(qp, settings);
  out.certificate = certify(qp, out);
  const bool accurate = out.certificate.kkt() <= 10.0 * settings.tolerance;
  if (accurate)
    out.status = QpStatus::optimal;
  else if (out.status == QpStatus::optimal)
    out.status = QpStatus::failed;
  return out;
}

}  // namespace smoothpost
