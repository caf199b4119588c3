#pragma once

#include "kernels/qp/qp_solver.h"

namespace smoothpost {

/// Mehrotra's predictor-corrector interior point for one programme.
///
/// The equations of the layout are never equations of the linear systems: piece i has the state
/// T^0_i … T^{L−1}_i, T^L_i … (k numbers a channel) and one new number T^L_{i+k−L}, and the
/// layout's equations say the state of piece i + 1. Every Newton system is then a linear-quadratic
/// problem along the pieces, factored backwards (Riccati) in O(spans·local²) and solved forwards;
/// equations of the user are stiff (1/δ) and made exact by refinement. Order of the pivots, and
/// with it every bit of the result, is fixed.
///
/// Needs channels ≤ 3 and degree 3 or 5.   @throws ContractViolation for other layouts.
/// Late weights are stiff against what a smooth spline costs: about one in twelve random programmes
/// of the tests ends at a certificate of 1e-8 … 1e-6 by rounding and says `failed`; its violation
/// is below 1e-8 all the same. Cost: 8 to 30 iterations of about 0.3 µs a piece (one channel).
QpSolution solve_by_banded(const QuadraticProgram& qp, const QpSettings& settings);

}  // namespace smoothpost
