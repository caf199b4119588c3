// Collision queries of a laser head against a sheet, beside what FCL and CGAL need for the same
// question in the same run (processor time of this thread):
//   fcl_mesh     fcl::collide, head of 2,048 triangles as OBBRSS hierarchy against the sheet's
//   fcl_convex   fcl::collide, nozzle and casing as convex hulls of 32-gons against the sheet's
//   fcl_distance fcl::distance, head of triangles
//   cgal         CGAL::Rigid_triangle_mesh_collision_detection, exact predicates
// FCL and CGAL answer whether bodies meet; our scene also keeps 2 mm between them, with an exempt
// ball about the tip, and proves whole motions. `differ` counts places where the answers to the one
// common question (clearance 0) differ: polygons stand for circles in theirs.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "formats/mesh/stl_reader.h"
#include "kernels/collision/motion_check.h"
#include "kernels/core/units.h"
#include "kernels/geometry/weld.h"

#ifdef SMOOTHPOST_WITH_FCL
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>
#endif
#ifdef SMOOTHPOST_WITH_CGAL
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Rigid_triangle_mesh_collision_detection.h>
#include <CGAL/Surface_mesh.h>
#endif

namespace {

using namespace smoothpost;

double cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Shortest of `runs` runs, µs for one of `count` pieces of work.
template <class Work>
double best_us(int runs, std::size_t count, Work work) {
  double best = 1e9;
  for (int i = 0; i < runs; ++i) {
    const double begin = cpu_time();
    work();
    best = std::min(best, cpu_time() - begin);
  }
  return 1e6 * best / static_cast<double>(count);
}

double height(double x, double y) { return 20.0 * std::sin(x / 40.0) * std::cos(y / 55.0); }
Vec3 normal(double x, double y) {
  return Vec3(-0.5 * std::cos(x / 40.0) * std::cos(y / 55.0),
              20.0 / 55.0 * std::sin(x / 40.0) * std::sin(y / 55.0), 1.0)
      .normalized();
}

/// A wavy sheet, 1.5 mm thick and closed, of 4 n² + 8 n triangles over 500 x 500 mm.
TriangleMesh sheet(int n) {
  std::vector<Vec3> corners;
  const auto at = [n](int i, int j, double down) {
    const double x = 500.0 * i / n;
    const double y = 500.0 * j / n;
    return Vec3(x, y, height(x, y) - down);
  };
  const auto quad = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    for (const Vec3& v : {a, b, c, a, c, d}) corners.push_back(v);
  };
  constexpr double kThick = 1.5;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      quad(at(i, j, 0), at(i + 1, j, 0), at(i + 1, j + 1, 0), at(i, j + 1, 0));
      quad(at(i, j, kThick), at(i, j + 1, kThick), at(i + 1, j + 1, kThick), at(i + 1, j, kThick));
    }
    quad(at(i, 0, kThick), at(i + 1, 0, kThick), at(i + 1, 0, 0), at(i, 0, 0));
    quad(at(i + 1, n, kThick), at(i, n, kThick), at(i, n, 0), at(i + 1, n, 0));
    quad(at(0, i + 1, kThick), at(0, i, kThick), at(0, i, 0), at(0, i + 1, 0));
    quad(at(n, i, kThick), at(n, i + 1, kThick), at(n, i + 1, 0), at(n, i, 0));
  }
  return weld(corners);
}

ScrewChain laser() {
  ScrewChain chain;
  const auto add = [&](JointKind kind, const Vec3& direction) {
    ChainJoint joint;
    joint.kind = kind;
    joint.direction = direction;
    chain.joints.push_back(joint);
  };
  for (int i = 0; i < 3; ++i) add(JointKind::linear, Vec3::Unit(i));
  add(JointKind::rotary, Vec3::UnitZ());
  add(JointKind::rotary, Vec3::UnitY());
  add(JointKind::linear, Vec3::UnitZ());
  return chain;
}

const FrustumSize kNozzle{
    .from = {0, 0, 0}, .to = {0, 0, 60}, .radius_from = 2.0, .radius_to = 25.0};
const FrustumSize kCasing{
    .from = {0, 0, 160}, .to = {0, 0, 400}, .radius_from = 60.0, .radius_to = 60.0};
constexpr double kStandoff = -50.0;

Scene scene_of(const TriangleMesh& mesh, double clearance, bool exempt) {
  std::vector<SceneBody> bodies = {
      {.name = "nozzle", .joint = 5, .shape = ConvexShape::frustum(kNozzle)},
      {.name = "casing", .joint = 4, .shape = ConvexShape::frustum(kCasing)},
      {.name = "part", .joint = SceneBody::kWorkpiece, .shape = mesh_shape(mesh).value()}};
  std::vector<ScenePair> pairs = {{.first = 0, .second = 2, .clearance = clearance},
                                  {.first = 1, .second = 2, .clearance = clearance}};
  if (exempt) pairs[0].exempt = ExemptSphere{Vec3::Zero(), 8.0};
  return Scene(laser(), bodies, pairs);
}

JointVector joints(const Vec3& tip, const Vec3& axis, double c) {
  JointVector q(6);
  const double angle = std::atan2(axis.y(), axis.x());
  q << tip - kStandoff * axis, angle + 2.0 * kPi * std::round((c - angle) / (2.0 * kPi)),
      std::atan2(std::hypot(axis.x(), axis.y()), axis.z()), kStandoff;
  return q;
}

/// 628 cutter locations 1 mm apart, 1 mm over the sheet, axis normal to it.
std::vector<JointVector> path() {
  std::vector<JointVector> out;
  double x = 60.0;
  double y = 250.0;
  for (int i = 0; i < 628; ++i) {
    x += std::cos(0.012 * i);
    y += std::sin(0.012 * i);
    const Vec3 n = normal(x, y);
    out.push_back(joints(Vec3(x, y, height(x, y)) + n, n, i ? out.back()[3] : 0.0));
  }
  return out;
}

/// 1000 places as in the figures of peers: tip −0.5 … 1.5 mm along the normal.
std::vector<JointVector> places() {
  std::vector<JointVector> out;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(60.0, 440.0);
  std::uniform_real_distribution<double> gap(-0.5, 1.5);
  for (int i = 0; i < 1000; ++i) {
    const double x = u(random);
    const double y = u(random);
    const Vec3 n = normal(x, y);
    out.push_back(joints(Vec3(x, y, height(x, y)) + gap(random) * n, n, 0.0));
  }
  return out;
}

/// A frustum as triangles, `n` to the circle and `rings` along it.
TriangleMesh polygons(const FrustumSize& f, int n, int rings) {
  std::vector<Vec3> corners;
  const auto at = [&](double share, int k) {
    const double a = 2.0 * kPi * (k % n) / n;
    const double r = f.radius_from + share * (f.radius_to - f.radius_from);
    return Vec3(f.from + share * (f.to - f.from) + r * Vec3(std::cos(a), std::sin(a), 0.0));
  };
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < rings; ++j) {
      const double lo = double(j) / rings;
      const double hi = double(j + 1) / rings;
      for (const Vec3& v :
           {at(lo, k), at(lo, k + 1), at(hi, k + 1), at(lo, k), at(hi, k + 1), at(hi, k)})
        corners.push_back(v);
    }
    for (const Vec3& v : {f.from, at(0, k + 1), at(0, k), f.to, at(1, k), at(1, k + 1)})
      corners.push_back(v);
  }
  return weld(corners);
}

#ifdef SMOOTHPOST_WITH_FCL
std::shared_ptr<fcl::BVHModel<fcl::OBBRSSd>> fcl_model(const TriangleMesh& mesh) {
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  std::vector<fcl::Vector3d> vertices(mesh.vertices.begin(), mesh.vertices.end());
  std::vector<fcl::Triangle> triangles;
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  model->addSubModel(vertices, triangles);
  model->endModel();
  return model;
}

std::shared_ptr<fcl::Convexd> fcl_convex(const FrustumSize& f) {
  const TriangleMesh mesh = polygons(f, 32, 1);
  auto vertices =
      std::make_shared<std::vector<fcl::Vector3d>>(mesh.vertices.begin(), mesh.vertices.end());
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& t : mesh.triangles) {
    faces->push_back(3);
    for (const auto v : t) faces->push_back(static_cast<int>(v));
  }
  return std::make_shared<fcl::Convexd>(vertices, static_cast<int>(mesh.triangles.size()), faces);
}

bool fcl_meets(const fcl::CollisionGeometryd* a, const Pose& at, const fcl::CollisionGeometryd* b) {
  fcl::CollisionRequestd request;
  fcl::CollisionResultd result;
  return fcl::collide(a, at, b, Pose::Identity(), request, result) > 0;
}
#endif

/// The same yes/no question for all.
void yes_no(benchmark::State& state) {
  const TriangleMesh mesh = sheet(static_cast<int>(state.range(0)));
  const Scene scene = scene_of(mesh, 0.0, false);
  const auto all = places();
  std::vector<char> ours(all.size());
  for (auto _ : state) {
    state.counters["ours_us"] = best_us(3, all.size(), [&] {
      for (std::size_t i = 0; i < all.size(); ++i) ours[i] = scene.free(all[i]);
    });
  }
  state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
  state.counters["hits"] = static_cast<double>(std::count(ours.begin(), ours.end(), 0));
  std::vector<LinkPoses> poses;
  for (const auto& q : all) poses.push_back(link_poses(scene.chain(), q));
  const auto compare = [&](const char* name, int runs, const auto& meets) {
    std::vector<char> theirs(all.size());
    state.counters[std::string(name) + "_us"] = best_us(runs, all.size(), [&] {
      for (std::size_t i = 0; i < all.size(); ++i) theirs[i] = !meets(poses[i]);
    });
    double differ = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) differ += theirs[i] != ours[i];
    state.counters[std::string(name) + "_differ"] = differ;
  };
#ifdef SMOOTHPOST_WITH_FCL
  const auto part = fcl_model(mesh);
  const auto nozzle = fcl_model(polygons(kNozzle, 64, 7));
  const auto casing = fcl_model(polygons(kCasing, 64, 7));
  compare("fcl_mesh", 3, [&](const LinkPoses& at) {
    return fcl_meets(nozzle.get(), at[6], part.get()) || fcl_meets(casing.get(), at[5], part.get());
  });
  const auto nozzle_hull = fcl_convex(kNozzle);
  const auto casing_hull = fcl_convex(kCasing);
  compare("fcl_convex", 3, [&](const LinkPoses& at) {
    return fcl_meets(nozzle_hull.get(), at[6], part.get()) ||
           fcl_meets(casing_hull.get(), at[5], part.get());
  });
#endif
#ifdef SMOOTHPOST_WITH_CGAL
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
  const auto surface = [](const TriangleMesh& m) {
    Surface out;
    for (const Vec3& v : m.vertices) out.add_vertex({v.x(), v.y(), v.z()});
    for (const auto& t : m.triangles)
      out.add_face(Surface::Vertex_index(t[0]), Surface::Vertex_index(t[1]),
                   Surface::Vertex_index(t[2]));
    return out;
  };
  const Surface sheet_surface = surface(mesh);
  const Surface nozzle_surface = surface(polygons(kNozzle, 64, 7));
  const Surface casing_surface = surface(polygons(kCasing, 64, 7));
  CGAL::Rigid_triangle_mesh_collision_detection<Surface> detection;
  const auto sheet_id = detection.add_mesh(sheet_surface);
  const auto nozzle_id = detection.add_mesh(nozzle_surface);
  const auto casing_id = detection.add_mesh(casing_surface);
  const auto place = [&](std::size_t id, const Pose& at) {
    const auto& m = at.matrix();
    detection.set_transformation(id, CGAL::Aff_transformation_3<Kernel>(
                                         m(0, 0), m(0, 1), m(0, 2), m(0, 3), m(1, 0), m(1, 1),
                                         m(1, 2), m(1, 3), m(2, 0), m(2, 1), m(2, 2), m(2, 3)));
  };
  compare("cgal", 1, [&](const LinkPoses& at) {
    place(nozzle_id, at[6]);
    place(casing_id, at[5]);
    const std::vector<std::size_t> others = {nozzle_id, casing_id};
    return !detection.get_all_intersections(sheet_id, others).empty();
  });
#endif
}

/// Along a path of cutter locations, 2 mm required, exempt ball: what a certificate asks.
void along_path(benchmark::State& state) {
  const TriangleMesh mesh = sheet(static_cast<int>(state.range(0)));
  const Scene scene = scene_of(mesh, 2.0, true);
  const auto q = path();
  std::size_t free = 0;
  std::size_t queries = 0;
  for (auto _ : state) {
    state.counters["yes_no_us"] = best_us(5, q.size(), [&] {
      SceneCache cache;
      free = 0;
      for (const auto& at : q) free += scene.free(at, &cache);
      queries = cache.queries();
    });
    state.counters["queries"] = static_cast<double>(queries);
    state.counters["yes_no_without_cache_us"] = best_us(3, q.size(), [&] {
      for (const auto& at : q) benchmark::DoNotOptimize(scene.free(at));
    });
    state.counters["clearance_cap5_us"] = best_us(3, q.size(), [&] {
      SceneCache cache;
      for (const auto& at : q) benchmark::DoNotOptimize(scene.clearance(at, 5.0, &cache).margin);
    });
    state.counters["clearance_us"] = best_us(3, q.size(), [&] {
      SceneCache cache;
      for (const auto& at : q)
        benchmark::DoNotOptimize(
            scene.clearance(at, std::numeric_limits<double>::infinity(), &cache).margin);
    });
  }
  state.counters["free"] = static_cast<double>(free);
#ifdef SMOOTHPOST_WITH_FCL
  const auto part = fcl_model(mesh);
  const auto nozzle = fcl_model(polygons(kNozzle, 64, 7));
  fcl::DistanceRequestd request;
  state.counters["fcl_distance_us"] = best_us(1, q.size() / 10, [&] {
    for (std::size_t i = 0; i < q.size(); i += 10) {
      fcl::DistanceResultd result;
      const LinkPoses at = link_poses(scene.chain(), q[i]);
      benchmark::DoNotOptimize(
          fcl::distance(nozzle.get(), at[6], part.get(), Pose::Identity(), request, result));
    }
  });
#endif
}

void report_motions(benchmark::State& state, const Scene& scene,
                    const std::vector<JointVector>& q) {
  std::size_t free = 0;
  std::size_t queries = 0;
  double ms = 0.0;
  for (auto _ : state) {
    ms = 1e-3 * best_us(5, 1, [&] {
           SceneCache cache;
           free = queries = 0;
           for (std::size_t i = 0; i + 1 < q.size(); ++i) {
             const auto report = check_motion(scene, q[i], q[i + 1], {}, &cache);
             free += report.verdict == MotionVerdict::free;
             queries += report.queries;
           }
         });
  }
  state.counters["path_ms"] = ms;
  state.counters["motions"] = static_cast<double>(q.size() - 1);
  state.counters["free"] = static_cast<double>(free);
  state.counters["queries"] = static_cast<double>(queries);
}

/// Every motion of the path proven free.
void path_motions(benchmark::State& state) {
  report_motions(state, scene_of(sheet(static_cast<int>(state.range(0))), 2.0, true), path());
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Case 2 of the reference data beside the checkout.
void case2_motions(benchmark::State& state) {
  const std::filesystem::path folder = SMOOTHPOST_SOURCE_DIR "/../shared/reference";
  if (!std::filesystem::exists(folder / "case2.csv")) {
    state.SkipWithError("no ../shared/reference");
    return;
  }
  const auto stl = read_stl(bytes_of(folder / "case2.stl"), "case2.stl");
  std::vector<JointVector> q;
  std::istringstream lines(bytes_of(folder / "case2.csv"));
  for (std::string line; std::getline(lines, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    Vec3 tip;
    Vec3 axis;
    if (numbers >> tip.x() >> tip.y() >> tip.z() >> axis.x() >> axis.y() >> axis.z())
      q.push_back(joints(tip, axis.normalized(), q.empty() ? 0.0 : q.back()[3]));
  }
  report_motions(state, scene_of(weld(stl.value().corners), 2.0, true), q);
}

void build_tree(benchmark::State& state) {
  const TriangleMesh mesh = sheet(static_cast<int>(state.range(0)));
  double ours = 1e9;
  for (auto _ : state) {
    const double begin = cpu_time();
    benchmark::DoNotOptimize(build_triangle_tree(mesh).value().size());
    ours = std::min(ours, cpu_time() - begin);
  }
  state.counters["ours_ms"] = 1e3 * ours;
  state.counters["seeds_ms"] =
      1e-3 * best_us(3, 1,
                     [&] {
                       benchmark::DoNotOptimize(
                           mesh_shape(std::make_shared<const TriangleTree>(
                                          std::move(build_triangle_tree(mesh).value())),
                                      mesh)
                               .seeds.size());
                     }) -
      state.counters["ours_ms"];
#ifdef SMOOTHPOST_WITH_FCL
  const double begin = cpu_time();
  benchmark::DoNotOptimize(fcl_model(mesh).get());
  state.counters["fcl_ms"] = 1e3 * (cpu_time() - begin);
#endif
}

}  // namespace

BENCHMARK(yes_no)->Arg(70)->Arg(353)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(along_path)->Arg(70)->Arg(353)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(path_motions)->Arg(70)->Arg(353)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(case2_motions)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(build_tree)->Arg(353)->Iterations(5)->Unit(benchmark::kMillisecond);

BENCHMARK_MAIN();
