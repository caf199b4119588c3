#include "kernels/qp/banded_degrees.h"
#include "kernels/qp/interior_point.h"

namespace smoothpost {

QpSolution run_quintic(const QuadraticProgram& qp, const QpSettings& settings) {
  return run_interior_point<6>(qp, settings);
}

}  // namespace smoothpost
