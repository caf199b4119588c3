#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::heidenhain {

/// Prints a conversational program (.h) for HEIDENHAIN iTNC 530, TNC 640 and TNC 7: L with M91 and
/// machine axes for interpolation joints; FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR for
/// interpolation tool. What machine.dialect.name is decides between L with positions of the rotary
/// axes (heidenhain) and LN with the vector of the tool axis (heidenhain_vectors). Blocks are
/// numbered from 0 without gaps, whatever dialect.line_numbers says. When the machine file asks for
/// it, a guard of a program with tool moves leads to a stop without end unless preset and tool are
/// program.part and program.tool_length; without tool moves every block is in M91.
/// Errors: PR201, PR203 (path mode, axis letter, digits above 4, a part that is turned, a feed that
/// is too fast, a redundant axis in a tool move).   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads such a program without knowledge of what emit() was given. `part` is the place that the
/// guard demands. The rotation of `tool` about the tool axis is not in the text.
/// Errors: NC343 (text), NC344 (meaning), NC345 (guard).
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;
extern const Dialect kVectorDialect;

}  // namespace smoothpost::heidenhain
