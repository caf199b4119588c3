#include "kernels/kinematics/joint_jet.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "kernels/core/contract.h"
#include "kernels/kinematics/rotary_pair.h"
#include "tests/kernels/kinematics/arms.h"
#include "tests/kernels/kinematics/reference_machines.h"

using namespace smoothpost;
using test::Random;

namespace {

/// Joints that swing about the middle of their range, with exact derivatives.
struct Swing {
  JointVector middle, size, rate, phase;

  Swing(Random& random, const ScrewChain& chain) {
    const int n = chain.size();
    for (JointVector* v : {&middle, &size, &rate, &phase}) v->resize(n);
    for (int j = 0; j < n; ++j) {
      const ChainJoint& joint = chain.joints[static_cast<std::size_t>(j)];
      const double half = std::min(0.5 * (joint.upper - joint.lower),
                                   joint.kind == JointKind::rotary ? 1.0 : 300.0);
      middle[j] = joint.kind == JointKind::rotary ? random.between(-0.5, 0.5) + 0.7 : 100.0;
      size[j] = random.between(0.1, 0.3) * half;
      rate[j] = random.between(0.3, 1.0);
      phase[j] = random.between(-3.0, 3.0);
    }
  }

  JointJet at(double u) const {
    JointJet q(middle.size(), 4);
    for (Eigen::Index j = 0; j < middle.size(); ++j) {
      const double s = size[j] * std::sin(rate[j] * u + phase[j]);
      const double c = size[j] * std::cos(rate[j] * u + phase[j]);
      q.row(j) << middle[j] + s, rate[j] * c, -rate[j] * rate[j] * s,
          -rate[j] * rate[j] * rate[j] * c;
    }
    return q;
  }
};

using Function = std::function<Eigen::VectorXd(double)>;

/// Eighth-order central difference.
Function derivative(const Function& f) {
  return [f](double u) -> Eigen::VectorXd {
    constexpr double kWeights[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    constexpr double kStep = 0.05;
    Eigen::VectorXd sum = kWeights[0] / kStep * (f(u + kStep) - f(u - kStep));
    for (int k = 2; k <= 4; ++k)
      sum += kWeights[k - 1] / kStep * (f(u + k * kStep) - f(u - k * kStep));
    return sum;
  };
}

/// Tip, then the columns of the rotation, of the joints `joints(u)`.
Function pose_of(const ScrewChain& chain, const std::function<JointJet(double)>& joints) {
  return [&chain, joints](double u) -> Eigen::VectorXd {
    const Pose pose = forward(chain, joints(u).col(0));
    Eigen::VectorXd v(12);
    v << pose.translation(), pose.linear().col(0), pose.linear().col(1), pose.linear().col(2);
    return v;
  };
}

std::array<Eigen::VectorXd, 4> numeric_jet(const Function& f, double u) {
  const Function first = derivative(f), second = derivative(first);
  return {f(u), first(u), second(u), derivative(second)(u)};
}

double worst_of(const JointJet& a, const JointJet& b) { return (a - b).cwiseAbs().maxCoeff(); }

std::vector<ScrewChain> five_axis_chains() {
  return {test::laser(), test::laser(200.0), test::table_table_ac(), test::table_table_b45c()};
}

FreeJoints free_of(const ScrewChain& chain) {
  FreeJoints free{};
  for (std::size_t j = 0; j < chain.joints.size(); ++j) free[j] = !chain.joints[j].redundant;
  return free;
}

}  // namespace

TEST_CASE("joint_jet: forward derivatives are those of forward_location", "[kernels][kinematics]") {
  Random random(501);
  for (const ScrewChain& chain : five_axis_chains()) {
    for (int n = 0; n < 5; ++n) {
      const Swing swing(random, chain);
      const double u = random.between(-2.0, 2.0);
      const LocationJet jet = forward_jet(chain, swing.at(u));
      const auto expected = numeric_jet(
          [&](double x) -> Eigen::VectorXd {
            const CutterLocation at = forward_location(chain, swing.at(x).col(0));
            Eigen::VectorXd v(6);
            v << at.tip, at.axis;
            return v;
          },
          u);
      for (int r = 0; r < 4; ++r) {
        const Eigen::VectorXd& e = expected[static_cast<std::size_t>(r)];
        CHECK((jet.tip.col(r) - e.head<3>()).norm() < 1e-6 * (1.0 + e.head<3>().norm()));
        CHECK((jet.axis.col(r) - e.tail<3>()).norm() < 1e-7);
      }
    }
  }
}

TEST_CASE("joint_jet: the joints that made a tool path are found again", "[kernels][kinematics]") {
  Random random(502);
  for (const ScrewChain& chain : five_axis_chains()) {
    const FreeJoints free = free_of(chain);
    for (int n = 0; n < 200; ++n) {
      const JointJet q = Swing(random, chain).at(random.between(-2.0, 2.0));
      JointJet known = q;  // redundant joints keep what they do
      for (int j = 0; j < chain.size(); ++j)
        if (free[static_cast<std::size_t>(j)]) known.row(j).tail<3>().setConstant(1e3);
      const auto found = joint_jet(chain, known, free, forward_jet(chain, q));
      REQUIRE(found);
      CHECK(worst_of(*found, q) < 1e-9);
    }
  }
}

TEST_CASE("joint_jet: an arm follows position and rotation", "[kernels][kinematics]") {
  Random random(503);
  const ScrewChain chain = test::kr60();
  FreeJoints free{};
  free.fill(true);
  for (int n = 0; n < 20; ++n) {
    const Swing swing(random, chain);
    const double u = random.between(-2.0, 2.0);
    const auto pose = numeric_jet(pose_of(chain, [&](double x) { return swing.at(x); }), u);
    PoseJet target;
    for (std::size_t r = 0; r < 4; ++r) {
      target.tip.col(static_cast<Eigen::Index>(r)) = pose[r].head<3>();
      target.rotation[r] << pose[r].segment<3>(3), pose[r].segment<3>(6), pose[r].segment<3>(9);
    }
    JointJet known = swing.at(u);
    known.rightCols<3>().setZero();
    const auto found = joint_jet(chain, known, free, target);
    REQUIRE(found);
    CHECK(worst_of(*found, swing.at(u)) < 1e-5);
  }
}

TEST_CASE("joint_jet: at the pole the first rotary has no derivative of its own",
          "[kernels][kinematics]") {
  const ScrewChain chain = test::table_table_ac();
  const int turntable = 4;  // C lies along the tool axis when A is 0
  JointJet q = JointJet::Zero(5, 4);
  q(0, 1) = 2.0;
  q(turntable, 1) = 0.3;
  FreeJoints free = free_of(chain);
  const LocationJet target = forward_jet(chain, q);
  CHECK_FALSE(joint_jet(chain, q, free, target));
  free[turntable] = false;
  const auto found = joint_jet(chain, q, free, target);
  REQUIRE(found);
  CHECK(worst_of(*found, q) < 1e-9);
  CHECK_THROWS_AS(joint_jet(chain, JointJet::Zero(4, 4), free, target), ContractViolation);
}

TEST_CASE("jet: quotient and product undo each other", "[kernels][kinematics]") {
  const Jet f{2.0, -0.3, 0.7, 1.9};
  const Jet one = product(f, reciprocal(f));
  CHECK(one[0] == Approx(1.0));
  for (std::size_t r = 1; r < 4; ++r) CHECK(std::abs(one[r]) < 1e-15);
}
