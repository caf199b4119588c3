#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::beckhoff {

/// Prints joint words for TwinCAT CNC (ISG kernel): #HSC OFF, #TRAFO OFF, no zero offset (G53) and
/// no tool (D0), exact stop in every block (G360), feeds in G93, where F is the block's time in
/// seconds.
/// Errors: PR201, PR203 (tool moves, path mode, axis letter).   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a program through gcode_text.h, without knowledge of what emit() was given.
/// Errors: NC340, NC341.
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

}  // namespace smoothpost::beckhoff
