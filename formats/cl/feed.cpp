#include "formats/cl/feed.h"

#include "formats/cl/words.h"
#include "kernels/core/units.h"

namespace smoothpost::cl {

FeedUnit feed_unit(std::string_view word) {
  if (same_word(word, "MMPM")) return {true, false, 1.0};
  if (same_word(word, "IPM")) return {true, false, kMillimetresPerInch};
  if (same_word(word, "PERMIN")) return {true, false, 0.0};
  if (same_word(word, "MMPR")) return {true, true, 1.0};
  if (same_word(word, "IPR")) return {true, true, kMillimetresPerInch};
  if (same_word(word, "PERREV")) return {true, true, 0.0};
  return {};
}

Feed feed_of(double value, const FeedUnit& feed_unit, double unit) {
  const double length = value * (feed_unit.length > 0.0 ? feed_unit.length : unit);
  return {feed_unit.per_revolution ? length : length / kSecondsPerMinute, feed_unit.per_revolution};
}

bool usable(const Feed& feed) { return feed.value >= 1e-6 && feed.value <= 1e6; }

}  // namespace smoothpost::cl
