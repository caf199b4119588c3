#include "kernels/optimise/arm_reach.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/arms.h"
#include "tests/kernels/optimise/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// An arm with every offset there is: shoulder to the back, wrist beside the arm's plane, forearm
/// shorter than the upper arm.
ScrewChain offset_arm() {
  ScrewChain chain = kr60();
  chain.joints[1].origin.x() = -200;
  for (int j : {3, 4, 5}) chain.joints[static_cast<std::size_t>(j)].origin += Vec3(-150, 70, 0);
  chain.tool_home.translation() += Vec3(-150, 70, 0);
  return chain;
}

bool solved(const SixR& arm, const Pose& tool, int side) {
  const auto s = arm.solve(tool);
  for (std::size_t b = static_cast<std::size_t>(side); b < 8; b += 2)
    if (s.valid[b]) return true;
  return false;
}

/// A point of the chain at 0, moved by its first `joints` joints.
Vec3 moved(const ScrewChain& chain, const JointVector& q, int joints, Vec3 point) {
  for (int j = joints - 1; j >= 0; --j) {
    const auto& joint = chain.joints[static_cast<std::size_t>(j)];
    point = joint.origin + rotation_about(joint.direction, q[j]) * (point - joint.origin);
  }
  return point;
}

Vec3 across(const Vec3& v, const Vec3& axis) { return v - v.dot(axis) * axis; }

}  // namespace

TEST_CASE("arm_reach: lack is 0 exactly where a side has a solution", "[kernels][optimise]") {
  Dice dice(7);
  for (const ScrewChain& chain : {kr60(), offset_arm()}) {
    const SixR arm = *SixR::from(chain);
    const ArmReach reach(arm);
    int inside = 0, outside = 0;
    for (int n = 0; n < 4000; ++n) {
      const Pose tool = dice.pose(2500);
      for (const int side : {0, 1}) {
        const double lack = reach.nearest(tool, side).lack;
        if (lack > 0.0 && lack < 1e-8) continue;
        CHECK((lack == 0.0) == solved(arm, tool, side));
        ++(lack == 0.0 ? inside : outside);
      }
    }
    CHECK(inside > 1000);
    CHECK(outside > 1000);
  }
}

TEST_CASE("arm_reach: the nearest pose has a solution and lies as far as the lack says",
          "[kernels][optimise]") {
  Dice dice(8);
  for (const ScrewChain& chain : {kr60(), offset_arm()}) {
    const SixR arm = *SixR::from(chain);
    const ArmReach reach(arm);
    int tested = 0, without = 0;
    for (int n = 0; n < 4000; ++n) {
      const Pose tool = dice.pose(4000);
      for (const int side : {0, 1}) {
        const auto nearest = reach.nearest(tool, side);
        if (nearest.lack == 0.0) continue;
        CHECK((nearest.tool.linear() - tool.linear()).norm() == 0.0);
        const double way = (nearest.tool.translation() - tool.translation()).norm();
        CHECK(way == Approx(nearest.lack * reach.length()).epsilon(1e-6).margin(1e-5));
        ++tested;
        if (!solved(arm, nearest.tool, side)) ++without;
      }
    }
    CHECK(tested > 4000);
    CHECK(without < tested / 20);  // those whose way crosses the first axis
  }
}

TEST_CASE("arm_reach: lack is continuous and grows on the way out", "[kernels][optimise]") {
  const SixR arm = *SixR::from(kr60());
  const ArmReach reach(arm);
  Pose tool = forward(kr60(), kr60_home());
  double before = reach.nearest(tool, 0).lack;
  CHECK(before == 0.0);
  for (int n = 0; n < 4000; ++n) {
    tool.translation().x() += 1.0;
    const double lack = reach.nearest(tool, 0).lack;
    CHECK(lack >= before);
    CHECK(lack - before <= 1.0 / reach.length() + 1e-12);
    before = lack;
  }
  CHECK(before > 1.0);
}

TEST_CASE("arm_reach: singular measures from their definition", "[kernels][optimise]") {
  Dice dice(9);
  for (const ScrewChain& chain : {kr60(), offset_arm()}) {
    const ArmReach reach(*SixR::from(chain));
    const auto& j = chain.joints;
    const Vec3 wrist = j[4].origin + Vec3(0, j[3].origin.y() - j[4].origin.y(), 0);
    double least = 1.0;
    for (int n = 0; n < 2000; ++n) {
      JointVector q(6);
      for (int i = 0; i < 6; ++i) q[i] = dice.between(-M_PI, M_PI);
      const double hand = std::abs(jacobian(chain, q).block<3, 3>(0, 3).determinant());
      const Vec3 e2 = rotation_about(j[0].direction, q[0]) * j[1].direction;
      const Vec3 w = moved(chain, q, 3, wrist), elbow = moved(chain, q, 2, j[2].origin);
      const Vec3 u = across(elbow - moved(chain, q, 1, j[1].origin), e2), v = across(w - elbow, e2);
      const double bend = u.cross(v).norm() / (u.norm() * v.norm());
      const Vec3 beside = across(across(w - j[0].origin, j[0].direction), e2);
      const double shoulder = beside.norm() / (u.norm() + v.norm());
      const double expected = std::min({hand, bend, shoulder, 1.0});
      CHECK(reach.singular(q) == Approx(expected).margin(1e-9));
      least = std::min(least, expected);
    }
    CHECK(least < 0.01);
  }
  CHECK_THROWS_AS(ArmReach(*SixR::from(kr60())).singular(JointVector::Zero(5)), ContractViolation);
}

TEST_CASE("arm_reach: the ball holds every place of the tip", "[kernels][optimise]") {
  Dice dice(10);
  for (const ScrewChain& chain : {kr60(), offset_arm()}) {
    const ArmReach reach(*SixR::from(chain));
    for (int n = 0; n < 5000; ++n) {
      JointVector q(6);
      for (int i = 0; i < 6; ++i) q[i] = dice.between(-M_PI, M_PI);
      CHECK((forward(chain, q).translation() - reach.centre()).norm() <= reach.radius() + 1e-9);
    }
  }
}
