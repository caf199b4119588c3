#include <catch2/catch.hpp>
#include <cmath>

#include "tests/formats/nc/recording.h"

// Motion semantics of RS274NGC as LinuxCNC 2.9 has them; each refusal was tried with rs274.
namespace smoothpost::test {
namespace {

constexpr double kEps = 1e-9;

std::vector<std::string> one(const char* code) { return {code}; }

const CanonicalMotion& last(const Run& run) { return run.sink.motions.back(); }

}  // namespace

TEST_CASE("motion: words, units and the kinds", "[formats][nc][motion]") {
  const Run r = run_lines("G21 G0 X1 Y2 Z3 A90 B-45 C10\nG1 X2 F60\nG20 G1 Y1 U2");
  REQUIRE(r.ok);
  REQUIRE(r.sink.motions.size() == 3);
  const auto& m = r.sink.motions;
  CHECK(m[0].kind == MotionKind::rapid);
  CHECK(m[0].duration == 0.0);
  CHECK(m[0].line == 1);
  CHECK(m[0].programmed == 0x3f);
  CHECK(m[0].end[0] == 1.0);
  CHECK(m[0].end[3] == Approx(kPi / 2).margin(kEps));
  CHECK(m[0].end[4] == Approx(-kPi / 4).margin(kEps));
  CHECK(m[1].kind == MotionKind::feed);
  CHECK(m[1].duration == Approx(1.0));  // 1 mm at 60 mm/min
  CHECK(m[2].start == m[1].end);
  CHECK(m[2].end[1] == Approx(25.4));
  CHECK(m[2].end[6] == Approx(50.8));
  CHECK(m[2].end[0] == 2.0);
  CHECK(r.summary.uses_rotary);
  CHECK(r.summary.ended);
  CHECK(r.sink.of("program_end").size() == 1);
}

TEST_CASE("motion: inch is the first unit when the machine says so", "[formats][nc][motion]") {
  nc::InterpreterSettings settings;
  settings.inch_default = true;
  const Run r = run_lines("G0 X1\nG1 X2 F60", settings);
  CHECK(r.sink.motions[0].end[0] == Approx(25.4));
  CHECK(r.sink.motions[1].duration == Approx(1.0));
}

TEST_CASE("motion: F keeps its physical meaning over G20 and G21", "[formats][nc][motion]") {
  const Run r = run_lines("G21 G0 X0\nG1 X60 F60\nG20\nG1 X0");
  CHECK(last(r).duration == Approx(60.0));
  const Run old_unit = run_lines("G21 G0 X0\nG20 G1 X1 F25.4");
  CHECK(last(old_unit).duration == Approx(60.0));  // F is taken before the unit changes
  CHECK(old_unit.has("NC227"));
}

TEST_CASE("motion: incremental words", "[formats][nc][motion]") {
  const Run r = run_lines("G0 X1 Y1\nG91 X2\nG90 Y5\nG91 G0 X-1 Y-1");
  CHECK(r.sink.motions[1].end[0] == 3.0);
  CHECK(r.sink.motions[2].end[1] == 5.0);
  CHECK(last(r).end[0] == 2.0);
  CHECK(last(r).end[1] == 4.0);
}

TEST_CASE("motion: a word is unknown until the program gives it", "[formats][nc][motion]") {
  nc::InterpreterSettings settings;
  settings.home[0] = 7.0;
  const Run r = run_lines("G91 G0 X1\nG90 Y2\nG91 Y1\nG90 X5", settings);
  const auto& m = r.sink.motions;
  CHECK(m[0].unknown_start == 0x1ff);
  CHECK(m[0].unknown_end == 0x1ff);  // incremental from unknown stays unknown
  CHECK(m[0].end[0] == 8.0);
  CHECK(m[1].unknown_end == 0x1fd);
  CHECK(m[2].unknown_end == 0x1fd);
  CHECK(m[3].unknown_end == 0x1fc);
}

TEST_CASE("motion: F is of XYZ, else UVW, else degrees", "[formats][nc][motion]") {
  const Run r =
      run_lines("G0 X0 Y0 Z0 A0 B0 C0 U0 V0 W0\nG1 X3 Y4 A90 U100 F60\nG1 U96 V3 A0\nG1 A60 B80\n");
  CHECK(r.sink.motions[1].duration == Approx(5.0));
  CHECK(r.sink.motions[2].duration == Approx(5.0));    // U -4, V 3
  CHECK(r.sink.motions[3].duration == Approx(100.0));  // 100 deg at 60 deg/min
}

TEST_CASE("motion: inverse time", "[formats][nc][motion]") {
  const Run r =
      run_lines("G0 X0 A0\nG93 G1 X10 A90 F2\nG1 A0 F4\nG0 X0\nG2 X2 I1 F6\nG94 G1 X0 F60");
  REQUIRE(r.ok);
  CHECK(r.sink.motions[1].duration == Approx(30.0));
  CHECK(r.sink.motions[2].duration == Approx(15.0));
  CHECK(r.sink.motions[3].duration == 0.0);
  CHECK(r.sink.motions[4].duration == Approx(10.0));
  CHECK(r.sink.motions[5].duration == Approx(2.0));
  CHECK(run_lines("G93 G1 X1 F2\nX2").errors() == one("NC214"));
  CHECK(run_lines("G93 G1 X1 F2\nG94 X3").errors() == one("NC213"));
  CHECK(run_lines("G93 G1 X1 F2\nG0 X4\nF3\nX3").ok);
}

TEST_CASE("motion: refusals of straight moves", "[formats][nc][motion]") {
  CHECK(run_lines("X1").errors() == one("NC209"));
  CHECK(run_lines("G0 X1\nG80\nX1").errors() == one("NC209"));
  CHECK(run_lines("G80 X1").errors() == one("NC210"));
  CHECK(run_lines("G1 X1").errors() == one("NC213"));
  CHECK(run_lines("G1 X1 F0").errors() == one("NC213"));
  CHECK(run_lines("G1").errors() == one("NC213"));
  CHECK(run_lines("G0 X1 X2").errors() == one("NC205"));
  CHECK(run_lines("G91 G1 X1 G90 F5").errors() == one("NC204"));
  CHECK(run_lines("G17 G18").errors() == one("NC204"));
  CHECK(run_lines("G43 H0 G49").errors() == one("NC204"));
  CHECK(run_lines("G0 X1 H3").errors() == one("NC215"));
  CHECK(run_lines("G0 X1 P3").errors() == one("NC215"));
  CHECK(run_lines("G0 X1 I3").errors() == one("NC215"));
  CHECK(run_lines("G61 P1").errors() == one("NC215"));
  CHECK(run_lines("D5").errors() == one("NC215"));
  CHECK(run_lines("F-1").errors() == one("NC223"));
  CHECK(run_lines("T1.5").errors() == one("NC223"));
  CHECK(run_lines("T-1").errors() == one("NC223"));
  CHECK(run_lines("S-5").errors() == one("NC223"));
  CHECK(run_lines("G1.05").errors() == one("NC201"));
  CHECK(run_lines("G-1").errors() == one("NC201"));
  CHECK(run_lines("G15").errors() == one("NC201"));
  CHECK(run_lines("M1.5").errors() == one("NC206"));
  CHECK(run_lines("M-1").errors() == one("NC206"));
  CHECK(run_lines("G28 G1 X1 F1").errors() == one("NC211"));
  CHECK(run_lines("G1 X1 F10 G92.1").ok);
  CHECK(run_lines("G0.99999 X1").errors() == one("NC213"));  // rounds to G1
}

TEST_CASE("motion: codes of later versions and other controllers are named",
          "[formats][nc][motion]") {
  for (const char* code : {"G43.2", "G88", "G96"}) {
    const Run r = run_lines(std::string("G0 X0\n") + code + " X1");
    INFO(code);
    REQUIRE(r.errors() == one("NC202"));
    CHECK(r.all_text().find(code) != std::string::npos);
    CHECK(r.all_text().find("t.ngc:2:1:") != std::string::npos);
  }
  for (const char* code : {"G43.4", "G43.5", "G234", "G68.2", "G169", "G53.1", "G254"}) {
    const Run r = run_lines(std::string("G0 X0\nN7 ") + code + " H1");
    INFO(code);
    CHECK(r.codes(Severity::error).front() == "NC203");
    CHECK(r.all_text().find(code) != std::string::npos);
    CHECK(r.all_text().find("--input-dialect") != std::string::npos);
    CHECK(r.all_text().find("t.ngc:2:4:") != std::string::npos);
  }
}

TEST_CASE("motion: a refused motion code does not flood the log", "[formats][nc][motion]") {
  const Run r = run_lines("G0 X0\nG76 X1 Z-1 R2 F100\nX2\nX3\nX4\nG80\nG1 X5");
  CHECK(r.errors() == one("NC266"));
  CHECK(run_lines("G0 X0\nG88 X1 Z-1 R2 F100\nX2\nX3\nG80\nG1 X5").errors() == one("NC202"));
}

TEST_CASE("motion: G0 and G1 without axis words only set the mode", "[formats][nc][motion]") {
  const Run r = run_lines("G1 F100\nX1\nG0\nX2");
  REQUIRE(r.ok);
  REQUIRE(r.sink.motions.size() == 2);
  CHECK(r.sink.motions[0].kind == MotionKind::feed);
  CHECK(r.sink.motions[1].kind == MotionKind::rapid);
}

TEST_CASE("motion: order on one line", "[formats][nc][motion]") {
  const Run dwell = run_lines("G90 G0 X1 G4 P1");
  CHECK(dwell.sink.of("dwell").at(0).motions_before == 0);
  CHECK(dwell.sink.of("dwell").at(0).number == 1.0);
  CHECK(dwell.sink.motions.size() == 1);
  CHECK(run_lines("G4 P1 X3").errors() == one("NC209"));
  const Run modal = run_lines("G0 X0\nG4 P1 X3");
  CHECK(modal.sink.motions.size() == 2);
  CHECK(run_lines("G4").errors() == one("NC217"));
  CHECK(run_lines("G4 P-1").errors() == one("NC217"));
  const Run units = run_lines("G0 X1 G20");
  CHECK(last(units).end[0] == Approx(25.4));
  const Run ends = run_lines("M30 G0 X1");
  CHECK(ends.sink.of("program_end").at(0).motions_before == 1);
}

TEST_CASE("motion: block delete", "[formats][nc][motion]") {
  CHECK(run_lines("/G0 X1\n  / X2").sink.motions.size() == 2);
  nc::InterpreterSettings settings;
  settings.execute_deleted = false;
  CHECK(run_lines("G0 X0\n/G0 X1\n  /G99.9 X2", settings).sink.motions.size() == 1);
  CHECK(run_lines("G0 X0\n/G0 X1\n  /G99.9 X2", settings).ok);
}

TEST_CASE("motion: axis words that the input machine lacks", "[formats][nc][motion]") {
  nc::InterpreterSettings settings;
  settings.axes = 0x2f;  // X Y Z A C
  const Run r = run_lines("G0 X1 A2 C3\nG0 B4\nB5 U1", settings);
  CHECK(r.errors() == std::vector<std::string>{"NC212", "NC212"});  // B once, U once
  CHECK(r.all_text().find("axis word B") != std::string::npos);
  CHECK(r.all_text().find("t.ngc:2:4:") != std::string::npos);
  settings.any_axis_needs_machine = true;
  const Run any = run_lines("G0 X1 A2 C3\nC4", settings);
  CHECK(any.errors() == one("US110"));
  CHECK(any.all_text().find("needs --input-machine") != std::string::npos);
}

TEST_CASE("motion: the end of the program", "[formats][nc][motion]") {
  const Run open = run("G0 X1\n");
  CHECK(open.ok);
  CHECK(open.has("NC229"));
  CHECK_FALSE(open.summary.ended);
  CHECK(run("%\nG0 X1\n%\nX[2\n").ok);
  CHECK(run("%\nG0 X1\n%\nX[2\n").summary.ended);
  const Run after = run("G0 X1\nM2\nX5\nG99 nonsense\n");
  CHECK(after.ok);
  CHECK(after.sink.motions.size() == 1);
  CHECK(after.has("NC230"));
  CHECK_FALSE(run("G0 X1\nM30\n%\n").has("NC230"));
  CHECK(run("").sink.motions.empty());
}

TEST_CASE("motion: text that was not read has no effect and no value", "[formats][nc][motion]") {
  const Run r = run_lines("G0 X0\nG1 @1 F5\nO100 sub\nX$3");
  CHECK_FALSE(r.ok);
  CHECK(r.sink.motions.size() == 1);
  // interpret() alone refuses such a program too, once.
  const nc::ParsedProgram parsed = nc::parse("G0 X0\nG1 @1 F5\nX$3\nM2\n", "t");
  Recording sink;
  const auto result = nc::interpret(parsed.program, {}, sink);
  REQUIRE_FALSE(result.ok());
  CHECK(result.diagnostics().size() == 1);
  CHECK(result.diagnostics().front().code == "NC200");
}

TEST_CASE("motion: G53 and tool length", "[formats][nc][motion]") {
  const Run r = run_lines("G10 L2 P1 X10 Z5\nG43.1 Z50\nG0 X1 Y1 Z30\nG53 G0 Z100 X3\nG0 Y2");
  const auto& m = r.sink.motions;
  CHECK(m[0].end[2] == 35.0);
  CHECK(m[1].machine_position);
  CHECK(m[1].end[2] == 50.0);  // machine Z100 with a tool of 50
  CHECK(m[1].end[0] == 3.0);
  CHECK_FALSE(m[2].machine_position);
  CHECK(m[2].end[2] == 50.0);
  CHECK(run_lines("G53 X1").errors() == one("NC209"));
  CHECK(run_lines("G0 X0\nG53").errors() == one("NC216"));
  CHECK(run_lines("G0 X0\nG91 G53 X1").errors() == one("NC216"));
  CHECK(run_lines("F10 G0 X0\nG2 G53 X1 R5").errors() == one("NC216"));
  CHECK(run_lines("G0 X0\nG53 X1").ok);
}

TEST_CASE("motion: G43 shifts the controlled point, not the machine", "[formats][nc][motion]") {
  nc::InterpreterSettings settings = mill_settings();
  const Run r = run_lines("G0 X0 Z100\nT1 M6\nG43 Z60\nG49 G0 X5\nG43 H2 G0 X6", settings);
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  CHECK(m[1].start[2] == 50.0);  // the machine stands at 100, the tip 50 below
  CHECK(m[1].end[2] == 60.0);
  CHECK(m[2].start[2] == 110.0);
  CHECK(m[3].start[2] == 90.0);
  const auto lengths = r.sink.of("tool_length");
  REQUIRE(lengths.size() == 3);
  CHECK(lengths[0].number == 50.0);
  CHECK(lengths[0].integer == 1);
  CHECK(lengths[0].motions_before == 1);
  CHECK(lengths[1].number == 0.0);
  CHECK(lengths[1].integer == 0);
  CHECK(lengths[2].integer == 2);
  CHECK(r.summary.tools == std::vector<int>{1});
}

TEST_CASE("motion: lengths that nobody gave are refused", "[formats][nc][motion]") {
  const Run missing = run_lines("G43 H7", mill_settings());
  CHECK(missing.errors() == one("PR102"));
  CHECK(missing.all_text().find("--tool 7=LENGTH") != std::string::npos);
  CHECK(run_lines("T3 M6\nG43", mill_settings()).errors() == one("PR102"));
  CHECK(run_lines("G43", mill_settings()).errors() == one("PR104"));
  CHECK(run_lines("G43 H0 G0 Z1", mill_settings()).ok);
  CHECK(run_lines("G43.1 Z3 X1", mill_settings()).errors() == one("NC225"));
}

TEST_CASE("motion: G28 and G30", "[formats][nc][motion]") {
  nc::InterpreterSettings settings;
  settings.axes = 0x7;
  settings.home = {1, 2, 300};
  const Run r = run_lines(
      "G0 X10 Y20 Z30\nG28 Z50\nG0 Z10\nG30\nG28.1\nG0 X5 Y5 Z5\nG28.1\nG0 X9\nG28 X9", settings);
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  CHECK(m[1].end[2] == 50.0);
  CHECK(m[1].machine_position);
  CHECK(m[2].end[2] == 300.0);
  CHECK(m[2].end[0] == 10.0);
  CHECK(m[2].machine_position);
  CHECK((m[2].unknown_end & 7) == 4);  // where home is does not stand in the program
  CHECK((m[3].unknown_end & 7) == 0);
  CHECK(m[4].end[0] == 1.0);  // no words: all axes, one motion
  CHECK((m[4].unknown_end & 7) == 7);
  CHECK(m[4].programmed == 0);
  // G28.1 stores a known place; G28 then goes there.
  CHECK(last(r).end[0] == 5.0);
  CHECK((last(r).unknown_end & 1) == 0);
}

TEST_CASE("motion: tool-centre-point mode", "[formats][nc][motion]") {
  const Run r = run_lines("G0 X0 Y0 Z0 A0 B0 C0\nM428\nG1 X1 F60\nA30\nM429\nG0 Z5\nX1 Y1 M428");
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  CHECK_FALSE(m[0].tcp);
  CHECK(m[1].tcp);
  CHECK((m[1].unknown_start & 0x3f) == 0);  // the modes agree at rotary zero
  CHECK_FALSE(m[3].tcp);
  CHECK((m[3].unknown_start & 7) == 7);  // the mode changed at A30
  CHECK(m[4].tcp);                       // before the motion of its line
  CHECK(r.summary.uses_tcp);
  nc::InterpreterSettings settings;
  settings.has_tcp = false;
  CHECK(run_lines("M428", settings).errors() == one("PR101"));
}

TEST_CASE("motion: M61 is refused by name", "[formats][nc][motion]") {
  nc::InterpreterSettings settings;
  settings.process.unmapped = UnmappedWords::comment;
  CHECK(run_lines("M61 Q1", settings).codes(Severity::error).front() == "NC226");
}

}  // namespace smoothpost::test
