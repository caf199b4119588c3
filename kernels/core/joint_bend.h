#pragma once

#include <Eigen/Core>

namespace smoothpost {

/// How joints leave the straight way from q0 to q1 on τ ∈ [0, 1]: joint j is at
///   q0 + τ (q1 − q0) + Σ_{k=2..5} bend(j, k−2) · (τ^k − τ),
/// a polynomial whose higher coefficients are the bend and whose ends are q0 and q1. No rows:
/// straight. mm or rad.
using JointBend = Eigen::Matrix<double, Eigen::Dynamic, 4>;

}  // namespace smoothpost
