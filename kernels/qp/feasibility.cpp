#include <algorithm>
#include <cmath>

#include "kernels/qp/banded_solver.h"
#include "kernels/qp/equilibrate.h"
#include "kernels/qp/qp_solver.h"

namespace smoothpost {

namespace {

constexpr double kObjectiveShare = 1e-7;  // of the objective: makes the answer unique
constexpr double kLeastTau = -1.0;        // limits of ±1 have no room left there
constexpr double kUsualObjective = 1024;  // curvature of all pieces that needs no other share

Eigen::VectorXd limited_weights(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  Eigen::VectorXd weight(lower.size());
  for (Eigen::Index k = 0; k < weight.size(); ++k) weight[k] = lower[k] == upper[k] ? 0.0 : 1.0;
  return weight;
}

/// kObjectiveShare of an objective of the usual size.
double objective_share(const QuadraticProgram& qp) {
  const int local = qp.layout.local_size();
  double most = 0.0;
  for (int span = 0; span < qp.layout.spans(); ++span)
    most = std::max(most, qp.hessian.middleCols(span * local, local).diagonal().maxCoeff());
  const double whole = most * qp.layout.spans();
  const bool usual = whole <= kUsualObjective && whole * kUsualObjective >= 1.0;
  return usual || !(whole > 0.0) ? kObjectiveShare : kObjectiveShare / whole;
}

/// The limit with the largest share in the multiplier of τ.
void name_limit(const QuadraticProgram& qp, QpFeasibility& out) {
  const QpSolution& s = out.solution;
  const SplineLayout& layout = qp.layout;
  double largest = -1.0;
  for (int r = 0; r < qp.row_count(); ++r) {
    const double share = qp.relaxation->row_weight[r] * (s.row_lower[r] + s.row_upper[r]);
    if (share <= largest) continue;
    largest = share;
    out.name = qp.row_name[static_cast<std::size_t>(r)];
    out.place = qp.row_place[static_cast<std::size_t>(r)];
  }
  for (int c = 0; c < layout.channels; ++c)
    for (int level = 0; level <= layout.levels; ++level)
      for (int j = 0; j < layout.count(level); ++j) {
        const int k = layout.index(c, level, j);
        const double share = qp.relaxation->bound_weight[k] * (s.bound_lower[k] + s.bound_upper[k]);
        if (share <= largest) continue;
        largest = share;
        out.name = "bound";
        out.channel = c;
        out.level = level;
        out.place = layout.place(level, j);
      }
}

/// An answer, and whether the solver came to one.
struct Decision {
  QpFeasibility answer;
  bool solved = false;
};

/// Solves the elastic form of `qp` in the units of `scaled`.
Decision decide(const QuadraticProgram& qp, Equilibrated scaled, const QpSettings& settings) {
  QuadraticProgram& elastic = scaled.qp;
  if (!elastic.relaxation) {
    elastic.relaxation.emplace();
    elastic.relaxation->bound_weight = limited_weights(qp.lower, qp.upper);
    elastic.relaxation->row_weight = limited_weights(qp.row_lower, qp.row_upper);
  }
  elastic.relaxation->cost = 1.0;
  elastic.relaxation->lower = kLeastTau;
  const double share = objective_share(elastic);
  elastic.hessian *= share;
  elastic.gradient *= share;
  elastic.constant *= share;
  QpSettings s = settings;
  s.solver = QpSolver::banded;
  s.tolerance = std::max(settings.tolerance, 1e-8);
  QpFeasibility out;
  out.solution = solve_by_banded(elastic, s);
  out.shortfall = out.solution.tau;
  const bool solved =
      out.solution.status == QpStatus::optimal || out.solution.certificate.violation < 1e-7;
  out.feasible = solved && out.shortfall <= s.tolerance;
  name_limit(elastic, out);
  out.solution = in_given_units(scaled, std::move(out.solution));
  out.solution.objective = objective_value(qp, out.solution.x);
  return {std::move(out), solved};
}

/// The programme in the units that it was given in.
Equilibrated as_given(const QuadraticProgram& qp) {
  return {qp, Eigen::VectorXd::Ones(qp.layout.size()), Eigen::VectorXd::Ones(qp.row_count())};
}

}  // namespace

QpFeasibility feasibility(const QuadraticProgram& qp, const QpSettings& settings) {
  Decision scaled = decide(qp, equilibrated(qp), settings);
  if (scaled.solved) return std::move(scaled.answer);
  // Sizes are guessed from bounds and may mislead where only a few of them count.
  Decision given = decide(qp, as_given(qp), settings);
  return given.solved ? std::move(given.answer) : std::move(scaled.answer);
}

}  // namespace smoothpost
