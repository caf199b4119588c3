#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include "kernels/core/joints.h"

namespace smoothpost {

/// Derivatives of a path with respect to its parameter s at one place, seen from inside one piece.
struct PathJet {
  JointVector first, second, third;  ///< d q/ds, d²q/ds², d³q/ds³; mm or rad
  double tip_first = 0.0, tip_second = 0.0, tip_third = 0.0;  ///< of the tool tip's arc length, mm
                                                              ///< first ≥ 0; where it is ≤ 1e-9
                                                              ///< the others are not read
  double turn_first = 0.0;  ///< ≥ 0, rad by which the tool turns per unit of s
};

/// A joint path q(s) that is C3 inside its pieces and C2 where they meet, to be run from its first
/// break to its last without a stop between.
///
/// s is any regular parameter: q' or the tip's derivative is nowhere 0. Best is the arc length of
/// the tip, or where the tool also turns in place a generalised one, ds² = |dC|² + (ℓ dθ)² with
/// ℓ = 50 .. 100 mm/rad.
struct FeedPath {
  std::vector<double> breaks;  ///< ascending, ≥ 2: piece i is [breaks[i], breaks[i+1]]; every
                               ///< place where q‴ jumps or kinks or a cap changes is one of them:
                               ///< a kink that is missing costs some per cent of time
  std::vector<double> feed;  ///< mm/s, > 0, for each piece: the tip is never faster; infinity: none
  std::vector<double> rate;  ///< likewise of ds/dt; empty: none
  std::function<PathJet(std::size_t piece, double s)> jet;

  std::size_t pieces() const { return feed.size(); }
};

/// How a stretch starts or ends.
struct FeedEnd {
  bool rest = true;           ///< ds/dt = d²s/dt² = 0
  double speed = 0.0;         ///< unless rest: ds/dt > 0
  double acceleration = 0.0;  ///< unless rest: d²s/dt²
};

/// Limits of everything that moves. Those of the tip are about its arc length where tip_first ≥
/// 0.01; below that they fade to those of 0.00375 s, so that they say nothing much of turning in
/// place (limited_length() in feed_grid.h has the formula). A joint that does not move may have
/// limits 0.
struct FeedLimits {
  JointVector velocity, acceleration, jerk;  ///< > 0, mm or rad and s; infinity: none
  double tip_acceleration = std::numeric_limits<double>::infinity();  ///< mm/s², along the path
  double tip_jerk = std::numeric_limits<double>::infinity();          ///< mm/s³, along the path
  double turn_rate = std::numeric_limits<double>::infinity();         ///< rad/s, of the tool
};

}  // namespace smoothpost
