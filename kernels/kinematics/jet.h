#pragma once

#include <array>
#include <cmath>

#include "kernels/core/pose.h"

// Values with their derivatives of orders 1 … 3 by one parameter, and the rules of calculus.
namespace smoothpost {

/// Value and first three derivatives of one number by the path parameter, at one place.
using Jet = std::array<double, 4>;
/// The same for a vector: column r is the r-th derivative.
using VectorJet = Eigen::Matrix<double, 3, 4>;
/// The same for a matrix: entry r is the r-th derivative.
using MatrixJet = std::array<Mat3, 4>;

/// What the derivatives s and r − s of the factors weigh in the r-th derivative of a product.
inline constexpr double kLeibniz[4][4] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {1, 2, 1, 0}, {1, 3, 3, 1}};

inline Jet product(const Jet& f, const Jet& g) {
  Jet out{};
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t s = 0; s <= r; ++s) out[r] += kLeibniz[r][s] * f[s] * g[r - s];
  return out;
}

inline VectorJet product(const Jet& f, const VectorJet& v) {
  VectorJet out = VectorJet::Zero();
  for (int r = 0; r < 4; ++r)
    for (int s = 0; s <= r; ++s)
      out.col(r) += kLeibniz[r][s] * f[static_cast<std::size_t>(s)] * v.col(r - s);
  return out;
}

inline MatrixJet product(const MatrixJet& a, const MatrixJet& b) {
  MatrixJet out;
  for (std::size_t r = 0; r < 4; ++r) {
    out[r].setZero();
    for (std::size_t s = 0; s <= r; ++s) out[r] += kLeibniz[r][s] * a[s] * b[r - s];
  }
  return out;
}

/// 1/f.   @pre f[0] ≠ 0
inline Jet reciprocal(const Jet& f) {
  Jet out{1.0 / f[0], 0.0, 0.0, 0.0};
  for (std::size_t r = 1; r < 4; ++r) {
    for (std::size_t s = 1; s <= r; ++s) out[r] -= kLeibniz[r][s] * f[s] * out[r - s];
    out[r] *= out[0];
  }
  return out;
}

struct SineCosine {
  Jet sine;
  Jet cosine;
};

inline SineCosine sine_cosine(const Jet& angle) {
  const double s = std::sin(angle[0]);
  const double c = std::cos(angle[0]);
  const double square = angle[1] * angle[1];
  const double mixed = 3.0 * angle[1] * angle[2];
  const double third = angle[3] - square * angle[1];
  return {{s, c * angle[1], c * angle[2] - s * square, c * third - s * mixed},
          {c, -s * angle[1], -s * angle[2] - c * square, -s * third - c * mixed}};
}

/// v turned about a fixed unit axis: n (n·v) + cos φ (v − n (n·v)) + sin φ n × v.
inline VectorJet turned(const Vec3& axis, const SineCosine& angle, const VectorJet& v) {
  const VectorJet along = axis * (axis.transpose() * v);
  return along + product(angle.cosine, v - along) + product(angle.sine, cross_matrix(axis) * v);
}

inline VectorJet constant_jet(const Vec3& v) {
  VectorJet jet = VectorJet::Zero();
  jet.col(0) = v;
  return jet;
}

inline MatrixJet constant_matrix_jet(const Mat3& m) {
  return {m, Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
}

}  // namespace smoothpost
