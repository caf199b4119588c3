#pragma once

#include <string>

#include "kernels/core/pose.h"

namespace smoothpost::cl {

/// A circle that the tool tip goes round, mm in W.
struct Circle {
  Vec3 centre = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< unit
  bool right_hand = true;       ///< the sense of the motion about `normal`
  double radius = 0.0;          ///< as written; 0: not written
};

/// Distance of a point from the circle's axis, mm.
double radius_at(const Circle& circle, const Vec3& point);

/// Direction of the motion at a point of the circle, unit.   @pre radius_at(point) > 0
Vec3 tangent_at(const Circle& circle, const Vec3& point);

/// Angle from one point to another in the circle's sense, rad in [0, 2π).
double turn_between(const Circle& circle, const Vec3& from, const Vec3& to);

/// Why a point is not on the circle through `start`; empty when it is.
///
/// A radius of less than 1e-4 mm is none. The radii at start and point, and the written one, may
/// differ by 0.01 mm or 0.1 % of the largest, but never by more than 1 mm.
std::string off_circle(const Circle& circle, const Vec3& start, const Vec3& point);

/// An arc that is given point by point. The sweep adds up from each point to the next; a single
/// point within 1e-6 rad of the start is a full circle.
class ArcPath {
 public:
  ArcPath(const Circle& circle, const Vec3& start) : circle_(circle), start_(start), last_(start) {}

  /// Goes on to a point; what is wrong with it, or nothing.
  std::string add(const Vec3& point);

  const Circle& circle() const { return circle_; }
  const Vec3& start() const { return start_; }
  const Vec3& end() const { return last_; }
  int points() const { return points_; }
  /// rad, positive in the circle's sense.
  double sweep() const;

 private:
  Circle circle_;
  Vec3 start_;
  Vec3 last_;
  double sweep_ = 0.0;
  int points_ = 0;
};

}  // namespace smoothpost::cl
