#include <catch2/catch.hpp>

#include "formats/robot/krl_reader.h"
#include "tests/support/support.h"

using namespace smoothpost;
using krl::Statement;

namespace {

krl::ParsedKrl body(const std::string& statements) {
  return krl::parse("&ACCESS RVP\nDEF p( )\n" + statements + "\nEND\n", "p.src");
}

Statement one(const std::string& statement) {
  const auto parsed = body(statement);
  for (const auto& d : parsed.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(parsed.diagnostics.empty());
  REQUIRE(parsed.program.statements.size() == 1);
  return parsed.program.statements[0];
}

}  // namespace

TEST_CASE("krl reader: statements with their values and places", "[formats][robot]") {
  const auto ptp = one("  PTP {A1 10.5, A2 -90,E1 +.25} C_PTP ; comment");
  CHECK(ptp.kind == Statement::Kind::motion);
  CHECK(ptp.name == "PTP");
  CHECK(ptp.line == 3);
  CHECK(ptp.column == 3);
  CHECK(ptp.aggregate.find("A1") == 10.5);
  CHECK(ptp.aggregate.find("A2") == -90.0);
  CHECK(ptp.aggregate.find("E1") == 0.25);
  CHECK_FALSE(ptp.aggregate.find("A3"));
  CHECK(ptp.blend == "C_PTP");
  const auto lin = one("lin {x 1,y 2,z 3,a 4,b 5,c 6}");
  CHECK(lin.name == "LIN");
  CHECK(lin.aggregate.find("C") == 6.0);
  const auto trigger = one("TRIGGER WHEN DISTANCE=1 DELAY=-5 DO $OUT[1]=FALSE");
  CHECK(trigger.distance == 1);
  CHECK(trigger.number == -5.0);
  CHECK(trigger.body == "$OUT[1]=FALSE");
  const auto call = one("CUT_ON(1,\"a;b\") ; tail");
  CHECK(call.kind == Statement::Kind::call);
  CHECK(call.name == "CUT_ON");
  CHECK(call.value == "1,\"a;b\"");
  const auto set = one("$VEL.CP = 0.05");
  CHECK(set.kind == Statement::Kind::assignment);
  CHECK(set.name == "$VEL.CP");
  CHECK(set.number == 0.05);
  CHECK(one("$BASE=BASE_DATA[1]").value == "BASE_DATA[1]");
  CHECK(one("WAIT SEC 0.3").number == 0.3);
  CHECK(one("HALT").kind == Statement::Kind::halt);
  const auto path = one("trigger when path=-2.5 delay=-4 do $OUT[1]=TRUE");
  CHECK(path.by_path);
  CHECK(path.distance == 1);
  CHECK(path.path == -2.5);
  CHECK(path.number == -4.0);
}

TEST_CASE("krl reader: spline blocks", "[formats][robot]") {
  const auto parsed = body(
      "SPLINE WITH $VEL.CP=0.05\nSPL {X 1,Y 2,Z 3,A 4,B 5,C 6}\n; a comment\n"
      "TRIGGER WHEN PATH=0 ONSTART DELAY=0 DO $OUT[1]=TRUE\n"
      "SPL {X 2,Y 2,Z 3,A 4,B 5,C 6,E1 7} WITH $VEL.CP = 0.025\nENDSPLINE\n"
      "spline\nspl {x 1,y 2,z 3,a 4,b 5,c 6}\nendspline");
  for (const auto& d : parsed.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(parsed.diagnostics.empty());
  const auto& s = parsed.program.statements;
  REQUIRE(s.size() == 8);
  CHECK(s[0].kind == Statement::Kind::spline_begin);
  CHECK(s[0].speed == 0.05);
  CHECK(s[1].kind == Statement::Kind::motion);
  CHECK(s[1].name == "SPL");
  CHECK_FALSE(s[1].speed);
  CHECK(s[2].by_path);
  CHECK(s[2].distance == 0);
  CHECK(s[2].path == 0.0);
  CHECK(s[3].speed == 0.025);
  CHECK(s[3].aggregate.find("E1") == 7.0);
  CHECK(s[4].kind == Statement::Kind::spline_end);
  CHECK_FALSE(s[5].speed);
}

TEST_CASE("krl reader: malformed spline blocks are refused", "[formats][robot]") {
  const std::string point = "SPL {X 1,Y 2,Z 3,A 4,B 5,C 6}";
  const std::vector<std::string> bad = {
      "SPLINE\nENDSPLINE",
      "SPLINE\n" + point,
      "ENDSPLINE",
      point,
      "SPLINE\n" + point + "\nSPLINE\nENDSPLINE",
      "SPLINE\n" + point + " C_DIS\nENDSPLINE",
      "SPLINE\n" + point + "\nENDSPLINE C_SPL",
      "SPLINE WITH $VEL.CP=0\n" + point + "\nENDSPLINE",
      "SPLINE WITH $VEL.CP=-1\n" + point + "\nENDSPLINE",
      "SPLINE WITH $VEL.CP\n" + point + "\nENDSPLINE",
      "SPLINE WITH $ACC.CP=1\n" + point + "\nENDSPLINE",
      "SPLINE\n" + point + " WITH $VEL.CP=0.1,$ACC.CP=1\nENDSPLINE",
      "SPLINE\nSPL {X 1,Y 2,Z 3,A 4,B 5}\nENDSPLINE",
      "SPLINE\nSPL {A1 1}\nENDSPLINE",
      "SPLINE\nLIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n" + point + "\nENDSPLINE",
      "SPLINE\n$OUT[1]=TRUE\n" + point + "\nENDSPLINE",
      "SPLINE\nWAIT SEC 1\n" + point + "\nENDSPLINE",
      "SPLINE\nTRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE\n" + point + "\nENDSPLINE",
      "TRIGGER WHEN PATH= DELAY=0 DO $OUT[1]=TRUE",
      "TRIGGER WHEN PATH=0 ONEND DELAY=0 DO $OUT[1]=TRUE",
      "TRIGGER WHEN SPEED=0 DELAY=0 DO $OUT[1]=TRUE",
      "TRIGGER WHEN DISTANCE=0 DELAY=0 DO ENDSPLINE",
  };
  for (const auto& text : bad) {
    INFO(text);
    const auto parsed = body(text);
    REQUIRE_FALSE(parsed.diagnostics.empty());
    CHECK(parsed.diagnostics[0].code.substr(0, 4) == "NC32");
  }
}

TEST_CASE("krl reader: reads a program written for a KR C4", "[formats][robot]") {
  // The shape of a KUKA program with folds and an interrupt; poses only as LIN.
  const auto parsed = krl::parse(
      "&ACCESS RVP\r\n&REL 1\r\n&PARAM TEMPLATE = C:\\KRC\\vorgabe\r\nDEF cam6( )\r\n;FOLD "
      "INI;%{PE}\r\n"
      "  GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )\r\n  INTERRUPT ON 3\r\n"
      "  BAS (#INITMOV,0 )\r\n;ENDFOLD (INI)\r\n$BASE = BASE_DATA[1]\r\n"
      "PTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0,E1 0}\r\n"
      "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE\r\n"
      "LIN {X 800,Y 0,Z 500,A 0,B 90,C 0} C_DIS\r\nEND\r\n",
      "cam6.src");
  CHECK(parsed.diagnostics.empty());
  CHECK(parsed.program.name == "CAM6");
  CHECK(parsed.program.statements.size() == 7);
  CHECK(parsed.program.end_line == 14);
}

TEST_CASE("krl reader: malformed programs are refused", "[formats][robot]") {
  const char* const kBad[] = {
      "LIN {X 1,Y 2,Z 3,A 4,B 5}",                  // no C
      "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6",               // no }
      "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6,A1 0}",         // two families
      "LIN {X 1,X 2,Z 3,A 4,B 5,C 6}",              // key twice
      "LIN {X 1e3,Y 2,Z 3,A 4,B 5,C 6}",            // exponent
      "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6} C_PTP",        // approximation of PTP
      "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6} C_DIS C_ORI",  // two words
      "LIN {X 1,Y ,Z 3,A 4,B 5,C 6}",               // no number
      "PTP {A1 0,A7 0}",                            // no such axis
      "PTP {X 1,Y 2,Z 3,A 4,B 5,C 6}",              // pose in PTP
      "PTP A1 0",                                   // no {
      "TRIGGER WHEN DISTANCE=2 DELAY=0 DO $OUT[1]=TRUE",
      "TRIGGER WHEN DISTANCE=0 DO $OUT[1]=TRUE",
      "TRIGGER WHEN DISTANCE=0 DELAY=0 DO",
      "TRIGGER WHEN DISTANCE=0 DELAY=0 DO LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}",
      "WAIT SEC -1",
      "WAIT FOR $IN[1]",
      "$OUT[0]=TRUE",
      "$OUT[1]=",
      "SPL {X 1}",
      "GOTO X1",
      "MSG(\"open",
      "F((1)",
      "DECL INT I",
      "10 PTP",
  };
  for (const char* bad : kBad) {
    INFO(bad);
    const auto parsed = body(bad);
    REQUIRE_FALSE(parsed.diagnostics.empty());
    CHECK(parsed.diagnostics[0].where.line == 3);
    CHECK(parsed.diagnostics[0].code.substr(0, 4) == "NC32");
  }
  CHECK_FALSE(krl::parse("DEF p( )\nHALT\n", "p").diagnostics.empty());       // no END
  CHECK_FALSE(krl::parse("HALT\nEND\n", "p").diagnostics.empty());            // no DEF
  CHECK_FALSE(krl::parse("DEF p( )\nEND\nHALT\n", "p").diagnostics.empty());  // behind END
  CHECK_FALSE(krl::parse("DEF p\nEND\n", "p").diagnostics.empty());           // no ( )
  CHECK_FALSE(krl::parse("", "p").diagnostics.empty());
}
