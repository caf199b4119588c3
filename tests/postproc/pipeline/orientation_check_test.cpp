#include "postproc/pipeline/orientation_check.h"

#include <catch2/catch.hpp>

#include "kernels/core/units.h"
#include "postproc/pipeline/tool_motion.h"
#include "postproc/pipeline/verify.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

constexpr double kLead = 15.0, kTilt = 10.0, kThickness = 1.5;  // of the laser below, deg and mm

MachineDefinition laser(std::vector<MachineOverride> overrides = {}) {
  std::vector<MachineOverride> all = {
      {"recipe.orientation", "cone"},    {"recipe.optimise", "jerk"},
      {"tolerance.lead_deg", "15"},      {"tolerance.tilt_deg", "10"},
      {"workpiece.thickness_mm", "1.5"}, {"tool.gap_mm", "1"},
      {"tool.land_radius_mm", "2"},      {"tool.min_gap_mm", "0.4"}};
  all.insert(all.end(), overrides.begin(), overrides.end());
  return shipped_machine("laser_5p1", all);
}

/// A sheet in the plane z = 0 of W.
TriangleTree sheet() {
  TriangleMesh mesh;
  mesh.vertices = {{-500, -500, 0}, {500, -500, 0}, {500, 500, 0}, {-500, 500, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  auto tree = build_triangle_tree(mesh);
  REQUIRE(tree.ok());
  return std::move(tree.value());
}

/// The input goes straight along `way` with its axis along Z, tip 1 mm above the sheet; the output
/// goes the same way with the rotary axes at c and b all along: its axis is
/// (sin b cos c, sin b sin c, cos b).
struct Held {
  MachineDefinition machine = laser();
  Vec3 way = Vec3(20, 0, 0);
  double c_deg = 0.0, b_deg = 0.0;
  double off_along_axis = 0.0;  // mm, of the output's tip
  const TriangleTree* part = nullptr;
  bool beam = true;

  Checks checks() const {
    PathMaker maker(Vec3(0, 0, 1));
    if (beam) maker.event("beam_on");
    maker.feed(Vec3(0, 0, 1) + way);
    const ToolPath path = maker.take();
    const ReferencePath reference(path, {});
    const ScrewChain chain = chain_of(machine);
    JointVector q = home_of(machine);
    q[3] = radians_from_degrees(c_deg);
    q[4] = radians_from_degrees(b_deg);
    const CutterLocation at = forward_location(chain, q);
    q.head<3>() += Vec3(0, 0, 1) + off_along_axis * at.axis - at.tip;
    ReadBack read;
    MachineProgram planned;
    LineMap map;
    for (std::uint32_t i = 0; i < 2; ++i) {
      ReadBackMove move;
      move.to = q;
      move.known = 63;
      move.line = 11 + i;
      move.beam = beam && i == 1;
      move.rapid = i == 0;
      if (i == 1) move.to.head<3>() += way;
      move.duration = i;
      read.moves.push_back(move);
      MachineMove plan;
      plan.to = move.to;
      plan.joints = 63;
      planned.moves.push_back(plan);
      map.push_back({move.line, i == 0 ? 0 : path.points[1].line,
                     i == 0 ? MoveRole::link : MoveRole::path, i, i, 0.0, 1.0});
    }
    DeviationInput with{reference, map, planned, chain};
    with.orientation = orientation_input(machine, reference, {{1, 1, 1}}, part);
    return verify_deviation(read, machine, with, {});
  }
};

const Check* find(const Checks& checks, const std::string& name) {
  for (const auto& c : checks)
    if (c.name == name) return &c;
  return nullptr;
}

Check get(const Checks& checks, const std::string& name) {
  const Check* c = find(checks, name);
  INFO(name);
  REQUIRE(c != nullptr);
  return *c;
}

}  // namespace

TEST_CASE("orientation_check: a lead that is known by hand", "[postproc][pipeline]") {
  Held held;
  held.b_deg = 12.0;
  const Checks checks = held.checks();
  CHECK(find(checks, "axis_deviation") == nullptr);
  const Check lead = get(checks, "lead_deviation");
  CHECK(lead.value == Approx(12.0).epsilon(1e-9));
  CHECK(lead.limit == Approx(kLead));
  CHECK(lead.unit == "deg");
  CHECK(lead.ok);
  CHECK(get(checks, "tilt_deviation").value == Approx(0.0).margin(1e-9));
  CHECK(get(checks, "exit_edge_deviation").value == Approx(0.0).margin(1e-9));
  CHECK(get(checks, "tip_deviation").ok);
  CHECK(get(checks, "standoff_deviation").ok);
}

TEST_CASE("orientation_check: a tilt that is known by hand", "[postproc][pipeline]") {
  Held held;
  held.way = Vec3(0, 20, 0);
  held.b_deg = -9.0;
  const Checks checks = held.checks();
  CHECK(get(checks, "tilt_deviation").value == Approx(9.0).epsilon(1e-9));
  CHECK(get(checks, "tilt_deviation").ok);
  CHECK(get(checks, "lead_deviation").value == Approx(0.0).margin(1e-9));
  const Check edge = get(checks, "exit_edge_deviation");
  CHECK(edge.value == Approx(kThickness * std::tan(radians_from_degrees(9.0))));
  CHECK(edge.limit == Approx(kThickness * std::tan(radians_from_degrees(kTilt))));
  CHECK(edge.unit == "mm");
  CHECK(edge.ok);
}

TEST_CASE("orientation_check: lead and tilt together", "[postproc][pipeline]") {
  // An axis of slopes tan(14) along and tan(8) across the way.
  const double along = std::tan(radians_from_degrees(14.0));
  const double across = std::tan(radians_from_degrees(8.0));
  Held held;
  held.b_deg = degrees_from_radians(std::atan(std::hypot(along, across)));
  held.c_deg = degrees_from_radians(std::atan2(across, along));
  const Checks checks = held.checks();
  CHECK(get(checks, "lead_deviation").value == Approx(14.0).epsilon(1e-9));
  CHECK(get(checks, "tilt_deviation").value == Approx(8.0).epsilon(1e-9));
  CHECK(get(checks, "tilted_gap").value ==
        Approx(std::cos(radians_from_degrees(held.b_deg)) -
               2.0 * std::sin(radians_from_degrees(held.b_deg))));
}

TEST_CASE("orientation_check: beyond a limit the check fails with its lines",
          "[postproc][pipeline]") {
  Held held;
  held.b_deg = 15.1;
  const Check lead = get(held.checks(), "lead_deviation");
  CHECK_FALSE(lead.ok);
  CHECK(lead.value == Approx(15.1).epsilon(1e-9));
  CHECK(lead.output_line == 12);
  CHECK(lead.input_line == 3);
  held.way = Vec3(0, 20, 0);
  held.b_deg = 10.1;
  CHECK_FALSE(get(held.checks(), "tilt_deviation").ok);
  CHECK_FALSE(get(held.checks(), "exit_edge_deviation").ok);
  held.b_deg = 9.0;
  held.machine.tolerance.exit_edge = 0.2;
  const Check edge = get(held.checks(), "exit_edge_deviation");
  CHECK(edge.limit == 0.2);
  CHECK_FALSE(edge.ok);
  CHECK(edge.output_line == 12);
}

TEST_CASE("orientation_check: what has no freedom of its own is kept as an axis is",
          "[postproc][pipeline]") {
  Held held;
  held.machine = laser({{"tolerance.lead_deg", "0"}});
  held.b_deg = 0.04;  // axis_deg is 0.05
  CHECK(get(held.checks(), "lead_deviation").limit == Approx(0.05));
  CHECK(get(held.checks(), "lead_deviation").ok);
  held.b_deg = 0.06;
  CHECK_FALSE(get(held.checks(), "lead_deviation").ok);
}

TEST_CASE("orientation_check: the axis counts where nothing is freed", "[postproc][pipeline]") {
  Held held;
  held.machine = laser({{"tolerance.lead_deg", "0"}, {"tolerance.tilt_deg", "0"}});
  held.b_deg = 12.0;
  const Checks checks = held.checks();
  CHECK(get(checks, "axis_deviation").value == Approx(12.0).epsilon(1e-9));
  CHECK_FALSE(get(checks, "axis_deviation").ok);
  CHECK(find(checks, "lead_deviation") == nullptr);
  CHECK(find(checks, "tilted_gap") == nullptr);
  CHECK_FALSE(orientation_is_free(held.machine));
  CHECK(orientation_is_free(laser()));
  CHECK_FALSE(orientation_is_free(laser({{"recipe.orientation", "programmed"}})));
}

TEST_CASE("orientation_check: the gap of a tilted nozzle over its part", "[postproc][pipeline]") {
  const TriangleTree tree = sheet();
  Held held;
  held.part = &tree;
  for (const bool free : {true, false}) {
    if (!free) held.machine.recipe.orientation = "programmed";
    held.b_deg = 14.0;
    const Check gap = get(held.checks(), "tilted_gap");
    // [Ding2025] land of 2 mm at a gap of 1 mm: g·cos t − r·sin t.
    CHECK(gap.value == Approx(0.970296 - 2.0 * 0.241922).epsilon(1e-5));
    CHECK(gap.limit == 0.4);
    CHECK(gap.ok);
    CHECK(gap.note.empty());
    held.b_deg = 17.0;
    CHECK_FALSE(get(held.checks(), "tilted_gap").ok);
    CHECK(get(held.checks(), "tilted_gap").output_line == 12);
  }
  held.beam = false;
  CHECK(find(held.checks(), "tilted_gap") == nullptr);
  held.beam = true;
  held.part = nullptr;
  CHECK(find(held.checks(), "tilted_gap") == nullptr);
  held.machine = laser();
  CHECK_FALSE(get(held.checks(), "tilted_gap").note.empty());  // N is the programmed axis
  held.machine = laser({{"tool.land_radius_mm", "0"}});
  CHECK(find(held.checks(), "tilted_gap") == nullptr);
}

TEST_CASE("orientation_check: a standoff that moves the tip is found", "[postproc][pipeline]") {
  Held held;
  held.b_deg = 10.0;
  held.off_along_axis = 0.008;
  CHECK(get(held.checks(), "standoff_deviation").value == Approx(0.008).epsilon(1e-6));
  CHECK(get(held.checks(), "standoff_deviation").ok);
  held.off_along_axis = -0.022;
  CHECK_FALSE(get(held.checks(), "standoff_deviation").ok);
  held.off_along_axis = 0.0;
  held.machine.standoff.axis.clear();
  CHECK(find(held.checks(), "standoff_deviation") == nullptr);
}

TEST_CASE("orientation_check: values hold between samples where the way turns",
          "[postproc][pipeline]") {
  // Axis leaning along X by 10 deg all along a quarter of a circle: lead goes from 0 to 10 deg and
  // tilt back, as (s, c) of the turning angle.
  const MachineDefinition machine = laser();
  const ToolPath path = PathMaker({5, 0, 0}).arc({0, 0, 0}, kPi / 2).take();
  const ReferencePath reference(path, {});
  const auto input = orientation_input(machine, reference, {{1, 1, 1}}, nullptr);
  REQUIRE(input.has_value());
  for (const int steps : {8, 40}) {
    OrientationCheck check(machine, *input);
    check.begin();
    CHECK(check.least_steps(reference.length(1)) == 32);  // 7.854 mm by 0.25 mm
    const double b = radians_from_degrees(10.0);
    for (int i = 0; i <= steps; ++i)
      check.see({{1, static_cast<double>(i) / steps}, Vec3(std::sin(b), 0, std::cos(b))});
    const Checks checks = check.checks();
    CHECK(get(checks, "lead_deviation").value >= 10.0 - 0.05);  // T at the end is one-sided
    CHECK(get(checks, "lead_deviation").value <= 10.0 + (steps == 8 ? 0.1 : 0.01));
    CHECK(get(checks, "tilt_deviation").value >= 10.0 - 0.05);
  }
  OrientationCheck none(machine, *input);
  CHECK_FALSE(none.covers(0));
  CHECK_FALSE(none.covers(2));
  CHECK(none.frees(1));
}

TEST_CASE("orientation_check: an axis that lies down is no number to pass over",
          "[postproc][pipeline]") {
  Held held;
  held.way = Vec3(0, 20, 0);
  held.b_deg = 90.0;
  const Check edge = get(held.checks(), "exit_edge_deviation");
  CHECK_FALSE(edge.ok);
}
