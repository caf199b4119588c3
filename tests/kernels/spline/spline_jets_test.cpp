#include "kernels/spline/spline_jets.h"

#include <catch2/catch.hpp>
#include <random>

using namespace smoothpost;

TEST_CASE("SplineJets: value and derivatives of the spline", "[kernels][spline]") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  SplineCurve curve;
  curve.knots.values.assign(5, 0.0);
  for (int i = 0; i <= 12; ++i)
    curve.knots.values.push_back(i + (i % 12 ? 0.3 * any(random) : 0.0));
  curve.knots.values.insert(curve.knots.values.end(), 5, 12.0);
  curve.controls.resize(3, curve.knots.controls());
  for (int i = 0; i < curve.controls.size(); ++i) curve.controls(i) = any(random);
  const SplineJets<3> jets(curve);
  CHECK(jets.last() == 12.0);
  for (int i = 0; i <= 600; ++i) {
    const double u = 0.02 * i;
    const auto jet = jets.jet(u, 2.5);
    double factor = 1.0;
    for (int r = 0; r < 4; ++r, factor /= 2.5)
      CHECK((jet.col(r) - factor * curve.at(u, r)).norm() < 1e-10);
  }
  CHECK(jets.jet(-1.0) == jets.jet(0.0));
  CHECK(jets.jet(13.0) == jets.jet(12.0));
  CHECK_THROWS_AS(SplineJets<2>(curve), ContractViolation);
}
