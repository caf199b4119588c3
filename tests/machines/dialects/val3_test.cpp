#include "machines/dialects/val3.h"

#include "tests/machines/dialects/robot_programs.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition arm(std::vector<MachineOverride> more = {}) {
  more.insert(more.begin(), {"dialect.name", "val3"});
  return shipped_machine("robot_6r", more);
}

}  // namespace

TEST_CASE("val3: read_back(emit(x)) is x to the printed digits", "[machines][dialects]") {
  std::mt19937 rng(101);
  const auto machine = arm();
  std::size_t rounded = 0, timed = 0;
  for (int round = 0; round < 400; ++round)
    rounded += require_same_arm_program(val3::kDialect, machine,
                                        random_arm_program(machine, rng, 10), {1e-5, 1e-6, false});
  CHECK(rounded > 300);
  const auto joint = arm({{"dialect.mode", "joint"}});
  for (int round = 0; round < 100; ++round)
    timed += require_joint_times(val3::kDialect, joint, random_joint_program(joint, rng, 10), 0.01);
  CHECK(timed > 500);
}

TEST_CASE("val3: orientations near every singular angle come back", "[machines][dialects]") {
  const auto machine = arm();
  const double degree = kRadiansPerDegree;
  std::size_t tried = 0;
  for (const double y : {90.0, 89.99999, 90.00001, -90.0, -89.9999})
    for (const double x : {0.0, 37.0, 180.0, -179.99999})
      for (const double z : {0.0, -120.0, 180.0}) {
        auto program = short_arm_program(machine);
        for (std::size_t i = 1; i < 4; ++i)
          program.moves[i].tool.linear() = rotation_about(Vec3::UnitX(), x * degree) *
                                           rotation_about(Vec3::UnitY(), y * degree) *
                                           rotation_about(Vec3::UnitZ(), z * degree);
        require_same_arm_program(val3::kDialect, machine, program, {1e-5, 1e-6, false});
        ++tried;
      }
  CHECK(tried == 60);
}

TEST_CASE("val3: the text of a program", "[machines][dialects]") {
  const auto machine = arm();
  auto program = short_arm_program(machine);
  program.title = {"a ]]> b"};
  program.actions = {action(MachineAction::Kind::dwell, 4, "", 0.25)};
  const auto text = emitted(val3::kDialect, machine, program).text;
  CHECK(text.rfind("<?xml version=\"1.0\" encoding=\"utf-8\" ?>\n<Programs ", 0) == 0);
  for (const char* line :
       {"    <Code><![CDATA[begin\n", "\n// a ]]) b\n", "\nfPart.trsf={1400,0,600,0,0,0}\n",
        "\njTo={0,-90,90,0,45,0}\nmovej(jTo,tTip,mFirst)\n",
        "\npTo.trsf={0,0,0,0,0,0}\nmovel(pTo,tTip,mLink)\n",
        "\npTo.trsf={100,0,0,0,0,0}\nmMove.tvel=50\nmMove.rvel=10000\nmMove.blend=Cartesian\n"
        "mMove.leave=4\nmMove.reach=4\nmovel(pTo,tTip,mMove)\n",
        "\nmMove.tvel=25\nmMove.blend=off\nmMove.leave=0\nmMove.reach=0\nmovel(pTo,tTip,mMove)\n"
        "waitEndMove()\ndelay(0.25)\nend]]></Code>\n"}) {
    INFO(line << "\n" << text);
    CHECK(text.find(line) != std::string::npos);
  }
  const auto back = read_back(val3::kDialect, machine, text);
  CHECK(back.moves[2].blend == Approx(4.0));
  CHECK(back.moves[3].duration == Approx(2.0));
  REQUIRE(back.events.size() == 1);
  CHECK(back.events[0].before == 4);
}

TEST_CASE("val3: a statement waits for the motion in front of it", "[machines][dialects]") {
  auto machine = arm();
  machine.process.events = {{"beam_on", "doLaser=true", true, 0.0, 0.0},
                            {"beam_off", "doLaser=false", false, 0.0, 0.0},
                            {"message", "putln(\"{text}\")", true, 0.0, 0.0}};
  auto program = short_arm_program(machine);
  program.actions = {event("message", 1, {{"text", "a, \"b\") and (c"}}), event("beam_on", 3),
                     event("beam_off", 4)};
  const auto out = val3::emit(machine, program);
  REQUIRE(out.ok());
  REQUIRE(out.diagnostics().size() == 1);
  CHECK(out.diagnostics()[0].code == "PR222");
  const std::string& text = out.value().text;
  CHECK(text.find("waitEndMove()\ndoLaser=true\n") != std::string::npos);
  const auto back = read_back(val3::kDialect, machine, text);
  REQUIRE(back.events.size() == 3);
  CHECK(back.events[1].before == 3);
  CHECK(back.moves[2].blend == 0.0);
  CHECK(back.moves[3].beam);
  CHECK_FALSE(back.moves[2].beam);
}

TEST_CASE("val3: what cannot be printed is refused", "[machines][dialects]") {
  const auto machine = arm();
  auto program = short_arm_program(machine);
  require_common_rules(val3::kDialect, machine, program);
  program.moves.erase(program.moves.begin());
  const auto out = val3::emit(machine, program);
  REQUIRE_FALSE(out.ok());
  CHECK(out.diagnostics()[0].code == "PR203");
  auto named = machine;
  named.axes[2].name = "J3";
  CHECK_FALSE(val3::emit(named, short_arm_program(machine)).ok());
  named.axes[2].name = "E1";
  CHECK_FALSE(val3::emit(named, short_arm_program(machine)).ok());
}

TEST_CASE("val3: what could move differently than certified is refused", "[machines][dialects]") {
  const auto machine = arm();
  auto program = short_arm_program(machine);
  program.actions = {action(MachineAction::Kind::dwell, 4, "", 0.25)};
  const auto good = emitted(val3::kDialect, machine, program).text;
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"<Program name=\"smoothpost\">", "<Program name=\"other\">"},
      {"type=\"pointRx\"", "type=\"jointRx\""},
      {"end]]></Code>", "</Code>"},
      {"</Programs>\n", ""},
      {"link(fPart,world)\n", ""},
      {"link(fPart,world)", "link(fPart,fOther)"},
      {"link(tTip,flange)\n", ""},
      {"link(pTo,fPart)\n", ""},
      {"pTo.config={ssame,esame,wsame}", "pTo.config={lefty,esame,wsame}"},
      {"fPart.trsf={1400,0,600,0,0,0}", "fPart.trsf={1400,0,600,0,0}"},
      {"fPart.trsf={1400", "fPart.trsf={1e3"},
      {"tTip.trsf={", "tTip.trsf={9"},
      {"pTo.trsf={100,0,0,0,0,0}", "pTo.trsf={100,0,0,0,0,0}\nfPart.trsf={1400,0,601,0,0,0}"},
      {"mMove.blend=Cartesian", "mMove.blend=joint"},
      {"mMove.reach=4", "mMove.reach=5"},
      {"mMove.blend=off\nmMove.leave=0\nmMove.reach=0\nmovel", "movel"},
      {"mMove.tvel=50", "mMove.tvel=0"},
      {"mFirst.vel=10", "mFirst.vel=101"},
      {"mLink.rvel=90\n", ""},
      {"movel(pTo,tTip,mLink)", "movel(pTo,tTip,mOther)"},
      {"movel(pTo,tTip,mLink)", "movec(pTo,tTip,mLink)"},
      {"movel(pTo,tTip,mLink)", "movel(pTo,tTip,mFirst)"},
      {"waitEndMove()\n", ""},
      {"delay(0.25)", "delay(-1)"},
      {"delay(0.25)\n", "delay(0.25)\nmovel(pTo,tTip,mMove)\n"},
      {"movej(jTo,tTip,mFirst)\n", ""},
      {"jTo={0,-90,90,0,45,0}\n", ""},
      {"mMove.accel=100", "nSpeed=100"},
  };
  CHECK(require_refused(val3::kDialect, machine, good, changes) >= 10);
  std::mt19937 rng(103);
  require_bounded(val3::kDialect, machine, good, rng);
}
