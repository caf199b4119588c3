#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::fanuc_ls {

/// Prints one TP program in text (.LS) for FANUC R-30iA and later: J to joints for interpolation
/// joints, L to X Y Z W P R with CONFIG in user frame 9 with tool frame 9 for interpolation tool.
/// The program sets both frames through position registers 91 and 92. Moves end in FINE; a corner
/// with a blend of 1 mm or more in CR. An event on the fly at such a corner becomes the TB of the
/// move in front of it. J3 is A3 - A2 of the machine file.
/// Errors: PR201, PR202, PR203 (see RobotPrinter). Warnings: PR222 (an event on the fly stops the
/// robot), PR223 (more lines than a program can have).   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a program without knowledge of what emit() was given. Moves by percent or by register
/// 91 come back as rapids. Errors: NC346 (text), NC347 (meaning), NC348 (frames).
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

}  // namespace smoothpost::fanuc_ls
