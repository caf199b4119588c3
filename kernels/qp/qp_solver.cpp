#include "kernels/qp/qp_solver.h"

#include "kernels/qp/banded_solver.h"
#include "kernels/qp/ipopt_solver.h"

namespace smoothpost {

QpSolution solve_qp(const QuadraticProgram& qp, const QpSettings& settings) {
  return settings.solver == QpSolver::ipopt ? solve_by_ipopt(qp, settings)
                                            : solve_by_banded(qp, settings);
}

}  // namespace smoothpost
