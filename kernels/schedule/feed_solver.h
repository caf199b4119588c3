#pragma once

#include <cstddef>
#include <vector>

#include "kernels/schedule/feed_grid.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// The optimisation on one grid: find the controls x of b(w) > 0 of least T = ∫ b^{−1/2} dw with,
/// at every point and lane,
///   b ≤ cap,   |AR·(b, b')| ≤ 1,   |JR·(b, b', b'')| ≤ b^{−1/2},
///   AR = (q_ww, q_w/2)/A,   JR = (q_www, 3/2 q_ww, q_w/2)/J.
struct FeedProgram {
  const FeedGrid* grid = nullptr;
  const FeedLanes* lanes = nullptr;
  /// Factors of the rows of a point, > 1 draws the limits in: velocity (cap is divided by its
  /// square), acceleration, jerk.
  struct Factors {
    double velocity = 1.0, acceleration = 1.0, jerk = 1.0;
  };
  std::vector<Factors> factors;  ///< one a point
  int fixed_first = 0;           ///< that many first controls stay as they start
  int fixed_last = 0;
  const std::function<bool()>* going = nullptr;  ///< FeedStretch::going
};

struct FeedSolverSettings {
  double tolerance = 1e-6;  ///< of the duality gap, relative to T
  int iterations = 120;
};

struct FeedSolution {
  std::vector<double> controls;
  double time = 0.0;  ///< the quadrature of T
  bool converged = false;
  bool feasible = false;  ///< rows kept to 1e-8 at the points
  int iterations = 0;
};

/// Primal-dual interior point with the exact Hessian of the Lagrangian, clipped below; the jerk
/// rows are concave in b only through b^{−1/2}, whose linearisation lies inside, so a feasible
/// iterate stays feasible. From a start that breaks rows it finds into them where it can.
///
/// One iteration: rows as c(x) − s = 0, s, z > 0; H dx = −∇f − Σ g d ρ + σμ Σ g/s with d = z/s,
/// ρ = c − s, band Cholesky of half-width 3; steps of 0.99 to the boundary. Stops when s·z is below
/// tolerance·f and either the dual residual is below 1e-3 or T rests.
/// Guarantee (test): golden coefficients of the reference.
/// Deterministic: sums in fixed order.   Cost: about 0.2 µs a point and iteration with 8 lanes
/// (feed_passes.h).
/// @pre start has grid.controls() numbers and b > 0 at every point   @throws ContractViolation
/// Not from a paper; docs/equations.md.
FeedSolution solve_feed(const FeedProgram& program, std::vector<double> start,
                        const FeedSolverSettings& settings);

/// Largest ratios of a law b at the points: velocity, acceleration, jerk against the drawn-in
/// limits. All are ≤ 1 where the law is feasible; with b/c² they fall by c, c², c³.
FeedProgram::Factors point_ratios(const FeedProgram& program, const std::vector<double>& controls);

/// The least factor of all times, for each element by itself, that would bring its points inside:
/// max(v, √a, ∛j) of their ratios, not below 0.
std::vector<double> element_dilations(const FeedProgram& program,
                                      const std::vector<double>& controls);

/// Largest β for which b = β keeps every row at the points.
double constant_law(const FeedProgram& program);

}  // namespace smoothpost
