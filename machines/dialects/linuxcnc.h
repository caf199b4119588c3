#pragma once

#include "machines/dialects/dialect.h"

namespace smoothpost::linuxcnc {

/// Prints joint words for LinuxCNC: G0 for rapids, G93 G1 with the block's time for feeds, exact
/// path (G61), cancelled offsets and, when the machine file asks for it, a guard that aborts before
/// the first motion unless every active offset and tool length is zero. Input lines become N words.
/// Lengths in mm or inch and decimals by the machine file. Cost: linear.
Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program);

/// Reads joint words back through formats/nc, without knowledge of what emit() was given. The guard
/// is recognised by its exact text; any other use of O-words is refused.
Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name);

extern const Dialect kDialect;

}  // namespace smoothpost::linuxcnc
