#pragma once

#include <array>
#include <vector>

#include "kernels/schedule/feed_grid.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// One map with its b(w): a law from w = 0 up to `end`, which may lie before the map's extent.
struct LawPart {
  static constexpr int kParts = 8;  ///< equal parts of an element, each with its time

  double from = 0.0;  ///< s at w = 0
  RestMap map;
  std::vector<double> begin;  ///< w at the start of the elements, and at the end of the last
  std::vector<MapZone> zone;
  std::vector<std::array<double, 4>> cubic;  ///< b as a polynomial of w − begin
  std::vector<double> times;  ///< t at the start of part p of element e at [kParts·e + p], and
                              ///< at the end; from the start of the law

  double start_time() const { return times.front(); }
  double end_time() const { return times.back(); }
  double end() const { return from + map.at(begin.back(), zone.back())[0]; }
};

struct FeedLaw {
  std::vector<LawPart> parts;  ///< at least one; each begins where the one before ends
};

/// The law of the first `elements` elements of a grid, starting at time 0.
LawPart law_part(const FeedStretch& stretch, const FeedGrid& grid,
                 const std::vector<double>& controls, std::size_t elements);

/// Moves all times so that the part starts at t.
void shift_times(LawPart& part, double t);

}  // namespace smoothpost
