#include "kernels/smooth/pose_curve.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr int kDegree = 5;
constexpr int kNormSamples = 8;  // of a span, for the least length of the quaternion
constexpr double kLeastNorm = 0.5;

/// A unit quaternion q/|q| with three derivatives from those of q.
std::array<Eigen::Vector4d, 4> normalised(const std::array<Eigen::Vector4d, 4>& q) {
  // n = q·q and its derivatives, then f = n^(−1/2) by the chain rule, then Leibniz.
  const double n = q[0].squaredNorm();
  const double n1 = 2.0 * q[0].dot(q[1]);
  const double n2 = 2.0 * (q[1].squaredNorm() + q[0].dot(q[2]));
  const double n3 = 2.0 * (3.0 * q[1].dot(q[2]) + q[0].dot(q[3]));
  const double f = 1.0 / std::sqrt(n);
  const double g = -0.5 * f / n;  // df/dn
  const double h = -1.5 * g / n;
  const double k = -2.5 * h / n;
  const double f1 = g * n1;
  const double f2 = h * n1 * n1 + g * n2;
  const double f3 = k * n1 * n1 * n1 + 3.0 * h * n1 * n2 + g * n3;
  return {f * q[0], f1 * q[0] + f * q[1], f2 * q[0] + 2.0 * f1 * q[1] + f * q[2],
          f3 * q[0] + 3.0 * f2 * q[1] + 3.0 * f1 * q[2] + f * q[3]};
}

}  // namespace

PoseCurve::PoseCurve(const SplineCurve& spline) {
  require(spline.knots.degree == kDegree && spline.controls.rows() == 7,
          "pose_curve: a quintic spline of seven components");
  const SplineKnots& knots = spline.knots;
  Eigen::MatrixXd first(7, knots.controls() - 1);
  Eigen::MatrixXd second(7, knots.controls() - 2);
  for (int c = 0; c < 7; ++c) {
    first.row(c) = derivative_controls(knots, spline.controls.row(c), 1);
    second.row(c) = derivative_controls(knots, spline.controls.row(c), 2);
  }
  spans_.resize(static_cast<std::size_t>(knots.spans()));
  for (int i = 0; i < knots.spans(); ++i) {
    Span& span = spans_[static_cast<std::size_t>(i)];
    const double from = knots.values[static_cast<std::size_t>(kDegree + i)];
    span.length = knots.values[static_cast<std::size_t>(kDegree + i + 1)] - from;
    require(span.length > 0.0, "pose_curve: simple inner knots");
    double factorial = 1.0;
    for (int r = 0; r <= kDegree; ++r) {
      if (r > 0) factorial *= r;
      const BasisRow row = bspline_basis(knots, from, r);
      span.powers.col(r) =
          spline.controls.middleCols(row.first, row.weights.size()) * row.weights / factorial;
    }
    double rate = 0.0;
    double bend = 0.0;
    for (int j = i; j < i + kDegree; ++j) rate = std::max(rate, first.col(j).tail<4>().norm());
    for (int j = i; j < i + kDegree - 1; ++j) {
      span.bend.tip = std::max(span.bend.tip, second.col(j).head<3>().norm());
      bend = std::max(bend, second.col(j).tail<4>().norm());
    }
    double norm = 1e9;
    for (int k = 0; k <= kNormSamples; ++k) {
      Components value = span.powers.col(kDegree);
      for (int r = kDegree - 1; r >= 0; --r)
        value = value * (span.length * k / kNormSamples) + span.powers.col(r);
      norm = std::min(norm, value.tail<4>().norm());
    }
    norm -= 0.5 * span.length / kNormSamples * rate;
    require(norm > kLeastNorm, "pose_curve: the quaternion's length");
    // axis'' = ω' × axis + ω × (ω × axis), |ω| = 2|q̂'|, |ω'| = 2 of what of q̂'' is across q̂.
    rate /= norm;
    span.bend.axis = 2.0 * (bend / norm + 2.0 * rate * rate) + 4.0 * rate * rate;
  }
}

Pose PoseCurve::at(std::size_t span, double x) const {
  const auto& powers = spans_[span].powers;
  Components value = powers.col(kDegree);
  for (int r = kDegree - 1; r >= 0; --r) value = value * x + powers.col(r);
  Pose pose = Pose::Identity();
  pose.translation() = value.head<3>();
  pose.linear() =
      Eigen::Quaterniond(value[3], value[4], value[5], value[6]).normalized().toRotationMatrix();
  return pose;
}

PoseDerivatives PoseCurve::derivatives(std::size_t span, double x) const {
  const auto& powers = spans_[span].powers;
  std::array<Components, 4> value;
  for (int order = 0; order < 4; ++order) {
    Components sum = Components::Zero();
    for (int r = kDegree; r >= order; --r) {
      double factor = 1.0;
      for (int k = 0; k < order; ++k) factor *= r - k;
      sum = sum * x + factor * powers.col(r);
    }
    value[static_cast<std::size_t>(order)] = sum;
  }
  PoseDerivatives d;
  std::array<Eigen::Vector4d, 4> q;
  for (std::size_t r = 0; r < 4; ++r) {
    d.tip[r] = value[r].head<3>();
    q[r] = value[r].tail<4>();
  }
  d.rotation = normalised(q);
  return d;
}

}  // namespace smoothpost
