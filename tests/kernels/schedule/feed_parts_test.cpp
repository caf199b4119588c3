#include "kernels/schedule/feed_parts.h"

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

TEST_CASE("feed_parts: rows that change are felt, others are not touched", "[kernels][schedule]") {
  Problem p(5, 3000.0, 2000);
  FeedParts parts = solve_in_parts(p.program, {{1e-6}});
  const FeedSolution before = parts.solution;
  std::vector<bool> changed(p.grid.elements.size(), false);
  for (std::size_t i = 0; i < 5 * 10; ++i) p.program.factors[i].jerk = 1.2;  // ten elements
  std::fill(changed.begin(), changed.begin() + 10, true);
  solve_again(p.program, changed, 1.1, {{1e-6}}, parts);
  CHECK(parts.solution.time > before.time);
  CHECK(p.largest(parts.solution.controls) < 1.005);
  CHECK(parts.solution.controls.back() == before.controls.back());
}

TEST_CASE("feed_parts: no fixed controls", "[kernels][schedule]") {
  Problem p(5, 100.0, 60);
  p.program.fixed_first = 2;
  CHECK_THROWS_AS(solve_in_parts(p.program, {}), ContractViolation);
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
