#include "kernels/spline/gauss_rule.h"

#include <cmath>
#include <numbers>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

struct Legendre {
  double value = 0.0;
  double slope = 0.0;
};

Legendre legendre(int degree, double x) {
  double before = 1.0;
  double here = x;
  for (int n = 1; n < degree; ++n) {
    const double next = ((2 * n + 1) * x * here - n * before) / (n + 1);
    before = here;
    here = next;
  }
  return {here, degree * (x * here - before) / (x * x - 1.0)};
}

GaussRule make_rule(int points) {
  GaussRule rule;
  rule.points = points;
  for (int i = 0; 2 * i < points; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (points + 0.5));
    for (int pass = 0; pass < 8; ++pass) {
      const Legendre p = legendre(points, x);
      x -= p.value / p.slope;
    }
    if (2 * i + 1 == points) x = 0.0;
    const double slope = legendre(points, x).slope;
    const double weight = 1.0 / ((1.0 - x * x) * slope * slope);
    rule.nodes[i] = 0.5 * (1.0 - x);
    rule.nodes[points - 1 - i] = 0.5 * (1.0 + x);
    rule.weights[i] = rule.weights[points - 1 - i] = weight;
  }
  return rule;
}

std::array<GaussRule, kMaxGaussPoints> make_rules() {
  std::array<GaussRule, kMaxGaussPoints> rules;
  for (int points = 1; points <= kMaxGaussPoints; ++points) rules[points - 1] = make_rule(points);
  return rules;
}

}  // namespace

const GaussRule& gauss_rule(int points) {
  require(points >= 1 && points <= kMaxGaussPoints, "gauss_rule: between 1 and 16 points");
  static const std::array<GaussRule, kMaxGaussPoints> rules = make_rules();
  return rules[points - 1];
}

}  // namespace smoothpost
