#include "formats/heidenhain/corner.h"

#include <cmath>

#include "formats/nc/number_text.h"

namespace smoothpost::conversational {
namespace {

constexpr double kFlat = 1e-6;     // mm, between the heights of points of one plane
constexpr double kTurn = 1e-6;     // rad, of a corner that is one
constexpr double kBack = 3.14159;  // rad, of a way that turns back on itself
constexpr double kSlack = 1e-9;    // mm, of a line that is just long enough
constexpr double kShort = 1e-9;    // mm

double turn_of(const CornerLines& lines) {
  const Vec3 first = lines.corner - lines.start;
  const Vec3 second = lines.end - lines.corner;
  return std::atan2(first.x() * second.y() - first.y() * second.x(),
                    first.x() * second.x() + first.y() * second.y());
}

/// Cuts `length` off both lines.
Corner cut(const CornerLines& lines, double length) {
  Corner out;
  const Vec3 first = lines.corner - lines.start;
  const Vec3 second = lines.end - lines.corner;
  const double shorter = std::min(first.norm(), second.norm());
  if (std::abs(first.z()) > kFlat || std::abs(second.z()) > kFlat) {
    out.problem = "the lines of the corner do not lie in the working plane";
  } else if (shorter < kShort) {
    out.problem = "a line of the corner has no length";
  } else if (const double turn = std::abs(turn_of(lines)); turn < kTurn || turn > kBack) {
    out.problem = "the lines of the corner have one direction";
  } else if (length > shorter + kSlack) {
    out.problem = "it takes " + nc::decimal_text(length, 4) + " mm off lines of which one has " +
                  nc::decimal_text(shorter, 4) + " mm";
  } else {
    out.begin = lines.corner - length * first.normalized();
    out.end = lines.corner + length * second.normalized();
  }
  return out;
}

}  // namespace

Corner rounded_corner(const CornerLines& lines, double radius) {
  const double turn = turn_of(lines);
  Corner out = cut(lines, radius * std::tan(0.5 * std::abs(turn)));
  if (!out.problem.empty()) return out;
  const Vec3 along = (lines.corner - lines.start).normalized();
  const double side = turn > 0.0 ? radius : -radius;
  out.centre = out.begin + side * Vec3(-along.y(), along.x(), 0.0);
  out.sweep = turn;
  return out;
}

Corner chamfered_corner(const CornerLines& lines, double length) { return cut(lines, length); }

}  // namespace smoothpost::conversational
