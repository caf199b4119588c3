#pragma once

#include <random>
#include <vector>

#include "kernels/spline/bspline_basis.h"

// B-splines as their definition has them, and random ones, for the tests.
namespace smoothpost::test {

/// N_{j,r}(u) by the recursion of Cox and de Boor, 0/0 := 0.
inline double cox_de_boor(const std::vector<double>& u, int j, int r, double x) {
  const auto i = static_cast<std::size_t>(j);
  const auto d = static_cast<std::size_t>(r);
  if (r == 0) return u[i] <= x && x < u[i + 1] ? 1.0 : 0.0;
  double sum = 0.0;
  if (u[i + d] > u[i]) sum += (x - u[i]) / (u[i + d] - u[i]) * cox_de_boor(u, j, r - 1, x);
  if (u[i + d + 1] > u[i + 1])
    sum += (u[i + d + 1] - x) / (u[i + d + 1] - u[i + 1]) * cox_de_boor(u, j + 1, r - 1, x);
  return sum;
}

/// Clamped knots whose spans are between 0.4 and 1.6.
inline SplineKnots random_knots(int degree, int spans, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> length(0.4, 1.6);
  SplineKnots knots = clamped_knots(degree, spans);
  const auto k = static_cast<std::size_t>(degree);
  for (std::size_t i = k + 1; i < knots.values.size(); ++i)
    knots.values[i] = i <= k + static_cast<std::size_t>(spans)
                          ? knots.values[i - 1] + length(random)
                          : knots.values[i - 1];
  return knots;
}

/// Numbers between −1 and 1.
inline Eigen::VectorXd random_controls(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  Eigen::VectorXd controls(count);
  for (double& c : controls) c = value(random);
  return controls;
}

}  // namespace smoothpost::test
