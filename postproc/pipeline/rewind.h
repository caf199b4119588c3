#pragma once

#include <vector>

#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/joint_plan.h"
#include "postproc/pipeline/reference_path.h"

namespace smoothpost {

/// Splits cuts where an axis has to be unwound: the path ends at the place, a link of ours follows
/// (segment `replanned`), and the path goes on `over_burn` mm (of tip path) before the place, so
/// that the seam is cut twice.
///
/// The new segments are parts of the old ones: same line, same interpolation, arcs with the part of
/// their sweep, durations in proportion. At the end of the first half the events that end the cut
/// in the input (beam, gas, follow off) are repeated, at the start of the second half those that
/// start it. The second half never starts before the cut's own start, nor before an event inside
/// it. Guarantees (tests): without the doubled length the path is the old one; every split has its
/// two halves; the beam is off in between.
/// @pre places sorted, each inside a cut   Cost: linear in the path for each place.
void split_cuts(ToolPath& path, std::vector<Cut>& cuts, const ReferencePath::Frames& frames,
                const std::vector<SplitPlace>& places, double over_burn);

}  // namespace smoothpost
