#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::krl {

/// Prints one .src file for KUKA KSS 8: PTP to joints for interpolation joints, LIN in $BASE for
/// interpolation tool. $BASE is program.part, $TOOL is tool_frame(). Events on the fly are TRIGGERs
/// at the start point of the motion behind them, unless the robot stands there anyway.
/// $VEL.CP is the length over the planned time; a move that only turns sets $VEL.ORI1 and ORI2.
/// Errors: PR201 (event without words), PR202 (an axis is not named A1..A6, E1..E6), PR203 (tool
/// moves on a machine whose part moves).   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads a .src file through formats/robot, without knowledge of what emit() was given. PTP moves
/// come back as rapids: their time is not in the text. `part` and `tool_frame` are what the text
/// sets; $TOOL must be this machine's for some tool length. Errors: NC320 to NC324.
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

}  // namespace smoothpost::krl
