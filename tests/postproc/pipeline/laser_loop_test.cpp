#include "postproc/pipeline/laser_loop.h"

#include "formats/mesh/stl_reader.h"
#include "kernels/geometry/weld.h"
#include "postproc/pipeline/clearance_check.h"
#include "tests/postproc/pipeline/clear_scenes.h"

using namespace smoothpost;

namespace {

const std::vector<MachineOverride> kFree = {{"tolerance.lead_deg", "12"},
                                            {"tolerance.tilt_deg", "12"}};

std::vector<MachineOverride> with(std::vector<MachineOverride> list, MachineOverride more) {
  list.push_back(std::move(more));
  return list;
}

bool has(const Conversion& c, const std::string& code) {
  return std::any_of(c.diagnostics.begin(), c.diagnostics.end(),
                     [&](const Diagnostic& d) { return d.code == code; });
}

std::string told(const Conversion& c) {
  std::string text = to_string(c.verdict);
  for (const Diagnostic& d : c.diagnostics) text += "\n" + to_string(d);
  for (const LaserStretch& s : c.stretches)
    text += "\n" + s.clear.method + " passes " + std::to_string(s.clear.passes) + " cuts " +
            std::to_string(s.clear.cuts) + " boxes " + std::to_string(s.clear.boxes) + " " +
            s.clear.gave_up;
  return text;
}

const Check* find(const Conversion& c, const std::string& name) {
  for (const Check& check : c.checks)
    if (check.name == name) return &check;
  return nullptr;
}

bool is_clear(const Conversion& c) {
  return !c.stretches.empty() && std::all_of(c.stretches.begin(), c.stretches.end(),
                                             [](const LaserStretch& s) { return s.clear.clear; });
}

}  // namespace

#ifdef SMOOTHPOST_EXACT_ORACLE

TEST_CASE("laser_loop: a bent sheet with a post for the nozzle and a flange for the casing",
          "[postproc][pipeline][collision]") {
  if (!triangle_tree_available()) return;
  const test::ClearScene scene = test::bent_part();
  // As programmed both meet, the casing without the nozzle at some places.
  ConvertInput programmed = test::conversion_of(
      scene, {{"recipe.orientation", "programmed"}, {"recipe.optimise", "none"}});
  programmed.collision_check = false;
  const Conversion before = convert(programmed, false, {});
  INFO(told(before));
  REQUIRE(before.verdict == Verdict::certified);
  const test::DenseHits hits = test::dense_hits(before, programmed, 2);
  CHECK(hits.nozzle > 0);
  CHECK(hits.casing > 0);
  std::vector<std::size_t> alone;
  std::set_difference(hits.casing_moves.begin(), hits.casing_moves.end(), hits.nozzle_moves.begin(),
                      hits.nozzle_moves.end(), std::back_inserter(alone));
  CHECK(alone.size() > 3);

  for (const char* orientation : {"cone", "graph"}) {
    const ConvertInput in =
        test::conversion_of(scene, with(kFree, {"recipe.orientation", orientation}));
    const Conversion c = convert(in, false, {});
    INFO(orientation << " " << told(c));
    CHECK(c.verdict == Verdict::certified);
    CHECK(has(c, "KN158"));
    REQUIRE(find(c, "clearance") != nullptr);
    CHECK(find(c, "clearance")->ok);
    for (const char* name : {"lead_deviation", "tilt_deviation", "tilted_gap", "tip_deviation"}) {
      INFO(name);
      if (find(c, name) != nullptr) CHECK(find(c, name)->ok);
    }
    const test::DenseHits after = test::dense_hits(c, in);
    CHECK(after.nozzle == 0);
    CHECK(after.casing == 0);
    REQUIRE(c.stretches.size() == 1);
    const ClearanceLoopReport& r = c.stretches.front().clear;
    CHECK(r.clear);
    CHECK(r.tightest >= 0.0);
    CHECK(r.passes < 30);
    CHECK((r.method == "graph") == (orientation == std::string("graph")));
    if (r.method != "graph") {
      CHECK(r.cuts > 0);
      REQUIRE(!r.maps.empty());
      const DomainMap& map = r.maps.front();
      CHECK(map.line > 0);
      REQUIRE(map.cells.size() == map.standoffs.size());
      REQUIRE(map.cells.front().size() == map.leads.size());
      CHECK(map.cells.front().front().size() == map.tilts.size());
      // The first place is not free: some cell of it collides, some does not.
      std::string all;
      for (const auto& block : map.cells)
        for (const std::string& row : block) all += row;
      CHECK(all.find('#') != std::string::npos);
      CHECK(all.find('.') != std::string::npos);
      CHECK(c.program == convert(in, false, {}).program);
    }
  }
}

TEST_CASE("laser_loop: where nothing is admissible line and cure are named",
          "[postproc][pipeline][collision]") {
  if (!triangle_tree_available()) return;
  test::ClearScene scene = test::random_scene(1);
  scene.part = {};
  for (CutterLocation& c : scene.cut) c.axis = Vec3::UnitZ();
  test::add_quad(scene.part, {-100, -120, 0}, {160, -120, 0}, {160, 120, 0}, {-100, 120, 0});
  // Too high to go under, too near for 4 degrees.
  test::add_box(scene.part, {20, 45, 0}, {40, 48, 380}, Pose::Identity());
  const Conversion c = convert(
      test::conversion_of(scene, {{"tolerance.lead_deg", "4"}, {"tolerance.tilt_deg", "4"}}), false,
      {});
  INFO(told(c));
  CHECK(c.verdict == Verdict::refused);
  const auto d = std::find_if(c.diagnostics.begin(), c.diagnostics.end(),
                              [](const Diagnostic& one) { return one.code == "KN159"; });
  REQUIRE(d != c.diagnostics.end());
  CHECK(d->where.line > 1);
  CHECK(d->text.find("casing and part") != std::string::npos);
  CHECK(d->text.find("tolerance.tilt_deg of ") != std::string::npos);
  // The certificate still says what collides where.
  REQUIRE(find(c, "clearance") != nullptr);
  CHECK_FALSE(find(c, "clearance")->ok);
  // And the cure is one, as far as the gap of the nozzle lets it tilt.
  const double tilt = std::stod(d->text.substr(d->text.find("tilt_deg of ") + 12));
  CHECK(tilt > 4.0);
  const std::string wider = std::to_string(tilt + 2.0);
  const Conversion cured = convert(
      test::conversion_of(scene, {{"tolerance.lead_deg", "4"}, {"tolerance.tilt_deg", wider}}),
      false, {});
  INFO(told(cured));
  CHECK(is_clear(cured));
}

TEST_CASE("laser_loop: a mesh of the corpus beside a cut", "[postproc][pipeline][collision]") {
  const auto stl = test::shared_path("corpus/5_stl/mikedh/models/teapot.stl");
  if (!triangle_tree_available() || !stl) {
    WARN("no corpus: skipped");
    return;
  }
  test::ClearScene scene;
  test::add_quad(scene.part, {-100, -120, 0}, {160, -120, 0}, {160, 120, 0}, {-100, 120, 0});
  for (int i = 0; i <= 60; ++i) scene.cut.push_back({Vec3(i, 0, 1), Vec3::UnitZ()});
  // 60 x 200 x 360 mm, so near that the casing meets it.
  const TriangleMesh mesh = weld(read_stl(test::read_bytes(*stl), "teapot.stl").value().corners);
  Vec3 low = mesh.vertices.front(), high = low;
  for (const Vec3& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const auto first = static_cast<std::uint32_t>(scene.part.vertices.size());
  const Vec3 size(60, 200, 360), corner(0, 42, 0);
  for (const Vec3& v : mesh.vertices)
    scene.part.vertices.push_back(corner + (v - low).cwiseQuotient(high - low).cwiseProduct(size));
  for (const auto& t : mesh.triangles)
    scene.part.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});

  ConvertInput in = test::conversion_of(scene, kFree);
  in.collision_check = false;
  const Conversion before = convert(in, false, {});
  INFO(told(before));
  REQUIRE(before.verdict == Verdict::certified);
  CHECK(test::dense_hits(before, in, 1).casing > 0);
  in.collision_check = true;
  const Conversion after = convert(in, false, {});
  INFO(told(after));
  CHECK(after.verdict == Verdict::certified);
  CHECK(has(after, "KN158"));
  const test::DenseHits hits = test::dense_hits(after, in);
  CHECK(hits.nozzle + hits.casing == 0);
}

TEST_CASE("laser_loop: the graph without anything to meet, and via points around what is met",
          "[postproc][pipeline][collision]") {
  if (!triangle_tree_available()) return;
  ConvertInput alone =
      test::conversion_of(test::bent_part(), with(kFree, {"recipe.orientation", "graph"}));
  alone.collision_check = false;
  const Conversion free = convert(alone, false, {});
  INFO(told(free));
  CHECK(free.verdict == Verdict::certified);
  REQUIRE(free.stretches.size() == 1);
  CHECK(free.stretches.front().clear.method == "graph");
  CHECK_FALSE(has(free, "KN158"));
  REQUIRE(find(free, "lead_deviation") != nullptr);
  CHECK(find(free, "lead_deviation")->ok);

  const ConvertInput in =
      test::conversion_of(test::random_scene(106), with(kFree, {"recipe.orientation", "via"}));
  const Conversion via = convert(in, false, {});
  INFO(told(via));
  REQUIRE(is_clear(via));
  const std::string& method = via.stretches.front().clear.method;
  CHECK((method == "via" || method == "graph"));
  const test::DenseHits hits = test::dense_hits(via, in, 4);
  CHECK(hits.nozzle + hits.casing == 0);
}

namespace {

struct Tally {
  int scenes = 0, collided = 0, path = 0, reached = 0, by_loop = 0;
};

/// Scenes of consecutive seeds by the loop and by the graph.
Tally run_scenes(unsigned first, int count) {
  Tally tally;
  for (unsigned seed = first; seed < first + static_cast<unsigned>(count); ++seed) {
    const test::ClearScene scene = test::random_scene(seed);
    const ConvertInput in = test::conversion_of(scene, kFree);
    const Conversion loop = convert(in, false, {});
    const Conversion graph = convert(
        test::conversion_of(scene, with(kFree, {"recipe.orientation", "graph"})), false, {});
    INFO("seed " << seed << "\n" << told(loop) << "\ngraph: " << told(graph));
    ++tally.scenes;
    for (const Conversion* c : {&loop, &graph}) {
      if (c->verdict != Verdict::certified) continue;
      const test::DenseHits hits = test::dense_hits(*c, in);
      CHECK(hits.nozzle + hits.casing == 0);
    }
    REQUIRE((!loop.stretches.empty() || has(loop, "KN151")));
    if (!is_clear(loop) || loop.stretches.front().clear.method != "none") ++tally.collided;
    if (!is_clear(graph)) continue;
    ++tally.path;
    CHECK(is_clear(loop));
    tally.reached += is_clear(loop);
    if (is_clear(loop) && loop.stretches.front().clear.method != "graph")
      ++tally.by_loop;
    else
      WARN("seed " << seed << " by the graph");
  }
  WARN(tally.scenes << " scenes, " << tally.collided << " collide at first, " << tally.path
                    << " have a way, " << tally.reached << " reached, " << tally.by_loop
                    << " by the loop alone");
  return tally;
}

}  // namespace

TEST_CASE("laser_loop: random scenes are certified when a way exists",
          "[postproc][pipeline][collision]") {
  if (!triangle_tree_available()) return;
  const Tally tally = run_scenes(100, 12);
  CHECK(tally.collided >= 4);
  CHECK(2 * tally.path >= tally.scenes);
  CHECK(tally.reached == tally.path);
  CHECK(tally.by_loop >= tally.path - 1);
}

TEST_CASE("laser_loop: two hundred random scenes", "[postproc][pipeline][collision][slow]") {
  if (!triangle_tree_available()) return;
  const Tally tally = run_scenes(1000, 200);
  CHECK(tally.path >= 100);
  CHECK(tally.reached == tally.path);
  CHECK(tally.by_loop * 100 >= tally.path * 95);
}

#endif

namespace {

/// Quaternion interpolation between places of a path (paper B's Fig 9b): the tool axis on great
/// circles from one to the next.
std::vector<CutterLocation> quaternions(const std::vector<CutterLocation>& path,
                                        std::size_t parts) {
  std::vector<CutterLocation> out = path;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double at =
        static_cast<double>(i) * static_cast<double>(parts) / static_cast<double>(path.size() - 1);
    const auto part = std::min(static_cast<std::size_t>(at), parts - 1);
    const auto place = [&](std::size_t k) { return k * (path.size() - 1) / parts; };
    out[i].axis = great_circle(path[place(part)].axis, path[place(part + 1)].axis,
                               at - static_cast<double>(part));
  }
  return out;
}

}  // namespace

TEST_CASE("laser_loop: quaternion interpolation of Case 1 meets a wall that the loop avoids",
          "[postproc][pipeline][collision][paper]") {
  if (!triangle_tree_available()) return;
  InputSettings settings;
  settings.file_name = "case1.csv";
  auto read =
      interpret_csv(test::read_bytes(test::source_path("examples/paper_b/case1.csv")), settings);
  REQUIRE(read.ok());
  std::vector<CutterLocation> path;
  for (const PathPoint& p : read.value().path.points) path.push_back(p.location);
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = test::shipped_machine(
      "laser_5p1",
      {{"tolerance.lead_deg", "5"}, {"tolerance.tilt_deg", "5"}, {"tolerance.event_mm", "1"}});
  in.machine.power.min_cut_speed = 0.0;
  in.input_name = "case1.csv";
  const auto qi = quaternions(path, 5);
  // A wall along the middle of the cut, 3 mm too near to the casing on the way of the quaternions.
  const std::size_t middle = path.size() / 2;
  const Vec3 along = (path[middle + 40].tip - path[middle - 40].tip).normalized();
  const Vec3 side = Vec3::UnitZ().cross(along).normalized();
  double reach = -1e9;
  for (std::size_t i = middle - 15; i <= middle + 15; ++i)
    for (const double up : {160.0, 400.0})
      reach = std::max(reach, side.dot(qi[i].tip + up * qi[i].axis) + 60.0);
  Body wall;
  wall.name = "wall";
  wall.link = "workpiece";
  wall.shape = BodyShape::hull;
  for (const double s : {-10.0, 10.0})
    for (const double out : {reach - 3.0, reach + 10.0})
      for (const double up : {100.0, 500.0}) {
        Vec3 p = path[middle].tip + s * along;
        p += (out - side.dot(p)) * side;
        wall.points.push_back(p + up * Vec3::UnitZ());
      }
  in.machine.bodies.push_back(wall);
  const ScrewChain chain = chain_of(in.machine);
  auto scene = machine_scene({in.machine, chain, nullptr, nullptr, 0.0});
  REQUIRE(scene.ok());
  REQUIRE(scene.value().has_value());
  int hits = 0;
  const auto pair = RotaryPair::from(chain);
  for (const CutterLocation& c : qi) {
    const auto q = pair->solve(c, JointVector::Zero(6));
    REQUIRE(q.valid[0]);
    hits += !scene.value()->free(q.q[0]);
  }
  CHECK(hits > 3);

  const Conversion c = convert(in, false, {});
  INFO(told(c));
  CHECK(c.verdict == Verdict::certified);
  REQUIRE(find(c, "clearance") != nullptr);
  CHECK(find(c, "clearance")->ok);
  CHECK(is_clear(c));
  // Ten times as fine, by margins of their own.
  std::size_t met = 0;
  for (std::size_t i = 1; i < c.read.moves.size(); ++i) {
    if (c.read.moves[i].known != 63U || c.read.moves[i - 1].known != 63U) continue;
    for (int k = 1; k <= 10; ++k)
      met += !scene.value()->free(c.read.moves[i - 1].to +
                                  0.1 * k * (c.read.moves[i].to - c.read.moves[i - 1].to));
  }
  CHECK(met == 0);
}
