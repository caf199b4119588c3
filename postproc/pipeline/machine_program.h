#pragma once

#include <string>
#include <vector>

#include "kernels/core/result.h"
#include "machines/dialects/dialect.h"
#include "postproc/pipeline/interpret.h"
#include "postproc/pipeline/joint_plan.h"

namespace smoothpost {

/// The share of an assumed velocity limit that block times use.
inline constexpr double kAssumedShare = 0.9;

/// Puts joint samples, events and the machine's start, relocation and end motions into one program.
///  - Start: retract axis alone; rotaries; the other linears; the retract axis down to a point on
///  the tool
///    axis above the first path point; along the tool axis to it.
///  - Replanned segments: away along the tool axis, then as the start.
///  - End: away along the tool axis, retract axis, rotaries home, linears home.
///  - Block times: the programmed feed, stretched until no joint exceeds its velocity limit times
///    tolerance.limit_share (times kAssumedShare where the limit is assumed) and no block is
///    shorter than cycle.min_block.
/// `chain` is the output machine's with tool length 0 and the part placed in it.
MachineProgram build_program(const InterpretedInput& input, const MachineDefinition& machine,
                             const ScrewChain& chain, const std::vector<JointSample>& samples);

}  // namespace smoothpost
