#include "postproc/pipeline/clearance_check.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "formats/mesh/stl_reader.h"
#include "kernels/core/units.h"
#include "kernels/geometry/weld.h"
#include "postproc/pipeline/convert.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

// Upright along a sheet at z = 0, 1 mm above it.
const std::string kCut =
    "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\nG0 Z1\nM62 P0\nG1 X30 F3000\nG1 Y20\n"
    "G1 X0\nM63 P0\nG0 Z50\nM429\nM30\n%\n";

void add_quad(TriangleMesh& mesh, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto at = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
  mesh.triangles.push_back({at, at + 1, at + 2});
  mesh.triangles.push_back({at, at + 2, at + 3});
}

/// A sheet in the plane z = 0, and on it a square post of 10 mm at (x, 10) up to `height`.
TriangleMesh sheet_with_post(double x, double height) {
  TriangleMesh mesh;
  add_quad(mesh, {-60, -60, 0}, {120, -60, 0}, {120, 80, 0}, {-60, 80, 0});
  const double l = x - 5, r = x + 5, f = 5, b = 15;
  add_quad(mesh, {l, f, 0}, {r, f, 0}, {r, f, height}, {l, f, height});
  add_quad(mesh, {r, f, 0}, {r, b, 0}, {r, b, height}, {r, f, height});
  add_quad(mesh, {r, b, 0}, {l, b, 0}, {l, b, height}, {r, b, height});
  add_quad(mesh, {l, b, 0}, {l, f, 0}, {l, f, height}, {l, b, height});
  add_quad(mesh, {l, f, height}, {r, f, height}, {r, b, height}, {l, b, height});
  return mesh;
}

ConvertInput prepare(std::optional<TriangleMesh> part) {
  InputSettings settings;
  settings.file_name = "part.ngc";
  settings.machine = shipped_machine("laser_5p1");
  auto read = interpret_nc(kCut, settings);
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine("laser_5p1");
  in.machine.power.min_cut_speed = 0.0;
  in.placement.translation() = Vec3(700, 600, 1000);
  in.part = std::move(part);
  in.part_name = "part.stl";
  in.input_name = "part.ngc";
  return in;
}

const Check* find(const Conversion& c, const std::string& name) {
  for (const auto& check : c.checks)
    if (check.name == name) return &check;
  return nullptr;
}

bool has_code(const Conversion& c, const char* code) {
  return std::any_of(c.diagnostics.begin(), c.diagnostics.end(),
                     [code](const Diagnostic& d) { return d.code == code; });
}

bool has(const std::vector<std::string>& names, const char* name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

TEST_CASE("clearance: a low post is passed, a high one with a longer standoff, no higher one",
          "[postproc][pipeline][collision]") {
  // The casing, 60 mm round the tool, starts 160 mm above the tip (W at 0) and goes up to 260 mm
  // with W; the tip comes to x = 30, so that the post at 70 is 35 mm away: outside of the nozzle,
  // below the casing or in it.
  const Conversion low = convert(prepare(sheet_with_post(70.0, 60.0)), false, {});
  for (const auto& d : low.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(low.verdict == Verdict::certified);
  const Check* c = find(low, "clearance");
  REQUIRE(c != nullptr);
  CHECK(c->ok);
  CHECK(c->value >= c->limit);
  CHECK_FALSE(has(low.not_checked, "clearance"));
  CHECK_FALSE(has(low.not_checked, "part_clearance"));

  CHECK_FALSE(has_code(low, "KN157"));

  const Conversion longer = convert(prepare(sheet_with_post(70.0, 200.0)), false, {});
  for (const auto& d : longer.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(longer.verdict == Verdict::certified);
  REQUIRE(find(longer, "clearance") != nullptr);
  CHECK(find(longer, "clearance")->ok);
  CHECK(has_code(longer, "KN157"));

  const Conversion high = convert(prepare(sheet_with_post(70.0, 350.0)), false, {});
  CHECK(high.verdict == Verdict::refused);
  c = find(high, "clearance");
  REQUIRE(c != nullptr);
  CHECK_FALSE(c->ok);
  CHECK(c->value < c->limit);
  CHECK(c->note.find("casing and part") != std::string::npos);
  CHECK(c->input_line >= 6);
  CHECK(c->input_line <= 12);
  CHECK(has_code(high, "CK110"));
}

TEST_CASE("clearance: without a part the machine's own bodies are checked, on request nothing",
          "[postproc][pipeline][collision]") {
  ConvertInput in = prepare({});
  // Nozzle and casing are neighbours: this machine alone has nothing to check.
  CHECK(has(convert(in, false, {}).not_checked, "clearance"));
  Body clamp;
  clamp.name = "clamp";
  clamp.link = "workpiece";
  clamp.shape = BodyShape::box;
  clamp.from = Vec3(900, 590, 1000);
  clamp.to = Vec3(910, 610, 1010);
  in.machine.bodies.push_back(clamp);
  const Conversion own = convert(in, false, {});
  CHECK(own.verdict == Verdict::certified);
  CHECK(has(own.not_checked, "part_clearance"));
  CHECK_FALSE(has(own.not_checked, "clearance"));
  CHECK(find(own, "clearance") != nullptr);

  in.part = sheet_with_post(70.0, 250.0);
  in.collision_check = false;
  const Conversion none = convert(in, false, {});
  for (const auto& d : none.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(none.verdict == Verdict::certified);
  CHECK(has(none.not_checked, "clearance"));
  CHECK(find(none, "clearance") == nullptr);
}

TEST_CASE("clearance: a fixture on the table and a foreign program are checked too",
          "[postproc][pipeline][collision]") {
  ConvertInput in = prepare(sheet_with_post(70.0, 20.0));
  const Conversion clear = convert(in, false, {});
  REQUIRE(clear.verdict == Verdict::certified);

  Body post;
  post.name = "clamp";
  post.link = "workpiece";
  post.shape = BodyShape::box;
  post.from = Vec3(725, 590, 1000);  // M: in the way of the cut
  post.to = Vec3(735, 610, 1010);
  in.machine.bodies.push_back(post);
  const Conversion blocked = convert(in, false, {});
  CHECK(blocked.verdict == Verdict::refused);
  const Check* c = find(blocked, "clearance");
  REQUIRE(c != nullptr);
  CHECK(c->note.find("nozzle and clamp") != std::string::npos);

  CheckInput check;
  check.text = clear.program;
  check.file_name = "out.ngc";
  check.machine = in.machine;
  check.placement = in.placement;
  check.part = in.part;
  const Conversion refused = check_program(check, {});
  CHECK(refused.verdict == Verdict::refused);
  REQUIRE(find(refused, "clearance") != nullptr);
  CHECK_FALSE(find(refused, "clearance")->ok);
  check.machine.bodies.pop_back();
  const Conversion passed = check_program(check, {});
  for (const auto& d : passed.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(passed.verdict == Verdict::limits_only);
  REQUIRE(find(passed, "clearance") != nullptr);
  CHECK(find(passed, "clearance")->ok);
}

namespace {

std::optional<ConvertInput> strip(const std::vector<MachineOverride>& more) {
  const auto csv = shared_path("reference/case2.csv");
  const auto stl = shared_path("reference/case2.stl");
  if (!csv || !stl) return {};
  InputSettings settings;
  settings.file_name = "case2.csv";
  auto read = interpret_csv(read_bytes(*csv), settings);
  REQUIRE(read.ok());
  std::vector<MachineOverride> overrides = {{"tolerance.lead_deg", "15"},
                                            {"tolerance.tilt_deg", "10"}};
  overrides.insert(overrides.end(), more.begin(), more.end());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine("laser_5p1", overrides);
  in.input_name = "case2.csv";
  in.part = weld(read_stl(read_bytes(*stl), "case2.stl").value().corners);
  return in;
}

/// Least distance of the part's vertices to the casing of the machine file, 60 mm round the tool's
/// line from 160 to 400 mm behind where the axes of B and C cross, at the ends of the text's moves.
double casing_distance(const Conversion& c, const TriangleMesh& part) {
  double least = INFINITY;
  for (const ReadBackMove& m : c.read.moves) {
    if (m.known != 63U) continue;
    const Mat3 turn =
        rotation_about(Vec3::UnitZ(), m.to[3]) * rotation_about(Vec3::UnitY(), m.to[4]);
    for (const Vec3& v : part.vertices) {
      const Vec3 local = turn.transpose() * (v - m.to.head<3>());
      const double out = std::max(0.0, std::hypot(local.x(), local.y()) - 60.0);
      const double along = std::max({0.0, 160.0 - local.z(), local.z() - 400.0});
      least = std::min(least, std::hypot(out, along));
    }
  }
  return least;
}

}  // namespace

TEST_CASE(
    "clearance: the strip of paper B's Case 2 meets the casing unless it is moved out of the way",
    "[postproc][pipeline][collision][paper]") {
  const auto in = strip({});
  if (!in) {
    WARN("no reference files: skipped");
    return;
  }
  auto unchecked = *in;
  unchecked.collision_check = false;
  CHECK(casing_distance(convert(unchecked, false, {}), *in->part) == 0.0);

  const Conversion freed = convert(*in, false, {});
  for (const auto& d : freed.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(freed.verdict == Verdict::certified);
  REQUIRE(find(freed, "clearance") != nullptr);
  CHECK(find(freed, "clearance")->ok);
  CHECK(casing_distance(freed, *in->part) >= 2.0);
  CHECK(has_code(freed, "KN158"));

  // Without a stroke of the standoff the tool axis alone gives way.
  const auto fixed =
      strip({{"axis.W.min_mm", "-5"}, {"tolerance.lead_deg", "4"}, {"tolerance.tilt_deg", "1"}});
  const Conversion turned = convert(*fixed, false, {});
  for (const auto& d : turned.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(turned.verdict == Verdict::certified);
  CHECK(casing_distance(turned, *in->part) >= 2.0);
  CHECK(has_code(turned, "KN158"));
}
