#include "formats/mesh/stl_reader.h"
#include "kernels/collision/mesh_search.h"
#include "kernels/collision/motion_check.h"
#include "tests/kernels/collision/scenes.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

double wave(double x, double y) { return 20.0 * std::sin(x / 40.0) * std::cos(y / 55.0); }
Vec3 wave_normal(double x, double y) {
  return Vec3(-0.5 * std::cos(x / 40.0) * std::cos(y / 55.0),
              20.0 / 55.0 * std::sin(x / 40.0) * std::sin(y / 55.0), 1.0)
      .normalized();
}

}  // namespace

TEST_CASE("large_mesh: a sheet of 500,000 triangles", "[kernels][collision][.slow]") {
  NEEDS_TREE();
  const auto mesh = weld(test::sheet(
      [](double u, double v) { return Vec3(500 * u, 500 * v, wave(500 * u, 500 * v)); }, 500, 500));
  REQUIRE(mesh.triangles.size() == 500000);
  const Scene scene = test::laser_scene(mesh);
  std::mt19937 random(71);
  SceneCache cache;
  std::vector<JointVector> path;
  double c = 0.0;
  for (int i = 0; i < 628; ++i) {
    const double x = 100.0 + 0.4 * i;
    const double y = 250.0 + 80.0 * std::sin(0.01 * i);
    const Vec3 n = wave_normal(x, y);
    path.push_back(test::laser_joints(Vec3(x, y, wave(x, y)) + n, n, -50.0, c));
    c = path.back()[3];
  }
  int free = 0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    free += check_motion(scene, path[i], path[i + 1], {}, &cache).verdict == MotionVerdict::free;
  CHECK(free == 627);
  for (std::size_t i = 0; i < path.size(); i += 157) {
    const LinkPoses links = link_poses(scene.chain(), path[i]);
    const double expected = test::mesh_distance(
        mesh, test::posed(test::frustum_distance(test::kNozzle), links[test::kW + 1]));
    const auto found = mesh_margin(
        *scene.bodies()[2].shape.mesh()->tree, *scene.bodies()[0].shape.convex(),
        links[test::kW + 1], {.clearance = 0.0, .want = std::numeric_limits<double>::infinity()});
    CHECK(found.distance == Approx(expected).margin(1e-6));
  }
}

TEST_CASE("large_mesh: meshes of the corpus serve, or say why not", "[kernels][collision][.slow]") {
  NEEDS_TREE();
  const auto files = test::corpus_files("5_stl", {".stl", ".STL"});
  if (files.empty()) {
    WARN("no ../shared/corpus: skipped");
    return;
  }
  std::mt19937 random(72);
  int served = 0;
  int solid = 0;
  int refused = 0;
  std::size_t largest = 0;
  for (const auto& file : files) {
    const auto stl = read_stl(test::read_bytes(file), file.filename().string());
    if (!stl.ok()) continue;
    CAPTURE(file.string());
    const auto mesh = weld(stl.value().corners);
    const auto shape = mesh_shape(mesh);
    if (!shape.ok()) {
      CHECK(shape.diagnostics().at(0).code == "RG102");
      ++refused;
      continue;
    }
    ++served;
    largest = std::max(largest, mesh.triangles.size());
    const TriangleTree& tree = *shape.value().tree;
    const auto report = describe(mesh);
    CHECK(tree.solid() == (report.closed() && report.inconsistent.count == 0));
    CHECK(shape.value().seeds.size() == report.components);
    solid += tree.solid();
    // A capsule of a tenth of the mesh's size at places in and about its box.
    const Vec3 size = tree.max() - tree.min();
    const double r = 0.05 * size.norm();
    for (int i = 0; i < (mesh.triangles.size() > 50000 ? 2 : 6); ++i) {
      const Vec3 at =
          0.5 * (tree.min() + tree.max()) + size.cwiseProduct(test::random_vector(random, 0.9));
      const Vec3 to = at + 2.0 * r * test::random_direction(random);
      const auto found =
          mesh_margin(tree, ConvexShape::capsule(at, to, r), Pose::Identity(),
                      {.clearance = 0.0, .want = std::numeric_limits<double>::infinity()});
      const double expected = test::mesh_distance(mesh, test::capsule_distance(at, to, r));
      REQUIRE(found.distance == Approx(expected).margin(1e-5 * size.norm()));
    }
  }
  CAPTURE(files.size(), served, solid, refused, largest);
  CHECK(served > 20);
  CHECK(solid > 5);
  CHECK(largest > 100000);
}
