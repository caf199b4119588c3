#include <catch2/catch.hpp>

#include "kernels/schedule/feed_profile.h"
#include "tests/kernels/schedule/feed_paths.h"

namespace smoothpost {
namespace {

using test::from_rest_to_rest;

FeedSettings in_windows() {
  FeedSettings settings;
  settings.window_points = 500;
  return settings;
}

/// Windows that were tried and did not become part of the law.
struct WindowRun {
  FeedResult result;
  int failed = 0;
};

/// Progress is told with a share of its own for each part, 0 for the first, and at the end.
WindowRun run_in_windows(const test::LimitedPath& given) {
  int told = 0;
  double last = -1.0;
  const Progress progress{[&](const char*, double share) {
    told += share != last ? 1 : 0;
    last = share;
    return true;
  }};
  WindowRun run;
  run.result = schedule_feed(given.path, given.limits, {}, {}, in_windows(), progress);
  run.failed = run.result.windows - told;
  return run;
}

/// Random paths of 3 m in windows: limits kept, joined C2, not much slower than in one piece.
/// @return failed windows
int check_windows(unsigned from, unsigned to) {
  int failed = 0;
  for (unsigned seed = from; seed < to; ++seed) {
    INFO("seed " << seed);
    const test::LimitedPath random = test::random_path(seed, 3000.0);
    const FeedResult whole = from_rest_to_rest(random.path, random.limits);
    const WindowRun run = run_in_windows(random);
    const FeedResult& parts = run.result;
    failed += run.failed;
    REQUIRE(whole.status == FeedStatus::solved);
    REQUIRE(parts.status == FeedStatus::solved);
    CHECK(parts.windows >= 3);  // or the path was not cut at all
    CHECK(parts.load.largest() <= 1.0);
    CHECK(test::used_limits(random.path, random.limits, parts.profile, 20011).largest() <= 1.0);
    CHECK(parts.profile.duration() <= 1.003 * whole.profile.duration());
    CHECK(parts.profile.duration() >= 0.999 * whole.profile.duration());
  }
  return failed;
}

}  // namespace

TEST_CASE("schedule_feed: windows lose at most 0.3 per cent", "[kernels][schedule]") {
  CHECK(check_windows(3000, 3003) == 0);
}

TEST_CASE("schedule_feed: windows on 17 more paths", "[kernels][schedule][.slow][slow]") {
  CHECK(check_windows(3003, 3020) == 0);
}

TEST_CASE("schedule_feed: speed and acceleration have no step between windows",
          "[kernels][schedule]") {
  const test::LimitedPath random = test::random_path(3000, 3000.0);
  const FeedResult result = from_rest_to_rest(random.path, random.limits, in_windows());
  REQUIRE(result.windows > 3);
  const FeedProfile& profile = result.profile;
  const double step = 1e-4;
  FeedState before = profile.at(0.0);
  for (double t = step; t < profile.duration(); t += step) {
    const FeedState at = profile.at(t);
    const double jerk = std::max(std::abs(before.third), std::abs(at.third)) + 1e4;
    CHECK(std::abs(at.second - before.second) <= 2.0 * step * jerk);
    CHECK(std::abs(at.s - before.s - step * before.first) <= step * step * 1e5);
    before = at;
  }
}

TEST_CASE("schedule_feed: from and to a given speed", "[kernels][schedule]") {
  const FeedPath path = test::path6();
  const FeedLimits limits = test::path6_limits();
  const FeedProfile whole = from_rest_to_rest(path, limits).profile;
  // the middle of the whole law, cut out: its own states at the cuts, a little slower
  const FeedEnd start{false, 120.0, 0.0}, end{false, 90.0, 0.0};
  const FeedResult result = schedule_feed(path, limits, start, end, {}, {});
  REQUIRE(result.status == FeedStatus::solved);
  CHECK(result.load.largest() <= 1.0);
  CHECK(test::used_limits(path, limits, result.profile, 20011).largest() <= 1.0);
  const FeedState first = result.profile.at(0.0),
                  last = result.profile.at(result.profile.duration());
  CHECK(first.first == Approx(120.0).epsilon(1e-9));
  CHECK(std::abs(first.second) < 1e-4);
  CHECK(last.first == Approx(90.0).epsilon(1e-9));
  CHECK(std::abs(last.second) < 1e-4);
  CHECK(result.profile.duration() < whole.duration());
}

TEST_CASE("schedule_feed: a speed from which no stop is found", "[kernels][schedule]") {
  const FeedPath path = test::line(5.0, 250.0);  // a stop from 240 mm/s takes 10 mm and more
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = 8e3;
  limits.tip_jerk = 80e3;
  const FeedResult result = schedule_feed(path, limits, {false, 240.0, 0.0}, {}, {}, {});
  CHECK(result.status == FeedStatus::cannot_keep_speed);
  CHECK(result.witness.value == 240.0);
  CHECK(result.witness.s == 0.0);
  CHECK(result.profile.duration() == 0.0);
  const FeedResult fast =
      schedule_feed(test::line(200.0, 250.0), limits, {}, {false, 300.0, 0.0}, {}, {});
  CHECK(fast.status == FeedStatus::cannot_keep_speed);
  CHECK(fast.witness.value == 300.0);
  CHECK(fast.witness.s == 200.0);
  const FeedResult enough =
      schedule_feed(test::line(50.0, 250.0), limits, {false, 240.0, 0.0}, {}, {}, {});
  CHECK(enough.status == FeedStatus::solved);
}

TEST_CASE("schedule_feed: cancelled by its progress", "[kernels][schedule]") {
  const test::LimitedPath random = test::random_path(3000, 3000.0);
  int calls = 0;
  const Progress progress{[&](const char*, double share) {
    CHECK(share >= 0.0);
    CHECK(share <= 1.0);
    return ++calls < 3;
  }};
  const FeedResult result =
      schedule_feed(random.path, random.limits, {}, {}, in_windows(), progress);
  CHECK(result.status == FeedStatus::cancelled);
  CHECK(result.profile.duration() == 0.0);
  CHECK(calls == 3);
}

}  // namespace smoothpost
