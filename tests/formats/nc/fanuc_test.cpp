#include <catch2/catch.hpp>

#include "tests/formats/nc/recording.h"

namespace smoothpost::test {
namespace {

Run fanuc(const std::string& lines, nc::InterpreterSettings settings = mill_settings(),
          nc::InputDialect dialect = nc::InputDialect::fanuc) {
  return run("%\nO1000 (TEST)\n" + lines + "\nM30\n%\n", settings, dialect);
}

std::vector<std::string> one(const char* code) { return {code}; }

}  // namespace

TEST_CASE("fanuc: G43.4 is tool-centre-point mode with a length", "[formats][nc][fanuc]") {
  const Run r = fanuc(
      "G21 G17 G90 G94 G40 G49 G80 G69 G50\nG54\nG05.1 Q1 R5\nG43.4 H1 X0. Y0. Z50. B0. C0.\n"
      "G01 X10. B5. C-3. F6000.\nG49\nG05.1 Q0\nG0 X0. Y0. Z0.");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.diagnostics.empty());
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 3);
  CHECK(m[0].tcp);
  CHECK(m[0].kind == MotionKind::rapid);
  CHECK(m[1].tcp);
  CHECK_FALSE(m[1].axis_vector);
  CHECK(degrees(m[1].end[4]) == Approx(5.0));
  CHECK(m[1].duration == Approx(10.0 / 100.0));
  CHECK_FALSE(m[2].tcp);
  const auto lengths = r.sink.of("tool_length");
  REQUIRE(lengths.size() == 2);
  CHECK(lengths[0].number == 50.0);
  CHECK(lengths[0].integer == 1);
  CHECK(lengths[1].number == 0.0);
  CHECK(r.summary.uses_tcp);
}

TEST_CASE("fanuc: G43.5 gives the tool axis by I J K", "[formats][nc][fanuc]") {
  nc::InterpreterSettings settings = mill_settings();
  settings.any_axis_needs_machine = true;
  const Run r = fanuc(
      "G90 G21\nG43.5 H1 X0. Y0. Z50. I0. J0. K1.\nG1 X10. I1. K1. F100.\nX20.\nX30. J1.\n"
      "G3 X40. Y0. R5.\nG49",
      settings);
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 5);
  CHECK(m[0].start_axis.isZero());
  CHECK(m[0].end_axis == Vec3(Vec3::UnitZ()));
  CHECK(m[1].end_axis.isApprox(Vec3(1, 0, 1).normalized()));
  CHECK(m[2].start_axis == m[2].end_axis);      // none written: it stays
  CHECK(m[3].end_axis == Vec3(Vec3::UnitY()));  // one written: the others are 0
  CHECK(m[4].is_arc);
  CHECK(m[4].axis_vector);
  for (const auto& motion : m) CHECK(motion.tcp);
  CHECK(fanuc("G43.5 H1\nG1 X1. B5. K1. F1.").errors() == one("NC243"));
  CHECK(fanuc("G43.5 H1\nG1 X1. I0. J0. F1.").errors() == one("NC243"));
  CHECK(fanuc("G0 X0. Y0.\nG43.5 H1\nG2 X1. I1. F1.").errors() == one("NC243"));
  CHECK(fanuc("G0 X0. I1.").errors() == one("NC215"));
  CHECK(fanuc("G43.4 H7").errors() == one("PR102"));
}

TEST_CASE("fanuc: numbers without a decimal point", "[formats][nc][fanuc]") {
  const Run r = fanuc("G0 X0 Y0\nG1 X10 F500\nY-5\nX20");
  CHECK(r.errors() == std::vector<std::string>{"NC240", "NC240"});  // the first X, the first Y
  CHECK(r.diagnostics.front().where.line == 4);
  CHECK(r.diagnostics.front().where.column == 4);
  CHECK(fanuc("G0 X0 Y0 Z0 B0 C0\nG1 X1. F500\nM3 S100\nG4 P500").ok);
  CHECK(fanuc("G0 X0. Y0.\nG2 X10. Y0. R5 F10.").errors() == one("NC240"));
  nc::InterpreterSettings settings = mill_settings();
  settings.integer_increment = 1.0;
  CHECK(fanuc("G0 X10 B5", settings).sink.motions[0].end[0] == 10.0);
  settings.integer_increment = 0.001;
  CHECK(fanuc("G0 X10 Y2.", settings).sink.motions[0].end[0] == Approx(0.01));
  CHECK(fanuc("G0 X10 Y2.", settings).sink.motions[0].end[1] == 2.0);
  CHECK(degrees(fanuc("G0 B5000", settings).sink.motions[0].end[4]) == Approx(5.0));
  CHECK(fanuc("G20 G0 X10000", settings).sink.motions[0].end[0] == Approx(25.4));
  CHECK(fanuc("G20\nG0 X0 Y0\nG1 X1. F10").errors() == one("NC240"));
  CHECK(fanuc("G0 X0\nG1 X1. F10", mill_settings(), nc::InputDialect::haas).errors() ==
        one("NC240"));
}

TEST_CASE("fanuc: inch programs", "[formats][nc][fanuc]") {
  const Run r = fanuc("G20 G90 G0 X0 Y0 Z0\nG1 X1. F10.\nG21 G1 X0. F254.");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions[1].end[0] == Approx(25.4));
  CHECK(r.sink.motions[1].duration == Approx(6.0));
  CHECK(r.sink.motions[2].duration == Approx(6.0));  // F in the unit of its own block
}

TEST_CASE("fanuc: dwell, home, machine position", "[formats][nc][fanuc]") {
  const Run r = fanuc("G4 P500\nG04 X1.5\nG4 P2.\nG28 G91 Z0\nG90\nG53 X1. Y2.\nG30 P2 G91 Z0.");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto dwells = r.sink.of("dwell");
  REQUIRE(dwells.size() == 3);
  CHECK(dwells[0].number == 0.5);
  CHECK(dwells[1].number == 1.5);
  CHECK(dwells[2].number == 2.0);
  for (const auto& m : r.sink.motions) CHECK(m.machine_position);
  CHECK(r.sink.motions[2].end[1] == 2.0);
}

TEST_CASE("fanuc: modes of the control are read and do nothing", "[formats][nc][fanuc]") {
  const Run r = fanuc("G05 P10000\nG61.1\nG64\nG08 P1\nG9 G67 G15\n/2 G0 X1.\nG05 P0\nG5.1 Q0");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.codes(Severity::warning) == one("NC244"));
  CHECK(r.sink.motions.size() == 1);
  const Run haas = fanuc("G187 P3 E0.01\nG103 P1\nG234 H1\nG0 X1. B2.\nG49", mill_settings(),
                         nc::InputDialect::haas);
  INFO(haas.all_text());
  REQUIRE(haas.ok);
  CHECK(haas.sink.motions.front().tcp);
}

TEST_CASE("fanuc: what is refused", "[formats][nc][fanuc]") {
  struct Row {
    const char* line;
    const char* code;
    int column;
  };
  const Row rows[] = {{"G234 H1", "NC203", 1},      {"G68.2 X0 Y0 Z0 I0 J0 K0", "NC203", 1},
                      {"M98 P1000", "NC251", 1},    {"G65 P9000", "NC251", 1},
                      {"#1100=5", "NC132", 1},      {"G0 X[1+2", "NC130", 5},
                      {"G0 X#1", "NC131", 4},       {"G10 L2 P0 X1.", "NC218", 1},
                      {"M198 P1", "NC226", 1},      {"M97 P1", "NC226", 1},
                      {"G66 P1", "NC202", 1},       {"G76 X1. Z-1. R1.", "NC202", 1},
                      {"G54.1 P3", "NC202", 1},     {"G41 D1 X1.", "NC202", 1},
                      {"G87 Z-5. R2.", "NC202", 1}, {"G51 X1.", "NC202", 1},
                      {"G0 X1. ,C2.", "NC105", 8},  {"G4", "NC217", 1}};
  for (const Row& row : rows) {
    const std::string text = std::string(row.line) + "\nM30\n";
    const Run r = run(text, mill_settings(), nc::InputDialect::fanuc);
    INFO(row.line << "\n" << r.all_text());
    REQUIRE_FALSE(r.ok);
    if (std::string(row.code) != "NC105") CHECK(r.diagnostics.front().code == row.code);
    CHECK(r.diagnostics.front().where.line == 1);
    CHECK(r.diagnostics.front().where.column == row.column);
    CHECK(nc::print(nc::parse(text, "t", nc::InputDialect::fanuc).program) == text);
  }
}

}  // namespace smoothpost::test
