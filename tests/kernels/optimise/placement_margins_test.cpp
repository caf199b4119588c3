#include "kernels/optimise/placement_margins.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/arms.h"
#include "tests/kernels/optimise/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

PlacementMeasure arm_measure(std::vector<PlacementPoint> points, int spin_count) {
  PlacementTask task;
  task.points = std::move(points);
  task.spins = spins(spin_count);
  task.held = kr60_home();
  return PlacementMeasure(*Inverse::from(kr60()), task);
}

/// Share of the range left by the values of one stretch, by trying every number of turns.
double room(const ChainJoint& joint, std::vector<double> values) {
  const double middle = 0.5 * (joint.lower + joint.upper);
  for (std::size_t i = 1; i < values.size(); ++i)
    while (std::abs(values[i] - values[i - 1]) > M_PI + 1e-12)
      values[i] += values[i] < values[i - 1] ? 2.0 * M_PI : -2.0 * M_PI;
  double best = -1e9;
  for (int k = -6; k <= 6; ++k) {
    double least = 1e9;
    for (const double v : values)
      least = std::min(
          least, 1.0 - std::abs(v + 2.0 * M_PI * k - middle) / (0.5 * (joint.upper - joint.lower)));
    best = std::max(best, least);
  }
  return best;
}

/// The definition, one branch and spin at a time, without leaving any out.
double best_score(const PlacementMeasure& measure, const Pose& placement) {
  const SixR& arm = *measure.inverse().six_r();
  const ArmReach reach(arm);
  const ScrewChain& chain = arm.chain();
  const auto& points = measure.task().points;
  const Mat3 home = placement.linear().transpose() * forward(chain, measure.task().held).linear();
  double best = -1e9;
  for (const double spin : measure.task().spins)
    for (std::size_t b = 0; b < 8; ++b) {
      std::array<double, 6> joints;
      joints.fill(1.0);
      double singular = 1.0, lack = -1.0;
      std::array<std::vector<double>, 6> stretch;
      const auto close = [&] {
        for (std::size_t j = 0; j < 6; ++j) {
          if (!stretch[j].empty())
            joints[j] = std::min(joints[j], room(chain.joints[j], stretch[j]));
          stretch[j].clear();
        }
      };
      for (const auto& p : points) {
        Pose pose = Pose::Identity();
        pose.translation() = p.tip;
        const auto turn = [](const Vec3& x, const Vec3& y) {
          return Eigen::Quaterniond::FromTwoVectors(x, y).toRotationMatrix();
        };
        pose.linear() = turn(Vec3::UnitZ(), p.axis) * rotation_about(Vec3::UnitZ(), spin) *
                        turn(home * chain.tool_axis, Vec3::UnitZ()) * home;
        Pose tool = placement * pose;
        const auto nearest = reach.nearest(tool, static_cast<int>(b & 1U));
        if (nearest.lack > 0.0) lack = std::max(lack, nearest.lack);
        const auto solved = arm.solve(nearest.tool, measure.task().held);
        if (!p.joined || !solved.valid[b]) close();
        if (!solved.valid[b]) continue;
        singular = std::min(singular, reach.singular(solved.q[b]));
        for (std::size_t j = 0; j < 6; ++j) stretch[j].push_back(solved.q[b][static_cast<int>(j)]);
      }
      close();
      double least = std::min(singular, -lack), sum = std::max(-1.0, singular);
      for (const double j : joints) {
        least = std::min(least, j);
        sum += std::max(-1.0, j);
      }
      best = std::max(best, least + 0.001 * sum / 7.0);
    }
  return best;
}

}  // namespace

TEST_CASE("placement_margins: of an arm as the definition has them branch by branch",
          "[kernels][optimise]") {
  const PlacementMeasure measure = arm_measure(contour({300, 200, 60}, 0.3, 25), 6);
  Dice dice(21);
  int reached = 0, beyond = 0;
  for (int n = 0; n < 60; ++n) {
    Pose placement = Pose::Identity();
    placement.linear() = rotation_about(Vec3::UnitZ(), dice.between(-M_PI, M_PI));
    placement.translation() =
        900 * Vec3(dice.between(-1, 1), dice.between(-1, 1), dice.between(-1, 1));
    const PlacementMargins got = measure.at(placement);
    CHECK(PlacementMeasure::score(got) == Approx(best_score(measure, placement)).margin(1e-9));
    ++(got.least() >= 0.0 ? reached : beyond);
  }
  CHECK(reached > 5);
  CHECK(beyond > 5);
}

TEST_CASE("placement_margins: continuous at the border of reach and sloping beyond",
          "[kernels][optimise]") {
  const PlacementMeasure measure = arm_measure(contour({200, 200, 0}, 0.1, 17), 12);
  Pose placement = Pose::Identity();
  const auto reach = [&](double x) {
    placement.translation().x() = x;
    return measure.at(placement);
  };
  double inside = 0.0, outside = 3000.0;
  REQUIRE(reach(inside).reach.value == 1.0);
  REQUIRE(reach(outside).reach.value < 0.0);
  while (outside - inside > 1e-7) {
    const double middle = 0.5 * (inside + outside);
    (reach(middle).reach.value < 0.0 ? outside : inside) = middle;
  }
  CHECK(std::abs(PlacementMeasure::score(reach(inside)) - PlacementMeasure::score(reach(outside))) <
        2e-3);
  double before = PlacementMeasure::score(reach(outside + 50.0));
  for (double x = outside + 100.0; x < outside + 3000.0; x += 50.0) {
    const double now = PlacementMeasure::score(reach(x));
    CHECK(now < before);
    before = now;
  }
}

TEST_CASE("placement_margins: turns of one stretch are counted as a whole", "[kernels][optimise]") {
  // The tool leans to the inside of a helix: the table turns three times.
  const auto helix = [](bool joined) {
    PlacementTask task;
    for (int i = 0; i <= 90; ++i) {
      const double u = 6.0 * M_PI * i / 90;
      PlacementPoint p;
      p.tip = Vec3(50 * std::cos(u), 50 * std::sin(u), 0);
      p.axis = Vec3(-std::sin(0.3) * std::cos(u), -std::sin(0.3) * std::sin(u), std::cos(0.3));
      p.joined = joined && i > 0;
      task.points.push_back(p);
    }
    task.held = JointVector::Zero(5);
    return task;
  };
  const ScrewChain chain = table(Vec3::Constant(-400), Vec3::Constant(400));
  const auto whole = PlacementMeasure(*Inverse::from(chain), helix(true)).at(Pose::Identity());
  const auto single = PlacementMeasure(*Inverse::from(chain), helix(false)).at(Pose::Identity());
  // Half of three turns, when the stretch is as near to the middle as whole turns let it be.
  CHECK(whole.joints[4].value <= 1.0 - 3.0 * M_PI / 10.0 + 1e-9);
  CHECK(whole.joints[4].value >= 1.0 - 4.0 * M_PI / 10.0 - 1e-9);
  CHECK(single.joints[4].value == Approx(1.0 - M_PI / 10.0).margin(0.02));
  CHECK(whole.reach.value == 1.0);
  // One value of A all the way: 0.3 rad to one side.
  CHECK(std::min(std::abs(whole.joints[3].value - (1.0 - std::abs(0.3 + 0.7) / 1.3)),
                 std::abs(whole.joints[3].value - (1.0 - std::abs(-0.3 + 0.7) / 1.3))) < 1e-9);
}

TEST_CASE("placement_margins: a tool axis that a rotary pair cannot have is a lack",
          "[kernels][optimise]") {
  ScrewChain chain = table(Vec3::Constant(-400), Vec3::Constant(400));
  chain.joints[3].direction = Vec3(0, 1, 1).normalized();  // nutating: 90 deg from Z at most
  PlacementTask task;
  task.points.resize(1);
  task.held = JointVector::Zero(5);
  for (const double over : {0.1, 0.4, 0.9}) {
    const double tilt = M_PI_2 + over;
    task.points[0].axis = Vec3(std::sin(tilt), 0, std::cos(tilt));
    const auto margins = PlacementMeasure(*Inverse::from(chain), task).at(Pose::Identity());
    CHECK(margins.reach.value == Approx(-over / M_PI).margin(1e-12));
    CHECK(margins.least() == margins.reach.value);
  }
}

TEST_CASE("placement_margins: preconditions", "[kernels][optimise]") {
  const Inverse inverse = *Inverse::from(kr60());
  PlacementTask task;
  task.held = kr60_home();
  CHECK_THROWS_AS(PlacementMeasure(inverse, task), ContractViolation);
  task.points.resize(1);
  task.spins.clear();
  CHECK_THROWS_AS(PlacementMeasure(inverse, task), ContractViolation);
  task.spins = {0.0};
  task.held.resize(5);
  CHECK_THROWS_AS(PlacementMeasure(inverse, task), ContractViolation);
}
