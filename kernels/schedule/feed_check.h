#pragma once

#include <memory>
#include <vector>

#include "kernels/schedule/feed_grid.h"
#include "kernels/schedule/feed_profile.h"

// Internal to kernels/schedule.
namespace smoothpost {

/// Shares of the limits that laws on one grid use, at 44 places an element with both ends (seen
/// from inside the element).
///
/// The rows at the 44 places are interpolated from those at the collocation points. Two probes an
/// element verify that: where the loads of this very law, from a probe's own row and from the
/// interpolated one, are more than 1e-6 apart, 13 points of the element are evaluated and kept, and
/// where that is not enough, all 44 places each time. Between places, peaks above 0.9 are the tops
/// of parabolas through three neighbours.
/// Units: loads are shares of a limit; controls as in FeedGrid.   Cost: 1 to 2 µs an element at 8
/// lanes, 11 calls of path.jet more where rows are evaluated; memory 3 kB an element there.
class FeedCheck {
 public:
  /// Both have to live as long as this does.
  FeedCheck(const FeedStretch& stretch, const FeedGrid& grid);
  ~FeedCheck();

  /// The largest loads of every element.   @pre controls fit the grid
  std::vector<FeedLoad> loads(const std::vector<double>& controls);
  /// The same anew for the elements that `changed` names only.   @pre one of each an element
  void renew(const std::vector<double>& controls, const std::vector<bool>& changed,
             std::vector<FeedLoad>& loads);
  /// The stretches on the first `elements` elements on which a load is ≥ 0.99, at the same places;
  /// ascending in `from`.
  std::vector<FeedBinding> bindings(const std::vector<double>& controls, std::size_t elements);

 private:
  class Places;
  const FeedStretch& stretch_;
  const FeedGrid& grid_;
  std::unique_ptr<Places> places_;
};

/// FeedCheck::loads() of one law.
std::vector<FeedLoad> element_loads(const FeedStretch& stretch, const FeedGrid& grid,
                                    const std::vector<double>& controls);

FeedLoad largest_load(const std::vector<FeedLoad>& loads);

}  // namespace smoothpost
