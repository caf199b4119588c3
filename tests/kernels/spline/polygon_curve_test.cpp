#include "kernels/spline/polygon_curve.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/contract.h"

using namespace smoothpost;

namespace {

struct Polygon {
  std::vector<double> u;
  Eigen::MatrixXd values;
};

Polygon random_polygon(unsigned seed, int corners) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(0.3, 1.0), value(-2.0, 2.0);
  Polygon p{{0.0}, Eigen::MatrixXd(2, corners)};
  for (int k = 1; k < corners; ++k) p.u.push_back(p.u.back() + step(random));
  for (int k = 0; k < corners; ++k) p.values.col(k) << value(random), value(random);
  return p;
}

SplineKnots knots_over(double last, int pieces) {
  SplineKnots knots = clamped_knots(5, pieces);
  for (double& u : knots.values) u *= last / pieces;
  return knots;
}

Eigen::VectorXd at(const Polygon& p, double u) {
  std::size_t k = 1;
  while (k + 1 < p.u.size() && p.u[k] < u) ++k;
  const double t = (u - p.u[k - 1]) / (p.u[k] - p.u[k - 1]);
  const auto to = static_cast<Eigen::Index>(k);
  return (1.0 - t) * p.values.col(to - 1) + t * p.values.col(to);
}

double distance(const Polygon& p, int pieces) {
  const SplineCurve curve = polygon_curve(knots_over(p.u.back(), pieces), p.u, p.values);
  double worst = 0.0;
  for (int i = 0; i <= 1000; ++i) {
    const double u = std::min(curve.knots.last(), p.u.back() * i / 1000.0);
    worst = std::max(worst, (curve.at(u) - at(p, u)).norm());
  }
  return worst;
}

}  // namespace

TEST_CASE("polygon_curve: shorter pieces come nearer to the polygon", "[kernels][spline]") {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Polygon p = random_polygon(seed, 12);
    const double coarse = distance(p, 20), fine = distance(p, 80), finest = distance(p, 640);
    CHECK(fine < coarse);
    CHECK(finest < 0.25 * fine);
    CHECK(finest < 0.05);
  }
}

TEST_CASE("polygon_curve: a straight polygon is reproduced and ends are met", "[kernels][spline]") {
  Polygon p = random_polygon(7, 9);
  CHECK(
      (polygon_curve(knots_over(p.u.back(), 15), p.u, p.values).at(0.0) - p.values.col(0)).norm() <
      1e-12);
  for (std::size_t k = 0; k < p.u.size(); ++k)
    p.values.col(static_cast<Eigen::Index>(k)) << 3.0 - 2.0 * p.u[k], 0.5 * p.u[k];
  CHECK(distance(p, 15) < 1e-12);
}

TEST_CASE("polygon_curve: in the hull of the control points of its piece", "[kernels][spline]") {
  const Polygon p = random_polygon(8, 14);
  const SplineCurve curve = polygon_curve(knots_over(p.u.back(), 30), p.u, p.values);
  for (int i = 0; i <= 500; ++i) {
    const double u = std::min(curve.knots.last(), p.u.back() * i / 500.0);
    const auto near = curve.controls.middleCols(knot_span(curve.knots, u), 6);
    const Eigen::VectorXd value = curve.at(u);
    CHECK((value.array() <= near.rowwise().maxCoeff().array() + 1e-12).all());
    CHECK((value.array() >= near.rowwise().minCoeff().array() - 1e-12).all());
  }
  CHECK_THROWS_AS(polygon_curve(curve.knots, {0.0}, Eigen::MatrixXd::Zero(2, 1)),
                  ContractViolation);
}
