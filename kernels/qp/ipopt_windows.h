#pragma once

#include "kernels/qp/qp_solver.h"

// Internal to kernels/qp.
namespace smoothpost {

/// How a programme is cut into windows, in control points of one channel.
struct QpWindows {
  int controls = 0;  ///< most of a window, without what it has in common with its neighbours
  int overlap = 0;   ///< on each side
};

/// Ipopt's optimum of a programme that is too large for one call, window by window.
///
/// `start` is an optimum. In each window Ipopt solves the programme with all control points (and
/// derivatives) outside the window held at what the windows before have made of `start`: the
/// bidiagonal equations at its ends are what it takes over from its neighbours. One sweep. The
/// solution is put together from all windows, multipliers too, each taking over from the one before
/// along what they have in common; its certificate is one of the whole programme. Windows are
/// solved to a thousandth of the tolerance, so that they fit. `windows` of the result is their
/// number, `iterations` the sum.
/// @pre no relaxation; windows.controls ≥ 16
/// @return status optimal with certificate.kkt() ≤ 100·tolerance; else that of the first window
/// that failed, or iteration_limit where the windows do not fit
/// Cost: linear.   Difference from solve_by_ipopt(): none in the result, beyond the tolerance.
QpSolution solve_by_windows(const QuadraticProgram& qp, const QpSettings& settings,
                            const QpSolution& start, const QpWindows& windows);

}  // namespace smoothpost
