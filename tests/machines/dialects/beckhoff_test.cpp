#include "machines/dialects/beckhoff.h"

#include "tests/machines/dialects/random_programs.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition machine_of(const std::string& name, std::vector<MachineOverride> more = {}) {
  more.insert(more.begin(), {{"dialect.name", "beckhoff"}, {"dialect.mode", "joint"}});
  return shipped_machine(name, more);
}

}  // namespace

TEST_CASE("beckhoff: read_back(emit(x)) is x to the printed digits", "[machines][dialects]") {
  std::mt19937 rng(121);
  for (const char* name : {"head_table_bc", "table_table_ac", "table_table_b45c", "head_head_ca",
                           "laser_5p1", "laser_5p1_offset", "finish_2p2r_1p1r"})
    for (const char* units : {"mm", "inch"}) {
      const auto machine = machine_of(name, {{"dialect.units", units}});
      for (int round = 0; round < 60; ++round) {
        const auto program = random_joint_program(machine, rng, 10);
        const auto out = emitted(beckhoff::kDialect, machine, program);
        const auto back = read_back(beckhoff::kDialect, machine, out.text);
        REQUIRE(back.moves.size() == program.moves.size());
        REQUIRE(back.exact_path);
        REQUIRE(back.offset_guard);
        for (std::size_t i = 0; i < program.moves.size(); ++i) {
          REQUIRE(back.moves[i].line == out.move_lines[i]);
          REQUIRE(back.moves[i].rapid == program.moves[i].rapid);
          require_same_joints(machine, program.moves[i], back.moves[i]);
          if (!program.moves[i].rapid)
            REQUIRE(std::abs(back.moves[i].duration - program.moves[i].duration) < 1e-6);
        }
      }
    }
}

TEST_CASE("beckhoff: the text of a program", "[machines][dialects]") {
  auto machine = machine_of("table_table_bc");
  machine.process.events = {{"tool_change", "T{tool} M6", false, 0.0, 0.0},
                            {"beam_on", "M62", true, 0.0, 0.0},
                            {"beam_off", "M63", true, 0.0, 0.0},
                            {"message", "#MSG [\"{text}\"]", true, 0.0, 0.0}};
  std::mt19937 rng(122);
  auto program = random_joint_program(machine, rng, 4);
  for (std::size_t i = 1; i < 4; ++i) {
    program.moves[i].rapid = i == 3;
    program.moves[i].duration = i == 3 ? 0.0 : 0.25;
  }
  program.actions = {event("tool_change", 0, {{"tool", "3"}}),
                     event("beam_on", 1),
                     event("message", 2, {{"text", "a ; b"}}),
                     action(MachineAction::Kind::dwell, 2, "", 0.5),
                     event("beam_off", 3),
                     action(MachineAction::Kind::cut_label, 3, "CUT 2")};
  const auto text = emitted(beckhoff::kDialect, machine, program).text;
  CHECK(text.rfind("%SMOOTHPOST\n", 0) == 0);
  CHECK(text.find(" #HSC OFF\n") != std::string::npos);
  CHECK(text.find(" T3 M6\n") < text.find(" D0\n"));
  CHECK(text.find(" F0.25\n") != std::string::npos);  // seconds
  CHECK(text.find(" #TIME 0.5\n") != std::string::npos);
  CHECK(text.find("#TRAFO OFF", text.find("(CUT 2)")) != std::string::npos);
  const auto back = read_back(beckhoff::kDialect, machine, text);
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"tool_change", 0}, {"beam_on", 1}, {"message", 2}, {"dwell", 2}, {"beam_off", 3}};
  REQUIRE(back.events.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(back.events[i].name == expected[i].first);
    CHECK(back.events[i].before == expected[i].second);
  }
  CHECK(back.moves[2].beam);
  CHECK_FALSE(back.moves[3].beam);
  require_common_rules(beckhoff::kDialect, machine, random_joint_program(machine, rng, 4));
}

TEST_CASE("beckhoff: what could move differently than certified is refused",
          "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc");
  std::mt19937 rng(123);
  auto program = random_joint_program(machine, rng, 2);
  program.moves[1].rapid = false;
  program.moves[1].duration = 0.25;
  const auto good = emitted(beckhoff::kDialect, machine, program).text;
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"#HSC OFF", "#HSC ON [OPMODE 1 CONTERROR 0.1]"},
      {"#TRAFO OFF", "#TRAFO ON"},
      {"G53 ", "G54 "},
      {" D0 ", " D1 "},
      {" G360 ", " G359 "},
      {" G360 ", " G61 "},
      {"G90 ", "G91 "},
      {"G71 ", ""},
      {" G93\n", " G94\n"},
      {" F0.25", ""},
      {" F0.25", " F0"},
      {"G1 X", "G2 X"},
      {"G1 X", "G1 X X"},
      {"G1 X", "G1 P"},
      {"N60 ", "N20 "},
  };
  CHECK(require_refused(beckhoff::kDialect, machine, good, changes) >= 10);
  require_bounded(beckhoff::kDialect, machine, good, rng);
  auto poses = program;
  poses.moves[1].interpolation = MoveInterpolation::tool;
  const auto refused = beckhoff::emit(machine, poses);
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.diagnostics()[0].code == "PR203");
}
