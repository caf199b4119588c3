#include "kernels/schedule/constant_feed.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"

using namespace smoothpost;

namespace {

constexpr double kPi = 3.14159265358979323846;

JointVector two(double a, double b) {
  JointVector v(2);
  v << a, b;
  return v;
}

FeedLimits limits(double velocity, double acceleration, double jerk) {
  FeedLimits l;
  l.velocity = two(velocity, velocity);
  l.acceleration = two(acceleration, acceleration);
  l.jerk = two(jerk, jerk);
  return l;
}

/// A circle of radius r in X and Y by a parameter that runs `scale` times as fast as its arc
/// length, a quarter a piece.
FeedPath circle(double r, double scale, double feed) {
  FeedPath path;
  for (int k = 0; k <= 4; ++k) path.breaks.push_back(0.5 * kPi * r * k / scale);
  path.feed.assign(4, feed);
  path.jet = [r, scale](std::size_t, double s) {
    const double angle = s * scale / r, w = scale / r;
    PathJet jet;
    jet.first = r * w * two(-std::sin(angle), std::cos(angle));
    jet.second = r * w * w * two(-std::cos(angle), -std::sin(angle));
    jet.third = r * w * w * w * two(std::sin(angle), -std::cos(angle));
    jet.tip_first = scale;
    return jet;
  };
  return path;
}

}  // namespace

TEST_CASE("constant_feed: a circle against its closed form", "[kernels][schedule]") {
  // |q_l| ≤ 1, |q_ll| ≤ 1/r, |q_lll| ≤ 1/r², each reached at a quarter: V, sqrt(A r), cbrt(J r²).
  const double r = 20.0;
  for (const double scale : {1.0, 2.5}) {
    const FeedPath path = circle(r, scale, 100.0);
    CHECK(largest_constant_feed(path, limits(50.0, 1e9, 1e12), 5).feed == Approx(50.0));
    const ConstantFeed a = largest_constant_feed(path, limits(1e9, 2000.0, 1e12), 5);
    CHECK(a.feed == Approx(std::sqrt(2000.0 * r)));
    CHECK(a.blocking.kind == FeedOverload::Kind::acceleration);
    const ConstantFeed j = largest_constant_feed(path, limits(1e9, 1e9, 3e4), 5);
    CHECK(j.feed == Approx(std::cbrt(3e4 * r * r)));
    CHECK(j.blocking.kind == FeedOverload::Kind::jerk);
  }
}

TEST_CASE("constant_feed: a tip whose speed over the parameter changes", "[kernels][schedule]") {
  // The same line by a cubic parameter: by arc length it has neither curvature nor jerk.
  FeedPath path;
  path.breaks = {1.0, 2.0};
  path.feed = {100.0};
  path.jet = [](std::size_t, double s) {
    PathJet jet;
    jet.first = s * s * two(3.0, 0.0);
    jet.second = s * two(6.0, 0.0);
    jet.third = two(6.0, 0.0);
    jet.tip_first = 3.0 * s * s;
    jet.tip_second = 6.0 * s;
    jet.tip_third = 6.0;
    return jet;
  };
  CHECK(largest_constant_feed(path, limits(70.0, 1.0, 1.0), 9).feed == Approx(70.0));
}

TEST_CASE("constant_feed: overloads name joint and factor at the programmed feed",
          "[kernels][schedule]") {
  const double r = 20.0;
  FeedPath path = circle(r, 1.0, 100.0);
  path.feed[2] = 250.0;
  path.feed[3] = std::numeric_limits<double>::infinity();
  const auto found = overloads(path, limits(1e9, 2000.0, 1e12), 5);
  REQUIRE(found.size() == 4);
  // 100²/20 = 500 of 2000; 250²/20 = 3125 of 2000.
  CHECK(found[0].kind == FeedOverload::Kind::none);
  CHECK(found[2].kind == FeedOverload::Kind::acceleration);
  CHECK(found[2].factor == Approx(3125.0 / 2000.0));
  CHECK(found[2].piece == 2);
  CHECK((found[2].joint == 0 || found[2].joint == 1));
  CHECK(found[3].kind == FeedOverload::Kind::none);
}

TEST_CASE("constant_feed: what does not move the tip has no say", "[kernels][schedule]") {
  FeedPath path;
  path.breaks = {0.0, 1.0};
  path.feed = {100.0};
  path.jet = [](std::size_t, double) {
    PathJet jet;
    jet.first = two(1.0, 0.0);
    jet.second = jet.third = two(0.0, 0.0);
    return jet;
  };
  CHECK(std::isinf(largest_constant_feed(path, limits(1.0, 1.0, 1.0), 3).feed));
  CHECK(overloads(path, limits(1e-3, 1.0, 1.0), 3)[0].kind == FeedOverload::Kind::none);
  CHECK_THROWS_AS(largest_constant_feed(path, limits(1.0, 1.0, 1.0), 1), ContractViolation);
}
