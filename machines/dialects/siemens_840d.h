#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::siemens_840d {

/// Prints a part program (.mpf) for SINUMERIK 840D sl. Moves of interpolation joints are machine
/// axis words with TRAFOOF: in a program of joints only with G500 and D0 behind a guard that the
/// active frame is zero, else with SUPA D0. Moves of interpolation tool are X Y Z of the tip and
/// A3= B3= C3= of the tool axis under TRAORI, ORIWKS, ORIVECT, G54 and D1. Feeds are G93 with F in
/// every block, exact stop is G60 G601. When the machine file asks for it, a guard stops before the
/// first motion unless the active frame is program.part and D1 has program.tool_length.
/// Errors: PR201 (event without words), PR203 (path_mode blend, axis letter).   Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads a part program through formats/siemens, without knowledge of what emit() was given, and
/// refuses every word that emit() does not print. `part` is the frame that the guard demands. The
/// rotation of `tool` about the tool axis is not in the text: it is the smallest one.
/// Errors: NC325 to NC329.
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

}  // namespace smoothpost::siemens_840d
