#include <catch2/catch.hpp>
#include <random>

#include "formats/robot/rapid_reader.h"
#include "tests/support/support.h"

using namespace smoothpost;
using rapid::Statement;
using rapid::Value;

namespace {

rapid::ParsedRapid body(const std::string& statements) {
  return rapid::parse("MODULE m\nPROC main()\n" + statements + "\nENDPROC\nENDMODULE\n", "m.mod");
}

rapid::ParsedRapid data(const std::string& declarations) {
  return rapid::parse("MODULE m\n\n" + declarations + "\nPROC main()\nStop;\nENDPROC\nENDMODULE\n",
                      "m.mod");
}

Statement one(const std::string& statement) {
  const auto parsed = body(statement);
  for (const auto& d : parsed.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(parsed.diagnostics.empty());
  REQUIRE(parsed.program.procedures.size() == 1);
  REQUIRE(parsed.program.procedures[0].statements.size() == 1);
  return parsed.program.procedures[0].statements[0];
}

// The shape of a program for a laser robot, without its arcs and joint moves to poses.
const char* const kProgram =
    "MODULE cam6\r\n"
    "  ! units: mm, deg, s; quaternion order q1=w\r\n"
    "  PERS tooldata tLaser := [TRUE,[[0,0,250],[1,0,0,0]],[5,[0,0,100],[1,0,0,0],0,0,0]];\r\n"
    "  PERS wobjdata wPart := [FALSE,TRUE,\"\",[[800,0,500],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\r\n"
    "  CONST speeddata vCut := [50,200,5000,1000];\r\n"
    "  CONST zonedata zCut := [FALSE,0.5,0.5,0.5,0.5,0.5,0.5];\r\n"
    "  CONST jointtarget jHome := [[0,0,0,0,45,0],[9E9,9E9,9E9,9E9,9E+09,9E9]];\r\n"
    "  CONST robtarget p10 := [[0,0,50],[0,0.707107,0.707107,0],[0,0,0,0],\r\n"
    "    [9E9,9E9,9E9,9E9,9E9,9E9]];\r\n"
    "  VAR triggdata trigOn;\r\n"
    "  PROC main()\r\n"
    "    ConfL\\Off;\r\n"
    "    SingArea\\Wrist;\r\n"
    "    TriggIO trigOn, 0\\Start\\DOp:=doLaser, 1;\r\n"
    "    MoveAbsJ jHome, v200, fine, tLaser\\WObj:=wPart;\r\n"
    "  cut_1:\r\n"
    "    TriggL [[50,0,0],[0,0.707107,0.707107,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], vCut, "
    "trigOn\\T2:=trigOn, zCut, tLaser\\WObj:=wPart; ! on\r\n"
    "    MoveL p10, vCut, fine, tLaser\\WObj:=wPart;\r\n"
    "  ENDPROC\r\n"
    "ENDMODULE\r\n";

}  // namespace

TEST_CASE("rapid reader: statements with their values and places", "[formats][robot]") {
  const auto move =
      one("  movel [[1,-2.5,+.25],[1,0,0,0],[0,-1,2,4],[9E9,10,9E9,9E9,9E9,9E9]],\n vCut\\T:=1.5 , "
          "z_1, T1\\WObj:=w; ! tail");
  CHECK(move.kind == Statement::Kind::move);
  CHECK(move.name == "MOVEL");
  CHECK(move.line == 3);
  CHECK(move.column == 3);
  REQUIRE(move.positional(0));
  const auto& target = move.positional(0)->items;
  CHECK(target[0].items[1].number == -2.5);
  CHECK(target[0].items[2].number == 0.25);
  CHECK(target[2].items[3].number == 4.0);
  CHECK(target[3].items[0].number == 9e9);
  CHECK(move.positional(1)->text == "VCUT");
  CHECK(move.positional(2)->text == "Z_1");
  CHECK(move.positional(2)->line == 4);
  CHECK(move.find("T")->number == 1.5);
  CHECK(move.find("WObj") == nullptr);
  CHECK(move.find("WOBJ")->text == "W");
  CHECK(move.positional(4) == nullptr);
  const auto joints =
      one("MoveAbsJ [[0,-90,90,0,45,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v,fine,t;");
  CHECK(joints.has("NOEOFFS"));
  CHECK(joints.positional(0)->items[0].items[1].number == -90.0);
  const auto trigger = one("TriggEquip t, 10\\Start, 0.1\\DOp:=gun, 1;");
  CHECK(trigger.kind == Statement::Kind::trigger);
  CHECK(trigger.positional(2)->number == 0.1);
  CHECK(trigger.find("DOP")->text == "GUN");
  CHECK(one("WaitTime\\InPos, 0.3;").positional(0)->number == 0.3);
  CHECK(one("WaitTime 2;").kind == Statement::Kind::wait);
  CHECK(one("Stop;").kind == Statement::Kind::stop);
  CHECK(one("SingArea\\Off;").has("OFF"));
  const auto call = one("cut_7 : SpindleCW  630,\"a \"\"b\"\"; ! c\" ;");
  CHECK(call.kind == Statement::Kind::procedure);
  CHECK(call.label == "CUT_7");
  CHECK(call.name == "SPINDLECW");
  CHECK(call.text == "SpindleCW 630,\"a \"\"b\"\"; ! c\"");
  CHECK(call.positional(1)->text == "a \"b\"; ! c");
  CHECK(one("PDispOff;").arguments.empty());
}

TEST_CASE("rapid reader: a whole module", "[formats][robot]") {
  const auto parsed = rapid::parse(kProgram, "cam6.mod");
  for (const auto& d : parsed.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(parsed.diagnostics.empty());
  CHECK(parsed.program.name == "CAM6");
  REQUIRE(parsed.program.declarations.size() == 7);
  CHECK(parsed.program.declarations[5].line == 8);
  CHECK(parsed.program.declarations[0].value->items[2].items[0].number == 5.0);
  REQUIRE(parsed.program.procedures.size() == 1);
  const auto& statements = parsed.program.procedures[0].statements;
  REQUIRE(statements.size() == 6);
  CHECK(statements[4].label == "CUT_1");
  CHECK(statements[4].line == 17);
  CHECK(parsed.program.end_line == 20);
  CHECK(parsed.program.line_count == 20);
}

TEST_CASE("rapid reader: malformed statements are refused", "[formats][robot]") {
  const std::string p = "[[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
  const std::string j = "[[0,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
  struct Case {
    const char* code;
    std::string text;
  };
  const std::vector<Case> bad = {
      {"NC331", "MoveL " + p + ",v,z,t"},               // no ;
      {"NC331", "MoveL " + p + ",v,z;"},                // no tool
      {"NC331", "MoveL " + p + ",v,z,t,u;"},            // too many
      {"NC331", "MoveL " + p + ",v,z,t\\Corr;"},        // not of the subset
      {"NC331", "MoveL " + p + "\\NoEOffs,v,z,t;"},     // of MoveAbsJ
      {"NC331", "MoveL " + p + ",v\\T:=0,z,t;"},        // no time
      {"NC331", "MoveL " + p + ",v\\T:=1\\T:=2,z,t;"},  // twice
      {"NC331", "MoveL " + p + ",v,z,t\\WObj;"},        // no value
      {"NC331", "MoveL 5,v,z,t;"},                      // no target
      {"NC331", "MoveL " + p + ",v,z,[1];"},            // tool without name
      {"NC332", "MoveL [[0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v,z,t;"},
      {"NC332", "MoveL [[0,0,0],[1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v,z,t;"},
      {"NC332", "MoveL [[0,0,0],[1,0,0,0],[0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v,z,t;"},
      {"NC332", "MoveL [[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9]],v,z,t;"},
      {"NC332", "MoveL [[0,0,0],[1,0,0,0],[0,0,0,0]],v,z,t;"},
      {"NC332", "MoveL " + j + ",v,z,t;"},
      {"NC332", "MoveAbsJ " + p + ",v,z,t;"},
      {"NC332", "MoveL [[0,0,0],[1,0,0.02,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v,z,t;"},
      {"NC332", "MoveL " + p + ",[1,2,3],z,t;"},
      {"NC332", "MoveL " + p + ",v,[FALSE,1,1,1,1,1],t;"},
      {"NC332", "MoveL " + p + ",v,[0,1,1,1,1,1,1],t;"},
      {"NC332", "MoveL [[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9],v,z,t;"},
      {"NC332", "F [[[[[[[[[[1]]]]]]]]]];"},
      {"NC331", "MoveJ " + p + ",v,z,t;"},
      {"NC331", "MoveC " + p + "," + p + ",v,z,t;"},
      {"NC331", "TriggL " + p + ",v,z,t;"},
      {"NC331", "TriggL " + p + ",v,a\\T9:=b,z,t;"},
      {"NC331", "TriggL " + p + ",v,[1],z,t;"},
      {"NC331", "TriggIO a, 0\\Start, 1;"},                  // no signal
      {"NC331", "TriggIO a, 0\\Start\\DOp:=b\\GOp:=c, 1;"},  // two
      {"NC331", "TriggIO a, 0\\Start\\Time\\DOp:=b, 1;"},
      {"NC331", "TriggIO 5, 0\\Start\\DOp:=b, 1;"},
      {"NC331", "TriggEquip a, 0\\Start\\DOp:=b, 1;"},  // no lag
      {"NC331", "TriggInt a, 0, b;"},
      {"NC331", "ConfL;"},
      {"NC331", "ConfL\\Of;"},
      {"NC331", "ConfL\\On\\Off;"},
      {"NC331", "SingArea\\LockAxis4;"},
      {"NC331", "WaitTime -1;"},
      {"NC331", "WaitTime\\InPos;"},
      {"NC331", "WaitTime \\InPos 1;"},
      {"NC331", "Stop\\NoRegain;"},
      {"NC331", "x := 1;"},
      {"NC331", "IF x THEN Stop; ENDIF"},
      {"NC331", "GOTO cut_1;"},
      {"NC331", "SetDO a,;"},
      {"NC331", "SetDO ,a;"},
      {"NC331", "SetDO a b;"},
      {"NC331", "SetDO a,1e;"},
      {"NC331", "SetDO a,1E999;"},
      {"NC331", "SetDO a,\\;"},
      {"NC331", "SetDO a,1+1;"},
      {"NC331", "TPWrite \"open;"},
      {"NC331", "TPWrite \"a\\b\";"},
      {"NC331", "TPWrite \"" + std::string(81, 'x') + "\";"},
      {"NC331", std::string(33, 'n') + ";"},
      {"NC331", "1 Stop;"},
      {"NC331", "%;"},
      {"NC331", "a: b: Stop;"},
      {"NC331", "a: ;"},
  };
  for (const auto& c : bad) {
    INFO(c.text);
    const auto parsed = body(c.text);
    REQUIRE_FALSE(parsed.diagnostics.empty());
    INFO(to_string(parsed.diagnostics[0]));
    CHECK(parsed.diagnostics[0].where.line >= 3);
    CHECK(parsed.diagnostics[0].where.line <= 4);
    CHECK(parsed.diagnostics[0].where.column >= 1);
    CHECK(parsed.diagnostics[0].code == c.code);
  }
  // All of them in one run, each with its line.
  const auto two = body("MoveJ a,v,z,t;\nStop;\nWaitTime x;");
  REQUIRE(two.diagnostics.size() == 2);
  CHECK(two.diagnostics[0].where.line == 3);
  CHECK(two.diagnostics[1].where.line == 5);
}

TEST_CASE("rapid reader: malformed data and structure are refused", "[formats][robot]") {
  const char* const kData[] = {
      "PERS tooldata t := [TRUE,[[0,0,0],[1,0,0,0]],[5,[0,0,1],[1,0,0,0],0,0]];",
      "PERS tooldata t := [1,[[0,0,0],[1,0,0,0]],[5,[0,0,1],[1,0,0,0],0,0,0]];",
      "PERS tooldata t := [TRUE,[[0,0,0],[0.9,0,0,0]],[5,[0,0,1],[1,0,0,0],0,0,0]];",
      "PERS tooldata t := [TRUE,[[0,0,0],[1,0,0,0]],[5,[0,0,1],[1,0,1,0],0,0,0]];",
      "PERS wobjdata w := [FALSE,TRUE,0,[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];",
      "PERS loaddata l := [5,[0,0,1],[1,0,0,0],0,0];",
      "CONST speeddata v := [1,2,3];",
      "CONST speeddata v := [1,2,3,4,5];",
      "CONST zonedata z := [FALSE,1,1,1,1,1,x];",
      "CONST jointtarget j := [[0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];",
      "CONST speeddata v;",
      "CONST speeddata v := ;",
      "CONST speeddata := [1,2,3,4];",
      "CONST speeddata v := [1,2,3,4]",
      "CONST num n := 1;",
      "VAR triggdata t := [1];",
      "CONST speeddata v := [1,2,3,4]; CONST zonedata V := [FALSE,1,1,1,1,1,1];",
      "CONST speeddata main := [1,2,3,4];",
  };
  for (const char* bad : kData) {
    INFO(bad);
    const auto parsed = data(bad);
    REQUIRE_FALSE(parsed.diagnostics.empty());
    CHECK(parsed.diagnostics[0].code.substr(0, 4) == "NC33");
    CHECK(parsed.diagnostics[0].where.line >= 3);
  }
  const char* const kFiles[] = {
      "",
      "PROC main() ENDPROC",
      "MODULE m ENDMODULE",
      "MODULE PROC main() ENDPROC ENDMODULE",
      "MODULE m PROC main() ENDPROC",
      "MODULE m PROC main() Stop;",
      "MODULE m PROC main Stop; ENDPROC ENDMODULE",
      "MODULE m PROC () ENDPROC ENDMODULE",
      "MODULE m PROC a() ENDPROC PROC A() ENDPROC ENDMODULE",
      "MODULE m PROC a() x: Stop; X: Stop; ENDPROC ENDMODULE",
      "MODULE m PROC a() ENDPROC ENDMODULE Stop",
      "MODULE m PROC a() ENDPROC VAR triggdata t; ENDMODULE",
      "MODULE m PROC a() ENDPROC \x01 ENDMODULE",
      "MODULE m PROC a() ENDPROC ! \x01\n ENDMODULE",
  };
  for (const char* bad : kFiles) {
    INFO(bad);
    CHECK_FALSE(rapid::parse(bad, "p").diagnostics.empty());
  }
}

TEST_CASE("rapid reader: every prefix and mutation ends in values or diagnostics",
          "[formats][robot]") {
  const std::string text = kProgram;
  for (std::size_t n = 0; n + 12 < text.size(); ++n)
    CHECK_FALSE(rapid::parse(text.substr(0, n), "p").diagnostics.empty());
  std::mt19937 rng(41);
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_int_distribution<std::size_t> place(0, text.size() - 1);
  std::size_t refused = 0;
  for (int i = 0; i < 5000; ++i) {
    std::string changed = text;
    changed[place(rng)] = static_cast<char>(byte(rng));
    if (i % 3 == 0) changed.erase(place(rng) % changed.size(), 3);
    const auto parsed = rapid::parse(changed, "p");
    refused += parsed.diagnostics.empty() ? 0 : 1;
    for (const auto& d : parsed.diagnostics) {
      REQUIRE(d.where.line >= 1);
      REQUIRE(d.where.line <= 22);
      REQUIRE(d.where.column >= 1);
    }
  }
  CHECK(refused > 1000);
  CHECK(refused < 5000);
  // Many errors are cut off, deep nesting is not followed.
  std::string many;
  for (int i = 0; i < 1000; ++i) many += "GOTO x;\n";
  CHECK(body(many).diagnostics.size() == 100);
  CHECK_FALSE(body("F " + std::string(100000, '[')).diagnostics.empty());
}
