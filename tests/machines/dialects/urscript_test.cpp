#include "machines/dialects/urscript.h"

#include "tests/machines/dialects/robot_programs.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition arm(std::vector<MachineOverride> more = {}) {
  more.insert(more.begin(), {"dialect.name", "urscript"});
  return shipped_machine("robot_6r", more);
}

}  // namespace

TEST_CASE("urscript: read_back(emit(x)) is x to the printed digits", "[machines][dialects]") {
  std::mt19937 rng(81);
  const auto machine = arm();
  std::size_t rounded = 0;
  for (int round = 0; round < 400; ++round)
    rounded += require_same_arm_program(urscript::kDialect, machine,
                                        random_arm_program(machine, rng, 10), {});
  CHECK(rounded > 300);
  const auto joint = arm({{"dialect.mode", "joint"}, {"dialect.digits_deg", "7"}});
  for (int round = 0; round < 100; ++round) {
    const auto program = random_joint_program(joint, rng, 10);
    require_same_arm_program(urscript::kDialect, joint, program, {});
  }
}

TEST_CASE("urscript: movep at both sides of a rounded corner, movel elsewhere",
          "[machines][dialects]") {
  const auto machine = arm();
  auto program = short_arm_program(machine);
  const auto text = emitted(urscript::kDialect, machine, program).text;
  const std::string target = "(pose_trans(sp_part, p[";
  CHECK(text.find("movel" + target + "0, 0, 0, 0, 0, 0]), a=1.2, v=0.25)") != std::string::npos);
  CHECK(text.find("movep" + target + "0.1, 0, 0, 0, 0, 0]), a=1.2, v=0.05, r=0.004)") !=
        std::string::npos);
  CHECK(text.find("movep" + target + "0.1, 0.05, 0, 0, 0, 0]), a=1.2, v=0.025, r=0)") !=
        std::string::npos);
  const auto back = read_back(urscript::kDialect, machine, text);
  CHECK(back.moves[2].blend == Approx(4.0));
  CHECK(back.moves[3].duration == Approx(2.0));
  // A statement needs a robot that stands.
  program.actions = {action(MachineAction::Kind::dwell, 3, "", 0.5)};
  const auto stops = emitted(urscript::kDialect, machine, program).text;
  CHECK(stops.find("movep") == std::string::npos);
  CHECK(stops.find("movel" + target + "0.1, 0, 0, 0, 0, 0]), t=2)") != std::string::npos);
}

TEST_CASE("urscript: programs of others in the base frame", "[machines][dialects]") {
  const auto machine = arm();
  const auto own = emitted(urscript::kDialect, machine, short_arm_program(machine)).text;
  const auto tcp =
      own.substr(own.find("set_tcp"), own.find('\n', own.find("set_tcp")) - own.find("set_tcp"));
  const std::string text = "# of another post\n\ndef job():\n\t" + tcp +
                           "\n    movej([0, -1.5, 1.5, 0, 0.7, 0], a=1.4, v=1.05)\n"
                           "    movel(p[1.5, 0.1, 0.8, 0, 0, 0], a=1.2, v=0.1)\n"
                           "    movep(p[1.5, 0.2, 0.8, 0, 0, 0.1], a=1.2, v=0.05, r=0)\n"
                           "    movel(p[1.6, 0.2, 0.8, 0, 0, 0.1], t=3)\nend\n";
  const auto refused = [&](const std::string& old, const std::string& now) {
    std::string changed = text;
    REQUIRE(changed.find(old) != std::string::npos);
    changed.replace(changed.find(old), old.size(), now);
    const auto read = urscript::read_back(machine, changed, "job.script");
    REQUIRE_FALSE(read.ok());
    UNSCOPED_INFO(to_string(read.diagnostics().front()));
    return to_string(read.diagnostics().front());
  };
  CHECK(refused("a=1.4, v=1.05", "").find("job.script:5:5") != std::string::npos);
  CHECK(refused("movej([0, -1.5, 1.5, 0, 0.7, 0]", "movej(p[1, 0, 1, 0, 0, 0]")
            .find("which of the arm") != std::string::npos);
  CHECK(refused("movel(p[1.5", "while True:").find("program flow") != std::string::npos);
  CHECK(refused("set_tcp(", "textmsg(").find("NC347") != std::string::npos);
  CHECK(refused("movel(p[1.5, 0.1, 0.8, 0, 0, 0]",
                "movel(pose_trans(sp_part, p[1.5, 0.1, 0.8, 0, 0, 0])")
            .find("NC348") != std::string::npos);
  const auto read = urscript::read_back(machine, text, "job.script");
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  const ReadBack& back = read.value();
  REQUIRE(back.moves.size() == 4);
  CHECK(back.part->isApprox(Pose::Identity()));
  CHECK(back.moves[1].tool.translation() == Vec3(1500, 100, 800));
  CHECK(back.moves[2].duration == Approx(2.0));
  CHECK(back.moves[3].duration == Approx(3.0));
}

TEST_CASE("urscript: events, and those on the fly that stop the robot", "[machines][dialects]") {
  auto machine = arm();
  machine.process.events = {{"beam_on", "set_standard_digital_out(1, True)", true, 0.0, 0.0},
                            {"beam_off", "set_standard_digital_out(1, False)", false, 0.0, 0.0},
                            {"message", "textmsg(\"{text}\")", true, 0.0, 0.0}};
  auto program = short_arm_program(machine);
  program.actions = {event("message", 1, {{"text", "a, \"b\") and (c"}}), event("beam_on", 3),
                     event("beam_off", 4), action(MachineAction::Kind::dwell, 4, "", 0.25)};
  const auto out = urscript::emit(machine, program);
  REQUIRE(out.ok());
  REQUIRE(out.diagnostics().size() == 1);
  CHECK(out.diagnostics()[0].code == "PR222");
  CHECK(out.diagnostics()[0].severity == Severity::warning);
  const auto back = read_back(urscript::kDialect, machine, out.value().text);
  REQUIRE(back.events.size() == 4);
  CHECK(back.events[0].name == "message");
  CHECK(back.events[1].before == 3);
  CHECK(back.moves[3].beam);
  CHECK(back.moves[2].blend == 0.0);
  CHECK_FALSE(back.events[2].beam);
  CHECK(back.events[3].seconds == 0.25);
}

TEST_CASE("urscript: what cannot be printed is refused", "[machines][dialects]") {
  const auto refused = [](const MachineDefinition& m, const MachineProgram& p, const char* code) {
    const auto out = urscript::emit(m, p);
    REQUIRE_FALSE(out.ok());
    CHECK(out.diagnostics()[0].code == code);
  };
  auto machine = arm();
  auto program = short_arm_program(machine);
  require_common_rules(urscript::kDialect, machine, program);
  program.moves.erase(program.moves.begin());
  refused(machine, program, "PR203");
  auto named = machine;
  named.axes[2].name = "J3";
  refused(named, short_arm_program(machine), "PR202");
  refused(arm({{"dialect.path_mode", "spline"}}), short_arm_program(machine), "PR203");
}

TEST_CASE("urscript: what could move differently than certified is refused",
          "[machines][dialects]") {
  const auto machine = arm();
  const auto good = emitted(urscript::kDialect, machine, short_arm_program(machine)).text;
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"def smoothpost():", "def smoothpost()"},
      {"def smoothpost():", "thread smoothpost():"},
      {"\nend\n", "\n"},
      {"\nend\n", "\nend\nsmoothpost()\n"},
      {"movep(", "movec("},
      {"pose_trans(sp_part,", "pose_trans(other,"},
      {"pose_trans(sp_part, p[0.1, 0, 0, 0, 0, 0])", "p[0.1, 0, 0, 0, 0, 0]"},
      {"p[0.1, 0, 0, 0, 0, 0]", "p[0.1, 0, 0, 0, 0]"},
      {"p[0.1, 0, 0, 0, 0, 0]", "p[0.1, 0, 0, 0, 0, 1e3]"},
      {"p[0.1, 0, 0, 0, 0, 0])", "p[0.1, 0, 0, 0, 0, 0]"},
      {", v=0.05,", ", v=0,"},
      {", r=0.004)", ", r=-0.004)"},
      {", r=0.004)", ")"},
      {"set_tcp(p[", "set_tcp(p[9"},
      {"  set_tcp", "  # set_tcp"},
      {"set_payload(32, ", "set_payload(3, "},
      {"  sp_part", "  # sp_part"},
      {"movej([", "movej(p["},
      {"movel(", "movep("},
      {"a=0.5, v=0.2", "a=0.5, v=0"},
      {"  movep", "  while True\n  movep"},
      {"  movep", "  set_tcp(p[0, 0, 0, 0, 0, 0])\n  movep"},
  };
  CHECK(require_refused(urscript::kDialect, machine, good, changes) >= 10);
  std::mt19937 rng(82);
  require_bounded(urscript::kDialect, machine, good, rng);
}

TEST_CASE("urscript_servoj: a stream of targets, held before everything else",
          "[machines][dialects]") {
  const auto machine = shipped_machine(
      "robot_6r", {{"dialect.name", "urscript_servoj"}, {"dialect.digits_deg", "7"}});
  const Dialect& dialect = urscript::kServoDialect;
  std::mt19937 rng(82);
  for (int round = 0; round < 100; ++round)
    require_same_arm_program(dialect, machine, random_joint_program(machine, rng, 10), {});
  MachineProgram program;
  program.part.translation() = Vec3(1400, 0, 600);
  MachineMove move;
  move.to = home_of(machine);
  move.joints = 63;
  move.rapid = true;
  program.moves = {move};
  move.rapid = false;
  move.duration = 0.008;
  for (int i = 0; i < 3; ++i) {
    move.to[0] += 0.001;
    program.moves.push_back(move);
  }
  move.rapid = true;
  program.moves.push_back(move);
  program.actions = {event("coolant_on", 2)};
  const auto good = emitted(dialect, machine, program).text;
  INFO(good);
  const std::string servo = ", t=0.008, lookahead_time=0.03, gain=2000)\n";
  CHECK(good.find(servo + "  sp_hold(") < good.find("  set_standard_digital_out(2, True)"));
  const auto back = read_back(dialect, machine, good);
  REQUIRE(back.moves.size() == 5);
  CHECK(back.moves[2].duration == Approx(0.008));
  CHECK_FALSE(back.moves[1].rapid);
  CHECK(back.events.at(0).before == 2);
  const auto first_hold =
      good.substr(good.find("  sp_hold("), good.find("  set_standard") - good.find("  sp_hold("));
  const std::vector<std::pair<std::string, std::string>> changes = {
      {first_hold, ""},
      {"  sp_hold([0.001", "  sp_hold([0.002"},
      {"t=0.008, lookahead_time=0.03", "t=0, lookahead_time=0.03"},
      {"t=0.008, lookahead_time=0.03", "t=0.008, lookahead_time=0.2"},
      {"t=0.008, lookahead_time=0.03, gain=2000", "t=0.008"},
      {"    stopj(10)\n", ""},
      {"servoj(q, t=0.2", "servoj(q, t=0.02"},
      {"  end\n", ""},
      {"  def sp_hold(q):", "  def sp_hold(p):"},
      {"  movej(", "  servoj("},
  };
  CHECK(require_refused(dialect, machine, good, changes) == 10);
  auto tool = short_arm_program(machine);
  CHECK_FALSE(dialect.emit(machine, tool).ok());
  require_bounded(dialect, machine, good, rng);
}
