#include "kernels/qp/banded_degrees.h"
#include "kernels/qp/interior_point.h"

namespace smoothpost {

QpSolution run_cubic(const QuadraticProgram& qp, const QpSettings& settings) {
  return run_interior_point<4>(qp, settings);
}

}  // namespace smoothpost
