#include "kernels/kinematics/six_r.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <utility>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/reference_machines.h"

namespace smoothpost {
namespace {

/// Lengths of an ortho-parallel arm in the words of the literature, mm.
struct ArmText {
  double a1 = 25.0;
  double a2 = -35.0;
  double b = 0.0;
  double c1 = 400.0;
  double c2 = 315.0;
  double c3 = 365.0;
  double c4 = 80.0;
};

ChainJoint rotary(const Vec3& direction, const Vec3& origin) {
  ChainJoint joint;
  joint.kind = JointKind::rotary;
  joint.direction = direction;
  joint.origin = origin;
  joint.lower = -M_PI;
  joint.upper = M_PI;
  return joint;
}

/// The arm upright: every link along z. Tool along the sixth axis.
ScrewChain upright(const ArmText& arm) {
  const Vec3 y = Vec3::UnitY();
  const Vec3 z = Vec3::UnitZ();
  const Vec3 elbow(arm.a1, 0.0, arm.c1 + arm.c2);
  const Vec3 wrist = elbow + Vec3(arm.a2, arm.b, arm.c3);
  ScrewChain chain;
  chain.joints = {rotary(z, Vec3::Zero()), rotary(y, Vec3(arm.a1, 0, arm.c1)),
                  rotary(y, elbow),        rotary(z, wrist),
                  rotary(y, wrist),        rotary(z, wrist)};
  chain.tool_home.translation() = wrist + Vec3(0, 0, arm.c4);
  return chain;
}

Pose random_pose(test::Random& random, double reach) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(random.between(-M_PI, M_PI), random.unit()).toRotationMatrix();
  pose.translation() = reach * random.between(0.0, 1.0) * random.unit();
  return pose;
}

/// The chain with every screw as it is at the joint values `zero`, which become 0.
ScrewChain with_zero_at(const ScrewChain& chain, const JointVector& zero) {
  ScrewChain out = chain;
  Pose moved = Pose::Identity();
  for (int i = 0; i < chain.size(); ++i) {
    out.joints[i].direction = moved.linear() * chain.joints[i].direction;
    out.joints[i].origin = moved * chain.joints[i].origin;
    const Mat3 turn = rotation_about(out.joints[i].direction.normalized(), zero[i]);
    Pose step = Pose::Identity();
    step.linear() = turn;
    step.translation() = out.joints[i].origin - turn * out.joints[i].origin;
    moved = step * moved;
  }
  out.tool_home = moved * chain.tool_home;
  return out;
}

/// Everything about an arm that may differ: lengths, side, zeros, signs, base, points of the axes.
ScrewChain random_arm(test::Random& random) {
  ArmText arm;
  for (double* length : {&arm.a1, &arm.a2, &arm.b})
    *length = random.below(4) == 0 ? 0.0 : random.between(-200.0, 200.0);
  arm.c1 = random.between(-100.0, 900.0);
  arm.c2 = random.between(200.0, 1200.0);
  arm.c3 = random.between(200.0, 1200.0);
  ScrewChain chain = upright(arm);
  JointVector zero(6);
  for (int i = 0; i < 6; ++i) zero[i] = random.between(-M_PI, M_PI);
  chain.tool_home = chain.tool_home * random_pose(random, 500.0);
  chain = with_zero_at(chain, zero);
  const Pose place = random_pose(random, 3000.0);
  for (ChainJoint& joint : chain.joints) {
    joint.direction = (place.linear() * joint.direction).normalized();
    joint.origin = place * joint.origin + random.between(-300.0, 300.0) * joint.direction;
    if (random.below(2) == 0) joint.direction = -joint.direction;
    joint.redundant = random.below(2) == 0;
  }
  chain.tool_home = place * chain.tool_home;
  chain.workpiece_home = random_pose(random, 2000.0);
  return chain;
}

double rotation_error(const Pose& a, const Pose& b) {
  return rotation_log(a.linear().transpose() * b.linear()).norm();
}

double joint_difference(const JointVector& a, const JointVector& b) {
  double worst = 0.0;
  for (int i = 0; i < a.size(); ++i) worst = std::max(worst, test::angle_difference(a[i], b[i]));
  return worst;
}

/// Checks every valid branch against the pose and the range of its angles; returns their number.
int check_branches(const SixR& arm, const Pose& pose, const SixRSolutions& solutions) {
  int count = 0;
  for (int b = 0; b < 8; ++b) {
    if (!solutions.valid[b]) continue;
    ++count;
    REQUIRE(solutions.q[b].allFinite());
    REQUIRE(solutions.q[b].minCoeff() > -M_PI);
    REQUIRE(solutions.q[b].maxCoeff() <= M_PI);
    const Pose back = forward(arm.chain(), solutions.q[b]);
    REQUIRE((back.translation() - pose.translation()).norm() <= 1e-9);
    REQUIRE(rotation_error(back, pose) <= 1e-12);
  }
  return count;
}

JointVector joints(std::initializer_list<double> values) {
  JointVector q(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), q.data());
  return q;
}

}  // namespace

TEST_CASE("six_r: FK(IK(x)) = x on 20,000 poses of the reference robot",
          "[kernels][kinematics][paper]") {
  const auto arm = SixR::from(upright({}));
  REQUIRE(arm);
  test::Random random(61);
  std::array<int, 8> own{};
  for (int n = 0; n < 20000; ++n) {
    const JointVector q = random.joints(arm->chain());
    const Pose pose = forward(arm->chain(), q);
    const SixRSolutions solutions = arm->solve(pose, q);
    const int branch = arm->branch_of(q);
    REQUIRE(solutions.valid[branch]);
    REQUIRE(joint_difference(solutions.q[branch], q) < 1e-6);
    REQUIRE(check_branches(*arm, pose, solutions) >= 2);
    ++own[branch];
  }
  for (int b = 0; b < 8; ++b) CHECK(own[b] > 100);
}

TEST_CASE("six_r: mirrored and offset arms with any zero and sign on 20,000 poses",
          "[kernels][kinematics]") {
  test::Random random(62);
  std::array<int, 8> own{};
  for (int n = 0; n < 2000; ++n) {
    const auto arm = SixR::from(random_arm(random));
    REQUIRE(arm);
    for (int k = 0; k < 10; ++k) {
      const JointVector q = random.joints(arm->chain());
      const Pose pose = forward(arm->chain(), q);
      const SixRSolutions solutions = arm->solve(pose, q);
      const int branch = arm->branch_of(q);
      REQUIRE(solutions.valid[branch]);
      REQUIRE(joint_difference(solutions.q[branch], q) < 1e-5);
      REQUIRE(check_branches(*arm, pose, solutions) >= 2);
      ++own[branch];
    }
  }
  for (int b = 0; b < 8; ++b) CHECK(own[b] > 100);
}

TEST_CASE("six_r: the branches are different and keep their index along a path",
          "[kernels][kinematics]") {
  const auto arm = SixR::from(
      upright({.a1 = 300, .a2 = 145, .b = 20, .c1 = 800, .c2 = 850, .c3 = 820, .c4 = 170}));
  REQUIRE(arm);
  const JointVector from = joints({0.1, 0.4, 0.9, 0.3, 0.6, -0.4});
  const JointVector to = joints({0.6, 0.6, 1.2, 0.8, 1.1, 0.5});
  std::array<JointVector, 8> last;
  for (int n = 0; n <= 1000; ++n) {
    const JointVector q = from + (to - from) * (n / 1000.0);
    const SixRSolutions solutions = arm->solve(forward(arm->chain(), q), q);
    for (int b = 0; b < 8; ++b) {
      REQUIRE(solutions.valid[b] == solutions.valid[b & 3]);
      if (!solutions.valid[b]) continue;
      CHECK(arm->branch_of(solutions.q[b]) == b);
      for (int other = 0; other < b; ++other)
        if (solutions.valid[other])
          CHECK(joint_difference(solutions.q[b], solutions.q[other]) > 0.01);
      if (last[b].size() == 6) CHECK(joint_difference(solutions.q[b], last[b]) < 0.02);
      last[b] = solutions.q[b];
    }
    CHECK(solutions.valid[0]);
  }
}

TEST_CASE("six_r: front is the side of the second axis whatever the directions of the joints",
          "[kernels][kinematics]") {
  for (const int reversed : {0, 1, 2, 3}) {
    CAPTURE(reversed);
    ScrewChain chain = upright({.a1 = 300, .a2 = 0, .b = 0, .c1 = 800, .c2 = 800, .c3 = 800});
    for (const int j : {0, 1})
      if ((reversed >> j) % 2 == 1) chain.joints[j].direction = -chain.joints[j].direction;
    const auto arm = SixR::from(chain);
    REQUIRE(arm);
    Pose pose = Pose::Identity();
    pose.linear() = rotation_about(Vec3::UnitY(), M_PI_2);
    pose.translation() = Vec3(1000, 0, 1000);
    const SixRSolutions solutions = arm->solve(pose);
    for (const int branch : {0, 2, 4, 6}) {
      REQUIRE(solutions.valid[branch]);
      CHECK(test::angle_difference(solutions.q[branch][0], 0.0) < 1e-12);
    }
    for (const int branch : {1, 3, 5, 7})
      if (solutions.valid[branch])
        CHECK(test::angle_difference(solutions.q[branch][0], M_PI) < 1e-12);
  }
}

TEST_CASE("six_r: closed case: upright arm with the wrist at a right angle",
          "[kernels][kinematics]") {
  // a1 = a2 = b = 0: shoulder at 400, upper arm 300, forearm 400; q3 = 90 deg, q5 = 90 deg.
  const auto arm =
      SixR::from(upright({.a1 = 0, .a2 = 0, .b = 0, .c1 = 400, .c2 = 300, .c3 = 400, .c4 = 50}));
  REQUIRE(arm);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_about(Vec3::UnitY(), M_PI);
  pose.translation() = Vec3(400, 0, 650);  // wrist at (400, 0, 700), tool pointing down
  const SixRSolutions solutions = arm->solve(pose);
  REQUIRE(solutions.valid[0]);
  CHECK(joint_difference(solutions.q[0], joints({0, 0, M_PI_2, 0, M_PI_2, 0})) < 1e-14);
  REQUIRE(solutions.valid[4]);
  CHECK(joint_difference(solutions.q[4], joints({0, 0, M_PI_2, M_PI, -M_PI_2, M_PI})) < 1e-14);
  REQUIRE(solutions.valid[3]);
  CHECK(test::angle_difference(solutions.q[3][0], M_PI) < 1e-14);
}

TEST_CASE("six_r: wrist singular: the fourth joint is held and the sum is right",
          "[kernels][kinematics]") {
  for (const bool elsewhere : {false, true}) {
    ScrewChain chain = upright({});
    if (elsewhere) chain = with_zero_at(chain, joints({0.3, -0.2, 0.8, 0.5, 0.0, -1.0}));
    const auto arm = SixR::from(chain);
    REQUIRE(arm);
    for (const double bend : {0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-6, 1e-3}) {
      CAPTURE(elsewhere, bend);
      const JointVector q = joints({0.4, 0.3, 0.9, 0.7, bend, -0.4});
      const Pose pose = forward(arm->chain(), q);
      const JointVector near = joints({0.4, 0.3, 0.9, 1.2, 0.0, 0.0});
      const SixRSolutions solutions = arm->solve(pose, near);
      REQUIRE(check_branches(*arm, pose, solutions) >= 4);
      const bool singular = bend < 1e-12;
      REQUIRE(solutions.wrist_singular[arm->branch_of(q) & 3] == singular);
      const JointVector& found = solutions.q[arm->branch_of(q)];
      CHECK(test::angle_difference(found[3] + found[5], 0.3) < 1e-12);
      if (!singular) continue;
      CHECK(found[3] == 1.2);
      CHECK(joint_difference(found, solutions.q[arm->branch_of(q) ^ 4]) == 0.0);
    }
    // The far end: axes 4 and 6 antiparallel.
    const JointVector far = joints({0.4, 0.3, 0.9, 0.7, M_PI, -0.4});
    const Pose pose = forward(arm->chain(), far);
    const SixRSolutions solutions = arm->solve(pose, far);
    REQUIRE(check_branches(*arm, pose, solutions) >= 4);
    const JointVector& found = solutions.q[arm->branch_of(far) & 3];
    CHECK(found[3] == 0.7);
    CHECK(test::angle_difference(found[5], -0.4) < 1e-12);
  }
}

TEST_CASE("six_r: shoulder singular: the first joint is held", "[kernels][kinematics]") {
  const auto arm = SixR::from(upright({.a1 = 50, .a2 = 20, .b = 0}));
  REQUIRE(arm);
  JointVector q = joints({1.1, 0.0, 0.0, 0.3, 0.8, -0.2});
  // Bring the wrist centre onto the first axis: 50 + Re of the arm = 0.
  const double reach = std::hypot(315.0 + 365.0, 20.0);
  q[1] = std::asin(-50.0 / reach) - std::atan2(20.0, 315.0 + 365.0);
  const Pose pose = forward(arm->chain(), q);
  const SixRSolutions solutions = arm->solve(pose, q);
  CHECK(solutions.shoulder_singular);
  REQUIRE(check_branches(*arm, pose, solutions) >= 4);
  int held = 0;
  for (int b = 0; b < 8; ++b) {
    if (!solutions.valid[b]) continue;
    CHECK(solutions.q[b][0] == 1.1);
    held += joint_difference(solutions.q[b], q) < 1e-6 ? 1 : 0;
  }
  CHECK(held >= 1);
}

TEST_CASE("six_r: elbow singular: stretched, folded, and folded onto the second axis",
          "[kernels][kinematics]") {
  const auto arm = SixR::from(upright({.a1 = 0, .a2 = 0, .b = 0, .c1 = 400, .c2 = 300, .c3 = 300}));
  REQUIRE(arm);
  for (const double elbow : {0.0, 1e-12, 1e-9, 1e-6, M_PI - 1e-3, M_PI - 1e-6, M_PI - 1e-9}) {
    CAPTURE(elbow);
    const JointVector q = joints({0.4, 0.7, elbow, 0.5, 0.9, -0.3});
    const Pose pose = forward(arm->chain(), q);
    REQUIRE(check_branches(*arm, pose, arm->solve(pose, q)) >= 2);
  }
  const JointVector folded = joints({0.4, 0.7, M_PI, 0.5, 0.9, -0.3});
  const Pose pose = forward(arm->chain(), folded);
  const SixRSolutions solutions = arm->solve(pose, folded);
  CHECK(solutions.elbow_singular);
  REQUIRE(check_branches(*arm, pose, solutions) >= 4);
  for (int b = 0; b < 8; ++b)
    if (solutions.valid[b]) CHECK(solutions.q[b][1] == 0.7);
}

TEST_CASE("six_r: out of reach is invalid and never NaN", "[kernels][kinematics]") {
  const auto arm = SixR::from(upright({.b = 60.0}));
  REQUIRE(arm);
  test::Random random(63);
  Pose far = random_pose(random, 1.0);
  far.translation() = Vec3(5000, 0, 0);
  for (const bool valid : arm->solve(far).valid) CHECK_FALSE(valid);
  // Inside the cylinder of radius b around the first axis there is nothing either.
  Pose inside = Pose::Identity();
  inside.translation() = Vec3(10, 0, 900 + 80);
  for (const bool valid : arm->solve(inside).valid) CHECK_FALSE(valid);
  int unreachable = 0;
  for (int n = 0; n < 20000; ++n) {
    const Pose pose = random_pose(random, 1600.0);
    const SixRSolutions solutions = arm->solve(pose);
    unreachable += check_branches(*arm, pose, solutions) == 0 ? 1 : 0;
  }
  CHECK(unreachable > 1000);
  CHECK(unreachable < 19000);
}

TEST_CASE("six_r: a sphere of wrist centres just beyond the stretched arm",
          "[kernels][kinematics]") {
  const auto arm =
      SixR::from(upright({.a1 = 0, .a2 = 0, .b = 0, .c1 = 0, .c2 = 300, .c3 = 400, .c4 = 0}));
  REQUIRE(arm);
  test::Random random(64);
  for (int n = 0; n < 1000; ++n) {
    Pose pose = random_pose(random, 1.0);
    const Vec3 direction = random.unit();
    pose.translation() = (700.0 + 5e-11) * direction;
    CHECK(check_branches(*arm, pose, arm->solve(pose)) == 8);
    pose.translation() = (700.0 + 1e-8) * direction;
    CHECK(check_branches(*arm, pose, arm->solve(pose)) == 0);
  }
}

TEST_CASE("six_r: recognises only its own kind", "[kernels][kinematics]") {
  const ScrewChain good = upright({});
  CHECK(SixR::from(good));
  ScrewChain chain = good;
  chain.joints[5].redundant = true;
  CHECK(SixR::from(chain));
  chain.joints.pop_back();
  CHECK_FALSE(SixR::from(chain));
  chain = good;
  chain.joints[2].kind = JointKind::linear;
  CHECK_FALSE(SixR::from(chain));
  chain = good;
  chain.joints[0].side = ChainSide::workpiece;
  CHECK_FALSE(SixR::from(chain));
  chain = good;
  chain.joints[1].direction = Vec3(0, 0.8, 0.6);  // not square to the first axis
  CHECK_FALSE(SixR::from(chain));
  chain = good;
  chain.joints[2].direction = Vec3(0.6, 0.8, 0);  // not parallel to the second
  CHECK_FALSE(SixR::from(chain));
  chain = good;
  chain.joints[4].origin.x() += 1e-6;  // wrist axes that miss each other
  CHECK_FALSE(SixR::from(chain));
  chain = good;
  chain.joints[2].origin = chain.joints[1].origin;  // no upper arm
  CHECK_FALSE(SixR::from(chain));
  CHECK_FALSE(SixR::from(test::laser()));
  CHECK_FALSE(SixR::from(test::table_table_ac()));
}

TEST_CASE("six_r: the reference robot of the shared golden file", "[kernels][kinematics][paper]") {
  const auto machines = test::reference_machines();
  if (machines.empty()) {
    WARN("no shared reference material: skipped");
    return;
  }
  const auto arm = SixR::from(machines.at("robot_6R").chain);
  REQUIRE(arm);
  test::Random random(65);
  for (int n = 0; n < 2000; ++n) {
    const JointVector q = random.joints(arm->chain());
    const Pose pose = forward(arm->chain(), q);
    const SixRSolutions solutions = arm->solve(pose, q);
    REQUIRE(check_branches(*arm, pose, solutions) >= 2);
    CHECK(joint_difference(solutions.q[arm->branch_of(q)], q) < 1e-6);
  }
}

TEST_CASE("six_r: joint vectors of another size are refused", "[kernels][kinematics]") {
  const auto arm = SixR::from(upright({}));
  REQUIRE(arm);
  CHECK_THROWS_AS(arm->solve(Pose::Identity(), JointVector::Zero(5)), ContractViolation);
  CHECK_THROWS_AS(arm->branch_of(JointVector::Zero(7)), ContractViolation);
}

}  // namespace smoothpost
