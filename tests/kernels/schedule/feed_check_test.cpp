#include "kernels/schedule/feed_check.h"

#include <catch2/catch.hpp>

#include "kernels/schedule/stretch_solver.h"
#include "tests/kernels/schedule/feed_paths.h"

namespace smoothpost {
namespace {

FeedStretch stretch_of(const FeedPath& path, const FeedLimits& limits) {
  const double length = path.breaks.back();
  return {&path, FeedLanes::from(limits), 0.0, length, RestMap(length, {250.0, 8e3, 80e3}, {})};
}

}  // namespace

TEST_CASE("feed_check: loads from interpolated rows are those of the path", "[kernels][schedule]") {
  const FeedPath path = test::path6();
  const FeedLimits limits = test::path6_limits();
  const FeedStretch stretch = stretch_of(path, limits);
  const StretchLaw law = solve_resting(stretch, {});
  FeedGrid bare = law.grid;
  bare.probes.clear();  // then every place is evaluated
  const auto fast = element_loads(stretch, law.grid, law.controls);
  const auto exact = element_loads(stretch, bare, law.controls);
  for (std::size_t e = 0; e < fast.size(); ++e) {
    CHECK(std::abs(fast[e].velocity - exact[e].velocity) < 3e-6);
    CHECK(std::abs(fast[e].acceleration - exact[e].acceleration) < 3e-6);
    CHECK(std::abs(fast[e].jerk - exact[e].jerk) < 3e-6);
  }
}

TEST_CASE("feed_check: a dilation divides loads by its powers", "[kernels][schedule]") {
  const FeedPath path = test::path6();
  const FeedLimits limits = test::path6_limits();
  const FeedStretch stretch = stretch_of(path, limits);
  StretchLaw law = solve_resting(stretch, {});
  const FeedLoad before = law.load();
  dilate(law, 1.02);  // peaks between places are looked for from 0.9 on
  const FeedLoad after = largest_load(element_loads(stretch, law.grid, law.controls));
  CHECK(after.velocity == Approx(before.velocity / 1.02).epsilon(1e-6));
  CHECK(after.acceleration == Approx(before.acceleration / 1.0404).epsilon(1e-6));
  CHECK(after.jerk == Approx(before.jerk / 1.061208).epsilon(1e-6));
  CHECK(law.load().jerk == Approx(after.jerk).epsilon(1e-6));
}

TEST_CASE("schedule_feed: twelve joints", "[kernels][schedule]") {
  const FeedPath six = test::path6();
  const FeedLimits limits = test::path6_limits();
  FeedPath path = six;
  const auto twice = [](const JointVector& v) {
    JointVector both(12);
    both << v, v.reverse();
    return both;
  };
  path.jet = [&](std::size_t piece, double s) {
    PathJet jet = six.jet(piece, s);
    for (JointVector* v : {&jet.first, &jet.second, &jet.third}) *v = twice(*v);
    return jet;
  };
  FeedLimits both = limits;
  for (JointVector* v : {&both.velocity, &both.acceleration, &both.jerk}) *v = twice(*v);
  const double once = test::from_rest_to_rest(six, limits).profile.duration();
  const FeedResult result = test::from_rest_to_rest(path, both);
  REQUIRE(result.status == FeedStatus::solved);
  CHECK(result.profile.duration() == Approx(once).epsilon(2e-4));
}

}  // namespace smoothpost
