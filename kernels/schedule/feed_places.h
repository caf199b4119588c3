#pragma once

#include <array>
#include <vector>

#include "kernels/schedule/feed_grid.h"
#include "kernels/schedule/feed_profile.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// b, b', b'' and √b at a place.
struct PlaceValues {
  double b = 0.0, b1 = 0.0, b2 = 0.0, root = 0.0;
};

/// Rows at `count` places from those at `nodes` collocation points, all of 3·width numbers:
/// out[place] = Σ_j weights[place·nodes + j] rows[j].
struct RowInterpolation {
  int width = 8, nodes = 0, count = 0;
  const double* weights = nullptr;
};
void interpolate_rows(const RowInterpolation& by, const double* rows, double* out);

/// Replaces the row of each place (FeedRow::q, 3·width numbers) by its shares of the limits:
/// |velocity| at [l], acceleration at [width + l] and jerk at [2·width + l] with their signs.
void rows_to_loads(const FeedLanes& lanes, const std::vector<PlaceValues>& at, double* rows);

/// The largest shares of the lanes (3·width numbers a place, as rows_to_loads() leaves them) at the
/// places and, above 0.9, at the tops of parabolas through three neighbours.   @pre shares ascend
FeedLoad largest_loads(int width, const std::vector<double>& shares, const double* loads);

}  // namespace smoothpost
