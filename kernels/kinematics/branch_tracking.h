#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/kinematics/rotary_pair.h"

namespace smoothpost {

/// A location to be reached, and how.
struct TrackingPoint {
  CutterLocation location;
  bool cut = false;          ///< the motion that ends here cuts: rotaries must be continuous on it
  std::uint32_t line = 0;    ///< input line, for messages
};

struct BranchTrackingSettings {
  JointVector held;                 ///< values of the held joints; also where the first point starts from
  double pole_cap = 0.0;            ///< rad: inside this angle to the pole the first rotary is free
  double continuity = 0.8726646;    ///< rad: largest rotary step on a cutting motion between neighbours
};

/// A place where no continuous choice exists inside a cut.
struct Rewind {
  std::size_t point = 0;
  std::uint32_t line = 0;
  int joint = 0;
  std::string reason;  ///< which axis, its value and its limit, for a person
};

struct BranchTracking {
  enum class Status { ok, unreachable, rewind_needed, over_limit } status = Status::ok;
  std::vector<JointVector> q;   ///< one per point when status is ok
  std::vector<int> branch;      ///< branch index per point
  std::size_t point = 0;        ///< where it failed
  std::string reason;           ///< what failed there: joint, value, limit
  std::vector<Rewind> rewinds;  ///< when a rewind is needed
};

/// One global choice of branch and winding along a path, by dynamic programming under the axis limits.
BranchTracking track_branches(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                              const BranchTrackingSettings& settings);

}  // namespace smoothpost
