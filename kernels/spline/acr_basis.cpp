#include "kernels/spline/acr_basis.h"

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

// The septic Hermite functions, coefficients of t⁰ … t⁷. H0 goes from 0 to 1; H1 and E1 have unit
// slope at the start and at the end; M and N have second derivative 2 there.
const Septic kH0{0, 0, 0, 0, 35, -84, 70, -20};
const Septic kH1{0, 1, 0, 0, -20, 45, -36, 10};
const Septic kE1{0, 0, 0, 0, -15, 39, -34, 10};
const Septic kM{0, 0, 1, 0, -10, 20, -15, 4};
const Septic kN{0, 0, 0, 0, 5, -14, 13, -4};

double derivative(const SepticValue& v, int order) {
  switch (order) {
    case 0:
      return v.value;
    case 1:
      return v.d1;
    case 2:
      return v.d2;
    default:
      return v.d3;
  }
}

}  // namespace

SepticValue evaluate(const Septic& c, double t) {
  SepticValue v;
  for (Eigen::Index k = 7; k >= 0; --k) {
    v.d3 = v.d3 * t + 3.0 * v.d2;
    v.d2 = v.d2 * t + 2.0 * v.d1;
    v.d1 = v.d1 * t + v.value;
    v.value = v.value * t + c[k];
  }
  return v;
}

Septic acr_span(const AcrShape& shape, const Eigen::Vector4d& p) {
  const double start_slope = shape.kappa * (p[2] - p[0]);
  const double end_slope = shape.kappa * (p[3] - p[1]);
  const double start_bend = shape.lambda * (p[0] - 2.0 * p[1] + p[2]);
  const double end_bend = shape.lambda * (p[1] - 2.0 * p[2] + p[3]);
  Septic c =
      (p[2] - p[1]) * kH0 + start_slope * kH1 + end_slope * kE1 + start_bend * kM + end_bend * kN;
  c[0] += p[1];
  return c;
}

Eigen::Vector4d acr_basis(const AcrShape& shape, double t, int order) {
  require(t >= 0.0 && t <= 1.0, "acr_basis: t in [0, 1]");
  require(order >= 0 && order <= 3, "acr_basis: derivative order 0 to 3");
  Eigen::Vector4d b;
  for (Eigen::Index i = 0; i < 4; ++i)
    b[i] = derivative(evaluate(acr_span(shape, Eigen::Vector4d::Unit(i)), t), order);
  return b;
}

}  // namespace smoothpost
