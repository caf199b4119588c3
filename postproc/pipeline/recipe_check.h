#pragma once

#include "kernels/core/tool_path.h"
#include "machines/definition/machine.h"
#include "machines/dialects/dialect.h"

namespace smoothpost {

/// How the control turns the tool in the mode that the machine asks of the dialect.
ToolTurn tool_turn_of(const MachineDefinition& machine, const Dialect& dialect);

/// What a machine's settings ask for and this version, this dialect or this input cannot do:
/// US120, one for each key with what is possible. Settings are refused, never ignored.
Diagnostics recipe_problems(const MachineDefinition& machine, const Dialect& dialect,
                            const ToolPath& input);

}  // namespace smoothpost
