#pragma once

#include <optional>
#include <string>

#include "kernels/qp/qp_solver.h"
#include "kernels/qp/sparse_program.h"

// Internal to kernels/qp.
namespace smoothpost {

/// Solves a programme with Ipopt: the lifted programme as a sparse problem with constant
/// derivatives, Mehrotra's predictor-corrector mode. Reads no option file, prints nothing. Threads
/// that call it at the same time take turns.
/// Built without Ipopt: status failed, and the message says so.
QpSolution solve_by_ipopt(const QuadraticProgram& qp, const QpSettings& settings);

/// What Ipopt itself says of a sparse programme.
struct IpoptAnswer {
  std::optional<SparsePoint> point;  ///< where it ended, whatever its status
  QpStatus status = QpStatus::failed;
  int iterations = 0;
  std::string word;  ///< its own, for messages
};
/// One call of Ipopt; settings.start is not read. Built without Ipopt: failed.
IpoptAnswer ask_ipopt(const SparseProgram& program, const SparsePoint* start,
                      const QpSettings& settings);

}  // namespace smoothpost
