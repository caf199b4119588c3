#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::fanuc_30i {

/// Prints a program for FANUC 30i, 31i and 32i: G53 or G54 and machine axes in G93 for
/// interpolation joints; tool centre point control with tool posture control (P1) for interpolation
/// tool. What machine.dialect.name is decides between positions of the rotary axes (fanuc_30i,
/// G43.4) and the vector of the tool axis (fanuc_30i_vectors, G43.5). Exact stop is G61, AI contour
/// control G05.1. When the machine file asks for it, a guard raises an alarm before the first
/// motion unless the live offsets are program.part and the tool length is program.tool_length.
/// Errors: PR201 (event without words), PR203 (path mode, axis letter, a part that is turned, a
/// redundant axis in a tool move).   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a program through gcode_text.h, without knowledge of what emit() was given. `part` is
/// the place that the guard demands. The rotation of `tool` about the tool axis is not in the text.
/// Errors: NC340, NC341, NC342.
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;
extern const Dialect kVectorDialect;

}  // namespace smoothpost::fanuc_30i
