#pragma once

#include <cstdint>
#include <vector>

#include "kernels/spline/acr_basis.h"

namespace smoothpost {

/// g and its derivatives by u.
struct BlendValue {
  double value = 0.0, d1 = 0.0, d2 = 0.0, d3 = 0.0;
};

/// A blend function g: 0 for u ≤ −reach, u for u ≥ reach, C³ everywhere, g(u) − u = g(−u). A corner
/// made with it, r(σ) = A(σ) + h·g(σ/h)·(B(σ) − A(σ))/σ, goes from leg A to leg B (corner_path.h).
///
///  - acr: the paper's corner curve. The control points of [Cai2025] Eq. (14) are affine in the
///    corner, so the curve is h·(−a(t)·T0 + b(t)·T1) with a, b ACR splines of the weights of
///    acr_spline.h; σ = h(b − a), h·g = h·b. reach = 3/2, g(0) = 1/4; not monotone (it undershoots
///    to about −0.0059 and dg/du lies in [−0.033, 1.033] for κ = λ = 1/2; [−0.1, 1.1] for all
///    shapes).
///  - ramp: g'' = (1−u²)²(c0 + c1·u²), c0 = 15/16 − c1/7. reach = 1, g(0) = c0/6 + c1/24; convex.
///
/// Guarantees (tests): limits with value, slope 0 or 1, second and third derivative 0; C³ at every
/// inner knot; the symmetry above; |g(−u)| ≤ g(0)·(1 − u/reach) for u ≥ 0; acr equals the spline
/// through acr_corner_points() as a curve; ramp convex; derivatives equal central differences.
/// Units: none.   Cost: acr about 0.3 µs (a Newton iteration on a monotone septic), ramp 10 ns; no
/// allocation.
class BlendFunction {
 public:
  /// @pre 0.4 ≤ κ ≤ 0.6 and −0.5 ≤ λ ≤ 2.5 (σ(t) is monotone there)   @throws ContractViolation.
  static BlendFunction acr(const AcrShape& shape);
  /// @pre −1.09 ≤ c1 ≤ 6.56 (convex)   @throws ContractViolation if not.
  static BlendFunction ramp(double c1);

  BlendValue at(double u) const;
  double reach() const { return kind_ == Kind::acr ? 1.5 : 1.0; }
  double at_zero() const;
  /// Where |u| passes from one formula to the next inside (0, reach), ascending.
  std::vector<double> knots() const;
  /// An upper bound of |g''|; for acr by a scan (30 µs, κ = λ = 1/2 free).
  double second_derivative_bound() const;
  bool is_acr() const { return kind_ == Kind::acr; }
  /// κ and λ of acr.   @pre is_acr()
  AcrShape shape() const { return {first_parameter_, second_parameter_}; }
  /// c1 of ramp.   @pre !is_acr()
  double c1() const { return first_parameter_; }

 private:
  enum class Kind : std::uint8_t { acr, ramp };
  BlendFunction(Kind kind, double first, double second)
      : first_parameter_(first), second_parameter_(second), kind_(kind) {}
  BlendValue acr_at(double u) const;
  BlendValue ramp_at(double u) const;

  double first_parameter_;   ///< κ or c1
  double second_parameter_;  ///< λ
  Kind kind_;
};

/// κ and λ of acr that keep the spline's span Q2 … Q3 nearest to the leg, for a corner that turns
/// by θ (rad): least squares over t of the distance to the point of the leg at t, in all
/// coordinates. Guarantee (test): no other pair does better; κ in [0.50, 0.52], λ in [2.03, 2.11].
/// Cost: about 0.5 µs.   @pre 0 < θ < π
/// Implements [Cai2025] Eq. (30)–(37). Differences from the paper: it measures over its first
/// coordinate, which fails on legs along or across it; Eq. (34) lacks two factors 2; its program
/// has the wrong sign of m2 (the tables of examples/paper_a_tables reproduce both). The shape bends
/// more than κ = λ = 1/2: it only flattens that one span.
AcrShape acr_fit(double turn);

/// The c1 of ramp for a corner that turns by θ (rad): near the least peak of the third derivative.
/// c1 = clamp(0.0372·θ° − 1.3, −0.35, 5.9), a fit (heuristic, not an optimum).
double ramp_c1(double turn);

}  // namespace smoothpost
