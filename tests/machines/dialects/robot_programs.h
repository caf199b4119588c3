#pragma once

#include "tests/machines/dialects/random_programs.h"

// Random programs of an arm, and their round trip.
namespace smoothpost::test {

/// Joint moves and straight moves; `seconds` long at least. Blends at some corners.
inline MachineProgram random_arm_program(const MachineDefinition& machine, std::mt19937& rng,
                                         int moves, double least_seconds = 0.05) {
  MachineProgram program = random_joint_program(machine, rng, moves);
  program.part.translation() = Vec3(1400.25, -20.5, 600.125);
  program.part.linear() = rotation_from_rpy(0.1, -0.2, 2.5);
  program.tool_length = 87.5;
  std::bernoulli_distribution tool(0.7), same(0.15), blend(0.4);
  std::uniform_real_distribution<double> place(-200.0, 200.0), radius(0.5, 20.0);
  for (std::size_t i = 0; i < program.moves.size(); ++i) {
    auto& move = program.moves[i];
    move.tool_length = program.tool_length;
    if (!move.rapid) move.duration = std::max(move.duration, least_seconds);
    if (i == 0 || !tool(rng)) continue;
    const auto& last = program.moves[i - 1];
    move.interpolation = MoveInterpolation::tool;
    move.joints = 0;
    move.tool.translation() = Vec3(place(rng), place(rng), place(rng));
    move.tool.linear() = random_rotation(rng);
    const bool after_tool = last.interpolation == MoveInterpolation::tool;
    if (after_tool && same(rng)) move.tool.linear() = last.tool.linear();
    if (after_tool && same(rng)) move.tool.translation() = last.tool.translation();
    if (!move.rapid && blend(rng)) move.blend = radius(rng);
  }
  return program;
}

/// How exact the times of a dialect are: |read - planned| ≤ share · planned + seconds.
struct TimeError {
  double share = 1e-5;
  double seconds = 1e-6;
  /// False: joint moves have a time only where their start is known, tool moves only where they go
  /// anywhere.
  bool always = true;
};

/// Joints to half a digit (rounding of the text's own unit included), tip to two units of the last
/// digit, rotation to 1e-4 deg; blends never larger than planned. Returns how many were rounded.
inline std::size_t require_same_arm_program(const Dialect& dialect,
                                            const MachineDefinition& machine,
                                            const MachineProgram& program, TimeError time) {
  const auto out = emitted(dialect, machine, program);
  const auto back = read_back(dialect, machine, out.text);
  REQUIRE(back.moves.size() == program.moves.size());
  REQUIRE(back.offset_guard);
  REQUIRE(back.exact_path);
  REQUIRE(back.line_count == out.line_count);
  REQUIRE(back.part);
  REQUIRE((back.part->translation() - program.part.translation()).norm() < 2e-4);
  REQUIRE(rotation_log(back.part->linear().transpose() * program.part.linear()).norm() < 2e-7);
  const double digit = std::pow(10.0, -machine.dialect.digits_length);
  std::size_t rounded = 0;
  for (std::size_t i = 0; i < program.moves.size(); ++i) {
    const auto& planned = program.moves[i];
    const auto& found = back.moves[i];
    REQUIRE(found.line == out.move_lines[i]);
    REQUIRE(found.blend <= planned.blend * (1 + 1e-9));
    rounded += found.blend > 0.0 ? 1 : 0;
    const bool tool = planned.interpolation == MoveInterpolation::tool;
    const bool goes = tool && !planned.tool.isApprox(program.moves[i - 1].tool, 1e-9);
    if (!planned.rapid && (time.always || goes))
      REQUIRE(std::abs(found.duration - planned.duration) <=
              time.share * planned.duration + time.seconds);
    if (!tool) {
      require_same_joints(machine, planned, found);
      continue;
    }
    REQUIRE(found.rapid == planned.rapid);
    REQUIRE(found.interpolation == MoveInterpolation::tool);
    REQUIRE((found.tool.translation() - planned.tool.translation()).norm() <= 2.0 * digit);
    REQUIRE(rotation_log(found.tool.linear().transpose() * planned.tool.linear()).norm() <=
            radians_from_degrees(1e-4));
  }
  return rounded;
}

/// Joint moves of a program of joint moves only take what is planned, or what 99.99 % of the axes'
/// speeds take: never less, and no more than a share `share` longer. Returns how many were timed.
inline std::size_t require_joint_times(const Dialect& dialect, const MachineDefinition& machine,
                                       const MachineProgram& program, double share) {
  const auto back = read_back(dialect, machine, emitted(dialect, machine, program).text);
  REQUIRE(back.moves.size() == program.moves.size());
  std::size_t timed = 0;
  for (std::size_t i = 1; i < program.moves.size(); ++i) {
    const auto& planned = program.moves[i];
    REQUIRE(back.moves[i].rapid == planned.rapid);
    if (planned.rapid) continue;
    double least = 0.0;
    for (int j = 0; j < machine.size(); ++j)
      least = std::max(least, std::abs(planned.to[j] - program.moves[i - 1].to[j]) /
                                  machine.axes[static_cast<std::size_t>(j)].velocity);
    const double expected = std::max(planned.duration, least / 0.9999);
    REQUIRE(back.moves[i].duration >= expected * (1 - 1e-4));
    REQUIRE(back.moves[i].duration <= expected * (1 + share));
    ++timed;
  }
  return timed;
}

/// Two straight moves with a corner of 5 mm between them, and a joint move in front.
inline MachineProgram short_arm_program(const MachineDefinition& machine) {
  MachineProgram program;
  program.part.translation() = Vec3(1400, 0, 600);
  program.tool_length = 100;
  MachineMove move;
  move.to = home_of(machine);
  move.joints = (1U << machine.size()) - 1U;
  move.rapid = true;
  move.tool_length = 100;
  program.moves = {move};
  for (const Vec3& tip : {Vec3(0, 0, 0), Vec3(100, 0, 0), Vec3(100, 50, 0)}) {
    move.interpolation = MoveInterpolation::tool;
    move.joints = 0;
    move.rapid = program.moves.size() == 1;
    move.duration = move.rapid ? 0.0 : 2.0;
    move.blend = program.moves.size() == 2 ? 5.0 : 0.0;
    move.tool.translation() = tip;
    program.moves.push_back(move);
  }
  return program;
}

}  // namespace smoothpost::test
