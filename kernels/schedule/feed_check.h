#pragma once

#include <array>
#include <vector>

#include "kernels/schedule/feed_grid.h"
#include "kernels/schedule/feed_profile.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// Largest shares of the limits that b = x(w) uses in every element, on 44 places an element with
/// both ends (seen from inside the element).
///
/// The rows at the 44 places are interpolated from those at the collocation points. Two probes an
/// element verify that: where the loads of this very law, from a probe's own row and from the
/// interpolated one, are more than 1e-6 apart, the path itself is evaluated at all 44 places.
/// Between places, peaks above 0.9 are the tops of parabolas through three neighbours.
std::vector<FeedLoad> element_loads(const FeedStretch& stretch, const FeedGrid& grid,
                                    const std::vector<double>& controls);

/// The same anew for the elements that `changed` names only.
void renew_loads(const FeedStretch& stretch, const FeedGrid& grid,
                 const std::vector<double>& controls, const std::vector<bool>& changed,
                 std::vector<FeedLoad>& loads);

/// The stretches on the first `elements` elements on which a load is ≥ 0.99, at the same places;
/// ascending in `from`.
std::vector<FeedBinding> feed_bindings(const FeedStretch& stretch, const FeedGrid& grid,
                                       const std::vector<double>& controls, std::size_t elements);

FeedLoad largest_load(const std::vector<FeedLoad>& loads);

}  // namespace smoothpost
