#pragma once

#include <Eigen/Core>

namespace smoothpost {

/// The two free numbers of an adjustable Catmull-Rom (ACR) spline; dimensionless.
struct AcrShape {
  double kappa = 0.5;   ///< slope at a knot: κ (p₁ − p₋₁)
  double lambda = 0.5;  ///< second derivative at a knot: 2λ (p₋₁ − 2p₀ + p₁)
};

/// Weights of the four control points of one adjustable Catmull-Rom (ACR) span.
///
/// Returns b with   value(t) = b[0]·p₋₁ + b[1]·p₀ + b[2]·p₁ + b[3]·p₂,   t ∈ [0, 1];
/// for `order` = r > 0 the weights give the r-th derivative by t. The span is the septic Hermite
/// polynomial with the knot derivatives of AcrShape and third derivative 0 at both knots.
///
/// Guarantees, for every shape (each has a test of the same name):
///  - interpolation: b(0) = (0,1,0,0), b(1) = (0,0,1,0);                            Eq. (8)
///  - partition of unity: Σ bᵢ(t) = 1;        - mirror symmetry: bᵢ(1−t) = b₃₋ᵢ(t);
///  - knot derivatives (−κ, 0, κ, 0), (2λ, −4λ, 2λ, 0), 0 at t = 0;                Eq. (9)–(11)
///  - straight lines at constant speed are reproduced when κ = 1/2, for every λ;
///  - parabolas are reproduced when κ = λ = 1/2.
/// Two neighbouring spans join C³ if they share κ, λ and the parameter spacing.
///
/// Units: the unit of the control points. No allocation; about 60 flops.
/// @param t  span parameter   @param order  derivative order
/// @pre 0 ≤ t ≤ 1, 0 ≤ order ≤ 3          @throws ContractViolation if not.
///
/// Implements [Cai2025] Eq. (6) and (7), §3.1.1 (docs/references.bib).
/// Differences from the paper:
///  - Eq. (9) prints b₁'(0) = 1. Eq. (6)–(7) give 0, which partition of unity also requires.
///  - §4 says that κ = λ = 0 is the standard Catmull-Rom form. There every derivative up to the
///    third vanishes at both knots and the curve stops; the standard form has κ = 1/2.
Eigen::Vector4d acr_basis(const AcrShape& shape, double t, int order = 0);

/// A septic polynomial Σ c[k] tᵏ and its first three derivatives at t.
struct SepticValue {
  double value = 0.0, d1 = 0.0, d2 = 0.0, d3 = 0.0;
};
using Septic = Eigen::Matrix<double, 8, 1>;

/// Coefficients of one ACR span of scalar control points p = (p₋₁, p₀, p₁, p₂): what acr_basis
/// weighs. Guarantee (test): equals acr_basis·p to rounding, derivatives too.   Cost: 40 flops.
Septic acr_span(const AcrShape& shape, const Eigen::Vector4d& p);

/// Value and derivatives by Horner's rule; any t.
SepticValue evaluate(const Septic& polynomial, double t);

}  // namespace smoothpost
