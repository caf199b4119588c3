#pragma once

#include <string>

#include "postproc/pipeline/block_runs.h"

// Few blocks along polynomials in the place of many straight ones.
namespace smoothpost {

/// Replaces runs of straight moves of one scheduled stretch by bent moves: the longest that hold,
/// from the front. The polynomial of a run from s0 to s1 is hermite_bend() of the stretch's joints,
/// so that neighbours meet with a continuous tangent (dialect.curves "cubic", degree 3), or tangent
/// and curvature ("quintic", degree 5). A run holds where
///  - no action (event, label, comment, dwell) stands inside of it, and where nothing changes in it
///    that is of the input's points: beam, tool, programmed feed, events;
///  - the ends of its moves lie on the stretch (an event's latency may have moved them off);
///  - at the end and the middle of each move that it replaces tip and tool axis are as near to the
///    stretch as 0.8 of the tolerances' chord share allows, at the place of the polynomial that the
///    certificate pairs with that of the input: by share inside a segment, by length of the tip
///    over several;
///  - run at an even pace in its whole time it has no place more than kShortBlock earlier or later
///    than the schedule, and no joint above the velocities and accelerations of feed_limits().
/// The certificate proves what comes out (verify_deviation).
/// Guarantees (tests): a dense grid keeps the tolerance; tangents, and curvatures of degree 5, meet
/// to the scheduled path's own; durations sum up as before.
/// Cost: about 10 forward solutions for each move that is there.   @pre dialect.curves is not lines
CurveReport join_into_curves(MachineProgram& program, const CurveInput& input);

/// What a certificate of such a program rests on.
std::string curve_assumption(const MachineDefinition& machine);

}  // namespace smoothpost
