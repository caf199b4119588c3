#include "kernels/optimise/tip_fit.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/qp/hybrid_solver.h"

namespace smoothpost {

namespace {

/// The point at parameter u on the polyline of the problem.
Vec3 on_polyline(const TipFitProblem& p, double u) {
  const auto above = std::upper_bound(p.u.begin(), p.u.end(), u);
  if (above == p.u.begin()) return p.points.front();
  if (above == p.u.end()) return p.points.back();
  const std::size_t i = static_cast<std::size_t>(above - p.u.begin());
  const double t = (u - p.u[i - 1]) / (p.u[i] - p.u[i - 1]);
  return p.points[i - 1] + t * (p.points[i] - p.points[i - 1]);
}

/// Control points on the polyline at their places: near the curve, and exact for straight ones.
Eigen::MatrixXd guess(const TipFitProblem& p, const SplineLayout& layout) {
  Eigen::MatrixXd controls(3, layout.controls());
  for (int j = 0; j < layout.controls(); ++j) controls.col(j) = on_polyline(p, layout.place(0, j));
  return controls;
}

/// The programme of one coordinate for what has to be added to the guess, in units of the
/// tolerance.
QuadraticProgram programme(const TipFitProblem& p, const SplineLayout& layout,
                           const Eigen::VectorXd& from, int coordinate) {
  const double box = p.tolerance / std::sqrt(3.0);
  const Eigen::VectorXd jerk = derivative_controls(p.knots, from, 3);
  const double scale = std::max(box, jerk.cwiseAbs().maxCoeff());
  QuadraticProgram qp = empty_program(layout);
  add_derivative_cost(qp, 0, 3, 1.0 / (scale * scale * layout.spans()));
  const Eigen::VectorXd lifted = lift(layout, from.transpose());
  const int local = layout.local_size();
  for (int i = 0; i < layout.spans(); ++i) {
    Eigen::VectorXd x(local);
    for (int k = 0; k < local; ++k) x[k] = lifted[layout.local_index(i, k)];
    qp.gradient.col(i) += qp.hessian.middleCols(i * local, local) * x;
  }
  std::vector<NewRow> rows;
  for (std::size_t i = 0; i < p.u.size(); ++i) {
    NewRow row;
    row.row = local_row(layout, 0, p.u[i], 0);
    const double miss = (p.points[i][coordinate] - bspline_value(p.knots, from, p.u[i])) / box;
    const double room = i == 0 || i + 1 == p.u.size() ? 0.0 : 1.0;
    row.lower = miss - room;
    row.upper = miss + room;
    row.row.weights /= box;
    row.name = "tip";
    row.place = p.u[i];
    rows.push_back(std::move(row));
  }
  set_rows(qp, rows);
  return qp;
}

}  // namespace

TipFit fit_tip(const TipFitProblem& p) {
  require(p.knots.degree == 5, "quintic splines");
  require(p.tolerance > 0.0, "tolerance > 0");
  require(p.u.size() == p.points.size() && p.u.size() >= 2, "a point for every parameter");
  SplineLayout layout = spline_layout(p.knots, 3, 1);
  layout.scale.setConstant(p.tolerance / std::sqrt(3.0));
  TipFit out;
  out.curve = {p.knots, guess(p, layout)};
  for (int c = 0; c < 3; ++c) {
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
    out.curve.controls.row(c) += controls_of(layout, s.x).row(0);
    out.solutions.push_back(std::move(s));
    if (out.failed >= 0) return out;
  }
  return out;
}

}  // namespace smoothpost
