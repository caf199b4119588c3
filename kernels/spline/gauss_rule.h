#pragma once

#include <array>

namespace smoothpost {

inline constexpr int kMaxGaussPoints = 16;

/// Gauss-Legendre rule on [0, 1]: ∫₀¹ f ≈ Σ weights[g]·f(nodes[g]), g < points; exact for
/// polynomials of degree 2·points − 1.
struct GaussRule {
  int points = 0;
  std::array<double, kMaxGaussPoints> nodes{};    ///< ascending, inside (0, 1)
  std::array<double, kMaxGaussPoints> weights{};  ///< sum 1
};

/// The rule of that many points.   Cost: a look-up; the tables are made at the first call.
/// @pre 1 ≤ points ≤ kMaxGaussPoints   @throws ContractViolation if not.
const GaussRule& gauss_rule(int points);

}  // namespace smoothpost
