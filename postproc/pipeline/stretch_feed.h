#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "kernels/core/result.h"
#include "kernels/schedule/constant_feed.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/joint_stretch.h"

// Which feed a stretch is asked for, and the stretch as the schedule takes it.
namespace smoothpost {

/// A bound of ds/dt between two places.
struct RateCap {
  double from = 0.0, to = 0.0, rate = std::numeric_limits<double>::infinity();
};

/// The pieces of the stretch, cut where caps (ascending) begin and end. `stretch` has to outlive
/// it.
FeedPath feed_path(const JointStretch& stretch, const std::vector<RateCap>& caps);

/// Lowers the feed of every cut to the largest constant one that every joint's limits allow
/// everywhere in it (largest_constant_feed); stops and their ramps are not looked at.
/// @param samples of the plan
void lower_to_constant(std::vector<JointStretch>& stretches, const std::vector<Cut>& cuts,
                       const std::vector<JointSample>& samples, const FeedLimits& limits);

/// A place where a joint cannot keep the programmed feed.
struct TooFast {
  FeedOverload load;
  std::uint32_t line = 0;  ///< of the input
};

/// The stretches with stops in the sharp corners that they cannot pass at the programmed feed: a
/// blend of a corner that turns the tip by kSharpCorner or more is passed at rest in its middle.
/// Every other place where a joint would break a limit at the programmed feed goes to `too_fast`.
/// Guarantee (test): without entries there, the schedule runs at the programmed feed everywhere but
/// on ramps to and from rest or another programmed feed.   Cost: 24 evaluations a piece.
std::vector<JointStretch> at_programmed_feed(std::vector<JointStretch> stretches,
                                             const StretchesInput& plan, const FeedLimits& limits,
                                             std::vector<TooFast>& too_fast);

inline constexpr double kSharpCorner = 0.349;  ///< rad: 20°

/// KN152: lines, joints and factors, the first twelve.   @pre too_fast is not empty
Diagnostic too_fast_problem(const std::vector<TooFast>& too_fast, const MachineDefinition& machine,
                            const std::string& file_name);

}  // namespace smoothpost
