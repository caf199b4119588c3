#include "kernels/core/pose.h"

#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

Mat3 cross_matrix(const Vec3& w) {
  Mat3 m;
  m << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return m;
}

Mat3 rotation_about(const Vec3& axis, double angle) {
  require(std::abs(axis.norm() - 1.0) < 1e-9, "rotation axis has unit length");
  const Mat3 k = cross_matrix(axis);
  const double half = std::sin(0.5 * angle);
  return Mat3::Identity() + std::sin(angle) * k + 2.0 * half * half * (k * k);
}

Mat3 rotation_exp(const Vec3& w) {
  const double angle = w.norm();
  const Mat3 k = cross_matrix(w);
  if (angle < 1e-5) {
    const double a2 = angle * angle;
    return Mat3::Identity() + (1.0 - a2 / 6.0) * k + (0.5 - a2 / 24.0) * (k * k);
  }
  const double half = std::sin(0.5 * angle) / angle;
  return Mat3::Identity() + std::sin(angle) / angle * k + 2.0 * half * half * (k * k);
}

Vec3 rotation_log(const Mat3& r) {
  require((r * r.transpose() - Mat3::Identity()).norm() < 1e-6, "rotation matrix is orthonormal");
  const Vec3 skew(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
  const double sine = 0.5 * skew.norm();
  const double cosine = 0.5 * (r.trace() - 1.0);
  const double angle = std::atan2(sine, cosine);
  if (angle < 1e-5) return 0.5 * (1.0 + angle * angle / 6.0) * skew;
  if (angle < kPi - 1e-3) return 0.5 * angle / sine * skew;
  // Near half a turn: R + Rᵀ = 2cos·I + 2(1−cos)·a·aᵀ; its largest column gives the axis.
  const Mat3 outer = 0.5 * (r + r.transpose()) - cosine * Mat3::Identity();
  int column = 0;
  outer.diagonal().maxCoeff(&column);
  Vec3 axis = outer.col(column).normalized();
  const double along = axis.dot(skew);
  if (along < 0.0) axis = -axis;
  if (along == 0.0) {
    for (int i = 0; i < 3; ++i) {
      if (axis[i] == 0.0) continue;
      if (axis[i] < 0.0) axis = -axis;
      break;
    }
  }
  return angle * axis;
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Vec3 great_circle(const Vec3& a, const Vec3& b, double t) {
  const double angle = angle_between(a, b);
  if (angle < 1e-9) return (a + t * (b - a)).normalized();
  Vec3 normal = a.cross(b);
  // Parallel within round-off: any plane through a serves; this one is reproducible.
  if (normal.norm() < 1e-12) normal = a.unitOrthogonal();
  normal.normalize();
  return (std::cos(t * angle) * a + std::sin(t * angle) * normal.cross(a)).normalized();
}

Eigen::Quaterniond same_sign(const Eigen::Quaterniond& q, const Eigen::Quaterniond& reference) {
  if (q.dot(reference) >= 0.0) return q;
  return Eigen::Quaterniond(-q.w(), -q.x(), -q.y(), -q.z());
}

Mat3 rotation_from_rpy(double a, double b, double c) {
  return rotation_about(Vec3::UnitZ(), c) * rotation_about(Vec3::UnitY(), b) *
         rotation_about(Vec3::UnitX(), a);
}

}  // namespace smoothpost
