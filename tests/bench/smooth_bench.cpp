#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>

#include "tests/kernels/smooth/paths.h"

// Blending corners: planning (construction), planning with a measured certificate, evaluation.
// Counters: corners per second, bytes that a corner takes.
namespace smoothpost {
namespace {

/// A random walk of `corners` corners: lines of 0.2 to 20 mm, turns of the tip of any angle below
/// 150 degrees, of the tool up to 0.2 rad.
test::PathText walk(std::size_t corners) {
  test::Random random(7);
  test::PathText text;
  Vec3 direction = Vec3::UnitX();
  for (std::size_t i = 0; i <= corners; ++i) {
    text.line(random.scale(0.2, 20.0) * direction, random.between(0.0, 0.2) * random.unit());
    const Vec3 axis = direction.cross(random.unit()).normalized();
    direction = Eigen::AngleAxisd(random.between(0.0, 2.6), axis) * direction;
    text.nodes.back().rotation.normalize();
  }
  return text;
}

CornerSettings settings_of(std::int64_t kind) {
  CornerSettings settings;
  settings.kind = kind == 0 ? BlendKind::acr : BlendKind::ramp;
  settings.tip_tolerance = 0.05;
  settings.rotation_tolerance = 0.01;
  return settings;
}

void bm_plan(benchmark::State& state) {
  const auto corners = static_cast<std::size_t>(state.range(0));
  const test::PathText text = walk(corners);
  for (auto _ : state) {
    state.PauseTiming();
    auto nodes = text.nodes;
    auto legs = text.legs;
    state.ResumeTiming();
    const CornerPath path(std::move(nodes), std::move(legs), {}, settings_of(state.range(1)));
    benchmark::DoNotOptimize(path.corners().data());
  }
  state.counters["corners/s"] = benchmark::Counter(
      static_cast<double>(corners * state.iterations()), benchmark::Counter::kIsRate);
  state.counters["bytes/corner"] =
      sizeof(PathNode) + sizeof(PathLeg) + sizeof(Corner) + sizeof(double) + 0.125;
}
BENCHMARK(bm_plan)->ArgsProduct({{1000, 10000, 100000, 1000000}, {0, 1}});

/// Plans, then measures tip distance and rotation angle at eight places of each window: 16 poses
/// and 16 originals a corner.
void bm_plan_and_certify(benchmark::State& state) {
  const auto corners = static_cast<std::size_t>(state.range(0));
  const test::PathText text = walk(corners);
  double worst = 0.0;
  for (auto _ : state) {
    const CornerPath path = text.blended(settings_of(state.range(1)));
    for (std::size_t leg = 0; leg < path.legs(); ++leg) {
      const double length = path.length(leg);
      for (int i = 0; i < 8; ++i) {
        const double x = length * (i + 0.5) / 8.0;
        const Pose a = path.at(leg, x);
        const Pose b = path.original(leg, x);
        const Eigen::Quaterniond d(Mat3(a.linear().transpose() * b.linear()));
        worst = std::max({worst, (a.translation() - b.translation()).norm() / 0.05,
                          2.0 * std::asin(std::min(1.0, d.vec().norm())) / 0.01});
      }
    }
  }
  state.counters["corners/s"] = benchmark::Counter(
      static_cast<double>(corners * state.iterations()), benchmark::Counter::kIsRate);
  state.counters["worst/tolerance"] = worst;
}
BENCHMARK(bm_plan_and_certify)->ArgsProduct({{10000}, {0, 1}});

void bm_at(benchmark::State& state) {
  const test::PathText text = walk(1000);
  const CornerPath path = text.blended(settings_of(state.range(0)));
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t leg = i % path.legs();
    const double share = static_cast<double>(i % 97) / 97.0;
    benchmark::DoNotOptimize(path.at(leg, share * path.length(leg)));
    ++i;
  }
}
BENCHMARK(bm_at)->Arg(0)->Arg(1);

void bm_derivatives(benchmark::State& state) {
  const test::PathText text = walk(1000);
  const CornerPath path = text.blended(settings_of(state.range(0)));
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t leg = i % path.legs();
    const double share = static_cast<double>(i % 97) / 97.0;
    benchmark::DoNotOptimize(path.derivatives(leg, share * path.length(leg)));
    ++i;
  }
}
BENCHMARK(bm_derivatives)->Arg(0)->Arg(1);

}  // namespace
}  // namespace smoothpost

BENCHMARK_MAIN();
