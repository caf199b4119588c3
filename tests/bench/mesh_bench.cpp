// Reading, welding and asking a mesh. Each benchmark runs beside its floor in the same process; the
// counter `times_floor` is how many times longer it takes.
//   reading: a copy of the file's bytes, and the unpacking of nine floats a triangle
//   weld:    one pass over the corners   tree: sorting as many keys   query: the surface in closed
//   form

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include "formats/mesh/stl_reader.h"
#include "kernels/geometry/part_registration.h"
#include "kernels/geometry/triangle_tree.h"
#include "kernels/geometry/weld.h"

namespace {

using namespace smoothpost;

/// CPU time of this thread, s: what a busy machine does to the wall clock is not our work.
double cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// The shortest of five runs, s.
template <class Work>
double floor_time(Work work) {
  double best = 1e9;
  for (int i = 0; i < 5; ++i) {
    const double begin = cpu_time();
    work();
    best = std::min(best, cpu_time() - begin);
  }
  return best;
}

/// Runs `work` once an iteration and reports how many times the floor it takes (shortest run each).
/// Returns the shortest run, s.
template <class Work>
double beside_floor(benchmark::State& state, double floor, Work work) {
  double best = 1e9;
  for (auto _ : state) {
    const double begin = cpu_time();
    work();
    best = std::min(best, cpu_time() - begin);
  }
  state.counters["best_ms"] = 1e3 * best;
  state.counters["floor_ms"] = 1e3 * floor;
  state.counters["times_floor"] = best / floor;
  return best;
}

double height(double x, double y) { return 20.0 * std::sin(x / 40.0) * std::cos(y / 55.0); }

/// A wavy sheet of n x n cells over 500 x 500 mm.
std::vector<Vec3> sheet(int n) {
  std::vector<Vec3> corners;
  corners.reserve(6 * static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  const auto at = [n](int i, int j) {
    const double x = 500.0 * i / n;
    const double y = 500.0 * j / n;
    return Vec3(static_cast<float>(x), static_cast<float>(y), static_cast<float>(height(x, y)));
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (const Vec3& v :
           {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)})
        corners.push_back(v);
  return corners;
}

std::string binary_stl(const std::vector<Vec3>& corners) {
  const auto count = static_cast<std::uint32_t>(corners.size() / 3);
  std::string bytes(84 + 50 * std::size_t{count}, '\0');
  std::memcpy(bytes.data() + 80, &count, 4);
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const float value = static_cast<float>(corners[i][k]);
      std::memcpy(
          bytes.data() + 84 + 50 * (i / 3) + 12 + 12 * (i % 3) + 4 * static_cast<std::size_t>(k),
          &value, 4);
    }
  return bytes;
}

const std::vector<Vec3>& million() {
  static const std::vector<Vec3> corners = sheet(707);  // 999,698 triangles
  return corners;
}
const TriangleMesh& half_million() {
  static const TriangleMesh mesh = weld(sheet(500));  // 500,000 triangles
  return mesh;
}
const TriangleTree& tree_of_half_million() {
  static const TriangleTree tree = std::move(build_triangle_tree(half_million()).value());
  return tree;
}

std::vector<Vec3> unpacked(const std::string& bytes) {
  std::vector<Vec3> out((bytes.size() - 84) / 50 * 3);
  for (std::size_t i = 0; i < out.size(); ++i) {
    float v[3];
    std::memcpy(v, bytes.data() + 84 + 50 * (i / 3) + 12 + 12 * (i % 3), sizeof v);
    out[i] = Vec3(v[0], v[1], v[2]);
  }
  return out;
}

void read_binary(benchmark::State& state) {
  const std::string bytes = binary_stl(million());
  const double copy = floor_time([&] {
    std::string other = bytes;
    benchmark::DoNotOptimize(other.data());
  });
  const double unpack = floor_time([&] { benchmark::DoNotOptimize(unpacked(bytes).data()); });
  beside_floor(state, unpack, [&] {
    benchmark::DoNotOptimize(read_stl(bytes, "bench.stl").value().corners.data());
  });
  state.counters["copy_ms"] = 1e3 * copy;
}

void read_and_weld(benchmark::State& state) {
  const std::string bytes = binary_stl(million());
  const double unpack = floor_time([&] { benchmark::DoNotOptimize(unpacked(bytes).data()); });
  beside_floor(state, unpack, [&] {
    const auto stl = read_stl(bytes, "bench.stl");
    benchmark::DoNotOptimize(weld(stl.value().corners).vertices.data());
  });
}

double pass_over(const std::vector<Vec3>& corners) {
  return floor_time([&] {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& v : corners) sum += v;
    benchmark::DoNotOptimize(sum.data());
  });
}

void weld_million(benchmark::State& state) {
  const auto& corners = million();
  beside_floor(state, pass_over(corners),
               [&] { benchmark::DoNotOptimize(weld(corners).vertices.data()); });
}

void describe_million(benchmark::State& state) {
  const TriangleMesh mesh = weld(million());
  beside_floor(state, pass_over(million()), [&] { benchmark::DoNotOptimize(describe(mesh).area); });
}

void build_tree_half_million(benchmark::State& state) {
  const auto& mesh = half_million();
  std::vector<double> keys(mesh.triangles.size());
  std::mt19937 random(1);
  for (double& key : keys) key = static_cast<double>(random());
  const double sorting = floor_time([&] {
    auto sorted = keys;
    std::sort(sorted.begin(), sorted.end());
    benchmark::DoNotOptimize(sorted.data());
  });
  beside_floor(state, sorting,
               [&] { benchmark::DoNotOptimize(build_triangle_tree(mesh).value().size()); });
}

/// 10,000 points about 1 mm over the sheet; in the order of a path, or scattered.
std::vector<CutterLocation> points_over_sheet(bool path) {
  std::vector<CutterLocation> points;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(10.0, 490.0);
  for (int i = 0; i < 10000; ++i) {
    const double a = 2e-3 * i;
    const double x = path ? 250.0 + 0.02 * i * std::cos(a) : u(random);
    const double y = path ? 250.0 + 0.02 * i * std::sin(a) : u(random);
    const Vec3 normal = Vec3(-0.5 * std::cos(x / 40.0) * std::cos(y / 55.0),
                             20.0 / 55.0 * std::sin(x / 40.0) * std::sin(y / 55.0), 1.0)
                            .normalized();
    points.push_back({Vec3(x, y, height(x, y)) + normal, normal});
  }
  return points;
}

void closest_points(benchmark::State& state) {
  const bool hinted = state.range(0) != 0;
  const auto& tree = tree_of_half_million();
  const auto points = points_over_sheet(hinted);
  const double nearest = floor_time([&] {
    double sum = 0.0;
    for (const auto& p : points) sum += height(p.tip.x(), p.tip.y());
    benchmark::DoNotOptimize(sum);
  });
  const double best = beside_floor(state, nearest, [&] {
    std::uint32_t hint = 0;
    for (const auto& p : points) {
      const auto found = hinted ? tree.closest(p.tip, hint) : tree.closest(p.tip);
      hint = found.triangle;
      benchmark::DoNotOptimize(found.signed_distance);
    }
  });
  state.counters["us_per_query"] = 1e6 * best / static_cast<double>(points.size());
}

void register_points(benchmark::State& state) {
  const auto& tree = tree_of_half_million();
  auto points = points_over_sheet(true);
  const RegistrationSettings settings{
      .nominal_gap = 1.0, .allowed_gap_deviation = 0.5, .allowed_angle = 0.35};
  const double queries = floor_time([&] {
    std::uint32_t hint = 0;
    for (const auto& p : points) hint = tree.closest(p.tip, hint).triangle;
    benchmark::DoNotOptimize(hint);
  });
  if (state.range(0))
    for (auto& p : points) p.tip += Vec3(3, -2, 5);
  std::string verdict;
  beside_floor(state, queries,
               [&] { verdict = to_string(register_part(points, tree, settings).verdict); });
  state.SetLabel(verdict);
}

}  // namespace

BENCHMARK(read_binary)->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(read_and_weld)->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(weld_million)->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(describe_million)->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(build_tree_half_million)->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(closest_points)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(register_points)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
