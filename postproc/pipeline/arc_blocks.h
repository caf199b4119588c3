#pragma once

#include <string>

#include "postproc/pipeline/block_runs.h"

// Arcs and helices of two linear axes in the place of many straight blocks.
namespace smoothpost {

/// Replaces runs of straight moves of one scheduled stretch by arcs (JointArc): the longest that
/// hold, from the front. The arc of a run begins and ends where the run does; its centre, on the
/// line that leaves it no other choice, is the least squares of the algebraic distance of the ends
/// and middles of its moves. A run holds where BlockRuns::may_follow() and
///  - two of X Y Z that span a plane of arc_planes() go along it, the third is linear in the angle,
///    and no other joint changes in the printed digits;
///  - the input has arcs only or none in it;
///  - at the end and the middle of each move that it replaces tip and tool axis are as near to the
///    stretch as 0.8 of the tolerances' chord share allows (BlockRuns::is_near);
///  - run at an even pace it keeps the schedule's time (BlockRuns::keeps_time), and no joint is
///    above 1.03 times the velocities and accelerations of feed_limits(), nor the machine's own;
///  - it sweeps kMostSweep at most.
/// It becomes an arc when it has three moves or more, the arc's radius and sweep are those that
/// set_arc() reads, and a straight block in its place would be off by more than that 0.8.
/// The certificate proves what comes out, everywhere along the arc (verify_deviation).
/// Guarantees (tests): circles and helices of random places come back; a dense grid keeps the
/// tolerance; durations sum up as before; no arc where a rotary moves or the path is straight.
/// Cost: about 10 forward solutions for each move that is there and each plane.
CurveReport join_into_arcs(MachineProgram& program, const CurveInput& input);

/// What a certificate of such a program rests on.
std::string arc_assumption();

}  // namespace smoothpost
