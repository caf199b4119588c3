#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::urscript {

/// Prints one program for URScript (Universal Robots CB3 and e-Series), in m, rad and s: movej to
/// joints for interpolation joints, movel or movep in the part's frame (pose_trans) for
/// interpolation tool. The program sets its tool (set_tcp) and names the part's frame. Planned
/// times are t=; corners with a blend are movep with v= and r=. Other statements are run when the
/// robot stands.
/// Errors: PR201, PR202 (axes are not A1 to A6), PR203 (see RobotPrinter, an external axis).
/// Warning PR222: an event on the fly for which the robot stops.   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a program, statement by statement, without knowledge of what emit() was given. Moves
/// without t= come back as rapids, movep by its speed. Errors: NC346 (text), NC347 (meaning), NC348
/// (frames).
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

/// urscript_servoj: joint moves with a time as a stream of servoj, one target a move, which the
/// control follows through a filter (lookahead_time, gain). In front of everything else the program
/// holds the last target (sp_hold). Other moves are movej. Errors: PR203, a tool move.
extern const Dialect kServoDialect;

}  // namespace smoothpost::urscript
