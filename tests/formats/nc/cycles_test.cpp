#include "formats/nc/cycles.h"

#include <catch2/catch.hpp>

#include "tests/formats/nc/recording.h"

namespace smoothpost::test {
namespace {

using Kind = nc::CycleStep::Kind;
using Texts = std::vector<std::string>;

/// The motions behind the first one: r or f, and the coordinate along `axis`.
Texts heights(const Run& r, std::size_t axis = 2) {
  INFO(r.all_text());
  REQUIRE(r.ok);
  Texts out;
  for (std::size_t i = 1; i < r.sink.motions.size(); ++i) {
    const CanonicalMotion& m = r.sink.motions[i];
    std::string text = m.kind == MotionKind::feed ? "f" : "r";
    const double value = std::round(m.end[axis] * 1e6) / 1e6;
    std::string number = std::to_string(value == 0.0 ? 0.0 : value);
    number.erase(number.find_last_not_of('0') + 1);
    if (number.back() == '.') number.pop_back();
    out.push_back(text + number);
  }
  return out;
}

const char* kStart = "G0 X0 Y0 Z5 F60\n";

Run drill(const std::string& lines, const nc::InterpreterSettings& settings = mill_settings()) {
  return run_lines(kStart + lines, settings);
}

Run fanuc(const std::string& lines) {
  return run("%\nO1000 (TEST)\nG90 G21 G0 X0 Y0 Z5. F60\n" + lines + "\nM30\n%\n", mill_settings(),
             nc::InputDialect::fanuc);
}

}  // namespace

TEST_CASE("cycles: the steps of each cycle", "[formats][nc][cycles]") {
  nc::CycleHole hole;
  hole.clear = 5.0;
  hole.retract = 1.0;
  hole.bottom = -4.0;
  hole.peck = 2.5;
  hole.clearance = 0.25;
  hole.dwell = 0.5;
  hole.middle = -3.0;
  const auto steps = [&](int code) {
    hole.code = static_cast<nc::GCode>(code);
    std::string text;
    for (const nc::CycleStep& step : nc::cycle_steps(hole)) {
      constexpr const char* kNames[] = {"r",    "f",  "d",     "stop",  "orient",
                                        "back", "on", "aside", "centre"};
      text += text.empty() ? "" : " ";
      text += kNames[static_cast<std::size_t>(step.kind)];
      if (step.kind == Kind::rapid || step.kind == Kind::feed) {
        text += std::to_string(step.value).substr(0, step.value < 0.0 ? 5 : 4);
      }
    }
    return text;
  };
  CHECK(steps(810) == "f-4.00 r5.00");
  CHECK(steps(820) == "f-4.00 d r5.00");
  CHECK(steps(830) == "f-1.50 r1.00 r-1.25 f-4.00 r5.00");
  CHECK(steps(730) == "f-1.50 r-1.25 f-4.00 r5.00");
  CHECK(steps(740) == "f-4.00 back d f5.00 on");
  CHECK(steps(840) == "f-4.00 back d f5.00 on");
  CHECK(steps(850) == "f-4.00 f1.00 r5.00");
  CHECK(steps(860) == "f-4.00 d stop r5.00 on");
  CHECK(steps(890) == "f-4.00 d f5.00");
  CHECK(steps(870) == "aside orient r-4.00 centre on f-3.00 f-4.00 orient aside r5.00 centre on");
  // Pecks that end exactly at the bottom leave no peck of nothing.
  hole.peck = 0.5;
  CHECK(nc::peck_count(hole) == 1.0);  // G87 has none
  hole.code = 830;
  CHECK(nc::peck_count(hole) == 10.0);
  CHECK(nc::cycle_steps(hole).size() == 9 * 3 + 2);
  // Pecks below the last digit of the height come to an end.
  hole.retract = 1e17;
  hole.bottom = 1e17 - 32.0;
  hole.peck = 1.0;
  CHECK(nc::cycle_steps(hole).size() <= 32 * 3 + 2);
}

TEST_CASE("cycles: way to the hole and retract as LinuxCNC 2.9", "[formats][nc][cycles]") {
  // G99 is active at the start; G98 goes back to the height before the series, in one straight way.
  CHECK(heights(drill("G81 X1 Z-1 R1\nX2")) == Texts{"r5", "r1", "f-1", "r1", "r1", "f-1", "r1"});
  CHECK(heights(drill("G99 G81 X1 Z-1 R1\nG98 X2")) ==
        Texts{"r5", "r1", "f-1", "r1", "r5", "r1", "f-1", "r5"});
  CHECK(heights(drill("G98 G81 X1 Z-1 R1\nX3 R2\nG99 X4\nX5\nG98 X6")) ==
        Texts{"r5", "r1", "f-1", "r5", "r5", "r2", "f-1", "r5", "r5", "r2", "f-1", "r2", "r2",
              "f-1", "r2", "r5", "r2", "f-1", "r5"});
  // Below R the tool first rises.
  CHECK(heights(run_lines("G0 X0 Y0 Z0 F60\nG81 X1 Z-1 R1")) == Texts{"r1", "r1", "f-1", "r1"});
  // G91: R from the height of the series, Z from R, X and Y from hole to hole.
  const Run r = drill("G98 G91 G81 X1 Y2 Z-2 R-1 L2\nX1");
  CHECK(heights(r) ==
        Texts{"r5", "r4", "f2", "r5", "r5", "r4", "f2", "r5", "r5", "r4", "f2", "r5"});
  CHECK(heights(r, 0) ==
        Texts{"r1", "r1", "f1", "r1", "r2", "r2", "f2", "r2", "r3", "r3", "f3", "r3"});
  CHECK(r.sink.motions.back().end[1] == 4.0);
  CHECK(r.sink.motions[3].duration == Approx(2.0));
  for (std::size_t i = 1; i < 9; ++i) CHECK(r.sink.motions[i].line == 2);
  // The numbers are kept as they are written, also over a change of unit and of plane.
  CHECK(heights(drill("G81 X1 Z-1 R1\nG20 X1")).back() == "r25.4");
  CHECK(heights(drill("G81 X1 Z-1 R1\nG18 X2"), 1) ==
        Texts{"r0", "r0", "f0", "r0", "r1", "f-1", "r1"});
  // Words of another cycle or behind another motion are forgotten.
  CHECK(drill("G81 X1 Z-1 R1\nG82 X2 P1").errors() == Texts{"NC260"});
  CHECK(drill("G81 X1 Z-1 R1\nG0 X5\nG81 X2").errors() == Texts{"NC260"});
  CHECK(drill("G81 X1 Z-1 R1\nG80\nX2").errors() == Texts{"NC209"});
}

TEST_CASE("cycles: planes", "[formats][nc][cycles]") {
  const Run zx = run_lines("G18 G0 X0 Y5 Z0 F60\nG99 G83 X1 Z2 Y-1 R1 Q1.5");
  CHECK(heights(zx, 1) == Texts{"r5", "r1", "f-0.5", "r1", "r-0.246", "f-1", "r1"});
  CHECK(zx.sink.motions.back().end[0] == 1.0);
  CHECK(zx.sink.motions.back().end[2] == 2.0);
  const Run yz = run_lines("G19 G0 X5 Y0 Z0 F60\nG98 G85 Y1 Z2 X-1 R1");
  CHECK(heights(yz, 0) == Texts{"r5", "r1", "f-1", "f1", "r5"});
  // A rotated system turns the holes, not their depth.
  const Run turned = run_lines("G10 L2 P1 X10 R90\nG0 X0 Y0 Z5 F60\nG81 X1 Z-1 R1");
  INFO(turned.all_text());
  REQUIRE(turned.ok);
  CHECK(turned.sink.motions.back().end[0] == Approx(10.0));
  CHECK(turned.sink.motions.back().end[1] == Approx(1.0));
}

TEST_CASE("cycles: spindle and dwell are events", "[formats][nc][cycles]") {
  const Run tap = drill("M3 S100\nG84 X1 Z-4 R1 P0.5");
  CHECK(heights(tap) == Texts{"r5", "r1", "f-4", "f1"});
  CHECK(tap.sink.event_texts() ==
        Texts{"spindle_on rpm=100", "spindle_on_reverse rpm=100", "spindle_on rpm=100"});
  CHECK(tap.sink.of("dwell").front().number == 0.5);
  CHECK(tap.sink.of("event")[1].motions_before == 4);  // at the bottom
  CHECK(drill("M4 S100\nG74 X1 Z-4 R1").sink.event_texts()[1] == "spindle_on rpm=100");
  const Run bore = drill("M3 S100\nG86 X1 Z-4 R1 P0.5");
  CHECK(bore.sink.event_texts() ==
        Texts{"spindle_on rpm=100", "spindle_off", "spindle_on rpm=100"});
  // A word that the cycle stands for and the table lacks is refused by name.
  CHECK(drill("M3 S100\nG87 X1 Z-4 R1 I1 J1 K-3").has("PR101"));
  nc::InterpreterSettings kept = mill_settings();
  kept.process.unmapped = UnmappedWords::comment;
  const Run back = drill("M3 S100\nG87 X1 Z-4 R1 I1 J1 K-3", kept);
  CHECK(heights(back) == Texts{"r5", "r1", "r1", "r-4", "r-4", "f-3", "f-4", "r-4", "r1", "r1"});
  CHECK(heights(back, 0)[2] == "r2");
}

TEST_CASE("cycles: what is refused", "[formats][nc][cycles]") {
  struct Row {
    const char* lines;
    const char* code;
  };
  const Row rows[] = {{"G81 X1 R1", "NC260"},
                      {"G91 G81 X1 Z-1 R1\nG90 X2", "NC261"},
                      {"G81 X1 Z-1", "NC260"},
                      {"G81", "NC260"},
                      {"G81 X1 Z-1 R-2", "NC260"},
                      {"G83 X1 Z-1 R1", "NC260"},
                      {"G83 X1 Z-1 R1 Q-1", "NC260"},
                      {"G73 X1 Z-1 R1 Q0", "NC260"},
                      {"G82 X1 Z-1 R1", "NC260"},
                      {"G82 X1 Z-1 R1 P-1", "NC260"},
                      {"G81 X1 Z-1 R1 L0", "NC260"},
                      {"G81 X1 Z-1 R1 L1.5", "NC260"},
                      {"G81 X1 Z-1 R1 A90", "NC260"},
                      {"G87 X1 Z-1 R1 I1", "NC260"},
                      {"G93 G81 X1 Z-1 R1 F2", "NC261"},
                      {"G84 X1 Z-1 R1", "NC261"},
                      {"M4 S1\nG84 X1 Z-1 R1", "NC261"},
                      {"M3 S1\nG74 X1 Z-1 R1", "NC261"},
                      {"G86 X1 Z-1 R1 P1", "NC261"},
                      {"M3 S1\nG18 G84 X1 Y-1 R1", "NC261"},
                      {"G28 Z6\nG81 X1 Z-1 R1", "NC261"},
                      {"G81 X1 Z-1 R1 Q1", "NC215"},
                      {"G81 X1 Z-1 R1 P1", "NC215"},
                      {"G81 X1 Z-1 R1 I1", "NC215"},
                      {"G81 X1 Z-1 R1\nR2", "NC215"},
                      {"G53 G81 X1 Z-1 R1", "NC216"},
                      {"F0\nG81 X1 Z-1 R1", "NC213"},
                      {"G88 X1 Z-1 R1 P1", "NC202"}};
  for (const Row& row : rows) {
    const Run r = drill(row.lines);
    INFO(row.lines << "\n" << r.all_text());
    REQUIRE_FALSE(r.ok);
    CHECK(r.has(row.code));
    CHECK(r.diagnostics.front().where.line >= 2);
  }
}

TEST_CASE("cycles: the Fanuc family", "[formats][nc][cycles]") {
  // G98 at the start; all words stay until G80; K counts, 0 only keeps the words.
  CHECK(
      heights(fanuc("G81 X1. Z-1. R1.\nX2.\nG99 G82 X3. P500\nG80 X9.\nX8.")) ==
      Texts{"r5", "r1", "f-1", "r5", "r5", "r1", "f-1", "r5", "r5", "r1", "f-1", "r1", "r1", "r1"});
  CHECK(fanuc("G82 X3. Z-1. R1. P500").sink.of("dwell").front().number == 0.5);
  CHECK(heights(fanuc("G81 Z-1. R1. K0\nX2.")) == Texts{"r5", "r1", "f-1", "r5"});
  CHECK(heights(fanuc("G91 G99 G81 X1. Z-2. R-4. K2"), 0).back() == "r2");
  const Run pecks = fanuc("G99 G83 X1. Z-1. R1. Q1.5\nG80");
  CHECK(heights(pecks) == Texts{"r5", "r1", "f-0.5", "r1", "r-0.246", "f-1", "r1"});
  CHECK(pecks.codes(Severity::warning) == Texts{"NC244"});
  CHECK(run("G0 X0 Y0 Z5.\nG83 X1. Z-1. R1. Q1. K1. F60.\nM30\n", mill_settings(),
            nc::InputDialect::haas)
            .errors() == Texts{"NC215"});  // the least peck there, not a count
  CHECK(fanuc("M3 S100\nG43.4 H1 Z5.\nG81 X1. Z-1. R1.").has("NC261"));
}

}  // namespace smoothpost::test
