#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <random>

#include "kernels/core/units.h"
#include "machines/definition/machine_file.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

MachineDefinition load_text(const std::string& text, const std::string& name) {
  const auto result = parse_machine_file(text, name);
  std::string all;
  for (const auto& diagnostic : result.diagnostics()) all += to_string(diagnostic) + "\n";
  INFO(all);
  REQUIRE(result.ok());
  return result.value();
}

MachineDefinition load(const std::filesystem::path& path) {
  return load_text(test::read_bytes(path), path.string());
}

MachineDefinition shipped(const std::string& name) {
  return load(test::source_path("machines/" + name + "/machine.toml"));
}

const AxisDefinition& axis(const MachineDefinition& machine, const std::string& name) {
  const int index = machine.axis_by_name(name);
  REQUIRE(index >= 0);
  return machine.axes[static_cast<std::size_t>(index)];
}

bool within(double value, const AxisDefinition& a) {
  return value >= a.joint.lower && value <= a.joint.upper;
}

/// Home and retract position are inside the axes' ranges.
bool within_ranges(const MachineDefinition& machine) {
  for (const AxisDefinition& a : machine.axes)
    if (!within(a.joint.home, a)) return false;
  return machine.links.retract_axis.empty() ||
         within(machine.links.retract, axis(machine, machine.links.retract_axis));
}

}  // namespace

TEST_CASE("machine files: every machine.toml of the tree loads without a message",
          "[machines][definition]") {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::source_path("machines"))) {
    const auto file = entry.path() / "machine.toml";
    if (!std::filesystem::exists(file)) continue;
    INFO(file.string());
    const MachineDefinition machine = load(file);
    CHECK(parse_machine_file(test::read_bytes(file), "m").diagnostics().empty());
    CHECK(machine.name == entry.path().filename().string());
    CHECK(std::filesystem::exists(entry.path() / "README.md"));
    CHECK(within_ranges(machine));
    ++count;
  }
  CHECK(count >= 9);
}

TEST_CASE("machine files: the example of docs/machine_file.md loads and shows every key",
          "[machines][definition]") {
  const std::string page = test::read_bytes(test::source_path("docs/machine_file.md"));
  const std::size_t start = page.find("```toml\nschema");
  REQUIRE(start != std::string::npos);
  const std::size_t first = start + std::string("```toml\n").size();
  const std::size_t end = page.find("```", first);
  REQUIRE(end != std::string::npos);
  const std::string example = page.substr(first, end - first);
  const MachineDefinition machine = load_text(example, "docs/machine_file.md");
  CHECK(machine.size() == 6);
  CHECK(machine.axes[5].joint.side == ChainSide::workpiece);
  CHECK(parse_machine_file(example, "m").diagnostics().empty());

  // Every key that a table row of the page introduces stands in the example.
  int keys = 0;
  for (std::size_t at = page.find("\n| `"); at != std::string::npos && at < start;
       at = page.find("\n| `", at + 1)) {
    const std::string row = page.substr(at + 3, page.find(" |", at + 3) - at - 3);
    for (std::size_t tick = row.find('`'); tick != std::string::npos;) {
      const std::size_t close = row.find('`', tick + 1);
      REQUIRE(close != std::string::npos);
      std::string key = row.substr(tick + 1, close - tick - 1);
      key = key.substr(key.rfind('.') + 1);
      INFO(key);
      CHECK(example.find(key + " = ") != std::string::npos);
      ++keys;
      tick = row.find('`', close + 1);
    }
  }
  CHECK(keys >= 60);
}

TEST_CASE("machine files: the design example loads", "[machines][definition]") {
  const auto path = test::shared_path("design/machine_example.toml");
  if (!path) {
    WARN("no shared reference material: skipped");
    return;
  }
  const MachineDefinition machine = load(*path);
  CHECK(machine.name == "laser_5p1");
  CHECK(machine.size() == 6);
  CHECK(machine.process.events.size() == 8);
  CHECK(machine.links.rapid == RapidMotion::independent);
  CHECK(machine.recipe.smoothing == "acr");
}

TEST_CASE("laser_5p1: the limits of paper B, Table 2", "[machines][definition][paper]") {
  const MachineDefinition machine = shipped("laser_5p1");
  struct Row {
    const char* name;
    double lower, upper, velocity, acceleration, jerk;
  };
  // The table prints metres and radians.
  const Row rows[] = {{"X", 0.0, 1600.0, 2e3, 12e3, 120e3},  {"Y", 0.0, 1400.0, 2e3, 12e3, 120e3},
                      {"Z", 0.0, 3000.0, 2e3, 12e3, 120e3},  {"C", -2 * kPi, 2 * kPi, 10, 80, 200},
                      {"B", -kPi / 2, kPi / 2, 10, 80, 200}, {"W", -100, 20, 2e3, 40e3, 400e3}};
  const JointLimits limits = limits_of(machine);
  REQUIRE(machine.size() == 6);
  for (int i = 0; i < 6; ++i) {
    INFO(rows[i].name);
    CHECK(machine.axes[static_cast<std::size_t>(i)].name == rows[i].name);
    CHECK(limits.lower[i] == Approx(rows[i].lower).epsilon(1e-14));
    CHECK(limits.upper[i] == Approx(rows[i].upper).epsilon(1e-14));
    CHECK(limits.velocity[i] == Approx(rows[i].velocity).epsilon(1e-14));
    CHECK(limits.acceleration[i] == Approx(rows[i].acceleration).epsilon(1e-14));
    CHECK(limits.jerk[i] == Approx(rows[i].jerk).epsilon(1e-14));
  }
  CHECK(axis(machine, "W").joint.redundant);
  CHECK(machine.standoff.axis == "W");
  CHECK(machine.standoff.following == Following::additive);
  CHECK_FALSE(axis(machine, "C").joint.cyclic);
}

TEST_CASE("laser_5p1: tip = (q1, q2, q3) - (L0 - q6) O with L0 = 0",
          "[machines][definition][paper]") {
  const MachineDefinition machine = shipped("laser_5p1");
  const ScrewChain chain = chain_of(machine);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    JointVector q(6);
    for (int j = 0; j < 6; ++j) q[j] = uniform(random) * (j == 3 || j == 4 ? 1.5 : 500.0);
    const CutterLocation location = forward_location(chain, q);
    const Vec3 axis_out(std::cos(q[3]) * std::sin(q[4]), std::sin(q[3]) * std::sin(q[4]),
                        std::cos(q[4]));
    CHECK((location.axis - axis_out).norm() < 1e-12);
    CHECK((location.tip - (q.head<3>() + q[5] * axis_out)).norm() < 1e-9);
  }
}

TEST_CASE("laser_5p1_offset: laser_5p1 with a head that has lengths",
          "[machines][definition][paper]") {
  const MachineDefinition machine = shipped("laser_5p1_offset");
  const MachineDefinition plain = shipped("laser_5p1");
  const ScrewChain chain = chain_of(machine);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    JointVector q(6);
    for (int j = 0; j < 6; ++j) q[j] = uniform(random) * (j == 3 || j == 4 ? 1.5 : 500.0);
    const Mat3 c = rotation_about(Vec3::UnitZ(), q[3]);
    const Mat3 b = rotation_about(Vec3::UnitY(), q[4]);
    const Vec3 tip = q.head<3>() + c * (Vec3(30, 0, 0) + b * Vec3(-30, 0, q[5] - 200));
    const CutterLocation location = forward_location(chain, q);
    CHECK((location.axis - c * b * Vec3::UnitZ()).norm() < 1e-12);
    CHECK((location.tip - tip).norm() < 1e-9);
  }
  for (const AxisDefinition& a : plain.axes) {
    INFO(a.name);
    const AxisDefinition& other = axis(machine, a.name);
    CHECK(other.joint.lower == a.joint.lower);
    CHECK(other.joint.upper == a.joint.upper);
    CHECK(other.velocity == a.velocity);
    CHECK(other.acceleration == a.acceleration);
    CHECK(other.jerk == a.jerk);
  }
}

TEST_CASE("robot_6r: ranges and speeds of the data sheet", "[machines][definition]") {
  const MachineDefinition machine = shipped("robot_6r");
  struct Row {
    const char* name;
    double lower, upper, velocity;
  };
  const Row rows[] = {{"A1", -185, 185, 128}, {"A2", -135, 35, 102},  {"A3", -120, 158, 128},
                      {"A4", -350, 350, 260}, {"A5", -119, 119, 245}, {"A6", -350, 350, 322}};
  REQUIRE(machine.size() == 6);
  for (const Row& row : rows) {
    INFO(row.name);
    const AxisDefinition& a = axis(machine, row.name);
    CHECK(degrees_from_radians(a.joint.lower) == Approx(row.lower).epsilon(1e-14));
    CHECK(degrees_from_radians(a.joint.upper) == Approx(row.upper).epsilon(1e-14));
    CHECK(degrees_from_radians(a.velocity) == Approx(row.velocity).epsilon(1e-14));
    CHECK_FALSE(a.joint.redundant);
  }
  CHECK(machine.dialect.name == "krl");
  CHECK(machine.recipe.kind == "robot");
}

TEST_CASE("table-table machines: the table turns as LinuxCNC's trt kinematics says",
          "[machines][definition]") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const bool tilts_a : {true, false}) {
    const MachineDefinition machine = shipped(tilts_a ? "table_table_ac" : "table_table_bc");
    const double length = 37.5;
    const ScrewChain chain = chain_of(machine, length);
    for (int i = 0; i < 1000; ++i) {
      const Vec3 tip = 100.0 * Vec3(uniform(random), uniform(random), uniform(random));
      const double tilt = 1.7 * uniform(random);
      const double c = 6.0 * uniform(random);
      // trtfuncs.c, offsets 0: joints of the point, then the tool length on top.
      const double x = std::cos(c) * tip.x() - std::sin(c) * tip.y();
      const double y = std::sin(c) * tip.x() + std::cos(c) * tip.y();
      JointVector q(5);
      if (tilts_a)
        q << x, std::cos(tilt) * y - std::sin(tilt) * tip.z(),
            std::sin(tilt) * y + std::cos(tilt) * tip.z() + length, tilt, c;
      else
        q << std::cos(tilt) * x + std::sin(tilt) * tip.z(), y,
            -std::sin(tilt) * x + std::cos(tilt) * tip.z() + length, tilt, c;
      CHECK((forward_location(chain, q).tip - tip).norm() < 1e-9);
    }
  }
}

TEST_CASE(
    "table-table machines: a part of 100 mm around the centre is reached up to 90 deg of tilt",
    "[machines][definition]") {
  std::mt19937 random(13);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int tested = 0;
  for (const bool tilts_a : {true, false}) {
    const MachineDefinition machine = shipped(tilts_a ? "table_table_ac" : "table_table_bc");
    const AxisDefinition& tilt_axis = axis(machine, tilts_a ? "A" : "B");
    const Vec3 about = tilts_a ? Vec3::UnitX() : Vec3::UnitY();
    for (int i = 0; i < 10000; ++i) {
      const Vec3 tip = 100.0 * Vec3(uniform(random), uniform(random), uniform(random));
      const double tilt = -kPi / 4 * (uniform(random) + 1.0);
      const double c = kPi * uniform(random);
      const double length = 75.0 * (uniform(random) + 1.0);
      const Vec3 p = rotation_about(about, tilt) * rotation_about(Vec3::UnitZ(), c) * tip;
      const bool reached = within(p.x(), axis(machine, "X")) && within(p.y(), axis(machine, "Y")) &&
                           within(p.z() + length, axis(machine, "Z")) && within(tilt, tilt_axis) &&
                           within(c, axis(machine, "C"));
      if (!reached) FAIL("tilt " << tilt << " C " << c << " tip " << tip.transpose());
      ++tested;
    }
    CHECK(within(radians_from_degrees(-75.0), tilt_axis));
    CHECK(within(radians_from_degrees(270.0), axis(machine, "C")));
    CHECK(axis(machine, "C").joint.cyclic);
  }
  CHECK(tested == 20000);
}

TEST_CASE("shipped machines: a laser knows no milling words and a mill no beam",
          "[machines][definition]") {
  for (const char* laser_name : {"laser_5p1", "laser_5p1_offset"}) {
    const MachineDefinition laser = shipped(laser_name);
    for (const char* event : {"spindle_on", "spindle_on_reverse", "spindle_off", "coolant_on",
                              "coolant_mist", "coolant_off", "tool_change"}) {
      INFO(event);
      CHECK_FALSE(laser.has_event(event));
    }
    for (const char* event : {"beam_on", "beam_off", "pierce", "power", "gas_on", "follow_on"}) {
      INFO(event);
      CHECK(laser.has_event(event));
    }
  }
  for (const char* name : {"table_table_ac", "table_table_bc", "table_table_b45c", "head_table_bc",
                           "head_head_ca", "finish_2p2r_1p1r", "robot_6r"}) {
    INFO(name);
    const MachineDefinition mill = shipped(name);
    for (const char* event : {"spindle_on", "spindle_on_reverse", "spindle_off", "coolant_on",
                              "coolant_off", "tool_change"})
      CHECK(mill.has_event(event));
    for (const char* event : {"beam_on", "beam_off", "pierce", "power", "gas_on", "follow_on"})
      CHECK_FALSE(mill.has_event(event));
  }
}
