#pragma once

#include <array>

#include "machines/dialects/dialect.h"

namespace smoothpost::grbl {

/// Prints joint words for the firmware that machine.dialect.name says: grbl (grblHAL),
/// grbl_fluidnc, grbl_marlin, grbl_reprapfirmware, grbl_klipper. All of them go straight in all
/// axes from block to block; they differ in what F means and in which codes they know. Where the
/// firmware has G53, every motion is in machine coordinates; the others have no guard.
/// Errors: PR201, PR203 (tool moves, inch, path mode, axis letter, an offset guard that the
/// firmware cannot have).   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a program through gcode_text.h as that firmware would, without knowledge of what
/// emit() was given. Errors: NC340, NC341.
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

/// Sorted by name.
extern const std::array<Dialect, 5> kDialects;

}  // namespace smoothpost::grbl
