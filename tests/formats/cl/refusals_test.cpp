#include <catch2/catch.hpp>

#include "tests/formats/cl/recording.h"

namespace smoothpost::test {
namespace {

struct Refused {
  const char* text;
  const char* code;
  int line;
  int column;
  const char* names;  ///< what the message says
};

const char* const kHead = "UNITS/MM\nFEDRAT/600\nFROM/0,0,0\n";

}  // namespace

TEST_CASE("refusals: malformed programs with their place", "[formats][cl]") {
  const Refused kCases[] = {
      // The text.
      {"GOTO/1,2,3;", "CL101", 4, 11, ";"},
      {"#1=5", "CL101", 4, 1, "#"},
      {"P1=POINT/1,2", "CL101", 4, 3, "APT source"},
      {"GOTO/P1=3", "CL101", 4, 8, "APT source"},
      {"GOTO/\"1\",2,3", "CL101", 4, 6, "\""},
      {"GOTO/1,2.3.4,5", "CL102", 4, 8, "2.3.4"},
      {"GOTO/1,--2,5", "CL102", 4, 8, "--2"},
      {"GOTO/1,2,$\n   1e999", "CL102", 5, 4, "1e999"},
      {"GOTO/1,.,5", "CL102", 4, 8, "."},
      {"GOTO/1 2,3", "CL103", 4, 8, "`,`"},
      {"GOTO/- 1,2,3", "CL102", 4, 6, "-"},
      {"GOTO 1,2,3", "CL103", 4, 6, "GOTO"},
      {"GOTO-1,2,3", "CL103", 4, 5, "GOTO"},
      {"GOTO1,2,3", "CL103", 4, 5, "GOTO"},
      {"RAPID GOTO/1,2,3", "CL103", 4, 7, "RAPID"},
      {"GOTO/1,2,3,$", "CL110", 5, 1, "FINI"},
      {"GOTO/1,$ 2,3", "CL104", 4, 8, "$"},
      // Values.
      {"GOTO/1,2", "CL110", 4, 8, "2 values"},
      {"GOTO/1,2,3,4", "CL110", 4, 12, "4 values"},
      {"GOTO/", "CL110", 4, 1, "0 values"},
      {"GOTO/1,,3", "CL110", 4, 8, "missing"},
      {"GOTO/1,2,P3", "CL110", 4, 10, "P3"},
      {"GOTO/1,2,1O", "CL110", 4, 10, "1O"},
      {"GOTO/1,2,(3)", "CL110", 4, 10, "("},
      {"GOTO/1,5e6,0", "CL107", 4, 6, "1000000"},
      {"GOTO/1,2,3,0,0,0", "CL113", 4, 12, "axis"},
      {"TLAXIS/NORMPS,1,2", "CL110", 4, 8, "NORMPS"},
      {"TLAXIS/0,0,0", "CL113", 4, 8, "axis"},
      {"GODLTA/1,2", "CL110", 4, 10, "2 values"},
      {"MULTAX/1", "CL110", 4, 8, "MULTAX"},
      {"MULTAX/MAYBE", "CL110", 4, 8, "MAYBE"},
      {"MULTAX/OFF\nGOTO/1,2,3,0,0,1", "CL116", 5, 12, "MULTAX"},
      {"UNITS/FURLONGS", "CL111", 4, 7, "FURLONGS"},
      {"UNITS/25.4", "CL110", 4, 7, "UNITS"},
      {"RAPID/5", "CL110", 4, 7, "RAPID"},
      // Feeds and spindle.
      {"FEDRAT/0", "CL115", 4, 8, "above 0"},
      {"FEDRAT/-5,MMPM", "CL115", 4, 8, "above 0"},
      {"FEDRAT/MMPM", "CL115", 4, 1, "feed"},
      {"FEDRAT/5,FPM", "CL115", 4, 10, "FPM"},
      {"FEDRAT/INVERS,AUTO", "CL115", 4, 8, "INVERS"},
      {"FEDRAT/5,MMPM,IPM", "CL115", 4, 15, "IPM"},
      {"FEDRAT/1e30", "CL115", 4, 8, "1e30"},
      {"FEDRAT/0.1,MMPR\nGOTO/1,0,0", "CL115", 5, 1, "spindle"},
      {"SPINDL/200,SFM", "CL151", 4, 12, "SFM"},
      {"SPINDL/ON", "CL151", 4, 1, "speed"},
      {"SPINDL/-5", "CL151", 4, 8, "rpm"},
      {"SPINDL/LOCK", "CL151", 4, 8, "LOCK"},
      {"SPINDL", "CL151", 4, 1, "SPINDL"},
      {"LOADTL/1.5", "CL110", 4, 8, "1.5"},
      {"LOADTL", "CL110", 4, 1, "tool"},
      {"LOADTL/1,SPEED,5", "CL110", 4, 10, "SPEED"},
      {"LOAD/TOOL", "CL110", 4, 1, "tool"},
      {"DELAY/-1", "CL110", 4, 7, "dwell"},
      {"DELAY/2,REV", "CL110", 4, 9, "REV"},
      // Arcs.
      {"CIRCLE/0,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1\nGOTO/0,0,0", "CL120", 5, 1, "line 4"},
      {"CIRCLE/5,0,0,0,0,1\nGODLTA/1,2,3", "CL120", 5, 1, "line 4"},
      {"CIRCLE/5,0,0,0,0,1", "CL120", 5, 1, "line 4"},
      {"RAPID\nCIRCLE/5,0,0,0,0,1\nGOTO/10,0,0", "CL120", 5, 1, "rapid"},
      {"CIRCLE/5,0,0,0,0,1\nGOTO/11,0,0", "CL121", 5, 1, "5 mm at the start and 6 mm"},
      {"CIRCLE/0,0,0,0,0,1\nGOTO/0,0,0", "CL121", 5, 1, "radius is zero"},
      {"CIRCLE/5,0,0,0,0,1,-5\nGOTO/10,0,0", "CL121", 4, 20, "above 0"},
      {"CIRCLE/5,0,0,0,0,0\nGOTO/10,0,0", "CL113", 4, 14, "axis"},
      {"CIRCLE/5,0,0,5\nGOTO/10,0,0", "CL110", 4, 14, "4 values"},
      {"CIRCLE/5,0,0,0,0,1,5,0.1,0.5,10,0,TIMES,2\nGOTO/10,0,0", "CL150", 4, 35, "TIMES"},
      {"CIRCLE/5,0,0,0,0,1\nGOTO/5,-5,0\n5,5,0\n10,0,0", "CL121", 7, 1, "against the sense"},
      {"CIRCLE/5,0,0,0,0,1\nGOTO/5,-5,0\n5,5", "CL110", 6, 3, "2 values"},
      {"1,2,3", "CL124", 4, 1, "without a word"},
      {"GOTO/1,2,3\n4,5,6", "CL124", 5, 1, "without a word"},
      {"TLON,GOFWD/(CIRCLE/5,0,0,5),ON,(LINE/5,0,0,10,0,0)", "CL123", 4, 1, "INDIRV"},
      {"INDIRV/1,0,0\nTLON,GOFWD/(CIRCLE/5,0,0,5),ON,(LINE/5,0,0,10,0,0)", "CL123", 5, 1,
       "90 degrees"},
      {"INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/5,0,0,5),ON,(LINE/5,0,0,11,0,0)", "CL121", 5, 1, "6 mm"},
      {"INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/5,0,0,5),ON,(PLANE/1,0,0,5)", "CL123", 5, 33, "PLANE"},
      {"INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/5,0,0,5),PAST,(LINE/5,0,0,10,0,0)", "CL123", 5, 29,
       "PAST"},
      {"INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/5,0,0,5),ON,(LINE/5,0,0,10,0,0", "CL123", 5, 1, "early"},
      {"INDIRV/0,0,0", "CL113", 4, 1, "direction"},
      {"CYCLE/DRILL,FEDTO,1,RAPTO,1\nRAPID\nGOTO/1,0,0", "CL131", 6, 1, "RAPID"},
      {"CYCLE/DRILL,FEDTO,1,RAPTO,1\nGODLTA/1,0,0", "CL131", 5, 1, "GODLTA"},
  };
  for (const Refused& c : kCases) {
    INFO(c.text);
    const ClRun r = read_cl(kHead + std::string(c.text) + "\nFINI\n");
    INFO(r.all_text());
    CHECK_FALSE(r.ok);
    REQUIRE(r.errors() == std::vector<std::string>{c.code});
    const auto error =
        std::find_if(r.diagnostics.begin(), r.diagnostics.end(),
                     [](const Diagnostic& d) { return d.severity == Severity::error; });
    CHECK(error->where.file == "t.apt");
    CHECK(error->where.line == c.line);
    CHECK(error->where.column == c.column);
    CHECK(error->text.find(c.names) != std::string::npos);
  }
}

TEST_CASE("refusals: what a position has to be known for", "[formats][cl]") {
  const auto first_error = [](const std::string& lines) {
    const ClRun r = read_cl("UNITS/MM\nFEDRAT/600\n" + lines + "\nFINI\n");
    return r.errors().empty() ? std::string() : r.errors().front();
  };
  CHECK(first_error("GODLTA/1,2,3") == "CL125");
  CHECK(first_error("CIRCLE/0,0,0,0,0,1\nGOTO/1,0,0") == "CL125");
  CHECK(first_error("INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/5,0,0,5),ON,(LINE/5,0,0,10,0,0)") == "CL125");
  CHECK(first_error("CYCLE/DRILL,FEDTO,1,RAPTO,1,RTRCTO,AUTO\nGOTO/1,2,3") == "CL131");
}

TEST_CASE("refusals: a feed motion without feed is told once", "[formats][cl]") {
  const ClRun r =
      read_cl("UNITS/MM\nFROM/0,0,0\nRAPID\nGOTO/1,0,0\nGOTO/2,0,0\nGOTO/3,0,0\nFINI\n");
  CHECK_FALSE(r.ok);
  CHECK(r.errors() == std::vector<std::string>{"CL114"});
  CHECK(r.diagnostics.front().where.line == 5);
}

TEST_CASE("refusals: a binary file is one message", "[formats][cl]") {
  const ClRun r = read_cl(std::string("\x11\0\xe8\x1c\0\0pmill", 11));
  CHECK_FALSE(r.ok);
  CHECK(r.errors() == std::vector<std::string>{"CL106"});
}

TEST_CASE("refusals: at most a hundred errors and their count", "[formats][cl]") {
  std::string text;
  for (int i = 0; i < 250; ++i) text += "GOTO/1\n";
  const ClRun r = read_lines(text);
  CHECK(r.errors().size() == 100);
  REQUIRE(r.diagnostics.back().code == "CL100");
  CHECK(r.diagnostics.back().text.find("250") != std::string::npos);
}

TEST_CASE("refusals: an empty text is no program but no error either", "[formats][cl]") {
  const ClRun r = read_cl("");
  CHECK(r.ok);
  CHECK(r.sink.calls.empty());
  CHECK(r.has("CL162"));
}

}  // namespace smoothpost::test
