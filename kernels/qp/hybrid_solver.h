#pragma once

#include "kernels/qp/qp_solver.h"

namespace smoothpost {

/// Of one channel or all together.
inline constexpr int kMostIpoptControls = 20000;

/// Ipopt's optimum of a programme whose optimum the banded solver has found already.
///
/// Ipopt gets the programme with those rows only that are near active at `banded` (slack below
/// 1e-3, or a multiplier); the others are checked at its optimum and added where they are violated,
/// until none is. Multipliers of rows that were left out are 0, so the certificate is one of the
/// whole programme.
/// Above kMostIpoptControls control points Ipopt would take a minute and more: the banded solution
/// stands, with its certificate and its own name. Without Ipopt in the build likewise.
/// @pre banded is a solution of qp with status optimal   @return Ipopt's; its own status when it
/// fails
QpSolution solve_by_hybrid(const QuadraticProgram& qp, const QpSettings& settings,
                           const QpSolution& banded);

}  // namespace smoothpost
