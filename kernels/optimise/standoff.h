#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "kernels/kinematics/head_geometry.h"
#include "kernels/optimise/path_law.h"
#include "kernels/qp/qp_solver.h"
#include "kernels/spline/bspline_basis.h"

namespace smoothpost {

/// Velocity, acceleration and jerk limits of one joint, by the path parameter u: the limit by time
/// divided by rate, rate², rate³ (rate in pieces per second). Infinity: no limit.
struct RateLimits {
  double velocity = std::numeric_limits<double>::infinity();
  double acceleration = std::numeric_limits<double>::infinity();
  double jerk = std::numeric_limits<double>::infinity();
};

/// Where q6 has to be at one place of the path, mm; infinity: no limit.
struct StandoffBound {
  double u = 0.0;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// Position range, limits and weights of optimise_standoff().
struct StandoffOptions {
  double lower = 0.0, upper = 0.0;   ///< of q6, mm, the reserve taken off already; lower < upper
  RateLimits standoff;               ///< of q6
  std::array<RateLimits, 3> linear;  ///< of q1 … q3; rows at `rows_per_span` places of each piece
  int rows_per_span = 3;             ///< equally spaced from the piece's start, and the last knot
  double regularisation = 1e-6;      ///< ε of the term ε·∫ q6'''²
  /// Share of the held standoff's Σ ∫ (q_i''')² du that the mean of ((q6 − middle)/(half range))²
  /// costs: makes q6 unique where any parabola is as smooth (constant tool axis).
  double pull = 1e-9;
  bool rest_at_ends = true;       ///< q6' = q6'' = 0 at both ends
  double start = 0.0, end = 0.0;  ///< q6 at the ends that are fixed, mm, in range
  bool fixed_start = false, fixed_end = false;
  std::vector<StandoffBound> bounds = {};  ///< in any order
  /// Given: the objective counts in time, and limits of derivatives do not count.
  std::optional<PathLaw> law = std::nullopt;
  QpSettings solver;
  bool hybrid = false;  ///< banded, then once more by Ipopt (solve_by_hybrid)
};

/// The standoff that makes the linear axes smoothest, for given tip and rotaries.
struct StandoffResult {
  /// Its x are the lifted variables of q6 − (lower + upper)/2, scaled. Its objective is unscaled:
  /// Σ ∫ (q_i''')² du + ε ∫ (q6''')² du and the pull, mm²/u⁵; with a law Σ ∫ (q⃛_i)² dt, mm²/s⁵.
  QpSolution solution;
  QpFeasibility feasibility;  ///< asked when it has no solution; relaxed as for the time factor
  SplineCurve q6;             ///< one component; the held standoff when there is no solution
  /// Σ ∫ (q_i''')² du (with a law ∫ (q⃛_i)² dt) with q6 held in mid-range or at `start`
  double jerk_before = 0.0;
  double jerk_after = 0.0;  ///< the same with q6
};

/// minimise over a quintic spline q6(u), on the knots of the rotaries,
///   Σ_{i=1..3} ∫ (q_i''')² du + ε ∫ (q6''')² du,   q_i = a_i(u) + b_i(u) q6(u) (HeadGeometry),
/// by 5 Gauss points a piece, under lower ≤ q6 ≤ upper, |q6'|, |q6''|, |q6'''| limits on control
/// points, |q_i'|, |q_i''|, |q_i'''| limits at places of each piece, the bounds at their places,
/// and q6' = q6'' = 0 at the ends. Where a limit of q1 … q3 is exceeded between those places
/// (looked for at 12 places a piece and the parabolas through them) its rows are narrowed by that
/// share and 2e-4, and the programme is solved again, at most three times. With a law (the schedule
/// of an earlier shape) the same in its metric: q⃛_i and dt in the objective, ε ∫ (q6''')² at its
/// mean speed, range and bounds of q6, and no other limits: they are its own schedule's. Convex;
/// tip and tool axis are not touched by any q6. Guarantees (tests): golden qp_q6 of paper_b.json;
/// limits hold on a dense grid, bounds at their places; the tip stays to 1e-9 mm; not above the
/// held standoff. Units: mm, rad, and u as the knots have it (unit pieces keep the numbers well
/// conditioned). Cost: linear in the pieces, allocates.
/// @param tip 3 components, mm, W   @param rotary 2 components, rad; both on clamped quintic knots
/// over the same range; `tip` may have other knots.
/// @pre as said at the parameters; limits > 0, rows_per_span ≥ 1, ε and pull ≥ 0, ends in range
/// @throws ContractViolation if not.
/// Implements [Ding2025] Eq. (46)-(54), (62). Differences from the paper: see docs/equations.md.
StandoffResult optimise_standoff(const HeadGeometry& head, const SplineCurve& tip,
                                 const SplineCurve& rotary, const StandoffOptions& settings);

/// By how much a stretch has to slow down so that some q6 keeps every limit, and why.
struct StandoffTimeFactor {
  bool found = false;   ///< false: a solver broke down
  double factor = 1.0;  ///< t ≥ 1; the limits can be kept with this one
  int joint = -1;       ///< that is at its limit at the factor: index in the chain; −1: t = 1
  int derivative = 0;   ///< of it: 1 velocity, 2 acceleration, 3 jerk
  double place = 0.0;   ///< u of it
  int solves = 0;
};

/// The least t ≥ 1 for which optimise_standoff() is feasible when each piece takes t times as long:
/// velocity limits times t, acceleration t², jerk t³, those of q6 and of q1 … q3.
///
/// By Newton's method on the elastic programme "least τ with velocities ≤ t(1 + τ), accelerations ≤
/// t²(1 + 2τ), jerks ≤ t³(1 + 3τ)" in units of the limits. Because (1 + lτ)^(1/l) falls with l,
/// t(1 + 3τ)^(1/3) ≤ t* ≤ t(1 + τ): every programme gives a bracket, and near the solution its
/// width is τ².
/// Guarantees (tests): feasible at the factor, infeasible 1e-4 below it.
/// Units, @param, @pre as optimise_standoff(), without a law.   Cost: three to six programmes.
StandoffTimeFactor least_standoff_time(const HeadGeometry& head, const SplineCurve& tip,
                                       const SplineCurve& rotary, const StandoffOptions& settings);

}  // namespace smoothpost
