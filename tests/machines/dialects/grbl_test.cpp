#include "machines/dialects/grbl.h"

#include "tests/machines/dialects/random_programs.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

const Dialect& dialect_named(const std::string& name) {
  for (const auto& row : grbl::kDialects)
    if (row.name == name) return row;
  FAIL("no dialect " + name);
  return grbl::kDialects[0];
}

bool knows_machine_words(const std::string& name) {
  return name != "grbl_marlin" && name != "grbl_klipper";
}

MachineDefinition machine_of(const std::string& machine, const std::string& dialect) {
  return shipped_machine(
      machine, {{"dialect.name", dialect},
                {"dialect.mode", "joint"},
                {"dialect.offset_guard", knows_machine_words(dialect) ? "true" : "false"}});
}

// One move from 0: X 3 mm, Y 4 mm, B 12 deg, C 9 deg, in 2 s; those whose letter is in `letters`.
MachineProgram one_move(const MachineDefinition& machine, const std::string& letters) {
  MachineProgram program;
  MachineMove move;
  move.to = JointVector::Zero(machine.size());
  move.joints = (1U << machine.size()) - 1U;
  move.rapid = true;
  program.moves = {move, move};
  auto& second = program.moves[1];
  second.rapid = false;
  second.duration = 2.0;
  const std::vector<std::pair<char, double>> steps = {
      {'X', 3}, {'Y', 4}, {'B', 12 * kRadiansPerDegree}, {'C', 9 * kRadiansPerDegree}};
  for (const auto& [letter, step] : steps)
    if (letters.find(letter) != std::string::npos) second.to[machine.axis_by_letter(letter)] = step;
  return program;
}

}  // namespace

TEST_CASE("grbl: read_back(emit(x)) is x to the printed digits for every firmware",
          "[machines][dialects]") {
  std::mt19937 rng(111);
  std::size_t moves = 0;
  for (const auto& dialect : grbl::kDialects)
    for (const char* name : {"head_table_bc", "table_table_ac", "table_table_b45c"}) {
      const auto machine = machine_of(name, dialect.name);
      for (int round = 0; round < 60; ++round) {
        const auto program = random_joint_program(machine, rng, 10);
        const auto out = emitted(dialect, machine, program);
        const auto back = read_back(dialect, machine, out.text);
        REQUIRE(back.moves.size() == program.moves.size());
        REQUIRE(back.exact_path);
        REQUIRE(back.offset_guard == knows_machine_words(dialect.name));
        REQUIRE(back.line_count == out.line_count);
        for (std::size_t i = 0; i < program.moves.size(); ++i, ++moves) {
          REQUIRE(back.moves[i].line == out.move_lines[i]);
          REQUIRE(back.moves[i].rapid == program.moves[i].rapid);
          require_same_joints(machine, program.moves[i], back.moves[i]);
          if (!program.moves[i].rapid)
            REQUIRE(back.moves[i].duration == Approx(program.moves[i].duration).epsilon(1e-4));
        }
      }
    }
  CHECK(moves == 9000);
  const auto laser = machine_of("laser_5p1", "grbl");
  const auto program = random_joint_program(laser, rng, 50);
  CHECK(read_back(dialect_named("grbl"), laser, emitted(dialect_named("grbl"), laser, program).text)
            .moves.size() == 50);
}

TEST_CASE("grbl: what F means by firmware and kind of move", "[machines][dialects]") {
  struct Row {
    const char* dialect;
    const char* letters;
    const char* motion;
  };
  // In 2 s: 30/min in G93; 5 mm are 150 mm/min, 15 deg are 450 deg/min, 12 deg are 360.
  const std::vector<Row> rows = {
      {"grbl", "XYBC", "G53 G1 X3 Y4 B12 C9 F30\n"},
      {"grbl", "BC", "G53 G1 B12 C9 F30\n"},
      {"grbl_fluidnc", "XYBC", "G53 G1 X3 Y4 B12 C9 F30\n"},
      {"grbl_reprapfirmware", "BC", "G53 G1 B12 C9 F30\n"},
      {"grbl_marlin", "XY", "G1 X3 Y4 F150\n"},
      {"grbl_marlin", "XYBC", "G1 X3 Y4 B12 C9 F150\n"},
      {"grbl_marlin", "BC", "G1 B12 C9 F450\n"},
      {"grbl_klipper", "XYBC", "G1 X3 Y4 B12 C9 F150\n"},
      {"grbl_klipper", "BC", "G1 B12 C9 F360\n"},
  };
  for (const auto& row : rows) {
    INFO(row.dialect << " " << row.letters);
    const auto machine = machine_of("table_table_bc", row.dialect);
    const auto text =
        emitted(dialect_named(row.dialect), machine, one_move(machine, row.letters)).text;
    CHECK(text.find(row.motion) != std::string::npos);
    CHECK(read_back(dialect_named(row.dialect), machine, text).moves[1].duration == Approx(2.0));
  }
}

TEST_CASE("grbl: what a firmware does not know is not written", "[machines][dialects]") {
  for (const auto& dialect : grbl::kDialects) {
    INFO(dialect.name);
    auto machine = machine_of("table_table_bc", dialect.name);
    machine.process.events = {{"spindle_on", "M3 S{rpm}", false, 0.0, 0.0},
                              {"power", "M67 E0 Q{percent}", true, 0.0, 0.0}};
    auto program = one_move(machine, "XY");
    program.actions = {event("spindle_on", 1, {{"rpm", "900"}}),
                       event("power", 2, {{"percent", "5"}}),
                       action(MachineAction::Kind::dwell, 2, "", 0.25),
                       action(MachineAction::Kind::cut_label, 2, "CUT (2)")};
    const auto text = emitted(dialect, machine, program).text;
    const bool grbl =
        std::string(dialect.name) == "grbl" || std::string(dialect.name) == "grbl_fluidnc";
    CHECK((text.find("M30") != std::string::npos) == grbl);  // elsewhere it deletes the file
    CHECK((text.find("\n(") != std::string::npos) == grbl);
    CHECK((text.find("\nN") != std::string::npos) == grbl);
    CHECK((text.find("G61") != std::string::npos) == grbl);
    CHECK((text.find("G93") != std::string::npos) == knows_machine_words(dialect.name));
    CHECK(text.find(grbl ? "G4 P0.25\n" : "G4 P250\n") != std::string::npos);
    // Statements of a machine wait for the motion in front of them.
    CHECK((text.find("M400\nM3 S900\n") != std::string::npos) == !grbl);
    CHECK((text.find("M400\nM67 ") != std::string::npos) ==
          (std::string(dialect.name) == "grbl_marlin"));
    const auto back = read_back(dialect, machine, text);
    REQUIRE(back.events.size() == 3);
    CHECK(back.events[2].seconds == Approx(0.25));
    require_common_rules(dialect, machine, one_move(machine, "X"));
  }
}

TEST_CASE("grbl: what cannot be printed is refused", "[machines][dialects]") {
  const auto refused = [](const std::string& dialect, MachineDefinition machine) {
    const auto out = dialect_named(dialect).emit(machine, one_move(machine, "X"));
    REQUIRE_FALSE(out.ok());
    CHECK(out.diagnostics()[0].code == "PR203");
  };
  auto machine = machine_of("table_table_bc", "grbl_marlin");
  machine.dialect.offset_guard = true;
  refused("grbl_marlin", machine);
  machine = machine_of("table_table_bc", "grbl");
  machine.dialect.units = "inch";
  refused("grbl", machine);
  refused("grbl_fluidnc", machine_of("laser_5p1", "grbl_fluidnc"));  // axis W
}

TEST_CASE("grbl: what could move differently than certified is refused", "[machines][dialects]") {
  for (const auto& dialect : grbl::kDialects) {
    INFO(dialect.name);
    const auto machine = machine_of("table_table_bc", dialect.name);
    const auto good = emitted(dialect, machine, one_move(machine, "XYB")).text;
    std::vector<std::pair<std::string, std::string>> changes = {
        {"G1 X3", "G2 X3"},     {"G1 X3", "G1 W3"},   {"G1 X3", "G1 X3 X4"},
        {"G1 X3", "G1 X3..2"},  {"G1 X3", "G1 X3e1"}, {"G1 X3", "G0 G1 X3"},
        {"G1 X3", "G91 G1 X3"}, {"G1 X3", "G28 X3"},  {"G1 X3", "M999\nG1 X3"},
        {"G21", "G20"},         {"G90", "G91"},       {" F", " E"},
    };
    if (knows_machine_words(dialect.name)) changes.push_back({"G93", "G95"});
    if (knows_machine_words(dialect.name)) changes.push_back({"G93\n", "G94\n"});
    CHECK(require_refused(dialect, machine, good, changes) >= 10);
    std::mt19937 rng(112);
    require_bounded(dialect, machine, good, rng);
    if (!knows_machine_words(dialect.name)) continue;
    std::string open = good;
    open.erase(open.find("G53 G1"), 4);
    CHECK_FALSE(read_back(dialect, machine, open).offset_guard);
  }
}
