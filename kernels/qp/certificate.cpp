#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/qp/layout_equations.h"
#include "kernels/qp/qp_solver.h"

namespace smoothpost {
namespace {

/// lower ≤ value ≤ upper with its two multipliers; the limits with what they give way already.
struct Limited {
  double value, lower, upper;
  double at_lower, at_upper;
  bool equation;  ///< of the user: the difference of the multipliers may be anything
};

struct Measured {
  QpCertificate certificate;
  double objective_scale = 1.0;
};

void measure_side(Measured& measured, double slack, double multiplier) {
  QpCertificate& c = measured.certificate;
  c.violation = std::max(c.violation, -slack);
  // Without a limit there is nothing to be complementary to: no multiplier is right.
  c.sign = std::max(c.sign, std::isinf(slack) ? std::abs(multiplier) : -multiplier);
  if (std::isinf(slack)) return;
  c.complementarity =
      std::max(c.complementarity, std::abs(multiplier * slack) / measured.objective_scale);
}

void measure(Measured& measured, const Limited& limited) {
  if (limited.equation) {
    measured.certificate.violation =
        std::max(measured.certificate.violation, std::abs(limited.value - limited.lower));
    return;
  }
  measure_side(measured, limited.value - limited.lower, limited.at_lower);
  measure_side(measured, limited.upper - limited.value, limited.at_upper);
}

void measure_limits(Measured& measured, const QuadraticProgram& qp, const QpSolution& solution) {
  const Relaxation* relaxed = qp.relaxation ? &*qp.relaxation : nullptr;
  for (Eigen::Index i = 0; i < solution.x.size(); ++i) {
    const double way = relaxed ? relaxed->bound_weight(i) * solution.tau : 0.0;
    measure(measured,
            {solution.x(i), qp.lower(i) - way, qp.upper(i) + way, solution.bound_lower(i),
             solution.bound_upper(i),
             qp.lower(i) == qp.upper(i) && (!relaxed || relaxed->bound_weight(i) == 0.0)});
  }
  const Eigen::VectorXd values = row_values(qp, solution.x);
  for (Eigen::Index r = 0; r < values.size(); ++r) {
    const double way = relaxed ? relaxed->row_weight(r) * solution.tau : 0.0;
    measure(measured,
            {values(r), qp.row_lower(r) - way, qp.row_upper(r) + way, solution.row_lower(r),
             solution.row_upper(r),
             qp.row_lower(r) == qp.row_upper(r) && (!relaxed || relaxed->row_weight(r) == 0.0)});
  }
}

/// The multiplier of τ ≥ lower is not in the solution: either it is 0, and what is left of the
/// stationarity in τ counts, or it is all of that, and its product with τ's slack counts.
void measure_tau(Measured& measured, const Relaxation& relaxed, const QpSolution& solution) {
  QpCertificate& c = measured.certificate;
  const double held =
      relaxed.bound_weight.dot(solution.bound_lower + solution.bound_upper) +
      (relaxed.row_weight.size() ? relaxed.row_weight.dot(solution.row_lower + solution.row_upper)
                                 : 0.0);
  const double left = relaxed.cost - held;
  const double slack = solution.tau - relaxed.lower;
  c.violation = std::max(c.violation, -slack);
  const double stationarity =
      std::abs(left) / (1.0 + std::max(std::abs(relaxed.cost), std::abs(held)));
  const double complementarity = std::abs(left * slack) / measured.objective_scale;
  if (left > 0.0 && complementarity < stationarity) {
    c.complementarity = std::max(c.complementarity, complementarity);
  } else {
    c.stationarity = std::max(c.stationarity, stationarity);
  }
}

bool all_finite(const QpSolution& s) {
  return s.x.allFinite() && std::isfinite(s.tau) && s.bound_lower.allFinite() &&
         s.bound_upper.allFinite() && s.row_lower.allFinite() && s.row_upper.allFinite();
}

}  // namespace

std::string to_string(QpStatus status) {
  switch (status) {
    case QpStatus::optimal:
      return "optimal";
    case QpStatus::infeasible:
      return "infeasible";
    case QpStatus::iteration_limit:
      return "iteration limit";
    case QpStatus::failed:
      return "failed";
  }
  return "unknown";
}

std::string to_string(QpSolver solver) { return solver == QpSolver::banded ? "banded" : "ipopt"; }

double QpCertificate::kkt() const {
  return std::max({stationarity, violation, complementarity, sign});
}

QpCertificate certify(const QuadraticProgram& qp, const QpSolution& solution) {
  Measured measured;
  const LagrangianGradient gradient = lagrangian_gradient(qp, solution);
  if (!all_finite(solution) || !gradient.value.allFinite()) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {kInfinity, kInfinity, kInfinity, kInfinity};
  }
  measured.objective_scale = 1.0 + std::abs(objective_value(qp, solution.x));
  const Eigen::VectorXd left = with_equation_terms(
      qp.layout, equation_multipliers(qp.layout, gradient.value), gradient.value);
  measured.certificate.stationarity = left.lpNorm<Eigen::Infinity>() / gradient.scale;
  for (const LayoutEquation& e : layout_equations(qp.layout)) {
    const double off = solution.x(e.next) - solution.x(e.last) - e.step * solution.x(e.rate);
    measured.certificate.violation = std::max(measured.certificate.violation, std::abs(off));
  }
  measure_limits(measured, qp, solution);
  if (qp.relaxation) measure_tau(measured, *qp.relaxation, solution);
  return measured.certificate;
}

}  // namespace smoothpost
