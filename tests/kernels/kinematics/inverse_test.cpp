#include "kernels/kinematics/inverse.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/arms.h"
#include "tests/kernels/kinematics/reference_machines.h"

using namespace smoothpost;

namespace {

std::vector<ScrewChain> chains() {
  return {test::laser(), test::laser(200.0), test::table_table_ac(), test::table_table_b45c(),
          test::kr60()};
}

double largest_turn(const ScrewChain& chain, const JointVector& from, const JointVector& to) {
  double worst = 0.0;
  for (int j = 0; j < chain.size(); ++j)
    if (chain.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary)
      worst = std::max(worst, std::abs(to[j] - from[j]));
  return worst;
}

}  // namespace

TEST_CASE("inverse: which closed form a chain has", "[kernels][kinematics]") {
  for (const auto& chain : chains()) {
    const auto inverse = Inverse::from(chain);
    REQUIRE(inverse);
    const bool arm = chain.joints.front().kind == JointKind::rotary;
    CHECK(inverse->takes_rotation() == arm);
    CHECK((inverse->six_r() != nullptr) == arm);
    CHECK((inverse->rotary_pair() != nullptr) == !arm);
    CHECK(inverse->chain().size() == chain.size());
  }
  ScrewChain three = test::laser();
  three.joints.resize(3);
  CHECK_FALSE(Inverse::from(three));
  CHECK_FALSE(Inverse::from(ScrewChain{}));
}

TEST_CASE("inverse: every branch brings the tool to the pose", "[kernels][kinematics]") {
  for (const auto& chain : chains()) {
    const auto inverse = Inverse::from(chain);
    test::Random random(3);
    for (int n = 0; n < 500; ++n) {
      const JointVector near = random.joints(chain);
      const Pose tool = forward(chain, near);
      const InverseSolutions solved = inverse->solve(tool, near);
      CHECK(solved.count == (inverse->takes_rotation() ? 8 : 2));
      bool own = false;
      for (int b = 0; b < 8; ++b) {
        if (!solved.valid[static_cast<std::size_t>(b)]) continue;
        REQUIRE(b < solved.count);
        const JointVector& q = solved.q[static_cast<std::size_t>(b)];
        const Pose back = forward(chain, q);
        REQUIRE((back.translation() - tool.translation()).norm() < 1e-8);
        REQUIRE((back.linear() * chain.tool_axis - tool.linear() * chain.tool_axis).norm() < 1e-11);
        if (inverse->takes_rotation()) REQUIRE((back.linear() - tool.linear()).norm() < 1e-11);
        double away = 0.0;
        for (int j = 0; j < chain.size(); ++j) {
          const bool rotary = chain.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary;
          if (rotary) CHECK(std::abs(q[j]) <= M_PI + 1e-15);
          away = std::max(away, rotary ? test::angle_difference(q[j], near[j])
                                       : std::abs(q[j] - near[j]) * 1e-3);
        }
        own = own || away < 1e-6;
      }
      CHECK(own);
    }
  }
}

TEST_CASE("inverse: the nearest solution has the smallest largest rotary step",
          "[kernels][kinematics]") {
  for (const auto& chain : chains()) {
    const auto inverse = Inverse::from(chain);
    test::Random random(5);
    for (int n = 0; n < 1000; ++n) {
      const Pose tool = forward(chain, random.joints(chain));
      JointVector near = random.joints(chain);
      for (int j = 0; j < chain.size(); ++j)  // several turns away
        if (chain.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary)
          near[j] += 2.0 * M_PI * (random.below(5) - 2);
      const auto got = inverse->nearest(tool, near);
      REQUIRE(got);
      const Pose back = forward(chain, *got);
      CHECK((back.translation() - tool.translation()).norm() < 1e-8);
      const InverseSolutions solved = inverse->solve(tool, near);
      double least = INFINITY;
      for (int b = 0; b < solved.count; ++b) {
        if (!solved.valid[static_cast<std::size_t>(b)]) continue;
        JointVector q = solved.q[static_cast<std::size_t>(b)];
        for (int j = 0; j < chain.size(); ++j) {
          if (chain.joints[static_cast<std::size_t>(j)].kind != JointKind::rotary) continue;
          for (int turn = -4; turn <= 4; ++turn) {
            const double value = solved.q[static_cast<std::size_t>(b)][j] + 2.0 * M_PI * turn;
            if (std::abs(value - near[j]) < std::abs(q[j] - near[j])) q[j] = value;
          }
        }
        least = std::min(least, largest_turn(chain, near, q));
      }
      CHECK(largest_turn(chain, near, *got) == Approx(least).margin(1e-9));
    }
  }
}

TEST_CASE("inverse: following a path by nearest solutions never turns back",
          "[kernels][kinematics]") {
  const ScrewChain chain = test::laser();
  const auto inverse = Inverse::from(chain);
  JointVector q(6);
  q << 800, 700, 1000, 0, 0.4, 0;
  for (int k = 1; k <= 400; ++k) {  // C winds three turns and more: limits are not applied
    JointVector wanted = q;
    wanted[3] = 0.05 * k;
    const auto next = inverse->nearest(forward(chain, wanted), q);
    REQUIRE(next);
    CHECK((*next - wanted).norm() < 1e-7);
    q = *next;
  }
}

TEST_CASE("inverse: held joints and out of reach", "[kernels][kinematics]") {
  const ScrewChain laser = test::laser();
  const auto inverse = Inverse::from(laser);
  JointVector near(6);
  near << 800, 700, 1000, 0.3, 0.4, -7.5;
  const auto got = inverse->nearest(forward(laser, near), near);
  REQUIRE(got);
  CHECK((*got)[5] == -7.5);  // the held standoff
  JointVector pole = near;
  pole[4] = 0.0;  // the free C takes the value of near
  const auto at_pole = inverse->nearest(forward(laser, pole), near);
  REQUIRE(at_pole);
  CHECK((*at_pole)[3] == Approx(0.3));

  const ScrewChain arm = test::kr60();
  const auto robot = Inverse::from(arm);
  Pose far = forward(arm, test::kr60_home());
  far.translation() += Vec3(9000, 0, 0);
  CHECK_FALSE(robot->nearest(far, test::kr60_home()));
  const auto none = robot->solve(far, test::kr60_home());
  for (const bool valid : none.valid) CHECK_FALSE(valid);
  CHECK_THROWS_AS(robot->nearest(far, near.head(5)), ContractViolation);
  CHECK_THROWS_AS(robot->solve(far, near.head(5)), ContractViolation);
  CHECK_THROWS_AS(inverse->nearest(far, near.head(5)), ContractViolation);
}
