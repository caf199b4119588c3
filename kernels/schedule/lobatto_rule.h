#pragma once

#include <vector>

// Internal to kernels/schedule.
namespace smoothpost {

/// Gauss-Lobatto rule on [0, 1]: ∫₀¹ f ≈ Σ weights[i]·f(nodes[i]), both ends among the nodes; exact
/// for polynomials of degree 2·points − 3.
struct LobattoRule {
  std::vector<double> nodes;    ///< ascending, 0 … 1, symmetric
  std::vector<double> weights;  ///< sum 1
};

/// The nodes are the ends and the zeros of P'_{m−1} (Legendre) on [−1, 1], the weights
/// 2/(m (m − 1) P_{m−1}²), both halved.   @pre 3 ≤ points ≤ 32   @throws ContractViolation
LobattoRule lobatto_rule(int points);

/// The matrix of polynomial interpolation from nodes to places: value(place i) =
/// Σ_j result[i·nodes + j]·value(node j), by the barycentric formula.
std::vector<double> interpolation_weights(const std::vector<double>& nodes,
                                          const std::vector<double>& places);

}  // namespace smoothpost
