#pragma once

#include <vector>

#include "kernels/schedule/feed_check.h"
#include "kernels/schedule/feed_solver.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// How a stretch is solved.
struct StretchSettings {
  double element_time = 0.007;  ///< s
  int least_elements = 40;
  int points = 5;       ///< Lobatto points an element
  int tightenings = 3;  ///< most solves with the rows drawn in
  double lower = 0.0;   ///< share by which all limits are lowered
  double slope = 0.0;   ///< share by which they sink further, linearly in s, to the end
};

/// A law on a grid.
struct StretchLaw {
  FeedGrid grid;
  std::vector<double> controls;
  std::vector<FeedLoad> loads;  ///< of every element, of the limits themselves
  double time = 0.0;            ///< quadrature of T
  bool converged = false;       ///< of the last solve
  bool constant = false;        ///< b = const
  int iterations = 0;           ///< of all solves

  FeedLoad load() const { return largest_load(loads); }
  /// Least factor ≥ 1 of all times that brings every load to 1 or below.
  double dilation() const;
};

/// Stretches all times by c: b ← b/c², loads by c, c², c³.
void dilate(StretchLaw& law, double c);

/// The best law from rest to rest found, before its dilation: two grid levels, both in parts
/// (solve_in_parts), tightening, and b =
/// const where that is faster or the optimiser fails. Always a law: some dilation makes it
/// feasible.
StretchLaw solve_resting(const FeedStretch& stretch, const StretchSettings& settings);

/// Speed and acceleration of a moving end, as b and db/dw there; see moving_end().
struct MovingEnd {
  bool moving = false;
  double b = 0.0, slope = 0.0;
};

/// With φ' = v there: b = (ds/dt)²/v², db/dw = 2 (d²s/dt²)/v.
MovingEnd moving_end(const FeedStretch& stretch, const FeedEnd& end);

struct MovingEnds {
  MovingEnd start, end;
};

/// A law with given speeds at its ends; nothing is dilated. The first or last two controls are
///   x_0 = b,   x_1 = b + b' h/3   (h: the element there, shortened until x_1 ≥ 0.6 b).
/// A law that did not converge or whose load is above 1 is the caller's to refuse.
StretchLaw solve_moving(const FeedStretch& stretch, const MovingEnds& ends,
                        const StretchSettings& settings);

}  // namespace smoothpost
