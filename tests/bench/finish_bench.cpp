// The finishing stage: tracking with exact joints, slices and normals of a large mesh, and a cut's
// free joint.

#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>

#include "examples/paper_c/paper_paths.h"
#include "kernels/geometry/oriented_surface.h"
#include "kernels/geometry/slicing.h"
#include "kernels/geometry/surface_normal.h"
#include "kernels/geometry/weld.h"
#include "kernels/optimise/redundancy.h"

namespace {

using namespace smoothpost;

double cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Joints of every 0.025 mm of paper C's ellipse from the closed form, and forward kinematics of
/// them. Counters: ns a point, and the largest error of the tip and of the axis.
void tracking(benchmark::State& state) {
  const RotaryPair pair = *RotaryPair::from(paper_c::machine());
  const paper_c::Contour contour = paper_c::ellipse(50, 35);
  std::vector<CutterLocation> points;
  std::vector<double> bed;
  for (double s = 0.0; s < contour.length(); s += 0.025) {
    const LocationJet at = contour.at(s);
    points.push_back({at.tip.col(0), at.axis.col(0)});
    bed.push_back(-2.0 * kPi * s / contour.length());
  }
  double best = 1e9, tip = 0.0, axis = 0.0;
  for (auto _ : state) {
    const double begin = cpu_time();
    JointVector held = JointVector::Zero(6);
    for (std::size_t i = 0; i < points.size(); ++i) {
      held[5] = bed[i];
      const RotaryPairSolutions found = pair.solve(points[i], held);
      const bool second =
          !found.valid[0] || (found.valid[1] && std::abs(found.q[1][3]) < std::abs(found.q[0][3]));
      const JointVector& q = found.q[second ? 1 : 0];
      const CutterLocation at = forward_location(pair.chain(), q);
      tip = std::max(tip, (at.tip - points[i].tip).norm());
      axis = std::max(axis, (at.axis - points[i].axis).norm());
    }
    best = std::min(best, cpu_time() - begin);
  }
  state.counters["ns_a_point"] = 1e9 * best / static_cast<double>(points.size());
  state.counters["tip_mm"] = tip;
  state.counters["axis_rad"] = axis;
}
BENCHMARK(tracking)->Unit(benchmark::kMillisecond);

/// A closed bumpy ball of about `n`² triangles, 100 mm wide.
TriangleMesh bumpy(int n) {
  const int around = n, up = n / 2;
  std::vector<Vec3> corners;
  const auto at = [&](int i, int j) -> Vec3 {
    const double a = 2.0 * kPi * (i % around) / around, b = kPi * j / up;
    const double r =
        j == 0 || j == up ? 50.0 : 50.0 + 2.0 * std::sin(5 * a) * std::sin(b) * std::sin(4 * b);
    return r * Vec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
  };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < up; ++j) {
      if (j > 0)
        for (const Vec3& v : {at(i, j), at(i, j + 1), at(i + 1, j)}) corners.push_back(v);
      if (j + 1 < up)
        for (const Vec3& v : {at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)}) corners.push_back(v);
    }
  return weld(corners);
}

/// 100 layers of a mesh of 330,000 triangles, from the welded file on.
void slicing(benchmark::State& state) {
  const TriangleMesh mesh = bumpy(576);
  double best = 1e9;
  std::size_t points = 0;
  for (auto _ : state) {
    const double begin = cpu_time();
    const OrientedSurface surface = orient_surface(mesh);
    SliceSettings settings;
    settings.first = -49.6;
    settings.last = 49.6;
    settings.pitch = 1.0;
    const auto layers = slice_surface(surface, settings);
    best = std::min(best, cpu_time() - begin);
    points = 0;
    for (const SliceLayer& layer : layers.value())
      for (const SliceContour& contour : layer.contours) points += contour.points.size();
    state.counters["layers"] = static_cast<double>(layers.value().size());
  }
  state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
  state.counters["points"] = static_cast<double>(points);
  state.counters["s"] = best;
}
BENCHMARK(slicing)->Unit(benchmark::kMillisecond)->Iterations(3);

void normals(benchmark::State& state) {
  const OrientedSurface surface = orient_surface(bumpy(200));
  const SurfaceNormals normals(surface);
  const auto n = static_cast<std::uint32_t>(surface.mesh.triangles.size());
  std::uint32_t i = 0;
  for (auto _ : state) {
    const auto& t = surface.mesh.triangles[i];
    const Vec3 middle =
        (surface.mesh.vertices[t[0]] + surface.mesh.vertices[t[1]] + surface.mesh.vertices[t[2]]) /
        3.0;
    benchmark::DoNotOptimize(normals.at(i, middle));
    i = (i + 7919) % n;
  }
}
BENCHMARK(normals);

/// Closed minimum norm over the ellipse, and its refinement for least jerk with pieces of 4 mm.
void free_joint(benchmark::State& state) {
  const RotaryPair pair = *RotaryPair::from(paper_c::machine());
  const paper_c::Contour contour = paper_c::ellipse(50, 35);
  const RedundantPath path = redundant_path(pair, contour.at, contour.breaks);
  MinimumNormSettings local;
  local.weight.resize(6);
  local.weight << 1 / 4e4, 1 / 4e4, 1 / 9.0, 1 / 9.0, 1 / 2500.0, 1.0;
  local.near = JointVector::Zero(6);
  local.change = -2.0 * kPi;
  local.step = 4.0;
  SmoothFreeSettings smooth;
  smooth.velocity_weight = smooth.jerk_weight = local.weight;
  smooth.lower = JointVector::Constant(6, -1e4);
  smooth.upper = JointVector::Constant(6, 1e4);
  smooth.free_lower = -20.0;
  smooth.free_upper = 10.0;
  smooth.spacing = 4.0;
  smooth.most_passes = 6;
  double best = 1e9;
  for (auto _ : state) {
    const double begin = cpu_time();
    const MinimumNorm norm = minimum_norm(path, local);
    const SmoothFree found = smooth_free(path, norm.free, local.near, smooth);
    benchmark::DoNotOptimize(found.after.jerk);
    best = std::min(best, cpu_time() - begin);
  }
  state.counters["best_ms"] = 1e3 * best;
}
BENCHMARK(free_joint)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
