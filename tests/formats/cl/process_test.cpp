#include <catch2/catch.hpp>

#include "tests/formats/cl/recording.h"

namespace smoothpost::test {
namespace {

using Lines = std::vector<std::string>;

ClRun with_row(const char* name, const char* text, const std::string& lines) {
  cl::ReaderSettings settings;
  EventWords row;
  row.event = name;
  row.text = text;
  settings.process.events.push_back(row);
  return read_lines(lines, settings);
}

}  // namespace

TEST_CASE("process: SPINDL in every order", "[formats][cl]") {
  const struct {
    const char* lines;
    Lines events;
  } kCases[] = {
      {"SPINDL/630", {"spindle_on rpm=630"}},
      {"SPINDL/630,RPM", {"spindle_on rpm=630"}},
      {"SPINDL/630,RPM,CLW", {"spindle_on rpm=630"}},
      {"SPINDL/630.5,CCLW", {"spindle_on_reverse rpm=630.5"}},
      {"SPINDL/RPM,100000,CCLW", {"spindle_on_reverse rpm=100000"}},
      {"SPINDL/CCLW,RPM,5", {"spindle_on_reverse rpm=5"}},
      {"SPINDL/5,CCLW\nSPINDL/7", {"spindle_on_reverse rpm=5", "spindle_on_reverse rpm=7"}},
      {"SPINDL/5\nSPINDL/OFF\nSPINDL/ON", {"spindle_on rpm=5", "spindle_off", "spindle_on rpm=5"}},
      {"SPINDL/5\nSPINDL/CCLW", {"spindle_on rpm=5", "spindle_on_reverse rpm=5"}},
      {"SPINDL/0,RPM", {"spindle_off"}},
  };
  for (const auto& c : kCases) {
    INFO(c.lines);
    const ClRun r = read_lines(c.lines);
    INFO(r.all_text());
    REQUIRE(r.ok);
    CHECK(r.sink.events == c.events);
  }
}

TEST_CASE("process: tools", "[formats][cl]") {
  const ClRun r = read_lines(
      "LOADTL/3\nLOAD/TOOL,14\nLOADTL/5,ADJUST,5\nLOADTL/MILL_D10\nSELECT/TOOL,9\nLOADTL/"
      "7.,LENGTH,80.");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.events == Lines{"tool_change tool=3", "tool_change tool=14", "tool_change tool=5",
                               "tool_change tool=MILL_D10", "tool_change tool=7"});
  CHECK(r.summary.tools == Lines{"3", "14", "5", "MILL_D10", "7"});
}

TEST_CASE("process: a TOOLNO that nothing loads is told", "[formats][cl]") {
  CHECK(read_lines("TOOLNO/4,MILL,1,0, 14.1,,5\nGOTO/1,0,0").has("CL168"));
  CHECK_FALSE(read_lines("TOOLNO/4,MILL\nLOADTL/4\nGOTO/1,0,0").has("CL168"));
  CHECK_FALSE(read_lines("LOADTL/4\nTOOLNO/4,MILL\nGOTO/1,0,0").has("CL168"));
}

TEST_CASE("process: coolant stops and dwells", "[formats][cl]") {
  const ClRun r = read_lines(
      "COOLNT/ON\nCOOLNT/FLOOD\nCOOLNT/MIST\nCOOLNT/OFF\nSTOP\nOPSTOP\nDELAY/2.5\nDWELL/1");
  REQUIRE(r.ok);
  CHECK(r.sink.events ==
        Lines{"coolant_on", "coolant_on", "coolant_mist", "coolant_off", "stop", "optional_stop"});
  CHECK(r.sink.dwells == std::vector<double>{2.5, 1.0});
}

TEST_CASE("process: events stand between the motions of their place", "[formats][cl]") {
  const ClRun r = read_lines(
      "GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nCOOLNT/ON\nGOTO/0,10,0\nCOOLNT/OFF\nGOTO/0,20,0");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.calls ==
        Lines{"rapid 3", "line 4", "event coolant_on", "arc 7", "event coolant_off", "line 9"});
}

TEST_CASE("process: texts and descriptions are comments", "[formats][cl]") {
  const ClRun r = read_cl(
      "PARTNO/P 1\n$$ made here\nREMARK about\nPPRINT  TOOL 5\nMACHIN/PWORKS, 0\nUNITS/MM\n"
      "CUTTER/ 10.0,$\n 0.5\nTPRINT/T1 End Mill\nTOOL PATH/A,TOOL,B\nTLDATA/MILL,1,2\n"
      "CSI_SET_FLUTE_LENGTH/25.\nSETUP/START,1\nGOTO/1,2,3 $$ first\nPAINT/PATH\n$$\nFINI\n");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.comments == Lines{"PARTNO/P 1", "made here", "about", "TOOL 5", "MACHIN/PWORKS, 0",
                                 "CUTTER/ 10.0,0.5", "TPRINT/T1 End Mill", "TOOL PATH/A,TOOL,B",
                                 "TLDATA/MILL,1,2", "CSI_SET_FLUTE_LENGTH/25.", "SETUP/START,1",
                                 "first"});
}

TEST_CASE("process: words without meaning are refused or comments on the user's word",
          "[formats][cl]") {
  const std::string lines = "INSERT/M 8 (gas)\nAUXFUN/10,$\n 2\nCOOLNT/TAPKUL\nLOAD/WIRE";
  const ClRun refused = read_lines(lines);
  CHECK_FALSE(refused.ok);
  CHECK(refused.errors() == Lines{"PR101", "PR101", "PR101", "PR101"});
  CHECK(refused.diagnostics[0].text.find("INSERT/M 8 (gas)") != std::string::npos);
  CHECK(refused.diagnostics[1].where.line == 5);
  cl::ReaderSettings settings;
  settings.process.unmapped = UnmappedWords::comment;
  const ClRun kept = read_lines(lines, settings);
  REQUIRE(kept.ok);
  CHECK(kept.sink.comments == Lines{"unmapped: INSERT/M 8 (gas)", "unmapped: AUXFUN/10,2",
                                    "unmapped: COOLNT/TAPKUL", "unmapped: LOAD/WIRE"});
  CHECK(kept.sink.events.empty());
}

TEST_CASE("process: words that would move the tool are refused even then", "[formats][cl]") {
  cl::ReaderSettings settings;
  settings.process.unmapped = UnmappedWords::comment;
  for (const char* statement :
       {"ORIGIN/1,2,3", "TRANS/0,0,5", "ROTABL/45", "TRACUT/NOMORE", "COPY/1,SAME,2", "GOHOME",
        "NURBS/1", "DNTCUT", "PSIS/PL1", "CALL/SUB", "THREAD/TURN"}) {
    INFO(statement);
    const ClRun r = read_lines(std::string(statement) + "\nGOTO/1,2,3", settings);
    CHECK_FALSE(r.ok);
    CHECK(r.errors() == Lines{"CL150"});
    CHECK(r.diagnostics.front().where.line == 4);
    const std::string text = r.diagnostics.front().text;
    const std::string word = statement;
    CHECK(text.find(word.substr(0, word.find('/'))) == 0);
  }
}

TEST_CASE("process: rows of the table are read as statements", "[formats][cl]") {
  CHECK(with_row("beam_on", "AUXFUN/10", "AUXFUN / 10").sink.events == Lines{"beam_on"});
  CHECK(with_row("power", "AUXFUN/20,{percent}", "auxfun/20, 35.5").sink.events ==
        Lines{"power percent=35.5"});
  CHECK(with_row("gas_on", "INSERT/GAS ON", "INSERT GAS  ON").sink.events == Lines{"gas_on"});
  CHECK(with_row("message", "PPRINT/{text}", "PPRINT Tool 5, new").sink.events ==
        Lines{"message text=Tool 5, new"});
  CHECK(with_row("gas_on", "COOLNT/FLOOD", "COOLNT/FLOOD\nCOOLNT/MIST").sink.events ==
        Lines{"gas_on", "coolant_mist"});
  // No row for this value; NC words never fit.
  CHECK(with_row("beam_on", "AUXFUN/10", "AUXFUN/11").errors() == Lines{"PR101"});
  CHECK(with_row("power", "AUXFUN/{n}", "AUXFUN/11,12").errors() == Lines{"PR101"});
  CHECK(with_row("spindle_on", "M3 S{rpm}", "M3").errors() == Lines{"PR101"});
  // A row cannot take a motion away.
  CHECK(with_row("beam_on", "GOTO/1,2,3", "GOTO/1,2,3").sink.events.empty());
}

TEST_CASE("process: CUTCOM is told once", "[formats][cl]") {
  const ClRun r =
      read_lines("CUTCOM/LEFT\nGOTO/1,0,0\nCUTCOM/OFF\nCUTCOM/RIGHT,XYPLAN\nGOTO/2,0,0");
  REQUIRE(r.ok);
  CHECK(r.codes(Severity::warning) == Lines{"CL160"});
  CHECK_FALSE(read_lines("CUTCOM/OFF").has("CL160"));
}

}  // namespace smoothpost::test
