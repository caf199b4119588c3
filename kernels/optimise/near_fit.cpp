#include "kernels/optimise/near_fit.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/qp/hybrid_solver.h"

namespace smoothpost {

namespace {

constexpr int kLevels = 3;

/// The values at parameter u on the polyline of the problem.
Eigen::VectorXd on_polyline(const NearFitProblem& p, double u) {
  const auto above = std::upper_bound(p.u.begin(), p.u.end(), u);
  if (above == p.u.begin()) return p.values.col(0);
  if (above == p.u.end()) return p.values.col(p.values.cols() - 1);
  const auto i = static_cast<Eigen::Index>(above - p.u.begin());
  const double before = *(above - 1);
  const double t = (u - before) / (*above - before);
  return p.values.col(i - 1) + t * (p.values.col(i) - p.values.col(i - 1));
}

/// Control points on the polyline at their places: near the curve, and exact for straight ones.
Eigen::MatrixXd guess(const NearFitProblem& p, const SplineLayout& layout) {
  Eigen::MatrixXd controls(p.values.rows(), layout.controls());
  for (int j = 0; j < layout.controls(); ++j) controls.col(j) = on_polyline(p, layout.place(0, j));
  return controls;
}

/// The derivatives of one channel at one end become what is asked for.
void fix_end(QuadraticProgram& qp, const SplineKnots& knots, const Eigen::VectorXd& from,
             const Eigen::MatrixXd& wanted, int channel, bool at_end) {
  for (int level = 1; level <= kLevels; ++level) {
    const int j = at_end ? qp.layout.count(level) - 1 : 0;
    const double held = derivative_controls(knots, from, level)[j];
    const int i = qp.layout.index(0, level, j);
    qp.lower[i] = qp.upper[i] = (wanted(channel, level - 1) - held) / qp.layout.scale(0, level);
  }
}

/// The programme of one channel for what has to be added to the guess, in units of the tolerance.
QuadraticProgram programme(const NearFitProblem& p, SplineLayout layout,
                           const Eigen::VectorXd& from, int channel) {
  const double box = p.tolerance[channel];
  layout.scale.setConstant(box);
  const Eigen::VectorXd jerk = derivative_controls(p.knots, from, kLevels);
  const double scale = std::max(box, jerk.cwiseAbs().maxCoeff());
  QuadraticProgram qp = empty_program(layout);
  add_derivative_cost(qp, 0, kLevels, 1.0 / (scale * scale * layout.spans()));
  const Eigen::VectorXd lifted = lift(layout, from.transpose());
  const int local = layout.local_size();
  for (int i = 0; i < layout.spans(); ++i) {
    Eigen::VectorXd x(local);
    for (int k = 0; k < local; ++k) x[k] = lifted[layout.local_index(i, k)];
    qp.gradient.col(i) += qp.hessian.middleCols(i * local, local) * x;
  }
  std::vector<bool> exact(p.u.size(), false);
  exact.front() = exact.back() = true;
  for (const std::size_t i : p.exact) exact[i] = true;
  std::vector<NewRow> rows;
  rows.reserve(p.u.size());
  for (std::size_t i = 0; i < p.u.size(); ++i) {
    NewRow row;
    row.row = local_row(layout, 0, p.u[i], 0);
    const double miss =
        (p.values(channel, static_cast<Eigen::Index>(i)) - bspline_value(p.knots, from, p.u[i])) /
        box;
    const double room = exact[i] ? 0.0 : 1.0;
    row.lower = miss - room;
    row.upper = miss + room;
    row.row.weights /= box;
    row.name = "tip";
    row.place = p.u[i];
    rows.push_back(std::move(row));
  }
  set_rows(qp, rows);
  if (p.start) fix_end(qp, p.knots, from, *p.start, channel, false);
  if (p.end) fix_end(qp, p.knots, from, *p.end, channel, true);
  return qp;
}

}  // namespace

NearFit fit_near(const NearFitProblem& p) {
  require(p.knots.degree == 5, "quintic splines");
  require(p.values.rows() == p.tolerance.size() && p.tolerance.minCoeff() > 0.0, "tolerance > 0");
  require(static_cast<Eigen::Index>(p.u.size()) == p.values.cols() && p.u.size() >= 2,
          "a value for every parameter");
  const SplineLayout layout = spline_layout(p.knots, kLevels, 1);
  NearFit out;
  out.curve = {p.knots, guess(p, layout)};
  for (int c = 0; c < p.values.rows(); ++c) {
    const Eigen::VectorXd from = out.curve.controls.row(c);
    const QuadraticProgram qp = programme(p, layout, from, c);
    QpSettings banded = p.solver;
    if (p.hybrid) banded.solver = QpSolver::banded;
    QpSolution s = solve_qp(qp, banded);
    if (s.status != QpStatus::optimal) {
      out.failed = c;
      if (p.explain) out.place = feasibility(qp, banded).place;
      out.solutions.push_back(std::move(s));
      return out;
    }
    if (p.hybrid) s = solve_by_hybrid(qp, p.solver, s);
    if (s.status != QpStatus::optimal) out.failed = c;
    out.curve.controls.row(c) += controls_of(qp.layout, s.x).row(0);
    out.solutions.push_back(std::move(s));
    if (out.failed >= 0) return out;
  }
  return out;
}

}  // namespace smoothpost
