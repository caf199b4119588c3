#include "postproc/pipeline/convert.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <random>

#include "kernels/core/units.h"
#include "kernels/geometry/triangle_tree.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/timeline.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// The path as a conversion sees it: everything that does not cut is a link.
ToolPath with_links(ToolPath path) {
  find_cuts(path, {});
  return path;
}

InputSettings posted_for(const char* machine) {
  InputSettings settings;
  settings.file_name = "part.ngc";
  settings.machine = shipped_machine(machine);
  settings.tool_lengths = {{1, 60.0}};
  return settings;
}

ConvertInput prepare(const std::string& text, const char* from, const char* to) {
  auto read = interpret_nc(text, posted_for(from));
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine(to);
  in.input_name = "part.ngc";
  return in;
}

const Check& find(const Conversion& c, const std::string& name) {
  for (const auto& check : c.checks)
    if (check.name == name) return check;
  FAIL("no check " << name);
  return c.checks.front();
}

bool has_code(const Diagnostics& diagnostics, const std::string& code) {
  for (const auto& d : diagnostics)
    if (d.code == code) return true;
  return false;
}

// A five-axis program for the A/C table: rapids, a tilted cut with both rotaries moving, an arc.
const std::string kMill =
    "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\n"
    "G0 X-20 Y-10 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F300\nG1 X20 F600\n"
    "G2 X20 Y10 I0 J10\nG1 X-20 Y10 Z1\n"
    "G0 Z30\nG0 A-40 C30\nG0 X0 Y0 Z10\nG1 Z2 F300\n"
    "G1 X10 Y5 Z1 A-55 C60\nG1 X-5 Y9 Z3 A-30 C-20\nG0 Z40\nM5\nM429\nM30\n%\n";

const std::string kLaserHead = "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\n";
const std::string kLaserEnd = "G0 Z50\nM429\nM30\n%\n";

Pose at(double x, double y, double z) {
  Pose p = Pose::Identity();
  p.translation() = Vec3(x, y, z);
  return p;
}

}  // namespace

TEST_CASE("convert: an A/C program becomes a certified B/C program", "[postproc][pipeline]") {
  const auto in = prepare(kMill, "table_table_ac", "table_table_bc");
  const Conversion c = convert(in, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(c.verdict == Verdict::certified);
  CHECK(c.level == "geometry");
  CHECK(find(c, "tip_deviation").value <= 0.01);
  CHECK(find(c, "axis_deviation").value <= 0.05);
  CHECK(std::count(c.not_checked.begin(), c.not_checked.end(), "clearance") == 0);
  CHECK(std::count(c.not_checked.begin(), c.not_checked.end(), "part_clearance") == 1);
}

TEST_CASE("convert: the certified deviation bounds an independent dense comparison",
          "[postproc][pipeline]") {
  const auto in = prepare(kMill, "table_table_ac", "table_table_bc");
  const Conversion c = convert(in, false, {});
  REQUIRE(c.verdict == Verdict::certified);
  const ToolPath cut_path = with_links(in.input.path);
  const ReferencePath reference(cut_path, in.input.frames);
  // The output machine's forward kinematics written out: p_M = Ry(B) Rz(C) p_W, tool along Z,
  // length 60.
  const auto tip_in_part = [&](const JointVector& q) {
    const Mat3 table = rotation_about(Vec3::UnitY(), q[3]) * rotation_about(Vec3::UnitZ(), q[4]);
    return CutterLocation{table.transpose() * (Vec3(q[0], q[1], q[2]) - Vec3(0, 0, 60)),
                          table.transpose() * Vec3::UnitZ()};
  };
  REQUIRE(in.machine.axes[3].name == "B");
  REQUIRE(in.machine.axes[4].name == "C");
  double tip = 0.0, axis = 0.0;
  std::size_t samples = 0;
  for (std::size_t i = 1; i < c.line_map.size(); ++i) {
    const auto& e = c.line_map[i];
    if (e.role != MoveRole::path) continue;
    for (int k = 0; k <= 50; ++k) {
      const double t = k / 50.0;
      const auto out =
          tip_in_part(c.read.moves[i - 1].to + t * (c.read.moves[i].to - c.read.moves[i - 1].to));
      const auto wanted = reference.at(e.segment, e.from_share + t * (e.to_share - e.from_share));
      tip = std::max(tip, (out.tip - wanted.tip).norm());
      axis = std::max(axis, angle_between(out.axis, wanted.axis));
      ++samples;
    }
  }
  INFO(samples << " samples, tip " << tip << " mm");
  CHECK(samples > 5000);
  CHECK(tip > 1e-5);
  CHECK(tip <= find(c, "tip_deviation").value);
  CHECK(degrees_from_radians(axis) <= find(c, "axis_deviation").value);
}

TEST_CASE("verify: a program that was changed after planning is not certified",
          "[postproc][pipeline]") {
  const auto in = prepare(kMill, "table_table_ac", "table_table_bc");
  const Conversion c = convert(in, false, {});
  REQUIRE(c.verdict == Verdict::certified);
  const ToolPath cut_path = with_links(in.input.path);
  const ReferencePath reference(cut_path, in.input.frames);
  ScrewChain chain = chain_of(in.machine);
  MachineProgram planned;  // joints as read: only the text's own faults can show
  for (const auto& move : c.read.moves) {
    MachineMove m;
    m.to = move.to;
    planned.moves.push_back(m);
  }
  const auto failed = [&](const ReadBack& read) {
    std::string names;
    for (const auto& check :
         verify_deviation(read, in.machine, {reference, c.line_map, planned, chain}, {}))
      if (!check.ok) names += check.name + " ";
    return names;
  };
  CHECK(failed(c.read).empty());
  std::mt19937 rng(1);
  int caught = 0;
  for (int round = 0; round < 60; ++round) {
    ReadBack read = c.read;
    const auto i = std::uniform_int_distribution<std::size_t>(20, read.moves.size() - 5)(rng);
    if (c.line_map[i].role != MoveRole::path) continue;
    const int joint = round % 5;
    read.moves[i].to[joint] += joint < 3 ? 0.05 : radians_from_degrees(0.2);
    INFO("move " << i << " joint " << joint);
    REQUIRE(failed(read).find("deviation") != std::string::npos);
    ++caught;
  }
  CHECK(caught > 40);
  ReadBack dropped = c.read;
  dropped.moves.erase(dropped.moves.begin() + 40);
  CHECK(failed(dropped).find("path_complete") != std::string::npos);
  ReadBack doubled = c.read;
  doubled.moves.insert(doubled.moves.begin() + 40, doubled.moves[40]);
  CHECK(failed(doubled).find("path_complete") != std::string::npos);
}

TEST_CASE("verify_machine: position and planned velocity limits, by definition",
          "[postproc][pipeline]") {
  const auto machine = shipped_machine("table_table_bc");
  ReadBack read;
  read.offset_guard = read.exact_path = true;
  const auto add = [&](int joint, double value, double duration) {
    ReadBackMove move;
    move.to = read.moves.empty() ? home_of(machine) : read.moves.back().to;
    move.to[joint] = value;
    move.known = 0x1f;
    move.rapid = duration == 0.0;
    move.duration = duration;
    move.line = static_cast<std::uint32_t>(read.moves.size() + 1);
    read.moves.push_back(move);
  };
  const auto verdict = [&](const std::string& name) {
    for (const auto& c : verify_machine(read, machine).checks)
      if (c.name == name) return c.ok;
    FAIL("no check " << name);
    return false;
  };
  const auto& x = machine.axes[0];
  add(0, 0.0, 0.0);
  add(0, 0.5 * x.velocity, 0.5000001);
  CHECK(verdict("position_limit.X"));
  CHECK(verdict("velocity_limit.X"));
  add(0, 0.0, 0.499);
  CHECK_FALSE(verdict("velocity_limit.X"));
  read.moves.pop_back();
  add(0, x.joint.upper, 0.0);
  CHECK(verdict("position_limit.X"));
  add(0, x.joint.upper + 0.001, 0.0);
  CHECK_FALSE(verdict("position_limit.X"));
}

TEST_CASE("beam rules: each one fails on its own fault and none can be forced",
          "[postproc][pipeline]") {
  struct Fault {
    const char* rule;
    std::string body;
  };
  const std::vector<Fault> faults = {
      {"beam_off_in_rapid", "G0 Z1\nM62 P0\nG1 X10 F1000\nG0 X20\nM63 P0\n"},
      {"beam_dwell", "G0 Z1\nM62 P0\nG1 X10 F1000\nG4 P0.5\nG1 X20\nM63 P0\n"},
      {"beam_off_at_start_and_end",
       "G0 Z1\nM62 P0\nG1 X10 F1000\nM63 P0\nG1 X20\nM62 P0\nG1 X30\n"}};
  for (const auto& fault : faults) {
    const bool ends_on = std::string(fault.rule) == "beam_off_at_start_and_end";
    auto in = prepare(kLaserHead + fault.body + (ends_on ? "M429\nM30\n%\n" : kLaserEnd),
                      "laser_5p1", "laser_5p1");
    in.placement = at(700, 600, 1000);
    for (const bool force : {false, true}) {
      const Conversion c = convert(in, force, {});
      INFO(fault.rule << " force " << force);
      for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
      CHECK(c.verdict == Verdict::refused);
      CHECK_FALSE(find(c, fault.rule).ok);
    }
  }
  auto good = prepare(kLaserHead + "G0 Z1\nM62 P0\nG4 P0.3\nG1 X10 F1000\nM63 P0\n" + kLaserEnd,
                      "laser_5p1", "laser_5p1");
  good.placement = at(700, 600, 1000);
  const Conversion c = convert(good, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(c.verdict == Verdict::certified);
}

bool read_beam_is_lead(const Conversion& c, const ReferencePath& reference, std::size_t i) {
  return c.read.moves[i].beam != reference.path().points[c.line_map[i].segment].beam;
}

TEST_CASE("verify: a beam that is not where the input has it is found", "[postproc][pipeline]") {
  auto in = prepare(kLaserHead + "G0 Z1\nM62 P0\nG1 X10 F1000\nM63 P0\n" + kLaserEnd, "laser_5p1",
                    "laser_5p1");
  in.placement = at(700, 600, 1000);
  in.machine.recipe.optimise = "none";  // one block for the whole cut
  in.machine.recipe.orientation = "programmed";
  const Conversion c = convert(in, false, {});
  REQUIRE(c.verdict == Verdict::certified);
  const ToolPath cut_path = with_links(in.input.path);
  const ReferencePath reference(cut_path, in.input.frames);
  ScrewChain chain = chain_of(in.machine);
  chain.workpiece_home = chain.workpiece_home * in.placement;
  MachineProgram planned;
  for (const auto& move : c.read.moves) {
    MachineMove m;
    m.to = move.to;
    planned.moves.push_back(m);
  }
  for (std::size_t i = 0; i < c.read.moves.size(); ++i) {
    if (c.line_map[i].role != MoveRole::path) continue;
    // The last block goes without beam on purpose: it is the latency of beam off.
    if (read_beam_is_lead(c, reference, i)) continue;
    ReadBack read = c.read;
    read.moves[i].beam = !read.moves[i].beam;
    bool found = false;
    for (const auto& check :
         verify_deviation(read, in.machine, {reference, c.line_map, planned, chain}, {}))
      if (check.name == "beam_as_programmed") found = !check.ok;
    CHECK(found);
  }
}

TEST_CASE("verify: a joint that is not a number is never certified", "[postproc][pipeline]") {
  const auto in = prepare(kMill, "table_table_ac", "table_table_bc");
  const Conversion c = convert(in, false, {});
  const ToolPath cut_path = with_links(in.input.path);
  const ReferencePath reference(cut_path, in.input.frames);
  const ScrewChain chain = chain_of(in.machine);
  MachineProgram planned;
  for (const auto& move : c.read.moves) {
    MachineMove m;
    m.to = move.to;
    planned.moves.push_back(m);
  }
  ReadBack read = c.read;
  read.moves[30].to[1] = std::nan("");
  bool failed = false;
  for (const auto& check :
       verify_deviation(read, in.machine, {reference, c.line_map, planned, chain}, {}))
    failed = failed || !check.ok;
  CHECK(failed);
  failed = false;
  for (const auto& check : verify_machine(read, in.machine).checks) failed = failed || !check.ok;
  CHECK(failed);
}

TEST_CASE("convert: spindle words cannot reach a laser", "[postproc][pipeline]") {
  auto in = prepare(kMill, "table_table_ac", "laser_5p1");
  in.placement = at(700, 600, 1000);
  for (const bool force : {false, true}) {
    const Conversion c = convert(in, force, {});
    CHECK(c.verdict == Verdict::refused);
    CHECK(c.program.empty());
    REQUIRE(has_code(c.diagnostics, "PR201"));
    bool spindle = false;
    for (const auto& d : c.diagnostics)
      if (d.code == "PR201" && d.text.find("spindle_on") != std::string::npos) {
        spindle = true;
        CHECK(d.where.line == 6);
      }
    CHECK(spindle);
  }
}

TEST_CASE("interpret: missing tool length and unmapped M words are refused at their place",
          "[postproc][pipeline]") {
  auto settings = posted_for("table_table_ac");
  settings.tool_lengths.clear();
  const auto no_length = interpret_nc(kMill, settings);
  REQUIRE_FALSE(no_length.ok());
  bool named = false;
  for (const auto& d : no_length.diagnostics())
    if (d.severity == Severity::error && d.where.line == 8 &&
        d.text.find("--tool 1=") != std::string::npos)
      named = true;
  CHECK(named);

  const auto unmapped =
      interpret_nc("%\nG21 G90\nG0 X0 Y0 Z0 A0 C0\nM123\nM30\n%\n", posted_for("table_table_ac"));
  REQUIRE_FALSE(unmapped.ok());
  CHECK(has_code(unmapped.diagnostics(), "PR101"));
}

TEST_CASE("interpret: rotary words need the machine they were posted for, XYZ do not",
          "[postproc][pipeline]") {
  InputSettings none;
  none.file_name = "part.ngc";
  const auto rotary = interpret_nc("%\nG21 G90\nG0 X0 Y0 Z0\nG1 X1 A5 F100\nM30\n%\n", none);
  REQUIRE_FALSE(rotary.ok());
  CHECK(has_code(rotary.diagnostics(), "US110"));
  CHECK(interpret_nc("%\nG21 G90\nG0 X0 Y0 Z0\nG1 X1 F100\nM30\n%\n", none).ok());
}

TEST_CASE("interpret: the part's frame is the program's zero whatever the work offset",
          "[postproc][pipeline]") {
  auto settings = posted_for("table_table_ac");
  const std::string tcp = "%\nM428\nG21 G90\nG54\nG0 X1 Y2 Z3 A0 C0\nG1 X4 F100\nM30\n%\n";
  const auto plain = interpret_nc(tcp, settings);
  settings.work_offsets[1].words = {10, 20, 30, 0, 0, 0, 0, 0, 0};
  const auto moved = interpret_nc(tcp, settings);
  REQUIRE(plain.ok());
  REQUIRE(moved.ok());
  for (std::size_t i = 0; i < plain.value().path.points.size(); ++i)
    CHECK((plain.value().path.points[i].location.tip - moved.value().path.points[i].location.tip)
              .norm() < 1e-12);
  // Outside TCP mode the same offset decides where the part lies on the input machine: a turn of
  // the table then moves the tip, seen from the part.
  const std::string joints = "%\nG21 G90\nG54\nG0 X0 Y0 Z0 A0 C90\nG1 X4 F100\nM30\n%\n";
  const auto turned = interpret_nc(joints, settings);
  REQUIRE(turned.ok());
  const Vec3 tip = turned.value().path.points.front().location.tip;
  // p_W = Rz(−90°)·(10,20,30) − (10,20,30) by the table's definition p_M = Rz(C)·p.
  CHECK((tip - (Vec3(20, -10, 30) - Vec3(10, 20, 30))).norm() < 1e-9);
}

TEST_CASE("interpret: motions that follow the spindle are refused with their line",
          "[postproc][pipeline]") {
  for (const char* motion : {"G33 Z-5 K1", "G33.1 Z-5 K1", "G18 G76 P1 Z-5 I-3 J1 K2"}) {
    const auto r = interpret_nc(
        "%\nG21 G90 F100\nG0 X0 Y0 Z0 A0 C0\nS100 M3\n" + std::string(motion) + "\nG0 Z5\nM30\n%\n",
        posted_for("table_table_ac"));
    INFO(motion);
    REQUIRE_FALSE(r.ok());
    REQUIRE(r.diagnostics().size() == 1);
    CHECK(r.diagnostics().front().code == "NC316");
    CHECK(r.diagnostics().front().where.line == 5);
  }
}

TEST_CASE("interpret: probing motions are refused with the line of the first",
          "[postproc][pipeline]") {
  for (const char* code : {"G38.2", "G38.3", "G38.4", "G38.5"}) {
    const auto r = interpret_nc("%\nG21 G90 F100\nG0 X0 Y0 Z0 A0 C0\n" + std::string(code) +
                                    " Z-5\nX[#5063]\nG0 Z5\nM30\n%\n",
                                posted_for("table_table_ac"));
    INFO(code);
    REQUIRE_FALSE(r.ok());
    REQUIRE(r.diagnostics().size() == 1);
    CHECK(r.diagnostics().front().code == "NC317");
    CHECK(r.diagnostics().front().where.line == 4);
  }
}

TEST_CASE("interpret: the tool's centre under cutter radius compensation", "[postproc][pipeline]") {
  const auto r =
      interpret_nc("%\nG21 G90 F600\nG0 X0 Y0 Z0\nG41.1 D4\nG1 X10\nY10\nG40\nG0 X0\nM30\n%\n", {});
  REQUIRE(r.ok());
  CHECK(has_code(r.diagnostics(), "NC265"));
  const auto& points = r.value().path.points;
  REQUIRE(points.size() == 4);
  CHECK((points[1].location.tip - Vec3(8, 2, 0)).norm() < 1e-9);
  CHECK((points[2].location.tip - Vec3(8, 10, 0)).norm() < 1e-9);
  CHECK((points[3].location.tip - Vec3(0, 10, 0)).norm() < 1e-9);
}

TEST_CASE("interpret: G49 after G43, G53 and an unknown start", "[postproc][pipeline]") {
  const auto settings = posted_for("table_table_ac");
  const auto unknown =
      interpret_nc("%\nM428\nG21 G90\nG0 X0 A0 C0\nG1 Y1 Z0 F100\nM30\n%\n", settings);
  REQUIRE_FALSE(unknown.ok());
  CHECK(has_code(unknown.diagnostics(), "NC313"));
  // A second work system whose place was not given is refused.
  const auto second =
      interpret_nc("%\nM428\nG21 G90\nG54\nG0 X0 Y0 Z0 A0 C0\nG55\nG1 X1 F100\nM30\n%\n", settings);
  REQUIRE_FALSE(second.ok());
  CHECK(has_code(second.diagnostics(), "PR301"));
}

TEST_CASE("convert: positions of the input machine in mid program become links of ours",
          "[postproc][pipeline]") {
  // G53 and G28 go to places of the A/C machine that mean nothing on the B/C machine.
  for (const char* away : {"G53 G0 Z50", "G28 Z60"}) {
    const auto in = prepare(std::string("%\nM428\nG21 G90 G94\nG0 X0 Y0 Z20 A0 C0\nG1 X10 F500\n") +
                                away + "\nG0 X5 Y5 Z20 A-30 C10\nG1 X15 F500\nG0 Z60\nM30\n%\n",
                            "table_table_ac", "table_table_bc");
    const Conversion c = convert(in, false, {});
    INFO(away);
    for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
    REQUIRE(c.verdict == Verdict::certified);
    // Between the two cuts the retract axis goes to the retract position, alone.
    const int z = in.machine.axis_by_name(in.machine.links.retract_axis);
    bool retracted = false, cut_before = false;
    for (std::size_t i = 1; i < c.line_map.size(); ++i) {
      if (c.line_map[i].role == MoveRole::path) cut_before = true;
      const auto step = (c.read.moves[i].to - c.read.moves[i - 1].to).eval();
      if (cut_before && !retracted && c.line_map[i].role == MoveRole::link &&
          std::abs(c.read.moves[i].to[z] - in.machine.links.retract) < 1e-9 && step[z] != 0.0) {
        retracted = true;
        for (int j = 0; j < 5; ++j)
          if (j != z) CHECK(step[j] == 0.0);
      }
    }
    CHECK(retracted);
  }
}

TEST_CASE("convert: tools of different length", "[postproc][pipeline]") {
  auto settings = posted_for("table_table_ac");
  settings.tool_lengths = {{1, 60.0}, {2, 85.5}};
  auto read = interpret_nc(
      "%\nM428\nG21 G90 G94\nT1 M6\nG43 H1\nG0 X0 Y0 Z20 A0 C0\nG1 X10 F500\nG0 Z40\n"
      "T2 M6\nG43 H2\nG0 X0 Y0 Z20\nG1 X10 A-30 F500\nG0 Z60\nM30\n%\n",
      settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine("table_table_bc");
  in.input_name = "part.ngc";
  const Conversion c = convert(in, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(c.verdict == Verdict::certified);
  // At B = 0 the Z axis stands one tool length above the tip: lines 7 and 12 are at tip height 20.
  for (std::size_t i = 0; i < c.line_map.size(); ++i) {
    if (c.line_map[i].input_line == 7) CHECK(c.read.moves[i].to[2] == Approx(80.0).margin(1e-4));
    if (c.line_map[i].input_line == 11 && c.line_map[i].to_share == 1.0)
      CHECK(c.read.moves[i].to[2] == Approx(105.5).margin(1e-4));
  }
}

TEST_CASE("interpret: G43.1 states the tool length itself", "[postproc][pipeline]") {
  const auto read =
      interpret_nc("%\nM428\nG21 G90 G94\nG43.1 Z42\nG0 X0 Y0 Z20 A0 C0\nG1 X10 F500\nM30\n%\n",
                   posted_for("table_table_ac"));
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  for (const auto& p : read.value().path.points) {
    CHECK(p.tool_length == 42.0);
    CHECK(p.tip_offset == 0.0);
    CHECK(p.location.tip.z() == Approx(20.0));
  }
}

TEST_CASE("convert: the same input gives the same bytes", "[postproc][pipeline]") {
  const auto in = prepare(kMill, "table_table_ac", "table_table_bc");
  CHECK(convert(in, false, {}).program == convert(in, false, {}).program);
}

TEST_CASE("convert: cancelling never leaves a certificate", "[postproc][pipeline]") {
  const auto in = prepare(kMill, "table_table_ac", "table_table_bc");
  for (int at = 1; at <= 2; ++at) {
    int calls = 0;
    Progress progress;
    progress.report = [&](const char*, double) { return ++calls < at; };
    CHECK(convert(in, false, progress).verdict == Verdict::refused);
  }
}

TEST_CASE("convert: out of the machine's range is named with line and limit",
          "[postproc][pipeline]") {
  auto in = prepare(kLaserHead + "G1 X10 F1000\n" + kLaserEnd, "laser_5p1", "laser_5p1");
  in.placement = at(-100, 600, 1000);
  const Conversion c = convert(in, false, {});
  CHECK(c.verdict == Verdict::refused);
  CHECK(has_code(c.diagnostics, "KN102"));
}

TEST_CASE("convert: the pole is crossed without a swing", "[postproc][pipeline]") {
  // B goes through 0 at constant C in the input: the same on the output, not a turn of C by 180
  // degrees.
  auto in = prepare(kLaserHead + "G0 X0 Y0 Z1 B-20 C30\nG1 X50 B20 F1000\n" + kLaserEnd,
                    "laser_5p1", "laser_5p1");
  in.placement = at(700, 600, 1000);
  const Conversion c = convert(in, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(c.verdict == Verdict::certified);
  for (std::size_t i = 0; i < c.line_map.size(); ++i)
    if (c.line_map[i].input_line == 7)
      CHECK(std::abs(std::remainder(c.read.moves[i].to[3] - radians_from_degrees(30), kPi)) < 1e-6);
}

TEST_CASE("convert: a turn at the pole stays inside the tolerances on a table",
          "[postproc][pipeline]") {
  // A 3-axis part, then a tilt in a direction that the C table has to turn to, all while cutting.
  const auto in = prepare(
      "%\nM428\nG21 G90 G94\nG0 X30 Y0 Z20 A0 C0\nG1 Z0 F500\nG1 X-30\n"
      "G1 Y5 A-30 C0\nG1 X0 A-30 C40\nG1 X5 A0\nG0 Z30\nM30\n%\n",
      "table_table_ac", "table_table_bc");
  const Conversion c = convert(in, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(c.verdict == Verdict::certified);
}

TEST_CASE("convert: a C axis that winds past its limit is reported with its line",
          "[postproc][pipeline]") {
  std::string body = "G0 X0 Y0 Z1 B30 C0\n";
  for (int turn = 1; turn <= 5; ++turn)
    body += "G1 X" + std::to_string(turn * 5) + " C" + std::to_string(turn * 180) + " F1000\n";
  auto settings = posted_for("laser_5p1");
  auto read = interpret_nc(kLaserHead + body + kLaserEnd, settings);
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine("laser_5p1");
  in.input_name = "part.ngc";
  in.placement = at(700, 600, 1000);
  const Conversion c = convert(in, false, {});
  CHECK(c.verdict == Verdict::refused);
  REQUIRE(has_code(c.diagnostics, "KN103"));
  for (const auto& d : c.diagnostics)
    if (d.code == "KN103") CHECK(d.where.line >= 9);
}

TEST_CASE("trajectory_csv: joints and tip at the cycle at the feed of the schedule",
          "[postproc][pipeline]") {
  auto in = prepare(kLaserHead + "G0 Z1\nG1 X10 F600\n" + kLaserEnd, "laser_5p1", "laser_5p1");
  in.placement = at(700, 600, 1000);
  in.timed = true;
  const Conversion c = convert(in, false, {});
  REQUIRE(c.verdict == Verdict::certified);
  ScrewChain chain = chain_of(in.machine);
  chain.workpiece_home = chain.workpiece_home * in.placement;
  const std::string csv = trajectory_csv(c.timeline, in.machine, chain, 0.0);
  CHECK(csv.rfind("t_s,X_mm,Y_mm,Z_mm,C_deg,B_deg,W_mm,x_mm,y_mm,z_mm,i,j,k,beam\n", 0) == 0);
  // Behind its ramp 10 mm/s: at 4 ms in steps of 0.04 mm.
  std::size_t in_cut = 0;
  std::size_t at_line = csv.find('\n') + 1;
  double last_x = -1.0;
  while (at_line < csv.size()) {
    const auto end = csv.find('\n', at_line);
    std::vector<double> values;
    std::string row = csv.substr(at_line, end - at_line);
    for (std::size_t p = 0; p != std::string::npos;) {
      values.push_back(std::stod(row.substr(p)));
      const auto comma = row.find(',', p);
      p = comma == std::string::npos ? comma : comma + 1;
    }
    REQUIRE(values.size() == 14);
    CHECK(values[7] == Approx(values[1] - 700).margin(1e-5));  // B = 0: tip follows X
    if (values[9] == Approx(1.0).margin(1e-9) && values[7] > 1.0 && values[7] < 9.0) {
      // Slowed by less than a cycle in the cut's time of more than a second.
      if (last_x > 0) CHECK(values[7] - last_x == Approx(0.04).epsilon(0.004));
      last_x = values[7];
      ++in_cut;
    }
    at_line = end + 1;
  }
  CHECK(in_cut > 190);
}

TEST_CASE("convert: chosen cuts run with the spindle and coolant of the whole program",
          "[postproc][pipeline]") {
  const std::string program =
      "%\nG21 G90 G94 G54\nT1 M6\nM3 S2000\nM8\nG0 X0 Y0 Z20\nG1 X10 F500\nG0 Z50\nG0 X20 Z20\n"
      "G1 X30\nG0 Z50\nG0 X40 Z20\nG1 X50\nM9\nG0 Z50\nG0 X60 Z20\nG1 X70\nG0 Z50\nM5\nM30\n%\n";
  for (int cut = 1; cut <= 4; ++cut) {
    auto in = prepare(program, "table_table_ac", "table_table_bc");
    in.cuts = CutRange{cut, cut};
    const Conversion c = convert(in, false, {});
    INFO("cut " << cut);
    for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
    REQUIRE(c.verdict == Verdict::certified);
    CHECK(find(c, "process_as_programmed").ok);
    std::map<std::string, std::string> states;
    std::size_t cutting = 0;
    while (c.line_map[cutting].role != MoveRole::path) ++cutting;
    for (const auto& e : c.read.events)
      if (e.before <= cutting) note_state(e.name, states);
    CHECK(states.count("spindle") == 1);
    CHECK(states.count("coolant") == (cut < 4 ? 1U : 0U));
    CHECK(states.count("tool") == 1);
    // At the end everything is off.
    for (const auto& e : c.read.events) note_state(e.name, states);
    CHECK(states.count("spindle") == 0);
    CHECK(states.count("coolant") == 0);
  }
}
