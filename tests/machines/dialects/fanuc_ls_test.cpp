#include "machines/dialects/fanuc_ls.h"

#include "tests/machines/dialects/robot_programs.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition arm(std::vector<MachineOverride> more = {}) {
  more.insert(more.begin(), {"dialect.name", "fanuc_ls"});
  return shipped_machine("robot_6r", more);
}

}  // namespace

TEST_CASE("fanuc_ls: read_back(emit(x)) is x to the printed digits", "[machines][dialects]") {
  std::mt19937 rng(91);
  const auto machine = arm();
  std::size_t rounded = 0;
  // Speeds have one decimal and times whole milliseconds, or tenths of a second above 32 s.
  for (int round = 0; round < 400; ++round)
    rounded += require_same_arm_program(fanuc_ls::kDialect, machine,
                                        random_arm_program(machine, rng, 10), {0.1, 0.1});
  CHECK(rounded > 200);
}

TEST_CASE("fanuc_ls: nothing is faster than planned", "[machines][dialects]") {
  std::mt19937 rng(92);
  const auto machine = arm();
  for (int round = 0; round < 100; ++round) {
    const auto program = random_arm_program(machine, rng, 10);
    const auto back =
        read_back(fanuc_ls::kDialect, machine, emitted(fanuc_ls::kDialect, machine, program).text);
    for (std::size_t i = 0; i < program.moves.size(); ++i)
      if (!program.moves[i].rapid)
        REQUIRE(back.moves[i].duration >= program.moves[i].duration * (1 - 1e-6));
  }
}

TEST_CASE("fanuc_ls: the text of a program", "[machines][dialects]") {
  auto machine = arm();
  machine.process.events = {{"beam_on", "DO[1] = ON", true, 0.0, 0.0},
                            {"beam_off", "DO[1]=OFF ;", false, 0.0, 0.0}};
  auto program = short_arm_program(machine);
  const double degree = kRadiansPerDegree;
  program.moves[0].to << 10 * degree, -80.5 * degree, 95 * degree, 200 * degree, -45 * degree, 0;
  program.actions = {
      action(MachineAction::Kind::cut_label, 1, "CUT 1 from input line 4 with tool 1"),
      event("beam_on", 3), event("beam_off", 4)};
  const auto out = emitted(fanuc_ls::kDialect, machine, program);
  const std::string& text = out.text;
  CHECK(text.rfind("/PROG  SMOOTHPOST\n/ATTR\n", 0) == 0);
  CHECK(text.find(":J P[1] 10% FINE ;\n") != std::string::npos);
  CHECK(text.find(":L P[2] R[91]mm/sec FINE ;\n") != std::string::npos);
  CHECK(text.find(":L P[3] 50mm/sec CR5 TB 0.00sec,DO[1]=ON ;\n") != std::string::npos);
  CHECK(text.find(":L P[4] 25mm/sec FINE ;\n") != std::string::npos);
  CHECK(text.find(":  DO[1]=OFF ;\n") != std::string::npos);
  CHECK(text.find(":  !CUT 1 from input line 4 with ;\n") < text.find(":  !tool 1 ;\n"));
  CHECK(text.find(":  LBL[1] ;\n") != std::string::npos);
  // J3 is A3 + ... without A2: 95 + 80.5.
  CHECK(text.find("J3= 175.5 deg") != std::string::npos);
  CHECK(text.find("PR[91,1]=1400 ;") != std::string::npos);
  const auto instructions =
      std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find("/POS")), ':') -
      1;
  CHECK(text.find("LINE_COUNT\t= " + std::to_string(instructions) + ";") != std::string::npos);
  const auto back = read_back(fanuc_ls::kDialect, machine, text);
  REQUIRE(back.events.size() == 2);
  CHECK(back.events[0].name == "beam_on");
  CHECK(back.events[0].before == 3);
  CHECK(back.moves[2].blend == 5.0);
  CHECK(back.moves[3].beam);
  CHECK_FALSE(back.events[1].beam);
}

TEST_CASE("fanuc_ls: an event at a corner that is no output stops the robot",
          "[machines][dialects]") {
  auto machine = arm();
  machine.process.events = {{"message", "CALL SAY('{text}')", true, 0.0, 0.0},
                            {"beam_on", "DO[1]=ON", true, 0.0, 0.0}};
  auto program = short_arm_program(machine);
  program.actions = {event("message", 3, {{"text", "x"}}), event("beam_on", 3)};
  const auto out = fanuc_ls::emit(machine, program);
  REQUIRE(out.ok());
  CHECK(out.diagnostics().size() == 2);
  for (const auto& d : out.diagnostics()) CHECK(d.code == "PR222");
  const auto back = read_back(fanuc_ls::kDialect, machine, out.value().text);
  CHECK(back.moves[2].blend == 0.0);
  CHECK(back.moves[3].beam);
}

TEST_CASE("fanuc_ls: what cannot be printed is refused", "[machines][dialects]") {
  auto machine = arm();
  auto program = short_arm_program(machine);
  require_common_rules(fanuc_ls::kDialect, machine, program);
  program.moves.erase(program.moves.begin());
  const auto out = fanuc_ls::emit(machine, program);
  REQUIRE_FALSE(out.ok());
  CHECK(out.diagnostics()[0].code == "PR203");
  auto named = machine;
  named.axes[2].name = "J3";
  const auto names = fanuc_ls::emit(named, short_arm_program(machine));
  REQUIRE_FALSE(names.ok());
  CHECK(names.diagnostics()[0].code == "PR202");
}

TEST_CASE("fanuc_ls: what could move differently than certified is refused",
          "[machines][dialects]") {
  const auto machine = arm();
  const auto good = emitted(fanuc_ls::kDialect, machine, short_arm_program(machine)).text;
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"/PROG  SMOOTHPOST", "/PROG"},
      {"/POS\n", "/APPL\n"},
      {"\n/END", "\n"},
      {"   2:", "   3:"},
      {" ;\n   3:", "\n   3:"},
      {"CR5 ", "CNT50 "},
      {"CR5 ", "CR-5 "},
      {"50mm/sec", "50mm"},
      {"50mm/sec", "0mm/sec"},
      {"L P[3]", "L P[9]"},
      {"L P[3]", "L PR[3]"},
      {"L P[3]", "C P[3]"},
      {"L P[3]", "J P[3]"},
      {"CR5 ", "CR5 Offset,PR[1] "},
      {"P[3]{", "P[5]{"},
      {"CONFIG : '", "CONFIG : 'X"},
      {"X = 100 mm", "X = 1e2 mm"},
      {"X = 100 mm,", ""},
      {"UF : 9, UT : 9", "UF : 1, UT : 1"},
      {"UFRAME_NUM=9", "UFRAME_NUM=1"},
      {"UTOOL[9]=PR[92]", "UTOOL[8]=PR[92]"},
      {"PR[91,3]=600", "PR[91,2]=600"},
      {"PR[92,1]=", "PR[92,1]=9"},
      {"R[91]=250", "R[91]=2500"},
      {"J2= ", "J7= "},
  };
  CHECK(require_refused(fanuc_ls::kDialect, machine, good, changes) >= 10);
  std::mt19937 rng(93);
  require_bounded(fanuc_ls::kDialect, machine, good, rng);
}
