#include "kernels/optimise/spin.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/arms.h"
#include "tests/kernels/optimise/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

SixR arm() { return *SixR::from(kr60()); }

/// Upright tools (as at home, turned by `turn`) along a path in the part.
std::vector<SpinPoint> points_of(const std::function<Vec3(double)>& tip,
                                 const std::function<Mat3(double)>& rotation, double length,
                                 int count) {
  const Mat3 home = forward(kr60(), kr60_home()).linear();
  std::vector<SpinPoint> out;
  for (int i = 0; i < count; ++i) {
    const double u = static_cast<double>(i) / (count - 1);
    SpinPoint p;
    p.tool.translation() = tip(u);
    p.tool.linear() = rotation(u) * home;
    p.length = u * length;
    p.cut = i > 0;
    out.push_back(p);
  }
  return out;
}

std::vector<SpinPoint> line(int count = 40) {
  return points_of([](double u) { return Vec3(-150 + 300 * u, 80 * u, 100); },
                   [](double) { return Mat3(Mat3::Identity()); }, 310.0, count);
}

Pose turned(const SixR& robot, const SpinPoint& p, double angle) {
  Pose out = p.tool;
  out.linear() = p.tool.linear() * rotation_about(robot.chain().tool_axis, angle);
  return out;
}

/// The margin from its definition: every branch over the whole path, turns kept from point to
/// point and centred where a stretch starts.
double margin_of(const SixR& robot, const std::vector<SpinPoint>& points,
                 const SpinProfile& profile) {
  const ArmReach reach(robot);
  const auto& joints = robot.chain().joints;
  double best = -1e9;
  for (std::size_t b = 0; b < 8; ++b) {
    double least = 1e9;
    std::size_t lost = 0;
    JointVector last;
    bool have = false;
    for (const SpinPoint& p : points) {
      const auto solved = robot.solve(turned(robot, p, profile.at(p.length)));
      if (!solved.valid[b]) {
        ++lost;
        have = false;
        continue;
      }
      JointVector q = solved.q[b];
      for (int j = 0; j < 6; ++j) {
        const ChainJoint& joint = joints[static_cast<std::size_t>(j)];
        const double middle = 0.5 * (joint.lower + joint.upper);
        const double to = have && p.cut ? last[j] : middle;
        q[j] += 2.0 * M_PI * std::round((to - q[j]) / (2.0 * M_PI));
        least =
            std::min(least, 1.0 - std::abs(q[j] - middle) / (0.5 * (joint.upper - joint.lower)));
      }
      least = std::min(least, reach.singular(q));
      last = q;
      have = true;
    }
    if (lost > 0)  // so many shares below the rest
      least = std::min(0.0, least) - static_cast<double>(lost) / static_cast<double>(points.size());
    best = std::max(best, least);
  }
  return best;
}

}  // namespace

TEST_CASE("spin: the basis is a partition of unity and a constant stays one",
          "[kernels][optimise][spin]") {
  Dice dice(31);
  for (int round = 0; round < 50; ++round) {
    const double length = dice.between(0.5, 2000.0), value = dice.between(-7, 7);
    const auto count = static_cast<std::size_t>(6 + 14 * dice.between(0, 1));
    const SpinProfile one({value}, length);
    const SpinProfile many(std::vector<double>(count, value), length);
    for (int i = 0; i <= 40; ++i) {
      const double x = length * i / 40;
      CHECK(one.at(x) == value);
      CHECK(many.at(x) == Approx(value).margin(1e-12));
    }
    // Each basis function by itself: none negative, together 1.
    for (int i = 0; i <= 20; ++i) {
      const double x = length * i / 20;
      double sum = 0.0;
      for (std::size_t k = 0; k < count; ++k) {
        std::vector<double> unit(count, 0.0);
        unit[k] = 1.0;
        const double n = SpinProfile(unit, length).at(x);
        CHECK(n >= -1e-14);
        sum += n;
      }
      CHECK(sum == Approx(1.0).margin(1e-12));
    }
    // Held beyond its ends.
    CHECK(many.at(-1.0) == many.at(0.0));
    CHECK(many.at(length + 1.0) == many.at(length));
  }
}

TEST_CASE("spin: a profile has four continuous derivatives", "[kernels][optimise][spin]") {
  Dice dice(32);
  for (int round = 0; round < 20; ++round) {
    const std::size_t count = 6 + static_cast<std::size_t>(round % 7);
    std::vector<double> c;
    for (std::size_t k = 0; k < count; ++k) c.push_back(dice.between(-1, 1));
    const double spans = static_cast<double>(count) - 5.0;  // uniform quintic
    const SpinProfile profile(c, spans);                    // knots at the integers
    // The fifth difference of a C4 quintic is bounded by the step; a jump in the fourth derivative
    // would make fourth differences of neighbouring places differ whatever the step.
    const auto fourth = [&](double x, double h) {
      const auto f = [&](int k) { return profile.at(x + k * h); };
      return (f(-2) - 4.0 * f(-1) + 6.0 * f(0) - 4.0 * f(1) + f(2)) / (h * h * h * h);
    };
    for (int knot = 1; knot < static_cast<int>(spans); ++knot) {
      const double h = 0.02;
      const double before = fourth(knot - 3 * h, h), after = fourth(knot + 3 * h, h);
      // |fifth derivative| of a uniform quintic B-spline with |c| <= 1 is at most 32.
      CHECK(std::abs(after - before) <= 6 * h * 32.0 + 1e-3);
    }
  }
}

TEST_CASE("spin: the margin is that of its definition", "[kernels][optimise][spin]") {
  const SixR robot = arm();
  Dice dice(33);
  int reached = 0, lost = 0;
  for (int round = 0; round < 60; ++round) {
    const Vec3 centre(dice.between(-700, 500), dice.between(-900, 900), dice.between(-300, 700));
    const double lean = dice.between(0, 0.5);
    auto points = points_of(
        [&](double u) { return Vec3(centre + 150 * Vec3(std::cos(5 * u), std::sin(5 * u), u)); },
        [&](double u) { return rotation_about(Vec3::UnitX(), lean * u); }, 780.0, 20);
    if (round % 3 == 0) points[9].cut = false;
    std::vector<double> c = {dice.between(-3, 3)};
    if (round % 2 == 0)
      for (int k = 0; k < 6; ++k) c.push_back(c[0] + dice.between(-0.5, 0.5));
    const SpinProfile profile(c, 780.0);
    const double wanted = margin_of(robot, points, profile);
    const SpinMeasure got = measure_spin(robot, points, profile);
    INFO("round " << round);
    CHECK(got.margin == Approx(wanted).margin(1e-9));
    CHECK(got.jerk >= 0.0);
    ++(wanted > 0.0 ? reached : lost);
  }
  CHECK(reached > 5);
  CHECK(lost > 5);
}

TEST_CASE("spin: optimised is never worse and is deterministic", "[kernels][optimise][spin]") {
  const SixR robot = arm();
  Dice dice(34);
  for (int round = 0; round < 4; ++round) {
    const Vec3 shift(dice.between(-300, 300), dice.between(-500, 500), dice.between(-100, 300));
    auto points = line(25);
    for (SpinPoint& p : points) p.tool.translation() += shift;
    const double start = dice.between(-1, 1);
    const SpinResult a = optimise_spin(robot, points, start, 8, 150);
    const SpinResult b = optimise_spin(robot, points, start, 8, 150);
    CHECK(a.after.margin >= a.before.margin);
    CHECK(a.before.margin == measure_spin(robot, points, SpinProfile({start}, 310.0)).margin);
    CHECK(a.after.margin == Approx(measure_spin(robot, points, a.profile).margin).margin(1e-12));
    CHECK(a.evaluations <= 151);
    CHECK(a.profile.coefficients() == b.profile.coefficients());
  }
}

TEST_CASE("spin: a path that no constant can follow is followed", "[kernels][optimise][spin]") {
  // The tool's frame turns four times about the vertical: with a constant rotation about the tool
  // the wrist would have to make every turn.
  const SixR robot = arm();
  const double turns = 8.0 * M_PI;
  auto points =
      points_of([](double u) { return Vec3(-100 + 200 * u, 50 * u, 150); },
                [&](double u) { return rotation_about(Vec3::UnitZ(), turns * u); }, 400.0, 160);
  double best = -1e9;
  for (int k = 0; k < 48; ++k)
    best = std::max(best,
                    measure_spin(robot, points, SpinProfile({2.0 * M_PI * k / 48}, 400.0)).margin);
  CHECK(best < 0.0);
  const SpinResult found = optimise_spin(robot, points, 0.0, 10, 2500);
  INFO("best constant " << best << ", found " << found.after.margin);
  CHECK(found.after.margin > 0.0);
}

TEST_CASE("spin: near wanted angles", "[kernels][optimise][spin]") {
  std::vector<double> lengths, constant, ramp, slow;
  for (int i = 0; i <= 300; ++i) {
    const double x = 5.0 * i;
    lengths.push_back(x);
    constant.push_back(1.25);
    ramp.push_back(0.001 * x - 0.3);
    slow.push_back(0.3 * std::sin(2.0 * M_PI * x / 1500.0));
  }
  const SpinProfile c = spin_near(lengths, constant, 20), r = spin_near(lengths, ramp, 20),
                    s = spin_near(lengths, slow, 30);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    CHECK(c.at(lengths[i]) == Approx(1.25).margin(1e-9));
    const bool inside = lengths[i] > 250.0 && lengths[i] < 1250.0;
    CHECK(std::abs(r.at(lengths[i]) - ramp[i]) < (inside ? 0.02 : 0.25));
    CHECK(std::abs(s.at(lengths[i]) - slow[i]) < (inside ? 0.05 : 0.2));
  }
}

TEST_CASE("spin: preconditions", "[kernels][optimise][spin]") {
  for (const std::size_t count : {0UL, 2UL, 5UL})
    CHECK_THROWS_AS(SpinProfile(std::vector<double>(count, 0.0), 10.0), ContractViolation);
  CHECK_THROWS_AS(SpinProfile({0.0}, 0.0), ContractViolation);
  CHECK_THROWS_AS(SpinProfile({0.0}, -1.0), ContractViolation);
  CHECK_NOTHROW(SpinProfile({0.0}, 1.0));
  CHECK_NOTHROW(SpinProfile(std::vector<double>(6, 0.0), 1.0));
  const SixR robot = arm();
  CHECK_THROWS_AS(optimise_spin(robot, {}, 0.0), ContractViolation);
  CHECK_THROWS_AS(optimise_spin(robot, line(5), 0.0, 5), ContractViolation);
}

TEST_CASE("spin: derivatives of the profile are those of its values", "[kernels][optimise]") {
  std::vector<double> c;
  for (int i = 0; i < 12; ++i) c.push_back(std::sin(2.3 * i) + 0.1 * i);
  const SpinProfile profile(c, 350.0);
  const double h = 0.5;
  for (double x = 3.0; x < 347.0; x += 7.7) {
    const Jet jet = profile.jet(x), before = profile.jet(x - h), after = profile.jet(x + h);
    CHECK(jet[0] == profile.at(x));
    for (std::size_t r = 0; r < 3; ++r)  // the next derivative changes by its own at most
      CHECK(jet[r + 1] == Approx((after[r] - before[r]) / (2.0 * h)).epsilon(1e-3).margin(2e-7));
  }
  CHECK(profile.jet(-1.0)[1] == 0.0);
  CHECK(profile.jet(400.0)[1] == 0.0);
  CHECK(SpinProfile({0.4}, 10.0).jet(3.0) == Jet{0.4, 0.0, 0.0, 0.0});
}
