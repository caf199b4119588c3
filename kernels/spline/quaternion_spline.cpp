#include "kernels/spline/quaternion_spline.h"

#include <algorithm>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

/// The piece that holds u, which is inside.
std::size_t piece_of(const std::vector<double>& u, double at) {
  const auto above = std::upper_bound(u.begin() + 1, u.end() - 1, at);
  return static_cast<std::size_t>(above - u.begin()) - 1;
}

/// Second derivatives of the natural cubic spline: h_{i−1} m_{i−1} + 2(h_{i−1} + h_i) m_i + h_i
/// m_{i+1} = 6 (slope_i − slope_{i−1}), m = 0 at both ends; Thomas' recursion.
std::vector<Eigen::Vector4d> natural_bend(const QuaternionKnots& k) {
  const std::size_t n = k.u.size();
  std::vector<Eigen::Vector4d> bend(n, Eigen::Vector4d::Zero());
  std::vector<double> share(n, 0.0);
  const auto step = [&](std::size_t i) { return k.u[i + 1] - k.u[i]; };
  const auto slope = [&](std::size_t i) -> Eigen::Vector4d {
    return (k.values[i + 1].coeffs() - k.values[i].coeffs()) / step(i);
  };
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double pivot = 2.0 * (step(i - 1) + step(i)) - step(i - 1) * share[i - 1];
    share[i] = step(i) / pivot;
    bend[i] = (6.0 * (slope(i) - slope(i - 1)) - step(i - 1) * bend[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) bend[i] -= share[i] * bend[i + 1];
  return bend;
}

}  // namespace

QuaternionKnots with_continuous_signs(QuaternionKnots knots) {
  require(knots.u.size() >= 2 && knots.u.size() == knots.values.size(),
          "two places, one value each");
  for (std::size_t i = 1; i < knots.u.size(); ++i) {
    require(knots.u[i] > knots.u[i - 1], "places ascend");
    knots.values[i] = same_sign(knots.values[i], knots.values[i - 1]);
  }
  return knots;
}

Eigen::Quaterniond slerp_at(const QuaternionKnots& knots, double u) {
  require(knots.u.size() >= 2 && knots.u.size() == knots.values.size(),
          "two places, one value each");
  const double inside = std::clamp(u, knots.u.front(), knots.u.back());
  const std::size_t i = piece_of(knots.u, inside);
  return knots.values[i].slerp((inside - knots.u[i]) / (knots.u[i + 1] - knots.u[i]),
                               same_sign(knots.values[i + 1], knots.values[i]));
}

QuaternionSpline::QuaternionSpline(const QuaternionKnots& knots)
    : knots_(with_continuous_signs(knots)), bend_(natural_bend(knots_)) {}

Eigen::Quaterniond QuaternionSpline::at(double u) const {
  const double inside = std::clamp(u, knots_.u.front(), knots_.u.back());
  const std::size_t i = piece_of(knots_.u, inside);
  const double h = knots_.u[i + 1] - knots_.u[i];
  const double b = (inside - knots_.u[i]) / h;
  const double a = 1.0 - b;
  const Eigen::Vector4d value =
      a * knots_.values[i].coeffs() + b * knots_.values[i + 1].coeffs() +
      h * h / 6.0 * ((a * a * a - a) * bend_[i] + (b * b * b - b) * bend_[i + 1]);
  return Eigen::Quaterniond(value.normalized());
}

}  // namespace smoothpost
