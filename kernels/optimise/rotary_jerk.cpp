#include "kernels/optimise/rotary_jerk.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/qp/hybrid_solver.h"
#include "kernels/spline/gauss_rule.h"

namespace smoothpost {

namespace {

constexpr double kStill = 1e-7;  // rad: rotaries of two passes are the same
constexpr double kSameObjective = 1e-5;
constexpr double kHolds = 1e-9;        // a window is kept
constexpr double kTimeShare = 1e-4;    // relative accuracy of the least time
constexpr double kNearlyHolds = 1e-3;  // a window is kept well enough to know the least time
constexpr double kNear =
    0.15;  // rad-like: half-spaces of a gap farther away than this are left out
constexpr double kDifference = 1e-5;  // rad, for the curvature of the tool axis

constexpr double kStretch = 1.5;  // of the time, until a monotone motion is found
constexpr double kSlowest = 100.0;
constexpr double kMonotoneShare = 2e-3;  // relative accuracy of its least time

/// A half-space normal·O ≥ least.
struct HalfSpace {
  Vec3 normal;
  std::string_view name;
  double least = 0.0;
};

/// The half-spaces of a window with unit normals. The widest cone is the pyramid inside it whose
/// edges lie on it, where the corners of lead and tilt are outside.
std::vector<HalfSpace> half_spaces(const OrientationWindow& w) {
  constexpr int kSides = 16;
  const double lead[] = {std::tan(w.lead_low), std::tan(w.lead_high)};
  const double tilt[] = {std::tan(w.tilt_low), std::tan(w.tilt_high)};
  std::vector<HalfSpace> list;
  list.push_back({(lead[1] * w.normal - w.tangent).normalized(), "lead"});
  list.push_back({(w.tangent - lead[0] * w.normal).normalized(), "lead"});
  list.push_back({(tilt[1] * w.normal - w.binormal).normalized(), "tilt"});
  list.push_back({(w.binormal - tilt[0] * w.normal).normalized(), "tilt"});
  const double reach = std::tan(w.widest) * std::cos(kPi / kSides);
  for (int k = 0; k < kSides; ++k) {
    const double turn = 2.0 * kPi * (k + 0.5) / kSides;
    const double c = std::cos(turn), s = std::sin(turn);
    const double corner = std::max(c * lead[0], c * lead[1]) + std::max(s * tilt[0], s * tilt[1]);
    if (corner > reach)
      list.push_back({(reach * w.normal - c * w.tangent - s * w.binormal).normalized(), "gap"});
  }
  for (const AxisCut& cut : w.cuts) list.push_back({cut.normal, "clearance", cut.least});
  return list;
}

double smallest_limit(const std::array<RateLimits, 2>& limits) {
  const double least = std::min(limits[0].jerk, limits[1].jerk);
  return std::isfinite(least) ? least : 1.0;
}

double finite_or_one(double value) { return std::isfinite(value) ? value : 1.0; }

/// The passes over one problem.
class Passes {
 public:
  Passes(const RotaryProblem& problem, const RotarySettings& settings)
      : in_(problem), settings_(settings), joints_(problem.held) {
    require(in_.chain != nullptr && in_.held.size() == in_.chain->size(), "a chain and its joints");
    require(in_.knots.degree == 5, "quintic splines");
    require(in_.seed.size() == in_.windows.size(), "a seed for every window");
    at_ = in_.seed;
    pull_.assign(at_.size(), Vec3::Zero());
  }

  /// The programme with limits of one piece taking t times as long, linear about the last pass.
  QuadraticProgram programme(double t, double objective_scale) {
    SplineLayout layout = spline_layout(in_.knots, 3, 2);
    for (int c = 0; c < 2; ++c) {
      const RateLimits l = slowed(in_.limits[static_cast<std::size_t>(c)], t);
      layout.scale(c, 1) = finite_or_one(l.velocity);
      layout.scale(c, 2) = finite_or_one(l.acceleration);
      layout.scale(c, 3) = finite_or_one(l.jerk);
    }
    QuadraticProgram qp = empty_program(layout);
    for (int c = 0; c < 2; ++c) {
      add_derivative_cost(qp, c, 3, 2.0 * objective_scale);
      const RateLimits l = slowed(in_.limits[static_cast<std::size_t>(c)], t);
      const double limits[] = {l.velocity, l.acceleration, l.jerk};
      for (int level = 1; level <= 3; ++level)
        if (std::isfinite(limits[level - 1])) limit_level(qp, c, level, limits[level - 1]);
      for (int j = 0; j < qp.layout.count(0); ++j) {
        qp.lower[qp.layout.index(c, 0, j)] = in_.lower[static_cast<std::size_t>(c)];
        qp.upper[qp.layout.index(c, 0, j)] = in_.upper[static_cast<std::size_t>(c)];
      }
      if (in_.rest_at_ends)
        for (const int level : {1, 2})
          for (const int j : {0, qp.layout.count(level) - 1})
            qp.lower[qp.layout.index(c, level, j)] = qp.upper[qp.layout.index(c, level, j)] = 0.0;
    }
    if (in_.monotone) add_monotone(qp);
    set_rows(qp, rows(qp.layout));
    for (std::size_t i = 0; i < at_.size(); ++i)
      if (!pull_[i].isZero()) add_curvature(qp, i);
    return qp;
  }

  /// Takes the multipliers of the windows, for the curvature of the next programme.
  void learn(const QpSolution& solution) {
    std::fill(pull_.begin(), pull_.end(), Vec3::Zero());
    for (std::size_t r = 0; r < window_rows_.size(); ++r) {
      const WindowRow& row = window_rows_[r];
      if (row.window >= 0)
        pull_[static_cast<std::size_t>(row.window)] +=
            solution.row_lower[static_cast<Eigen::Index>(r)] * row.normal;
    }
  }

  /// Moves the place of linearisation to the spline; false: it went only half the way.
  bool follow(const SplineCurve& q) {
    std::vector<std::array<double, 2>> next(at_.size());
    double worst = 0.0, change = 0.0;
    for (std::size_t i = 0; i < at_.size(); ++i) {
      const Eigen::VectorXd value = q.at(in_.windows[i].u);
      next[i] = {value[0], value[1]};
      change = std::max({change, std::abs(value[0] - at_[i][0]), std::abs(value[1] - at_[i][1])});
      worst = std::max(worst, in_.windows[i].outside(axis_at(next[i])));
    }
    const bool worse = passes_ > 0 && worst > 1e-3 && worst > 1.5 * outside_;
    if (worse)
      for (std::size_t i = 0; i < at_.size(); ++i)
        for (std::size_t c = 0; c < 2; ++c) next[i][c] = 0.5 * (next[i][c] + at_[i][c]);
    at_ = std::move(next);
    outside_ = worst;
    change_ = change;
    ++passes_;
    return !worse;
  }

  /// `objective` is that of this pass' rotaries.
  bool settled(double objective) {
    const bool same =
        std::abs(objective - objective_) <= kSameObjective * std::abs(objective) + 1e-12;
    objective_ = objective;
    return outside_ <= kHolds && (change_ <= kStill || same);
  }
  double outside() const { return outside_; }
  int passes() const { return passes_; }

 private:
  Vec3 axis_at(const std::array<double, 2>& q) const {
    joints_[in_.joints[0]] = q[0];
    joints_[in_.joints[1]] = q[1];
    return forward_location(*in_.chain, joints_).axis;
  }

  /// A row of a window: normal·O ≥ 0. Via rows have window −1.
  struct WindowRow {
    int window = -1;
    Vec3 normal = Vec3::Zero();
    NewRow row;
  };

  std::vector<NewRow> rows(const SplineLayout& layout) {
    window_rows_.clear();
    for (const RotaryVia& via : in_.via)
      for (int c = 0; c < 2; ++c) {
        const double value = via.q[static_cast<std::size_t>(c)];
        window_rows_.push_back(
            {-1, Vec3::Zero(), {local_row(layout, c, via.u, 0), value, value, "via point", via.u}});
      }
    for (std::size_t i = 0; i < in_.windows.size(); ++i) add_window(layout, i);
    std::stable_sort(
        window_rows_.begin(), window_rows_.end(),
        [](const WindowRow& a, const WindowRow& b) { return a.row.row.span < b.row.row.span; });
    std::vector<NewRow> list;
    for (const WindowRow& row : window_rows_) list.push_back(row.row);
    return list;
  }

  /// dO/dq of the two rotaries.
  std::array<Vec3, 2> slopes_at(const std::array<double, 2>& q) const {
    const Vec3 axis = axis_at(q);
    const Jacobian jac = jacobian(*in_.chain, joints_);
    return {Vec3(jac.col(in_.joints[0]).head<3>()).cross(axis),
            Vec3(jac.col(in_.joints[1]).head<3>()).cross(axis)};
  }

  // Half-spaces that are far away cannot matter to this pass; of the first one only those of the
  // gap, as its seed may be anywhere.
  void add_window(const SplineLayout& layout, std::size_t i) {
    const OrientationWindow& w = in_.windows[i];
    const Vec3 axis = axis_at(at_[i]);
    const std::array<Vec3, 2> slope = slopes_at(at_[i]);
    const LocalRow first = local_row(layout, 0, w.u, 0);
    const LocalRow second = local_row(layout, 1, w.u, 0);
    for (const HalfSpace& h : half_spaces(w)) {
      const double slack = h.normal.dot(axis) - h.least;
      if (slack > kNear && h.name == "gap") continue;
      const double a = h.normal.dot(slope[0]), b = h.normal.dot(slope[1]);
      NewRow row;
      row.row = first;
      row.row.weights = a * first.weights + b * second.weights;
      row.lower = settings_.cone_margin - slack + a * at_[i][0] + b * at_[i][1];
      row.upper = std::numeric_limits<double>::infinity();
      row.name = h.name;
      row.place = w.u;
      window_rows_.push_back({static_cast<int>(i), h.normal, std::move(row)});
    }
  }

  // The Lagrangian's second derivative by the two rotaries at a window, as far as it is convex:
  // without it passes swing where the objective is flat.
  void add_curvature(QuadraticProgram& qp, std::size_t i) const {
    const std::array<Vec3, 2> here = slopes_at(at_[i]);
    Eigen::Matrix2d m;
    for (std::size_t k = 0; k < 2; ++k) {
      std::array<double, 2> moved = at_[i];
      moved[k] += kDifference;
      const std::array<Vec3, 2> there = slopes_at(moved);
      for (std::size_t c = 0; c < 2; ++c)
        m(static_cast<int>(c), static_cast<int>(k)) =
            -pull_[i].dot(there[c] - here[c]) / kDifference;
    }
    m = 0.5 * (m + m.transpose()).eval();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(m);
    m = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
        eigen.eigenvectors().transpose();
    const Eigen::Vector2d at(at_[i][0], at_[i][1]);
    const LocalRow first = local_row(qp.layout, 0, in_.windows[i].u, 0);
    Eigen::MatrixXd weights(first.weights.size(), 2);
    weights << first.weights, local_row(qp.layout, 1, in_.windows[i].u, 0).weights;
    const int local = qp.layout.local_size();
    qp.hessian.middleCols(first.span * local, local) += weights * m * weights.transpose();
    qp.gradient.col(first.span) -= weights * (m * at);
    qp.constant += 0.5 * at.dot(m * at);
  }

  // Control points of the first derivative that reach between two vias have the sign of the step;
  // where it turns around they are 0.
  void add_monotone(QuadraticProgram& qp) const {
    const std::vector<double>& knots = qp.layout.knots.values;
    for (int c = 0; c < 2; ++c)
      for (int j = 0; j < qp.layout.count(1); ++j) {
        const double first = knots[static_cast<std::size_t>(j + 1)];
        const double last = knots[static_cast<std::size_t>(j + 1 + qp.layout.knots.degree)];
        const int k = qp.layout.index(c, 1, j);
        for (std::size_t v = 1; v < in_.via.size(); ++v) {
          if (in_.via[v].u <= first || in_.via[v - 1].u >= last) continue;
          const double step = in_.via[v].q[static_cast<std::size_t>(c)] -
                              in_.via[v - 1].q[static_cast<std::size_t>(c)];
          if (step >= 0.0) qp.lower[k] = std::max(qp.lower[k], 0.0);
          if (step <= 0.0) qp.upper[k] = std::min(qp.upper[k], 0.0);
        }
      }
  }

  const RotaryProblem& in_;
  const RotarySettings& settings_;
  mutable JointVector joints_;
  std::vector<std::array<double, 2>> at_;
  std::vector<Vec3> pull_;  ///< Σ multiplier·normal of every window
  std::vector<WindowRow> window_rows_;
  double outside_ = 0.0;
  double change_ = 0.0;
  double objective_ = -1.0;
  int passes_ = 0;
};

SplineCurve curve_of(const QuadraticProgram& qp, const QpSolution& s) {
  return {qp.layout.knots, controls_of(qp.layout, s.x)};
}

/// Σ ∫ (q_c''')² du, exactly: the integrand has degree 4.
double jerk_square(const SplineCurve& q) {
  const GaussRule& rule = gauss_rule(3);
  const SplineKnots& knots = q.knots;
  double sum = 0.0;
  for (int span = 0; span < knots.spans(); ++span) {
    const double first = knots.values[static_cast<std::size_t>(span + knots.degree)];
    const double length = knots.values[static_cast<std::size_t>(span + knots.degree) + 1] - first;
    for (int g = 0; g < rule.points; ++g)
      sum += length * rule.weights[g] * q.at(first + length * rule.nodes[g], 3).squaredNorm();
  }
  return sum;
}

// Of ∫ (q''')², so that the objective is of the order of 1 when a rotary is at its jerk limit.
double scale_of(const RotaryProblem& problem, double t) {
  const double jerk = smallest_limit(problem.limits) * t * t * t;
  return 1.0 / (jerk * jerk * problem.knots.spans());
}

/// Relaxation of the limits of derivatives by a longer time: weight l for level l.
Relaxation by_time(const QuadraticProgram& qp) {
  Relaxation r;
  r.bound_weight = Eigen::VectorXd::Zero(qp.layout.size());
  r.row_weight = Eigen::VectorXd::Zero(qp.row_count());
  for (int c = 0; c < qp.layout.channels; ++c)
    for (int level = 1; level <= qp.layout.levels; ++level)
      for (int j = 0; j < qp.layout.count(level); ++j) {
        const int k = qp.layout.index(c, level, j);
        if (qp.lower[k] < qp.upper[k]) r.bound_weight[k] = level;
      }
  return r;
}

/// Relaxation of the windows alone.
Relaxation by_cone(const QuadraticProgram& qp) {
  Relaxation r;
  r.bound_weight = Eigen::VectorXd::Zero(qp.layout.size());
  r.row_weight = Eigen::VectorXd::Zero(qp.row_count());
  for (int i = 0; i < qp.row_count(); ++i)
    if (qp.row_lower[i] < qp.row_upper[i]) r.row_weight[i] = 1.0;
  return r;
}

/// Good enough for the next pass to be linear about it.
bool near_optimum(const QpSolution& s) {
  return s.status == QpStatus::optimal ||
         (s.certificate.violation < 1e-7 && s.certificate.kkt() < 1e-4);
}

bool usable(const QpSolution& s) {
  return s.status == QpStatus::optimal || s.certificate.violation < 1e-7;
}

/// Why a programme has no solution: `why` names the limit that a longer time would give room at, or
/// the window that cannot be kept in any time.
RotaryStatus verdict(QuadraticProgram qp, const QpSettings& settings, QpFeasibility& why) {
  qp.relaxation = by_time(qp);
  why = feasibility(qp, settings);
  if (usable(why.solution))
    return why.shortfall > 0.0 ? RotaryStatus::too_fast : RotaryStatus::solver_failed;
  qp.relaxation = by_cone(qp);
  why = feasibility(qp, settings);
  return usable(why.solution) && why.shortfall > 1e-7 ? RotaryStatus::cone_empty
                                                      : RotaryStatus::solver_failed;
}

/// The smoothest rotaries at a time that has room, from those of `near`.
RotaryResult smoothest_at(RotaryProblem problem, double t, const SplineCurve& near,
                          RotarySettings settings) {
  for (RateLimits& l : problem.limits) l = slowed(l, t);
  for (std::size_t i = 0; near.controls.size() > 0 && i < problem.windows.size(); ++i) {
    const Eigen::VectorXd value = near.at(problem.windows[i].u);
    problem.seed[i] = {value[0], value[1]};
  }
  if (settings.hybrid) settings.solver.solver = QpSolver::banded;
  settings.hybrid = false;
  return optimise_rotaries(problem, settings);
}

/// The signs of `monotone` do not give way to a longer time, and a bound gives way on both of its
/// sides: the least time by halving instead.
RotaryTime least_monotone_time(const RotaryProblem& problem, double least,
                               const RotarySettings& settings) {
  RotaryTime out;
  const auto holds = [&](double t) {
    RotaryResult there = smoothest_at(problem, t, out.q, settings);
    out.passes += std::max(1, there.passes);
    if (there.status != RotaryStatus::optimal) {
      out.why = there.why;
      return false;
    }
    out.status = RotaryStatus::optimal;
    out.factor = t;
    out.q = there.q;
    out.result = std::move(there);
    return true;
  };
  double below = least;
  if (holds(least)) return out;
  while (!holds(kStretch * below)) {
    below *= kStretch;
    if (below > kSlowest * least) return out;
  }
  while (out.factor > below * (1.0 + kMonotoneShare)) {
    const double middle = std::sqrt(below * out.factor);
    if (!holds(middle)) below = middle;
  }
  return out;
}

}  // namespace

RateLimits slowed(const RateLimits& limits, double t) {
  return {limits.velocity * t, limits.acceleration * t * t, limits.jerk * t * t * t};
}

double OrientationWindow::outside(const Vec3& axis) const {
  double worst = -1.0;
  for (const HalfSpace& h : half_spaces(*this)) worst = std::max(worst, h.least - h.normal.dot(axis));
  return worst;
}

RotaryResult optimise_rotaries(const RotaryProblem& problem, const RotarySettings& settings) {
  Passes passes(problem, settings);
  RotaryResult out;
  QpSettings banded = settings.solver;
  if (settings.hybrid) banded.solver = QpSolver::banded;
  QuadraticProgram qp;
  // The last pass that keeps every window: the answer when a later one has none.
  std::optional<std::pair<QuadraticProgram, RotaryResult>> kept;
  for (int pass = 0; pass < settings.most_passes; ++pass) {
    qp = passes.programme(1.0, scale_of(problem, 1.0));
    out.solution = solve_qp(qp, banded);
    if (!near_optimum(out.solution) && kept) {
      out.status = RotaryStatus::not_converged;
      break;
    }
    if (!near_optimum(out.solution)) {
      // Windows may be out of reach of the linear model: nearer by the elastic form, then again.
      QuadraticProgram elastic = qp;
      elastic.relaxation = by_cone(qp);
      out.why = feasibility(elastic, banded);
      out.status = RotaryStatus::too_fast;
      if (!usable(out.why.solution) || problem.windows.empty()) break;
      out.solution = out.why.solution;
    } else {
      out.status = RotaryStatus::not_converged;
      passes.learn(out.solution);
    }
    out.q = curve_of(qp, out.solution);
    passes.follow(out.q);
    out.passes = passes.passes();
    out.outside = passes.outside();
    if (out.status != RotaryStatus::not_converged) continue;
    // A solution that is near its optimum is good for a next pass, not for the answer.
    if (out.solution.status != QpStatus::optimal) continue;
    if (problem.windows.empty() || passes.settled(jerk_square(out.q))) {
      out.status = RotaryStatus::optimal;
      break;
    }
    if (out.outside <= kHolds) kept.emplace(qp, out);
  }
  if (out.status == RotaryStatus::not_converged && kept) {
    std::tie(qp, out) = std::move(*kept);
    out.status = RotaryStatus::optimal;
  }
  if (out.status == RotaryStatus::too_fast) out.status = verdict(qp, banded, out.why);
  if (out.status != RotaryStatus::optimal) return out;
  out.programme = std::move(qp);
  out.solution.objective = jerk_square(out.q);
  return settings.hybrid ? polish_rotaries(std::move(out), settings) : out;
}

RotaryResult polish_rotaries(RotaryResult result, const RotarySettings& settings) {
  require(result.status == RotaryStatus::optimal, "rotaries to polish");
  result.solution = solve_by_hybrid(result.programme, settings.solver, result.solution);
  if (result.solution.status == QpStatus::optimal)
    result.q = curve_of(result.programme, result.solution);
  else
    result.status = RotaryStatus::solver_failed;
  result.solution.objective = jerk_square(result.q);
  return result;
}

RotaryTime least_rotary_time(const RotaryProblem& problem, double least,
                             const RotarySettings& settings) {
  if (problem.monotone) return least_monotone_time(problem, least, settings);
  Passes passes(problem, settings);
  RotaryTime out;
  double t = least;
  for (int pass = 0; pass < settings.most_passes; ++pass) {
    QuadraticProgram qp = passes.programme(t, scale_of(problem, t));
    qp.relaxation = by_time(qp);
    const QpFeasibility answer = feasibility(qp, settings.solver);
    if (!usable(answer.solution)) {
      qp.relaxation = by_cone(qp);
      out.why = feasibility(qp, settings.solver);
      out.status = usable(out.why.solution) && out.why.shortfall > 1e-7
                       ? RotaryStatus::cone_empty
                       : RotaryStatus::solver_failed;
      if (out.status != RotaryStatus::cone_empty) return out;
      out.q = curve_of(qp, out.why.solution);
      passes.follow(out.q);
      out.passes = passes.passes();
      continue;
    }
    out.why = answer;
    out.q = curve_of(qp, answer.solution);
    const double before = t;
    // t(1 + 3τ)^(1/3) is a lower bound of the answer, t(1 + τ) an upper one.
    t = std::max(least, t * std::cbrt(std::max(1e-3, 1.0 + 3.0 * answer.shortfall)));
    passes.follow(out.q);
    out.passes = passes.passes();
    out.status = RotaryStatus::not_converged;
    if (passes.outside() < kNearlyHolds && std::abs(t / before - 1.0) < kTimeShare) break;
  }
  out.factor = t;
  if (out.status != RotaryStatus::not_converged) return out;
  // The least time itself leaves one spline, or none by rounding.
  for (const double spare : {0.0, 3e-3, 1e-2}) {
    if (spare == 0.0 && t > least) continue;
    RotaryResult there = smoothest_at(problem, t * (1.0 + spare), out.q, settings);
    if (there.status != RotaryStatus::optimal) continue;
    out.status = RotaryStatus::optimal;
    out.factor = t * (1.0 + spare);
    out.q = there.q;
    out.passes += there.passes;
    out.result = std::move(there);
    break;
  }
  return out;
}

}  // namespace smoothpost
