#include "kernels/kinematics/screw_chain.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/reference_machines.h"

namespace smoothpost {
namespace {

using test::Random;
using test::random_chain;

double tolerance(double reference) { return 1e-9 * std::max(1.0, std::abs(reference)); }

void check_pose(const Pose& pose, const nlohmann::json& reference) {
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) {
      const double expected = reference.at(r).at(c);
      CHECK(std::abs(pose.matrix()(r, c) - expected) <= tolerance(expected));
    }
}

/// exp of a screw from its series: the definition, independent of Rodrigues.
Eigen::Matrix4d screw_exponential(const ChainJoint& joint, double value) {
  Eigen::Matrix4d twist = Eigen::Matrix4d::Zero();
  if (joint.kind == JointKind::linear) {
    twist.topRightCorner<3, 1>() = joint.direction;
  } else {
    twist.topLeftCorner<3, 3>() = cross_matrix(joint.direction);
    twist.topRightCorner<3, 1>() = -joint.direction.cross(joint.origin);
  }
  Eigen::Matrix4d term = Eigen::Matrix4d::Identity();
  Eigen::Matrix4d sum = term;
  for (int n = 1; n < 60; ++n) {
    term = (term * twist * (value / n)).eval();
    sum += term;
  }
  return sum;
}

TEST_CASE("screw_chain: golden poses and Jacobians of the reference machines",
          "[kernels][kinematics][paper]") {
  const auto machines = test::reference_machines();
  const auto golden = test::reference_json("paper_c.json");
  if (machines.empty() || !golden) {
    WARN("no shared reference files: skipped");
    return;
  }
  int poses = 0;
  for (const auto& [name, entry] : golden->at("machines").items()) {
    CAPTURE(name);
    const test::ReferenceMachine& machine = machines.at(name);
    std::vector<int> order;
    for (std::string joint : entry.at("joint_order")) {
      if (joint[0] == '-') joint.erase(0, 1);
      const auto at = std::find(machine.names.begin(), machine.names.end(), joint);
      REQUIRE(at != machine.names.end());
      order.push_back(static_cast<int>(at - machine.names.begin()));
    }
    for (const auto& fk : entry.at("fk")) {
      JointVector q(machine.chain.size());
      for (std::size_t k = 0; k < order.size(); ++k) q[order[k]] = fk.at("q").at(k);
      check_pose(forward(machine.chain, q), fk.at("T"));
      const CutterLocation location = forward_location(machine.chain, q);
      const Jacobian columns = jacobian(machine.chain, q);
      for (int i = 0; i < 3; ++i) {
        const double p = fk.at("p").at(i);
        const double a = fk.at("a").at(i);
        CHECK(std::abs(location.tip[i] - p) <= tolerance(p));
        CHECK(std::abs(location.axis[i] - a) <= tolerance(a));
      }
      for (int row = 0; row < 6; ++row)
        for (std::size_t k = 0; k < order.size(); ++k) {
          const double expected = fk.at("Jg").at(row).at(k);
          CHECK(std::abs(columns(row, order[k]) - expected) <= tolerance(expected));
        }
      ++poses;
    }
  }
  CHECK(poses == 14);
}

TEST_CASE("screw_chain: golden chains of paper C, both readings of the home pose",
          "[kernels][kinematics][paper]") {
  const auto golden = test::reference_json("paper_c.json");
  if (!golden) {
    WARN("no shared reference files: skipped");
    return;
  }
  for (const char* reading : {"fsbs_A", "fsbs_B"}) {
    CAPTURE(reading);
    const auto& entry = golden->at(reading);
    ScrewChain chain;
    for (const auto& screw : entry.at("S")) {
      std::array<double, 6> s{};
      for (int i = 0; i < 6; ++i) s[i] = screw.at(i);
      const Vec3 w(s[0], s[1], s[2]);
      const Vec3 v(s[3], s[4], s[5]);
      ChainJoint joint;
      joint.kind = w.norm() > 0.5 ? JointKind::rotary : JointKind::linear;
      joint.direction = w.norm() > 0.5 ? w : v;
      joint.origin = w.cross(v);
      chain.joints.push_back(joint);
    }
    chain.tool_home = test::pose_from(entry.at("M"));
    for (const auto& fk : entry.at("fk")) {
      JointVector q(6);
      for (int i = 0; i < 6; ++i) q[i] = fk.at("q").at(i);
      check_pose(forward(chain, q), fk.at("T"));
      const Jacobian columns = jacobian(chain, q);
      for (int row = 0; row < 6; ++row)
        for (int i = 0; i < 6; ++i) {
          const double expected = fk.at("Jg").at(row).at(i);
          CHECK(std::abs(columns(row, i) - expected) <= tolerance(expected));
        }
    }
  }
}

TEST_CASE("screw_chain: golden laser locations of paper B, tip = q123 - (L0 - q6) axis",
          "[kernels][kinematics][paper]") {
  const auto golden = test::reference_json("paper_b.json");
  if (!golden) {
    WARN("no shared reference files: skipped");
    return;
  }
  for (const auto& entry : golden->at("kinematics").at("cases")) {
    const double metre = 1000.0;
    const ScrewChain chain = test::laser(metre * entry.at("L0").get<double>());
    JointVector q(6);
    for (int i = 0; i < 6; ++i)
      q[i] = entry.at("q").at(i).get<double>() *
             (chain.joints[i].kind == JointKind::linear ? metre : 1.0);
    const CutterLocation location = forward_location(chain, q);
    for (int i = 0; i < 3; ++i) {
      CHECK(std::abs(location.tip[i] - metre * entry.at("C").at(i).get<double>()) <= 1e-9);
      CHECK(std::abs(location.axis[i] - entry.at("O").at(i).get<double>()) <= 1e-14);
    }
  }
}

TEST_CASE("screw_chain: forward is the product of screw exponentials", "[kernels][kinematics]") {
  Random random(11);
  double worst = 0.0;
  for (int n = 0; n < 300; ++n) {
    const ScrewChain chain = random_chain(random, 1 + random.below(8));
    const JointVector q = random.joints(chain);
    Eigen::Matrix4d workpiece = Eigen::Matrix4d::Identity();
    Eigen::Matrix4d tool = Eigen::Matrix4d::Identity();
    for (int i = 0; i < chain.size(); ++i) {
      auto& side = chain.joints[i].side == ChainSide::tool ? tool : workpiece;
      side = (side * screw_exponential(chain.joints[i], q[i])).eval();
    }
    const Eigen::Matrix4d expected =
        (workpiece * chain.workpiece_home.matrix()).inverse() * tool * chain.tool_home.matrix();
    const Pose pose = forward(chain, q);
    worst = std::max(worst, (pose.matrix() - expected).cwiseAbs().maxCoeff());
    CHECK((pose.linear() * pose.linear().transpose() - Mat3::Identity()).norm() < 1e-13);
    const CutterLocation location = forward_location(chain, q);
    CHECK((location.tip - pose.translation()).norm() < 1e-10);
    CHECK((location.axis - pose.linear() * chain.tool_axis).norm() < 1e-13);
  }
  CHECK(worst < 1e-9);
}

TEST_CASE("screw_chain: home pose at zero", "[kernels][kinematics]") {
  Random random(12);
  for (int n = 0; n < 20; ++n) {
    const ScrewChain chain = random_chain(random, 6);
    const Pose expected = chain.workpiece_home.inverse() * chain.tool_home;
    CHECK((forward(chain, JointVector::Zero(6)).matrix() - expected.matrix()).norm() < 1e-12);
  }
}

TEST_CASE("screw_chain: Jacobian equals central differences", "[kernels][kinematics]") {
  Random random(13);
  double worst = 0.0;
  for (int n = 0; n < 200; ++n) {
    const ScrewChain chain = random_chain(random, 1 + random.below(8));
    const JointVector q = random.joints(chain);
    const Jacobian columns = jacobian(chain, q);
    for (int i = 0; i < chain.size(); ++i) {
      const double h = chain.joints[i].kind == JointKind::linear ? 1e-2 : 1e-5;
      JointVector above = q;
      JointVector below = q;
      above[i] += h;
      below[i] -= h;
      const Pose a = forward(chain, above);
      const Pose b = forward(chain, below);
      const Vec3 angular = rotation_log(a.linear() * b.linear().transpose()) / (2.0 * h);
      const Vec3 linear = (a.translation() - b.translation()) / (2.0 * h);
      worst = std::max(worst, (columns.col(i).head<3>() - angular).norm());
      worst = std::max(worst, (columns.col(i).tail<3>() - linear).norm() / 1000.0);
    }
  }
  CHECK(worst < 1e-9);
}

TEST_CASE("screw_chain: preconditions", "[kernels][kinematics]") {
  const ScrewChain chain = test::laser();
  const JointVector q = JointVector::Zero(5);
  CHECK_THROWS_AS(forward(chain, q), ContractViolation);
  CHECK_THROWS_AS(forward_location(chain, q), ContractViolation);
  CHECK_THROWS_AS(jacobian(chain, q), ContractViolation);
  CHECK_THROWS_AS(second_derivative_bound(chain, q, q), ContractViolation);
}

/// Largest second difference of tip and axis on the motion: a lower estimate of the true maximum.
SecondDerivativeBound dense(const ScrewChain& chain, const JointVector& from,
                            const JointVector& to) {
  constexpr int kSamples = 200;
  const double h = 1.0 / kSamples;
  SecondDerivativeBound out;
  std::vector<CutterLocation> at;
  for (int s = 0; s <= kSamples; ++s)
    at.push_back(forward_location(chain, from + (s * h) * (to - from)));
  for (int s = 1; s < kSamples; ++s) {
    const Vec3 tip = at[s - 1].tip - 2.0 * at[s].tip + at[s + 1].tip;
    const Vec3 axis = at[s - 1].axis - 2.0 * at[s].axis + at[s + 1].axis;
    out.tip = std::max(out.tip, tip.norm() / (h * h));
    out.axis = std::max(out.axis, axis.norm() / (h * h));
  }
  return out;
}

TEST_CASE("second_derivative_bound: never below dense second differences",
          "[kernels][kinematics]") {
  Random random(14);
  // Rounding of the second differences: 4 times 1e-16 of 3000 mm, times 200².
  const double noise_tip = 1e-7;
  const double noise_axis = 1e-10;
  int tested = 0;
  for (int n = 0; n < 3000; ++n) {
    const ScrewChain chain = random_chain(random, 1 + random.below(8));
    const double size = std::pow(10.0, random.between(-4.0, 0.0));
    const JointVector from = random.joints(chain);
    const JointVector to = from + size * (random.joints(chain) - from);
    const SecondDerivativeBound bound = second_derivative_bound(chain, from, to);
    const SecondDerivativeBound seen = dense(chain, from, to);
    CAPTURE(n, size, bound.tip, seen.tip, bound.axis, seen.axis);
    REQUIRE(seen.tip <= bound.tip + noise_tip);
    REQUIRE(seen.axis <= bound.axis + noise_axis);
    ++tested;
  }
  CHECK(tested == 3000);
}

TEST_CASE("second_derivative_bound: close to the true maximum on typical motions",
          "[kernels][kinematics]") {
  for (const ScrewChain& chain :
       {test::laser(200.0), test::table_table_ac(), test::table_table_b45c()}) {
    // Shares of the axes' ranges: a block of a few degrees, a coarse one, a wild one.
    struct Case {
      double size;
      double median;
      double worst;
    };
    for (const Case& c : {Case{0.002, 1.1, 1.5}, Case{0.02, 2.0, 10.0}, Case{0.2, 5.0, 30.0}}) {
      Random random(15);
      std::vector<double> tip;
      std::vector<double> axis;
      for (int n = 0; n < 501; ++n) {
        const JointVector from = random.joints(chain);
        const JointVector to = from + c.size * (random.joints(chain) - from);
        const SecondDerivativeBound bound = second_derivative_bound(chain, from, to);
        const SecondDerivativeBound seen = dense(chain, from, to);
        // Below this, second differences are rounding.
        tip.push_back(bound.tip / std::max(seen.tip, 1e-4));
        axis.push_back(bound.axis / std::max(seen.axis, 1e-8));
      }
      std::sort(tip.begin(), tip.end());
      std::sort(axis.begin(), axis.end());
      CAPTURE(c.size, tip[250], tip.back(), axis[250], axis.back());
      CHECK(tip[250] < c.median);
      CHECK(axis[250] < c.median);
      CHECK(tip.back() < c.worst);
      CHECK(axis.back() < c.worst);
    }
  }
}

TEST_CASE("second_derivative_bound: circle of one rotary in closed form", "[kernels][kinematics]") {
  // A tip on a circle of radius 100 mm: |tip''| = 100 · Δq² all along.
  ScrewChain chain;
  chain.joints = {test::joint({'C', ChainSide::tool, -3, 3})};
  chain.tool_home.translation() = Vec3(100, 0, 7);
  chain.tool_axis = Vec3::UnitX();
  JointVector from(1);
  JointVector to(1);
  from << 0.3;
  to << 1.5;
  const SecondDerivativeBound bound = second_derivative_bound(chain, from, to);
  CHECK(bound.tip == Approx(144.0).epsilon(1e-9));
  CHECK(bound.axis == Approx(1.44).epsilon(1e-9));
  CHECK(second_derivative_bound(chain, from, from).tip == 0.0);
}

}  // namespace
}  // namespace smoothpost
