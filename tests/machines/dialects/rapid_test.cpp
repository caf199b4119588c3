#include "machines/dialects/rapid.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <regex>
#include <sstream>

#include "kernels/core/units.h"
#include "machines/dialects/rapid_text.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

const double kTurnTolerance = radians_from_degrees(1e-4);
using Kind = MachineAction::Kind;

MachineDefinition robot(std::vector<MachineOverride> overrides = {}) {
  overrides.push_back({"dialect.name", "rapid"});
  MachineDefinition machine = shipped_machine("robot_6r", overrides);
  machine.process.events.push_back({"beam_on", "SetDO doLaser,1", true, 0.0, 0.002});
  machine.process.events.push_back({"beam_off", "SetDO doLaser,0", true, 0.0, 0.002});
  machine.process.events.push_back({"pierce", "SetDO doLaser,1", false, 0.3, 0.0});
  machine.process.events.push_back({"power", "SetAO aoPower,{percent};", true, 0.0, 0.0});
  machine.process.events.push_back({"gas_on", "GasOn 1", true, 0.0, 0.0});
  return machine;
}

// The same arm on a track, which is no part of the chain's closed form.
MachineDefinition robot_on_track() {
  MachineDefinition machine = robot();
  AxisDefinition track = machine.axes[0];
  track.name = "E1";
  track.letter = 'X';
  track.joint = ChainJoint{};
  track.joint.kind = JointKind::linear;
  track.joint.side = ChainSide::tool;
  track.joint.direction = Vec3::UnitY();
  track.joint.lower = -1000.0;
  track.joint.upper = 1000.0;
  track.joint.redundant = true;
  machine.axes.insert(machine.axes.begin(), track);
  return machine;
}

Mat3 random_rotation(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(rng), normal(rng), normal(rng), normal(rng))
      .normalized()
      .toRotationMatrix();
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
  move.joints = 0;
  move.interpolation = MoveInterpolation::tool;
  move.tool = from;
  const double kind = unit(rng);
  if (kind > 0.1) move.tool.translation() = Vec3(place(rng), place(rng), place(rng));
  if (kind > 0.1 && kind < 0.3) move.tool.translation() = from.translation() + Vec3(1e-3, 0, 0);
  if (kind < 0.8) move.tool.linear() = random_rotation(rng);
  move.rapid = unit(rng) < 0.1;
  move.duration = move.rapid ? 0.0 : std::uniform_real_distribution<double>(0.012, 20.0)(rng);
  if (unit(rng) < 0.7) move.blend = std::pow(10.0, 3.0 * unit(rng) - 2.5);
  return move;
}

MachineAction action(Kind kind, std::size_t before, std::string text = "") {
  MachineAction a;
  a.kind = kind;
  a.before = before;
  a.input_line = 7;
  (kind == Kind::event ? a.event.name : a.text) = std::move(text);
  a.seconds = 0.25;
  return a;
}

MachineProgram random_program(const MachineDefinition& machine, std::mt19937& rng, int moves) {
  MachineProgram program;
  program.title = {"a title! with \"quotes\"; and more"};
  program.part.translation() = Vec3(1400.5, -20.25, 600.125);
  program.part.linear() = random_rotation(rng);
  program.tool_length = 87.5;
  Pose at = Pose::Identity();
  std::bernoulli_distribution link(0.15);
  for (int i = 0; i < moves; ++i) {
    program.moves.push_back(i == 0 || link(rng) ? joints_move(machine, rng)
                                                : line_move(machine, at, rng));
    if (program.moves.back().interpolation == MoveInterpolation::tool)
      at = program.moves.back().tool;
  }
  return program;
}

// Events at random places, of those that the robot has.
void add_events(MachineProgram& program, std::mt19937& rng) {
  std::uniform_int_distribution<std::size_t> place(0, program.moves.size());
  const std::vector<std::string> names = {"beam_on", "beam_off", "pierce", "power", "stop"};
  std::uniform_int_distribution<std::size_t> which(0, names.size() + 1);
  for (int i = 0; i < 4; ++i) {
    const std::size_t n = which(rng);
    auto a = n < names.size() ? action(Kind::event, place(rng), names[n])
                              : action(n == names.size() ? Kind::dwell : Kind::comment, place(rng));
    if (a.event.name == "power") a.event.parameters = {{"percent", "45.5"}};
    program.actions.push_back(std::move(a));
  }
  std::stable_sort(program.actions.begin(), program.actions.end(),
                   [](const auto& a, const auto& b) { return a.before < b.before; });
}

ReadBack read(const MachineDefinition& machine, const std::string& text) {
  const auto back = rapid::read_back(machine, text, "out.mod");
  for (const auto& d : back.diagnostics()) UNSCOPED_INFO(to_string(d));
  INFO(text);
  REQUIRE(back.ok());
  return back.value();
}

EmittedProgram emitted(const MachineDefinition& machine, const MachineProgram& program) {
  auto out = rapid::emit(machine, program);
  for (const auto& d : out.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(out.ok());
  return out.value();
}

std::string emitted_text(const MachineDefinition& machine, const MachineProgram& program) {
  return emitted(machine, program).text;
}

double turn_between(const Mat3& a, const Mat3& b) { return rotation_log(a.transpose() * b).norm(); }

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

bool is_tool(const MachineMove& move) { return move.interpolation == MoveInterpolation::tool; }

// Whether a corner may be rounded at the end of move i: its two ways are straight and have a
// length, and nothing but events on the fly happens there.
bool may_blend(const MachineProgram& program, std::size_t i) {
  const auto& moves = program.moves;
  if (i == 0 || i + 1 >= moves.size()) return false;
  if (!is_tool(moves[i]) || !is_tool(moves[i + 1])) return false;
  for (const std::size_t k : {i, i + 1})
    if (is_tool(moves[k - 1]) &&
        (moves[k].tool.translation() - moves[k - 1].tool.translation()).norm() < 1e-4)
      return false;
  for (const auto& a : program.actions) {
    const bool flies =
        a.kind == Kind::event &&
        (a.event.name == "beam_on" || a.event.name == "beam_off" || a.event.name == "power");
    if (a.before == i + 1 && a.kind != Kind::comment && !flies) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("rapid: read_back(emit(x)) is x to the printed digits", "[machines][dialects]") {
  std::mt19937 rng(51);
  const auto machine = robot();
  const double half_digit = 0.5 * std::pow(10.0, -machine.dialect.digits_length) * (1 + 1e-6);
  const double half_angle =
      radians_from_degrees(0.5 * std::pow(10.0, -machine.dialect.digits_angle)) * (1 + 1e-6);
  double worst = 0.0;
  int zones = 0;
  for (int round = 0; round < 500; ++round) {
    auto program = random_program(machine, rng, 10);
    add_events(program, rng);
    const auto out = emitted(machine, program);
    const auto back = read(machine, out.text);
    REQUIRE(back.moves.size() == program.moves.size());
    REQUIRE(back.offset_guard);
    REQUIRE(back.exact_path);
    REQUIRE(back.line_count == out.line_count);
    for (std::size_t i = 0; i < program.moves.size(); ++i) {
      const auto& planned = program.moves[i];
      const auto& found = back.moves[i];
      REQUIRE(found.line == out.move_lines[i]);
      REQUIRE(found.interpolation == planned.interpolation);
      REQUIRE(found.rapid == planned.rapid);
      REQUIRE_FALSE(found.spline);
      REQUIRE(found.blend <= planned.blend);
      if (found.blend > 0.0) {
        ++zones;
        REQUIRE(found.blend * 1.6 * (1 + 1e-9) >= planned.blend);
      }
      if (may_blend(program, i)) REQUIRE((found.blend > 0.0) == (planned.blend >= 1e-3));
      if (!is_tool(planned)) {
        REQUIRE(found.known == planned.joints);
        REQUIRE((found.to - planned.to).cwiseAbs().maxCoeff() <= half_angle);
        continue;
      }
      REQUIRE(found.known == 0);
      REQUIRE((found.tool.translation() - planned.tool.translation()).cwiseAbs().maxCoeff() <=
              half_digit);
      worst = std::max(worst, turn_between(found.tool.linear(), planned.tool.linear()));
    }
    // Events: the same, in their order, each before its move.
    std::vector<std::pair<std::string, std::size_t>> expected, got;
    for (const auto& a : program.actions) {
      if (a.kind == Kind::comment) continue;
      expected.emplace_back(a.kind == Kind::dwell ? "dwell" : a.event.name, a.before);
      if (a.event.name == "pierce") expected.emplace_back("dwell", a.before);
    }
    // A beam_on that has to be a statement has the words of pierce.
    for (const auto& e : back.events) got.emplace_back(e.name, e.before);
    REQUIRE(got.size() == expected.size());
    for (std::size_t k = 0; k < got.size(); ++k) {
      REQUIRE(got[k].second == expected[k].second);
      if (got[k].first == "pierce" && expected[k].first == "beam_on") continue;
      REQUIRE(got[k].first == expected[k].first);
    }
  }
  CHECK(worst <= kTurnTolerance);
  CHECK(degrees_from_radians(worst) > 1e-9);  // the comparison is not empty
  CHECK(zones > 300);
}

TEST_CASE("rapid: the speeds give each move its planned time", "[machines][dialects]") {
  std::mt19937 rng(52);
  const auto machine = robot();
  int lines = 0, turning = 0, timed = 0;
  for (int round = 0; round < 300; ++round) {
    auto program = random_program(machine, rng, 12);
    for (std::size_t i = 1; i < program.moves.size(); ++i)
      if (!is_tool(program.moves[i]) && i % 2 == 0) {
        program.moves[i].rapid = false;
        program.moves[i].duration = 0.5 + static_cast<double>(i);
      }
    const auto text = emitted_text(machine, program);
    const auto back = read(machine, text);
    timed += contains(text, "spLink\\T:=") ? 1 : 0;
    for (std::size_t i = 1; i < program.moves.size(); ++i) {
      const auto& planned = program.moves[i];
      if (planned.rapid) continue;
      const double ratio = back.moves[i].duration / planned.duration;
      INFO(text);
      if (!is_tool(planned)) {
        CHECK(ratio == Approx(1.0).epsilon(1e-6));
        continue;
      }
      const Pose& from = back.moves[i - 1].tool;
      const bool after_line = back.moves[i - 1].interpolation == MoveInterpolation::tool;
      const bool stays =
          after_line && (planned.tool.translation() - from.translation()).norm() < 2e-4;
      ++(stays ? turning : lines);
      // Never faster than planned, and four digits of speed.
      CHECK(ratio > 1.0 - 3e-5);
      CHECK(ratio < 1.0 + 1.1e-3);
    }
  }
  CHECK(turning > 50);
  CHECK(lines > 1000);
  CHECK(timed > 10);
}

TEST_CASE("rapid: quaternions have w first and the length 1 and are the rotation",
          "[machines][dialects]") {
  std::mt19937 rng(53);
  std::normal_distribution<double> normal;
  double worst_length = 0.0, worst_turn = 0.0;
  for (int i = 0; i < 20000; ++i) {
    // Also half turns and turns near them, where w is 0.
    const Vec3 axis = Vec3(normal(rng), normal(rng), i % 3 == 0 ? 0.0 : normal(rng)).normalized();
    const double angle = i % 4 == 0 ? kPi : kPi * (1.0 - std::pow(10.0, -(i % 13)));
    const Mat3 rotation =
        Eigen::AngleAxisd(i % 5 == 0 ? 1.7 * normal(rng) : angle, axis).toRotationMatrix();
    const auto q = rapid::printed_quaternion(rotation, 8);
    REQUIRE(q[0] >= 0.0);
    double sum = 0.0;
    for (const double v : q) sum += v * v;
    worst_length = std::max(worst_length, std::abs(std::sqrt(sum) - 1.0));
    // R v = v + 2w (u × v) + 2 u × (u × v), u = (x, y, z)
    const Vec3 u(q[1], q[2], q[3]);
    Mat3 got;
    for (int k = 0; k < 3; ++k) {
      const Vec3 v = Vec3::Unit(k);
      got.col(k) = v + 2.0 * q[0] * u.cross(v) + 2.0 * u.cross(u.cross(v));
    }
    worst_turn = std::max(worst_turn, (got - rotation).cwiseAbs().maxCoeff());
  }
  CHECK(worst_length < 1.5e-8);
  CHECK(worst_turn < radians_from_degrees(1e-5));
  const auto six = rapid::printed_quaternion(random_rotation(rng), 6);
  CHECK(std::abs(std::sqrt(six[0] * six[0] + six[1] * six[1] + six[2] * six[2] + six[3] * six[3]) -
                 1.0) < 2e-6);
}

TEST_CASE("rapid: configuration data from their definition", "[machines][dialects]") {
  std::mt19937 rng(54);
  const auto machine = robot();
  const rapid::ArmConfiguration configuration(machine);
  // Where a point of the arm is with the first joints moved.
  const auto moved = [&machine](int joints, const JointVector& q, const Vec3& point) {
    ScrewChain part;
    for (int j = 0; j < joints; ++j)
      part.joints.push_back(machine.axes[static_cast<std::size_t>(j)].joint);
    part.tool_home = Pose::Identity();
    part.tool_home.translation() = point;
    return Vec3(forward(part, JointVector(q.head(joints))).translation());
  };
  int seen[8] = {};
  for (int i = 0; i < 20000; ++i) {
    const JointVector q = random_joints(machine, rng);
    const auto data = configuration.at(q);
    const int axes[3] = {0, 3, 5};
    for (std::size_t k = 0; k < 3; ++k) {
      const double degrees = degrees_from_radians(q[axes[k]]);
      REQUIRE(data[k] * 90.0 <= degrees + 1e-8);
      REQUIRE(degrees < (data[k] + 1) * 90.0 + 1e-8);
    }
    const auto& axis = machine.axes;
    const Vec3 second = moved(1, q, axis[1].joint.origin),
               third = moved(2, q, axis[2].joint.origin);
    const Vec3 wrist = moved(3, q, axis[4].joint.origin);
    const Vec3 base = axis[0].joint.origin;
    const Vec3 front = moved(1, q, base + Vec3::UnitX()) - base;
    const Vec3 sideways = moved(1, q, base + axis[1].joint.direction) - base;
    // Axis 2 leans the arm forward: from up to front is its positive sense.
    REQUIRE(axis[1].joint.direction.cross(Vec3::UnitZ()).dot(Vec3::UnitX()) > 0.99);
    const bool behind_base = (wrist - base).dot(front) < 0.0;
    const bool behind_arm = (third - second).cross(wrist - third).dot(sideways) < 0.0;
    const int expected = 4 * behind_base + 2 * behind_arm + (q[4] < 0.0 ? 1 : 0);
    REQUIRE(data[3] == expected);
    ++seen[expected];
  }
  for (const int count : seen) CHECK(count > 0);
  JointVector q = JointVector::Zero(6);
  CHECK(configuration.text(q) == "[0,0,0,2]");  // the wrist is above the stretched lower arm
  q << radians_from_degrees(-0.5), 0, 0, radians_from_degrees(90.0), -0.1,
      radians_from_degrees(-350);
  CHECK(configuration.text(q) == "[-1,1,-4,3]");
  q[0] = -1e-15;
  CHECK(configuration.at(q)[0] == 0);
  // A track in front of the arm changes nothing.
  const auto tracked = robot_on_track();
  JointVector longer(7);
  longer << 500.0, q;
  CHECK(rapid::ArmConfiguration(tracked).text(longer) == configuration.text(q));
}

TEST_CASE("rapid: external axes are stated and come back", "[machines][dialects]") {
  std::mt19937 rng(55);
  const auto machine = robot_on_track();
  const auto program = random_program(machine, rng, 30);
  const auto text = emitted_text(machine, program);
  CHECK(contains(text, ",9E9,9E9,9E9,9E9,9E9]"));
  CHECK_FALSE(contains(text, "[9E9"));
  const auto back = read(machine, text);
  for (std::size_t i = 0; i < program.moves.size(); ++i) {
    CHECK(back.moves[i].to[0] == Approx(program.moves[i].to[0]).margin(6e-5));
    CHECK(back.moves[i].known == (is_tool(program.moves[i]) ? 1U : 127U));
  }
  CHECK_FALSE(rapid::read_back(robot(), text, "p").ok());  // that machine has no track
  CHECK_FALSE(
      rapid::read_back(machine, emitted_text(robot(), random_program(robot(), rng, 3)), "p").ok());
}

TEST_CASE("rapid: events on the fly are set by TriggL and others are statements",
          "[machines][dialects]") {
  std::mt19937 rng(56);
  const auto machine = robot();
  MachineProgram program = random_program(machine, rng, 1);
  for (int i = 1; i < 6; ++i) {
    program.moves.push_back(line_move(machine, Pose::Identity(), rng));
    auto& move = program.moves.back();
    move.tool.translation() = Vec3(10.0 * i, 0, 0);
    move.rapid = false;
    move.duration = 1.0;
    move.blend = 0.05;
  }
  auto power = action(Kind::event, 2, "power");
  power.event.parameters = {{"percent", "45"}};
  program.actions = {action(Kind::event, 1, "pierce"),
                     action(Kind::event, 1, "beam_on"),
                     power,
                     action(Kind::event, 2, "beam_off"),
                     action(Kind::event, 3, "beam_off"),
                     action(Kind::dwell, 3),
                     action(Kind::event, 4, "gas_on"),
                     action(Kind::event, 6, "beam_off")};
  const auto out = rapid::emit(machine, program);
  REQUIRE(out.ok());
  const std::string& text = out.value().text;
  INFO(text);
  CHECK(contains(text, "\n    SetDO doLaser,1;\n    WaitTime\\InPos, 0.3;\n    TriggL "));
  // The latency of a row is taken off by the pipeline, not by the controller too.
  CHECK(contains(text, "    TriggIO spT1, 0\\Start\\DOp:=doLaser, 1;\n"));
  CHECK(contains(text, "    TriggIO spT2, 0\\Start\\AOp:=aoPower, 45;\n"));
  CHECK_FALSE(contains(text, "TriggEquip"));
  CHECK(contains(text, ", spT2\\T2:=spT3, fine, spTool"));
  CHECK(contains(text, "  VAR triggdata spT3;\n"));
  // The robot waits behind this one: a trigger would come after the wait.
  CHECK(contains(text, "\n    SetDO doLaser,0;\n    WaitTime\\InPos, 0.25;\n"));
  // Not a signal: the robot stops for it, and that is said.
  CHECK(contains(text, "fine, spTool\\WObj:=spPart;\n    GasOn 1;\n"));
  int warnings = 0;
  for (const auto& d : out.diagnostics()) {
    CHECK(d.severity == Severity::warning);
    if (d.code == "PR222") {
      ++warnings;
      CHECK(d.where.line == 7);
    }
  }
  CHECK(warnings == 2);  // gas_on, and beam_off with no motion behind it
  const auto back = read(machine, text);
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"pierce", 1},   {"dwell", 1}, {"beam_on", 1}, {"power", 2},   {"beam_off", 2},
      {"beam_off", 3}, {"dwell", 3}, {"gas_on", 4},  {"beam_off", 6}};
  REQUIRE(back.events.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(back.events[i].name == expected[i].first);
    CHECK(back.events[i].before == expected[i].second);
  }
  CHECK_FALSE(back.moves[0].beam);
  CHECK(back.moves[1].beam);
  CHECK_FALSE(back.moves[2].beam);
  const std::vector<double> blends = {0.0, 0.04, 0.0, 0.0, 0.04, 0.0};
  for (std::size_t i = 0; i < blends.size(); ++i) CHECK(back.moves[i].blend == blends[i]);
  // Nine at one place: the first is a statement.
  program.actions.assign(9, action(Kind::event, 2, "beam_on"));
  const auto nine = emitted_text(machine, program);
  CHECK(contains(nine, "\\T8:=spT1"));
  CHECK(contains(nine, "    SetDO doLaser,1;\n"));
  CHECK(read(machine, nine).events.size() == 9);
}

TEST_CASE("rapid: an event without words is refused with its line", "[machines][dialects]") {
  std::mt19937 rng(57);
  auto machine = robot();
  auto program = random_program(machine, rng, 2);
  program.actions = {action(Kind::event, 1, "mist_on"), action(Kind::event, 1, "mist_off")};
  const auto refused = rapid::emit(machine, program);
  REQUIRE_FALSE(refused.ok());
  REQUIRE(refused.diagnostics().size() == 2);
  CHECK(refused.diagnostics()[0].code == "PR201");
  CHECK(contains(refused.diagnostics()[0].text, "mist_on"));
  CHECK(refused.diagnostics()[0].where.line == 7);
  machine.process.unmapped = UnmappedWords::comment;
  CHECK(contains(emitted_text(machine, program), "    ! unmapped event: mist_on\n"));
}

TEST_CASE("rapid: a value of the input cannot become a statement", "[machines][dialects]") {
  std::mt19937 rng(58);
  const auto machine = robot();
  auto program = random_program(machine, rng, 2);
  auto message = action(Kind::event, 1, "message");
  auto tool = action(Kind::event, 1, "tool_change");
  for (const char* value : {"x\";\nSetDO doLaser,1; !\xC3\xA4", "a\\", "7!"}) {
    message.event.parameters = {{"text", value}};
    tool.event.parameters = {{"tool", "7"}};
    program.actions = {message, tool, action(Kind::comment, 1, std::string("c\n") + value)};
    const auto text = emitted_text(machine, program);
    CHECK_FALSE(contains(text, "\nSetDO"));
    CHECK_FALSE(contains(text, ";\n    SetDO"));
    const auto back = read(machine, text);
    REQUIRE(back.events.size() == 2);
    CHECK(back.events[0].name == "message");
    CHECK(back.events[1].name == "tool_change");
  }
  tool.event.parameters = {{"tool", "7!"}};
  program.actions = {tool};
  CHECK_FALSE(contains(emitted_text(machine, program), "7!"));
}

TEST_CASE("rapid: frames and load are stated and come back", "[machines][dialects]") {
  std::mt19937 rng(59);
  auto machine = robot();
  const auto program = random_program(machine, rng, 3);
  const auto text = emitted_text(machine, program);
  const auto back = read(machine, text);
  REQUIRE(back.part);
  CHECK((back.part->translation() - program.part.translation()).norm() < 1e-3);
  CHECK(turn_between(back.part->linear(), program.part.linear()) < kTurnTolerance);
  REQUIRE(back.tool_frame);
  // From the definition: in M the tip is tool.tip, a tool length behind it along the axis.
  const Pose tip = machine.tool.flange * *back.tool_frame;
  CHECK((tip.translation() - (machine.tool.tip - 87.5 * machine.tool.axis)).norm() < 1e-3);
  CHECK(turn_between(tip.linear(), Mat3::Identity()) < kTurnTolerance);
  CHECK(contains(text, "],[32,[11,0,100],[1,0,0,0],0.15,0.24,0.13]];\n"));
  machine.tool.load.reset();
  const auto refused = rapid::emit(machine, program);
  REQUIRE_FALSE(refused.ok());
  REQUIRE(refused.diagnostics().size() == 1);
  CHECK(refused.diagnostics()[0].code == "PR221");
  for (const char* key : {"mass_kg", "centre_mm", "inertia_kg_m2"})
    CHECK(contains(refused.diagnostics()[0].text, key));
}

TEST_CASE("rapid: from a label on the program is the same", "[machines][dialects]") {
  std::mt19937 rng(60);
  const auto machine = robot();
  auto program = random_program(machine, rng, 9);
  program.moves[4] = joints_move(machine, rng);
  program.actions = {action(Kind::cut_label, 2, "CUT 7 from input line 12"),
                     action(Kind::cut_label, 4, "CUT 7 goes on after a rewind"),
                     action(Kind::event, 5, "beam_on")};
  const auto text = emitted_text(machine, program);
  INFO(text);
  CHECK(contains(text, "\n    ! CUT 7 from input line 12\n  cut_7:\n    spModes;\n"));
  const std::string label = "  cut_7_2:\n";
  const auto at = text.find(label);
  REQUIRE(at != std::string::npos);
  const std::string begin = "  PROC main()\n";
  const auto head = text.find(begin) + begin.size();
  const auto whole = read(machine, text);
  const auto rest = read(machine, text.substr(0, head) + text.substr(at));
  REQUIRE(rest.moves.size() == 5);
  CHECK(rest.offset_guard);
  for (std::size_t i = 0; i < rest.moves.size(); ++i) {
    const auto &a = rest.moves[i], &b = whole.moves[i + 4];
    CHECK(a.to == b.to);
    CHECK(a.tool.isApprox(b.tool));
    CHECK(a.duration == b.duration);
    CHECK(a.rapid == b.rapid);
    CHECK(a.beam == b.beam);
  }
}

TEST_CASE("rapid: long programs go on in further procedures and are told", "[machines][dialects]") {
  std::mt19937 rng(61);
  const auto machine = robot();
  auto program = random_program(machine, rng, 6000);
  for (std::size_t i = 0; i < 6000; i += 300)
    program.actions.push_back(
        action(Kind::cut_label, i, "CUT " + std::to_string(i / 300 + 1) + " from input line 1"));
  const auto out = rapid::emit(machine, program);
  REQUIRE(out.ok());
  CHECK(std::count_if(out.diagnostics().begin(), out.diagnostics().end(),
                      [](const Diagnostic& d) { return d.code == "PR223"; }) == 1);
  CHECK(contains(out.value().text, "    spPart3;\n  ENDPROC\n  PROC spPart3()\n"));
  const auto back = read(machine, out.value().text);
  REQUIRE(back.moves.size() == 6000);
  for (std::size_t i = 0; i < 6000; ++i) REQUIRE(back.moves[i].line == out.value().move_lines[i]);
}

TEST_CASE("rapid: options", "[machines][dialects]") {
  std::mt19937 rng(62);
  auto program = random_program(robot(), rng, 6);
  const auto refused = rapid::emit(robot({{"dialect.path_mode", "spline"}}), program);
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.diagnostics()[0].code == "PR203");
  const auto text = emitted_text(robot(), program);
  CHECK(text == emitted_text(robot(), program));
  for (auto& move : program.moves) move.spline = true;
  CHECK(text == emitted_text(robot({{"dialect.path_mode", "blend"}}), program));
  CHECK(contains(text, "\\NoEOffs, spFirst, fine,"));
  CHECK(text.find("spFirst, ") == text.rfind("spFirst, "));
  program.certified = false;
  const auto open = emitted_text(robot(), program);
  CHECK(open.find("! NOT CERTIFIED") < open.find("PROC"));
  CHECK(open.find("\n    Stop;\n") < open.find("MoveAbsJ"));
  CHECK(read(robot(), open).moves.size() == 6);
  const auto with_lines = robot({{"dialect.start", "[\"AccSet 50, 50;\", \"Reset doA; ! x\"]"},
                                 {"dialect.end", "[\"Reset doB;\"]"}});
  const auto lines = emitted_text(with_lines, program);
  CHECK(lines.find("    AccSet 50, 50;\n") < lines.find("spModes"));
  CHECK(contains(lines, "    Reset doB;\n  ENDPROC\n"));
  CHECK(read(with_lines, lines).moves.size() == 6);
  CHECK_FALSE(rapid::read_back(robot(), lines, "p").ok());
}

TEST_CASE("rapid: machines that are no arm and unknown starts are refused",
          "[machines][dialects]") {
  std::mt19937 rng(63);
  const auto mill = shipped_machine("table_table_bc");
  const auto refused = rapid::emit(mill, random_program(mill, rng, 2));
  REQUIRE_FALSE(refused.ok());
  CHECK(refused.diagnostics()[0].code == "PR202");
  auto program = random_program(robot(), rng, 2);
  program.moves[0].joints = 3;
  const auto half = rapid::emit(robot(), program);
  REQUIRE_FALSE(half.ok());
  CHECK(half.diagnostics()[0].code == "PR203");
  auto five = robot();
  five.axes.pop_back();
  const auto arm = rapid::emit(five, random_program(five, rng, 1));
  REQUIRE_FALSE(arm.ok());
  CHECK(arm.diagnostics()[0].code == "PR202");
}

namespace {

// One joint move and two lines with a zone between them.
MachineProgram short_program(const MachineDefinition& machine, std::mt19937& rng) {
  MachineProgram program = random_program(machine, rng, 1);
  for (int i = 1; i < 4; ++i) {
    program.moves.push_back(line_move(machine, Pose::Identity(), rng));
    auto& move = program.moves.back();
    move.tool.translation() = Vec3(10 * i, 20, 30);
    move.rapid = false;
    move.duration = 1.0;
    move.blend = i == 2 ? 0.5 : 0.0;
  }
  program.actions = {action(Kind::event, 2, "beam_on")};
  return program;
}

}  // namespace

TEST_CASE("rapid: what could move differently than certified is refused", "[machines][dialects]") {
  std::mt19937 rng(64);
  const auto machine = robot();
  const std::string good = emitted_text(machine, short_program(machine, rng));
  const auto with = [&good](const std::string& from, const std::string& to, std::size_t nth = 0) {
    std::string text = good;
    auto at = text.find(from);
    while (nth-- > 0) at = text.find(from, at + 1);
    INFO(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
  };
  CHECK(read(machine, good).offset_guard);
  const std::vector<std::pair<const char*, std::string>> bad = {
      {"NC333", with("ConfL\\Off", "ConfL\\On")},
      {"NC333", with("ConfJ\\Off;", "")},
      {"NC333", with("SingArea\\Off", "SingArea\\Wrist")},
      {"NC333", with("VelSet 100", "VelSet 50")},
      {"NC333", with("VelSet 100, 5000", "VelSet 100, 5")},
      {"NC333", with("    spModes;", "")},
      {"NC333", with("    spModes;", "    spModes;\n    main;")},
      {"NC333", with("  PROC spModes", "  PROC other() Stop; ENDPROC\n  PROC spModes")},
      {"NC333", with("PROC main", "PROC start")},
      {"NC334", with("[TRUE,[[", "[TRUE,[[9")},        // another tool
      {"NC334", with("[TRUE,[[", "[FALSE,[[")},        // tool stands in the cell
      {"NC334", with("],[32,[", "],[0,[")},            // no mass
      {"NC334", with("[FALSE,TRUE,", "[TRUE,TRUE,")},  // part in the robot's hand
      {"NC334", with("[FALSE,TRUE,\"\"", "[FALSE,TRUE,\"M7\"")},
      {"NC334", with("spTool\\WObj:=spPart", "spTool\\WObj:=wobj0", 1)},
      {"NC334", with("spTool\\WObj:=spPart", "tool0\\WObj:=spPart", 1)},
      {"NC334", with("spTool\\WObj:=spPart", "spTool", 1)},
      {"NC333", with("MoveAbsJ",
                     "MoveL [[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]], "
                     "spLink, fine, spTool\\WObj:=spPart;\n    MoveAbsJ")},
      {"NC333", with("9E9,9E9]], spV", "9E9,0]], spV")},  // an axis that the machine has not
      {"NC333", with("fine, spTool", "z10, spTool", 1)},  // a zone that is not in the text
      {"NC333", with("spV1, ", "v100, ")},
      {"NC333", with("speeddata spV1:=[", "speeddata spV1:=[-")},
      {"NC333", with("zonedata spZ1:=[FALSE,", "zonedata spZ1:=[FALSE,-")},
      {"NC333", with("    TriggL", "    SetDO doGas,1;\n    TriggL")},  // no row
      {"NC333", with("    MoveL", "    Stop;\n    MoveL", 1)},          // in a zone
      {"NC333", with("    MoveL", "    WaitTime 1;\n    MoveL", 1)},
      {"NC333", with("0\\Start", "5\\Start")},
      {"NC333", with("0\\Start", "0\\Time")},
      {"NC333", with("0\\Start", "0")},
      {"NC333", with("TriggIO spT1, 0\\Start\\DOp", "TriggEquip spT1, 0\\Start, 0.1\\DOp")},
      {"NC333", with("DOp:=doLaser", "DOp:=doOther")},
      {"NC333", with("    TriggIO", "    ! TriggIO")},
      {"NC331", with("  VAR triggdata", "  VAR num")},
      {"NC331", with("    MoveL", "    MoveJ")},
      {"NC332", with("],[32,[11", "],[32,[11,0")},
  };
  for (const auto& [code, text] : bad) {
    const auto back = rapid::read_back(machine, text, "p");
    INFO(text);
    REQUIRE_FALSE(back.ok());
    CHECK(back.diagnostics()[0].code == code);
    CHECK(back.diagnostics()[0].where.line > 0);
  }
  // The guard is missed, the motion is the same.
  for (const auto& text : {with("PDispOff;", ""), with("EOffsOff;", ""), with("\\NoEOffs", ""),
                           with("VelSet 100, 5000;", "")})
    CHECK_FALSE(read(machine, text).offset_guard);
  CHECK(read(machine, with("TriggIO spT1, 0\\Start\\DOp", "TriggEquip spT1, 0\\Start, 0\\DOp"))
            .events.size() == 1);
}

TEST_CASE("rapid: the text has the grammar of RAPID", "[machines][dialects]") {
  // Line by line, independent of our reader.
  const std::string n = R"(-?\d+(\.\d{1,9})?)", name = R"([A-Za-z]\w{0,31})";
  const auto list = [](const std::string& item, int count) {
    std::string text = R"(\[)" + item;
    for (int i = 1; i < count; ++i) text += "," + item;
    return text + R"(\])";
  };
  const std::string pose = list(n, 3) + "," + list(n, 4);
  const std::string external = list("(9E9|" + n + ")", 6);
  const std::string end = ", (fine|spZ\\d+), spTool\\\\WObj:=spPart;";
  const std::string speed = "sp(V\\d+|First|Joint|Link)(\\\\T:=" + n + ")?";
  const std::string target =
      R"(\[)" + pose + "," + R"(\[-?\d,-?\d,-?\d,[0-7]\])" + "," + external + R"(\])";
  const std::vector<std::string> forms = {
      "MODULE smoothpost",
      "ENDMODULE",
      "  PROC " + name + R"(\(\))",
      "  ENDPROC",
      " +!.*",
      R"(  PERS tooldata spTool:=\[TRUE,\[)" + pose + R"(\],\[)" + n + "," + pose + "," + n + "," +
          n + "," + n + R"(\]\];)",
      R"(  PERS wobjdata spPart:=\[FALSE,TRUE,"",\[)" + pose + R"(\],\[)" + pose + R"(\]\];)",
      "  CONST speeddata " + name + ":=" + list(n, 4) + ";",
      R"(  CONST zonedata spZ\d+:=\[FALSE)" + std::string() + "(," + n + R"(){6}\];)",
      R"(  VAR triggdata spT\d+;)",
      R"(    (ConfL|ConfJ|SingArea)\\Off;)",
      R"(    (PDispOff|EOffsOff|Stop|spModes|spPart\d+);)",
      "    VelSet 100, " + n + ";",
      R"(    TriggIO spT\d+, 0\\Start\\[DAG]Op:=)" + name + ", " + n + ";",
      R"(    WaitTime\\InPos, )" + n + ";",
      "    Set[DA]O " + name + "," + n + ";",
      "    GasOn 1;",
      R"(  cut_\w+:)",
      R"(    MoveAbsJ \[)" + list(n, 6) + "," + external + R"(\]\\NoEOffs, )" + speed + end,
      "    MoveL " + target + ", " + speed + end,
      "    TriggL " + target + ", " + speed + R"(, spT\d+(\\T[2-8]:=spT\d+)*)" + end,
  };
  std::vector<std::regex> patterns;
  for (const auto& form : forms) patterns.emplace_back(form);
  std::vector<int> used(forms.size(), 0);
  std::mt19937 rng(65);
  const auto machine = robot();
  for (int round = 0; round < 5; ++round) {
    auto program = random_program(machine, rng, 12);
    add_events(program, rng);
    program.actions.push_back(action(Kind::cut_label, 12, "CUT 3"));
    std::istringstream text(emitted_text(machine, program));
    std::string line;
    while (std::getline(text, line)) {
      std::size_t k = 0;
      while (k < patterns.size() && !std::regex_match(line, patterns[k])) ++k;
      INFO(line);
      REQUIRE(k < patterns.size());
      ++used[k];
      CHECK(std::all_of(line.begin(), line.end(), [](char c) { return c >= 0x20 && c < 0x7F; }));
    }
  }
  for (std::size_t k = 0; k < forms.size(); ++k) {
    INFO(forms[k]);
    if (!contains(forms[k], "GasOn")) CHECK(used[k] > 0);
  }
}

TEST_CASE("rapid: every prefix and mutation ends in a value or diagnostics",
          "[machines][dialects]") {
  std::mt19937 rng(66);
  const auto machine = robot();
  const auto text = emitted_text(machine, short_program(machine, rng));
  for (std::size_t n = 0; n + 11 < text.size(); n += 5)
    REQUIRE_FALSE(rapid::read_back(machine, text.substr(0, n), "p").ok());
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_int_distribution<std::size_t> place(0, text.size() - 1);
  for (int i = 0; i < 2000; ++i) {
    std::string changed = text;
    changed[place(rng)] = static_cast<char>(byte(rng));
    if (i % 2 == 0) std::swap(changed[place(rng)], changed[place(rng)]);
    const auto back = rapid::read_back(machine, changed, "p");
    REQUIRE((back.ok() || has_error(back.diagnostics())));
  }
}

TEST_CASE("rapid: radii of zones and printed speeds are not above what is asked for",
          "[machines][dialects]") {
  std::mt19937 rng(67);
  std::uniform_real_distribution<double> exponent(-4.0, 4.0);
  std::vector<double> radii;
  for (int i = 0; i < 20000; ++i) {
    const double x = std::pow(10.0, exponent(rng));
    const double r = rapid::blend_radius(x);
    REQUIRE(r <= x);
    if (x >= 1e-3) REQUIRE(r * 1.6 * (1 + 1e-9) >= x);
    radii.push_back(r);
    const double v = rapid::printed_speed(x);
    REQUIRE(v <= x * (1 + 3e-5));
    REQUIRE(v >= x * (1 - 1.1e-3));
  }
  std::sort(radii.begin(), radii.end());
  radii.erase(std::unique(radii.begin(), radii.end()), radii.end());
  CHECK(radii.size() <= 37);
  for (const double exact : {0.001, 0.0016, 0.01, 0.63, 1.0, 2.5})
    CHECK(rapid::blend_radius(exact) == exact);
  CHECK(rapid::blend_radius(0.0) == 0.0);
  CHECK(rapid::blend_radius(-1.0) == 0.0);
  CHECK(rapid::printed_speed(49.99999) == 50.0);
}
