#pragma once

#include "kernels/core/joint_bend.h"
#include "kernels/core/joints.h"

// Joints that follow polynomials of degree 5 at most from one end of a move to the other.
namespace smoothpost {

/// A move of all joints over τ ∈ [0, 1]; see JointBend.
struct BentMove {
  const JointVector& from;
  const JointVector& to;
  const JointBend& bend;
};

/// The joints at τ, mm or rad.   Cost: O(joints), no allocation.
/// @pre to, and bend unless it has no rows, have as many rows as from
/// @throws ContractViolation if not; so have the others below.
JointVector joints_at(const BentMove& move, double tau);

/// Their derivatives by τ, the first and the second one.
JointVector rates_at(const BentMove& move, double tau);
JointVector second_at(const BentMove& move, double tau);

/// For each joint, a bound of |dq/dτ| and of |d²q/dτ²| on the whole move.
///
/// Derivation. A polynomial on [0, 1] lies in the hull of its Bernstein coefficients, so its size
/// is at most the largest of them.
/// Guarantees (tests): never below dense samples; exact for moves whose derivative is monotone.
/// Cost: O(joints), no allocation.
struct BendBounds {
  JointVector rate;
  JointVector second;
};
BendBounds bend_bounds(const BentMove& move);

/// A place of a smooth joint path with derivatives by its parameter s.
struct PathEnd {
  JointVector joints, first, second;
};

/// The bend of the polynomial that goes from `from` to `to` over `length` of s with the path's
/// first derivative at both ends (degree 3) and its second one, too (degree 5), so that moves one
/// behind the other meet with a continuous tangent, or tangent and curvature.
///
/// With D = q1 − q0, d = length·q', k = length²·q'':
///   degree 3: c2 = 3D − 2d0 − d1, c3 = −2D + d0 + d1;
///   degree 5: c2 = k0/2, c3 = 10D − 6d0 − 4d1 − 3/2 k0 + 1/2 k1,
///             c4 = −15D + 8d0 + 7d1 + 3/2 k0 − k1, c5 = 6D − 3d0 − 3d1 − 1/2 k0 + 1/2 k1.
/// Guarantee (test): a polynomial of that degree comes back.
/// @pre degree is 3 or 5, length > 0, one value per joint   @throws ContractViolation if not.
JointBend hermite_bend(const PathEnd& from, const PathEnd& to, double length, int degree);

}  // namespace smoothpost
