#pragma once

#include "machines/definition/machine.h"

namespace smoothpost {

/// X_FT as robot controllers state it ($TOOL, tooldata): the flange of the machine file to the tip
/// of a tool of `tool_length` mm. With every joint 0, T has the rotation of M.
Pose tool_frame(const MachineDefinition& machine, double tool_length);

}  // namespace smoothpost
