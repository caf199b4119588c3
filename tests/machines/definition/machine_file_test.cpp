#include "machines/definition/machine_file.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "formats/toml/toml.h"
#include "kernels/core/units.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

const char* const kBase =
    "schema = 1\n"
    "name = \"m\"\n"
    "[[axis]]\n"
    "name = \"X\"\n"
    "letter = \"X\"\n"
    "type = \"linear\"\n"
    "chain = \"tool\"\n"
    "direction = [1, 0, 0]\n"
    "min_mm = -10\n"
    "max_mm = 20.5\n"
    "max_velocity_mm_per_s = 30\n"
    "max_acceleration_mm_per_s2 = 40\n"
    "max_jerk_mm_per_s3 = 50\n"
    "source = \"datasheet\"\n"
    "[[axis]]\n"
    "name = \"tilt\"\n"
    "letter = \"B\"\n"
    "type = \"rotary\"\n"
    "chain = \"workpiece\"\n"
    "direction = [0, 3, 4]\n"
    "origin_mm = [1, 2, 3]\n"
    "min_deg = -90\n"
    "max_deg = 180\n"
    "home = 45\n"
    "cyclic = true\n"
    "max_velocity_deg_per_s = 60\n"
    "max_acceleration_deg_per_s2 = 120\n"
    "max_jerk_deg_per_s3 = 240\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  REQUIRE(text.find(from, at + 1) == std::string::npos);
  return text.replace(at, from.size(), to);
}

/// Line and column of the only place where `marker` stands.
SourceLocation place_of(const std::string& text, const std::string& marker) {
  const std::size_t at = text.find(marker);
  REQUIRE(at != std::string::npos);
  REQUIRE(text.find(marker, at + 1) == std::string::npos);
  SourceLocation where{"m.toml", 1, 1};
  for (std::size_t i = 0; i < at; ++i) {
    ++where.column;
    if (text[i] == '\n') {
      ++where.line;
      where.column = 1;
    }
  }
  return where;
}

std::string listing(const Diagnostics& diagnostics) {
  std::string all;
  for (const auto& diagnostic : diagnostics) all += to_string(diagnostic) + "\n";
  return all;
}

/// The file gives exactly one message, with that code, at the place `shift` bytes into `marker`.
void check_error(const std::string& text, const char* code, const std::string& marker,
                 int shift = 0) {
  const auto result = parse_machine_file(text, "m.toml");
  INFO(text);
  INFO(listing(result.diagnostics()));
  CHECK_FALSE(result.ok());
  REQUIRE(result.diagnostics().size() == 1);
  const Diagnostic& found = result.diagnostics()[0];
  const SourceLocation expected = place_of(text, marker);
  CHECK(found.code == code);
  CHECK(found.severity == Severity::error);
  CHECK(found.where.file == "m.toml");
  CHECK(found.where.line == expected.line);
  CHECK(found.where.column == expected.column + shift);
  CHECK_FALSE(found.text.empty());
}

/// The same for a value: `line` is "key = value" and the error is at the value.
void check_value(const std::string& text, const char* code, const std::string& line) {
  check_error(text, code, line, static_cast<int>(line.find(" = ")) + 3);
}

std::string base_with(const std::string& from, const std::string& to) {
  return replaced(kBase, from, to);
}

std::string base_and(const std::string& more) { return kBase + more; }

MachineDefinition parse(const std::string& text,
                        const std::vector<MachineOverride>& overrides = {}) {
  const auto result = parse_machine_file(text, "m.toml", overrides);
  INFO(listing(result.diagnostics()));
  REQUIRE(result.ok());
  return result.value();
}

std::string first_text(const std::string& text) {
  const auto result = parse_machine_file(text, "m.toml");
  REQUIRE_FALSE(result.diagnostics().empty());
  return result.diagnostics()[0].text;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("machine file: units become mm, rad and s", "[machines][definition]") {
  const MachineDefinition m = parse(base_and(
      "[tool]\ntip_mm = [1, 2, 3]\naxis = [0, 0, 2]\ngap_mm = 1\nland_radius_mm = 2\nmin_gap_mm = "
      "0.5\n"
      "[workpiece]\nframe = { xyz_mm = [4, 5, 6], rpy_deg = [10, 20, 30] }\nthickness_mm = 1.5\n"
      "[cycle]\ntime_ms = 2\nmin_block_ms = 5\nlook_ahead_blocks = 7\n"
      "[links]\nclearance_mm = 8\nretract_axis = \"X\"\nretract_mm = 20\nrotation_deg = 9\n"
      "rapid = \"independent\"\n"
      "[tolerance]\ntip_mm = 0.02\naxis_deg = 0.1\nlead_deg = 2\ntilt_deg = 3\nclearance_mm = 4\n"
      "limit_share = 0.9\n"
      "[dialect]\nunits = \"inch\"\ndigits_inch = 4\ndigits_mm = 3\ndigits_deg = 2\nblock_ms = 25\n"
      "start = [\"G21\", \"G90\"]\nend = [\"M2\"]\nline_numbers = false\noffset_guard = false\n"
      "path_mode = \"blend\"\n"));
  REQUIRE(m.size() == 2);
  CHECK(m.axes[0].letter == 'X');
  CHECK(m.axes[0].joint.kind == JointKind::linear);
  CHECK(m.axes[0].joint.side == ChainSide::tool);
  CHECK(m.axes[0].source == LimitSource::datasheet);
  CHECK(m.axes[1].joint.kind == JointKind::rotary);
  CHECK(m.axes[1].joint.side == ChainSide::workpiece);
  CHECK(m.axes[1].source == LimitSource::assumed);
  CHECK((m.axes[1].joint.direction - Vec3(0, 0.6, 0.8)).norm() < 1e-15);
  CHECK(m.axes[1].joint.origin == Vec3(1, 2, 3));
  CHECK(m.axes[1].joint.cyclic);
  CHECK_FALSE(m.axes[1].joint.redundant);
  const JointLimits limits = limits_of(m);
  CHECK(limits.lower[0] == -10.0);
  CHECK(limits.upper[0] == 20.5);
  CHECK(limits.velocity[0] == 30.0);
  CHECK(limits.acceleration[0] == 40.0);
  CHECK(limits.jerk[0] == 50.0);
  CHECK(limits.lower[1] == Approx(-kPi / 2));
  CHECK(limits.upper[1] == Approx(kPi));
  CHECK(limits.velocity[1] == Approx(kPi / 3));
  CHECK(limits.acceleration[1] == Approx(2 * kPi / 3));
  CHECK(limits.jerk[1] == Approx(4 * kPi / 3));
  CHECK(home_of(m)[0] == 0.0);
  CHECK(home_of(m)[1] == Approx(kPi / 4));
  CHECK(m.tool.axis == Vec3(0, 0, 1));
  CHECK(m.tool.gap == 1.0);
  CHECK(m.tool.land_radius == 2.0);
  CHECK(m.tool.min_gap == 0.5);
  CHECK(m.workpiece.frame.translation() == Vec3(4, 5, 6));
  const auto rad = [](double degrees) { return degrees * kPi / 180; };
  const Mat3 rotation =
      (Eigen::AngleAxisd(rad(30), Vec3::UnitZ()) * Eigen::AngleAxisd(rad(20), Vec3::UnitY()) *
       Eigen::AngleAxisd(rad(10), Vec3::UnitX()))
          .toRotationMatrix();
  CHECK((m.workpiece.frame.linear() - rotation).norm() < 1e-14);
  CHECK(m.workpiece.thickness == 1.5);
  CHECK(m.cycle.time == Approx(0.002));
  CHECK(m.cycle.min_block == Approx(0.005));
  CHECK(m.cycle.look_ahead_blocks == 7);
  CHECK(m.links.clearance == 8.0);
  CHECK(m.links.retract_axis == "X");
  CHECK(m.links.retract == 20.0);
  CHECK(m.links.rotation == Approx(rad(9)));
  CHECK(m.links.rapid == RapidMotion::independent);
  CHECK(m.tolerance.tip == 0.02);
  CHECK(m.tolerance.axis == Approx(rad(0.1)));
  CHECK(m.tolerance.lead == Approx(rad(2)));
  CHECK(m.tolerance.tilt == Approx(rad(3)));
  CHECK(m.tolerance.clearance == 4.0);
  CHECK(m.tolerance.limit_share == 0.9);
  CHECK(m.dialect.units == "inch");
  CHECK(m.dialect.digits_length == 4);
  CHECK(m.dialect.digits_angle == 2);
  CHECK(m.dialect.block_time == Approx(0.025));
  CHECK(m.dialect.start == std::vector<std::string>{"G21", "G90"});
  CHECK(m.dialect.end == std::vector<std::string>{"M2"});
  CHECK_FALSE(m.dialect.line_numbers);
  CHECK_FALSE(m.dialect.offset_guard);
  CHECK(m.dialect.path_mode == "blend");
  CHECK(m.axis_by_letter('B') == 1);
  CHECK(m.axis_by_letter('C') == -1);
  CHECK(m.axis_by_name("tilt") == 1);
  CHECK(m.axis_by_name("B") == -1);
}

TEST_CASE("machine file: documented defaults", "[machines][definition]") {
  const MachineDefinition m = parse(kBase);
  CHECK(m.description.empty());
  CHECK(m.tool.tip == Vec3::Zero());
  CHECK(m.tool.axis == Vec3::UnitZ());
  CHECK(m.workpiece.frame.matrix() == Pose::Identity().matrix());
  CHECK(m.bodies.empty());
  CHECK(m.cycle.time == Approx(0.001));
  CHECK(m.cycle.min_block == Approx(0.004));
  CHECK(m.standoff.axis.empty());
  CHECK(m.standoff.following == Following::exclusive);
  CHECK(m.links.retract_axis.empty());
  CHECK(m.links.rapid == RapidMotion::linear);
  CHECK(m.tolerance.tip == 0.01);
  CHECK(m.tolerance.axis == Approx(0.05 * kPi / 180));
  CHECK(m.tolerance.limit_share == 1.0);
  CHECK(m.tolerance.budget.chord == 0.65);  // without smoothing
  CHECK(m.tolerance.budget.smoothing == 0.0);
  CHECK(parse(base_and("[recipe]\nsmoothing = \"acr\"\n")).tolerance.budget.chord == 0.15);
  CHECK(m.recipe.kind == "five_axis");
  CHECK(m.recipe.smoothing == "none");
  CHECK(m.dialect.name == "linuxcnc");
  CHECK(m.dialect.mode == "joint");
  CHECK(m.dialect.units == "mm");
  CHECK(m.dialect.digits_length == 5);
  CHECK(m.dialect.digits_angle == 6);
  CHECK(m.dialect.block_time == 0.0);
  CHECK(m.dialect.path_mode == "exact");
  CHECK(m.process.unmapped == UnmappedWords::refuse);
  CHECK(m.process.events.empty());
  CHECK(m.power.speed.empty());
  CHECK(parse(base_and("[dialect]\nunits = \"inch\"\n")).dialect.digits_length == 6);
  CHECK(parse(base_and("[cycle]\nmin_block_ms = 20\n")).dialect.block_time == 0.0);
}

TEST_CASE("machine file: the tip of a tool is its length below the tip of the file",
          "[machines][definition]") {
  const MachineDefinition m =
      parse(base_and("[tool]\ntip_mm = [1, 2, 3]\naxis = [0, 1, 0]\n[workpiece]\nframe = { xyz_mm "
                     "= [7, 8, 9] }\n"));
  const ScrewChain chain = chain_of(m, 10.0);
  CHECK(chain.tool_home.translation() == Vec3(1, -8, 3));
  CHECK(chain.tool_home.linear() == Mat3::Identity());
  CHECK(chain.tool_axis == Vec3(0, 1, 0));
  CHECK(chain.workpiece_home.translation() == Vec3(7, 8, 9));
  CHECK(chain_of(m).tool_home.translation() == Vec3(1, 2, 3));
  REQUIRE(chain.size() == 2);
  CHECK(chain.joints[1].origin == Vec3(1, 2, 3));
}

TEST_CASE("machine file: not TOML", "[machines][definition]") {
  const auto result = parse_machine_file("schema = 1\nname = \n", "m.toml");
  REQUIRE(result.diagnostics().size() == 1);
  CHECK(result.diagnostics()[0].code == "MF101");
  CHECK(result.diagnostics()[0].where.line == 2);
}

TEST_CASE("machine file: schema", "[machines][definition]") {
  check_value(base_with("schema = 1", "schema = 2"), "MF103", "schema = 2");
  check_value(base_with("schema = 1", "schema = \"1\""), "MF103", "schema = \"1\"");
  check_error(base_with("schema = 1\n", ""), "MF103", "name = \"m\"");
}

TEST_CASE("machine file: unknown keys, with the nearest known one", "[machines][definition]") {
  check_error(base_and("[tolerance]\ntipp_mm = 1\n"), "MF104", "tipp_mm");
  CHECK(contains(first_text(base_and("[tolerance]\ntipp_mm = 1\n")), "did you mean tip_mm?"));
  check_error(base_and("[tolerence]\n"), "MF104", "tolerence");
  CHECK(contains(first_text(base_and("[tolerence]\n")), "did you mean tolerance?"));
  check_error(base_and("[zzzzzzzzzz]\n"), "MF104", "zzzzzzzzzz");
  CHECK(contains(first_text(base_and("[zzzzzzzzzz]\n")), "remove it"));
  check_error(base_with("source =", "sauce ="), "MF104", "sauce");
  check_error(base_with("max_mm = 20.5\n", "max_mm = 20.5\ncyclic = false\n"), "MF104",
              "cyclic = false");
  check_error(base_with("max_mm = 20.5\n", "max_mm = 20.5\norigin_mm = [0, 0, 0]\n"), "MF104",
              "origin_mm = [0, 0, 0]");
  check_error(base_and("[process.events]\nbeam_on = { text = \"M3\", laten = 1 }\n"), "MF104",
              "laten");
  check_error(base_and("[workpiece]\nframe = { xyz_mm = [0, 0, 0], abc = 1 }\n"), "MF104", "abc");
  check_error(base_and("[tolerance.budget]\nmerging = 0.1\n"), "MF104", "merging");
}

TEST_CASE("machine file: missing keys", "[machines][definition]") {
  check_error(base_with("name = \"m\"\n", ""), "MF105", "schema");
  for (const char* line : {"name = \"X\"\n", "letter = \"X\"\n", "type = \"linear\"\n",
                           "chain = \"tool\"\n", "direction = [1, 0, 0]\n", "min_mm = -10\n",
                           "max_mm = 20.5\n", "max_velocity_mm_per_s = 30\n",
                           "max_acceleration_mm_per_s2 = 40\n", "max_jerk_mm_per_s3 = 50\n"}) {
    const std::string text = base_with(line, "");
    const auto result = parse_machine_file(text, "m.toml");
    INFO(line << listing(result.diagnostics()));
    REQUIRE(result.diagnostics().size() == 1);
    CHECK(result.diagnostics()[0].code == "MF105");
    CHECK(result.diagnostics()[0].where.line == 3);
    CHECK(result.diagnostics()[0].where.column == 1);
    CHECK(contains(result.diagnostics()[0].text, std::string(line).substr(0, 4)));
  }
  check_error(base_with("origin_mm = [1, 2, 3]\n", ""), "MF105", "[[axis]]\nname = \"tilt\"");
  check_error(base_and("[links]\nretract_axis = \"X\"\n"), "MF105", "[links]");
  check_error(base_and("[process.events]\nbeam_on = { motion = \"stop\" }\n"), "MF105", "{ motion");
  check_error("schema = 1\nname = \"m\"\n", "MF105", "schema");
  check_error(base_and("[process.power]\npercent = [0, 1]\n"), "MF105", "[process.power]");
}

TEST_CASE("machine file: wrong types", "[machines][definition]") {
  check_value(base_with("min_mm = -10", "min_mm = \"-10\""), "MF106", "min_mm = \"-10\"");
  check_value(base_with("cyclic = true", "cyclic = 1"), "MF106", "cyclic = 1");
  check_value(base_with("name = \"tilt\"", "name = 7"), "MF106", "name = 7");
  check_value(base_with("[1, 0, 0]", "[1, 0]"), "MF106", "direction = [1, 0]");
  check_error(base_with("[1, 0, 0]", "[1, 0, \"z\"]"), "MF106", "\"z\"");
  check_value(base_and("[dialect]\ndigits_deg = 2.5\n"), "MF106", "digits_deg = 2.5");
  check_value(base_and("[dialect]\nstart = \"G21\"\n"), "MF106", "start = \"G21\"");
  check_error(base_and("[dialect]\nstart = [\"G21\", \"G90\\nM3\"]\n"), "MF106", "\"G90\\nM3\"");
  check_value("tool = 5\n" + std::string(kBase), "MF106", "tool = 5");
  check_value("schema = 1\nname = \"m\"\naxis = 5\n", "MF106", "axis = 5");
  check_error("schema = 1\nname = \"m\"\naxis = [5]\n", "MF106", "5]");
  check_value(base_and("[process.events]\nbeam_on = 3\n"), "MF106", "beam_on = 3");
  check_value(base_and("[process]\nevents = 3\n"), "MF106", "events = 3");
  check_value(base_and("[tolerance]\nbudget = 0.1\n"), "MF106", "budget = 0.1");
  check_value(base_with("home = 45", "home = 2026-11-24"), "MF106", "home = 2026-11-24");
}

TEST_CASE("machine file: missing and wrong units", "[machines][definition]") {
  check_error(base_with("max_velocity_mm_per_s", "max_velocity"), "MF107", "max_velocity = 30");
  CHECK(contains(first_text(base_with("max_velocity_mm_per_s", "max_velocity")),
                 "write max_velocity_mm_per_s"));
  check_error(base_with("min_mm", "min_deg"), "MF107", "min_deg = -10");
  check_error(base_with("max_jerk_deg_per_s3", "max_jerk_mm_per_s3 "), "MF107",
              "max_jerk_mm_per_s3  = 240");
  check_error(base_with("max_acceleration_mm_per_s2", "max_acceleration_mm_per_s"), "MF107",
              "max_acceleration_mm_per_s =");
  check_error(base_and("[tolerance]\ntip_inch = 0.001\n"), "MF107", "tip_inch");
  check_error(base_and("[tolerance]\naxis_rad = 0.001\n"), "MF107", "axis_rad");
  check_error(base_and("[cycle]\ntime_s = 0.001\n"), "MF107", "time_s");
  check_error(base_and("[dialect]\nblock = 10\n"), "MF107", "block = 10");
  check_error(base_and("[tool]\ntip = [0, 0, 0]\n"), "MF107", "tip = [");
}

TEST_CASE("machine file: values out of their range", "[machines][definition]") {
  check_value(base_with("per_s = 30", "per_s = 0"), "MF108", "max_velocity_mm_per_s = 0");
  check_value(base_with("per_s3 = 240", "per_s3 = -240"), "MF108", "max_jerk_deg_per_s3 = -240");
  check_value(base_and("[tolerance]\ntip_mm = 0\n"), "MF108", "tip_mm = 0");
  check_value(base_and("[tolerance]\naxis_deg = -1\n"), "MF108", "axis_deg = -1");
  check_value(base_and("[tolerance]\nlead_deg = -1\n"), "MF108", "lead_deg = -1");
  check_value(base_and("[tolerance]\nlimit_share = 1.1\n"), "MF108", "limit_share = 1.1");
  check_value(base_and("[dialect]\ndigits_mm = 10\n"), "MF108", "digits_mm = 10");
  check_value(base_and("[dialect]\ndigits_deg = -1\n"), "MF108", "digits_deg = -1");
  check_value(base_and("[dialect]\ndigits_inch = 12\n"), "MF108", "digits_inch = 12");
  check_value(base_and("[cycle]\ntime_ms = 0\n"), "MF108", "time_ms = 0");
  check_value(base_and("[cycle]\nlook_ahead_blocks = -1\n"), "MF108", "look_ahead_blocks = -1");
  check_value(base_and("[recipe]\nknot_every = 0\n"), "MF108", "knot_every = 0");
  check_value(base_and("[recipe]\nknot_every = 65\n"), "MF108", "knot_every = 65");
  check_value(base_and("[recipe]\nalternations = 9\n"), "MF108", "alternations = 9");
  check_value(base_and("[recipe]\nvia_mm = [-1, 2]\n"), "MF108", "via_mm = [-1, 2]");
  check_value(base_and("[tolerance]\nexit_edge_mm = 0\n"), "MF108", "exit_edge_mm = 0");
  check_value(base_and("[links]\nclearance_mm = -1\n"), "MF108", "clearance_mm = -1");
  check_value(base_and("[standoff]\nreserve_mm = -1\n"), "MF108", "reserve_mm = -1");
  check_value(base_and("[workpiece]\nthickness_mm = -1\n"), "MF108", "thickness_mm = -1");
  check_error(base_and("[process.events]\nx = { text = \"M3\", dwell_s = -1 }\n"), "MF108", "-1 }");
}

TEST_CASE("machine file: the settings of a laser", "[machines][definition]") {
  const MachineDefinition none = parse(kBase);
  CHECK(none.recipe.via.empty());
  CHECK_FALSE(none.tolerance.exit_edge.has_value());
  const MachineDefinition m =
      parse(base_and("[tolerance]\nexit_edge_mm = 0.25\n"
                     "[recipe]\nvia_mm = [0, 36.5, 100]\nknot_every = 64\n"));
  CHECK(m.recipe.via == std::vector<double>{0.0, 36.5, 100.0});
  CHECK(m.recipe.knot_every == 64);
  CHECK(m.tolerance.exit_edge == 0.25);
  CHECK(parse(kBase, {{"recipe.via_mm", "[0,100]"}}).recipe.via == std::vector<double>{0.0, 100.0});
  for (const char* word : {"programmed", "qi", "qi_c2", "via", "cone", "monotone", "graph"})
    CHECK(parse(base_and("[recipe]\norientation = \"" + std::string(word) + "\"\n"))
              .recipe.orientation == word);
  for (const char* word : {"hybrid", "ipopt", "banded"})
    CHECK(parse(base_and("[recipe]\nsolver = \"" + std::string(word) + "\"\n")).recipe.solver ==
          word);
  for (const char* word : {"jerk", "constant", "programmed"})
    CHECK(parse(base_and("[recipe]\nschedule = \"" + std::string(word) + "\"\n")).recipe.schedule ==
          word);
}

TEST_CASE("machine file: via points rise", "[machines][definition]") {
  check_value(base_and("[recipe]\nvia_mm = [0, 5, 5]\n"), "MF124", "via_mm = [0, 5, 5]");
  check_value(base_and("[recipe]\nvia_mm = 5\n"), "MF106", "via_mm = 5");
}

TEST_CASE("machine file: words that the recipe does not know", "[machines][definition]") {
  check_value(base_and("[recipe]\norientation = \"free\"\n"), "MF113", "orientation = \"free\"");
  check_value(base_and("[recipe]\nsolver = \"osqp\"\n"), "MF113", "solver = \"osqp\"");
  check_value(base_and("[recipe]\noptimise = \"time\"\n"), "MF113", "optimise = \"time\"");
  check_value(base_and("[recipe]\nschedule = \"fast\"\n"), "MF113", "schedule = \"fast\"");
}

TEST_CASE("machine file: numbers that are none", "[machines][definition]") {
  check_value(base_with("min_mm = -10", "min_mm = nan"), "MF109", "min_mm = nan");
  check_value(base_with("max_deg = 180", "max_deg = inf"), "MF109", "max_deg = inf");
  check_error(base_with("[1, 0, 0]", "[1, 0, -inf]"), "MF109", "-inf");
  check_value(base_and("[tolerance]\ntip_mm = inf\n"), "MF109", "tip_mm = inf");
}

TEST_CASE("machine file: reversed limits", "[machines][definition]") {
  check_value(base_with("min_mm = -10", "min_mm = 21"), "MF110", "max_mm = 20.5");
  check_value(base_with("max_deg = 180", "max_deg = -90"), "MF110", "max_deg = -90");
}

TEST_CASE("machine file: directions", "[machines][definition]") {
  check_value(base_with("[1, 0, 0]", "[0, 0, 0]"), "MF111", "direction = [0, 0, 0]");
  check_value(base_and("[tool]\naxis = [0, 0.0, 0]\n"), "MF111", "axis = [0, 0.0, 0]");
  const MachineDefinition m = parse(base_with("[1, 0, 0]", "[-1e200, 1e200, 0]"));
  CHECK((m.axes[0].joint.direction - Vec3(-1, 1, 0) / std::sqrt(2.0)).norm() < 1e-15);
}

TEST_CASE("machine file: names and letters that are taken", "[machines][definition]") {
  const std::string second =
      "[[axis]]\nname = \"Y\"\nletter = \"Y\"\ntype = \"linear\"\n"
      "chain = \"tool\"\ndirection = [0, 1, 0]\nmin_mm = 0\nmax_mm = 1\n"
      "max_velocity_mm_per_s = 1\nmax_acceleration_mm_per_s2 = 1\n"
      "max_jerk_mm_per_s3 = 1\n";
  CHECK(parse(kBase + second).size() == 3);
  check_error(kBase + replaced(second, "name = \"Y\"", "name =  \"X\""), "MF112", "name =  \"X\"",
              8);
  check_error(kBase + replaced(second, "letter = \"Y\"", "letter =  \"X\""), "MF112",
              "letter =  \"X\"", 10);
  const std::string body =
      "[[body]]\nlink = \"X\"\nname = \"b\"\nshape = \"cylinder\"\n"
      "from_mm = [0, 0, 0]\nto_mm = [0, 0, 1]\nradius_mm = 2\n";
  CHECK(parse(kBase + body).bodies[0].radius_to == 2.0);
  check_error(kBase + body + replaced(body, "name = ", "name =  "), "MF112", "name =  \"b\"", 8);
}

TEST_CASE("machine file: values that are not in the list", "[machines][definition]") {
  const auto refused = [](const std::string& section, const std::string& key,
                          const std::string& listed) {
    const std::string line = key + " = \"wrong\"";
    check_value(base_and("[" + section + "]\n" + line + "\n"), "MF113", line);
    CHECK(contains(first_text(base_and("[" + section + "]\n" + line + "\n")), listed));
  };
  check_value(base_with("\"linear\"", "\"prismatic\""), "MF113", "type = \"prismatic\"");
  check_value(base_with("\"tool\"", "\"head\""), "MF113", "chain = \"head\"");
  check_value(base_with("\"datasheet\"", "\"guess\""), "MF113", "source = \"guess\"");
  CHECK(contains(first_text(base_with("\"datasheet\"", "\"guess\"")),
                 "datasheet, measured or assumed"));
  check_value(base_with("letter = \"X\"", "letter = \"x\""), "MF113", "letter = \"x\"");
  check_value(base_with("letter = \"X\"", "letter = \"XY\""), "MF113", "letter = \"XY\"");
  check_value(base_with("name = \"m\"", "name = \"a/b\""), "MF113", "name = \"a/b\"");
  check_value(base_with("name = \"tilt\"", "name = \"a.b\""), "MF113", "name = \"a.b\"");
  refused("standoff", "following", "none, additive or exclusive");
  refused("links", "rapid", "linear or independent");
  refused("links", "rewind", "links_only");
  refused("recipe", "kind", "robot, laser, finishing or five_axis");
  refused("recipe", "smoothing", "acr, ramp or none");
  refused("recipe", "shape", "half, paper or tuned");
  refused("recipe", "orientation", "monotone");
  refused("recipe", "optimise", "jerk or none");
  refused("recipe", "solver", "hybrid");
  refused("recipe", "schedule", "jerk, constant or programmed");
  refused("dialect", "mode", "joint or tcp");
  refused("dialect", "units", "mm or inch");
  refused("dialect", "path_mode", "exact, blend or spline");
  refused("dialect", "curves", "lines, arcs, cubic or quintic");
  refused("process", "unmapped", "refuse or comment");
  check_value(base_and("[dialect]\nextension = \".ngc\"\n"), "MF113", "extension = \".ngc\"");
  check_value(base_and("[dialect]\nname = \"\"\n"), "MF113", "name = \"\"");
  check_error(base_and("[process.events]\nx = { text = \"M3\", motion = \"fly\" }\n"), "MF113",
              "\"fly\"");
}

TEST_CASE("machine file: axes that do not exist or cannot do it", "[machines][definition]") {
  check_value(base_and("[standoff]\naxis = \"W\"\n"), "MF114", "axis = \"W\"");
  CHECK(contains(first_text(base_and("[standoff]\naxis = \"W\"\n")), "X or tilt"));
  check_value(base_and("[links]\nretract_axis = \"Z\"\nretract_mm = 1\n"), "MF114",
              "retract_axis = \"Z\"");
  check_value(base_and("[standoff]\naxis = \"tilt\"\n"), "MF124", "axis = \"tilt\"");
  check_value(base_and("[links]\nretract_axis = \"tilt\"\nretract_mm = 1\n"), "MF124",
              "retract_axis = \"tilt\"");
  check_value(base_and("[links]\nretract_axis = \"X\"\nretract_mm = 21\n"), "MF124",
              "retract_mm = 21");
  check_value(base_and("[standoff]\naxis = \"X\"\nreserve_mm = 20\n"), "MF124", "reserve_mm = 20");
  check_value(
      base_with("chain = \"tool\"", "chain = \"workpiece\" ").append("[standoff]\naxis = \"X\"\n"),
      "MF124", "axis = \"X\"");
}

TEST_CASE("machine file: home", "[machines][definition]") {
  check_value(base_with("home = 45", "home = 181"), "MF115", "home = 181");
  check_error(base_with("min_mm = -10", "min_mm = 1"), "MF115", "[[axis]]\nname = \"X\"");
  CHECK(parse(base_with("min_mm = -10", "min_mm = 1\nhome = 1")).axes[0].joint.home == 1.0);
}

TEST_CASE("machine file: budget", "[machines][definition]") {
  const std::string shares =
      "[tolerance.budget]\nmerge = 0.2\nsmoothing = 0.2\nchord = 0.2\n"
      "rounding = 0.2\n";
  CHECK(parse(base_and(shares + "controller = 0.2\n")).tolerance.budget.merge == 0.2);
  CHECK(parse(base_and(shares + "controller = 0.2000005\n")).tolerance.budget.merge == 0.2);
  check_error(base_and(shares + "controller = 0.200002\n"), "MF116", "[tolerance.budget]");
  check_error(base_and("[tolerance.budget]\nmerge = 0.2\n"), "MF116", "[tolerance.budget]");
  const auto negative =
      parse_machine_file(base_and("[tolerance.budget]\nmerge = -0.1\nsmoothing = 0.6\n"), "m.toml");
  REQUIRE_FALSE(negative.ok());
  CHECK(contains(listing(negative.diagnostics()), "m.toml:30:9: error: merge is -0.1"));
}

TEST_CASE("machine file: power table", "[machines][definition]") {
  const auto table = [](const std::string& speed, const std::string& percent) {
    return base_and("[process.power]\nspeed_mm_per_s = " + speed + "\npercent = " + percent +
                    "\nmin_percent = 20\nmin_cut_speed_mm_per_s = 5\n");
  };
  const MachineDefinition m = parse(table("[0, 50, 100]", "[20, 60, 60]"));
  CHECK(m.power.speed == std::vector<double>{0, 50, 100});
  CHECK(m.power.percent == std::vector<double>{20, 60, 60});
  CHECK(m.power.min_percent == 20.0);
  CHECK(m.power.min_cut_speed == 5.0);
  CHECK(m.power.by_program);
  CHECK(m.power.error == 30.0);
  CHECK(m.power.at(-1.0) == 20.0);
  CHECK(m.power.at(25.0) == Approx(40.0));
  CHECK(m.power.at(75.0) == 60.0);
  CHECK(m.power.at(1e9) == 60.0);
  const std::string plain = table("[0, 50]", "[20, 60]");
  const MachineDefinition control = parse(plain + "follows = \"control\"\nerror_percent = 2.5\n");
  CHECK_FALSE(control.power.by_program);
  CHECK(control.power.error == 2.5);
  check_value(plain + "follows = \"nobody\"\n", "MF113", "follows = \"nobody\"");
  check_value(plain + "error_percent = 0\n", "MF108", "error_percent = 0");
  check_value(table("[0, 50, 50]", "[20, 60, 70]"), "MF117", "speed_mm_per_s = [0, 50, 50]");
  check_value(table("[-1, 50, 60]", "[20, 60, 70]"), "MF117", "speed_mm_per_s = [-1, 50, 60]");
  check_value(table("[0, 50, 60]", "[20, 60, 50]"), "MF117", "percent = [20, 60, 50]");
  check_value(table("[0, 50, 60]", "[20, 60]"), "MF117", "percent = [20, 60]");
  check_value(table("[0]", "[20]"), "MF117", "percent = [20]");
  check_value(table("[0, 50]", "[20, 101]"), "MF108", "percent = [20, 101]");
}

TEST_CASE("machine file: letters of dialect linuxcnc", "[machines][definition]") {
  check_value(base_with("letter = \"X\"", "letter = \"A\""), "MF118", "letter = \"A\"");
  check_value(base_with("letter = \"B\"", "letter = \"Y\""), "MF118", "letter = \"Y\"");
  check_value(base_with("letter = \"X\"", "letter = \"E\""), "MF118", "letter = \"E\"");
  CHECK(parse(base_with("letter = \"X\"", "letter = \"E\"") + "[dialect]\nname = \"other\"\n")
            .axes[0]
            .letter == 'E');
}

TEST_CASE("machine file: count of axes", "[machines][definition]") {
  std::string text = "schema = 1\nname = \"m\"\n[dialect]\nname = \"other\"\n";
  for (int i = 0; i < 13; ++i) {
    const char letter = static_cast<char>('A' + i);
    text += std::string("[[axis]]\nname = \"") + letter + "\"\nletter = \"" + letter +
            "\"\ntype = \"linear\"\nchain = \"tool\"\ndirection = [1, 0, 0]\nmin_mm = 0\n"
            "max_mm = 1\nmax_velocity_mm_per_s = 1\nmax_acceleration_mm_per_s2 = 1\n"
            "max_jerk_mm_per_s3 = 1\n";
    if (i == 11) CHECK(parse(text).size() == 12);
  }
  check_error(text, "MF119", "[[axis]]\nname = \"M\"");
  check_value("schema = 1\nname = \"m\"\naxis = []\n", "MF119", "axis = []");
}

TEST_CASE("machine file: event rows", "[machines][definition]") {
  const MachineDefinition m = parse(base_and(
      "[process]\nunmapped = \"comment\"\n[process.events]\nspindle_on = \"M3 S{rpm}\"\n"
      "beam_on = { text = \"M62 P0\", motion = \"on_the_fly\", latency_ms = 2, dwell_s = 0.5 }\n"
      "a_last = { text = \"M9\" }\n"));
  CHECK(m.process.unmapped == UnmappedWords::comment);
  REQUIRE(m.process.events.size() == 3);
  CHECK(m.process.events[0].event == "spindle_on");
  CHECK(m.process.events[0].text == "M3 S{rpm}");
  CHECK_FALSE(m.process.events[0].on_the_fly);
  CHECK(m.process.events[1].event == "beam_on");
  CHECK(m.process.events[1].on_the_fly);
  CHECK(m.process.events[1].latency == Approx(0.002));
  CHECK(m.process.events[1].dwell == 0.5);
  CHECK(m.process.events[2].event == "a_last");
  CHECK(m.has_event("beam_on"));
  CHECK_FALSE(m.has_event("beam_off"));
  const auto row = [](const std::string& text) {
    return base_and("[process.events]\nx = \"" + text + "\"\n");
  };
  for (const char* text :
       {"", "  ", "M3 S{rpm", "M3 S}", "M3 S{}", "M3 S{Rpm}", "M3 {a{b}}", "M3\\nM4"}) {
    INFO(text);
    check_value(row(text), "MF120", "x = \"" + std::string(text) + "\"");
  }
  check_error(base_and("[process.events]\nBeam = \"M3\"\n"), "MF120", "Beam");
  check_error(base_and("[process.events]\nx = { text = \"\" }\n"), "MF120", "\"\" }");
  const auto twice =
      parse_machine_file(base_and("[process.events]\na = \"M3\"\nb = \"M3\"\n"), "m.toml");
  CHECK(twice.ok());
  REQUIRE(twice.diagnostics().size() == 1);
  CHECK(to_string(twice.diagnostics()[0]).rfind("m.toml:31:1: warning: ", 0) == 0);
  CHECK(twice.diagnostics()[0].code == "MF122");
}

TEST_CASE("machine file: bodies", "[machines][definition]") {
  const std::string body =
      "[[body]]\nlink = \"tilt\"\nname = \"b\"\nshape = \"frustum\"\n"
      "from_mm = [1, 2, 3]\nto_mm = [4, 5, 6]\nradius_mm = [2, 0]\n";
  const Body read = parse(kBase + body).bodies.at(0);
  CHECK(read.link == "tilt");
  CHECK(read.shape == BodyShape::frustum);
  CHECK(read.from == Vec3(1, 2, 3));
  CHECK(read.to == Vec3(4, 5, 6));
  CHECK(read.radius_from == 2.0);
  CHECK(read.radius_to == 0.0);
  const auto with = [&](const std::string& from, const std::string& to) {
    return kBase + replaced(body, from, to);
  };
  CHECK(parse(with("\"tilt\"", "\"base\"")).bodies[0].link == "base");
  check_value(with("link = \"tilt\"", "link = \"Q\""), "MF114", "link = \"Q\"");
  check_value(with("frustum", "cone"), "MF113", "shape = \"cone\"");
  check_value(with("[2, 0]", "[2, -1]"), "MF108", "radius_mm = [2, -1]");
  check_value(with("[2, 0]", "0"), "MF108", "radius_mm = 0");
  check_value(with("[2, 0]", "[1, 2, 3]"), "MF106", "radius_mm = [1, 2, 3]");
  check_value(with("frustum", "capsule"), "MF124", "radius_mm = [2, 0]");
  check_error(with("frustum", "box"), "MF104", "radius_mm");
  check_value(with("[4, 5, 6]", "[1, 2, 3.0]"), "MF124", "to_mm = [1, 2, 3.0]");
  check_error(with("radius_mm = [2, 0]\n", ""), "MF105", "[[body]]");
}

TEST_CASE("machine file: settings that contradict each other", "[machines][definition]") {
  check_value(base_and("[tool]\ngap_mm = 1\nmin_gap_mm = 2\n"), "MF124", "min_gap_mm = 2");
  check_value(base_and("[cycle]\nmin_block_ms = 10\n[dialect]\nblock_ms = 9\n"), "MF124",
              "block_ms = 9");
}

TEST_CASE("machine file: all errors are collected, in the order of the file",
          "[machines][definition]") {
  std::string text = base_with("max_velocity_mm_per_s", "max_velocity");
  text = replaced(text, "\"datasheet\"", "\"guess\"");
  text = replaced(text, "[0, 3, 4]", "[0, 0, 0]");
  text += "[tolerance]\ntip_mm = -1\nfoo = 1\n[process.events]\nx = \"\"\n";
  const auto result = parse_machine_file(text, "m.toml");
  INFO(listing(result.diagnostics()));
  REQUIRE(result.diagnostics().size() == 6);
  const char* codes[] = {"MF107", "MF113", "MF111", "MF108", "MF104", "MF120"};
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(result.diagnostics()[i].code == codes[i]);
    if (i > 0) CHECK(result.diagnostics()[i].where.line > result.diagnostics()[i - 1].where.line);
  }
  std::string many = kBase;
  for (int i = 0; i < 5000; ++i) many += "k" + std::to_string(i) + " = 1\n";
  const auto capped = parse_machine_file(many, "m.toml");
  CHECK(capped.diagnostics().size() == 201);
  CHECK(capped.diagnostics().back().code == "MF125");
}

TEST_CASE("overrides: change the file before it is validated", "[machines][definition]") {
  const std::string text = base_and(
      "[tolerance]\ntip_mm = 0.5\n[process.events]\ngas_on = \"M64 P1\"\n[tool]\ntip_mm = [0, 0, "
      "0]\n");
  const MachineDefinition m = parse(text, {{"tolerance.tip_mm", "0.01"},
                                           {"axis.tilt.max_deg", "80"},
                                           {"process.unmapped", "comment"},
                                           {"dialect.block_ms", "20"},
                                           {"process.events.gas_on", "M8"},
                                           {"process.events.mist", "\"M7\""},
                                           {"process.events.gas_off", "M65 P1"},
                                           {"process.events.gas_off.latency_ms", "3"},
                                           {"tool.tip_mm", "[1, 2, 3.5]"},
                                           {"dialect.line_numbers", "false"},
                                           {"workpiece.frame.xyz_mm", "[7, 8, 9]"},
                                           {"name", "other"},
                                           {"tolerance.tip_mm", "0.02"}});
  CHECK(m.tolerance.tip == 0.02);  // the last one counts
  CHECK(m.axes[1].joint.upper == Approx(80 * kPi / 180));
  CHECK(m.process.unmapped == UnmappedWords::comment);
  CHECK(m.dialect.block_time == Approx(0.020));
  REQUIRE(m.process.events.size() == 3);
  CHECK(m.process.events[0].event == "gas_on");
  CHECK(m.process.events[0].text == "M8");
  CHECK(m.process.events[1].text == "M7");
  CHECK(m.process.events[2].text == "M65 P1");
  CHECK(m.process.events[2].latency == Approx(0.003));
  CHECK(m.tool.tip == Vec3(1, 2, 3.5));
  CHECK_FALSE(m.dialect.line_numbers);
  CHECK(m.workpiece.frame.translation() == Vec3(7, 8, 9));
  CHECK(m.name == "other");
}

TEST_CASE("overrides: errors are located at the option", "[machines][definition]") {
  const auto check = [](const std::string& key, const std::string& value, const char* code) {
    const auto result = parse_machine_file(kBase, "m.toml", {{key, value}});
    INFO(key << "=" << value << "\n" << listing(result.diagnostics()));
    CHECK_FALSE(result.ok());
    REQUIRE(result.diagnostics().size() == 1);
    CHECK(result.diagnostics()[0].code == code);
    CHECK(result.diagnostics()[0].where.file == "--set " + key);
    CHECK(result.diagnostics()[0].where.line == 0);
    CHECK(to_string(result.diagnostics()[0]).rfind("--set " + key + ": error: ", 0) == 0);
  };
  check("tolerance.tip_mm", "-1", "MF108");
  check("tolerance.tip_mm", "small", "MF106");
  check("tolerance.tip_mm", "", "MF106");
  check("tolerance.tip_mm", "nan", "MF109");
  check("tolerance.tip_mm", "1\nname = 2", "MF106");
  check("tolerance.tip", "1", "MF107");
  check("tolerance.foo", "1", "MF104");
  check("foo.bar", "1", "MF104");
  check("tolerance.budget.merge", "0.2", "MF116");
  check("axis.tilt.max_deg", "-100", "MF110");
  check("axis.tilt.min_deg", "200", "MF110");
  check("axis.tilt.max_mm", "80", "MF107");
  check("axis.X.min_mm", "1", "MF115");
  check("axis.tilt.min_deg", "50", "MF115");
  check("axis.Q.max_mm", "1", "MF121");
  check("axis.X", "1", "MF121");
  check("axis", "1", "MF121");
  check("body.nozzle.name", "x", "MF121");
  check("name.first", "1", "MF121");
  check("", "1", "MF121");
  check("a..b", "1", "MF121");
  check("a b", "1", "MF121");
  check("schema", "2", "MF103");
  check("dialect.units", "parsec", "MF113");
  check("process.events.gas_on", "M{", "MF120");
  check("links.retract_axis", "Q", "MF114");
  check("workpiece.frame", "{ xyz_mm = [0, 0] }", "MF106");
  const auto names = parse_machine_file(kBase, "m.toml", {{"axis.Q.max_mm", "1"}});
  CHECK(contains(names.diagnostics()[0].text, "X or tilt"));
}

TEST_CASE("process file: the event table alone", "[machines][definition]") {
  const auto good = parse_process_file(
      "schema = 1\n[process]\nunmapped = \"comment\"\n[process.events]\nz = \"M3\"\na = \"M5\"\n",
      "p.toml");
  REQUIRE(good.ok());
  CHECK(good.value().unmapped == UnmappedWords::comment);
  REQUIRE(good.value().events.size() == 2);
  CHECK(good.value().events[0].event == "z");
  const auto check = [](const std::string& text, const char* code, int line) {
    const auto result = parse_process_file(text, "p.toml");
    INFO(text << listing(result.diagnostics()));
    REQUIRE_FALSE(result.ok());
    REQUIRE(result.diagnostics().size() == 1);
    CHECK(result.diagnostics()[0].code == code);
    CHECK(result.diagnostics()[0].where.line == line);
  };
  check("[process.events]\nz = \"M3\"\n[tool]\n", "MF104", 3);
  check("[process.events]\nz = \"M3\"\n[process.power]\n", "MF104", 3);
  check("[process.events]\nz = \"{\"\n", "MF120", 2);
  check("schema = 3\n[process.events]\n", "MF103", 1);
  check("", "MF105", 1);
  check("x = \n", "MF101", 1);
}

namespace {

/// What every accepted machine has, whatever its file was.
void check_invariants(const MachineDefinition& m) {
  bool good = m.size() >= 1 && m.size() <= kMaxJoints && !m.name.empty();
  for (const auto& axis : m.axes) {
    good = good && axis.joint.lower < axis.joint.upper && axis.joint.home >= axis.joint.lower &&
           axis.joint.home <= axis.joint.upper && axis.velocity > 0 && axis.acceleration > 0 &&
           axis.jerk > 0 && std::abs(axis.joint.direction.norm() - 1.0) < 1e-12 &&
           axis.joint.origin.allFinite();
  }
  const auto& b = m.tolerance.budget;
  good = good && m.tolerance.tip > 0 && m.tolerance.axis > 0 && m.tool.tip.allFinite() &&
         std::abs(b.merge + b.smoothing + b.chord + b.rounding + b.controller - 1.0) < 2e-6 &&
         m.dialect.digits_length >= 0 && m.dialect.digits_length <= 9 && m.dialect.block_time >= 0;
  CHECK(good);
}

std::string mutated(std::string text, std::mt19937& random) {
  const std::vector<std::string> pieces = {
      "[[",   "]]",  "{",          "}",        "\"",         "\"\"\"", "'''", "=",
      ".",    "#",   "nan",        "inf",      "-",          "1e999",  "\n",  "0x",
      "\xFF", "_mm", "[[axis]]\n", "[tool]\n", "axis = 1\n", "e9"};
  for (auto n = 1 + random() % 3; n > 0 && !text.empty(); --n) {
    const std::size_t at = random() % text.size();
    switch (random() % 5) {
      case 0:
        text[at] = static_cast<char>(random() % 256);
        break;
      case 1:
        text.erase(at, 1 + random() % 20);
        break;
      case 2:
        text.insert(at, pieces[random() % pieces.size()]);
        break;
      case 3:
        text.insert(at, text.substr(random() % text.size(), random() % 60));
        break;
      default:
        text[at] = "0123456789.-"[random() % 12];
        break;
    }
  }
  return text;
}

}  // namespace

TEST_CASE("machine file: prefixes and mutations end in a machine or in located errors",
          "[machines][definition]") {
  std::mt19937 random(17);
  int accepted = 0;
  int refused = 0;
  const auto check = [&](const std::string& text) {
    const auto result = parse_machine_file(text, "m.toml");
    if (result.ok()) {
      ++accepted;
      check_invariants(result.value());
      return;
    }
    ++refused;
    bool good = has_error(result.diagnostics());
    const auto lines = std::count(text.begin(), text.end(), '\n') + 1;
    for (const auto& d : result.diagnostics())
      good = good && d.code.rfind("MF1", 0) == 0 && !d.text.empty() &&
             (d.code == "MF125" ||
              (d.where.line >= 1 && d.where.line <= lines && d.where.column >= 1));
    if (!good) FAIL(text << listing(result.diagnostics()));
  };
  for (const char* name : {"laser_5p1", "table_table_ac", "table_table_bc"}) {
    const std::string text =
        test::read_bytes(test::source_path(std::string("machines/") + name + "/machine.toml"));
    for (int i = 0; i < 700; ++i) check(text.substr(0, random() % (text.size() + 1)));
    for (int i = 0; i < 2000; ++i) check(mutated(text, random));
  }
  CHECK(accepted > 200);
  CHECK(refused > 2000);
}

TEST_CASE("machine file: huge files end in diagnostics, in time", "[machines][definition]") {
  const auto grown = [](const std::string& head, const std::function<std::string(int)>& piece) {
    std::string text = head;
    constexpr std::size_t kBytes = std::size_t{512} << 10;
    text.reserve(kBytes);
    for (int i = 0;; ++i) {
      const std::string next = piece(i);
      if (text.size() + next.size() > kBytes) return text;
      text += next;
    }
  };
  const auto number = [](int i) { return std::to_string(i); };
  const std::vector<std::string> texts = {
      grown(kBase, [&](int i) { return "max_velocity_mm_per_m" + number(i) + " = 1\n"; }),
      grown(kBase, [&](int i) { return "[[body]]\nname = \"" + number(i) + "\"\n"; }),
      grown(kBase, [](int) { return std::string("[[axis]]\n"); }),
      grown(base_and("[process.events]\n"), [&](int i) { return "e" + number(i) + " = \"\"\n"; }),
      grown(base_and("[dialect]\nstart = ["), [](int) { return std::string("1,"); }) + "]",
      grown(base_and("[tool]\naxis = ["), [](int) { return std::string("nan,"); }) + "]",
      grown(kBase, [&](int i) { return "\"\xC3\xA4" + number(i) + "\" = 1\n"; })};
  for (const auto& text : texts) {
    const auto result = parse_machine_file(text, "m.toml");
    CHECK_FALSE(result.ok());
    CHECK(result.diagnostics().size() <= 201);
  }
  CHECK(parse_machine_file(std::string(kMaxTomlBytes + 1, '\n'), "m.toml").diagnostics()[0].code ==
        "MF102");
}
