#include "formats/cl/arc.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::cl {
namespace {

constexpr double kNoRadius = 1e-4;     // mm
constexpr double kRadiusError = 0.01;  // mm
constexpr double kRadiusShare = 0.001;
constexpr double kLargestError = 1.0;  // mm
constexpr double kFullCircle = 1e-6;   // rad
constexpr double kSamePoint = 1e-6;    // mm

Vec3 spoke(const Circle& circle, const Vec3& point) {
  const Vec3 offset = point - circle.centre;
  return offset - circle.normal * circle.normal.dot(offset);
}

}  // namespace

double radius_at(const Circle& circle, const Vec3& point) { return spoke(circle, point).norm(); }

Vec3 tangent_at(const Circle& circle, const Vec3& point) {
  const Vec3 forward = circle.normal.cross(spoke(circle, point)).normalized();
  return circle.right_hand ? forward : Vec3(-forward);
}

double turn_between(const Circle& circle, const Vec3& from, const Vec3& to) {
  const Vec3 a = spoke(circle, from);
  const Vec3 b = spoke(circle, to);
  double angle = std::atan2(circle.normal.dot(a.cross(b)), a.dot(b));
  if (!circle.right_hand) angle = -angle;
  if (angle < 0.0) angle += 2.0 * kPi;
  return angle < 2.0 * kPi ? angle : 0.0;
}

std::string off_circle(const Circle& circle, const Vec3& start, const Vec3& point) {
  const double first = radius_at(circle, start);
  const double radius = radius_at(circle, point);
  if (std::min(first, radius) < kNoRadius)
    return "the radius is zero: from the centre to the start " + nc::decimal_text(first, 4) +
           " mm, to the point " + nc::decimal_text(radius, 4) + " mm";
  const double written = circle.radius > 0.0 ? circle.radius : first;
  const auto [least, most] = std::minmax({first, radius, written});
  const double difference = most - least;
  if (difference > kLargestError ||
      (difference > kRadiusError && difference > kRadiusShare * most)) {
    std::string text = "the point is not on the circle: the radius is " +
                       nc::decimal_text(first, 4) + " mm at the start and " +
                       nc::decimal_text(radius, 4) + " mm at the point";
    if (circle.radius > 0.0) text += ", written " + nc::decimal_text(circle.radius, 4) + " mm";
    return text + "; they may differ by 0.01 mm or 0.1 %";
  }
  return {};
}

std::string ArcPath::add(const Vec3& point) {
  std::string problem = off_circle(circle_, start_, point);
  if (!problem.empty()) return problem;
  // Two equal points behind each other are no turn, but a first point at the start is one.
  if (points_ == 0 || (point - last_).norm() > kSamePoint) {
    const double turn = turn_between(circle_, last_, point);
    const bool at_start = 2.0 * kPi - turn < kFullCircle;
    sweep_ += points_ > 0 && at_start ? 0.0 : turn;
  }
  last_ = point;
  ++points_;
  const double rise = circle_.normal.dot(point - start_);
  if (points_ > 1 && sweep_ > 2.0 * kPi + kFullCircle && std::abs(rise) < kNoRadius)
    return "the points run against the sense of the circle";
  return {};
}

double ArcPath::sweep() const {
  return points_ == 1 && sweep_ < kFullCircle ? sweep_ + 2.0 * kPi : sweep_;
}

}  // namespace smoothpost::cl
