#include "kernels/optimise/tip_fit.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <functional>

#include "kernels/core/contract.h"

using namespace smoothpost;

namespace {

/// Points of a curve over t = 0 … 1, the parameters spread over the pieces; coordinates rounded to
/// multiples of `grid` when it is not 0.
TipFitProblem points_of(const std::function<Vec3(double)>& curve, int points, int pieces,
                        double grid = 0.0) {
  TipFitProblem p;
  p.knots = clamped_knots(5, pieces);
  for (int i = 0; i < points; ++i) {
    const double t = static_cast<double>(i) / (points - 1);
    p.u.push_back(i + 1 == points ? p.knots.last() : t * pieces);
    Vec3 point = curve(t);
    if (grid > 0.0)
      for (int k = 0; k < 3; ++k) point[k] = grid * std::round(point[k] / grid);
    p.points.push_back(point);
  }
  p.tolerance = 0.01;
  p.hybrid = ipopt_available();
  return p;
}

double largest_distance(const TipFitProblem& p, const TipFit& fit) {
  double worst = 0.0;
  for (std::size_t i = 0; i < p.u.size(); ++i)
    worst = std::max(worst, (fit.curve.at(p.u[i]) - p.points[i]).norm());
  return worst;
}

double end_distance(const TipFitProblem& p, const TipFit& fit) {
  return std::max((fit.curve.at(p.u.front()) - p.points.front()).norm(),
                  (fit.curve.at(p.u.back()) - p.points.back()).norm());
}

double jerk_integral(const SplineCurve& curve) {
  const int n = 50 * curve.knots.spans();
  double sum = 0.0;
  for (int i = 0; i < n; ++i)
    sum += curve.at(curve.knots.last() * (i + 0.5) / n, 3).squaredNorm() / 50.0;
  return sum;
}

double largest_jerk(const SplineCurve& curve) {
  const int n = 20 * curve.knots.spans();
  double worst = 0.0;
  for (int i = 0; i <= n; ++i)
    worst = std::max(worst, curve.at(curve.knots.last() * i / n, 3).norm());
  return worst;
}

Vec3 parabola(double t) {
  return Vec3(300.0, 200.0, 100.0) + Vec3(80.0, -30.0, 10.0) * t + Vec3(-20.0, 15.0, 40.0) * t * t;
}

/// Two turns of radius 20 and pitch 15.
Vec3 helix(double t) {
  const double a = 4.0 * M_PI * t;
  return Vec3(20.0 * std::cos(a), 20.0 * std::sin(a), 15.0 * a / (2.0 * M_PI));
}

/// Half a circle of radius 5 in a tilted plane.
Vec3 arc(double t) {
  const Vec3 a = Vec3(1.0, 0.5, 0.2).normalized();
  const Vec3 b = a.unitOrthogonal();
  return 5.0 * (std::cos(M_PI * t) * a + std::sin(M_PI * t) * b);
}

}  // namespace

TEST_CASE("tip_fit: points of a parabola give the parabola", "[kernels][optimise]") {
  const TipFitProblem p = points_of(parabola, 121, 30);
  const TipFit fit = fit_tip(p);
  REQUIRE(fit.failed == -1);
  REQUIRE(fit.solutions.size() == 3);
  double worst = 0.0;
  for (int i = 0; i <= 500; ++i)
    worst = std::max(worst, (fit.curve.at(30.0 * i / 500.0) - parabola(i / 500.0)).norm());
  CHECK(worst < 0.01);
  CHECK(jerk_integral(fit.curve) < 1e-9);
  CHECK(end_distance(p, fit) < 1e-8);
}

TEST_CASE("tip_fit: every point within the tolerance and exact ends", "[kernels][optimise]") {
  const std::vector<std::function<Vec3(double)>> curves = {parabola, helix, arc};
  for (const double tolerance : {0.002, 0.01, 0.05})
    for (std::size_t k = 0; k < curves.size(); ++k) {
      TipFitProblem p = points_of(curves[k], 241, 60);
      p.tolerance = tolerance;
      const TipFit fit = fit_tip(p);
      INFO(k << " tolerance " << tolerance << " at " << fit.place);
      REQUIRE(fit.failed == -1);
      CHECK(largest_distance(p, fit) <= tolerance * (1.0 + 1e-6));
      for (std::size_t i = 0; i < p.u.size(); ++i)
        CHECK((fit.curve.at(p.u[i]) - p.points[i]).cwiseAbs().maxCoeff() <=
              tolerance / std::sqrt(3.0) * (1.0 + 1e-6));
      CHECK(end_distance(p, fit) < 1e-8);
      for (const QpSolution& s : fit.solutions) CHECK(s.certificate.kkt() <= 1e-6);
      CHECK(fit.curve.controls.rows() == 3);
    }
}

TEST_CASE("tip_fit: smoother than the curve that it stands for", "[kernels][optimise]") {
  // A least value is not above that of any curve in the box; the true helix nearly is one.
  const TipFitProblem p = points_of(helix, 481, 120);
  const TipFit fit = fit_tip(p);
  REQUIRE(fit.failed == -1);
  const double rate = 4.0 * M_PI / 120.0;  // rad a piece
  CHECK(jerk_integral(fit.curve) <= 400.0 * std::pow(rate, 6) * 120.0);
  CHECK(largest_jerk(fit.curve) <= 1.5 * 20.0 * std::pow(rate, 3));
}

TEST_CASE("tip_fit: rounding leaves no trace in the third derivative", "[kernels][optimise]") {
  const std::vector<std::function<Vec3(double)>> curves = {parabola, helix, arc};
  const std::vector<double> true_jerk = {0.0, 20.0 * std::pow(4.0 * M_PI / 60.0, 3),
                                         5.0 * std::pow(M_PI / 60.0, 3)};
  for (const double grid : {0.001, 0.005})
    for (std::size_t k = 0; k < curves.size(); ++k) {
      const TipFitProblem p = points_of(curves[k], 241, 60, grid);
      const TipFit fit = fit_tip(p);
      INFO(k << " grid " << grid);
      REQUIRE(fit.failed == -1);
      CHECK(largest_distance(p, fit) <= p.tolerance * (1.0 + 1e-6));
      CHECK(end_distance(p, fit) < 1e-8);
      // Third differences of the rounded points by the points' spacing of 1/4 piece.
      double rounded = 0.0;
      for (std::size_t i = 3; i < p.points.size(); ++i)
        rounded = std::max(
            rounded,
            (p.points[i] - 3.0 * p.points[i - 1] + 3.0 * p.points[i - 2] - p.points[i - 3]).norm() *
                64.0);
      const double jerk = largest_jerk(fit.curve);
      CHECK(jerk < true_jerk[k] + 0.1 * rounded);
      CHECK(jerk <= 2.0 * true_jerk[k] + 1e-4);
    }
}

TEST_CASE("tip_fit: too few pieces", "[kernels][optimise]") {
  // A bump of 5 mm within a 20th of the length on 6 pieces.
  const auto bump = [](double t) {
    const double near = (t - 0.7) / 0.02;
    return Vec3(100.0 * t, 5.0 * std::exp(-near * near), 0.0);
  };
  const TipFitProblem coarse = points_of(bump, 401, 6);
  const TipFit fit = fit_tip(coarse);
  CHECK(fit.failed == 1);
  CHECK(fit.place > 0.5 * 6);
  CHECK(fit.place < 0.9 * 6);
  CHECK(fit.solutions.back().status != QpStatus::optimal);
  const TipFit fine = fit_tip(points_of(bump, 401, 200));
  CHECK(fine.failed == -1);
}

TEST_CASE("tip_fit: a second run gives equal bytes", "[kernels][optimise]") {
  const TipFitProblem p = points_of(helix, 121, 30, 0.001);
  const TipFit a = fit_tip(p), b = fit_tip(p);
  REQUIRE(a.failed == -1);
  CHECK(std::memcmp(a.curve.controls.data(), b.curve.controls.data(),
                    sizeof(double) * static_cast<std::size_t>(a.curve.controls.size())) == 0);
}

TEST_CASE("tip_fit: preconditions", "[kernels][optimise]") {
  TipFitProblem p = points_of(parabola, 21, 5);
  p.tolerance = 0.0;
  CHECK_THROWS_AS(fit_tip(p), ContractViolation);
  p = points_of(parabola, 21, 5);
  p.points.pop_back();
  CHECK_THROWS_AS(fit_tip(p), ContractViolation);
  p = points_of(parabola, 21, 5);
  p.knots = clamped_knots(3, 5);
  CHECK_THROWS_AS(fit_tip(p), ContractViolation);
}
