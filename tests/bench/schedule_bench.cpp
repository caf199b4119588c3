#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <vector>

#include "kernels/schedule/feed_check.h"
#include "kernels/schedule/feed_profile.h"
#include "kernels/schedule/feed_solver.h"

#ifdef SMOOTHPOST_WITH_IPOPT
#include "tests/kernels/schedule/feed_ipopt.h"
#endif

// The feed schedule of an analytic path of six joints, repeated to the length wanted. Argument:
// collocation points. Counters: microseconds a point, iterations, microseconds a point and
// iteration, and the share of the check of the finished law. toppra's figure is the project
// owner's measurement of its C++ library on a machine of this kind, without jerk limits; it is here
// to stand beside ours, not measured by this programme.
namespace smoothpost {
namespace {

constexpr double kPeriod = 400.0;    // mm
constexpr double kPeriodTime = 1.7;  // s, about, of one period
constexpr int kPoints = 5;           // an element

/// q_k = a sin(w s + phase), the second joint s itself; mm, rad.
FeedPath waves(double length) {
  FeedPath path;
  path.breaks = {0.0, length};
  path.feed = {250.0};
  path.jet = [](std::size_t, double s) {
    static constexpr double kWaves[6][3] = {{50.0, 0.020, 0.0}, {0.0, 0.0, 0.0},
                                            {20.0, 0.035, 0.0}, {0.6, 0.012, 0.0},
                                            {0.4, 0.017, 1.57}, {10.0, 0.025, 0.0}};
    PathJet jet{JointVector(6), JointVector(6), JointVector(6)};
    for (int k = 0; k < 6; ++k) {
      const double a = kWaves[k][0], w = kWaves[k][1], u = w * s + kWaves[k][2];
      jet.first[k] = a * w * std::cos(u);
      jet.second[k] = -a * w * w * std::sin(u);
      jet.third[k] = -a * w * w * w * std::cos(u);
    }
    jet.first[1] = jet.tip_first = 1.0;
    return jet;
  };
  return path;
}

FeedLimits limits() {
  FeedLimits result{JointVector(6), JointVector(6), JointVector(6), 8e3, 80e3};
  result.velocity << 2e3, 2e3, 2e3, 10, 10, 2e3;
  result.acceleration << 12e3, 12e3, 12e3, 80, 80, 40e3;
  result.jerk << 120e3, 120e3, 120e3, 200, 200, 400e3;
  return result;
}

/// Length whose law has about that many points at 7 ms an element.
double length_of(int64_t points) {
  return kPeriod * static_cast<double>(points) / kPoints * 0.007 / kPeriodTime;
}

/// One solve of the interior point on one grid, from the constant law.
struct SolveProblem {
  FeedPath path;
  FeedStretch stretch;
  FeedGrid grid;
  FeedProgram program;
  std::vector<double> start;

  explicit SolveProblem(int64_t points) : path(waves(length_of(points))) {
    const double length = path.breaks.back();
    stretch = {&path, FeedLanes::from(limits()), 0.0, length,
               RestMap(length, {250.0, 8e3, 80e3}, {})};
    const double extent = stretch.map.extent();
    const int count = static_cast<int>(points / kPoints);
    grid = feed_grid(stretch, feed_elements(stretch, {{0.0, extent}, {0.0, extent}}, count),
                     kPoints, true);
    program.grid = &grid;
    program.lanes = &stretch.lanes;
    program.factors.resize(grid.points());
    start.assign(grid.controls(), 0.5 * constant_law(program));
  }
  SolveProblem(const SolveProblem&) = delete;
};

void BM_Solve(benchmark::State& state) {
  const SolveProblem problem(state.range(0));
  FeedSolution solution;
  for (auto _ : state) {
    solution = solve_feed(problem.program, problem.start, {});
    benchmark::DoNotOptimize(solution.time);
  }
  const double points = static_cast<double>(problem.grid.points());
  state.SetLabel("toppra, no jerk limits: 1.9 to 2.1 us a point (not measured here)");
  state.counters["iterations"] = solution.iterations;
  state.counters["converged"] = solution.converged;
  state.counters["T"] = solution.time;
  state.counters["s_per_point"] = benchmark::Counter(
      points, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(BM_Solve)->Arg(1000)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond);

#ifdef SMOOTHPOST_WITH_IPOPT

/// Ipopt on the same problem: the same elements, points and start, its own rows.
void BM_Ipopt(benchmark::State& state) {
  const SolveProblem problem(state.range(0));
  const RestMap& map = problem.stretch.map;
  std::vector<double> ends;
  for (const FeedElement& element : problem.grid.elements) ends.push_back(element.begin);
  ends.push_back(problem.grid.elements.back().end);
  const test::FeedTranscription twin(problem.path, limits(),
                                     {map.length(), map.speed(), map.ramp()}, ends);
  test::IpoptLaw law;
  double seconds = 0.0;
  for (auto _ : state) {
    const std::clock_t begin = std::clock();
    law = test::solve_by_ipopt(twin, problem.start, {1e-10, 0.1});
    seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    benchmark::DoNotOptimize(law.time);
  }
  if (!law.solved) state.SkipWithError("Ipopt did not succeed");
  // Ours on the same problem in the same run: the fastest of three.
  double ours = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const std::clock_t begin = std::clock();
    benchmark::DoNotOptimize(solve_feed(problem.program, problem.start, {}).time);
    ours = std::min(ours, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  state.counters["times_ours"] = seconds / ours;
  state.counters["iterations"] = law.iterations;
  state.counters["T"] = law.time;
  state.counters["s_per_point"] = benchmark::Counter(
      static_cast<double>(twin.points.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(BM_Ipopt)->Arg(1000)->Arg(10000)->Iterations(1)->Unit(benchmark::kMillisecond);

#endif

/// The check on 40 places an element, of the constant law.
void BM_Check(benchmark::State& state) {
  const FeedPath path = waves(length_of(state.range(0)));
  const double length = path.breaks.back();
  const FeedStretch stretch{&path, FeedLanes::from(limits()), 0.0, length,
                            RestMap(length, {250.0, 8e3, 80e3}, {})};
  const double extent = stretch.map.extent();
  const int count = static_cast<int>(state.range(0) / kPoints);
  const FeedGrid grid = feed_grid(
      stretch, feed_elements(stretch, {{0.0, extent}, {0.0, extent}}, count), kPoints, true);
  const std::vector<double> controls(grid.controls(), 0.5);
  for (auto _ : state) benchmark::DoNotOptimize(element_loads(stretch, grid, controls));
  state.counters["s_per_point"] = benchmark::Counter(
      static_cast<double>(grid.points()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(BM_Check)->Arg(10000)->Unit(benchmark::kMillisecond);

/// schedule_feed from rest to rest; from 100,000 points on in windows.
void BM_Schedule(benchmark::State& state) {
  const FeedPath path = waves(length_of(state.range(0)));
  FeedResult result;
  for (auto _ : state) {
    result = schedule_feed(path, limits(), {}, {}, {}, {});
    benchmark::DoNotOptimize(result.elements);
  }
  state.counters["iterations"] = result.iterations;
  state.counters["windows"] = result.windows;
  state.counters["load"] = result.load.largest();
  state.counters["s_per_point"] = benchmark::Counter(
      static_cast<double>(kPoints * result.elements),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(BM_Schedule)
    ->Arg(1000)
    ->Arg(10000)
    ->Arg(1000000)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace smoothpost

BENCHMARK_MAIN();
