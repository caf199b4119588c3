#include "machines/dialects/yaskawa_jbi.h"

#include "machines/dialects/tool_frame.h"
#include "machines/dialects/yaskawa_posture.h"
#include "tests/machines/dialects/robot_programs.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition arm(std::vector<MachineOverride> more = {}) {
  more.insert(more.begin(), {{"dialect.name", "yaskawa_jbi"}, {"dialect.digits_mm", "3"}});
  return shipped_machine("robot_6r", more);
}

// Away from where a printed digit moves an axis by many: axis 5 at 0 and the stretched elbow.
JointVector well_placed_joints(const MachineDefinition& machine, std::mt19937& rng) {
  const yaskawa_jbi::Postures postures(machine);
  while (true) {
    JointVector q = random_joints(machine, rng);
    if (std::abs(std::sin(q[4])) < 0.2 || std::abs(std::sin(q[2] - 0.175)) < 0.2) continue;
    if (postures.of(q)) return q;
  }
}

MachineProgram random_program(const MachineDefinition& machine, std::mt19937& rng, int moves) {
  auto program = random_arm_program(machine, rng, moves, 0.5);
  for (auto& move : program.moves) move.to = well_placed_joints(machine, rng);
  return program;
}

}  // namespace

TEST_CASE("yaskawa_jbi: read_back(emit(x)) is x to the printed digits", "[machines][dialects]") {
  std::mt19937 rng(111);
  const auto machine = arm();
  ScrewChain in_base = chain_of(machine, 87.5);
  in_base.workpiece_home = Pose::Identity();
  const double degree = kRadiansPerDegree;
  std::size_t lines = 0, joints = 0;
  for (int round = 0; round < 300; ++round) {
    const auto program = random_program(machine, rng, 10);
    const auto out = emitted(yaskawa_jbi::kDialect, machine, program);
    const auto back = read_back(yaskawa_jbi::kDialect, machine, out.text);
    REQUIRE(back.moves.size() == program.moves.size());
    REQUIRE(back.offset_guard);
    REQUIRE(back.exact_path);
    REQUIRE(back.line_count == out.line_count);
    REQUIRE(back.part);
    REQUIRE(back.part->isApprox(Pose::Identity()));
    for (std::size_t i = 0; i < program.moves.size(); ++i) {
      const auto& planned = program.moves[i];
      const auto& found = back.moves[i];
      REQUIRE(found.line == out.move_lines[i]);
      REQUIRE(found.interpolation == planned.interpolation);
      REQUIRE(found.blend == 0.0);
      const bool tool = planned.interpolation == MoveInterpolation::tool;
      const Pose want = tool ? program.part * planned.tool : forward(in_base, planned.to);
      const Pose got = tool ? found.tool : forward(in_base, found.to);
      REQUIRE((got.translation() - want.translation()).norm() <= 2e-3);
      REQUIRE(rotation_log(got.linear().transpose() * want.linear()).norm() <= 2e-4 * degree);
      const bool goes = tool && !planned.tool.isApprox(program.moves[i - 1].tool, 1e-9);
      if (goes && !planned.rapid) {
        REQUIRE(found.duration >= planned.duration * (1 - 1e-4));
        ++lines;
      }
      if (tool) continue;
      REQUIRE(found.known == 63U);
      REQUIRE((found.to - planned.to).cwiseAbs().maxCoeff() < 0.05 * degree);
      ++joints;
    }
  }
  CHECK(lines > 1000);
  CHECK(joints > 500);
}

TEST_CASE("yaskawa_jbi: joint moves take the planned time", "[machines][dialects]") {
  std::mt19937 rng(112);
  const auto machine = arm();
  std::size_t timed = 0;
  for (int round = 0; round < 100; ++round) {
    auto program = random_joint_program(machine, rng, 10);
    for (auto& move : program.moves) move.to = well_placed_joints(machine, rng);
    timed += require_joint_times(yaskawa_jbi::kDialect, machine, program, 0.05);
  }
  CHECK(timed > 500);
}

TEST_CASE("yaskawa_jbi: a posture and its flange give the joints back", "[machines][dialects]") {
  std::mt19937 rng(113);
  const auto machine = arm();
  const yaskawa_jbi::Postures postures(machine);
  REQUIRE(postures.exists());
  ScrewChain chain = chain_of(machine);
  chain.workpiece_home = Pose::Identity();
  const Pose to_flange = tool_frame(machine, 0.0).inverse();
  std::array<std::size_t, 6> seen{};
  for (int i = 0; i < 2000; ++i) {
    const JointVector q = well_placed_joints(machine, rng);
    const auto posture = postures.of(q);
    REQUIRE(posture);
    const auto found = postures.joints(forward(chain, q) * to_flange, *posture);
    REQUIRE(found);
    for (int j = 0; j < 6; ++j)
      REQUIRE(std::abs((*found)[static_cast<std::size_t>(j)] - q[j]) < 1e-7);
    seen[0] += posture->no_flip ? 1 : 0;
    seen[1] += posture->lower ? 1 : 0;
    seen[2] += posture->rear ? 1 : 0;
    for (std::size_t k = 0; k < 3; ++k) seen[3 + k] += posture->turned[k] ? 1 : 0;
  }
  for (const std::size_t n : seen) CHECK(n > 20);
  JointVector q = home_of(machine);
  q[4] = 0.0;
  CHECK_FALSE(postures.of(q));
  q[4] = 0.5;
  q[3] = kPi;
  CHECK_FALSE(postures.of(q));
}

TEST_CASE("yaskawa_jbi: the text of a job", "[machines][dialects]") {
  auto machine = arm();
  machine.process.events = {{"beam_on", "DOUT OT#(1) ON", true, 0.0, 0.0},
                            {"beam_off", "DOUT OT#(1) OFF", false, 0.0, 0.0}};
  auto program = short_arm_program(machine);
  program.moves[3].duration = 0.2;  // 250 mm/s: the speed of links
  program.actions = {
      action(MachineAction::Kind::cut_label, 1, "CUT 1 from input line 4 with tool 1"),
      event("beam_on", 3), event("beam_off", 4), action(MachineAction::Kind::dwell, 4, "", 0.251)};
  const auto out = yaskawa_jbi::emit(machine, program);
  REQUIRE(out.ok());
  REQUIRE(out.diagnostics().size() == 1);
  CHECK(out.diagnostics()[0].code == "PR222");
  const std::string& text = out.value().text;
  for (const char* line :
       {"/JOB\r\n//NAME SMTHPOST\r\n//POS\r\n///NPOS 4,0,0,1,0,0\r\n",
        "///RCONF 0,0,0,0,0,0,0,0\r\n", "\r\nC00001=1400,0,600,0,0,0\r\n",
        "\r\nP00091=", "\r\nNOP\r\nSETTOOL TL#(9) P091\r\n", "\r\nMOVJ C00000 VJ=10 PL=0\r\n",
        "\r\n'CUT 1 from input line 4 with\r\n'tool 1\r\n*CUT1\r\n",
        "\r\nMOVL C00001 V=250 PL=0\r\n", "\r\nMOVL C00002 V=50 PL=0\r\nDOUT OT#(1) ON\r\n",
        "\r\nMOVL C00003 V=249.9 PL=0\r\nDOUT OT#(1) OFF\r\nTIMER T=0.26\r\nEND\r\n"}) {
    INFO(line << "\n" << text);
    CHECK(text.find(line) != std::string::npos);
  }
  const auto back = read_back(yaskawa_jbi::kDialect, machine, text);
  CHECK(back.moves[1].rapid);
  CHECK_FALSE(back.moves[3].rapid);
  REQUIRE(back.events.size() == 3);
  CHECK(back.moves[3].beam);
  CHECK_FALSE(back.events[1].beam);
}

TEST_CASE("yaskawa_jbi: what cannot be printed is refused", "[machines][dialects]") {
  const auto machine = arm();
  require_common_rules(yaskawa_jbi::kDialect, machine, short_arm_program(machine));
  const auto refused = [](const MachineDefinition& m, const MachineProgram& program) {
    const auto out = yaskawa_jbi::emit(m, program);
    REQUIRE_FALSE(out.ok());
    CHECK(out.diagnostics()[0].code == "PR203");
  };
  auto slow = short_arm_program(machine);
  slow.moves[2].duration = 2000.0;  // 0.05 mm/s
  CHECK(emitted(yaskawa_jbi::kDialect, machine, slow).text.find("MOVL C00002 V=0.1 PL=0") !=
        std::string::npos);
  auto singular = short_arm_program(machine);
  singular.moves[0].to[4] = 0.0;
  refused(machine, singular);
  auto fine = machine;
  fine.dialect.digits_length = 4;
  refused(fine, short_arm_program(machine));
  auto other = machine;
  other.axes[5].joint.origin.y() += 10.0;  // no spherical wrist
  refused(other, short_arm_program(machine));
}

TEST_CASE("yaskawa_jbi: what could move differently than certified is refused",
          "[machines][dialects]") {
  const auto machine = arm();
  const auto good = emitted(yaskawa_jbi::kDialect, machine, short_arm_program(machine)).text;
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"/JOB", "/JOBS"},
      {"//NAME SMTHPOST\r\n", ""},
      {"///NPOS 4,", "///NPOS 5,"},
      {"///NPOS 4,0,0,1", "///NPOS 4,1,0,1"},
      {"///POSTYPE BASE", "///POSTYPE USER"},
      {"///RECTAN\r\n", ""},
      {"///RCONF 0,0,0,0,0,0,0,0\r\n", ""},
      {"///RCONF 0,0,0,0,0,0,0,0", "///RCONF 0,0,0,0,0,0"},
      {"///RCONF 0,0,0,0,0,0,0,0", "///RCONF 0,0,2,0,0,0,0,0"},
      {"C00002=", "C00003="},
      {"C00002=1500,0,600,0,0,0", "C00002=1500,0,600,0,0"},
      {"C00002=1500", "C00002=1.5e3"},
      {"C00000=", "C00000=9"},
      {"P00091=", "P00092="},
      {"P00091=", "P00091=9"},
      {"////FRAME BASE", "////FRAME USER 1"},
      {"///ATTR SC,RW,RJ", "///ATTR SC,RW"},
      {"SETTOOL TL#(9) P091\r\n", ""},
      {"SETTOOL TL#(9)", "SETTOOL TL#(8)"},
      {"MOVL C00002", "MOVL C00009"},
      {"MOVL C00002", "MOVC C00002"},
      {"MOVL C00002 V=50 PL=0", "MOVL C00002 V=50"},
      {"MOVL C00002 V=50 PL=0", "MOVL C00002 V=50 PL=3"},
      {"MOVL C00002 V=50", "MOVL C00002 V=0"},
      {"MOVL C00002 V=50", "MOVL C00002 VJ=50"},
      {"MOVJ C00000 VJ=10", "MOVJ C00000 VJ=101"},
      {"MOVL C00003 V=25 PL=0\r\n", ""},
      {"MOVJ C00000 VJ=10 PL=0\r\n", ""},
      {"END\r\n", ""},
      {"END\r\n", "END\r\nNOP\r\n"},
  };
  CHECK(require_refused(yaskawa_jbi::kDialect, machine, good, changes) >= 10);
  std::mt19937 rng(114);
  require_bounded(yaskawa_jbi::kDialect, machine, good, rng);
}
