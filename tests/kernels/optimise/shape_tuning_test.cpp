#include "kernels/optimise/shape_tuning.h"

#include <catch2/catch.hpp>

#include "kernels/core/contract.h"
#include "tests/kernels/optimise/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// A zigzag in the table's range whose tool axis leans another way at each corner.
std::vector<CornerPath> zigzag(const CornerSettings& settings) {
  std::vector<PathNode> nodes;
  std::vector<PathLeg> legs;
  Dice dice(7);
  for (int i = 0; i < 12; ++i) {
    PathNode node;
    node.tip = Vec3(20.0 * i, i % 2 ? 15.0 : 0.0, dice.between(-3.0, 3.0));
    const double lean = i % 2 ? 0.3 : 0.35;
    node.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(
        lean, Vec3(dice.between(0.5, 1.0), dice.between(0.0, 0.4), 0).normalized()));
    if (i > 0) {
      const Eigen::AngleAxisd turn(nodes.back().rotation.conjugate() * node.rotation);
      PathLeg leg;
      leg.turn = turn.angle() * turn.axis();
      legs.push_back(leg);
    }
    nodes.push_back(node);
  }
  std::vector<CornerPath> runs;
  runs.emplace_back(nodes, legs, std::vector<ArcGeometry>{}, settings);
  return runs;
}

TuningSettings settings_for(BlendKind kind) {
  TuningSettings s;
  s.corners.kind = kind;
  s.corners.tip_tolerance = 0.05;
  s.corners.rotation_tolerance = 0.002;
  s.jerk_limits = JointVector::Constant(5, 1e5);
  s.jerk_limits.tail(2).setConstant(1e3);
  s.start = JointVector::Zero(5);
  return s;
}

}  // namespace

TEST_CASE("shape_tuning: never worse than the start and inside the box", "[kernels][optimise]") {
  const auto inverse = Inverse::from(table(Vec3::Constant(-900.0), Vec3::Constant(900.0)));
  REQUIRE(inverse);
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    const TuningSettings s = settings_for(kind);
    const auto runs = zigzag(s.corners);
    const TuningResult r = tune_blend_shape(*inverse, runs, s);
    CHECK(r.corners == 10);
    CHECK(r.evaluations > 5);
    CHECK(r.evaluations <= s.evaluations + 2);
    CHECK(r.peak_before > 0.0);
    CHECK(r.peak_after <= r.peak_before);
    if (kind == BlendKind::acr) {
      CHECK(r.before.acr.kappa == 0.5);
      CHECK(r.after.acr.kappa >= 0.4);
      CHECK(r.after.acr.kappa <= 0.6);
      CHECK(r.after.acr.lambda >= -0.5);
      CHECK(r.after.acr.lambda <= 2.5);
    } else {
      CHECK(r.after.c1 >= -1.09);
      CHECK(r.after.c1 <= 6.56);
    }
    // The peak is that of its definition: the corners made anew with the shape found.
    CornerSettings found = s.corners;
    found.shape = r.after.acr;
    found.ramp_c1 = r.after.c1;
    int reached = 0;
    const double peak = peak_joint_jerk(
        *inverse, single_corners(zigzag(s.corners), found, s.most_corners), s, reached);
    CHECK(reached == 10);
    CHECK(peak == Approx(r.peak_after).epsilon(1e-6));
  }
}

TEST_CASE("shape_tuning: deterministic", "[kernels][optimise]") {
  const auto inverse = Inverse::from(table(Vec3::Constant(-900.0), Vec3::Constant(900.0)));
  const TuningSettings s = settings_for(BlendKind::acr);
  const auto a = tune_blend_shape(*inverse, zigzag(s.corners), s);
  const auto b = tune_blend_shape(*inverse, zigzag(s.corners), s);
  CHECK(a.after.acr.kappa == b.after.acr.kappa);
  CHECK(a.after.acr.lambda == b.after.acr.lambda);
  CHECK(a.peak_after == b.peak_after);
}

TEST_CASE("shape_tuning: the joint jerk of a plain corner in closed form",
          "[kernels][optimise][paper]") {
  // Linear axes alone: joints are the tip, so the peak is |r'''| of the blend: g'''/h² · |T1 − T0|.
  const auto inverse = Inverse::from(table(Vec3::Constant(-900.0), Vec3::Constant(900.0)));
  TuningSettings s = settings_for(BlendKind::ramp);
  s.corners.ramp_c1 = 0.0;
  s.jerk_limits.setOnes();
  std::vector<PathNode> nodes(3);
  nodes[1].tip = Vec3(10, 0, 0);
  nodes[2].tip = Vec3(10, 10, 0);
  std::vector<CornerPath> corners;
  corners.emplace_back(nodes, std::vector<PathLeg>(2), std::vector<ArcGeometry>{}, s.corners);
  const double h = corners[0].corners()[1].half_width;
  // c1 = 0: g''' = −4u(1−u²)·15/16, largest at u = 1/√3; X and Y each take one component.
  const double u = 1.0 / std::sqrt(3.0);
  const double expected = 4.0 * u * (1.0 - u * u) * 15.0 / 16.0 / (h * h);
  int reached = 0;
  CHECK(peak_joint_jerk(*inverse, corners, s, reached) == Approx(expected).epsilon(0.02));
  CHECK(reached == 1);
}

TEST_CASE("shape_tuning: preconditions", "[kernels][optimise]") {
  const auto inverse = Inverse::from(table(Vec3::Constant(-900.0), Vec3::Constant(900.0)));
  TuningSettings s = settings_for(BlendKind::acr);
  CHECK_THROWS_AS(tune_blend_shape(*inverse, {}, s), ContractViolation);
  s.jerk_limits[2] = 0.0;
  CHECK_THROWS_AS(tune_blend_shape(*inverse, zigzag(s.corners), s), ContractViolation);
}
