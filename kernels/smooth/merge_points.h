#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/core/pose.h"

namespace smoothpost {

/// A point of a dense path.
struct MergePoint {
  Vec3 tip = Vec3::Zero();                                       ///< mm
  Vec3 axis = Vec3::UnitZ();                                     ///< unit
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< with settings.whole_rotation
  double length = 0.0;  ///< mm along the path from its start, not decreasing
  bool keep = false;    ///< must stay: an event, a change of feed, the end of an arc
};

struct MergeSettings {
  double tip_tolerance = 0.0;   ///< mm
  double axis_tolerance = 0.0;  ///< rad
  bool whole_rotation = false;  ///< axis_tolerance is for `rotation`, not for the axis alone
  int longest = 48;             ///< points that one leg may take the place of
};

/// The points of a path that stay when others are merged into straight legs.
///
/// A leg from a to b takes the place of the points between when every one of them is within the
/// tolerances of the leg's pose at the same share of the length: tip on the chord, axis on the
/// great circle. So are then all poses between the points: their distance is largest at a point
/// (tip), the axis' up to the third power of the leg's angle, which is counted. Greedy from the
/// front; the first and the last point and those with `keep` stay. A point that repeats its
/// neighbour (nothing moves by 1e-9 mm or 1e-12 rad) is dropped too, unless kept: of a kept point's
/// repetitions the kept one stays. Guarantees (tests): deviation at equal share within the
/// tolerances at dense samples; kept points stay; repeated points; tolerance 0 keeps every point
/// that is not on the way. Cost: O(n · longest), no allocation but the result.
/// @return indices of the points that stay, ascending
std::vector<std::uint32_t> merge_points(std::span<const MergePoint> points,
                                        const MergeSettings& settings);

}  // namespace smoothpost
