#pragma once

#include <string_view>

namespace smoothpost::cl {

/// A feed as it was written: mm/s, or mm a revolution of the spindle.
struct Feed {
  double value = 0.0;
  bool per_revolution = false;
};

/// The unit of a feed by its minor word.
struct FeedUnit {
  bool known = false;
  bool per_revolution = false;
  double length = 0.0;  ///< mm; 0: the unit of lengths
};

/// MMPM IPM PERMIN MMPR IPR PERREV.
FeedUnit feed_unit(std::string_view word);

/// @param unit  mm of one unit of length
Feed feed_of(double value, const FeedUnit& feed_unit, double unit);

/// Whether a feed is within 1e-6 to 1e6 mm/s or mm a revolution.
bool usable(const Feed& feed);

}  // namespace smoothpost::cl
