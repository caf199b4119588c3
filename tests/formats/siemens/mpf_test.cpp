#include <catch2/catch.hpp>

#include "formats/siemens/mpf_reader.h"
#include "tests/support/support.h"

using namespace smoothpost;
using siemens::parse_mpf;

TEST_CASE("mpf reader: blocks and words with their places", "[formats][siemens]") {
  const auto parsed = parse_mpf(
      "%_N_CAM_MPF\n; title\nN10 TRAORI\nN20 G1 X10.5 Y-.25 A3=0.6 B3 = 0 C3=-0.8 F12 ; tail\r\n"
      "N30 CUT_7: G0 SUPA D0\nMSG(\"a;b\")\nN40 TRAFOOF\nN50 M30\n",
      "p.mpf");
  for (const auto& d : parsed.diagnostics) UNSCOPED_INFO(to_string(d));
  // "B3 = 0" has blanks around = : not a word of ours.
  REQUIRE(parsed.diagnostics.size() == 1);
  const auto good = parse_mpf(
      "N10 TRAORI\nN20 G1 X10.5 Y-.25 A3=0.6 B3=0 C3=-0.8 F12 ; tail\r\n"
      "N30 CUT_7: G0 SUPA D0\nMSG(\"a;b\")\nN40 TRAFOOF\nN50 M30\n",
      "p.mpf");
  for (const auto& d : good.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(good.diagnostics.empty());
  const auto& blocks = good.program.blocks;
  REQUIRE(blocks.size() == 6);
  CHECK(blocks[0].has("TRAORI"));
  CHECK(blocks[1].line == 2);
  CHECK(blocks[1].find("X")->value == 10.5);
  CHECK(blocks[1].find("Y")->value == -0.25);
  CHECK(blocks[1].find("C3")->value == -0.8);
  CHECK(blocks[1].has('G', 1.0));
  CHECK(blocks[2].label == "CUT_7");
  CHECK(blocks[2].has("SUPA"));
  CHECK(blocks[2].find("D")->value == 0.0);
  CHECK_FALSE(blocks[3].is_words);
  CHECK(blocks[3].text == "MSG(\"a;b\")");
  CHECK(good.program.end_line == 6);
}

TEST_CASE("mpf reader: malformed programs are refused", "[formats][siemens]") {
  const char* const kBad[] = {
      "N10 G0 X1\nN10 G0 X2\nM30\n",                   // N does not rise
      "N20 G0 X1\nN10 G0 X2\nM30\n",                   // N falls
      "G1 A3=0 B3=0 C3=1\nM30\n",                      // vector before TRAORI
      "TRAORI\nTRAFOOF\nG1 A3=0 B3=0 C3=1\nM30\n",     // and behind TRAFOOF
      "TRAORI\nG1 A3=0 B3=0 C3=1\nM30\n",              // no TRAFOOF before M30
      "TRAORI\nG1 X1 A3=0 B3=0 C3=0\nTRAFOOF\nM30\n",  // vector 0
      "G0 G1 X1\nM30\n",                               // two motions
      "G1 X1 X2\nM30\n",                               // axis twice
      "G1 X1\n",                                       // no end
      "M30\nG0 X1\n",                                  // behind the end
      "G1 X1.2.3\nM30\n",                              // no number
      "G1 X1e3\nM30\n",                                // exponent
      "G1 X\nM30\n",                                   // axis without number
      "MSG(\"open)\nM30\n",                            // quote
      "IF (R1>2 GOTOF AA\nAA:\nM30\n",                 // bracket
      "GOTOF NOWHERE\nM30\n",                          // no label
      "AA:\nGOTOF AA\nM30\n",                          // label behind us
      "AA:\nAA:\nM30\n",                               // label twice
      "X+\nM30\n",
      "@!\nM30\n",
  };
  for (const char* bad : kBad) {
    INFO(bad);
    const auto parsed = parse_mpf(bad, "p.mpf");
    REQUIRE_FALSE(parsed.diagnostics.empty());
    CHECK(parsed.diagnostics[0].code.substr(0, 4) == "NC32");
    CHECK(parsed.diagnostics[0].where.line > 0);
  }
  CHECK(parse_mpf("AA:\nGOTOB AA\nGOTOF BB\nBB:\nM30\n", "p").diagnostics.empty());
}
