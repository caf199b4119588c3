#include "kernels/schedule/lobatto_rule.h"

#include <cmath>
#include <cstddef>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

struct Legendre {
  double value, first, second;
};

/// P_n and derivatives at |x| < 1.
Legendre legendre(int n, double x) {
  double before = 1.0, value = x;
  for (int k = 2; k <= n; ++k) {
    const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
    before = value;
    value = next;
  }
  const double inside = 1.0 - x * x;
  const double first = n * (before - x * value) / inside;
  return {value, first, (2.0 * x * first - n * (n + 1.0) * value) / inside};
}

}  // namespace

LobattoRule lobatto_rule(int points) {
  require(points >= 3 && points <= 32, "lobatto_rule: 3 <= points <= 32");
  LobattoRule rule;
  rule.nodes.assign(points, 0.0);
  rule.weights.assign(points, 1.0 / (points * (points - 1.0)));
  rule.nodes.back() = 1.0;
  const double pi = std::acos(-1.0);
  for (int i = 1; i + 1 < points; ++i) {
    double x = -std::cos(pi * i / (points - 1));  // Chebyshev's, near enough for Newton
    for (int step = 0; step < 20; ++step) {
      const Legendre p = legendre(points - 1, x);
      x -= p.first / p.second;
    }
    if (2 * i == points - 1) x = 0.0;
    const double value = legendre(points - 1, x).value;
    rule.nodes[i] = 0.5 + 0.5 * x;
    rule.weights[i] /= value * value;
  }
  return rule;
}

std::vector<double> interpolation_weights(const std::vector<double>& nodes,
                                          const std::vector<double>& places) {
  const std::size_t n = nodes.size();
  std::vector<double> centre(n, 1.0), result(places.size() * n, 0.0);
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t k = 0; k < n; ++k)
      if (k != j) centre[j] /= nodes[j] - nodes[k];
  for (std::size_t i = 0; i < places.size(); ++i) {
    double* row = &result[i * n];
    double sum = 0.0;
    bool node = false;
    for (std::size_t j = 0; j < n && !node; ++j) {
      const double apart = places[i] - nodes[j];
      if (apart == 0.0) {
        for (std::size_t k = 0; k < n; ++k) row[k] = k == j ? 1.0 : 0.0;
        node = true;
      } else {
        row[j] = centre[j] / apart;
        sum += row[j];
      }
    }
    for (std::size_t j = 0; j < n && !node; ++j) row[j] /= sum;
  }
  return result;
}

}  // namespace smoothpost
