#include "kernels/schedule/feed_parts.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <catch2/catch.hpp>

#include "kernels/core/contract.h"
#include "kernels/schedule/feed_start.h"
#include "tests/kernels/schedule/feed_paths.h"

namespace smoothpost {
namespace {

struct Problem {
  test::LimitedPath path;
  FeedStretch stretch;
  FeedGrid grid;
  FeedProgram program;

  Problem(unsigned seed, double length, int elements) : path(test::random_path(seed, length)) {
    const double extent = path.path.breaks.back();
    stretch = {&path.path, FeedLanes::from(path.limits), 0.0, extent,
               RestMap(extent, {100.0, 1e3, 1e4}, {})};
    const double w = stretch.map.extent();
    grid = feed_grid(stretch, feed_elements(stretch, {{0.0, w}, {0.0, w}}, elements), 5, false);
    program.grid = &grid;
    program.lanes = &stretch.lanes;
    program.factors.resize(grid.points());
  }
  Problem(const Problem&) = delete;

  double largest(const std::vector<double>& law) const {
    const auto r = point_ratios(program, law);
    return std::max({r.velocity, r.acceleration, r.jerk});
  }
};

}  // namespace

TEST_CASE("feed_parts: the parts' law is that of the whole", "[kernels][schedule]") {
  for (unsigned seed : {3u, 8u, 21u}) {
    Problem p(seed, 3000.0, 2000);
    const FeedParts parts = solve_in_parts(p.program, {{1e-6}});
    const FeedSolution whole = solve_feed(
        p.program, std::vector<double>(p.grid.controls(), 0.5 * constant_law(p.program)), {1e-6});
    CAPTURE(seed, parts.parts.size(), whole.iterations, parts.solution.iterations);
    CHECK(parts.parts.size() > 1);
    REQUIRE(whole.converged);
    CHECK(parts.solution.converged);
    CHECK(parts.solution.time == Approx(whole.time).epsilon(1e-4));
    CHECK(p.largest(parts.solution.controls) < 1.005);
  }
}

TEST_CASE("feed_parts: parts that never meet are solved as one", "[kernels][schedule]") {
  // A straight line on which nothing but the acceleration counts: there is no bottleneck.
  const FeedPath path = test::line(1e6, 1e9);
  FeedLimits limits = test::no_limits(1);
  limits.velocity[0] = 1e9;
  limits.acceleration[0] = 1e3;
  limits.jerk[0] = 1e9;
  const FeedStretch stretch{&path, FeedLanes::from(limits), 0.0, 1e6,
                            RestMap(1e6, {3e4, 1e3, 1e9}, {})};
  const double w = stretch.map.extent();
  const FeedGrid grid =
      feed_grid(stretch, feed_elements(stretch, {{0.0, w}, {0.0, w}}, 1500), 5, false);
  FeedProgram program;
  program.grid = &grid;
  program.lanes = &stretch.lanes;
  program.factors.resize(grid.points());
  const FeedParts parts = solve_in_parts(program, {{1e-6}});
  CHECK(parts.parts.size() == 1);
  // up and down at full acceleration: T = 2 √(L/A)
  CHECK(parts.solution.time == Approx(2.0 * std::sqrt(1e6 / 1e3)).epsilon(2e-3));
}

TEST_CASE("feed_parts: feeds that differ by powers of ten do not join parts",
          "[kernels][schedule]") {
  // A line on which a rotary turns by 120 rad within some 10 mm, now and then: there the feed is
  // 0.05 mm/s, and 250 mm/s elsewhere.
  FeedPath path = test::line(2400.0, 250.0);
  path.jet = [](std::size_t, double s) {
    PathJet jet{test::joints({1.0, 0.0}), test::joints({0.0, 0.0}), test::joints({0.0, 0.0})};
    jet.tip_first = 1.0;
    for (const double middle : {280.0, 320.0, 930.0, 1410.0, 1990.0}) {
      // q' = 20 / cosh²(x), x = (s − middle) / 3
      const double x = (s - middle) / 3.0, t = std::tanh(x), f = 20.0 * (1.0 - t * t);
      jet.first[1] += f;
      jet.second[1] += -2.0 * t * f / 3.0;
      jet.third[1] += (6.0 * t * t - 2.0) * f / 9.0;
    }
    return jet;
  };
  FeedLimits limits = test::no_limits(2);
  limits.velocity = test::joints({300.0, 1.0});
  limits.acceleration = test::joints({1e3, 10.0});
  limits.jerk = test::joints({1e4, 100.0});
  const FeedStretch stretch{&path, FeedLanes::from(limits), 0.0, 2400.0,
                            RestMap(2400.0, {250.0, 1e3, 1e4}, {})};
  const double w = stretch.map.extent();
  const FeedGrid grid =
      feed_grid(stretch, feed_elements(stretch, {{0.0, w}, {0.0, w}}, 2400), 5, false);
  FeedProgram program;
  program.grid = &grid;
  program.lanes = &stretch.lanes;
  program.factors.resize(grid.points());
  const FeedParts parts = solve_in_parts(program, {{1e-6, 400}});
  CHECK(parts.parts.size() == 3);
  REQUIRE(parts.solution.converged);
  const FeedSolution whole = solve_feed(program, local_law(program), {1e-6, 1000});
  REQUIRE(whole.converged);
  CHECK(parts.solution.time == Approx(whole.time).epsilon(1e-3));
  const auto r = point_ratios(program, parts.solution.controls);
  CHECK(std::max({r.velocity, r.acceleration, r.jerk}) < 1.005);
}

TEST_CASE("mend_law: rows that are drawn in are kept, what is far from them stays",
          "[kernels][schedule]") {
  constexpr std::size_t kFirst = 700, kCount = 10, kReach = 24;
  for (unsigned seed : {5u, 6u, 7u}) {
    Problem p(seed, 3000.0, 2000);
    const FeedSolution before = solve_in_parts(p.program, {{1e-6}}).solution;
    const double inside = p.largest(before.controls);
    FeedMending mending{std::vector<double>(p.grid.elements.size(), 1.0), 1.0005, {1e-6}};
    for (std::size_t e = kFirst; e < kFirst + kCount; ++e) {
      mending.over[e] = 1.03;
      for (std::size_t i = 5 * e; i < 5 * (e + 1); ++i) p.program.factors[i] = {1.03, 1.06, 1.09};
    }
    FeedSolution mended = before;
    const std::vector<bool> changed = mend_law(p.program, mending, mended);
    CAPTURE(seed, mended.iterations);
    CHECK(mended.time > before.time);
    // What was let out beside it is all that may be above the limits.
    CHECK(p.largest(mended.controls) < std::max(inside, 1.00041));
    for (std::size_t e = 0; e < changed.size(); ++e)
      CHECK(changed[e] == (e + kReach >= kFirst && e < kFirst + kCount + kReach));
    // An element's law are its four controls: up to the run and behind it every bit is the same.
    bool same = true;
    for (std::size_t j = 0; j < mended.controls.size(); ++j)
      if (j < kFirst - kReach + 3 || j >= kFirst + kCount + kReach)
        same = same && mended.controls[j] == before.controls[j];
    CHECK(same);
    // The optimum of the whole with those rows is not faster by more than 1e-4.
    const FeedSolution anew = solve_in_parts(p.program, {{1e-6}}).solution;
    CHECK(mended.time < anew.time * (1.0 + 1e-4));
  }
}

TEST_CASE("mend_law: both ends, and runs side by side, on any number of threads",
          "[kernels][schedule]") {
  Problem p(9, 1500.0, 600);
  const FeedSolution before = solve_in_parts(p.program, {{1e-6}}).solution;
  FeedMending mending{std::vector<double>(p.grid.elements.size(), 1.0), 1.0005, {1e-6}};
  for (const std::size_t e : {std::size_t{0}, std::size_t{100}, std::size_t{150}, std::size_t{300},
                              p.grid.elements.size() - 1}) {
    mending.over[e] = 1.02;
    for (std::size_t i = 5 * e; i < 5 * (e + 1); ++i) p.program.factors[i] = {1.02, 1.04, 1.06};
  }
  std::vector<double> first;
  for (int threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    FeedSolution mended = before;
    mend_law(p.program, mending, mended);
    CHECK(p.largest(mended.controls) < 1.005);
    if (first.empty()) first = mended.controls;
    CHECK(mended.controls == first);
  }
  CHECK_FALSE(first == before.controls);
}

TEST_CASE("feed_parts: no fixed controls", "[kernels][schedule]") {
  Problem p(5, 100.0, 60);
  p.program.fixed_first = 2;
  CHECK_THROWS_AS(solve_in_parts(p.program, {}), ContractViolation);
  FeedSolution solution;
  CHECK_THROWS_AS(mend_law(p.program, {}, solution), ContractViolation);
}

TEST_CASE("feed_start: local_law and keep_inside break no row", "[kernels][schedule]") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Problem p(seed, 1000.0, 400);
    const std::vector<double> law = local_law(p.program);
    CAPTURE(seed);
    CHECK(*std::min_element(law.begin(), law.end()) > 0.0);
    CHECK(p.largest(law) <= 1.0 + 1e-9);
    const std::vector<double> inside = keep_inside(
        p.program, std::vector<double>(p.grid.controls(), 50.0 * constant_law(p.program)));
    CHECK(p.largest(inside) <= 1.0 + 1e-9);
  }
}

}  // namespace smoothpost
