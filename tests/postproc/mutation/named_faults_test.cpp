// Faults that `check --against` once certified, each by itself.
#include <catch2/catch.hpp>

#include "tests/postproc/mutation/mutation_cases.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

const DialectCase kMill = {"table_table_ac", "linuxcnc"};
const DialectCase kLaser = {"laser_5p1", "linuxcnc"};

/// The text with `from` replaced where it stands for the n-th time (from 1).
std::string with(std::string text, const std::string& from, const std::string& to, int n = 1) {
  std::size_t at = text.find(from);
  for (; n > 1 && at != std::string::npos; --n) at = text.find(from, at + 1);
  INFO(text);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

Conversion checked(const MutationCase& c, const std::string& text) {
  CheckInput in = c.check;
  in.text = text;
  return check_program(in, {});
}

bool fails(const Conversion& made, const std::string& check) {
  for (const auto& d : made.diagnostics) UNSCOPED_INFO(to_string(d));
  for (const Check& c : made.checks)
    if (c.name == check) return !c.ok;
  return false;
}

}  // namespace

TEST_CASE("check --against: a rapid that dives below both of its cuts is refused",
          "[postproc][mutation]") {
  const MutationCase c = make_case(kMill);
  // The way up behind the first cut, 10 mm along the tool axis.
  const std::size_t end = c.check.text.rfind("(CUT 2");
  const std::size_t up = c.check.text.rfind("G0 ", end);
  const std::string line = c.check.text.substr(up, c.check.text.find('\n', up) - up);
  const std::size_t z = line.find('Z');
  REQUIRE(z != std::string::npos);
  CHECK(checked(c, c.check.text).verdict == Verdict::certified);
  const std::string dives = line.substr(0, z + 1) + "-" + line.substr(z + 1);
  const Conversion made = checked(c, with(c.check.text, line, dives));
  CHECK(made.verdict == Verdict::refused);
  CHECK(fails(made, "link_depth"));
}

TEST_CASE("check --against: what the input turned off is off at the end", "[postproc][mutation]") {
  const MutationCase c = make_case(kLaser);
  const Conversion made = checked(c, with(c.check.text, "M65 P1", "", 1));
  CHECK(made.verdict == Verdict::refused);
  CHECK(fails(made, "process_complete"));
}

TEST_CASE("check --against: a cut shorter than twice event_mm keeps its beam",
          "[postproc][mutation]") {
  const MutationCase c = make_case(
      kLaser,
      "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\nG0 Z1\nM62 P0\nG1 X4 F3000\nM63 P0\n"
      "G0 Z20\nG0 X10\nG0 Z1\nM62 P0\nG1 X10.8 F3000\nM63 P0\nG0 Z50\nM429\nM30\n%\n");
  CHECK(checked(c, c.check.text).verdict == Verdict::certified);
  std::string dark = with(c.check.text, "M62 P0", "", 2);
  dark = with(dark, "M63 P0", "", 2);
  const Conversion made = checked(c, dark);
  CHECK(made.verdict == Verdict::refused);
  CHECK(fails(made, "process_complete"));
}

TEST_CASE("check --against: a cut shorter than twice event_mm keeps its spindle",
          "[postproc][mutation]") {
  const MutationCase c = make_case(
      kMill,
      "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X0 Y0 A0 C0\nG43 H1 Z30\nG0 Z1\n"
      "G1 Z0.2 F100\nG0 Z30\nG0 X5\nG0 Z1\nG1 Z0.2 F100\nG0 Z30\nM5\nM429\nM30\n%\n");
  CHECK(checked(c, c.check.text).verdict == Verdict::certified);
  std::string still = c.check.text;
  for (std::size_t at = still.find("M3 S1000"); at != std::string::npos;
       at = still.find("M3 S1000"))
    still.erase(at, 8);
  CHECK(checked(c, still).verdict == Verdict::refused);
}

TEST_CASE("check --against: tool changes are counted", "[postproc][mutation]") {
  const MutationCase c = make_case(
      kMill,
      "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X0 Y0 A0 C0\nG43 H1 Z30\nG0 Z1\n"
      "G1 Z0 F100\nG1 X4\nG0 Z30\nM5\nT1 M6\nS1000 M3\nG43 H1 Z30\nG0 X10\nG0 Z1\nG1 Z0 F100\n"
      "G1 X14\nG0 Z30\nM5\nM429\nM30\n%\n");
  CHECK(checked(c, c.check.text).verdict == Verdict::certified);
  CHECK(checked(c, with(c.check.text, "T1 M6", "", 2)).verdict == Verdict::refused);
}

TEST_CASE("check --against: a feed before every axis has a position is refused",
          "[postproc][mutation]") {
  const MutationCase c = make_case(kMill);
  const Conversion made = checked(c, with(c.check.text, "G53 G0 Z480", "G1 X5 F100\nG53 G0 Z480"));
  CHECK(made.verdict == Verdict::refused);
  CHECK(fails(made, "tip_deviation"));
}

TEST_CASE("check --against: a program without a motion is refused", "[postproc][mutation]") {
  const MutationCase c = make_case(kMill);
  const std::size_t first = c.check.text.find("G53 G0 Z480");
  CHECK(checked(c, c.check.text.substr(0, first) + "M2\n%\n").verdict == Verdict::refused);
}

TEST_CASE("check --against: tool centre point control with another tool's length is refused",
          "[postproc][mutation]") {
  const MutationCase c = make_case({"table_table_bc", "fanuc_30i"});
  CHECK(checked(c, c.check.text).verdict == Verdict::certified);
  CHECK(checked(c, with(c.check.text, "G43.4 H1", "G43.4 H10", 2)).verdict == Verdict::refused);
}

TEST_CASE("check --against: tool centre point control with an unnamed axis is refused",
          "[postproc][mutation]") {
  // Where the tool stands is not known then, nor the time of the first motion.
  const MutationCase fanuc = make_case({"table_table_bc", "fanuc_30i"});
  CHECK(checked(fanuc, with(fanuc.check.text, "G53 G0 B1. C-90.", "G53 G0 B1.")).verdict ==
        Verdict::refused);
  const MutationCase heidenhain = make_case({"table_table_bc", "heidenhain"});
  CHECK(checked(heidenhain, heidenhain.check.text).verdict == Verdict::certified);
  CHECK(checked(heidenhain, with(heidenhain.check.text, "L B+1 C-90 R0", "L B+1 R0")).verdict ==
        Verdict::refused);
}
