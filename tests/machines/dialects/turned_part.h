#pragma once

#include "tests/machines/dialects/random_programs.h"

// What dialects whose work offsets do not rotate make of a turned part.
namespace smoothpost::test {

/// A part that is turned about every axis comes back in a frame along the machine's axes at its
/// zero: there its poses are those that were planned, to two units of the last digit.
inline void require_turned_part(const Dialect& dialect, const MachineDefinition& machine,
                                std::mt19937& rng) {
  const double digit = std::pow(10.0, -machine.dialect.digits_length);
  const Vec3 axis = machine.tool.axis;
  std::size_t tools = 0;
  for (int round = 0; round < 20; ++round) {
    MachineProgram program = random_tool_program(machine, rng, 10);
    const Mat3 old = program.part.linear();
    program.part.linear() = random_rotation(rng);
    for (auto& move : program.moves) {  // the same places in the machine
      Pose back = Pose::Identity();
      back.linear() = program.part.linear().transpose() * old;
      move.tool = back * move.tool;
      if (move.duration > 0.0) move.duration += 2.0;  // a feed that a control can be told
    }
    const auto back = read_back(dialect, machine, emitted(dialect, machine, program).text);
    REQUIRE(back.part);
    REQUIRE(back.part->linear().isIdentity(1e-12));
    REQUIRE((back.part->translation() - program.part.translation()).norm() < 2.0 * digit);
    const Pose into = program.part.inverse() * *back.part;
    for (std::size_t i = 0; i < program.moves.size(); ++i) {
      const auto& planned = program.moves[i];
      if (planned.interpolation != MoveInterpolation::tool) continue;
      const Pose got = into * back.moves[i].tool;
      REQUIRE((got.translation() - planned.tool.translation()).norm() < 3.0 * digit);
      REQUIRE(angle_between(got.linear() * axis, planned.tool.linear() * axis) <=
              radians_from_degrees(1.1e-4));
      ++tools;
    }
  }
  CHECK(tools > 60);
}

}  // namespace smoothpost::test
