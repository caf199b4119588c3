#include "machines/dialects/ros_trajectory.h"

#include "tests/machines/dialects/random_programs.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition machine_of(const std::string& name, const Dialect& dialect) {
  return shipped_machine(
      name,
      {{"dialect.name", dialect.name}, {"dialect.mode", "joint"}, {"dialect.path_mode", "exact"}});
}

}  // namespace

TEST_CASE("ros_trajectory: read_back(emit(x)) is x to the printed digits", "[machines][dialects]") {
  std::mt19937 rng(101);
  for (const Dialect* dialect : {&ros_trajectory::kDialect, &ros_trajectory::kRos1Dialect})
    for (const char* name : {"laser_5p1", "table_table_ac", "robot_6r", "finish_2p2r_1p1r"}) {
      const auto machine = machine_of(name, *dialect);
      for (int round = 0; round < 50; ++round) {
        const auto program = random_joint_program(machine, rng, 10);
        const auto out = emitted(*dialect, machine, program);
        const auto back = read_back(*dialect, machine, out.text);
        REQUIRE(back.moves.size() == program.moves.size());
        REQUIRE(back.exact_path);
        REQUIRE(back.offset_guard);
        for (std::size_t i = 0; i < program.moves.size(); ++i) {
          REQUIRE(back.moves[i].line == out.move_lines[i]);
          require_same_joints(machine, program.moves[i], back.moves[i]);
          REQUIRE_FALSE(back.moves[i].rapid);
          if (!program.moves[i].rapid)
            REQUIRE(std::abs(back.moves[i].duration - program.moves[i].duration) < 2e-9);
        }
      }
    }
}

TEST_CASE("ros_trajectory: joints that a first link does not name stay at home",
          "[machines][dialects]") {
  const auto machine = machine_of("table_table_bc", ros_trajectory::kDialect);
  MachineProgram program;
  MachineMove move;
  move.to = JointVector::Constant(machine.size(), 0.25);
  move.joints = 1U << machine.axis_by_letter('Z');
  move.rapid = true;
  program.moves = {move};
  const auto back = read_back(ros_trajectory::kDialect, machine,
                              emitted(ros_trajectory::kDialect, machine, program).text);
  REQUIRE(back.moves.size() == 1);
  const JointVector home = home_of(machine);
  for (int j = 0; j < machine.size(); ++j) {
    const double wanted = move.joints >> j & 1U ? 0.25 : home[j];
    CHECK(std::abs(back.moves[0].to[j] - wanted) < 1e-7);
  }
}

TEST_CASE("ros_trajectory: rapids keep to a quarter of the velocity limits",
          "[machines][dialects]") {
  std::mt19937 rng(102);
  const auto machine = machine_of("table_table_bc", ros_trajectory::kDialect);
  auto program = random_joint_program(machine, rng, 200);
  for (auto& move : program.moves) move.rapid = true;
  const auto back = read_back(ros_trajectory::kDialect, machine,
                              emitted(ros_trajectory::kDialect, machine, program).text);
  double fastest = 0.0;
  for (std::size_t i = 1; i < back.moves.size(); ++i)
    for (int j = 0; j < machine.size(); ++j)
      fastest = std::max(fastest, std::abs(back.moves[i].to[j] - back.moves[i - 1].to[j]) /
                                      back.moves[i].duration /
                                      machine.axes[static_cast<std::size_t>(j)].velocity);
  CHECK(fastest <= 0.25 * (1 + 1e-4));
  CHECK(fastest > 0.24);
}

TEST_CASE("ros_trajectory: events have the time of the point in front, a dwell repeats it",
          "[machines][dialects]") {
  auto machine = machine_of("laser_5p1", ros_trajectory::kDialect);
  machine.process.events = {{"gas_on", "gas on", false, 0.0, 0.0},
                            {"pierce", "beam pierce", false, 0.3, 0.0},
                            {"beam_off", "beam off", true, 0.0, 0.0}};
  std::mt19937 rng(103);
  auto program = random_joint_program(machine, rng, 4);
  for (std::size_t i = 1; i < 4; ++i) {
    program.moves[i].rapid = false;
    program.moves[i].duration = 0.5;
  }
  program.actions = {event("gas_on", 0), action(MachineAction::Kind::dwell, 0, "", 0.125),
                     event("pierce", 2), event("beam_off", 3)};
  const auto text = emitted(ros_trajectory::kDialect, machine, program).text;
  const auto back = read_back(ros_trajectory::kDialect, machine, text);
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"gas_on", 0}, {"dwell", 0}, {"pierce", 2}, {"dwell", 2}, {"beam_off", 3}};
  REQUIRE(back.events.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(back.events[i].name == expected[i].first);
    CHECK(back.events[i].before == expected[i].second);
  }
  REQUIRE(back.moves.size() == 4);
  CHECK(back.events[3].seconds == Approx(0.3));
  CHECK(back.moves[2].duration == Approx(0.5));
  CHECK(back.moves[2].beam);
  CHECK_FALSE(back.moves[3].beam);
  const auto start = text.find("# start:");
  CHECK(start < text.find("# at "));
  CHECK(text.find("# at ") < text.find("# wait 0.125\n"));
}

TEST_CASE("ros_trajectory: what is not certified has joints that no controller has",
          "[machines][dialects]") {
  const auto machine = machine_of("robot_6r", ros_trajectory::kDialect);
  std::mt19937 rng(104);
  auto program = random_joint_program(machine, rng, 4);
  require_common_rules(ros_trajectory::kDialect, machine, program);
  program.certified = false;
  CHECK(emitted(ros_trajectory::kDialect, machine, program)
            .text.find("joint_names: [NOT_CERTIFIED_A1, NOT_CERTIFIED_A2,") != std::string::npos);
  program.moves[1].interpolation = MoveInterpolation::tool;
  const auto refused = ros_trajectory::emit(machine, program);
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.diagnostics()[0].code == "PR203");
}

TEST_CASE("ros_trajectory: malformed messages are refused", "[machines][dialects]") {
  const auto machine = machine_of("robot_6r", ros_trajectory::kDialect);
  MachineProgram program;
  MachineMove move;
  move.to = JointVector::Zero(6);
  move.joints = 63;
  move.rapid = true;
  program.moves = {move, move};
  program.moves[1].rapid = false;
  program.moves[1].duration = 0.5;
  program.moves[1].to[0] = 0.25;
  program.actions = {action(MachineAction::Kind::dwell, 1, "", 0.5)};
  const auto good = emitted(ros_trajectory::kDialect, machine, program).text;
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"header: ", "Header: "},
      {"joint_names: [A1, A2", "joint_names: [A2, A1"},
      {"points:", "point:"},
      {"[0.25, 0, 0, 0, 0, 0]", "[0.25, 0, 0, 0, 0]"},
      {"[0.25, 0, 0, 0, 0, 0]", "[0.25, 0, 0, 0, 0, 0, 0]"},
      {"[0.25, 0, 0, 0, 0, 0]", "[1e-3, 0, 0, 0, 0, 0]"},
      {"[0.25, 0, 0, 0, 0, 0], velocities: []", "[0.25, 0, 0, 0, 0, 0], velocities: [1]"},
      {"sec: ", "secs: "},
      {", nanosec: ", ", nanosec: -"},
      {"# wait 0.5", "# wait 0.4"},
      {"# wait 0.5", "# - wait 0.5\n# wait 0.5\n# wait 0.5"},
      {"- {positions: [0, 0", "- positions: [0, 0"},
      {"- {positions: [0, 0", "# at 1.0 M3\n- {positions: [0, 0"},
      {"# start:", "# - start:"},
  };
  CHECK(require_refused(ros_trajectory::kDialect, machine, good, changes) >= 10);
  std::mt19937 rng(105);
  require_bounded(ros_trajectory::kDialect, machine, good, rng);
}
