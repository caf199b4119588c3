#include "kernels/kinematics/numeric_ik.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <string>

#include "kernels/core/contract.h"
#include "kernels/kinematics/rotary_pair.h"
#include "kernels/kinematics/six_r.h"
#include "tests/kernels/kinematics/reference_machines.h"

namespace smoothpost {
namespace {

using Status = NumericInverse::Status;

ChainJoint rotary(const Vec3& direction, const Vec3& origin, double range = M_PI) {
  ChainJoint joint;
  joint.kind = JointKind::rotary;
  joint.direction = direction;
  joint.origin = origin;
  joint.lower = -range;
  joint.upper = range;
  return joint;
}

/// Ortho-parallel arm, upright, tool at an angle to the last axis.
ScrewChain robot() {
  const Vec3 wrist(315, 0, 2400);
  ScrewChain chain;
  chain.joints = {rotary(Vec3::UnitZ(), Vec3::Zero()),
                  rotary(Vec3::UnitY(), Vec3(350, 0, 800), 2.0),
                  rotary(Vec3::UnitY(), Vec3(350, 0, 1600), 2.4),
                  rotary(Vec3::UnitZ(), wrist),
                  rotary(Vec3::UnitY(), wrist, 2.1),
                  rotary(Vec3::UnitZ(), wrist)};
  chain.tool_home.translation() = wrist + Vec3(150, 0, 300);
  chain.tool_axis = Vec3(-1, 0, -1).normalized();
  return chain;
}

/// The robot on a rail of 3 m with the part on a turntable: eight joints on both sides.
ScrewChain robot_on_rail() {
  ScrewChain chain = robot();
  ChainJoint rail;
  rail.direction = Vec3::UnitY();
  rail.lower = -1500.0;
  rail.upper = 1500.0;
  chain.joints.insert(chain.joints.begin(), rail);
  ChainJoint table = rotary(Vec3::UnitZ(), Vec3(1500, 0, 0), 2.0 * M_PI);
  table.side = ChainSide::workpiece;
  chain.joints.push_back(table);
  chain.workpiece_home.translation() = Vec3(1500, 0, 500);
  return chain;
}

/// Paper C, reading A: two linears and two rotaries at the tool, lift and turntable at the part.
ScrewChain finishing_stage() {
  ScrewChain chain;
  chain.joints = {test::joint({'X', ChainSide::tool, 0, 280}),
                  test::joint({'Y', ChainSide::tool, -130, 130}),
                  test::joint({'C', ChainSide::tool, -2, 2, Vec3(-300, 0, 0)}),
                  test::joint({'B', ChainSide::tool, -1.4, 1.4, Vec3(-300, 0, 0)}),
                  test::joint({'Z', ChainSide::workpiece, -400, 0}),
                  test::joint({'C', ChainSide::workpiece, -7, 7})};
  chain.tool_home.translation() = Vec3(-220, 0, 0);
  chain.tool_axis = Vec3(-1, 0, 0);
  return chain;
}

std::map<std::string, ScrewChain> chains() {
  return {{"robot", robot()},
          {"robot on rail", robot_on_rail()},
          {"finishing stage", finishing_stage()},
          {"laser", test::laser(200.0)},
          {"table AC", test::table_table_ac()},
          {"table B45C", test::table_table_b45c()}};
}

/// q moved by up to `angle` rad, and by 200 mm a rad for linears, inside the limits.
JointVector near(test::Random& random, const ScrewChain& chain, const JointVector& q,
                 double angle) {
  JointVector out = q;
  for (int j = 0; j < q.size(); ++j) {
    const bool linear = chain.joints[j].kind == JointKind::linear;
    out[j] += random.between(-angle, angle) * (linear ? 200.0 : 1.0);
    out[j] = std::clamp(out[j], chain.joints[j].lower, chain.joints[j].upper);
  }
  return out;
}

bool within_limits(const ScrewChain& chain, const JointVector& q) {
  for (int j = 0; j < q.size(); ++j)
    if (q[j] < chain.joints[j].lower || q[j] > chain.joints[j].upper) return false;
  return true;
}

double rotation_error(const Pose& a, const Pose& b) {
  return rotation_log(a.linear().transpose() * b.linear()).norm();
}

void check_location(const ScrewChain& chain, const NumericInverse& found,
                    const CutterLocation& target) {
  const CutterLocation back = forward_location(chain, found.q);
  REQUIRE((back.tip - target.tip).norm() <= 1.01e-9);
  REQUIRE(angle_between(back.axis, target.axis) <= 1.01e-12);
  REQUIRE(within_limits(chain, found.q));
}

void check_pose(const ScrewChain& chain, const NumericInverse& found, const Pose& target) {
  const Pose back = forward(chain, found.q);
  REQUIRE((back.translation() - target.translation()).norm() <= 1.01e-9);
  REQUIRE(rotation_error(back, target) <= 1.01e-12);
  REQUIRE(within_limits(chain, found.q));
}

}  // namespace

TEST_CASE("numeric_ik: converges to 1e-9 mm and 1e-12 rad from 0.05 rad off",
          "[kernels][kinematics]") {
  test::Random random(71);
  for (const auto& [name, chain] : chains()) {
    CAPTURE(name);
    int failed = 0;
    int most = 0;
    for (int n = 0; n < 4000; ++n) {
      const JointVector q = random.joints(chain);
      const JointVector start = near(random, chain, q, 0.05);
      const CutterLocation location = forward_location(chain, q);
      const NumericInverse by_axis = numeric_inverse(chain, location, start);
      if (by_axis.status == Status::ok) check_location(chain, by_axis, location);
      const Pose pose = forward(chain, q);
      const NumericInverse by_pose = numeric_inverse(chain, pose, start);
      if (by_pose.status == Status::ok) check_pose(chain, by_pose, pose);
      failed += by_axis.status == Status::ok ? 0 : 1;
      failed += by_pose.status == Status::ok ? 0 : 1;
      most = std::max({most, by_axis.iterations, by_pose.iterations});
    }
    CAPTURE(most);
    CHECK(failed <=
          8);  // of 8000: poses with a joint near its limit, from the other side of a pole
  }
}

TEST_CASE("numeric_ik: agrees with the closed forms", "[kernels][kinematics]") {
  test::Random random(72);
  const auto arm = SixR::from(robot());
  const auto pair = RotaryPair::from(test::table_table_ac());
  REQUIRE(arm);
  REQUIRE(pair);
  NumericInverseSettings free;
  free.limits = false;
  int compared = 0;
  for (int n = 0; n < 2000; ++n) {
    const JointVector q = random.joints(arm->chain());
    const Pose pose = forward(arm->chain(), q);
    const NumericInverse found =
        numeric_inverse(arm->chain(), pose, near(random, arm->chain(), q, 0.02), free);
    REQUIRE(found.status == Status::ok);
    const SixRSolutions solutions = arm->solve(pose, found.q);
    double best = 10.0;
    for (int b = 0; b < 8; ++b) {
      if (!solutions.valid[b]) continue;
      double worst = 0.0;
      for (int j = 0; j < 6; ++j)
        worst = std::max(worst, test::angle_difference(found.q[j], solutions.q[b][j]));
      best = std::min(best, worst);
    }
    CHECK(best < 1e-5);
    compared += best < 1e-9 ? 1 : 0;
  }
  CHECK(compared > 1900);
}

TEST_CASE("numeric_ik: from far away, success is counted", "[kernels][kinematics]") {
  test::Random random(73);
  for (const auto& [name, chain] : chains()) {
    CAPTURE(name);
    int found_ok = 0;
    for (int n = 0; n < 1000; ++n) {
      const CutterLocation target = forward_location(chain, random.joints(chain));
      JointVector middle(chain.size());
      for (int j = 0; j < chain.size(); ++j)
        middle[j] = 0.5 * (chain.joints[j].lower + chain.joints[j].upper) + 0.3;
      const NumericInverse found = numeric_inverse(chain, target, middle);
      REQUIRE(found.q.allFinite());
      REQUIRE(within_limits(chain, found.q));
      if (found.status != Status::ok) continue;
      check_location(chain, found, target);
      ++found_ok;
    }
    CAPTURE(found_ok);
    CHECK(found_ok > 500);
  }
}

TEST_CASE("numeric_ik: the step of a redundant chain is least-norm to first order",
          "[kernels][kinematics]") {
  const ScrewChain chain = robot_on_rail();
  test::Random random(74);
  NumericInverseSettings settings;
  settings.weight = JointVector::Constant(8, 100.0);
  settings.weight[0] = 0.3;
  settings.weight[7] = 40.0;
  int tested = 0;
  for (int n = 0; n < 300; ++n) {
    JointVector q = 0.6 * random.joints(chain);
    q[5] = 0.8 + 0.2 * random.between(-1, 1);  // away from the wrist's singular pose
    const JointVector to = near(random, chain, q, 1e-4);
    const NumericInverse found = numeric_inverse(chain, forward(chain, to), q, settings);
    REQUIRE(found.status == Status::ok);
    // The motion has no part in the null space, measured with the weights.
    const Jacobian j = jacobian(chain, q);
    const Eigen::MatrixXd null = Eigen::FullPivLU<Eigen::MatrixXd>(j).kernel();
    const Eigen::VectorXd weighted =
        settings.weight.cwiseProduct(settings.weight).cwiseProduct(found.q - q);
    for (int k = 0; k < null.cols(); ++k) {
      const Eigen::VectorXd direction = null.col(k);
      const double share =
          std::abs(direction.dot(weighted)) / (settings.weight.cwiseProduct(direction).norm() *
                                               settings.weight.cwiseProduct(found.q - q).norm());
      CHECK(share < 0.02);
    }
    ++tested;
  }
  CHECK(tested == 300);
}

TEST_CASE("numeric_ik: centring reaches the least distance along the null space",
          "[kernels][kinematics]") {
  // The finishing stage has one free motion, the bed's angle: compare with a fine search over it.
  const ScrewChain chain = finishing_stage();
  test::Random random(75);
  for (int n = 0; n < 20; ++n) {
    JointVector q = random.joints(chain);
    q[0] = 140 + 60 * random.between(-1, 1);
    q[1] = 40 * random.between(-1, 1);
    q[2] = 0.5 * random.between(-1, 1);
    q[5] = random.between(-1, 1);
    const CutterLocation target = forward_location(chain, q);
    NumericInverseSettings settings;
    settings.limits = false;
    settings.centre = JointVector::Zero(6);
    settings.centre[0] = 140.0;
    settings.centre[4] = -200.0;
    const NumericInverse found = numeric_inverse(chain, target, q, settings);
    REQUIRE(found.status == Status::ok);
    check_location(chain, found, target);
    const auto cost = [&](const JointVector& at) {
      double sum = 0.0;
      for (int j = 0; j < 6; ++j) {
        const double w = chain.joints[j].kind == JointKind::linear ? 1.0 : 100.0;
        sum += std::pow(w * (at[j] - settings.centre[j]), 2);
      }
      return sum;
    };
    NumericInverseSettings plain;
    plain.limits = false;
    const double here = cost(found.q);
    for (const double step : {-1e-3, 1e-3}) {
      JointVector aside = found.q;
      aside[5] += step;  // the bed alone, the rest follows with the bed held still
      plain.weight = JointVector::Constant(6, 1.0);
      plain.weight[5] = 1e9;
      const NumericInverse other = numeric_inverse(chain, target, aside, plain);
      REQUIRE(other.status == Status::ok);
      CHECK(cost(other.q) >= here - 1e-6);
    }
  }
}

TEST_CASE("numeric_ik: limits are kept and named", "[kernels][kinematics]") {
  ScrewChain chain = test::table_table_ac();
  JointVector q(5);
  q << 10, 20, 30, 0.4, 0.7;
  const CutterLocation target = forward_location(chain, q);
  chain.joints[0].upper = 5.0;  // X would have to be at 10
  const NumericInverse found = numeric_inverse(chain, target, JointVector::Zero(5));
  CHECK(found.status == Status::limit);
  CHECK(found.joint == 0);
  CHECK(found.q[0] == 5.0);
  CHECK(within_limits(chain, found.q));
  CHECK(found.tip_error > 0.1);
  NumericInverseSettings free;
  free.limits = false;
  CHECK(numeric_inverse(chain, target, JointVector::Zero(5), free).status == Status::ok);

  // A redundant chain goes round the limit.
  ScrewChain rail = robot_on_rail();
  test::Random random(76);
  NumericInverseSettings cheap_rail;
  cheap_rail.weight = JointVector::Constant(8, 100.0);
  cheap_rail.weight[0] = 0.01;
  int at_limit = 0;
  for (int n = 0; n < 300; ++n) {
    JointVector start = 0.4 * random.joints(rail);
    start[3] = 1.0;  // the elbow bent, the wrist away from its singular pose
    start[5] = 1.0;
    ScrewChain tight = rail;
    tight.joints[0].lower = start[0] - 1.0;
    tight.joints[0].upper = start[0] + 1.0;
    const Pose pose = forward(rail, near(random, rail, start, 0.1));
    const NumericInverse round = numeric_inverse(tight, pose, start, cheap_rail);
    REQUIRE(round.status == Status::ok);
    check_pose(tight, round, pose);
    const bool stopped = round.q[0] == tight.joints[0].lower || round.q[0] == tight.joints[0].upper;
    at_limit += stopped ? 1 : 0;
  }
  CHECK(at_limit > 50);
}

TEST_CASE("numeric_ik: a start beyond the limits is clamped", "[kernels][kinematics]") {
  const ScrewChain chain = test::laser();
  JointVector q(6);
  q << 100, 200, 300, 0.5, 0.6, 0.0;
  const CutterLocation target = forward_location(chain, q);
  JointVector start = q;
  start[0] = -5000.0;
  start[5] = 500.0;
  const NumericInverse found = numeric_inverse(chain, target, start);
  REQUIRE(found.status == Status::ok);
  check_location(chain, found, target);
}

TEST_CASE("numeric_ik: unreachable targets end with the nearest pose found",
          "[kernels][kinematics]") {
  const ScrewChain chain = robot();
  NumericInverseSettings free;
  free.limits = false;
  JointVector start = JointVector::Constant(6, 0.3);
  CutterLocation target = forward_location(chain, start);
  target.tip = Vec3(9000, 0, 800);
  const NumericInverse found = numeric_inverse(chain, target, start, free);
  CHECK(found.status == Status::unreachable);
  CHECK(found.q.allFinite());
  CHECK(found.tip_error > 5000.0);
  CHECK(found.tip_error < 7500.0);
  const CutterLocation back = forward_location(chain, found.q);
  CHECK((back.tip - target.tip).norm() == Approx(found.tip_error));
  CHECK(angle_between(back.axis, target.axis) == Approx(found.rotation_error).margin(1e-12));

  // Roll about the tool cannot be commanded on a five-axis machine.
  const ScrewChain mill = test::table_table_ac();
  JointVector q = JointVector::Constant(5, 0.2);
  Pose rolled = forward(mill, q);
  rolled.linear() = rolled.linear() * rotation_about(Vec3::UnitZ(), 0.5);
  CHECK(numeric_inverse(mill, rolled, q).status != Status::ok);
  CHECK(numeric_inverse(mill, forward(mill, q), JointVector::Zero(5)).status == Status::ok);
}

TEST_CASE("numeric_ik: singular poses by name", "[kernels][kinematics]") {
  const ScrewChain arm = robot();
  JointVector q = JointVector::Constant(6, 0.4);
  test::Random random(77);
  const auto converges = [&](const ScrewChain& chain, const JointVector& at) {
    const Pose pose = forward(chain, at);
    const NumericInverse found = numeric_inverse(chain, pose, near(random, chain, at, 0.05));
    CAPTURE(found.iterations, found.tip_error, found.rotation_error);
    REQUIRE(found.status == Status::ok);
    check_pose(chain, found, pose);
  };
  q[4] = 0.0;  // wrist: axes 4 and 6 parallel
  converges(arm, q);
  q[4] = 0.7;
  q[2] = std::atan2(35.0, 800.0);  // elbow stretched: the wrist offset lies along the upper arm
  converges(arm, q);
  // Pole of a head: the tool along the first rotary.
  JointVector laser(6);
  laser << 100, 200, 300, 0.4, 0.0, 0.0;
  converges(test::laser(), laser);
  const CutterLocation upright = forward_location(test::laser(), laser);
  const NumericInverse found =
      numeric_inverse(test::laser(), upright, near(random, test::laser(), laser, 0.05));
  REQUIRE(found.status == Status::ok);
  check_location(test::laser(), found, upright);
  // The opposite tool axis is a saddle of the error: no NaN.
  JointVector turned = JointVector::Zero(6);
  CutterLocation down = forward_location(arm, turned);
  down.axis = -down.axis;
  CHECK(numeric_inverse(arm, down, turned).q.allFinite());
}

TEST_CASE("numeric_ik: preconditions", "[kernels][kinematics]") {
  const ScrewChain chain = robot();
  const JointVector q = JointVector::Zero(6);
  const Pose pose = forward(chain, q);
  CHECK_THROWS_AS(numeric_inverse(chain, pose, JointVector::Zero(5)), ContractViolation);
  CHECK_THROWS_AS(numeric_inverse(chain, pose, JointVector::Constant(6, NAN)), ContractViolation);
  CutterLocation location = forward_location(chain, q);
  location.axis *= 2.0;
  CHECK_THROWS_AS(numeric_inverse(chain, location, q), ContractViolation);
  NumericInverseSettings settings;
  settings.weight = JointVector::Zero(6);
  CHECK_THROWS_AS(numeric_inverse(chain, pose, q, settings), ContractViolation);
  settings.weight = JointVector::Ones(4);
  CHECK_THROWS_AS(numeric_inverse(chain, pose, q, settings), ContractViolation);
  settings.weight.resize(0);
  settings.centre = JointVector::Ones(4);
  CHECK_THROWS_AS(numeric_inverse(chain, pose, q, settings), ContractViolation);
  settings.centre.resize(0);
  settings.length = 0.0;
  CHECK_THROWS_AS(numeric_inverse(chain, pose, q, settings), ContractViolation);
}

}  // namespace smoothpost
