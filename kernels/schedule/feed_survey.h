#pragma once

#include <cstddef>
#include <vector>

#include "kernels/schedule/feed_profile.h"
#include "kernels/schedule/rest_map.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// What a first look along a path finds.
struct FeedSurvey {
  FeedStatus status = FeedStatus::solved;  ///< or why the path is refused
  FeedWitness witness;
  std::vector<double>
      slow;  ///< [i]: seconds from the start to breaks[i] at speed_bound() everywhere

  /// Seconds to s at that speed, linear inside a piece.
  double time(const FeedPath& path, double s) const;
  /// The s at which time() is t.
  double place(const FeedPath& path, double t) const;
};

/// The speed ds/dt that limits alone allow at a place, or infinity:
///   min over joints of V/|q'|, √(A/|q''|), ∛(J/|q'''|); feed and turn rate; the tip's A and J.
double speed_bound(const PathJet& jet, const FeedLimits& limits, double feed);

/// Looks at both ends of every piece and at places between (at least two, 64 along the path).
///
/// Refuses: NaN or infinity in a jet (not_finite); a joint that moves (|q'| above 1e-9 of the
/// largest of the path) under a limit that is not > 0, a feed that is not, or no finite limit at
/// all on what moves (no_limit); q' or q'' that jump at a break (not_smooth); two neighbouring
/// places of a piece where nothing moves (not_regular). Nothing moves anywhere: empty.
///
/// A jump counts at the speed u = speed_bound() on the slower side: Δq' must stay below `share` of
/// V/u, Δq'' below `share` of A/u². That is the jump of velocity or acceleration that the joint
/// would make at the largest speed there, as a share of its limit. Where that reference is
/// infinite, the largest |q'| or |q''| of the joint along the path takes its place; joints without
/// limits of acceleration and jerk may jump. Cost: 4 or more calls of path.jet a piece.
FeedSurvey survey(const FeedPath& path, const FeedLimits& limits, double smooth_share);

/// A part of a path.
struct FeedSpan {
  double from = 0.0, to = 0.0;  ///< s
};

/// Data of the map for a part: the harmonic mean of the speed, and the least limits at its ends.
RestGrading grading(const FeedPath& path, const FeedLimits& limits, const FeedSurvey& survey,
                    const FeedSpan& span);

}  // namespace smoothpost
