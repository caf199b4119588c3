#include "kernels/smooth/blend_function.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/spline/acr_spline.h"

namespace smoothpost {

namespace {

constexpr int kNewtonSteps = 60;

// Span k of six runs from Q_(k+2) to Q_(k+3).
constexpr std::size_t kFirstSpan = 2;
constexpr std::size_t kSpans = 6;

double knot(std::size_t j) { return kAcrCornerWeights[10 - j] - kAcrCornerWeights[j]; }

/// The share t of a span where the monotone polynomial reaches u.
double solve(const Septic& sigma, double u, double guess) {
  double low = 0.0;
  double high = 1.0;
  double t = guess;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const SepticValue v = evaluate(sigma, t);
    const double error = v.value - u;
    double next = t - error / v.d1;
    if (std::abs(next - t) <= 1e-15) return std::clamp(next, 0.0, 1.0);
    (error > 0.0 ? high : low) = t;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    t = next;
  }
  return t;
}

}  // namespace

double BlendFunction::second_derivative_bound() const {
  if (kind_ == Kind::ramp)  // (1−u²)² ≤ 1 and u²(1−u²)² ≤ 4/27
    return std::abs(15.0 / 16.0 - first_parameter_ / 7.0) + std::abs(first_parameter_) * 4.0 / 27.0;
  const auto scan = [this] {
    constexpr int kSteps = 96;
    double most = 0.0;
    for (int i = 0; i <= kSteps; ++i) most = std::max(most, std::abs(acr_at(-1.5 * i / kSteps).d2));
    return 1.1 * most;
  };
  if (first_parameter_ != 0.5 || second_parameter_ != 0.5) return scan();
  static const double half = scan();
  return half;
}

BlendFunction BlendFunction::acr(const AcrShape& shape) {
  require(shape.kappa >= 0.4 && shape.kappa <= 0.6 && shape.lambda >= -0.5 && shape.lambda <= 2.5,
          "blend_function: kappa in [0.4, 0.6] and lambda in [-0.5, 2.5]");
  return {Kind::acr, shape.kappa, shape.lambda};
}

BlendFunction BlendFunction::ramp(double c1) {
  require(c1 >= -1.09 && c1 <= 6.56, "blend_function: c1 in [-1.09, 6.56]");
  return {Kind::ramp, c1, 0.0};
}

double BlendFunction::at_zero() const {
  if (kind_ == Kind::acr) return 0.25;
  const double c1 = first_parameter_;
  return (15.0 / 16.0 - c1 / 7.0) / 6.0 + c1 / 24.0;
}

std::vector<double> BlendFunction::knots() const {
  std::vector<double> inside;
  if (kind_ != Kind::acr) return inside;
  for (std::size_t i = kFirstSpan + kSpans / 2; i-- > kFirstSpan;)
    if (knot(i) < 0.0 && knot(i) > -reach()) inside.push_back(-knot(i));
  return inside;
}

BlendValue BlendFunction::at(double u) const {
  if (u <= -reach()) return {};
  if (u >= reach()) return {u, 1.0, 0.0, 0.0};
  return kind_ == Kind::acr ? acr_at(u) : ramp_at(u);
}

BlendValue BlendFunction::acr_at(double u) const {
  // g(u) = u + g(−u): the half before the vertex is small there, so its digits are its own.
  if (u > 0.0) {
    const BlendValue mirrored = acr_at(-u);
    return {u + mirrored.value, 1.0 - mirrored.d1, mirrored.d2, -mirrored.d3};
  }
  std::size_t i = kFirstSpan;
  while (i + 1 < kFirstSpan + kSpans / 2 && u > knot(i + 1)) ++i;
  Eigen::Vector4d sigma_points;
  Eigen::Vector4d blend_points;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t j = i - 1 + k;
    sigma_points[static_cast<Eigen::Index>(k)] = knot(j);
    blend_points[static_cast<Eigen::Index>(k)] = kAcrCornerWeights[10 - j];
  }
  const Septic sigma = acr_span(shape(), sigma_points);
  const double t = solve(sigma, u, (u - knot(i)) / (knot(i + 1) - knot(i)));
  const SepticValue s = evaluate(sigma, t);
  const SepticValue b = evaluate(acr_span(shape(), blend_points), t);
  BlendValue g;
  g.value = b.value;
  g.d1 = b.d1 / s.d1;
  g.d2 = (b.d2 - g.d1 * s.d2) / (s.d1 * s.d1);
  g.d3 = (b.d3 - g.d1 * s.d3 - 3.0 * g.d2 * s.d1 * s.d2) / (s.d1 * s.d1 * s.d1);
  return g;
}

BlendValue BlendFunction::ramp_at(double u) const {
  if (u > 0.0) {
    const BlendValue mirrored = ramp_at(-u);
    return {u + mirrored.value, 1.0 - mirrored.d1, mirrored.d2, -mirrored.d3};
  }
  const double c1 = first_parameter_;
  const double c0 = 15.0 / 16.0 - c1 / 7.0;
  const double u2 = u * u;
  const double w = 1.0 - u2;
  const double bend = c0 + c1 * u2;
  BlendValue g;
  // Near the end the sum of powers cancels: there g = ∫∫ in powers of v = 1 + u.
  const double v = 1.0 + u;
  if (v < 0.25) {
    // g'' = v²(2−v)²(c0 + c1(1−v)²) as a polynomial in v, integrated twice.
    const double e0 = c0 + c1;
    const std::array<double, 7> c = {
        0.0, 0.0, 4.0 * e0, -4.0 * e0 - 8.0 * c1, e0 + 8.0 * c1 + 4.0 * c1, -2.0 * c1 - 4.0 * c1,
        c1};
    double power = 1.0;
    for (std::size_t k = 0; k < c.size(); ++k) {
      const auto n = static_cast<double>(k);
      g.value += c[k] * power * v * v / ((n + 1.0) * (n + 2.0));
      g.d1 += c[k] * power * v / (n + 1.0);
      power *= v;
    }
  } else {
    const double g0 = c0 / 6.0 + c1 / 24.0;
    g.value =
        g0 + u * (0.5 + u * (0.5 * c0 + u2 * ((c1 - 2.0 * c0) / 12.0 +
                                              u2 * ((c0 - 2.0 * c1) / 30.0 + u2 * c1 / 56.0))));
    g.d1 = 0.5 +
           u * (c0 + u2 * ((c1 - 2.0 * c0) / 3.0 + u2 * ((c0 - 2.0 * c1) / 5.0 + u2 * c1 / 7.0)));
  }
  g.d2 = w * w * bend;
  g.d3 = -4.0 * u * w * bend + 2.0 * c1 * u * w * w;
  return g;
}

AcrShape acr_fit(double turn) {
  require(turn > 0.0 && turn < kPi, "acr_fit: turning angle between 0 and half a turn");
  // Q1 … Q4 along and across the leg, in units of h; the deviation is κ·A + λ·B + C.
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  const std::array<double, 2> outgoing = {std::cos(turn), std::sin(turn)};
  for (std::size_t c = 0; c < 2; ++c) {
    Eigen::Vector4d q;
    for (std::size_t k = 0; k < 4; ++k)
      q[static_cast<Eigen::Index>(k)] =
          kAcrCornerWeights[9 - k] * outgoing[c] - (c == 0 ? kAcrCornerWeights[k + 1] : 0.0);
    Septic rest = acr_span({0.0, 0.0}, q);
    const Septic a = acr_span({1.0, 0.0}, q) - rest;
    const Septic b = acr_span({0.0, 1.0}, q) - rest;
    rest[0] -= q[1];
    rest[1] -= q[2] - q[1];
    const auto integral = [](const Septic& f, const Septic& g) {
      double sum = 0.0;
      for (Eigen::Index i = 0; i < 8; ++i)
        for (Eigen::Index j = 0; j < 8; ++j) sum += f[i] * g[j] / static_cast<double>(i + j + 1);
      return sum;
    };
    const double ab = integral(a, b);
    normal += (Eigen::Matrix2d() << integral(a, a), ab, ab, integral(b, b)).finished();
    right -= Eigen::Vector2d(integral(a, rest), integral(b, rest));
  }
  const double det = normal.determinant();
  return {(right[0] * normal(1, 1) - right[1] * normal(0, 1)) / det,
          (right[1] * normal(0, 0) - right[0] * normal(0, 1)) / det};
}

double ramp_c1(double turn) {
  return std::clamp(0.0372 * degrees_from_radians(turn) - 1.3, -0.35, 5.9);
}

}  // namespace smoothpost
