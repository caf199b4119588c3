#include "kernels/smooth/merge_points.h"

#include <cmath>

namespace smoothpost {

namespace {

constexpr double kNoMotion = 1e-9;     // mm
constexpr double kNoTurn = 1e-12;      // rad
constexpr double kLargestAngle = 0.3;  // rad of axis turn in one leg

bool repeats(const MergePoint& a, const MergePoint& b) {
  return (a.tip - b.tip).norm() < kNoMotion && (a.axis - b.axis).norm() < kNoTurn &&
         a.rotation.angularDistance(b.rotation) < kNoTurn;
}

/// Whether a straight leg from a to b stands for all points between.
bool stands_for(std::span<const MergePoint> points, std::size_t a, std::size_t b,
                const MergeSettings& settings) {
  const MergePoint& from = points[a];
  const MergePoint& to = points[b];
  const double angle = (to.axis - from.axis).norm();
  if (angle > kLargestAngle) return false;
  // The chord of the axes leaves the great circle's pace by less than this share of angle³.
  const double allowance = angle * angle * angle / 40.0;
  const double length = to.length - from.length;
  for (std::size_t i = a + 1; i < b; ++i) {
    const double share = length > 0.0 ? (points[i].length - from.length) / length
                                      : static_cast<double>(i - a) / static_cast<double>(b - a);
    const Vec3 tip = from.tip + share * (to.tip - from.tip);
    if ((points[i].tip - tip).norm() > settings.tip_tolerance) return false;
    if (settings.whole_rotation) {
      const Eigen::Quaterniond turned = from.rotation.slerp(share, to.rotation);
      if (points[i].rotation.angularDistance(turned) > settings.axis_tolerance + kNoTurn)
        return false;
      continue;
    }
    const Vec3 axis = (from.axis + share * (to.axis - from.axis)).normalized();
    if ((points[i].axis - axis).norm() + allowance > settings.axis_tolerance + kNoTurn)
      return false;
  }
  return true;
}

}  // namespace

std::vector<std::uint32_t> merge_points(std::span<const MergePoint> points,
                                        const MergeSettings& settings) {
  std::vector<std::uint32_t> kept;
  if (points.empty()) return kept;
  const auto index = [](std::size_t i) { return static_cast<std::uint32_t>(i); };
  kept.push_back(0);
  std::size_t from = 0;
  while (from + 1 < points.size()) {
    std::size_t to = from + 1;
    while (to + 1 < points.size() && !points[to].keep &&
           to + 1 - from <= static_cast<std::size_t>(settings.longest) &&
           stands_for(points, from, to + 1, settings))
      ++to;
    const bool last = to + 1 == points.size();
    if (repeats(points[from], points[to]) && (to == from + 1)) {
      // One of the two goes; a kept one stays, of two kept ones the first.
      if (!points[to].keep && !last) {
        // Skip it: the next leg starts at `from` still, seen from the repetition.
        from = to;
        continue;
      }
      if (!points[kept.back()].keep && kept.size() > 1) {
        kept.back() = index(to);
        from = to;
        continue;
      }
    }
    kept.push_back(index(to));
    from = to;
  }
  return kept;
}

}  // namespace smoothpost
