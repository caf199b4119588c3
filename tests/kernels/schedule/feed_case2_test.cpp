#include <catch2/catch.hpp>
#include <optional>

#include "kernels/kinematics/head_geometry.h"
#include "tests/kernels/kinematics/reference_machines.h"
#include "tests/kernels/schedule/feed_paths.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

/// Case 2 of the shared reference: rotaries of the cone programme, and a least-squares quintic of
/// 157 control points through the tips, on the laser's head with the standoff held.
struct Case2 {
  ScrewChain chain = test::laser();  // L0 = 0 as in the golden run; 200 mm takes 0.4 % longer
  HeadGeometry head = *HeadGeometry::from(chain);
  SplineCurve tip, rotary;

  PathJet jet(double s) const {
    VectorJet c;
    Jet q4{}, q5{};
    for (int order = 0; order < 4; ++order) {
      c.col(order) = tip.at(s, order);
      const Eigen::VectorXd q = rotary.at(s, order);
      q4[order] = q[0];
      q5[order] = q[1];
    }
    const LinearsByStandoff linears = linears_by_standoff(head, c, q4, q5);
    PathJet jet{JointVector::Zero(6), JointVector::Zero(6), JointVector::Zero(6)};
    JointVector* orders[] = {&jet.first, &jet.second, &jet.third};
    for (int order = 1; order < 4; ++order) {
      JointVector& q = *orders[order - 1];
      for (int k = 0; k < 3; ++k) q[head.linear[k]] = linears.a(k, order);
      q[head.first_rotary] = q4[order];
      q[head.second_rotary] = q5[order];
    }
    const Vec3 c1 = c.col(1), c2 = c.col(2), c3 = c.col(3);
    jet.tip_first = c1.norm();
    jet.tip_second = c1.dot(c2) / jet.tip_first;
    jet.tip_third =
        (c2.squaredNorm() + c1.dot(c3) - jet.tip_second * jet.tip_second) / jet.tip_first;
    return jet;
  }
};

/// Uniform clamped quintic knots over [0, last].
SplineKnots knots_over(double last, int controls) {
  SplineKnots knots = clamped_knots(5, controls - 5);
  for (double& u : knots.values) u *= last / (controls - 5);
  return knots;
}

std::optional<Case2> case2() {
  const auto rotaries = test::shared_path("reference/case2_cone_controls.csv");
  const auto points = test::shared_path("reference/case2.csv");
  if (!rotaries || !points) return std::nullopt;
  Case2 result;
  const auto angles = test::number_table(*rotaries), tips = test::number_table(*points);
  const double length = 627.5;
  result.rotary = {knots_over(length, static_cast<int>(angles.size())),
                   Eigen::MatrixXd(2, angles.size())};
  for (std::size_t j = 0; j < angles.size(); ++j)
    result.rotary.controls.col(j) << angles[j][0], angles[j][1];
  const SplineKnots knots = knots_over(length, 157);
  const int count = static_cast<int>(tips.size());
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(count, knots.controls()), values(count, 3);
  for (int i = 0; i < count; ++i) {
    const BasisRow row = bspline_basis(knots, length * i / (count - 1));
    basis.row(i).segment(row.first, row.weights.size()) = row.weights.transpose();
    values.row(i) << tips[i][0], tips[i][1], tips[i][2];
  }
  const Eigen::MatrixXd normal = basis.transpose() * basis;
  result.tip = {knots, normal.ldlt().solve(basis.transpose() * values).transpose()};
  return result;
}

}  // namespace

TEST_CASE("schedule_feed: Case 2 of paper B", "[kernels][schedule][paper]") {
  const auto found = case2();
  if (!found) {
    WARN("no ../shared/reference: skipped");
    return;
  }
  FeedPath path;
  path.breaks = {0.0, 627.5};  // quintic: q''' has no jump
  path.feed = {250.0};
  path.jet = [&](std::size_t, double s) { return found->jet(s); };
  FeedLimits limits = test::no_limits(6);
  for (int k = 0; k < 3; ++k) {
    limits.velocity[found->head.linear[k]] = 2e3;
    limits.acceleration[found->head.linear[k]] = 12e3;
    limits.jerk[found->head.linear[k]] = 120e3;
  }
  for (int k : {found->head.first_rotary, found->head.second_rotary}) {
    limits.velocity[k] = 10.0;
    limits.acceleration[k] = 80.0;
    limits.jerk[k] = 200.0;
  }
  limits.tip_acceleration = 8e3;
  limits.tip_jerk = 80e3;
  const FeedResult result = test::from_rest_to_rest(path, limits);
  REQUIRE(result.status == FeedStatus::solved);
  CAPTURE(result.dilation, result.elements, result.iterations);
  CHECK(result.profile.duration() >= 2.8070);
  CHECK(result.profile.duration() <= 2.8115);
  CHECK(result.load.largest() <= 1.0);
  CHECK(test::used_limits(path, limits, result.profile, 20011).largest() <= 1.0);

  path.feed = {500.0};
  CHECK(test::from_rest_to_rest(path, limits).profile.duration() == Approx(2.4204).epsilon(1e-3));
}

}  // namespace smoothpost
