#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "kernels/geometry/slicing.h"

namespace smoothpost {

/// A contour of a slice by arc length: 0 is its first point, length() its last (of a closed one the
/// first again). Lengths mm.
class ContourLine {
 public:
  /// @pre at least two points
  explicit ContourLine(const SliceContour& contour);
  double length() const { return length_.back(); }
  /// The point at a place, which is clamped.   Cost: log n.
  Vec3 at(double s) const;
  /// Unit, of the side at a place.
  Vec3 direction(double s) const;
  /// The middle of the longest side: the place that is farthest from a corner on parts of planes.
  double middle_of_longest() const;
  /// The vertex between two places, ends included, that turns most, and where it is; nothing when
  /// there is none.   Cost: log n and the vertices between.
  std::optional<std::pair<Vec3, double>> corner(double from, double to) const;

 private:
  std::size_t segment(double s) const;

  std::vector<Vec3> points_;
  std::vector<double> length_;
};

}  // namespace smoothpost
