#include "formats/nc/arc.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr double kFullCircleAngle = 1e-6;  // rad

/// Sweep from `start` to `end` about `centre` in the arc's sense, in (0, 2π] before further turns.
double sweep_of(const ArcWords& words, const PlanePoint& centre) {
  const double x1 = words.start.first - centre.first;
  const double y1 = words.start.second - centre.second;
  const double x2 = words.end.first - centre.first;
  const double y2 = words.end.second - centre.second;
  double angle = std::atan2(x1 * y2 - y1 * x2, x1 * x2 + y1 * y2);
  if (words.clockwise) angle = -angle;
  if (angle < kFullCircleAngle) angle += 2.0 * kPi;
  angle += 2.0 * kPi * (words.turns - 1);
  return words.clockwise ? -angle : angle;
}

}  // namespace

PlaneArc arc_by_centre(const ArcWords& words, const PlanePoint& centre) {
  PlaneArc arc;
  const double r1 =
      std::hypot(words.start.first - centre.first, words.start.second - centre.second);
  const double r2 = std::hypot(words.end.first - centre.first, words.end.second - centre.second);
  const double difference = std::abs(r1 - r2);
  if (std::min(r1, r2) < words.radius_tolerance) {
    arc.problem = "the radius is zero: from the centre to the start " + decimal_text(r1, 4) +
                  " mm, to the end " + decimal_text(r2, 4) + " mm";
    return arc;
  }
  if (difference > 100.0 * words.centre_tolerance ||
      (difference > words.centre_tolerance && difference > 0.001 * std::max(r1, r2))) {
    arc.problem = "the end is not on the circle: the radius is " + decimal_text(r1, 4) +
                  " mm at the start and " + decimal_text(r2, 4) + " mm at the end; limit " +
                  decimal_text(words.centre_tolerance, 4) + " mm or 0.1 %";
    return arc;
  }
  arc.centre = centre;
  arc.radius = 0.5 * (r1 + r2);
  arc.sweep = sweep_of(words, centre);
  return arc;
}

PlaneArc arc_by_radius(const ArcWords& words, double radius) {
  PlaneArc arc;
  const double dx = words.end.first - words.start.first;
  const double dy = words.end.second - words.start.second;
  const double chord = std::hypot(dx, dy);
  if (chord == 0.0) {
    arc.problem =
        "start and end are one point, so a radius gives no centre; give the centre by I J K";
    return arc;
  }
  double r = std::abs(radius);
  const double half = 0.5 * chord;
  if (half - r > words.radius_tolerance) {
    arc.problem = "radius " + decimal_text(r, 4) + " mm cannot reach an end " +
                  decimal_text(chord, 4) + " mm away";
    return arc;
  }
  r = std::max(r, half);
  // The centre lies left of the chord for a short counter-clockwise arc.
  const double height = std::sqrt(std::max(0.0, (r - half) * (r + half)));
  const bool left = words.clockwise == (radius < 0.0);
  const double side = left ? height : -height;
  arc.centre = {words.start.first + 0.5 * dx - side * dy / chord,
                words.start.second + 0.5 * dy + side * dx / chord};
  arc.radius = r;
  const double minor = 2.0 * std::atan2(half, height);
  double angle = radius < 0.0 ? 2.0 * kPi - minor : minor;
  angle += 2.0 * kPi * (words.turns - 1);
  arc.sweep = words.clockwise ? -angle : angle;
  return arc;
}

}  // namespace smoothpost::nc
