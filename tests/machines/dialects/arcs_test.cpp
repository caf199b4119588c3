#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/spline/bent_move.h"
#include "machines/dialects/arc_text.h"
#include "machines/dialects/beckhoff.h"
#include "machines/dialects/fanuc_30i.h"
#include "machines/dialects/linuxcnc.h"
#include "machines/dialects/siemens_840d.h"
#include "tests/machines/dialects/random_programs.h"

// Blocks along arcs, in every dialect that has them.
using namespace smoothpost;
using namespace smoothpost::test;

namespace {

struct Case {
  const Dialect* dialect;
  const char* name;
};
const Case kCases[] = {{&linuxcnc::kDialect, "linuxcnc"},
                       {&siemens_840d::kDialect, "siemens_840d"},
                       {&fanuc_30i::kDialect, "fanuc_30i"},
                       {&beckhoff::kDialect, "beckhoff"}};

MachineDefinition machine_of(const Case& c, const char* units = "mm") {
  std::vector<MachineOverride> overrides = {{"dialect.name", c.name}, {"dialect.mode", "joint"}};
  if (std::string(units) == "inch") {
    overrides.push_back({"dialect.units", "inch"});
    overrides.push_back({"dialect.digits_inch", "5"});
  }
  return shipped_machine("table_table_bc", overrides);
}

/// Some of the feeds go along an arc of radius 0.05 mm to 10 m in one of the three planes, up to
/// 270 degrees either way, the third axis still or not; the rotary axes stand.
void make_some_arcs(const MachineDefinition& machine, MachineProgram& program, std::mt19937& rng) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto planes = arc_planes(machine);
  REQUIRE(planes.size() == 3);
  for (std::size_t i = 1; i < program.moves.size(); ++i) {
    MachineMove& move = program.moves[i];
    if (move.rapid || unit(rng) < 0.3) continue;
    const ArcPlane& plane = planes[rng() % 3];
    const double radius = 0.05 * std::pow(2e5, unit(rng)), start = 6.28 * unit(rng);
    const double sweep = (0.01 + (kMostSweep - 0.011) * unit(rng)) * (rng() % 2 == 0 ? 1 : -1);
    const JointVector& from = program.moves[i - 1].to;
    const double third = move.to[plane.third];
    move.to = from;
    if (rng() % 2 == 0) move.to[plane.third] = third;
    move.arc = {sweep > 0.0 ? 1 : -1, plane.first, plane.second,
                from[plane.first] - radius * std::cos(start),
                from[plane.second] - radius * std::sin(start)};
    move.to[plane.first] = move.arc.centre_first + radius * std::cos(start + sweep);
    move.to[plane.second] = move.arc.centre_second + radius * std::sin(start + sweep);
  }
}

double length_of(const JointVector& from, const MachineMove& move) {
  const ArcShape shape = arc_shape({from, move.to, move.bend, move.arc});
  return shape.from_radius * std::abs(shape.sweep);
}

/// A quarter circle in each plane, of radius 10 about (0, 0, 0) and its neighbours, third axis 2
/// up.
std::string three_arcs(const Case& c, const MachineDefinition& machine) {
  MachineProgram program;
  MachineMove move;
  move.to = JointVector::Zero(machine.size());
  const int x = machine.axis_by_letter('X'), y = machine.axis_by_letter('Y'),
            z = machine.axis_by_letter('Z');
  move.to[x] = 10.0;
  move.joints = (1U << machine.size()) - 1U;
  move.rapid = true;
  program.moves.push_back(move);
  move.rapid = false;
  move.duration = 2.0;
  const std::pair<int, int> planes[] = {{x, y}, {y, z}, {z, x}};
  for (const auto& [first, second] : planes) {
    move.arc = {1, first, second, 0.0, move.to[second]};
    move.to[first] = 0.0;
    move.to[second] += 10.0;
    program.moves.push_back(move);
  }
  return emitted(*c.dialect, machine, program).text;
}

}  // namespace

TEST_CASE("arcs: read_back(emit(x)) is x to the printed digits in every dialect that has them",
          "[machines][dialects]") {
  std::mt19937 rng(61);
  for (const Case& c : kCases)
    for (const char* units : {"mm", "inch"}) {
      INFO(c.name << " " << units);
      const auto machine = machine_of(c, units);
      std::size_t arcs = 0;
      for (int round = 0; round < 60; ++round) {
        auto program = random_joint_program(machine, rng, 10);
        make_some_arcs(machine, program, rng);
        const auto out = emitted(*c.dialect, machine, program);
        const auto back = read_back(*c.dialect, machine, out.text);
        REQUIRE(back.offset_guard);
        REQUIRE(back.exact_path);
        REQUIRE(back.moves.size() == program.moves.size());
        for (std::size_t i = 0; i < program.moves.size(); ++i) {
          const MachineMove& planned = program.moves[i];
          const ReadBackMove& found = back.moves[i];
          REQUIRE(found.line == out.move_lines[i]);
          require_same_joints(machine, planned, found);
          // FANUC's F of an arc is over its angle, which the digits of small arcs change.
          const double angle =
              planned.arc.turn == 0
                  ? 0.0
                  : 4.0 * half_digit(machine, 0) / length_of(program.moves[i - 1].to, planned);
          if (!planned.rapid)
            REQUIRE(found.duration == Approx(planned.duration).epsilon(2e-4 + angle));
          REQUIRE(found.arc.turn == planned.arc.turn);
          if (planned.arc.turn == 0) continue;
          ++arcs;
          REQUIRE(found.arc.first == planned.arc.first);
          REQUIRE(found.arc.second == planned.arc.second);
          REQUIRE(std::abs(found.arc.centre_first - planned.arc.centre_first) <=
                  half_digit(machine, 0));
          REQUIRE(std::abs(found.arc.centre_second - planned.arc.centre_second) <=
                  half_digit(machine, 0));
        }
      }
      CHECK(arcs > 200);
    }
}

TEST_CASE("arcs: G2 and G3 go round as the letters of their plane say", "[machines][dialects]") {
  // From the definition: G3 is counter-clockwise seen from the positive end of the third axis, so
  // from X to Y, from Z to X, from Y to Z. The middle of a quarter circle is at 45 degrees.
  for (const Case& c : kCases) {
    INFO(c.name);
    const auto machine = machine_of(c);
    const std::string text = three_arcs(c, machine);
    CHECK(text.find("G17 G3") != std::string::npos);
    CHECK(text.find("G19 G3") != std::string::npos);
    CHECK(text.find("G18 G3") != std::string::npos);
    const auto back = read_back(*c.dialect, machine, text);
    REQUIRE(back.moves.size() == 4);
    const double near = 10.0 * std::sqrt(0.5);
    const char letters[] = {'X', 'Y', 'Y', 'Z', 'Z', 'X'};
    const double middle[] = {near, near, near, near, near, near};
    for (int k = 0; k < 3; ++k) {
      const ReadBackMove& move = back.moves[static_cast<std::size_t>(k + 1)];
      const JointVector q = joints_at(
          {back.moves[static_cast<std::size_t>(k)].to, move.to, move.bend, move.arc}, 0.5);
      CHECK(q[machine.axis_by_letter(letters[2 * k])] == Approx(middle[2 * k]).margin(1e-3));
      CHECK(q[machine.axis_by_letter(letters[2 * k + 1])] ==
            Approx(middle[2 * k + 1]).margin(1e-3));
      CHECK(move.duration == Approx(2.0).epsilon(1e-4));
    }
  }
}

TEST_CASE("arcs: blocks that could move differently are refused", "[machines][dialects]") {
  for (const Case& c : kCases) {
    INFO(c.name);
    const auto machine = machine_of(c);
    const std::string text = three_arcs(c, machine);
    const bool point = text.find("I-10.") != std::string::npos;
    const std::string i = point ? "I-10." : "I-10", j = point ? "J0." : "J0";
    const std::string centre = i + " " + j;
    const std::string tail = point ? "." : "";
    std::vector<std::pair<std::string, std::string>> changes = {
        {centre, j},                                                // the other
        {centre, ""},                                               // none
        {centre, centre + " K0" + tail},                            // one of another plane
        {centre, "I-10.01 " + j},                                   // radii differ
        {centre, "I10" + tail + " " + j},                           // centre on the other side
        {centre, i + " J5" + tail},                                 // end not on the circle
        {centre, "R10" + tail},                                     // by the radius
        {centre, centre + " B5" + tail},                            // a rotary moves along
        {"G17 G3", "G18 G3"},                                       // another plane
        {"G17 G3", "G17 G2 G3"},                                    // two senses
        {"G17 G3", "G17 G18 G3"},                                   // two planes
        {"G17 G3", "G91 G17 G3"},                                   // relative
        {"G17 G3 X0" + tail + " Y10" + tail, "G17 G3 X10" + tail},  // a full circle
        {"G17 G3 X0" + tail + " Y10" + tail, "G17 G3 X10" + tail + " Y0.001"},  // nearly one
        {"G17 G3", "G17 G2.5"}};
    // LinuxCNC takes a centre word that is missing as 0, which is what it was.
    if (std::string(c.name) != "linuxcnc") changes.emplace_back(centre, i);
    CHECK(require_refused(*c.dialect, machine, text, changes) >= 10);
  }
}

TEST_CASE("arcs: G3 for G2 goes the long way round and is refused beyond 270 degrees",
          "[machines][dialects]") {
  for (const Case& c : kCases) {
    INFO(c.name);
    const auto machine = machine_of(c);
    std::string text = three_arcs(c, machine);
    text.replace(text.find("G17 G3"), 6, "G17 G2");
    const auto back = c.dialect->read_back(machine, text, "out");
    // 270 degrees by the other way: an arc of its own, with the sense that is written.
    if (back.ok()) CHECK(back.value().moves[1].arc.turn == -1);
  }
}

TEST_CASE("arcs: prefixes and mutations end in a value or diagnostics", "[machines][dialects]") {
  std::mt19937 rng(62);
  for (const Case& c : kCases) {
    INFO(c.name);
    const auto machine = machine_of(c);
    require_bounded(*c.dialect, machine, three_arcs(c, machine), rng);
  }
}

TEST_CASE("arcs: the plane is G17 again before words of the machine file", "[machines][dialects]") {
  for (const Case& c : kCases) {
    INFO(c.name);
    auto machine = machine_of(c);
    MachineProgram program;
    MachineMove move;
    move.to = JointVector::Zero(machine.size());
    move.joints = (1U << machine.size()) - 1U;
    move.rapid = true;
    program.moves.push_back(move);
    move.rapid = false;
    move.duration = 1.0;
    const int y = machine.axis_by_letter('Y'), z = machine.axis_by_letter('Z');
    move.to[y] = 10.0;
    move.to[z] = 10.0;
    move.arc = {1, y, z, 0.0, 10.0};
    program.moves.push_back(move);
    program.actions = {event("coolant_on", 2)};
    const std::string text = emitted(*c.dialect, machine, program).text;
    const auto arc = text.find("G19 G3");
    REQUIRE(arc != std::string::npos);
    const auto plane = text.find("G17\n", arc), words = text.find("M8", arc);
    REQUIRE(words != std::string::npos);
    CHECK(plane < words);
    read_back(*c.dialect, machine, text);
  }
}
