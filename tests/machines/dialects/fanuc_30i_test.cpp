#include "machines/dialects/fanuc_30i.h"

#include "tests/machines/dialects/turned_part.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition machine_of(const std::string& name, const Dialect& dialect,
                             std::vector<MachineOverride> more = {}) {
  more.insert(more.begin(), {"dialect.name", dialect.name});
  return shipped_machine(name, more);
}

}  // namespace

TEST_CASE("fanuc_30i: read_back(emit(x)) is x to the printed digits in joints",
          "[machines][dialects]") {
  std::mt19937 rng(61);
  std::size_t moves = 0;
  for (const char* name : {"head_table_bc", "table_table_ac", "table_table_b45c", "head_head_ca",
                           "laser_5p1", "finish_2p2r_1p1r"})
    for (const char* units : {"mm", "inch"}) {
      const auto machine = machine_of(name, fanuc_30i::kDialect,
                                      {{"dialect.units", units}, {"dialect.mode", "joint"}});
      for (int round = 0; round < 100; ++round, moves += 10)
        require_same_tool_program(fanuc_30i::kDialect, machine,
                                  random_joint_program(machine, rng, 10));
    }
  CHECK(moves == 12000);
}

TEST_CASE("fanuc_30i: read_back(emit(x)) is x to the printed digits with G43.4 and G43.5",
          "[machines][dialects]") {
  std::mt19937 rng(62);
  for (const Dialect* dialect : {&fanuc_30i::kDialect, &fanuc_30i::kVectorDialect})
    for (const char* name :
         {"head_table_bc", "table_table_ac", "table_table_bc", "table_table_b45c", "head_head_ca"})
      for (const char* units : {"mm", "inch"}) {
        const auto machine = machine_of(name, *dialect, {{"dialect.units", units}});
        for (int round = 0; round < 50; ++round)
          require_same_tool_program(*dialect, machine, random_tool_program(machine, rng, 10));
      }
}

TEST_CASE("fanuc_30i: the feed of a tool move is the tip's speed", "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", fanuc_30i::kDialect);
  const auto program = short_tool_program(machine);
  const auto text = emitted(fanuc_30i::kDialect, machine, program).text;
  // 2 mm in 0.5 s; then 0.1 rad = 5.729578 deg in 0.5 s.
  CHECK(text.find(" G1 X3. F240.\n") != std::string::npos);
  CHECK(text.find(" G1 B5.729578 F687.549\n") != std::string::npos);
  CHECK(text.find(" G94 G40 ") < text.find(" G43.4 H1 P1\n"));
  const auto back = read_back(fanuc_30i::kDialect, machine, text);
  CHECK(back.moves[1].duration == Approx(0.5).epsilon(1e-4));
  CHECK(back.moves[2].duration == Approx(0.5).epsilon(1e-6));
  CHECK(back.moves[3].duration == Approx(0.5).epsilon(1e-6));
  REQUIRE(back.part);
  CHECK(back.part->translation() == Vec3(10, 20, 30));
  const auto vectors = machine_of("table_table_bc", fanuc_30i::kVectorDialect);
  const auto other = emitted(fanuc_30i::kVectorDialect, vectors, program).text;
  CHECK(other.find(" G43.5 H1 P1\n") != std::string::npos);
  CHECK(read_back(fanuc_30i::kVectorDialect, vectors, other).moves[3].duration ==
        Approx(0.5).epsilon(1e-4));
}

TEST_CASE("fanuc_30i: a joint move's F is its time", "[machines][dialects]") {
  std::mt19937 rng(64);
  const auto machine = machine_of("table_table_bc", fanuc_30i::kDialect);
  const auto program = random_joint_program(machine, rng, 200);
  const auto back =
      read_back(fanuc_30i::kDialect, machine, emitted(fanuc_30i::kDialect, machine, program).text);
  for (std::size_t i = 0; i < program.moves.size(); ++i)
    if (!program.moves[i].rapid)
      REQUIRE(back.moves[i].duration == Approx(program.moves[i].duration).epsilon(1e-5));
}

TEST_CASE("fanuc_30i: a block too short for G93 takes longer", "[machines][dialects]") {
  std::mt19937 rng(65);
  const auto machine = machine_of("table_table_bc", fanuc_30i::kDialect);
  auto program = random_joint_program(machine, rng, 2);
  program.moves[1].rapid = false;
  program.moves[1].duration = 0.004;
  const auto text = emitted(fanuc_30i::kDialect, machine, program).text;
  CHECK(text.find(" F9999.999\n") != std::string::npos);
  CHECK(read_back(fanuc_30i::kDialect, machine, text).moves[1].duration ==
        Approx(0.0060000006).epsilon(1e-9));
}

TEST_CASE("fanuc_30i: G49 stands in the first block behind tool moves and names every linear axis",
          "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", fanuc_30i::kDialect);
  auto program = short_tool_program(machine);
  auto away = program.moves[0];
  away.joints = 1U << machine.axis_by_letter('Z');
  program.moves.push_back(away);
  away.joints = (1U << machine.size()) - 1U;
  away.rapid = false;
  away.duration = 2.0;
  program.moves.push_back(away);
  const auto text = emitted(fanuc_30i::kDialect, machine, program).text;
  const auto at = text.find("G49 G53 G0 ");
  REQUIRE(at != std::string::npos);
  const auto block = text.substr(at, text.find('\n', at) - at);
  for (const char* word : {" X", " Y", " Z"}) CHECK(block.find(word) != std::string::npos);
  const auto back = read_back(fanuc_30i::kDialect, machine, text);
  CHECK(back.moves[4].rapid);
  // In G54: the place of the part is taken off, and put on again by reading.
  require_same_joints(machine, program.moves[5], back.moves[5]);
  CHECK(back.moves[5].duration == Approx(2.0));
}

TEST_CASE("fanuc_30i: events and tool changes", "[machines][dialects]") {
  auto machine = machine_of("table_table_bc", fanuc_30i::kDialect);
  machine.process.events = {{"beam_on", "M62 P{percent}", true, 0.0, 0.0},
                            {"beam_off", "M63", true, 0.0, 0.0},
                            {"tool_change", "T{tool} M6", false, 0.0, 0.0},
                            {"pierce", "M64", false, 0.25, 0.0},
                            {"message", "(MSG, {text})", true, 0.0, 0.0}};
  auto program = short_tool_program(machine);
  program.moves.push_back(program.moves[0]);
  program.moves.push_back(program.moves[1]);
  for (std::size_t i = 4; i < program.moves.size(); ++i) program.moves[i].tool_length = 80.0;
  using Kind = MachineAction::Kind;
  program.actions = {event("tool_change", 1, {{"tool", "7"}}),
                     event("beam_on", 2, {{"percent", "40"}}),
                     event("message", 3, {{"text", "x) G0 X1"}}),
                     event("beam_off", 4),
                     action(Kind::cut_label, 4, "CUT 2 from input line 9"),
                     event("tool_change", 5, {{"tool", "12"}}),
                     event("pierce", 5),
                     action(Kind::dwell, 6, "", 0.5)};
  const auto text = emitted(fanuc_30i::kDialect, machine, program).text;
  CHECK(text.find("(- H7 HAS TO HOLD TOOL LENGTH 50, G54") == std::string::npos);
  CHECK(text.find("(H7 HAS TO HOLD TOOL LENGTH 50, G54 THE PLACE OF THE PART)") !=
        std::string::npos);
  CHECK(text.find("IF [ABS[#11007+#10007-50] GT 0.0005] THEN #3000=2(H7 IS") != std::string::npos);
  // The second tool is 30 mm longer.
  CHECK(text.find("(H12 HAS TO HOLD TOOL LENGTH 80)") != std::string::npos);
  CHECK(text.find("IF [ABS[#11012+#10012-80] GT 0.0005] THEN #3000=2(H12 IS") != std::string::npos);
  CHECK(text.find("G43.4 H7 P1") < text.find("G43.4 H12 P1"));
  CHECK(text.find("(CUT 2 FROM INPUT LINE 9)") != std::string::npos);
  const auto back = read_back(fanuc_30i::kDialect, machine, text);
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"tool_change", 1}, {"beam_on", 2}, {"message", 3}, {"beam_off", 4},
      {"tool_change", 5}, {"pierce", 5},  {"dwell", 5},   {"dwell", 6}};
  REQUIRE(back.events.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(back.events[i].name == expected[i].first);
    CHECK(back.events[i].before == expected[i].second);
  }
  CHECK(back.moves[2].beam);
  CHECK_FALSE(back.moves[4].beam);
}

TEST_CASE("fanuc_30i: the first tool move of every tool has its time", "[machines][dialects]") {
  for (const Dialect* dialect : {&fanuc_30i::kDialect, &fanuc_30i::kVectorDialect}) {
    auto machine = machine_of("table_table_bc", *dialect);
    machine.process.events = {{"tool_change", "T{tool} M6", false, 0.0, 0.0}};
    auto program = short_tool_program(machine);
    for (const std::size_t i : {0, 1, 2}) program.moves.push_back(program.moves[i]);
    for (std::size_t i = 4; i < program.moves.size(); ++i) program.moves[i].tool_length = 80.0;
    program.actions = {event("tool_change", 0, {{"tool", "7"}}),
                       event("tool_change", 4, {{"tool", "12"}})};
    const auto text = emitted(*dialect, machine, program).text;
    const auto back = read_back(*dialect, machine, text);
    for (const std::size_t i : {1, 2, 3, 5, 6}) {
      CAPTURE(i, text);
      CHECK(back.moves[i].duration == Approx(0.5).epsilon(1e-3));
    }
    // A guard that does not name the second tool, or another one.
    const auto line = text.find("IF [ABS[#11012");
    REQUIRE(line != std::string::npos);
    const auto begin = text.rfind('\n', line) + 1, end = text.find('\n', line) + 1;
    std::string without = text, other = text;
    without.erase(begin, end - begin);
    other.replace(text.find("#11012+#10012"), 13, "#11013+#10013");
    for (const std::string& changed : {without, other}) {
      const auto read = dialect->read_back(machine, changed, "out");
      REQUIRE_FALSE(read.ok());
      CHECK(read.diagnostics()[0].text.find("H12") != std::string::npos);
    }
  }
}

TEST_CASE("fanuc_30i: a turned part is written along the machine's axes", "[machines][dialects]") {
  std::mt19937 rng(31);
  for (const char* name : {"table_table_bc", "head_head_ca", "head_table_bc"})
    for (const Dialect* dialect : {&fanuc_30i::kDialect, &fanuc_30i::kVectorDialect}) {
      const auto machine = machine_of(name, *dialect);
      require_turned_part(*dialect, machine, rng);
    }
}

TEST_CASE("fanuc_30i: what cannot be printed is refused", "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", fanuc_30i::kDialect);
  const auto refused = [](const MachineDefinition& m, const MachineProgram& p) {
    const auto out = fanuc_30i::emit(m, p);
    REQUIRE_FALSE(out.ok());
    CHECK(out.diagnostics()[0].code == "PR203");
    return out.diagnostics()[0].text;
  };
  auto redundant = short_tool_program(machine);
  redundant.moves[1].joints = 1;
  refused(machine, redundant);
  const auto blend =
      machine_of("table_table_bc", fanuc_30i::kDialect, {{"dialect.path_mode", "blend"}});
  refused(blend, short_tool_program(machine));
  require_common_rules(fanuc_30i::kDialect, machine, short_tool_program(machine));
}

TEST_CASE("fanuc_30i: what could move differently than certified is refused",
          "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", fanuc_30i::kDialect);
  const auto good = emitted(fanuc_30i::kDialect, machine, short_tool_program(machine)).text;
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"G1 X1.", "G2 X1."},
      {"G1 X1.", "G1 Q1."},
      {"G1 X1.", "G1 X1. X2."},
      {"G1 X1.", "G1 X1..2"},
      {"G1 X1.", "G1 X1e3"},
      {"G1 X1.", "G68.2 X1."},
      {"G1 X1.", "M3 S100 G1 X1."},
      {" P1\n", " P0\n"},  // no posture control
      {" P1\n", "\n"},
      {" G43.4 H1", " G43 H1"},
      {" G43.4 H1", " G43.4 H2"},  // the length of another tool
      {" G61\n", " G64\n"},        // blends
      {" G90 ", " G91 "},
      {"G21 ", ""},
      {" F240.", ""},  // no feed
      {" G94 G40", " G93 G40"},
      {"G53 G0 ", "G53 G1 "},
      {"G49\n", "G90\n"},  // centre point control at the end
      {"(G54 IS", "(G54 (IS"},
      {"N9 ", "N3 "},  // numbers fall
      {"#5021-#5041", "#5022-#5041"},
      {"GT 0.0005", "GT 9.0005"},
      {"#11001", "#11002"},
      {"G40 G49 G80 G69 G54", "G40 G49 G80 G69 G55"},
      {"Z3. B0. ", "Z3. "},  // the tool's axis unknown behind G43.4
  };
  CHECK(require_refused(fanuc_30i::kDialect, machine, good, changes) >= 10);
  // Without the guard it can be read, and says so.
  std::string open = good;
  for (auto at = open.find("IF ["); at != std::string::npos; at = open.find("IF [")) {
    const auto line = open.rfind('\n', at) + 1;
    open.erase(line, open.find('\n', at) + 1 - line);
  }
  const auto back = read_back(fanuc_30i::kDialect, machine, open);
  CHECK_FALSE(back.offset_guard);
  CHECK_FALSE(back.part);
  std::mt19937 rng(63);
  require_bounded(fanuc_30i::kDialect, machine, good, rng);
}

TEST_CASE("fanuc_30i: a name of the program and lines of the machine file",
          "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", fanuc_30i::kDialect,
                                  {{"dialect.start", "[\"O4711(PUMP)\", \"G05 P10000\"]"},
                                   {"dialect.end", "[\"M9\", \"M30\"]"},
                                   {"dialect.line_numbers", "false"}});
  const auto text = emitted(fanuc_30i::kDialect, machine, short_tool_program(machine)).text;
  CHECK(text.rfind("%\nO4711(PUMP)\n", 0) == 0);
  CHECK(text.find("\nG05 P10000\n") != std::string::npos);
  CHECK(text.find("\nN") == std::string::npos);
  CHECK(text.substr(text.size() - 9) == "M9\nM30\n%\n");
  CHECK(read_back(fanuc_30i::kDialect, machine, text).moves.size() == 4);
}
