#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::rapid {

/// Prints one module for ABB RobotWare 6 and 7: MoveAbsJ to joints for interpolation joints, MoveL
/// in the wobjdata (program.part) with the tooldata (tool_frame(), [tool.load]) for interpolation
/// tool. Speed data are length over planned time, never faster by more than 2e-5. Events on the fly
/// whose text is SetDO, SetGO or SetAO with a name and a number are set by TriggL at the start
/// point of the motion behind them; other events are statements, in front of which the robot stops.
/// A move with a blend has zone data of blend_radius() of it, unless a statement or a move in
/// joints follows, or one of its two moves has no length: then it ends in fine. `spline` is not
/// looked at.
/// Errors: PR201 (event without words), PR202 (axes are not A1 to A6 and E1 to E6), PR203 (path
/// mode spline, tool moves on a machine whose part moves, a joint move before every axis has a
/// position), PR221 (no [tool.load]). Warnings: PR222 (an event on the fly stops the robot), PR223
/// (more lines than a module should have).   Cost: linear, names n log n.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads a module through formats/robot, without knowledge of what emit() was given. Joint moves
/// without a time of their own (\T) come back as rapids. `part` and `tool_frame` are what the data
/// of the text say; the tool must be this machine's for some tool length. Errors: NC330 to NC334.
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

}  // namespace smoothpost::rapid
