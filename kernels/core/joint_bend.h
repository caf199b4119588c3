#pragma once

#include <Eigen/Core>

namespace smoothpost {

/// How joints leave the straight way from q0 to q1 on τ ∈ [0, 1]: joint j is at
///   q0 + τ (q1 − q0) + Σ_{k=2..5} bend(j, k−2) · (τ^k − τ),
/// a polynomial whose higher coefficients are the bend and whose ends are q0 and q1. No rows:
/// straight. mm or rad.
using JointBend = Eigen::Matrix<double, Eigen::Dynamic, 4>;

/// How two linear joints go round a centre instead, on τ ∈ [0, 1]: with polar coordinates (ρ, φ) of
/// (first, second) about the centre both are linear in τ, ρ from that of q0 to that of q1, φ in the
/// sense of `turn` by the angle in (0, 2π] that takes the direction of q0 to that of q1. The other
/// joints stay straight: with a third linear joint that moves it is a helix. Positions in mm.
struct JointArc {
  int turn =
      0;  ///< 1: from the first joint's positive direction to the second's, −1: back; 0: none
  int first = 0, second = 0;
  double centre_first = 0.0, centre_second = 0.0;
};

}  // namespace smoothpost
