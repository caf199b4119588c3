#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/kinematics/track_candidates.h"

// The dynamic programme of track_branches() over candidates and whole turns of both rotaries.
namespace smoothpost {

/// Position range of one rotary (rad) in which turns are looked for, and where the path starts
/// from.
struct TurnLimits {
  double lower = 0.0;
  double upper = 0.0;
  double start = 0.0;
};

struct TurnSearchSettings {
  std::array<TurnLimits, 2> rotary;  ///< first, second
  double step = 0.0;                 ///< largest |Δq| of a rotary on a cutting motion, ≤ π
};

/// A cutting motion that no candidate and turn survives: it ends at `point`. The best state before
/// it has the rotary values `from`, by candidate `candidate` of point − 1.
struct DeadEnd {
  std::size_t point = 0;
  std::size_t candidate = 0;
  std::array<double, 2> from{};
};

struct TurnSearchResult {
  double cost = 0.0;
  std::vector<std::size_t> candidate;  ///< per point, index within its layer; empty with dead ends
  std::vector<std::array<double, 2>> rotary;  ///< per point, first and second with their turns
  std::vector<DeadEnd> dead_ends;
};

/// Cheapest sequence of candidates and turns (cost and rules of track_branches()). After a dead end
/// the search goes on as if the motion into it did not cut, so that all of them are found.
///
/// All turns of a candidate that a cut carries along have gained the same cost, so the table over
/// turns is moved, not copied: O(1) a point. A motion that does not cut takes the least of cost +
/// |Δq| over all turns by two sweeps for each pair of second-rotary turns (distance transform):
/// O(turns).
/// @pre at least one valid candidate at each point
TurnSearchResult search_turns(const TrackCandidates& candidates,
                              const std::vector<TrackingPoint>& points,
                              const TurnSearchSettings& settings);

}  // namespace smoothpost
