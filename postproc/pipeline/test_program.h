#pragma once

#include "kernels/core/check.h"
#include "kernels/core/result.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/dialect.h"

// A slow program that proves a machine file on the machine itself, before the first cut.
namespace smoothpost {

struct TestProgram {
  MachineProgram program;
  std::vector<bool> tip_held;  ///< per move: the tip stays on its point during it
  double tool_length = 0.0;    ///< mm
};

/// - Home, the retract axis first.
/// - Each axis alone, a little out and back, with a comment that says which side of the machine
/// moves
///   and which way: what a wrong sign or a swapped word would do otherwise.
/// - The tip held on one point of the part while each rotary (arms: each direction of rotation)
///   swings: what a wrong pivot, origin or tool length would show. Read an indicator at the tip.
/// No rapid, no process word, at most 5 mm/s and 5 deg/s. The tip leaves its point by no more than
/// half the tip tolerance (straight joint steps).
/// Failure KN130: no place inside the limits where any rotary can swing.
Result<TestProgram> make_test_program(const MachineDefinition& machine, double tool_length);

/// The text read back: positions inside limits, slow, beam off, and `tip_held` (mm): the largest
/// distance of the tip from its point, with the bound between samples.
Checks check_test_program(const ReadBack& read, const MachineDefinition& machine,
                          const TestProgram& test);

}  // namespace smoothpost
