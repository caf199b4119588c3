#include "machines/dialects/krl.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <sstream>

#include "kernels/core/units.h"
#include "machines/dialects/zyx_angles.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

const double kTurnTolerance = radians_from_degrees(1e-4);

MachineDefinition robot(const std::vector<MachineOverride>& overrides = {}) {
  MachineDefinition machine = shipped_machine("robot_6r", overrides);
  machine.process.events.push_back({"beam_on", "$OUT[1]=TRUE", true, 0.0, 0.0});
  machine.process.events.push_back({"beam_off", "$OUT[1]=FALSE", true, 0.0, 0.0});
  machine.process.events.push_back({"pierce", "$OUT[1]=TRUE", false, 0.3, 0.0});
  machine.process.events.push_back({"power", "$ANOUT[1]={percent}*0.01", true, 0.0, 0.0});
  return machine;
}

Mat3 random_rotation(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(rng), normal(rng), normal(rng), normal(rng));
  return q.normalized().toRotationMatrix();
}

// A rotation whose B is within `away` rad of +90 or -90 degrees.
Mat3 near_gimbal(std::mt19937& rng, double away) {
  std::uniform_real_distribution<double> turn(-kPi, kPi), side(-1.0, 1.0);
  const double b = (side(rng) > 0.0 ? 1.0 : -1.0) * (kPi / 2.0 - away * side(rng));
  return rotation_from_rpy(turn(rng), b, turn(rng));
}

JointVector random_joints(const MachineDefinition& machine, std::mt19937& rng) {
  JointVector q(machine.size());
  for (int j = 0; j < machine.size(); ++j) {
    const auto& joint = machine.axes[static_cast<std::size_t>(j)].joint;
    q[j] = std::uniform_real_distribution<double>(joint.lower, joint.upper)(rng);
  }
  return q;
}

MachineMove joints_move(const MachineDefinition& machine, std::mt19937& rng) {
  MachineMove move;
  move.to = random_joints(machine, rng);
  move.joints = (1U << machine.size()) - 1U;
  move.rapid = true;
  return move;
}

MachineMove line_move(const MachineDefinition& machine, const Pose& from, std::mt19937& rng) {
  std::uniform_real_distribution<double> place(-300.0, 300.0), unit(0.0, 1.0);
  MachineMove move = joints_move(machine, rng);
  move.interpolation = MoveInterpolation::tool;
  move.tool = from;
  const double kind = unit(rng);
  if (kind > 0.1) move.tool.translation() = Vec3(place(rng), place(rng), place(rng));
  if (kind > 0.1 && kind < 0.3) move.tool.translation() = from.translation() + Vec3(1e-3, 0, 0);
  if (kind < 0.8)
    move.tool.linear() = unit(rng) < 0.5 ? random_rotation(rng)
                                         : near_gimbal(rng, std::pow(10.0, -12.0 * unit(rng)));
  move.rapid = unit(rng) < 0.1;
  move.duration = move.rapid ? 0.0 : std::uniform_real_distribution<double>(0.012, 20.0)(rng);
  return move;
}

MachineProgram random_program(const MachineDefinition& machine, std::mt19937& rng, int moves) {
  MachineProgram program;
  program.title = {"a title; with a semicolon \"and a quote"};
  program.part.translation() = Vec3(1400.5, -20.25, 600.125);
  program.part.linear() = random_rotation(rng);
  program.tool_length = 87.5;
  Pose at = Pose::Identity();
  std::bernoulli_distribution link(0.2);
  for (int i = 0; i < moves; ++i) {
    const bool first = i == 0;
    program.moves.push_back(first || link(rng) ? joints_move(machine, rng)
                                               : line_move(machine, at, rng));
    if (program.moves.back().interpolation == MoveInterpolation::tool)
      at = program.moves.back().tool;
  }
  return program;
}

MachineAction action(MachineAction::Kind kind, std::size_t before, std::string text = "") {
  MachineAction a;
  a.kind = kind;
  a.before = before;
  a.input_line = 7;
  if (kind == MachineAction::Kind::event)
    a.event.name = text;
  else
    a.text = text;
  a.seconds = 0.25;
  return a;
}

ReadBack read(const MachineDefinition& machine, const std::string& text) {
  const auto back = krl::read_back(machine, text, "out.src");
  for (const auto& d : back.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(back.ok());
  return back.value();
}

std::string emitted_text(const MachineDefinition& machine, const MachineProgram& program) {
  const auto emitted = krl::emit(machine, program);
  for (const auto& d : emitted.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(emitted.ok());
  return emitted.value().text;
}

double turn_between(const Mat3& a, const Mat3& b) { return rotation_log(a.transpose() * b).norm(); }

}  // namespace

TEST_CASE("krl: read_back(emit(x)) is x to the printed digits", "[machines][dialects]") {
  std::mt19937 rng(21);
  const auto machine = robot();
  const double half_digit = 0.5 * std::pow(10.0, -machine.dialect.digits_length) * (1 + 1e-6);
  const double half_angle =
      radians_from_degrees(0.5 * std::pow(10.0, -machine.dialect.digits_angle)) * (1 + 1e-6);
  double worst = 0.0;
  for (int round = 0; round < 2000; ++round) {
    const auto program = random_program(machine, rng, 8);
    const auto emitted = krl::emit(machine, program);
    REQUIRE(emitted.ok());
    const auto back = read(machine, emitted.value().text);
    REQUIRE(back.moves.size() == program.moves.size());
    REQUIRE(back.offset_guard);
    REQUIRE(back.exact_path);
    for (std::size_t i = 0; i < program.moves.size(); ++i) {
      const auto& planned = program.moves[i];
      const auto& found = back.moves[i];
      REQUIRE(found.line == emitted.value().move_lines[i]);
      REQUIRE(found.interpolation == planned.interpolation);
      REQUIRE(found.rapid == planned.rapid);
      if (planned.interpolation == MoveInterpolation::joints) {
        REQUIRE(found.known == planned.joints);
        REQUIRE((found.to - planned.to).cwiseAbs().maxCoeff() <= half_angle);
        continue;
      }
      REQUIRE(found.known == 0);
      REQUIRE((found.tool.translation() - planned.tool.translation()).cwiseAbs().maxCoeff() <=
              half_digit);
      worst = std::max(worst, turn_between(found.tool.linear(), planned.tool.linear()));
    }
  }
  CHECK(worst <= kTurnTolerance);
  CHECK(degrees_from_radians(worst) > 1e-7);  // the comparison is not empty
}

TEST_CASE("krl: the speeds give each line its planned time", "[machines][dialects]") {
  std::mt19937 rng(22);
  const auto machine = robot();
  int turning = 0, lines = 0;
  for (int round = 0; round < 500; ++round) {
    auto program = random_program(machine, rng, 12);
    const auto back = read(machine, emitted_text(machine, program));
    for (std::size_t i = 1; i < program.moves.size(); ++i) {
      const auto& planned = program.moves[i];
      if (planned.interpolation != MoveInterpolation::tool || planned.rapid) continue;
      const Pose& from = back.moves[i - 1].tool;
      const bool after_line = back.moves[i - 1].interpolation == MoveInterpolation::tool;
      const bool stays =
          after_line && (planned.tool.translation() - from.translation()).norm() < 2e-4;
      const bool turns = turn_between(planned.tool.linear(), from.linear()) > 1e-3;
      if (stays && !turns) continue;  // neither path nor turn: no time in the text
      ++(stays ? turning : lines);
      // A speed has at most nine decimals: 1e-9 m/s of one below 0.1 mm/s is worth more.
      const double speed =
          (planned.tool.translation() - from.translation()).norm() * 1e-3 / planned.duration;
      const double digits = stays || !after_line ? 0.0 : 1e-9 / speed;
      CHECK(std::abs(back.moves[i].duration - planned.duration) <=
            (2e-5 + digits) * planned.duration);
    }
  }
  CHECK(turning > 50);
  CHECK(lines > 1000);
}

TEST_CASE("krl: angles of a rotation give it back near and at the gimbal", "[machines][dialects]") {
  std::mt19937 rng(23);
  double worst = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double away = i % 4 == 0 ? 1.0 : std::pow(10.0, -(i % 17));
    const Mat3 rotation = i % 5 == 0 ? near_gimbal(rng, 0.0) : near_gimbal(rng, away);
    const auto angles = zyx_angles(rotation, 0.7);
    REQUIRE(std::abs(angles.y) <= kPi / 2.0 + 1e-12);
    worst =
        std::max(worst, turn_between(rotation_from_rpy(angles.x, angles.y, angles.z), rotation));
  }
  CHECK(worst < 1e-8);
  CHECK(zyx_angles(rotation_from_rpy(0.0, kPi / 2.0, 0.0), 0.7).z == 0.7);
}

TEST_CASE("krl: events on the fly are triggers, events at a stop are statements",
          "[machines][dialects]") {
  std::mt19937 rng(24);
  const auto machine = robot();
  auto program = random_program(machine, rng, 5);
  using Kind = MachineAction::Kind;
  auto power = action(Kind::event, 2, "power");
  power.event.parameters = {{"percent", "45"}};
  program.actions = {action(Kind::event, 1, "pierce"),
                     action(Kind::event, 1, "beam_on"),
                     power,
                     action(Kind::event, 3, "beam_off"),
                     action(Kind::dwell, 3),
                     action(Kind::event, 5, "beam_off")};
  const auto text = emitted_text(machine, program);
  CHECK(text.find("\n$OUT[1]=TRUE\nWAIT SEC 0.3\n") != std::string::npos);
  CHECK(text.find("\nTRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE\n") != std::string::npos);
  CHECK(text.find("DO $ANOUT[1]=45*0.01\n") != std::string::npos);
  // The robot waits behind this one: a trigger would come after the wait.
  CHECK(text.find("\n$OUT[1]=FALSE\nWAIT SEC 0.25\n") != std::string::npos);
  const auto back = read(machine, text);
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"pierce", 1},   {"dwell", 1}, {"beam_on", 1}, {"power", 2},
      {"beam_off", 3}, {"dwell", 3}, {"beam_off", 5}};
  REQUIRE(back.events.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(back.events[i].name == expected[i].first);
    CHECK(back.events[i].before == expected[i].second);
  }
  CHECK_FALSE(back.moves[0].beam);
  CHECK(back.moves[1].beam);
  CHECK(back.moves[2].beam);
  CHECK_FALSE(back.moves[3].beam);
}

TEST_CASE("krl: an event without words is refused with its line", "[machines][dialects]") {
  std::mt19937 rng(25);
  auto machine = robot();
  auto program = random_program(machine, rng, 2);
  program.actions = {action(MachineAction::Kind::event, 1, "gas_on"),
                     action(MachineAction::Kind::event, 1, "gas_off")};
  const auto refused = krl::emit(machine, program);
  REQUIRE_FALSE(refused.ok());
  REQUIRE(refused.diagnostics().size() == 2);
  CHECK(refused.diagnostics()[0].code == "PR201");
  CHECK(refused.diagnostics()[0].where.line == 7);
  machine.process.unmapped = UnmappedWords::comment;
  CHECK(emitted_text(machine, program).find("; unmapped event: gas_on\n") != std::string::npos);
}

TEST_CASE("krl: a value of the input cannot become a statement", "[machines][dialects]") {
  std::mt19937 rng(26);
  const auto machine = robot();
  auto program = random_program(machine, rng, 2);
  auto message = action(MachineAction::Kind::event, 1, "message");
  message.event.parameters = {{"text", "x\")\n$OUT[1]=TRUE ;\xC3\xA4"}};
  program.actions = {message};
  const auto text = emitted_text(machine, program);
  CHECK(text.find("\n$OUT[1]=TRUE") == std::string::npos);
  const auto back = read(machine, text);
  REQUIRE(back.events.size() == 1);
  CHECK(back.events[0].name == "message");
}

TEST_CASE("krl: frames are stated and come back", "[machines][dialects]") {
  std::mt19937 rng(27);
  const auto machine = robot();
  const auto program = random_program(machine, rng, 3);
  const auto back = read(machine, emitted_text(machine, program));
  REQUIRE(back.part);
  CHECK((back.part->translation() - program.part.translation()).norm() < 1e-3);
  CHECK(turn_between(back.part->linear(), program.part.linear()) < kTurnTolerance);
  REQUIRE(back.tool_frame);
  // From the definition: in M the tip is tool.tip, a tool length behind it along the axis.
  const Pose tip = machine.tool.flange * *back.tool_frame;
  CHECK((tip.translation() - (machine.tool.tip - 87.5 * machine.tool.axis)).norm() < 1e-3);
  CHECK(turn_between(tip.linear(), Mat3::Identity()) < kTurnTolerance);
}

TEST_CASE("krl: labels restate frames and speeds", "[machines][dialects]") {
  std::mt19937 rng(28);
  const auto machine = robot();
  auto program = random_program(machine, rng, 6);
  program.actions = {action(MachineAction::Kind::cut_label, 3, "CUT 7, input line 12")};
  const auto text = emitted_text(machine, program);
  const auto label = text.find("\n; CUT 7, input line 12\n$BASE={");
  REQUIRE(label != std::string::npos);
  for (const char* word : {"$TOOL={", "$IPO_MODE=#BASE", "$ORI_TYPE=#VAR"})
    CHECK(text.find(word, label) != std::string::npos);
  CHECK(read(machine, text).moves.size() == 6);
}

TEST_CASE("krl: options", "[machines][dialects]") {
  std::mt19937 rng(29);
  const auto program = random_program(robot(), rng, 6);
  MachineProgram open = program;
  open.certified = false;
  const auto text = emitted_text(robot(), open);
  CHECK(text.find("; NOT CERTIFIED") < text.find("PTP"));
  CHECK(text.find("\nHALT\n") < text.find("PTP"));
  CHECK(text == emitted_text(robot(), open));
  const auto first = text.find("PTP");
  CHECK(text.rfind("BAS(#VEL_PTP,10)", first) != std::string::npos);
  CHECK(text.rfind("BAS(#VEL_PTP,100)", first) == std::string::npos);
}

TEST_CASE("krl: axes without a KRL name and parts that move are refused", "[machines][dialects]") {
  std::mt19937 rng(30);
  const auto mill = shipped_machine("table_table_bc");
  const auto refused = krl::emit(mill, random_program(mill, rng, 2));
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.diagnostics()[0].code == "PR202");
  CHECK(refused.diagnostics().back().code == "PR203");
}

TEST_CASE("krl: what could move differently than certified is refused", "[machines][dialects]") {
  std::mt19937 rng(31);
  const auto machine = robot();
  MachineProgram program = random_program(machine, rng, 1);
  program.moves.push_back(line_move(machine, Pose::Identity(), rng));
  program.moves.back().rapid = false;
  program.moves.back().duration = 1.0;
  program.moves.back().tool.translation() = Vec3(10, 20, 30);
  const std::string good = emitted_text(machine, program);
  read(machine, good);
  const auto with = [&good](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
  };
  const auto good_with_end = [&good](const std::string& line, const std::string& end) {
    std::string text = good;
    const auto close = text.find('}', text.find(line));
    return text.replace(close, 1, end);
  };
  read(machine, with("LIN {", "TRIGGER WHEN DISTANCE=1 DELAY=-5 DO $OUT[1]=TRUE\nLIN {"));
  const std::vector<std::string> bad = {
      with("$BASE={", "; $BASE={"),     // no base before LIN
      with("$TOOL={X ", "$TOOL={X 9"),  // another tool
      with("$LOAD.M=", "$LOAD.M=9"),    // another load
      with("$LOAD.CM={X ", "$LOAD.CM={X 9"),
      with("$LOAD.J={X ", "$LOAD.J={Y "),
      with("LIN {", "$LOAD.M=32\nLIN {"),             // behind a motion
      with("$IPO_MODE=#BASE", "$IPO_MODE=#TCP"),      // other frame
      with("$ORI_TYPE=#VAR", "$ORI_TYPE=#CONSTANT"),  // tool does not turn
      with("LIN {", "$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\nLIN {"),
      with("LIN {", "LIN {S 2,"),  // no meaning in LIN
      with("LIN {", "TRIGGER WHEN DISTANCE=1 DELAY=0 DO $OUT[1]=TRUE\nLIN {"),
      with("LIN {", "TRIGGER WHEN DISTANCE=0 DELAY=5 DO $OUT[1]=TRUE\nLIN {"),
      with("LIN {", "TRIGGER WHEN DISTANCE=1 DELAY=5 DO $OUT[1]=TRUE\nLIN {"),
      with("LIN {", "TRIGGER WHEN DISTANCE=1 DELAY=-2000 DO $OUT[1]=TRUE\nLIN {"),
      with("LIN {", "TRIGGER WHEN PATH=1 DELAY=-5 DO $OUT[1]=TRUE\nLIN {"),
      with("LIN {", "TRIGGER WHEN PATH=-1 ONSTART DELAY=0 DO $OUT[1]=TRUE\nLIN {"),
      with("LIN {", "TRIGGER WHEN PATH=-99999 DELAY=0 DO $OUT[1]=TRUE\nLIN {"),
      with("PTP {", "TRIGGER WHEN DISTANCE=1 DELAY=-5 DO $OUT[1]=TRUE\nPTP {"),
      good_with_end("LIN {", "} C_DIS"),  // of what distance
      with("LIN {", "$APO.CDIS=-1\nLIN {"),
      with("LIN {", "$APO.CDIS=F(1)\nLIN {"),
      with("LIN {", "$OUT[99]=TRUE\nLIN {"),    // no row
      with("LIN {", "BAS(#INITMOV,0)\nLIN {"),  // resets frames
      with("PTP {A1", "PTP {E5"),               // no such axis
      with("$VEL.ORI1", "; $VEL.ORI1"),         // time not known
      with("LIN {", "$OV_PRO=100\nLIN {"),
  };
  for (const auto& text : bad) {
    INFO(text);
    CHECK_FALSE(krl::read_back(machine, text, "p").ok());
  }
}

namespace {

// Blends and chains wherever a program can have them.
MachineProgram rounding_program(const MachineDefinition& machine, std::mt19937& rng, int moves) {
  MachineProgram program = random_program(machine, rng, moves);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto is_line = [&](std::size_t i) {
    return i > 0 && i < program.moves.size() &&
           program.moves[i].interpolation == MoveInterpolation::tool && !program.moves[i].rapid;
  };
  for (std::size_t i = 1; i < program.moves.size(); ++i) {
    MachineMove& move = program.moves[i];
    move.role = MoveRole::path;
    const Pose& from = program.moves[i - 1].tool;
    const bool has_way = program.moves[i - 1].interpolation == MoveInterpolation::joints ||
                         (move.tool.translation() - from.translation()).norm() > 1e-2;
    if (is_line(i) && has_way && unit(rng) < 0.6)
      move.spline = true;
    else if (is_line(i) && is_line(i + 1) && unit(rng) < 0.7)
      move.blend = std::pow(10.0, -4.0 + 6.0 * unit(rng));
  }
  for (std::size_t i = 1; i < program.moves.size(); ++i)
    if (unit(rng) < 0.3) {
      program.actions.push_back(
          action(MachineAction::Kind::event, i, unit(rng) < 0.5 ? "beam_on" : "beam_off"));
      if (unit(rng) < 0.3) program.actions.push_back(action(MachineAction::Kind::dwell, i));
    }
  return program;
}

MachineDefinition with_latency(double seconds) {
  MachineDefinition machine = robot();
  for (auto& row : machine.process.events) row.latency = row.on_the_fly ? seconds : 0.0;
  return machine;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// A joint move to somewhere, then LINs of which the one in the middle is parted at `shares`.
MachineProgram parted_program(const MachineDefinition& machine, std::mt19937& rng,
                              const std::vector<double>& shares) {
  MachineProgram program;
  program.moves.push_back(joints_move(machine, rng));
  const auto line = [&](const Pose& to, double seconds) {
    MachineMove move = program.moves.front();
    move.interpolation = MoveInterpolation::tool;
    move.joints = 0;
    move.rapid = false;
    move.tool = to;
    move.duration = seconds;
    program.moves.push_back(move);
  };
  std::uniform_real_distribution<double> place(-300.0, 300.0), turn(-0.5, 0.5);
  const auto pose = [&] {
    Pose p = Pose::Identity();
    p.translation() = Vec3(place(rng), place(rng), place(rng));
    p.linear() = rotation_exp(Vec3(turn(rng), turn(rng), turn(rng)));
    return p;
  };
  line(pose(), 2.0);
  const Pose from = program.moves.back().tool, to = pose();
  const Vec3 whole = rotation_log(to.linear() * from.linear().transpose());
  const double seconds = std::uniform_real_distribution<double>(0.1, 5.0)(rng);
  double done = 0.0;
  for (const double share : shares) {
    Pose at = Pose::Identity();
    at.translation() = from.translation() + share * (to.translation() - from.translation());
    at.linear() = rotation_exp(share * whole) * from.linear();
    line(at, (share - done) * seconds);
    program.actions.push_back(action(MachineAction::Kind::event, program.moves.size(), "beam_on"));
    done = share;
  }
  line(to, (1.0 - done) * seconds);
  line(pose(), 2.0);
  return program;
}

}  // namespace

TEST_CASE("krl: programs with blends and splines come back", "[machines][dialects]") {
  std::mt19937 rng(33);
  auto machine = robot();
  std::erase_if(machine.process.events, [](const auto& row) { return row.event == "pierce"; });
  const double half_digit = 0.5 * std::pow(10.0, -machine.dialect.digits_length) * (1 + 1e-6);
  std::size_t blends = 0, splines = 0;
  for (int round = 0; round < 500; ++round) {
    const auto program = rounding_program(machine, rng, 24);
    const auto emitted = krl::emit(machine, program);
    REQUIRE(emitted.ok());
    const auto back = read(machine, emitted.value().text);
    REQUIRE(back.exact_path);
    REQUIRE(back.moves.size() == program.moves.size());
    for (std::size_t i = 0; i < program.moves.size(); ++i) {
      const auto& planned = program.moves[i];
      const auto& found = back.moves[i];
      REQUIRE(found.line == emitted.value().move_lines[i]);
      REQUIRE(found.interpolation == planned.interpolation);
      REQUIRE(found.spline == planned.spline);
      REQUIRE(found.rapid == planned.rapid);
      REQUIRE(found.blend <= planned.blend * (1 + 1e-9));
      REQUIRE((found.blend >= planned.blend / 1.61 || planned.blend < 1e-3));
      splines += found.spline ? 1U : 0U;
      blends += found.blend > 0.0 ? 1U : 0U;
      if (planned.interpolation == MoveInterpolation::joints) continue;
      REQUIRE((found.tool.translation() - planned.tool.translation()).cwiseAbs().maxCoeff() <=
              half_digit);
      if (planned.spline && back.moves[i - 1].interpolation == MoveInterpolation::tool)
        REQUIRE(found.duration == Approx(planned.duration).epsilon(1e-2));
    }
    std::vector<std::pair<std::string, std::size_t>> planned, found;
    for (const auto& a : program.actions)
      planned.emplace_back(a.kind == MachineAction::Kind::dwell ? "dwell" : a.event.name, a.before);
    for (const auto& e : back.events) found.emplace_back(e.name, e.before);
    REQUIRE(found == planned);
  }
  CHECK(blends > 500);
  CHECK(splines > 2000);
}

TEST_CASE("krl: distances of blends are few and stated before they are used",
          "[machines][dialects]") {
  std::mt19937 rng(34);
  const auto machine = robot();
  MachineProgram program = random_program(machine, rng, 1);
  for (int i = 0; i < 9; ++i) {
    program.moves.push_back(line_move(machine, Pose::Identity(), rng));
    MachineMove& move = program.moves.back();
    move.rapid = false;
    move.duration = 1.0;
    move.tool.translation() = Vec3(10.0 * i, i % 2, 0);
    move.blend = std::vector<double>{
        0, 1.7, 2.4, 1.6, 0.0009, 0.9999, 1, 25.5, 0}[static_cast<std::size_t>(i)];
  }
  const auto text = emitted_text(machine, program);
  const auto back = read(machine, text);
  const std::vector<double> expected = {0, 0, 1.6, 1.6, 1.6, 0, 0.63, 1, 25, 0};
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK(back.moves[i].blend == expected[i]);
  CHECK(count_of(text, "$APO.CDIS=1.6\n") == 1);
  CHECK(count_of(text, "} C_DIS\n") == 6);
  CHECK(count_of(text, "$APO.CORI=0.015\n") == 1);
  CHECK(back.exact_path);
  std::string other = text;
  other.replace(other.find("} C_DIS"), 7, "} C_VEL");
  CHECK_FALSE(read(machine, other).exact_path);
  program.moves.push_back(joints_move(machine, rng));
  program.moves[9].blend = 1.0;  // towards a PTP
  CHECK_FALSE(read(machine, emitted_text(machine, program)).exact_path);
}

TEST_CASE("krl: spline blocks hold points and triggers and are not too long",
          "[machines][dialects]") {
  std::mt19937 rng(35);
  const auto machine = robot();
  MachineProgram program = random_program(machine, rng, 1);
  for (int i = 0; i < 1203; ++i) {
    program.moves.push_back(program.moves.front());
    MachineMove& move = program.moves.back();
    move.interpolation = MoveInterpolation::tool;
    move.rapid = false;
    move.spline = i > 0;
    move.duration = i % 2 == 0 ? 0.1 : 0.2;
    move.tool.translation() = Vec3(i, 0, 0);
  }
  using Kind = MachineAction::Kind;
  program.actions = {action(Kind::event, 20, "beam_on"), action(Kind::comment, 21, "a comment"),
                     action(Kind::event, 30, "beam_off"), action(Kind::dwell, 30),
                     action(Kind::cut_label, 40, "CUT 2")};
  const auto text = emitted_text(machine, program);
  std::size_t points = 0, blocks = 0, most = 0;
  bool open = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const bool begins = line.rfind("SPLINE", 0) == 0, ends = line == "ENDSPLINE";
    if (begins) ++blocks, points = 0;
    if (open && !ends)
      CHECK((line.rfind("SPL {", 0) == 0 || line.rfind("; ", 0) == 0 ||
             line == "TRIGGER WHEN PATH=0 ONSTART DELAY=0 DO $OUT[1]=TRUE"));
    points += line.rfind("SPL {", 0) == 0 ? 1U : 0U;
    most = std::max(most, points);
    open = (open || begins) && !ends;
  }
  CHECK(blocks == 5);  // 28, 10, 500, 500, 164
  CHECK(most == 500);
  CHECK(text.find("ENDSPLINE\n$OUT[1]=FALSE\nWAIT SEC 0.25\n") != std::string::npos);
  CHECK(text.find("ENDSPLINE\n; CUT 2\n") != std::string::npos);
  const auto back = read(machine, text);
  for (std::size_t i = 2; i < back.moves.size(); ++i) {
    REQUIRE(back.moves[i].spline);
    REQUIRE(back.moves[i].duration == Approx(program.moves[i].duration).epsilon(1e-4));
  }
  CHECK_FALSE(back.moves[19].beam);
  CHECK(back.moves[20].beam);
  CHECK(back.moves[29].beam);
  CHECK_FALSE(back.moves[30].beam);
  // A place on the way of a SPL is not known well enough.
  std::string other = text;
  const std::string at_start = "PATH=0 ONSTART DELAY=0";
  other.replace(other.find(at_start), at_start.size(), "PATH=0 DELAY=-5");
  CHECK_FALSE(krl::read_back(machine, other, "p").ok());
}

TEST_CASE("krl: an event that is early by its latency is a TRIGGER with a DELAY",
          "[machines][dialects]") {
  std::mt19937 rng(36);
  const auto machine = with_latency(0.02);
  std::uniform_real_distribution<double> share(0.02, 0.98);
  for (int round = 0; round < 300; ++round) {
    std::vector<double> shares;
    for (int i = 0; i <= round % 3; ++i) shares.push_back(share(rng));
    std::sort(shares.begin(), shares.end());
    const auto program = parted_program(machine, rng, shares);
    const auto emitted = krl::emit(machine, program);
    REQUIRE(emitted.ok());
    const std::string& text = emitted.value().text;
    CHECK(count_of(text, "\nLIN {") == 3);
    CHECK(count_of(text, "\nTRIGGER WHEN ") == shares.size());
    CHECK(count_of(text, " DELAY=-") + count_of(text, " DELAY=0 ") == shares.size());
    CHECK(text.find('.', text.find("DELAY=")) > text.find("DO", text.find("DELAY=")));
    const auto back = read(machine, text);
    REQUIRE(back.moves.size() == program.moves.size());
    REQUIRE(back.events.size() == shares.size());
    for (std::size_t i = 0; i < program.moves.size(); ++i) {
      const auto& planned = program.moves[i];
      CHECK(back.moves[i].line == emitted.value().move_lines[i]);
      if (i < 2) continue;
      CHECK((back.moves[i].tool.translation() - planned.tool.translation()).norm() < 2e-4);
      CHECK(turn_between(back.moves[i].tool.linear(), planned.tool.linear()) < kTurnTolerance);
      CHECK(back.moves[i].duration == Approx(planned.duration).margin(1e-5).epsilon(1e-4));
      CHECK(back.moves[i].beam == (i >= program.actions[0].before));
    }
    for (std::size_t k = 0; k < shares.size(); ++k)
      CHECK(back.events[k].before == program.actions[k].before);
  }
}

TEST_CASE("krl: events that need a point on the way keep it", "[machines][dialects]") {
  std::mt19937 rng(37);
  const auto lines = [&](const MachineDefinition& machine, const MachineProgram& program) {
    const auto text = emitted_text(machine, program);
    CHECK(read(machine, text).moves.size() == program.moves.size());
    return count_of(text, "\nLIN {");
  };
  const auto machine = with_latency(0.02);
  const auto program = parted_program(machine, rng, {0.4});
  CHECK(lines(machine, program) == 3);
  CHECK(lines(with_latency(0.0), program) == 4);  // belongs to a point
  auto slower = program;
  slower.moves[3].duration *= 1.1;
  CHECK(lines(machine, slower) == 4);
  auto bent = program;
  bent.moves[2].tool.translation() += Vec3(0.001, 0.001, 0.001);
  CHECK(lines(machine, bent) == 4);
  auto turned = program;
  turned.moves[2].tool.linear() = rotation_exp(Vec3(1e-6, 1e-6, 0)) * turned.moves[2].tool.linear();
  CHECK(lines(machine, turned) == 4);
  auto waits = program;
  waits.actions.push_back(action(MachineAction::Kind::dwell, 3));
  CHECK(lines(machine, waits) == 4);
  auto rapid = program;
  rapid.moves[3].rapid = true;
  CHECK(lines(machine, rapid) == 4);
  auto many = program;
  while (many.actions.size() < 9) many.actions.push_back(many.actions[0]);
  CHECK(lines(machine, many) == 4);
}

TEST_CASE("krl: every prefix and mutation ends in a value or diagnostics", "[machines][dialects]") {
  std::mt19937 rng(32);
  const auto machine = robot();
  auto text = emitted_text(machine, rounding_program(machine, rng, 6));
  while (text.find("SPL {") == std::string::npos || text.find("C_DIS") == std::string::npos)
    text = emitted_text(machine, rounding_program(machine, rng, 6));
  std::size_t refused = 0;
  for (std::size_t n = 0; n < text.size(); n += 7)
    refused += krl::read_back(machine, text.substr(0, n), "p").ok() ? 0 : 1;
  CHECK(refused > text.size() / 8);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int i = 0; i < 1000; ++i) {
    std::string changed = text;
    changed[std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(rng)] =
        static_cast<char>(byte(rng));
    const auto back = krl::read_back(machine, changed, "p");
    CHECK((back.ok() || has_error(back.diagnostics())));
  }
}
