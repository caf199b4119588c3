#pragma once

#include <optional>
#include <string>
#include <vector>

#include "machines/dialects/dialect.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/joint_plan.h"
#include "postproc/pipeline/links.h"

namespace smoothpost {

/// The share of an assumed velocity limit that block times use.
inline constexpr double kAssumedShare = 0.9;

struct ProgramInput {
  const ReferencePath& reference;  ///< of the path with its links marked (find_cuts)
  const std::vector<Cut>& cuts;
  const MachineDefinition& machine;
  const ScrewChain& chain;  ///< of the machine, tool length 0, part placed
  std::optional<PartBox> part;
  ToolTurn turn = ToolTurn::none;    ///< not none: the path is made of tool moves
  const Inverse* inverse = nullptr;  ///< of the chain; needed for tool moves
};

struct BuiltProgram {
  MachineProgram program;
  std::vector<std::uint32_t> cramped;  ///< input lines of cuts at links without room to retreat
};

/// Puts joint samples, events and links into one program.
///  - Each stretch of the path without a replanned segment is one run: away from the last one, a
///    label, an approach of its own, its events, its moves. The label stands where the machine has
///    left the part; what stands behind it states every axis and every state (spindle, coolant,
///    power ...) that the run needs, so that a program can be started there. The tool that has to
///    be in the holder stands in the label; it is not changed anew at every cut.
///  - Events inside a link happen at its retracted place, a tool change also when the input has it
///    at the end of a cut.
///  - Block times: the programmed feed, stretched until no joint exceeds its velocity limit times
///    tolerance.limit_share (times kAssumedShare where the limit is assumed) and no block is
///    shorter than cycle.min_block.
///  - Events on the fly with a latency stand that much earlier on the run, at its planned speed, as
///    far as the run and the last stop before them allow.
BuiltProgram build_program(const ProgramInput& input, const std::vector<JointSample>& samples);

}  // namespace smoothpost
