#include "machines/dialects/heidenhain.h"

#include "tests/machines/dialects/turned_part.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition machine_of(const std::string& name, const Dialect& dialect,
                             std::vector<MachineOverride> more = {}) {
  const std::vector<MachineOverride> own = {{"dialect.name", dialect.name},
                                            {"dialect.digits_mm", "4"},
                                            {"dialect.digits_inch", "4"},
                                            {"dialect.digits_deg", "4"}};
  more.insert(more.begin(), own.begin(), own.end());
  return shipped_machine(name, more);
}

// Feeds that the control can be told.
MachineProgram slow(MachineProgram program) {
  for (auto& move : program.moves)
    if (!move.rapid) move.duration = std::max(move.duration, 10.0);
  return program;
}

}  // namespace

TEST_CASE("heidenhain: read_back(emit(x)) is x to the printed digits in joints",
          "[machines][dialects]") {
  std::mt19937 rng(71);
  std::size_t timed = 0;
  for (const char* name : {"head_table_bc", "table_table_ac", "table_table_b45c", "head_head_ca",
                           "laser_5p1", "finish_2p2r_1p1r"})
    for (const char* units : {"mm", "inch"}) {
      const auto machine = machine_of(name, heidenhain::kDialect,
                                      {{"dialect.units", units}, {"dialect.mode", "joint"}});
      for (int round = 0; round < 60; ++round) {
        const auto program = slow(random_joint_program(machine, rng, 10));
        const auto back = require_same_tool_program(heidenhain::kDialect, machine, program);
        for (std::size_t i = 0; i < program.moves.size(); ++i) {
          if (program.moves[i].rapid) continue;
          REQUIRE(back.moves[i].duration == Approx(program.moves[i].duration).epsilon(1e-3));
          ++timed;
        }
      }
    }
  CHECK(timed > 5000);
}

TEST_CASE("heidenhain: read_back(emit(x)) is x to the printed digits with TCPM",
          "[machines][dialects]") {
  std::mt19937 rng(72);
  for (const Dialect* dialect : {&heidenhain::kDialect, &heidenhain::kVectorDialect})
    for (const char* name :
         {"head_table_bc", "table_table_ac", "table_table_bc", "table_table_b45c", "head_head_ca"})
      for (const char* units : {"mm", "inch"}) {
        const auto machine = machine_of(name, *dialect, {{"dialect.units", units}});
        for (int round = 0; round < 50; ++round) {
          const auto program = slow(random_tool_program(machine, rng, 10));
          const auto back = require_same_tool_program(*dialect, machine, program);
          if (!std::any_of(program.moves.begin(), program.moves.end(), [](const MachineMove& m) {
                return m.interpolation == MoveInterpolation::tool;
              }))
            continue;
          REQUIRE(back.part);
          REQUIRE((back.part->translation() - program.part.translation()).norm() < 3e-5);
        }
      }
}

TEST_CASE("heidenhain: the text of a program", "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", heidenhain::kDialect);
  auto program = short_tool_program(machine);
  program.actions = {action(MachineAction::Kind::cut_label, 1, "CUT 1 from input line 4"),
                     action(MachineAction::Kind::dwell, 2, "", 0.25)};
  const auto text = emitted(heidenhain::kDialect, machine, program).text;
  CHECK(text.rfind("0 BEGIN PGM SMOOTHPOST MM\n", 0) == 0);
  // 2 mm in 0.5 s; then 0.1 rad = 5.7296 deg in 0.5 s.
  CHECK(text.find(" L X+3 R0 F240\n") != std::string::npos);
  CHECK(text.find(" L B+5.7296 R0 F687.552\n") != std::string::npos);
  CHECK(text.find(" FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR\n") != std::string::npos);
  CHECK(text.find(" * - CUT 1 from input line 4\n") != std::string::npos);
  CHECK(text.find(" CYCL DEF 9.1 DWELL 0.25\n") != std::string::npos);
  CHECK(text.find(" Q52 = ABS ( Q50 - Q51 - Q53 - 30 )\n") != std::string::npos);
  CHECK(text.find("ID200 NR6 IDX1\n") != std::string::npos);
  const auto back = read_back(heidenhain::kDialect, machine, text);
  for (const std::size_t i : {1U, 2U, 3U})
    CHECK(back.moves[i].duration == Approx(0.5).epsilon(1e-4));
  REQUIRE(back.events.size() == 1);
  CHECK(back.events[0].name == "dwell");
  CHECK(back.events[0].seconds == 0.25);
  const auto vectors = machine_of("table_table_bc", heidenhain::kVectorDialect);
  const auto other = emitted(heidenhain::kVectorDialect, vectors, program).text;
  CHECK(other.find(" LN X+3 F240\n") != std::string::npos);
  CHECK(other.find(" TZ+0.99500417 F") != std::string::npos);
  const auto inch = machine_of("table_table_bc", heidenhain::kDialect, {{"dialect.units", "inch"}});
  // 2 mm in 0.5 s are 9.449 inch/min, in tenths of an inch and between printed tips.
  CHECK(emitted(heidenhain::kDialect, inch, program).text.find(" F94.44\n") != std::string::npos);
}

TEST_CASE("heidenhain: events and the beam", "[machines][dialects]") {
  auto machine = machine_of("table_table_bc", heidenhain::kDialect);
  machine.process.events = {{"beam_on", "M110", true, 0.0, 0.0},
                            {"beam_off", "M111", true, 0.0, 0.0},
                            {"spindle_on", "TOOL CALL S{rpm}", false, 0.0, 0.0},
                            {"tool_change", "TOOL CALL {tool} Z", false, 0.0, 0.0},
                            {"pierce", "M112", false, 0.5, 0.0}};
  auto program = short_tool_program(machine);
  program.moves.push_back(program.moves[0]);
  program.actions = {event("tool_change", 0, {{"tool", "3"}}),
                     event("spindle_on", 1, {{"rpm", "800"}}), event("pierce", 1),
                     event("beam_on", 2), event("beam_off", 4)};
  const auto text = emitted(heidenhain::kDialect, machine, program).text;
  CHECK(text.find("ID200 NR6 IDX3\n") != std::string::npos);  // tool 3
  const auto back = read_back(heidenhain::kDialect, machine, text);
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"tool_change", 0}, {"spindle_on", 1}, {"pierce", 1},
      {"dwell", 1},       {"beam_on", 2},    {"beam_off", 4}};
  REQUIRE(back.events.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(back.events[i].name == expected[i].first);
    CHECK(back.events[i].before == expected[i].second);
  }
  CHECK(back.moves[3].beam);
  CHECK_FALSE(back.moves[4].beam);
}

TEST_CASE("heidenhain: the first tool move of every tool has its time", "[machines][dialects]") {
  for (const Dialect* dialect : {&heidenhain::kDialect, &heidenhain::kVectorDialect}) {
    auto machine = machine_of("table_table_bc", *dialect);
    machine.process.events = {{"tool_change", "TOOL CALL {tool} Z", false, 0.0, 0.0},
                              {"spindle_on", "TOOL CALL S{rpm}", false, 0.0, 0.0}};
    auto program = short_tool_program(machine);
    for (const std::size_t i : {0, 1, 2}) program.moves.push_back(program.moves[i]);
    for (std::size_t i = 4; i < program.moves.size(); ++i) program.moves[i].tool_length = 80.0;
    program.actions = {event("tool_change", 0, {{"tool", "7"}}),
                       event("tool_change", 4, {{"tool", "12"}}),
                       event("spindle_on", 4, {{"rpm", "800"}})};
    const auto text = emitted(*dialect, machine, program).text;
    CHECK(text.find("; Tool 12 has to be 80 long") != std::string::npos);
    const auto back = read_back(*dialect, machine, text);
    for (const std::size_t i : {1, 2, 3, 5, 6}) {
      CAPTURE(i, text);
      CHECK(back.moves[i].duration == Approx(0.5).epsilon(1e-3));
    }
    // A guard that has another tool; a tool in the spindle that it does not have.
    for (const auto& [from, to] :
         {std::pair("NR6 IDX12", "NR6 IDX13"), std::pair("TOOL CALL 12 Z", "TOOL CALL 13 Z")}) {
      std::string changed = text;
      changed.replace(changed.find(from), std::string(from).size(), to);
      const auto read = dialect->read_back(machine, changed, "out");
      REQUIRE_FALSE(read.ok());
      CHECK(read.diagnostics()[0].text.find("length of the tool in the spindle") !=
            std::string::npos);
    }
  }
}

TEST_CASE("heidenhain: a turned part is written along the machine's axes", "[machines][dialects]") {
  std::mt19937 rng(32);
  for (const char* name : {"table_table_bc", "head_head_ca", "head_table_bc"})
    for (const Dialect* dialect : {&heidenhain::kDialect, &heidenhain::kVectorDialect}) {
      const auto machine = machine_of(name, *dialect);
      require_turned_part(*dialect, machine, rng);
    }
}

TEST_CASE("heidenhain: what cannot be printed is refused", "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", heidenhain::kDialect);
  const auto refused = [](const MachineDefinition& m, const MachineProgram& p) {
    const auto out = heidenhain::emit(m, p);
    REQUIRE_FALSE(out.ok());
    CHECK(out.diagnostics()[0].code == "PR203");
    return out.diagnostics()[0].text;
  };
  const auto program = short_tool_program(machine);
  auto fast = program;
  fast.moves[2].duration = 1e-4;
  CHECK(refused(machine, fast).find("feed") != std::string::npos);
  const auto digits =
      machine_of("table_table_bc", heidenhain::kDialect, {{"dialect.digits_deg", "5"}});
  CHECK(refused(digits, program).find("4 and 5") != std::string::npos);
  refused(machine_of("table_table_bc", heidenhain::kDialect, {{"dialect.path_mode", "blend"}}),
          program);
  require_common_rules(heidenhain::kDialect, machine, program);
}

TEST_CASE("heidenhain: what could move differently than certified is refused",
          "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", heidenhain::kDialect);
  const auto good = emitted(heidenhain::kDialect, machine, short_tool_program(machine)).text;
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"L X+3", "L X3"},  // no sign
      {"L X+3", "L X+3..1"},
      {"L X+3", "L X+3 X+4"},
      {"L X+3", "L X+333333"},
      {"L X+3", "L IX+3"},  // incremental
      {"L X+3", "CC X+3"},
      {"L X+3", "LN X+3"},
      {" R0 F240", " RL F240"},
      {" F240", ""},
      {" F240", " F240 FMAX"},
      {" M91", ""},
      {"PATHCTRL VECTOR", "PATHCTRL AXIS"},
      {"AXIS POS", "AXIS SPAT"},
      {"F TCP AXIS", "F CONT AXIS"},
      {" M127\n", " M126\n"},
      {"END PGM SMOOTHPOST MM", "END PGM SMOOTHPOST INCH"},
      {"BEGIN PGM SMOOTHPOST MM", "BEGIN PGM SMOOTHPOST"},
      {"\n7 ", "\n8 "},
      {"Z+3 B+0 C+0", "Z+3 C+0"},
      {"IDX2", "IDX3"},
      {"GT +0.0005", "GT +9.0005"},
      {"LBL 91\n", "LBL 92\n"},
      {" STOP\n", " M8\n"},
      {"ID200 NR2", "ID200 NR3"},
      {"ID200 NR6 IDX1", "ID200 NR6 IDX"},
      {"- Q53 ", ""},
  };
  CHECK(require_refused(heidenhain::kDialect, machine, good, changes) >= 10);
  const auto open =
      machine_of("table_table_bc", heidenhain::kDialect, {{"dialect.offset_guard", "false"}});
  const auto unguarded =
      read_back(heidenhain::kDialect, open,
                emitted(heidenhain::kDialect, open, short_tool_program(open)).text);
  CHECK_FALSE(unguarded.offset_guard);
  CHECK_FALSE(unguarded.part);
  std::mt19937 rng(73);
  require_bounded(heidenhain::kDialect, machine, good, rng);
}
