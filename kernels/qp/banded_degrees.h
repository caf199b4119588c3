#pragma once

#include "kernels/qp/qp_solver.h"

// Internal to kernels/qp: the interior point of each degree, in files of their own as they take
// long to compile. The certificate is not computed yet.
namespace smoothpost {

QpSolution run_cubic(const QuadraticProgram& qp, const QpSettings& settings);
QpSolution run_quintic(const QuadraticProgram& qp, const QpSettings& settings);

}  // namespace smoothpost
