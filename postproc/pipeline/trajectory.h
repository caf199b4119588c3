#pragma once

#include <string>

#include "machines/dialects/dialect.h"

namespace smoothpost {

/// The program's joints at the machine's cycle time as CSV: `t_s`, one column per axis with its
/// unit (X_mm, C_deg), then x_mm,y_mm,z_mm,i,j,k of the tool in the part and beam (0/1).
///
/// Joints are linear over each block's printed time; rapids take the time of the slowest joint at
/// its velocity limit; dwells hold. Starts at the first move after which every joint is known.
/// `chain` is the output machine's with the part placed; `tool_length` is that of the first tool.
std::string trajectory_csv(const ReadBack& read, const MachineDefinition& machine,
                           const ScrewChain& chain, double tool_length);

}  // namespace smoothpost
