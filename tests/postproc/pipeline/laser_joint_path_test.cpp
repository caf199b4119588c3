#include "postproc/pipeline/laser_joint_path.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/kinematics/rotary_pair.h"
#include "postproc/pipeline/laser_plan.h"
#include "tests/kernels/kinematics/reference_machines.h"

using namespace smoothpost;

namespace {

/// A spline whose control points follow slow waves.
SplineCurve waves(const SplineKnots& knots, std::vector<double> start, double size) {
  SplineCurve curve{knots, Eigen::MatrixXd(start.size(), knots.controls())};
  for (int c = 0; c < curve.controls.rows(); ++c)
    for (int j = 0; j < knots.controls(); ++j)
      curve.controls(c, j) = start[static_cast<std::size_t>(c)] +
                             size * std::sin(0.4 * j + 1.3 * c) + 0.2 * size * std::cos(0.9 * j);
  return curve;
}

struct Sample {
  ScrewChain chain = test::laser(80.0);
  LaserJointPath path;

  Sample() {
    const SplineKnots knots = clamped_knots(5, 12);
    path.head = *HeadGeometry::from(chain);
    path.tip = waves(knots, {10.0, -20.0, 5.0}, 15.0);
    path.rotary = waves(knots, {0.4, 0.9}, 0.3);
    path.standoff = waves(knots, {-3.0}, 8.0);
    path.held = JointVector::Zero(chain.size());
    path.length = 60.0;
  }
};

}  // namespace

TEST_CASE("laser_joint_path: the joints stand for tip and rotaries at every place",
          "[postproc][pipeline][laser]") {
  const Sample s;
  for (int k = 0; k <= 240; ++k) {
    const double u = s.path.last() * k / 240.0;
    const JointVector q = s.path.joints(u);
    CHECK((s.path.tip.at(u) - forward_location(s.chain, q).tip).norm() < 1e-9);
    CHECK((s.path.tool(u).tip - s.path.tip.at(u)).norm() < 1e-12);
    CHECK((s.path.tool(u).axis - forward_location(s.chain, q).axis).norm() < 1e-12);
    CHECK(q[s.path.head.first_rotary] == Approx(s.path.rotary.at(u)[0]).margin(1e-12));
    CHECK(q[s.path.head.second_rotary] == Approx(s.path.rotary.at(u)[1]).margin(1e-12));
    CHECK(q[s.path.head.standoff] == Approx(s.path.standoff.at(u)[0]).margin(1e-12));
  }
}

TEST_CASE("laser_joint_path: derivatives are differences of the joints",
          "[postproc][pipeline][laser]") {
  const Sample s;
  const double h = 1e-4;
  for (int k = 1; k < 120; ++k) {
    const double u = s.path.last() * k / 120.0;
    const JointJet below = s.path.jet(u - h), here = s.path.jet(u), above = s.path.jet(u + h);
    for (int order = 0; order < 3; ++order) {
      const JointVector slope = (above.col(order) - below.col(order)) / (2.0 * h);
      CHECK((slope - here.col(order + 1)).norm() < 1e-5 * (1.0 + here.col(order + 1).norm()));
    }
    CHECK((s.path.tip_jet(u).col(2) - s.path.tip.at(u, 2)).norm() < 1e-12);
  }
}

TEST_CASE("laser_joint_path: breaks are the knots and u is a share of the length",
          "[postproc][pipeline][laser]") {
  const Sample s;
  const std::vector<double> breaks = s.path.breaks();
  REQUIRE(breaks.size() == 13);
  for (std::size_t i = 0; i < breaks.size(); ++i) CHECK(breaks[i] == static_cast<double>(i));
  CHECK(s.path.length_at(6.0) == Approx(30.0));
  CHECK(s.path.parameter_at(30.0) == Approx(6.0));
  // The joints have four continuous derivatives there: no step in the third one.
  for (std::size_t i = 1; i + 1 < breaks.size(); ++i) {
    const JointJet below = s.path.jet(breaks[i] - 1e-7), above = s.path.jet(breaks[i] + 1e-7);
    CHECK((below - above).cwiseAbs().maxCoeff() < 1e-4);
  }
}
