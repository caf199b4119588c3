#include "kernels/optimise/rotary_jerk.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "kernels/core/contract.h"
#include "kernels/optimise/rotary_passes.h"
#include "kernels/qp/hybrid_solver.h"

namespace smoothpost {

namespace {

constexpr double kTimeShare = 1e-4;    // relative accuracy of the least time
constexpr double kNearlyHolds = 1e-3;  // a window is kept well enough to know the least time

constexpr double kStretch = 1.5;  // of the time, until a monotone motion is found
constexpr double kSlowest = 100.0;
constexpr double kMonotoneShare = 2e-3;  // relative accuracy of its least time

SplineCurve curve_of(const QuadraticProgram& qp, const QpSolution& s) {
  return {qp.layout.knots, controls_of(qp.layout, s.x)};
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
  for (const HalfSpace& h : half_spaces(*this))
    worst = std::max(worst, h.least - h.normal.dot(axis));
  return worst;
}

RotaryResult optimise_rotaries(const RotaryProblem& problem, const RotarySettings& settings) {
  RotaryPasses passes(problem, settings);
  RotaryResult out;
  QpSettings banded = settings.solver;
  if (settings.hybrid) banded.solver = QpSolver::banded;
  QuadraticProgram qp;
  // The last pass that keeps every window: the answer when a later one has none.
  std::optional<std::pair<QuadraticProgram, RotaryResult>> kept;
  for (int pass = 0; pass < settings.most_passes; ++pass) {
    qp = passes.programme(1.0);
    QpSettings from = banded;
    from.start = passes.start();
    out.solution = solve_qp(qp, from);
    // A start from another pass may be a bad one.
    if (from.start && !near_optimum(out.solution)) out.solution = solve_qp(qp, banded);
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
    if (problem.windows.empty() || passes.settled(rotary_objective(problem, out.q))) {
      out.status = RotaryStatus::optimal;
      break;
    }
    if (out.outside <= RotaryPasses::kHolds) kept.emplace(qp, out);
  }
  if (out.status == RotaryStatus::not_converged && kept) {
    std::tie(qp, out) = std::move(*kept);
    out.status = RotaryStatus::optimal;
  }
  if (out.status == RotaryStatus::too_fast) out.status = verdict(qp, banded, out.why);
  if (out.status != RotaryStatus::optimal) return out;
  out.programme = std::move(qp);
  out.solution.objective = rotary_objective(problem, out.q);
  return settings.hybrid ? polish_rotaries(problem, std::move(out), settings) : out;
}

RotaryResult polish_rotaries(const RotaryProblem& problem, RotaryResult result,
                             const RotarySettings& settings) {
  require(result.status == RotaryStatus::optimal, "rotaries to polish");
  result.solution = solve_by_hybrid(result.programme, settings.solver, result.solution);
  if (result.solution.status == QpStatus::optimal)
    result.q = curve_of(result.programme, result.solution);
  else
    result.status = RotaryStatus::solver_failed;
  result.solution.objective = rotary_objective(problem, result.q);
  return result;
}

RotaryTime least_rotary_time(const RotaryProblem& problem, double least,
                             const RotarySettings& settings) {
  require(!problem.law, "a longer time for limits by u");
  if (problem.monotone) return least_monotone_time(problem, least, settings);
  RotaryPasses passes(problem, settings);
  RotaryTime out;
  double t = least;
  for (int pass = 0; pass < settings.most_passes; ++pass) {
    QuadraticProgram qp = passes.programme(t);
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
