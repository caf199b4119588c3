#pragma once

#include <vector>

#include "kernels/core/pose.h"

// Interpolation of rotations given at places of a path: the two baselines of [Ding2025].
namespace smoothpost {

/// Unit quaternions, each at its own parameter.
struct QuaternionKnots {
  std::vector<double> u;                   ///< strictly ascending, at least two
  std::vector<Eigen::Quaterniond> values;  ///< unit, one a place
};

/// The same rotations, each value in the half sphere of the one before, so that the way between two
/// neighbours is the short one.   Guarantee (test): neighbours' dot products are not negative.
/// @throws ContractViolation when sizes differ or u does not ascend.
QuaternionKnots with_continuous_signs(QuaternionKnots knots);

/// Spherical linear interpolation: between two places a rotation about one fixed axis at constant
/// rate; only C0 at the places.
/// Guarantees (tests): exact at the places, constant rate between them, the short way whatever the
/// signs given.   Outside the places: the nearest one.   @pre as with_continuous_signs()
Eigen::Quaterniond slerp_at(const QuaternionKnots& knots, double u);

/// Cubic spline of the four components through the values, sign-continuous, second derivatives 0 at
/// both ends (natural), normalised: twice continuously differentiable.
class QuaternionSpline {
 public:
  /// Cost: linear.   @throws ContractViolation as with_continuous_signs()
  explicit QuaternionSpline(const QuaternionKnots& knots);

  /// Guarantees (tests): exact at the places; first and second differences agree on both sides of
  /// them; two places: the great circle of the two.
  /// Outside the places: the nearest one.   Cost: log n, no allocation.
  Eigen::Quaterniond at(double u) const;

 private:
  QuaternionKnots knots_;
  std::vector<Eigen::Vector4d> bend_;  ///< second derivatives at the places
};

}  // namespace smoothpost
