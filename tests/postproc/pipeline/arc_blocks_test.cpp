#include "postproc/pipeline/arc_blocks.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/units.h"
#include "kernels/spline/bent_move.h"
#include "machines/dialects/arc_text.h"
#include "postproc/pipeline/controller_motion.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/registry.h"
#include "postproc/pipeline/verify.h"
#include "tests/postproc/pipeline/certified_program.h"
#include "tests/postproc/pipeline/paths.h"

// Arcs in the place of straight blocks: planned, printed, read back and verified.
using namespace smoothpost;
using namespace smoothpost::test;

namespace {

const char* const kDialects[] = {"linuxcnc", "siemens_840d", "fanuc_30i", "beckhoff"};

const std::string kStart =
    "%\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-12 Y0 A0 C0\nG43 H1 Z40\nG0 Z5\n";
const std::string kEnd = "G17\nG0 Z60\nM5\nM30\n%\n";

// A helix, a pocket with coolant that comes on inside, arcs in the two other planes; then a face
// that is tilted about A and C.
const std::string kPocket = kStart +
                            "G1 Z0 F400\nG3 X-12 Y0 Z-2 I12 J0 F600\nG3 X12 Y0 I12 J0 F900\nM8\n"
                            "G3 X-12 Y0 I-12 J0\nG1 X8 Y0\nG18 G3 X2 Z4 I-6 K0\nG1 Y-10\n"
                            "G19 G2 Y-4 Z-2 J0 K-6\nG17\nM9\nG0 Z60\nG0 A-20 C35\nG0 X10 Y-5\n"
                            "G0 Z20\nG1 Z15 F400\nG2 X-8 Y-5 I-9 J0 F900\nG2 X10 Y-5 I9 J0\n" +
                            kEnd;

ConvertInput prepare(const std::string& program, const std::string& dialect, const char* curves,
                     const char* to = "table_table_bc") {
  ConvertInput in;
  in.input = read_program(program, "table_table_ac");
  in.machine = shipped_machine(
      to, {{"dialect.name", dialect}, {"dialect.mode", "joint"}, {"dialect.curves", curves}});
  in.input_name = "part.ngc";
  in.collision_check = false;
  return in;
}

std::vector<std::size_t> arcs_of(const ReadBack& back) {
  std::vector<std::size_t> arcs;
  for (std::size_t i = 1; i < back.moves.size(); ++i)
    if (back.moves[i].arc.turn != 0) arcs.push_back(i);
  return arcs;
}

ArcShape shape_of(const ReadBack& back, std::size_t i) {
  const ReadBackMove& m = back.moves[i];
  return arc_shape({back.moves[i - 1].to, m.to, m.bend, m.arc});
}

/// On the circle from the definition: centre, radius and angle of the start, in steps of the angle.
JointVector on_arc(const ReadBack& back, std::size_t i, double t) {
  const ReadBackMove& m = back.moves[i];
  const JointVector& from = back.moves[i - 1].to;
  const double x0 = from[m.arc.first] - m.arc.centre_first;
  const double y0 = from[m.arc.second] - m.arc.centre_second;
  const double turn = t * shape_of(back, i).sweep;
  JointVector q = from + t * (m.to - from);
  q[m.arc.first] = m.arc.centre_first + x0 * std::cos(turn) - y0 * std::sin(turn);
  q[m.arc.second] = m.arc.centre_second + x0 * std::sin(turn) + y0 * std::cos(turn);
  return q;
}

}  // namespace

TEST_CASE("arc_blocks: fewer blocks, the same path and time, in three planes",
          "[postproc][pipeline][arcs]") {
  for (const char* dialect : kDialects) {
    INFO(dialect);
    const Conversion lines = converted(prepare(kPocket, dialect, "lines"));
    const ConvertInput in = prepare(kPocket, dialect, "arcs");
    const Conversion c = converted(in);
    const ReadBack back = read_text(in, c.program);
    const std::vector<std::size_t> arcs = arcs_of(back);
    CAPTURE(lines.blocks, c.blocks, arcs.size());
    CHECK(4 * c.blocks < lines.blocks);
    CHECK(c.scheduled_time == Approx(lines.scheduled_time).epsilon(1e-3));
    for (const char* plane : {"G17 G2", "G17 G3", "G18 G3", "G19 G2"})
      CHECK(c.program.find(plane) != std::string::npos);
    bool helix = false;
    for (const std::size_t i : arcs) {
      const JointVector way = (back.moves[i].to - back.moves[i - 1].to).cwiseAbs();
      const JointArc& arc = back.moves[i].arc;
      for (int j = 0; j < way.size(); ++j)
        if (j != arc.first && j != arc.second && way[j] > 0.0) helix = true;
      const double radius = shape_of(back, i).from_radius;
      const double nearest =
          std::min({std::abs(radius - 12.0), std::abs(radius - 9.0), std::abs(radius - 6.0)});
      // Short ones may be others within the tolerance.
      CAPTURE(back.moves[i].line, radius, shape_of(back, i).sweep);
      if (std::abs(shape_of(back, i).sweep) > 0.2) CHECK(nearest < 0.02 * radius);
    }
    CHECK(helix);
    const ReadBack straight = read_text(prepare(kPocket, dialect, "lines"), lines.program);
    check_same_events(back, straight, 2e-3);
  }
}

TEST_CASE("arc_blocks: the certified deviation bounds an independent dense comparison",
          "[postproc][pipeline][arcs]") {
  for (const char* dialect : kDialects) {
    const ConvertInput in = prepare(kPocket, dialect, "arcs");
    const Conversion c = converted(in);
    const ReadBack back = read_text(in, c.program);
    ToolPath path = in.input.path;
    find_cuts(path, {});
    const ReferencePath reference(path, in.input.frames);
    const ScrewChain chain = chain_of(in.machine, 60.0);
    double tip = 0.0, axis = 0.0;
    int samples = 0;
    for (const std::size_t i : arcs_of(back)) {
      const auto& e = c.line_map[i];
      REQUIRE(e.role == MoveRole::path);
      if (e.from_segment != e.segment) continue;
      for (int k = 0; k <= 400; ++k) {
        const double t = k / 400.0;
        const CutterLocation out = forward_location(chain, on_arc(back, i, t));
        const auto wanted = reference.at(e.segment, e.from_share + t * (e.to_share - e.from_share));
        tip = std::max(tip, (out.tip - wanted.tip).norm());
        axis = std::max(axis, angle_between(out.axis, wanted.axis));
        ++samples;
      }
    }
    CAPTURE(dialect, tip, axis, samples);
    CHECK(samples > 2000);
    CHECK(tip <= find(c.checks, "tip_deviation").value);
    CHECK(degrees_from_radians(axis) <= find(c.checks, "axis_deviation").value + 1e-12);
  }
}

TEST_CASE("arc_blocks: random circles and helices come back", "[postproc][pipeline][arcs]") {
  std::mt19937 rng(71);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int found = 0;
  for (int round = 0; round < 12; ++round) {
    const int plane = static_cast<int>(rng() % 3);
    const bool clockwise = rng() % 2 == 0;
    const double radius = 2.0 * std::pow(20.0, unit(rng)), start = 6.28 * unit(rng);
    const double sweep = (0.5 + 4.0 * unit(rng)) * (clockwise ? -1.0 : 1.0);
    const double climb = plane == 0 && rng() % 2 == 0 ? -2.0 : 0.0;
    const char* letters[] = {"XYIJ", "ZXKI", "YZJK"};
    const char* l = letters[plane];
    // The plane's own coordinates, the centre at 0; Z stays above −45.
    const auto point = [&](double angle) {
      return std::pair(radius * std::cos(angle), radius * std::sin(angle));
    };
    const auto [a0, b0] = point(start);
    const auto [a1, b1] = point(start + sweep);
    const auto word = [](char letter, double v) { return letter + std::to_string(v) + " "; };
    const std::string program = kStart + "G1 " + word(l[0], a0) + word(l[1], b0) + "F900\n" +
                                (plane == 0   ? "G17"
                                 : plane == 1 ? "G18"
                                              : "G19") +
                                (clockwise ? " G2 " : " G3 ") + word(l[0], a1) + word(l[1], b1) +
                                word(l[2], -a0) + word(l[3], -b0) + (climb != 0.0 ? "Z3" : "") +
                                "\nG17\n" + kEnd;
    INFO(program);
    const ConvertInput in = prepare(program, "linuxcnc", "arcs");
    const ReadBack back = read_text(in, converted(in).program);
    double swept = 0.0;
    for (const std::size_t i : arcs_of(back)) {
      const ArcShape shape = shape_of(back, i);
      CHECK((shape.sweep < 0.0) == clockwise);
      CHECK(back.moves[i].arc.first ==
            arc_planes(in.machine)[static_cast<std::size_t>(plane)].first);
      if (std::abs(shape.sweep) > 0.2) CHECK(shape.from_radius == Approx(radius).epsilon(1e-2));
      swept += std::abs(shape.sweep);
      ++found;
    }
    // Almost all of it; where the schedule starts and stops there may be straight blocks.
    CHECK(swept > 0.8 * std::abs(sweep));
    CHECK(swept < 1.01 * std::abs(sweep));
  }
  CHECK(found >= 12);
}

TEST_CASE("arc_blocks: where a rotary moves or the path is straight there is no arc",
          "[postproc][pipeline][arcs]") {
  // Rotaries that move along; lines and corners of a blended path.
  for (const std::string& cut :
       {std::string("M428\nG1 Z0 F400\nG3 X-12 Y0 I12 J0 A-10 C20 F900\nM429\n"),
        std::string("G1 Z0 F400\nG1 X0 Y20 F900\nG1 X15 Y21\nG1 X15 Y0 Z2\n")}) {
    INFO(cut);
    const ConvertInput in = prepare(kStart + cut + kEnd, "linuxcnc", "arcs");
    const Conversion c = converted(in);
    CHECK(arcs_of(read_text(in, c.program)).empty());
    CHECK(c.program.find("G2 ") == std::string::npos);
    CHECK(c.program.find("G3 ") == std::string::npos);
  }
}

TEST_CASE("arc_blocks: straight steps stand for an arc within their deviation",
          "[postproc][pipeline][arcs]") {
  const ConvertInput in = prepare(kPocket, "linuxcnc", "arcs");
  const ReadBack back = read_text(in, converted(in).program);
  const ScrewChain chain = chain_of(in.machine, 60.0);
  FollowSettings settings;
  settings.tip_tolerance = 2e-3;
  const ControllerMotion motion = follow_joints(back, chain, settings);
  REQUIRE(motion.steps);
  std::size_t step = 0;
  int samples = 0;
  for (std::size_t i = 0; i < back.moves.size(); ++i) {
    const std::uint32_t line = back.moves[i].line;
    std::vector<std::size_t> steps;
    for (; step < motion.steps->moves.size() && motion.steps->moves[step].line == line; ++step)
      steps.push_back(step);
    REQUIRE(!steps.empty());
    if (back.moves[i].arc.turn == 0) continue;
    double duration = 0.0;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const ReadBackMove& s = motion.steps->moves[steps[k]];
      CHECK(s.arc.turn == 0);
      duration += s.duration;
      const JointVector& from = motion.steps->moves[steps[k] - 1].to;
      REQUIRE(s.deviation.size() == from.size());
      CHECK(s.deviation.maxCoeff() <= settings.tip_tolerance + s.spread + 1e-12);
      for (int n = 0; n <= 10; ++n) {
        const double t = n / 10.0;
        const JointVector q = on_arc(back, i, (static_cast<double>(k) + t) / steps.size());
        const JointVector off = (q - (from + t * (s.to - from))).cwiseAbs();
        REQUIRE((off.array() <= s.deviation.array() + 1e-12).all());
        ++samples;
      }
    }
    CHECK(duration == Approx(back.moves[i].duration));
  }
  CHECK(samples > 1000);
}

TEST_CASE("arc_blocks: check --against certifies the program by itself",
          "[postproc][pipeline][arcs]") {
  for (const char* dialect : kDialects) {
    INFO(dialect);
    const ConvertInput in = prepare(kPocket, dialect, "arcs");
    CheckInput check;
    check.text = converted(in).program;
    check.file_name = "program";
    check.machine = in.machine;
    check.tool_length = 60.0;
    check.against = in.input;
    check.collision_check = false;
    const Conversion verdict = check_program(check, {});
    for (const auto& d : verdict.diagnostics) UNSCOPED_INFO(to_string(d));
    CHECK(verdict.verdict == Verdict::certified);
  }
}

TEST_CASE("arc_blocks: an arc whose text is changed is not certified",
          "[postproc][pipeline][arcs]") {
  // verify_deviation with the map of the unchanged program, which is how a conversion verifies.
  const ConvertInput in = prepare(kPocket, "linuxcnc", "arcs");
  const Conversion c = converted(in);
  const auto verified = [&](const std::string& text) {
    const auto back = find_dialect("linuxcnc")->read_back(in.machine, text, "p");
    if (!back.ok()) return false;
    CheckInput check;
    check.text = text;
    check.file_name = "program";
    check.machine = in.machine;
    check.tool_length = 60.0;
    check.against = in.input;
    check.collision_check = false;
    return check_program(check, {}).verdict == Verdict::certified;
  };
  CHECK(verified(c.program));
  int tried = 0;
  for (std::size_t at = c.program.find(" G3 "); at != std::string::npos && tried < 20;
       at = c.program.find(" G3 ", at + 1)) {
    std::string sense = c.program;
    sense[at + 2] = '2';
    CHECK_FALSE(verified(sense));
    ++tried;
  }
  CHECK(tried > 5);
}

TEST_CASE("arc_blocks: dialects and settings without arcs refuse them",
          "[postproc][pipeline][arcs]") {
  const auto refused = [](std::vector<MachineOverride> overrides) {
    ConvertInput in = prepare(kPocket, "linuxcnc", "lines");
    overrides.push_back({"dialect.curves", "arcs"});
    in.machine = shipped_machine("table_table_bc", overrides);
    const Conversion c = convert(in, false, {});
    return std::any_of(c.diagnostics.begin(), c.diagnostics.end(),
                       [](const Diagnostic& d) { return d.code == "US120"; });
  };
  CHECK_FALSE(refused({{"dialect.name", "linuxcnc"}}));
  CHECK(refused({{"dialect.name", "grbl"}}));
  CHECK(refused({{"dialect.name", "heidenhain"}, {"dialect.mode", "joint"}}));
  CHECK(refused({{"dialect.name", "siemens_840d"}, {"dialect.mode", "tcp"}}));
  CHECK(refused({{"dialect.name", "linuxcnc"}, {"dialect.digits_mm", "2"}}));
  CHECK(refused(
      {{"dialect.name", "linuxcnc"}, {"dialect.units", "inch"}, {"dialect.digits_inch", "4"}}));
}
