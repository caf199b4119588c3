#include "kernels/kinematics/head_geometry.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "kernels/kinematics/rotary_pair.h"
#include "tests/kernels/kinematics/reference_machines.h"

using namespace smoothpost;
using test::Random;

namespace {

/// laser_5p1_offset: L0 = 200 mm, the second rotary 30 mm beside the first.
ScrewChain offset_laser() {
  ScrewChain chain = test::laser(200.0);
  chain.joints[4].origin = Vec3(30.0, 0.0, 0.0);
  return chain;
}

/// Any directions, origins, tool and workpiece; nothing when the directions are too dependent.
std::optional<ScrewChain> random_head(Random& random) {
  ScrewChain chain = test::laser();
  for (ChainJoint& joint : chain.joints) {
    joint.direction = random.unit();
    joint.origin = 200.0 * random.unit();
  }
  chain.tool_home.translation() = 300.0 * random.unit();
  chain.tool_home.linear() = rotation_about(random.unit(), random.between(-3.0, 3.0));
  chain.tool_axis = random.unit();
  const double sign = random.below(2) == 0 ? 1.0 : -1.0;
  chain.joints[5].direction = sign * (chain.tool_home.linear() * chain.tool_axis);
  chain.workpiece_home.translation() = 500.0 * random.unit();
  chain.workpiece_home.linear() = rotation_about(random.unit(), random.between(-3.0, 3.0));
  Mat3 directions;
  for (int i = 0; i < 3; ++i) directions.col(i) = chain.joints[i].direction;
  if (std::abs(directions.determinant()) < 0.2) return std::nullopt;
  return chain;
}

std::vector<ScrewChain> heads() {
  Random random(71);
  std::vector<ScrewChain> chains = {test::laser(), test::laser(200.0), offset_laser()};
  while (chains.size() < 12)
    if (const auto chain = random_head(random)) chains.push_back(*chain);
  return chains;
}

/// A smooth function with its derivatives: offset + amplitude sin(rate u + phase).
struct Wave {
  double offset, amplitude, rate, phase;
  Jet at(double u) const {
    const double s = amplitude * std::sin(rate * u + phase);
    const double c = amplitude * std::cos(rate * u + phase);
    return {offset + s, rate * c, -rate * rate * s, -rate * rate * rate * c};
  }
};

Wave random_wave(Random& random, double size) {
  return {random.between(-size, size), random.between(0.2, 1.0) * size, random.between(0.5, 2.0),
          random.between(-3.0, 3.0)};
}

/// A tip and two rotaries that move.
struct Motion {
  std::array<Wave, 3> tip;
  Wave q4, q5;
  VectorJet tip_at(double u) const {
    VectorJet jet;
    for (int i = 0; i < 3; ++i) {
      const Jet component = tip[i].at(u);
      for (int r = 0; r < 4; ++r) jet(i, r) = component[r];
    }
    return jet;
  }
};

Motion random_motion(Random& random) {
  return {{random_wave(random, 400.0), random_wave(random, 400.0), random_wave(random, 400.0)},
          random_wave(random, 2.0),
          random_wave(random, 1.0)};
}

/// Largest difference of every column from the eighth-order central difference of the one before.
double derivative_error(const std::function<VectorJet(double)>& jet, double u) {
  constexpr double kWeights[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
  constexpr double kStep = 0.01;
  const VectorJet exact = jet(u);
  VectorJet difference = VectorJet::Zero();
  for (int k = 1; k <= 4; ++k)
    difference += kWeights[k - 1] / kStep * (jet(u + k * kStep) - jet(u - k * kStep));
  return (exact.rightCols<3>() - difference.leftCols<3>()).cwiseAbs().maxCoeff();
}

}  // namespace

TEST_CASE("head_geometry: linears equal those of the closed form for any standoff",
          "[kernels][kinematics][paper]") {
  Random random(72);
  double worst = 0.0;
  for (const ScrewChain& chain : heads()) {
    const auto head = HeadGeometry::from(chain);
    const auto pair = RotaryPair::from(chain);
    REQUIRE(head);
    REQUIRE(pair);
    for (int n = 0; n < 200; ++n) {
      const JointVector q = random.joints(chain);
      const VectorJet tip = 500.0 * random.unit() * Eigen::RowVector4d(1, 0, 0, 0);
      const auto expected = pair->with_linears(tip.col(0), q);
      REQUIRE(expected);
      const LinearsByStandoff linears =
          linears_by_standoff(*head, tip, {q[3], 0, 0, 0}, {q[4], 0, 0, 0});
      JointVector own = q;
      for (int i = 0; i < 3; ++i)
        own[head->linear[i]] = linears.a(i, 0) + linears.b(i, 0) * q[head->standoff];
      worst = std::max(worst, (own - *expected).cwiseAbs().maxCoeff());
      worst = std::max(worst, (forward_location(chain, own).tip - tip.col(0)).norm());
    }
  }
  CHECK(worst < 1e-9);
}

TEST_CASE("head_geometry: the tip of every pose gives its linears back",
          "[kernels][kinematics][paper]") {
  Random random(73);
  double worst = 0.0;
  for (const ScrewChain& chain : heads()) {
    const auto head = HeadGeometry::from(chain);
    REQUIRE(head);
    for (int n = 0; n < 200; ++n) {
      const JointVector q = random.joints(chain);
      const CutterLocation location = forward_location(chain, q);
      VectorJet tip = VectorJet::Zero();
      tip.col(0) = location.tip;
      const Jet q4{q[3], 0, 0, 0};
      const Jet q5{q[4], 0, 0, 0};
      const LinearsByStandoff linears = linears_by_standoff(*head, tip, q4, q5);
      const Vec3 back = linears.a.col(0) + linears.b.col(0) * q[5];
      worst = std::max(worst, (back - q.head<3>()).cwiseAbs().maxCoeff());
      worst = std::max(worst, (axis_jet(*head, q4, q5).col(0) - location.axis).norm() * 1e3);
    }
  }
  CHECK(worst < 5e-9);  // linears of 3000 mm in directions with a determinant of 0.2
}

TEST_CASE("head_geometry: derivatives equal central differences", "[kernels][kinematics][paper]") {
  Random random(74);
  double of_a = 0.0;
  double of_b = 0.0;
  double of_axis = 0.0;
  for (const ScrewChain& chain : heads()) {
    const auto head = HeadGeometry::from(chain);
    REQUIRE(head);
    for (int n = 0; n < 20; ++n) {
      const Motion motion = random_motion(random);
      const auto linears = [&](double u) {
        return linears_by_standoff(*head, motion.tip_at(u), motion.q4.at(u), motion.q5.at(u));
      };
      const double u = random.between(-2.0, 2.0);
      const auto a = [&](double v) { return linears(v).a; };
      const auto b = [&](double v) { return linears(v).b; };
      const auto axis = [&](double v) { return axis_jet(*head, motion.q4.at(v), motion.q5.at(v)); };
      const double size = 1.0 + a(u).cwiseAbs().maxCoeff();
      of_a = std::max(of_a, derivative_error(a, u) / size);
      of_b = std::max(of_b, derivative_error(b, u));
      of_axis = std::max(of_axis, derivative_error(axis, u));
    }
  }
  CHECK(of_a < 1e-8);
  CHECK(of_b < 1e-8);
  CHECK(of_axis < 1e-8);
}

TEST_CASE("head_geometry: golden kinematics of paper B", "[kernels][kinematics][paper]") {
  struct Case {
    double l0;  // m, as in the golden file
    std::array<double, 6> q;
    Vec3 tip, axis;
  };
  const std::vector<Case> cases = {
      {0.0,
       {0.1, 0.2, 0.3, 0.7, 0.9, -0.05},
       {0.07004392665408585, 0.17476834749643674, 0.26891950158646677},
       {0.5991214669182833, 0.5046330500712651, 0.6216099682706644}},
      {0.2,
       {0.1, 0.2, 0.3, 0.7, 0.9, -0.05},
       {-0.04978036672957081, 0.07384173748218373, 0.1445975079323339},
       {0.5991214669182833, 0.5046330500712651, 0.6216099682706644}},
      {0.0,
       {1, 1, 1, -2.5, 0.3, 0.01},
       {0.9976324587316816, 0.9982313938829335, 1.009553364891256},
       {-0.2367541268318426, -0.17686061170665623, 0.955336489125606}},
      {0.2,
       {1, 1, 1, -2.5, 0.3, 0.01},
       {1.0449832840980502, 1.0336035162242647, 0.8184860670661349},
       {-0.2367541268318426, -0.17686061170665623, 0.955336489125606}}};
  for (const Case& c : cases) {
    const auto head = HeadGeometry::from(test::laser(1000.0 * c.l0));
    REQUIRE(head);
    const Jet q4{c.q[3], 0, 0, 0};
    const Jet q5{c.q[4], 0, 0, 0};
    VectorJet tip = VectorJet::Zero();
    tip.col(0) = 1000.0 * c.tip;
    const LinearsByStandoff linears = linears_by_standoff(*head, tip, q4, q5);
    const Vec3 expected = 1000.0 * Vec3(c.q[0], c.q[1], c.q[2]);
    CHECK((linears.a.col(0) + 1000.0 * c.q[5] * linears.b.col(0) - expected).norm() < 1e-9);
    CHECK((axis_jet(*head, q4, q5).col(0) - c.axis).norm() < 1e-14);
    CHECK((linears.b.col(0) + c.axis).norm() < 1e-14);  // q123 = C + (L0 - q6) O
  }
}

TEST_CASE("head_geometry: golden derivatives of the tool axis", "[kernels][kinematics][paper]") {
  // q4 and q5 of qp_q6 in paper_b.json at u = 2.5, from its control points in rational arithmetic.
  const Jet q4{1.0138903404556467, 0.11594394466667045, -0.17244433217068922, -0.03570087141907449};
  const Jet q5{1.0559800841483933, -0.09783678319894125, -0.0228758705310523, 0.012402367919146605};
  Eigen::Matrix<double, 4, 3> expected;
  expected << 0.46005170214014834, 0.7388635675475043, 0.49237491803393774,  //
      -0.11112885670548395, 0.01244693984108907, 0.08515549385746798,        //
      0.12035391921588641, -0.11180415956399958, 0.015197743214247113,       //
      0.041164107395479654, 0.0390103313526729, -0.014915879576562926;
  const auto head = HeadGeometry::from(test::laser());
  REQUIRE(head);
  CHECK((axis_jet(*head, q4, q5) - expected.transpose()).cwiseAbs().maxCoeff() < 1e-14);
}

TEST_CASE("head_geometry: the pole is no singular place", "[kernels][kinematics]") {
  const auto head = HeadGeometry::from(offset_laser());
  REQUIRE(head);
  const VectorJet tip = VectorJet::Zero();
  const LinearsByStandoff linears =
      linears_by_standoff(*head, tip, {0.4, 1.0, 0.5, -1.0}, {0.0, 0.0, 0.0, 0.0});
  // upright: the standoff lifts along the axis of the first rotary, whatever that one does
  VectorJet down = VectorJet::Zero();
  down(2, 0) = -1.0;
  CHECK((linears.b - down).cwiseAbs().maxCoeff() < 1e-15);
  CHECK((linears.a.col(0) - Vec3(0.0, 0.0, 200.0)).norm() < 1e-12);
}

TEST_CASE("head_geometry: other chains are no such head", "[kernels][kinematics]") {
  REQUIRE(HeadGeometry::from(test::laser()));
  const auto refused = [](const std::function<void(ScrewChain&)>& change) {
    ScrewChain chain = test::laser(200.0);
    change(chain);
    return !HeadGeometry::from(chain);
  };
  CHECK_FALSE(HeadGeometry::from(test::table_table_ac()));
  CHECK_FALSE(HeadGeometry::from(test::table_table_b45c()));
  CHECK_FALSE(HeadGeometry::from(ScrewChain{}));
  CHECK(refused([](ScrewChain& c) { c.joints.pop_back(); }));
  CHECK(refused([](ScrewChain& c) { c.joints[5].redundant = false; }));
  CHECK(refused([](ScrewChain& c) { std::swap(c.joints[2].redundant, c.joints[5].redundant); }));
  CHECK(refused([](ScrewChain& c) { c.joints[5].kind = JointKind::rotary; }));
  CHECK(refused([](ScrewChain& c) { std::swap(c.joints[2], c.joints[3]); }));
  CHECK(refused([](ScrewChain& c) { c.joints[5].direction = Vec3::UnitX(); }));
  CHECK(refused([](ScrewChain& c) { c.joints[1].direction = Vec3::UnitX(); }));
  CHECK(refused([](ScrewChain& c) { c.joints[4].direction = Vec3::UnitZ(); }));
  CHECK(refused([](ScrewChain& c) { c.joints[0].side = ChainSide::workpiece; }));
  // a positioner under the part, free or held
  CHECK(refused([](ScrewChain& c) {
    c.joints.push_back(test::joint({'A', ChainSide::workpiece, -1, 1}));
    c.joints.back().redundant = true;
  }));
  CHECK(refused([](ScrewChain& c) {
    c.joints.push_back(test::joint({'C', ChainSide::workpiece, -1, 1}));
  }));
}
