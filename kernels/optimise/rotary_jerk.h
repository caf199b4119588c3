#pragma once

#include <optional>
#include <vector>

#include "kernels/kinematics/screw_chain.h"
#include "kernels/optimise/path_law.h"
#include "kernels/optimise/standoff.h"
#include "kernels/qp/qp_solver.h"

namespace smoothpost {

/// A half-space that a tool axis O has to lie in, for what is beside the path: normal·O ≥ least.
struct AxisCut {
  Vec3 normal = Vec3::UnitZ();  ///< unit
  double least = -1.0;
};

/// Where a tool axis may point at one place of a path: O with
///   tan(low) ≤ (O·T)/(O·N) ≤ tan(high) for lead, likewise O·B for tilt, angle(O, N) ≤ widest, and
/// inside of every cut.
struct OrientationWindow {
  double u = 0.0;
  Vec3 normal = Vec3::UnitZ(), tangent = Vec3::UnitX(), binormal = Vec3::UnitY();  ///< N, T, B
  double lead_low = 0.0, lead_high = 0.0;  ///< rad, inside (−π/2, π/2)
  double tilt_low = 0.0, tilt_high = 0.0;
  double widest = 1.5;  ///< rad
  std::vector<AxisCut> cuts = {};

  /// How far O is outside, rad-like: largest violated half-space with unit normal; ≤ 0: inside.
  double outside(const Vec3& axis) const;
};

/// Rotaries imposed at one place of a path (via point).
struct RotaryVia {
  double u = 0.0;
  std::array<double, 2> q{};  ///< rad, unwound
};

struct RotaryProblem {
  const ScrewChain* chain = nullptr;
  std::array<int, 2> joints{};              ///< the two rotaries
  JointVector held;                         ///< values of the other joints (they do not matter)
  SplineKnots knots;                        ///< quintic, clamped
  std::vector<OrientationWindow> windows;   ///< ascending u; empty: no cone
  std::vector<std::array<double, 2>> seed;  ///< rotaries at every window, unwound, to start from
  std::vector<RotaryVia> via;               ///< ascending u
  std::array<double, 2> lower{}, upper{};   ///< rad
  std::array<RateLimits, 2> limits;         ///< by u; infinity: none
  bool rest_at_ends = true;                 ///< q' = q'' = 0 at both ends
  bool monotone = false;  ///< between two vias no rotary turns back, flat where both are equal
  /// Given: the objective counts in time, and of `limits` only the jerk, by time, rad and s, weighs
  /// the rotaries; not with `monotone`.
  std::optional<PathLaw> law = std::nullopt;
};

struct RotarySettings {
  QpSettings solver;   ///< of the last pass; `hybrid` below
  bool hybrid = true;  ///< passes banded, the last programme once more by Ipopt
  int most_passes = 12;
  double cone_margin = 1e-7;  ///< by which the half-spaces are drawn in, rad
};

enum class RotaryStatus {
  optimal,
  cone_empty,  ///< no spline on these knots keeps the windows and vias, whatever the limits
  too_fast,    ///< the windows can be kept, but not inside the limits
  not_converged,
  solver_failed
};

struct RotaryResult {
  RotaryStatus status = RotaryStatus::solver_failed;
  SplineCurve q;        ///< two components, rad
  QpSolution solution;  ///< of the last pass; its objective Σ ∫ (q''')² du, rad²/u⁵, or
                        ///< with a law the mean of Σ (q⃛/limit)² over the time
  QuadraticProgram programme;  ///< of the last pass, when there is a solution
  int passes = 0;
  double outside = 0.0;  ///< largest OrientationWindow::outside at the windows
  QpFeasibility why;     ///< when there is no solution: which limit, where
};

/// minimise Σ_{c=1,2} ∫ (q_c''')² du over two quintic splines, under limits on the control points
/// of the first three derivatives, position limits, via points as equations and, at every window,
/// the orientation cone.
///
/// The half-spaces (tan(high)·N − T)·O ≥ 0, (T − tan(low)·N)·O ≥ 0 (B for tilt) and the pyramid
/// of 16 sides inside the widest cone are exact in O; O is linear in (q1, q2) about the last pass:
/// O ≈ O_r + Σ (w_c × O_r)(q_c − q_r,c). Sides of the pyramid that are more than 0.15 away stay out
/// of a pass. The second derivative of the windows' part of the Lagrangian by (q1, q2), with the
/// last pass' multipliers and as far as it is convex, is added to each programme (sequential
/// quadratic programming): it vanishes where passes stand still, and without it they swing where
/// the objective is flat. Passes repeat until the windows hold to 1e-9 and the rotaries stand still
/// to 1e-7 or the objective to 1e-5; one that violates more than the one before goes half the way.
/// With a law (the schedule of an earlier shape) the same in its metric: Σ ∫ (q⃛/limit)² dt by 5
/// Gauss points a piece, and no limits of derivatives: how fast the new shape may be is for its own
/// schedule to say. (Rows that keep it below its limits under the law make it cling to the old one:
/// Case 2 gains 1.1 % in two passes with them and 8.3 % without.)
/// Guarantees (tests): every window holds at its place; limits hold everywhere (control points);
/// KKT of the last programme; via points exact; deterministic; monotone: the control points of the
/// first derivative that reach between two vias have the sign of the step, 0 where it turns around.
/// Units: rad, u.   Cost: passes (about 6) × 30 iterations, linear in pieces and windows.
/// Implements [Ding2025] Eq. (57)-(61). Differences from the paper: the printed programme has no
/// condition between via points and turns up to 41° off there (test); via values have to be
/// unwound; windows at every cutter location take their place.
RotaryResult optimise_rotaries(const RotaryProblem& problem, const RotarySettings& settings = {});

/// The last programme of a result of optimise_rotaries(problem) once more by Ipopt: what `hybrid`
/// does.   @pre result.status optimal   @return solver_failed when Ipopt has no optimum
RotaryResult polish_rotaries(const RotaryProblem& problem, RotaryResult result,
                             const RotarySettings& settings);

/// By how much a stretch has to slow down so that the rotaries keep their limits, and why.
struct RotaryTime {
  RotaryStatus status = RotaryStatus::solver_failed;
  double factor = 1.0;  ///< t ≥ `least`: each piece has to take t times as long
  QpFeasibility why;    ///< which limit is tight at the least t
  SplineCurve q;        ///< rotaries that keep the limits at the factor
  RotaryResult result;  ///< optimise_rotaries() at the factor, by the banded solver; its q is `q`
  int passes = 0;
};

/// The least t ≥ `least` such that optimise_rotaries() has a solution when velocity limits are
/// multiplied by t, acceleration by t², jerk by t³ (StandoffTimeFactor has the method; here every
/// pass moves the cone's half-spaces too), to 1e-4. `factor` is 0.3 % more, where there is room for
/// the smoothest rotaries, and 1 % more where those are not found there; with time to spare it is
/// `least`. `monotone`: by halving, to 0.2 %, as the signs do not give way to a longer time.
/// Guarantees (tests): windows and limits hold at the factor; not 2 % below it; Case 2 of paper B.
RotaryTime least_rotary_time(const RotaryProblem& problem, double least,
                             const RotarySettings& settings = {});

/// The limits when a piece takes t times as long.
RateLimits slowed(const RateLimits& limits, double t);

}  // namespace smoothpost
