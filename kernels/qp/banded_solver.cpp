#include "kernels/qp/banded_solver.h"

#include "kernels/core/contract.h"
#include "kernels/qp/banded_degrees.h"

namespace smoothpost {

namespace {

QpSolution solve_once(const QuadraticProgram& qp, const QpSettings& settings) {
  QpSolution out =
      qp.layout.knots.degree == 5 ? run_quintic(qp, settings) : run_cubic(qp, settings);
  out.certificate = certify(qp, out);
  const bool accurate = out.certificate.kkt() <= 10.0 * settings.tolerance;
  if (accurate)
    out.status = QpStatus::optimal;
  else if (out.status == QpStatus::optimal)
    out.status = QpStatus::failed;
  return out;
}

}  // namespace

QpSolution solve_by_banded(const QuadraticProgram& qp, const QpSettings& settings) {
  const int degree = qp.layout.knots.degree;
  require(degree == 3 || degree == 5, "the banded solver takes cubic and quintic splines");
  require(qp.layout.channels >= 1 && qp.layout.channels <= 3, "1 to 3 channels");
  require(qp.layout.levels < degree, "fewer lifted derivatives than the degree");
  const QpSolution out = solve_once(qp, settings);
  if (!settings.start || out.status == QpStatus::optimal) return out;
  QpSettings cold = settings;
  cold.start = nullptr;
  return solve_once(qp, cold);
}

}  // namespace smoothpost
