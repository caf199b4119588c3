#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernels/schedule/feed_path.h"

namespace smoothpost {

/// How much of its limit one joint would need at a constant speed of the tip.
struct FeedOverload {
  enum class Kind : std::uint8_t { none, velocity, acceleration, jerk } kind = Kind::none;
  int joint = -1;  ///< −1: no joint
  double s = 0.0;
  std::size_t piece = 0;
  double factor = 0.0;  ///< of the limit: above 1 it is exceeded
};

/// The largest constant tip speed at which every joint keeps its limits everywhere inside a path,
///   F = min over s, k of { V/|q_l|, (A/|q_ll|)^(1/2), (J/|q_lll|)^(1/3) },
/// with q_l, q_ll, q_lll the derivatives by the arc length l of the tip. Of what has no way of the
/// tip nothing is said. Infinity if no joint moves.
struct ConstantFeed {
  double feed = 0.0;      ///< mm/s
  FeedOverload blocking;  ///< factor 1: the joint that allows no more
};

/// Evaluates `places` ≥ 2 equidistant places of each piece, its ends from inside.
/// Cost: places · pieces evaluations of the path.
ConstantFeed largest_constant_feed(const FeedPath& path, const FeedLimits& limits, int places);

/// For each piece the largest overload at its own feed (FeedPath::feed); kind none where nothing is
/// above 1 or the piece has no feed. Acceleration and jerk grow by the square and the cube of the
/// feed: the feed that a piece can have is feed / max(v, a^(1/2), j^(1/3)) of the three factors.
std::vector<FeedOverload> overloads(const FeedPath& path, const FeedLimits& limits, int places);

}  // namespace smoothpost
