#pragma once

#include "kernels/qp/qp_solver.h"

// Internal to kernels/qp.
namespace smoothpost {

/// Solves a programme with Ipopt: the lifted programme as a sparse problem with constant
/// derivatives, Mehrotra's predictor-corrector mode. Reads no option file, prints nothing. Threads
/// that call it at the same time take turns.
/// Built without Ipopt: status failed, and the message says so.
QpSolution solve_by_ipopt(const QuadraticProgram& qp, const QpSettings& settings);

}  // namespace smoothpost
