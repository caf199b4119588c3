#pragma once

#include <array>

#include "kernels/schedule/feed_solver.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// The collocation points of one element as the interior point goes over them: pointers to the
/// first point's numbers, the other points' behind them.
///
/// A lane has four rows, each of the form c(b, b', b'') − s = 0 with s, z > 0:
///   1 ∓ AR·(b, b') and b^{−1/2} ∓ JR·(b, b', b''),
/// at [row·width + lane] of a point; the cap has one, 1 − b·inv_cap.
struct ElementRows {
  int nodes = 0;
  const double* q = nullptr;        ///< FeedGrid::rows
  const double* basis = nullptr;    ///< 12: what the four controls give to b, to b', to b''
  const double* inv_cap = nullptr;  ///< drawn in
  const double* weight = nullptr;   ///< of the point in the objective
  const FeedProgram::Factors* factors = nullptr;
  const FeedLanes* lanes = nullptr;
  double* s = nullptr;  ///< 4·width
  double* z = nullptr;
  double* cap_s = nullptr;
  double* cap_z = nullptr;
};

/// The four controls of an element and their change.
struct ElementControls {
  const double* x = nullptr;
  const double* dx = nullptr;
};

/// The largest −ds/s and −dz/z.
struct FeedFalls {
  double primal = 0.0, dual = 0.0;
};

/// The centring σμ of a step, and the shares of it that are gone.
struct FeedStep {
  double centre = 0.0, primal = 0.0, dual = 0.0;
};

/// What an element gives to the Newton system of its four controls, and to the whole.
struct ElementSums {
  std::array<double, 16> hessian{};  ///< full
  std::array<double, 4> dual{};      ///< ∇f − Σ g z, its negative
  std::array<double, 4> drift{};     ///< −∇f − Σ g d ρ
  std::array<double, 4> centre{};    ///< Σ g/s
  double objective = 0.0;            ///< Σ weight b^{−1/2}
  double gap = 0.0;                  ///< s·z
  double lack = 0.0;                 ///< least c − s, at most 0
};

/// Passes over the lanes of an element's points, compiled twice (with four lanes an instruction
/// where the processor has AVX2): the same operations in the same order, so the same bits.
/// Cost: 0.05 µs a point at 8 lanes for the falls, 0.13 for a step.   @param width  8 or 16
FeedFalls element_falls(int width, const ElementRows& rows, const ElementControls& at,
                        double centre);

/// s and z after the step, then the sums at x + step.primal·dx. New slacks are c there, or what the
/// linearised rows say where that is more.
ElementSums element_step(int width, const ElementRows& rows, const ElementControls& at,
                         const FeedStep& step);

/// The sums at x (dx is not read).
ElementSums element_sums(int width, const ElementRows& rows, const ElementControls& at);

/// c of every row of every point (4·width each) at x.
void element_slacks(int width, const ElementRows& rows, const double* x, double* c);

}  // namespace smoothpost
