#pragma once

#include "kernels/qp/qp_solver.h"

namespace smoothpost {

/// Control points of all channels together that Ipopt solves in one call.
inline constexpr int kMostIpoptControls = 20000;

/// Ipopt's optimum of a programme whose optimum the banded solver has found already.
///
/// Ipopt gets the programme with those rows only that are near active at `banded` (slack below
/// 1e-3, or a multiplier); the others are checked at its optimum and added where they are violated,
/// until none is. Multipliers of rows that were left out are 0, so the certificate is one of the
/// whole programme.
/// Above `most` control points Ipopt works window by window, each of at most half as many with what
/// is outside held, and the certificate is of the whole (solve_by_windows); `windows` is their
/// number. Without Ipopt in the build the banded solution stands, under its own name.
/// @pre banded is a solution of qp with status optimal   @return Ipopt's; its own status when it
/// fails
QpSolution solve_by_hybrid(const QuadraticProgram& qp, const QpSettings& settings,
                           const QpSolution& banded, int most = kMostIpoptControls);

}  // namespace smoothpost
