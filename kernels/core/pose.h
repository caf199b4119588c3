#pragma once

#include <Eigen/Geometry>

namespace smoothpost {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
/// Rigid transform; X_MW maps coordinates in W to coordinates in M. Translation in mm.
using Pose = Eigen::Isometry3d;

/// [w]× with [w]×·v = w × v.
Mat3 cross_matrix(const Vec3& w);

/// Rotation of `angle` (rad) about the unit vector `axis`: I + sin(φ)[a]× + (1−cos φ)[a]×².
/// @pre |axis| = 1 within 1e-9   @throws ContractViolation if not.
Mat3 rotation_about(const Vec3& axis, double angle);

/// Exponential map of SO(3): rotation by |w| (rad) about w/|w|; identity for w = 0.
/// Guarantees: inverse of rotation_log for |w| < π; exact to round-off for tiny |w| (series).
Mat3 rotation_exp(const Vec3& w);

/// Logarithm of SO(3): the rotation vector w (rad) with rotation_exp(w) = R and |w| ≤ π.
/// At |w| = π the axis' sign is the one whose first non-zero component is positive.
/// @pre R is a rotation within 1e-6.
Vec3 rotation_log(const Mat3& rotation);

/// Angle between two unit vectors in rad, [0, π]: atan2(|a×b|, a·b); accurate at 0 and π (no acos).
double angle_between(const Vec3& a, const Vec3& b);

/// Point at share t ∈ [0, 1] of the great circle from unit vector a to unit vector b.
/// Opposite vectors have no unique great circle: then the plane is that of
/// `Vec3::unitOrthogonal(a)`.
Vec3 great_circle(const Vec3& a, const Vec3& b, double t);

/// q or −q (the same rotation), whichever lies in the half sphere of `reference`.
Eigen::Quaterniond same_sign(const Eigen::Quaterniond& q, const Eigen::Quaterniond& reference);

/// Rotation Rz(c)·Ry(b)·Rx(a), angles in rad (the convention of `rpy` in machine files).
Mat3 rotation_from_rpy(double a, double b, double c);

}  // namespace smoothpost
