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

TEST_CASE("mpf reader: polynomials", "[formats][siemens]") {
  const auto parsed = parse_mpf(
      "UPATH\nN20 POLY PO[X]=(10,-.5,2) po[y]=(3) Z5 PL=1 F12\n"
      "N30 POLY X=PO(-10.5,1,2,3,4) C=PO(0,0.25) PL=99999.9999 F3\nM30\n",
      "p.mpf");
  for (const auto& d : parsed.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(parsed.diagnostics.empty());
  const auto& cubic = parsed.program.blocks[1];
  REQUIRE(cubic.is_words);
  CHECK(cubic.has("POLY"));
  CHECK(cubic.find("X")->polynomial);
  CHECK(cubic.find("X")->value == 10.0);
  CHECK(cubic.find("X")->higher == std::vector<double>{-0.5, 2.0});
  CHECK(cubic.find("Y")->polynomial);
  CHECK(cubic.find("Y")->higher.empty());
  CHECK_FALSE(cubic.find("Z")->polynomial);
  CHECK(cubic.find("PL")->value == 1.0);
  const auto& quintic = parsed.program.blocks[2];
  CHECK(quintic.find("X")->value == -10.5);
  CHECK(quintic.find("X")->higher == std::vector<double>{1.0, 2.0, 3.0, 4.0});
  CHECK(quintic.find("C")->higher == std::vector<double>{0.25});
}

TEST_CASE("mpf reader: malformed polynomials are refused", "[formats][siemens]") {
  const char* const kBad[] = {
      "POLY PO[X]=(1,2,3,4) PL=1\nM30\n",        // four numbers in the notation of degree 3
      "POLY X=PO(1,2,3,4,5,6) PL=1\nM30\n",      // six in that of degree 5
      "POLY X=PO() PL=1\nM30\n",                 // none
      "POLY X=PO(1,,3) PL=1\nM30\n",             // a number is missing
      "POLY X=PO(1,2 PL=1\nM30\n",               // bracket
      "POLY X=PO(1,2.5.1) PL=1\nM30\n",          // no number
      "POLY X=PO(1,2E3) PL=1\nM30\n",            // exponent
      "POLY PO[]=(1,2) PL=1\nM30\n",             // a denominator
      "POLY PO[X=(1,2) PL=1\nM30\n",             // bracket
      "POLY PO[X]=(1,2)Y3 PL=1\nM30\n",          // no blank behind it
      "POLY PO[X]=(1,2) X=PO(1,2) PL=1\nM30\n",  // an axis twice
      "POLY PO[X]=(1,2) X3 PL=1\nM30\n",         // likewise
      "POLY PO[X]=(1,2)\nM30\n",                 // no PL
      "POLY PO[X]=(1,2) PL=0\nM30\n",            // PL out of range
      "POLY PO[X]=(1,2) PL=100000\nM30\n",       // likewise
      "POLY PO[X]=(1,2) PO[PL]=(1)\nM30\n",      // PL is no axis
      "POLY X1 PL=1\nM30\n",                     // no polynomial
      "G1 PO[X]=(1,2) PL=1\nM30\n",              // polynomial without POLY
      "G1 X1 PL=1\nM30\n",                       // PL without POLY
      "G1 POLY PO[X]=(1,2) PL=1\nM30\n",         // two motions
      "POLY=3 PO[X]=(1,2) PL=1\nM30\n",          // POLY is a keyword
  };
  for (const char* bad : kBad) {
    INFO(bad);
    const auto parsed = parse_mpf(bad, "p.mpf");
    REQUIRE_FALSE(parsed.diagnostics.empty());
    CHECK(parsed.diagnostics[0].code == "NC326");
    CHECK(parsed.diagnostics[0].where.line == 1);
  }
}
