#pragma once

#include "machines/definition/machine.h"
#include "machines/dialects/dialect.h"
#include "postproc/pipeline/reference_path.h"

namespace smoothpost {

/// Puts events on the fly earlier on their run by the latency of their words at the planned speed;
/// moves are split there, in the same straight line and at the same speed.
///
/// An event stays where it is when the tool stands still before it: at the start of a run, and
/// behind a dwell or an event that stops. It never passes such a place.
/// Guarantees (tests): the split moves end where they did and last as long; an event stands its
/// latency ahead. Cost: linear in moves and actions.
/// `turn`: how the controller turns the tool on tool moves, which carry their start in the tool
/// pose of the move before.
/// `reference`: needed where a move takes the place of several segments.
void compensate_latency(MachineProgram& program, const MachineDefinition& machine, ToolTurn turn,
                        const ReferencePath* reference = nullptr);

}  // namespace smoothpost
