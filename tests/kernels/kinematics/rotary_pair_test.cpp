#include "kernels/kinematics/rotary_pair.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/reference_machines.h"

namespace smoothpost {
namespace {

using test::angle_difference;
using test::Random;

struct RoundTrip {
  double tip = 0.0;
  double axis = 0.0;
  int poses = 0;
  int both = 0;
};

/// FK(IK(x)) = x over random poses within the limits: every pose must be solved and its own joint
/// values must be among the solutions.
RoundTrip round_trip(const ScrewChain& chain, std::uint64_t seed, int count) {
  const auto pair = RotaryPair::from(chain);
  REQUIRE(pair.has_value());
  Random random(seed);
  RoundTrip result;
  for (int n = 0; n < count; ++n) {
    const JointVector q = random.joints(chain);
    const CutterLocation x = forward_location(chain, q);
    const RotaryPairSolutions solutions = pair->solve(x, q);
    bool own = false;
    for (int b = 0; b < 2; ++b) {
      if (!solutions.valid[b]) continue;
      const CutterLocation back = forward_location(chain, solutions.q[b]);
      result.tip = std::max(result.tip, (back.tip - x.tip).norm());
      result.axis = std::max(result.axis, (back.axis - x.axis).norm());
      double off = 0.0;
      for (int j = 0; j < chain.size(); ++j) {
        const double d = solutions.q[b][j] - q[j];
        off = std::max(off, chain.joints[j].kind == JointKind::rotary
                                ? 1000.0 * angle_difference(solutions.q[b][j], q[j])
                                : std::abs(d));
      }
      own = own || off < 1e-3;
    }
    REQUIRE(own);
    result.both += solutions.valid[0] && solutions.valid[1] ? 1 : 0;
    ++result.poses;
  }
  return result;
}

/// Five-axis chains of every arrangement: directions, sides, order and held joints at random.
std::optional<ScrewChain> random_five_axis(Random& random, bool held_rotary) {
  ScrewChain chain;
  std::vector<JointKind> kinds{JointKind::linear, JointKind::linear, JointKind::linear,
                               JointKind::rotary, JointKind::rotary};
  std::vector<bool> held(5, false);
  kinds.push_back(held_rotary ? JointKind::rotary : JointKind::linear);
  held.push_back(true);
  for (std::size_t i = kinds.size(); i-- > 1;) {
    const auto k = static_cast<std::size_t>(random.below(static_cast<int>(i) + 1));
    std::swap(kinds[i], kinds[k]);
    const bool other = held[k];
    held[k] = held[i];
    held[i] = other;
  }
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    ChainJoint joint;
    joint.kind = kinds[i];
    joint.redundant = held[i];
    joint.side = random.below(2) == 0 ? ChainSide::tool : ChainSide::workpiece;
    joint.direction = random.unit();
    joint.origin = 200.0 * random.unit();
    const double range = joint.kind == JointKind::linear ? 500.0 : 3.0;
    joint.lower = -range;
    joint.upper = range;
    chain.joints.push_back(joint);
  }
  chain.workpiece_home.linear() = rotation_exp(2.0 * random.unit());
  chain.workpiece_home.translation() = 100.0 * random.unit();
  chain.tool_home.linear() = rotation_exp(1.0 * random.unit());
  chain.tool_home.translation() = 100.0 * random.unit();
  chain.tool_axis = random.unit();
  if (!RotaryPair::from(chain)) return std::nullopt;
  return chain;
}

/// |Determinant| of the free linears' directions in W: 1 when they are orthogonal.
double linear_determinant(const ScrewChain& chain, const JointVector& q) {
  const Jacobian columns = jacobian(chain, q);
  Mat3 directions;
  int count = 0;
  for (int j = 0; j < chain.size(); ++j)
    if (chain.joints[j].kind == JointKind::linear && !chain.joints[j].redundant)
      directions.col(count++) = columns.col(j).tail<3>();
  return std::abs(directions.determinant());
}

TEST_CASE("rotary_pair: FK(IK(x)) = x on 20,000 poses of every five-axis reference machine",
          "[kernels][kinematics]") {
  const auto machines = test::reference_machines();
  if (machines.empty()) {
    WARN("no shared reference files: skipped");
    return;
  }
  int tested = 0;
  for (const auto& [name, machine] : machines) {
    CAPTURE(name);
    if (name == "robot_6R") {
      CHECK_FALSE(RotaryPair::from(machine.chain).has_value());
      continue;
    }
    const RoundTrip result = round_trip(machine.chain, 21, 20000);
    CAPTURE(result.tip, result.axis, result.both);
    CHECK(result.tip <= 1e-9);
    CHECK(result.axis <= 1e-12);
    CHECK(result.poses == 20000);
    CHECK(result.both == 20000);
    ++tested;
  }
  CHECK(tested == 6);
}

TEST_CASE("rotary_pair: any order, side and direction, with a held linear or rotary joint",
          "[kernels][kinematics]") {
  Random random(22);
  int chains = 0;
  int mixed = 0;
  for (int n = 0; n < 400; ++n) {
    const auto chain = random_five_axis(random, n % 2 == 0);
    if (!chain) continue;
    // Skew linears amplify rounding; linears on both sides of a rotary may be dependent at some
    // poses.
    const auto pair = RotaryPair::from(*chain);
    ++chains;
    int solved = 0;
    for (int k = 0; k < 20; ++k) {
      const JointVector q = random.joints(*chain);
      const CutterLocation x = forward_location(*chain, q);
      const RotaryPairSolutions solutions = pair->solve(x, q);
      for (int b = 0; b < 2; ++b) {
        if (!solutions.valid[b]) continue;
        ++solved;
        double longest = 1.0;
        for (int j = 0; j < chain->size(); ++j)
          longest = std::max(longest, std::abs(solutions.q[b][j]));
        const CutterLocation back = forward_location(*chain, solutions.q[b]);
        const double skew = linear_determinant(*chain, solutions.q[b]);
        CAPTURE(n, k, b, longest, skew);
        REQUIRE((back.tip - x.tip).norm() <= 1e-12 * longest / skew);
        REQUIRE((back.axis - x.axis).norm() <= 1e-12);
      }
    }
    if (solved < 40) ++mixed;
    CHECK(solved >= 38);
  }
  CHECK(chains > 300);
  CHECK(mixed < 20);
}

TEST_CASE("rotary_pair: golden inverse of paper B, four solutions with turns",
          "[kernels][kinematics][paper]") {
  const auto golden = test::reference_json("paper_b.json");
  if (!golden) {
    WARN("no shared reference files: skipped");
    return;
  }
  for (const auto& entry : golden->at("kinematics").at("cases")) {
    const ScrewChain chain = test::laser(1000.0 * entry.at("L0").get<double>());
    const auto pair = RotaryPair::from(chain);
    REQUIRE(pair.has_value());
    CutterLocation x;
    x.tip = 1000.0 * test::vector_from(entry.at("C"));
    x.axis = test::vector_from(entry.at("O"));
    JointVector held = JointVector::Zero(6);
    held[5] = 1000.0 * entry.at("q").at(5).get<double>();
    const RotaryPairSolutions solutions = pair->solve(x, held);
    int found = 0;
    for (const auto& reference : entry.at("ik")) {
      const double q4 = reference.at(0);
      const double q5 = reference.at(1);
      const int b = q5 >= 0.0 ? 0 : 1;  // branch 0 is q5 >= 0
      REQUIRE(solutions.valid[b]);
      CHECK(std::abs(solutions.q[b][4] - q5) < 1e-14);
      CHECK(angle_difference(solutions.q[b][3], q4) < 1e-14);
      for (int j = 0; j < 3; ++j)
        CHECK(std::abs(solutions.q[b][j] - 1000.0 * entry.at("q").at(j).get<double>()) < 1e-9);
      ++found;
    }
    CHECK(found == 4);
  }
}

TEST_CASE("rotary_pair: relative accuracy of the tilt near the pole", "[kernels][kinematics]") {
  for (const ScrewChain& chain :
       {test::laser(), test::table_table_ac(), test::table_table_b45c()}) {
    const auto pair = RotaryPair::from(chain);
    REQUIRE(pair.has_value());
    const int first = pair->first_rotary();
    const int second = pair->second_rotary();
    for (const double tilt : {1e-9, 1e-8, 1e-6, 1e-3}) {
      for (double turn = -3.0; turn <= 3.0; turn += 0.37) {
        for (const double side : {1.0, -1.0}) {
          JointVector q = JointVector::Constant(chain.size(), 10.0);
          q[first] = turn;
          // A nutating axis at 45 degrees tilts the tool by 1/√2 of its own angle.
          const double angle = side * tilt * (chain.joints[second].direction.z() > 0.5 ? 1.5 : 1.0);
          q[second] = angle;
          const CutterLocation x = forward_location(chain, q);
          const RotaryPairSolutions solutions = pair->solve(x, q);
          CAPTURE(tilt, turn, side);
          REQUIRE_FALSE(solutions.at_pole);
          const int b = side > 0.0 ? 0 : 1;
          REQUIRE(solutions.valid[b]);
          CHECK(std::abs(solutions.q[b][second] - angle) <= 4e-15 * tilt);
          CHECK(std::abs(solutions.q[b][first] - turn) <= 4e-15);
          CHECK((forward_location(chain, solutions.q[b]).tip - x.tip).norm() <= 1e-12);
        }
      }
    }
  }
}

TEST_CASE("rotary_pair: laser tilt is atan2 of the components down to 1e-9",
          "[kernels][kinematics]") {
  const auto pair = RotaryPair::from(test::laser());
  REQUIRE(pair.has_value());
  for (const double tilt : {1e-9, 1e-8, 1e-6, 1e-4, 0.1, 1.5}) {
    for (const double phi : {0.0, 0.7, 2.0, -2.9}) {
      CutterLocation x;
      x.axis = Vec3(std::sin(tilt) * std::cos(phi), std::sin(tilt) * std::sin(phi), std::cos(tilt));
      const RotaryPairSolutions solutions = pair->solve(x, JointVector::Zero(6));
      REQUIRE(solutions.valid[0]);
      REQUIRE(solutions.valid[1]);
      CHECK(std::abs(solutions.q[0][4] - tilt) <= 2e-15 * tilt);
      CHECK(std::abs(solutions.q[1][4] + tilt) <= 2e-15 * tilt);
      CHECK(std::abs(solutions.q[0][3] - phi) <= 1e-15);
      CHECK(angle_difference(solutions.q[1][3], phi + M_PI) <= 2e-15);
    }
  }
}

TEST_CASE("rotary_pair: at the pole the first rotary is held", "[kernels][kinematics]") {
  for (const ScrewChain& chain :
       {test::laser(), test::table_table_ac(), test::table_table_b45c()}) {
    const auto pair = RotaryPair::from(chain);
    REQUIRE(pair.has_value());
    JointVector held = JointVector::Constant(chain.size(), 5.0);
    held[pair->first_rotary()] = 0.8;
    for (const double tilt : {0.0, 1e-12, 5e-10}) {
      CutterLocation x;
      x.tip = Vec3(30, -20, 10);
      x.axis = Vec3(std::sin(tilt), 0, std::cos(tilt));
      const RotaryPairSolutions solutions = pair->solve(x, held);
      CHECK(solutions.at_pole);
      for (int b = 0; b < 2; ++b) {
        REQUIRE(solutions.valid[b]);
        CHECK(std::abs(solutions.q[b][pair->first_rotary()] - 0.8) < 1e-15);
        CHECK(solutions.q[b][pair->second_rotary()] == 0.0);
        const CutterLocation back = forward_location(chain, solutions.q[b]);
        CHECK((back.tip - x.tip).norm() < 1e-12);
        CHECK((back.axis - x.axis).norm() <= 1e-9);
      }
    }
    const auto pole = pair->nearest_pole(Vec3(std::sin(0.3), 0, std::cos(0.3)), held);
    REQUIRE(pole.has_value());
    CHECK((pole->axis - Vec3::UnitZ()).norm() < 1e-15);
    CHECK(std::abs(pole->angle - 0.3) < 1e-15);
    CHECK(pole->second == 0.0);
  }
}

TEST_CASE("rotary_pair: the far pole of an orthogonal pair", "[kernels][kinematics]") {
  const auto pair = RotaryPair::from(test::laser());
  REQUIRE(pair.has_value());
  const JointVector held = JointVector::Zero(6);
  for (const double tilt : {0.0, 1e-7, 1e-3}) {
    CutterLocation x;
    x.axis = Vec3(0, std::sin(tilt), -std::cos(tilt));
    const RotaryPairSolutions solutions = pair->solve(x, held);
    CHECK(solutions.at_pole == (tilt == 0.0));
    for (int b = 0; b < 2; ++b) {
      REQUIRE(solutions.valid[b]);
      CHECK((forward_location(pair->chain(), solutions.q[b]).axis - x.axis).norm() < 1e-15);
    }
    CHECK(std::abs(pair->nearest_pole(x.axis, held)->angle - tilt) < 1e-15);
    CHECK(std::abs(pair->nearest_pole(x.axis, held)->second - M_PI) < 1e-15);
  }
}

TEST_CASE("rotary_pair: boundary of reach of a nutating table", "[kernels][kinematics]") {
  const ScrewChain chain = test::table_table_b45c();
  const auto pair = RotaryPair::from(chain);
  REQUIRE(pair.has_value());
  const JointVector held = JointVector::Zero(5);
  // The tool axis in W goes from upright (B = 0) to level (B = 180 degrees) and no further.
  for (const double below : {1e-3, 1e-6, 1e-9, 1e-13, 0.0, -5e-13}) {
    CutterLocation x;
    x.axis =
        Vec3(std::cos(below) * std::cos(0.4), std::cos(below) * std::sin(0.4), std::sin(below));
    const RotaryPairSolutions solutions = pair->solve(x, held);
    CAPTURE(below);
    for (int b = 0; b < 2; ++b) {
      REQUIRE(solutions.valid[b]);
      CHECK((forward_location(chain, solutions.q[b]).axis - x.axis).norm() < 1e-12);
    }
  }
  for (const double beyond : {1e-11, 1e-6, 0.1}) {
    CutterLocation x;
    x.axis = Vec3(std::cos(beyond), 0.0, -std::sin(beyond));
    const RotaryPairSolutions solutions = pair->solve(x, held);
    CHECK_FALSE(solutions.valid[0]);
    CHECK_FALSE(solutions.valid[1]);
  }
}

TEST_CASE("rotary_pair: the branch index is stable along a path", "[kernels][kinematics]") {
  for (const ScrewChain& chain :
       {test::laser(), test::table_table_ac(), test::table_table_b45c()}) {
    const auto pair = RotaryPair::from(chain);
    REQUIRE(pair.has_value());
    std::array<double, 2> last{};
    for (int s = 0; s <= 1000; ++s) {
      const double phi = 0.02 * s;
      const double tilt = 0.7 + 0.5 * std::sin(0.013 * s);
      CutterLocation x;
      x.axis = Vec3(std::sin(tilt) * std::cos(phi), std::sin(tilt) * std::sin(phi), std::cos(tilt));
      const RotaryPairSolutions solutions = pair->solve(x, JointVector::Zero(chain.size()));
      for (int b = 0; b < 2; ++b) {
        REQUIRE(solutions.valid[b]);
        const double second = solutions.q[b][pair->second_rotary()];
        CHECK((b == 0 ? second > 0.0 : second < 0.0));
        if (s > 0) CHECK(std::abs(second - last[b]) < 0.05);
        last[b] = second;
      }
    }
  }
}

TEST_CASE("rotary_pair: first rotary is the one next to the workpiece", "[kernels][kinematics]") {
  CHECK(RotaryPair::from(test::laser())->first_rotary() == 3);
  CHECK(RotaryPair::from(test::laser())->second_rotary() == 4);
  // C stands on A: in the flattened chain C comes first.
  CHECK(RotaryPair::from(test::table_table_ac())->first_rotary() == 4);
  CHECK(RotaryPair::from(test::table_table_ac())->second_rotary() == 3);
}

TEST_CASE("rotary_pair: with_linears reaches the tip at any rotary values",
          "[kernels][kinematics]") {
  Random random(23);
  for (const ScrewChain& chain :
       {test::laser(150.0), test::table_table_ac(), test::table_table_b45c()}) {
    const auto pair = RotaryPair::from(chain);
    for (int n = 0; n < 1000; ++n) {
      const JointVector q = random.joints(chain);
      const Vec3 tip = 300.0 * random.unit();
      const auto solved = pair->with_linears(tip, q);
      REQUIRE(solved.has_value());
      CHECK((forward_location(chain, *solved).tip - tip).norm() < 1e-10);
      for (int j = 0; j < chain.size(); ++j)
        if (chain.joints[j].kind == JointKind::rotary || chain.joints[j].redundant)
          CHECK((*solved)[j] == q[j]);
    }
  }
}

TEST_CASE("rotary_pair: chains of another kind are not taken", "[kernels][kinematics]") {
  ScrewChain chain = test::table_table_ac();
  chain.joints.pop_back();
  CHECK_FALSE(RotaryPair::from(chain).has_value());  // one rotary
  chain = test::laser();
  chain.joints.back().redundant = false;
  CHECK_FALSE(RotaryPair::from(chain).has_value());  // four free linears
  chain = test::table_table_ac();
  chain.joints[1].direction = chain.joints[0].direction;
  CHECK_FALSE(RotaryPair::from(chain).has_value());  // dependent linears
  chain = test::table_table_ac();
  chain.joints[3].direction = Vec3::UnitZ();
  CHECK_FALSE(RotaryPair::from(chain).has_value());  // parallel rotaries
  chain = test::table_table_ac();
  chain.tool_axis = Vec3::UnitX();
  CHECK_FALSE(RotaryPair::from(chain).has_value());  // tool along the second rotary
}

TEST_CASE("rotary_pair: preconditions", "[kernels][kinematics]") {
  const auto pair = RotaryPair::from(test::table_table_ac());
  CutterLocation x;
  CHECK_THROWS_AS(pair->solve(x, JointVector::Zero(4)), ContractViolation);
  CHECK_THROWS_AS(pair->with_linears(x.tip, JointVector::Zero(4)), ContractViolation);
  CHECK_THROWS_AS(pair->nearest_pole(x.axis, JointVector::Zero(4)), ContractViolation);
  x.axis = Vec3(0, 0, 1.01);
  CHECK_THROWS_AS(pair->solve(x, JointVector::Zero(5)), ContractViolation);
}

}  // namespace
}  // namespace smoothpost
