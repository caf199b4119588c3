#include <catch2/catch.hpp>

#include "formats/heidenhain/scanner.h"
#include "formats/heidenhain/variables.h"
#include "tests/formats/heidenhain/recording.h"

// Flow, Q parameters, cycles, tools and M functions, refusals.
namespace smoothpost::test {
namespace {

using Codes = std::vector<std::string>;
using Places = std::vector<std::string>;
using Events = std::vector<std::string>;

double formula(const std::string& text) {
  conversational::Scanner scanner(text);
  const auto value = conversational::Variables().formula(scanner);
  INFO(text << ": " << value.problem);
  REQUIRE(value.ok());
  CHECK(scanner.at_end());
  return value.value;
}

}  // namespace

TEST_CASE("formulas: operators and functions", "[formats][heidenhain]") {
  CHECK(formula("1 + 2 * 3") == 7.0);
  CHECK(formula("( 1,5 + 2 ) * -3 / 2") == -5.25);
  CHECK(formula("2 * 3 ^ 2") == 18.0);
  CHECK(formula("+5 - -3") == 8.0);
  CHECK(formula("SIN 30 * 2") == Approx(1.0));
  CHECK(formula("SQRT 16 + SQ 3") == 13.0);
  CHECK(formula("ABS ( 2 - 5 ) + INT -2.7 + SGN -9") == 0.0);
  CHECK(formula("FRAC 2.25 + NEG 1") == -0.75);
  CHECK(formula("3 LEN 4") == 5.0);
  CHECK(formula("-1 ANG 0") == Approx(270.0));
  CHECK(formula("ATAN 1 + ACOS 0 + ASIN 1") == Approx(225.0));
  CHECK(formula("LOG 1000 + LN EXP 2 + COS 0 + TAN 45 + PI") == Approx(7.0 + kPi));
  CHECK(formula("8 DIV 4") == 2.0);
  for (const char* bad : {"Q1 = 1 / 0", "Q1 = SQRT -1", "Q1 = Q7", "Q1 = ( 1", "Q1 = 1 2",
                          "Q1 = ", "FN 0: Q1 = X", "Q1 = LN 0"}) {
    const auto r = read_blocks(bad);
    INFO(bad << "\n" << r.all_text());
    CHECK(r.errors().size() == 1);
  }
  CHECK(read_blocks("Q1 = " + std::string(5000, '(')).errors() == Codes{"NC405"});
  CHECK(read_blocks("Q1 = " + std::string(5000, '-') + "1").errors() == Codes{"NC405"});
}

TEST_CASE("flow: repeats and subprograms and jumps", "[formats][heidenhain]") {
  const auto r = read_program(
      "0 BEGIN PGM T MM\nL X+0 Y+0 Z+0 FMAX\nFN 0: Q1 = +0\nLBL 1\nFN 1: Q1 = +Q1 + +1\n"
      "L X+Q1 F100\nCALL LBL 1 REP 2/2\nCALL LBL \"UP\"\nL Y+9\nCALL LBL \"UP\"\n"
      "FN 9: IF +Q1 EQU +3 GOTO LBL 7\nL X+99\nLBL 7\nFN 12: IF +Q1 LT +3 GOTO LBL 8\nM30\n"
      "LBL \"UP\"\nL IZ+Q1\nLBL 0\nLBL 8\nL X+77\nEND PGM T MM\n");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.places() ==
        Places{"r 0 0 0", "f 1 0 0", "f 2 0 0", "f 3 0 0", "f 3 0 3", "f 3 9 3", "f 3 9 6"});
  CHECK(r.sink.ends == 1);
}

TEST_CASE("flow: repeats within repeats", "[formats][heidenhain]") {
  const auto r = read_blocks("LBL 1\nLBL 2\nL IX+1\nCALL LBL 2 REP 2\nL IY+1\nCALL LBL 1 REP 1");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.places().back() == "f 6 2 10");
  CHECK(r.sink.motions.size() == 9);
}

TEST_CASE("flow: programs without end are refused", "[formats][heidenhain]") {
  nc::InterpreterSettings settings;
  settings.run_budget = 1000;
  CHECK(read_blocks("LBL 1\nL IX+1\nFN 9: IF +0 EQU +0 GOTO LBL 1", settings).errors() ==
        Codes{"NC408"});
  CHECK(read_blocks("LBL 1\nCALL LBL 1", settings).errors() == Codes{"NC407"});
  CHECK(read_blocks("LBL 1\nL IX+1\nCALL LBL 1 REP 65000", settings).errors() == Codes{"NC408"});
  CHECK(read_blocks("CALL LBL 3").errors() == Codes{"NC406"});
  CHECK(read_blocks("LBL 3\nLBL 3").errors() == Codes{"NC406"});
  CHECK(read_blocks("CALL LBL 3\nSTOP M30\nLBL 3\nL X+1").errors() == Codes{"NC407"});
  const auto drilling = read_blocks(
      "CYCL DEF 1.0 PECKING\nCYCL DEF 1.1 DIST2\nCYCL DEF 1.2 DEPTH-1000\nCYCL DEF 1.3 "
      "PLNGNG0.001\n"
      "CYCL DEF 1.4 DWELL0\nCYCL DEF 1.5 F100\nCYCL CALL",
      settings);
  CHECK(drilling.errors() == Codes{"NC408"});
}

TEST_CASE("cycles: pecking and drilling", "[formats][heidenhain]") {
  const auto one = read_blocks(
      "CYCL DEF 1.0 PECKING\nCYCL DEF 1.1 DIST2\nCYCL DEF 1.2 DEPTH-7\nCYCL DEF 1.3 PECKG3\n"
      "CYCL DEF 1.4 DWELL1\nCYCL DEF 1.5 F120\nL X+5 FMAX M99");
  INFO(one.all_text());
  REQUIRE(one.ok);
  CHECK(one.places() == Places{"r 0 0 10", "r 5 0 10", "f 5 0 5", "r 5 0 10", "r 5 0 5.6",
                               "f 5 0 2", "r 5 0 10", "r 5 0 2.6", "f 5 0 1", "r 5 0 10"});
  CHECK(one.sink.dwells == std::vector<double>{1.0});
  CHECK(one.sink.motions[2].duration == Approx(5.0 / 2.0));
  const auto two = read_blocks(
      "CYCL DEF 200 BOHREN ~\nQ200=+2 ;SICHERHEITS-ABST. ~\nQ201=-5,5 ;TIEFE ~\nQ206=+150 "
      ";VORSCHUB ~\n"
      "Q202=+3 ;ZUSTELLUNG ~\nQ210=+0 ;VERWEILZEIT OBEN ~\nQ203=+1 ;KOOR. OBERFLAECHE ~\n"
      "Q204=+20 ;2. SICHERHEITS-ABST. ~\nQ211=+0.5 ;VERWEILZEIT UNTEN\nL X+1 Y+2 FMAX M99\nL X+4 "
      "FMAX\nCYCL CALL M9");
  INFO(two.all_text());
  REQUIRE(two.ok);
  const Places hole = {"r 1 2 3", "f 1 2 -2", "r 1 2 3", "r 1 2 0", "f 1 2 -4.5", "r 1 2 21"};
  const Places all = two.places();
  REQUIRE(all.size() == 15);
  CHECK(Places(all.begin() + 2, all.begin() + 8) == hole);
  CHECK(two.sink.calls.back() == "event coolant_off");
  CHECK(read_blocks("CYCL CALL").errors() == Codes{"NC414"});
  CHECK(read_blocks("CYCL DEF 200 B Q200=2 Q201=-5").errors() == Codes{"NC414"});
  CHECK(read_blocks("CYCL DEF 9.0 DWELL\nCYCL DEF 9.1 V.ZEIT 2,5").sink.dwells ==
        std::vector<double>{2.5});
}

TEST_CASE("tools: changes and speeds and lengths", "[formats][heidenhain]") {
  nc::InterpreterSettings settings;
  settings.tool_lengths[5] = 60.0;
  const auto r = read_blocks(
      "TOOL DEF 5 L+0 R+3\nTOOL CALL 5 Z S1000 F300\nM3\nTOOL CALL 5 Z S2000\nTOOL CALL Z S2000\n"
      "L X+1 Z+1 FMAX M8\nL X+2 M9\nTOOL CALL \"DRILL 8\" Z S500\nSTOP M5\nM13",
      settings);
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.events == Events{"tool_change tool=5", "spindle_on rpm=1000", "spindle_on rpm=2000",
                                "coolant_on", "coolant_off", "tool_change tool=DRILL 8",
                                "spindle_on rpm=500", "spindle_off", "stop", "spindle_on rpm=500",
                                "coolant_on"});
  CHECK(r.summary.tools == Events{"5", "DRILL 8"});
  CHECK(r.sink.motions[2].duration == Approx(1.0 / 5.0));
  CHECK(r.has("NC416"));
  CHECK(r.has("NC420"));
  const auto& calls = r.sink.calls;
  const auto at = [&](const char* text) { return std::find(calls.begin(), calls.end(), text); };
  CHECK(at("event coolant_on") < at("rapid 9"));
  CHECK(at("event coolant_off") > at("line 10"));
  CHECK(read_blocks("TOOL CALL 5 Z DL+0.1").errors() == Codes{"NC416"});
  CHECK(read_blocks("TOOL CALL 5 X").errors() == Codes{"NC402"});
  CHECK(read_blocks("TOOL CALL 5 Z DR+0.1\nM128\nLN X+1 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+1 FMAX")
            .errors() == Codes{"NC413"});
}

TEST_CASE("m functions: rows of the process table come first", "[formats][heidenhain]") {
  nc::InterpreterSettings settings;
  for (const auto& [name, text] : {std::pair<const char*, const char*>{"beam_on", "M3 S{power}"},
                                   {"gas", "M62"},
                                   {"clamp", "M10 P{n}"}}) {
    EventWords row;
    row.event = name;
    row.text = text;
    settings.process.events.push_back(row);
  }
  const auto r = read_blocks("TOOL CALL 1 Z S80\nM3\nL X+1 M62", settings);
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.events == Events{"tool_change tool=1", "beam_on power=80", "gas"});
  CHECK(read_blocks("M77", settings).errors() == Codes{"PR101"});
  CHECK(read_blocks("M10", settings).errors() == Codes{"PR103"});
  settings.process.unmapped = UnmappedWords::comment;
  CHECK(read_blocks("M77", settings).sink.comments == Events{"unmapped: M77"});
}

TEST_CASE("refusals: by name and with what to do", "[formats][heidenhain]") {
  struct Case {
    const char* blocks;
    const char* code;
    const char* word;
  };
  for (const Case& c : {Case{"L X+1 RL", "NC402", "RL"},
                        {"APPR LT X+1 LEN5 RL", "NC402", "APPR"},
                        {"DEP LT LEN5", "NC402", "DEP"},
                        {"FC DR- R5", "NC402", "FC"},
                        {"CALL PGM SUB", "NC402", "CALL PGM"},
                        {"FN 18: SYSREAD Q1 = ID270 NR1 IDX1\nL X+Q1", "NC402", "FN 18"},
                        {"CYCL DEF 19.0 WORKING PLANE\nCYCL DEF 19.1 B+5", "NC402", "CYCL DEF 19"},
                        {"CYCL DEF 207 TAPPING", "NC402", "CYCL DEF 207"},
                        {"CYCL DEF 8.0 MIRROR\nCYCL DEF 8.1 X", "NC402", "CYCL DEF 8"},
                        {"L X+1 M92", "NC402", "M92"},
                        {"L X+1 M140 MB MAX", "NC402", "M140"},
                        {"TCH PROBE 0.0 REF", "NC402", "TCH PROBE"},
                        {"SEL PGM \"A\"", "NC402", "SEL"},
                        {"FUNCTION TURNDATA", "NC402", "TURNDATA"},
                        {"L X+1 FU0.2", "NC402", "FU"},
                        {"HELLO WORLD", "NC403", "HELLO"},
                        {"L X+1 X+2", "NC404", "X"},
                        {"L X+1 Q", "NC404", "Q"},
                        {"L X+", "NC401", "missing"},
                        {"L X+Q3", "NC405", "Q3"},
                        {"L X+1 F100 FMAX", "NC404", "FMAX"},
                        {"L X+9999999", "NC401", "1000000"}}) {
    const auto r = read_blocks(c.blocks);
    INFO(c.blocks << "\n" << r.all_text());
    REQUIRE(r.errors() == Codes{c.code});
    const auto& d = *std::find_if(r.diagnostics.begin(), r.diagnostics.end(),
                                  [](const auto& x) { return x.severity == Severity::error; });
    CHECK(d.text.find(c.word) != std::string::npos);
    CHECK(d.where.line == 4);
    CHECK(d.where.column > 0);
  }
  CHECK(read_program("L X+1\n").errors() == Codes{"NC400", "NC409"});
  CHECK(read_program("").errors() == Codes{"NC400"});
  CHECK(read_program("BEGIN PGM A\nEND PGM A\n").errors() == Codes{"NC400"});
  nc::InterpreterSettings settings;
  settings.any_axis_needs_machine = true;
  CHECK(read_blocks("L A+5", settings).errors() == Codes{"NC412"});
  settings.any_axis_needs_machine = false;
  settings.axes = 0x17;
  CHECK(read_blocks("L A+5", settings).errors() == Codes{"NC412"});
}

TEST_CASE("text: places of blocks over several lines", "[formats][heidenhain]") {
  const auto r = read_program(
      "BEGIN PGM T MM\r\n1 ; a note ~\r\n2 L X+0 Y+0 Z+0 FMAX ; go\r\n3 CYCL DEF 200 X ~\r\n  "
      "Q200=Q9 ;A ~\r\n"
      "  Q201=1\r\n* - PART\r\n4 END PGM T MM\r\n");
  INFO(r.all_text());
  CHECK(r.errors() == Codes{"NC405"});
  CHECK(r.diagnostics.front().where.line == 5);
  CHECK(r.diagnostics.front().where.column == 8);
  CHECK(r.sink.comments == Events{"a note ~", "go", "A", "PART"});
}

}  // namespace smoothpost::test
