#include <catch2/catch.hpp>

#include "kernels/core/contract.h"
#include "kernels/schedule/feed_profile.h"
#include "tests/kernels/schedule/feed_paths.h"

namespace smoothpost {
namespace {

using test::from_rest_to_rest;
using test::joints;
using test::kNone;
using Kind = FeedWitness::Kind;

/// Two joints: the first runs as s, the second as given; no tip.
FeedPath two_joints(std::function<std::array<double, 3>(std::size_t, double)> second) {
  FeedPath path;
  path.breaks = {0.0, 40.0, 100.0};
  path.feed = {kNone, kNone};
  path.jet = [second](std::size_t piece, double s) {
    const auto d = second(piece, s);
    return PathJet{joints({1.0, d[0]}), joints({0.0, d[1]}), joints({0.0, d[2]})};
  };
  return path;
}

FeedLimits limits() { return {joints({100, 2}), joints({1000, 20}), joints({1e4, 200})}; }

}  // namespace

TEST_CASE("schedule_feed: refuses a joint that moves without a limit above 0",
          "[kernels][schedule]") {
  const FeedPath path = two_joints([](std::size_t piece, double) {
    return std::array<double, 3>{piece == 0 ? 0.0 : 1e-3, 0.0, 0.0};
  });
  for (int which = 0; which < 3; ++which) {
    FeedLimits locked = limits();
    (which == 0 ? locked.velocity : which == 1 ? locked.acceleration : locked.jerk)[1] = 0.0;
    FeedSettings settings;
    settings.smooth_share = 1.0;  // the jump is not what is tested
    const FeedResult result = from_rest_to_rest(path, locked, settings);
    CHECK(result.status == FeedStatus::no_limit);
    CHECK(result.witness.joint == 1);
    CHECK(result.witness.piece == 1);
    CHECK(result.witness.s == 40.0);
    CHECK(result.witness.value == 1e-3);
    CHECK(result.witness.limit == 0.0);
    CHECK(result.profile.duration() == 0.0);
  }
}

TEST_CASE("schedule_feed: a locked joint may rest", "[kernels][schedule]") {
  const FeedPath path = two_joints([](std::size_t, double) {
    return std::array<double, 3>{0.0, 0.0, 0.0};
  });
  FeedLimits locked = limits();
  locked.velocity[1] = locked.acceleration[1] = locked.jerk[1] = 0.0;
  const FeedResult result = from_rest_to_rest(path, locked);
  CHECK(result.status == FeedStatus::solved);
  const double best = test::seven_phases(100.0, {100.0, 1000.0, 1e4});
  CHECK(result.profile.duration() >= best);
  CHECK(result.profile.duration() <= 1.007 * best);
}

TEST_CASE("schedule_feed: refuses a feed that is not above 0", "[kernels][schedule]") {
  FeedPath path = test::line(10.0, 0.0);
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = 1e3;
  const FeedResult result = from_rest_to_rest(path, limits);
  CHECK(result.status == FeedStatus::no_limit);
  CHECK(result.witness.kind == Kind::feed);
  CHECK(result.witness.limit == 0.0);
}

TEST_CASE("schedule_feed: refuses what nothing limits", "[kernels][schedule]") {
  CHECK(from_rest_to_rest(test::line(10.0, kNone), test::no_limits(1)).status ==
        FeedStatus::no_limit);
}

TEST_CASE("schedule_feed: refuses derivatives that are not finite", "[kernels][schedule]") {
  for (int order = 0; order < 3; ++order)
    for (const double bad : {std::nan(""), kNone}) {
      const FeedPath path = two_joints([&](std::size_t piece, double) {
        std::array<double, 3> d{1e-3, 0.0, 0.0};
        if (piece == 1) d[order] = bad;
        return d;
      });
      const FeedResult result = from_rest_to_rest(path, limits());
      CHECK(result.status == FeedStatus::not_finite);
      CHECK(result.witness.joint == 1);
      CHECK(result.witness.piece == 1);
      CHECK_FALSE(std::isfinite(result.witness.value));
    }
}

TEST_CASE("schedule_feed: refuses jumps by their share of the limit", "[kernels][schedule]") {
  // At 100 mm/s, the speed that the first joint allows: 2 rad/s is 0.02 rad/mm, 20 rad/s² is
  // 0.002 rad/mm².
  struct Jump {
    double first, second;
    bool smooth;
  };
  for (const Jump& jump : {Jump{2.2e-6, 0, false}, Jump{1.8e-6, 0, true}, Jump{0, 2.2e-7, false},
                           Jump{0, 1.8e-7, true}}) {
    const FeedPath path = two_joints([&](std::size_t piece, double s) {
      const double on = piece == 1 ? 1.0 : 0.0;
      return std::array<double, 3>{on * (jump.first + jump.second * (s - 40.0)), on * jump.second,
                                   0.0};
    });
    const FeedResult result = from_rest_to_rest(path, limits());
    CHECK(result.status == (jump.smooth ? FeedStatus::solved : FeedStatus::not_smooth));
    if (jump.smooth) continue;
    CHECK(result.witness.joint == 1);
    CHECK(result.witness.s == 40.0);
    CHECK(result.witness.kind == (jump.first > 0.0 ? Kind::velocity : Kind::acceleration));
    CHECK(result.witness.value == Approx(jump.first + jump.second));
    CHECK(result.witness.limit == Approx((jump.first + jump.second) / 1.1));
  }
}

TEST_CASE("schedule_feed: refuses a parameter that runs while nothing moves",
          "[kernels][schedule]") {
  FeedPath path = test::line(100.0, 50.0);
  path.breaks = {0.0, 40.0, 60.0, 100.0};
  path.feed = {50.0, 50.0, 50.0};
  const auto moving = path.jet;
  path.jet = [moving](std::size_t piece, double s) {
    PathJet jet = moving(piece, s);
    if (piece == 1) jet.first[0] = jet.tip_first = 0.0;
    return jet;
  };
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = 1e3;
  limits.tip_jerk = 1e4;
  const FeedResult result = from_rest_to_rest(path, limits);
  CHECK(result.status == FeedStatus::not_regular);
  CHECK(result.witness.piece == 1);
  CHECK(result.witness.s == 40.0);
}

TEST_CASE("schedule_feed: nothing moves at all", "[kernels][schedule]") {
  const FeedPath path = two_joints([](std::size_t, double) {
    return std::array<double, 3>{0.0, 0.0, 0.0};
  });
  FeedPath still = path;
  still.jet = [](std::size_t, double) {
    return PathJet{joints({0, 0}), joints({0, 0}), joints({0, 0})};
  };
  const FeedResult result = from_rest_to_rest(still, limits());
  CHECK(result.status == FeedStatus::empty);
  CHECK(result.profile.duration() == 0.0);
}

TEST_CASE("schedule_feed: preconditions", "[kernels][schedule]") {
  const FeedPath good = test::line(10.0, 5.0);
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = 1e3;
  FeedPath path = good;
  path.breaks = {0.0};
  CHECK_THROWS_AS(from_rest_to_rest(path, limits), ContractViolation);
  path = good;
  path.breaks = {10.0, 0.0};
  CHECK_THROWS_AS(from_rest_to_rest(path, limits), ContractViolation);
  path = good;
  path.rate = {1.0, 2.0};
  CHECK_THROWS_AS(from_rest_to_rest(path, limits), ContractViolation);
  path = good;
  path.jet = nullptr;
  CHECK_THROWS_AS(from_rest_to_rest(path, limits), ContractViolation);
  CHECK_THROWS_AS(from_rest_to_rest(good, test::no_limits(2)), ContractViolation);
}

}  // namespace smoothpost
