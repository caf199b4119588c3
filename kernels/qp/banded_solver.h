#pragma once

#include "kernels/qp/qp_solver.h"

namespace smoothpost {

/// Mehrotra's predictor-corrector interior point for one programme.
///
/// The equations of the layout are never equations of the linear systems: piece i has the state
/// T^0_i … T^{L−1}_i, T^L_i … (k numbers a channel) and one new number T^L_{i+k−L}, and the
/// layout's equations say the state of piece i + 1. Every Newton system is then a linear-quadratic
/// problem along the pieces, factored backwards (Riccati, on factors UDUᵀ that only grow) in
/// O(spans·local²·(limits a piece)) and solved forwards. Weights of the user's equations and of
/// active limits are at most 1e6; what that leaves of the Newton system is solved for again
/// (primal-dual regularisation with refinement). Order of the pivots, and with it every bit of the
/// result, is fixed.
///
/// A `start` with x and multipliers of this layout and as many rows, near the optimum, saves about
/// half of the iterations; when it leads nowhere the programme is solved once more without it.
/// Programmes with a relaxation do not use it.
///
/// Needs channels ≤ 3 and degree 3 or 5.   @throws ContractViolation for other layouts.
/// Rounding leaves a certificate of about 1e-10; of 9,000 random programmes of the tests' kind none
/// failed, and one took more than 40 iterations. Cost: 8 to 25 iterations of 0.6 to 0.9 µs a
/// piece (one channel).
QpSolution solve_by_banded(const QuadraticProgram& qp, const QpSettings& settings);

}  // namespace smoothpost
