#pragma once

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/dialect.h"
#include "tests/support/machines.h"

// Random programs for a dialect's round trip, and what the dialects' tests ask alike.
namespace smoothpost::test {

inline JointVector random_joints(const MachineDefinition& machine, std::mt19937& rng) {
  JointVector q(machine.size());
  for (int j = 0; j < machine.size(); ++j) {
    const auto& joint = machine.axes[static_cast<std::size_t>(j)].joint;
    q[j] = std::uniform_real_distribution<double>(joint.lower, joint.upper)(rng);
  }
  return q;
}

inline Mat3 random_rotation(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(rng), normal(rng), normal(rng), normal(rng));
  return q.normalized().toRotationMatrix();
}

/// Moves from 10 ms to 30 s; the first is a rapid of every joint.
inline MachineProgram random_joint_program(const MachineDefinition& machine, std::mt19937& rng,
                                           int moves) {
  MachineProgram program;
  program.title = {"a title (with parentheses); a semicolon \"and a quote\" 100%"};
  std::bernoulli_distribution rapid(0.2);
  std::uniform_real_distribution<double> seconds(0.010, 30.0);
  for (int i = 0; i < moves; ++i) {
    MachineMove move;
    move.to = random_joints(machine, rng);
    move.joints = (1U << machine.size()) - 1U;
    move.rapid = i == 0 || rapid(rng);
    move.duration = move.rapid ? 0.0 : seconds(rng);
    move.input_line = static_cast<std::uint32_t>(i + 1);
    program.moves.push_back(std::move(move));
  }
  return program;
}

inline MachineAction event(const char* name, std::size_t before,
                           std::vector<std::pair<std::string, std::string>> values = {}) {
  MachineAction action;
  action.before = before;
  action.event.name = name;
  action.event.parameters = std::move(values);
  action.input_line = 7;
  return action;
}

inline MachineAction action(MachineAction::Kind kind, std::size_t before, std::string text = "",
                            double seconds = 0.0) {
  MachineAction out;
  out.kind = kind;
  out.before = before;
  out.text = std::move(text);
  out.seconds = seconds;
  out.input_line = 7;
  return out;
}

inline EmittedProgram emitted(const Dialect& dialect, const MachineDefinition& machine,
                              const MachineProgram& program) {
  const auto out = dialect.emit(machine, program);
  for (const auto& d : out.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(out.ok());
  return out.value();
}

inline ReadBack read_back(const Dialect& dialect, const MachineDefinition& machine,
                          const std::string& text) {
  const auto back = dialect.read_back(machine, text, "out");
  for (const auto& d : back.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(back.ok());
  return back.value();
}

inline bool is_rotary(const MachineDefinition& machine, int j) {
  return machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
}

/// Half of the last printed digit of joint j, in mm or rad.
inline double half_digit(const MachineDefinition& machine, int j) {
  const bool rotary = is_rotary(machine, j);
  const int digits = rotary ? machine.dialect.digits_angle : machine.dialect.digits_length;
  const double unit = rotary                            ? kRadiansPerDegree
                      : machine.dialect.units == "inch" ? kMillimetresPerInch
                                                        : 1.0;
  return 0.5 * std::pow(10.0, -digits) * unit * (1 + 1e-6) + 1e-12;
}

/// Every joint that the move names is read back, to half a printed digit.
inline void require_same_joints(const MachineDefinition& machine, const MachineMove& planned,
                                const ReadBackMove& found) {
  REQUIRE(found.interpolation == MoveInterpolation::joints);
  REQUIRE((found.known & planned.joints) == planned.joints);
  for (int j = 0; j < machine.size(); ++j)
    if (planned.joints >> j & 1U)
      REQUIRE(std::abs(found.to[j] - planned.to[j]) <= half_digit(machine, j));
}

/// Poses that a machine with two rotary axes reaches: the tip's frame at random joints, some of
/// them where the move before stands or with its axis. Straight part, one tool.
inline MachineProgram random_tool_program(const MachineDefinition& machine, std::mt19937& rng,
                                          int moves) {
  MachineProgram program = random_joint_program(machine, rng, moves);
  program.part.translation() = Vec3(120.5, -20.25, 60.125);
  program.tool_length = 87.5;
  ScrewChain chain = chain_of(machine, program.tool_length);
  chain.workpiece_home = program.part;
  std::bernoulli_distribution tool(0.7), same(0.2);
  for (std::size_t i = 0; i < program.moves.size(); ++i) {
    auto& move = program.moves[i];
    move.tool_length = program.tool_length;
    if (i == 0 || !tool(rng)) continue;
    if (same(rng)) move.to = program.moves[i - 1].to;
    if (same(rng))
      for (int j = 0; j < machine.size(); ++j)
        if (is_rotary(machine, j)) move.to[j] = program.moves[i - 1].to[j];
    move.interpolation = MoveInterpolation::tool;
    move.joints = 0;
    move.tool = forward(chain, move.to);
  }
  return program;
}

/// The round trip of such a program: joints to half a digit, tip to half a digit, axis to 1e-4 deg.
inline ReadBack require_same_tool_program(const Dialect& dialect, const MachineDefinition& machine,
                                          const MachineProgram& program) {
  const auto out = emitted(dialect, machine, program);
  const auto back = read_back(dialect, machine, out.text);
  REQUIRE(back.moves.size() == program.moves.size());
  REQUIRE(back.offset_guard);
  REQUIRE(back.exact_path);
  REQUIRE(back.line_count == out.line_count);
  const double unit = machine.dialect.units == "inch" ? kMillimetresPerInch : 1.0;
  const double half_length = 0.5 * unit * std::pow(10.0, -machine.dialect.digits_length);
  const Vec3 axis = machine.tool.axis;
  for (std::size_t i = 0; i < program.moves.size(); ++i) {
    const auto& planned = program.moves[i];
    const auto& found = back.moves[i];
    REQUIRE(found.line == out.move_lines[i]);
    REQUIRE(found.rapid == planned.rapid);
    if (planned.interpolation == MoveInterpolation::joints) {
      require_same_joints(machine, planned, found);
      continue;
    }
    REQUIRE(found.interpolation == MoveInterpolation::tool);
    REQUIRE(found.known == 0);
    REQUIRE((found.tool.translation() - planned.tool.translation()).cwiseAbs().maxCoeff() <=
            half_length * (1 + 1e-6) + 1e-12);
    const double turned = machine.dialect.digits_angle > 4 ? 1e-4 : 1.1e-4;
    REQUIRE(angle_between(found.tool.linear() * axis, planned.tool.linear() * axis) <=
            radians_from_degrees(turned));
  }
  return back;
}

/// A rapid of the joints, then tool moves: along a way, and turning about B on the spot.
inline MachineProgram short_tool_program(const MachineDefinition& machine) {
  MachineProgram program;
  program.part.translation() = Vec3(10, 20, 30);
  program.tool_length = 50;
  ScrewChain chain = chain_of(machine, 50);
  chain.workpiece_home = program.part;
  MachineMove move;
  move.to = home_of(machine);
  move.joints = (1U << machine.size()) - 1U;
  move.rapid = true;
  move.tool_length = 50;
  program.moves = {move};
  for (const double x : {1.0, 3.0, 3.0}) {
    move.rapid = false;
    move.interpolation = MoveInterpolation::tool;
    move.joints = 0;
    if (program.moves.size() == 3) move.to[machine.axis_by_letter('B')] = 0.1;
    move.tool = forward(chain, move.to);
    move.tool.translation() = Vec3(x, 2, 3);
    move.duration = 0.5;
    program.moves.push_back(move);
  }
  return program;
}

/// No emission with `from` replaced by `to` is read. Returns how many were tried.
inline std::size_t require_refused(
    const Dialect& dialect, const MachineDefinition& machine, const std::string& good,
    const std::vector<std::pair<std::string, std::string>>& changes) {
  read_back(dialect, machine, good);
  for (const auto& [from, to] : changes) {
    INFO(from << " -> " << to);
    std::string changed = good;
    const auto at = changed.find(from);
    REQUIRE(at != std::string::npos);
    changed.replace(at, from.size(), to);
    const auto back = dialect.read_back(machine, changed, "out");
    CHECK_FALSE(back.ok());
    if (back.ok()) continue;
    for (const auto& d : back.diagnostics()) CHECK(d.where.line > 0);
  }
  return changes.size();
}

/// Prefixes and mutations of a program end in a value or in diagnostics.
inline void require_bounded(const Dialect& dialect, const MachineDefinition& machine,
                            const std::string& text, std::mt19937& rng) {
  std::size_t refused = 0, tried = 0;
  for (std::size_t n = 0; n < text.size(); n += 1 + text.size() / 300, ++tried)
    refused += dialect.read_back(machine, text.substr(0, n), "p").ok() ? 0 : 1;
  CHECK(tried > 50);
  CHECK(refused > 0);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int i = 0; i < 500; ++i) {
    std::string changed = text;
    changed[std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(rng)] =
        static_cast<char>(byte(rng));
    const auto back = dialect.read_back(machine, changed, "p");
    CHECK((back.ok() || has_error(back.diagnostics())));
  }
}

/// An event without a row is refused with its line, all of them in one run; a program that is not
/// certified says so in its first lines; the same program gives the same bytes.
inline void require_common_rules(const Dialect& dialect, const MachineDefinition& machine,
                                 MachineProgram program) {
  CHECK(emitted(dialect, machine, program).text == emitted(dialect, machine, program).text);
  program.certified = false;
  const std::string text = emitted(dialect, machine, program).text;
  const auto at = text.find("NOT CERTIFIED");
  REQUIRE(at != std::string::npos);
  CHECK(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') < 24);
  program.actions = {event("no_such_event", 1), event("nor_this", 2)};
  const auto refused = dialect.emit(machine, program);
  REQUIRE_FALSE(refused.ok());
  REQUIRE(refused.diagnostics().size() == 2);
  for (const auto& d : refused.diagnostics()) {
    CHECK(d.code == "PR201");
    CHECK(d.where.line == 7);
  }
}

}  // namespace smoothpost::test
