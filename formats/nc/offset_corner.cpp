#include "formats/nc/offset_corner.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr double kStraightOn = 0.05;  // rad
constexpr double kWholeTurn = 1e-6;   // rad, as in arc.cpp

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// A line's points at the distance `radius` from a centre, in the order of its direction.
struct Chord {
  Vec2 first;
  Vec2 last;
};

std::optional<Chord> chord_of(const Vec2& point, const Vec2& direction, const Vec2& centre,
                              double radius) {
  const Vec2 to = centre - point;
  const double off = cross(direction, to);
  if (std::abs(off) > radius) return {};
  const double half = std::sqrt(std::max(0.0, radius * radius - off * off));
  const Vec2 middle = point + to.dot(direction) * direction;
  return Chord{middle - half * direction, middle + half * direction};
}

std::optional<Vec2> meet_lines(const Vec2& p, const Vec2& u, const Vec2& q, const Vec2& v) {
  const double turn = cross(u, v);
  if (turn == 0.0) return {};
  return Vec2(p + cross(q - p, v) / turn * u);
}

std::optional<Vec2> meet_arcs(const OffsetCurve& before, const OffsetCurve& next,
                              const ToolSide& tool) {
  const Vec2 way = next.centre - before.centre;
  const double distance = way.norm();
  if (distance == 0.0 || before.radius == 0.0) return {};
  const double along =
      (distance * distance + (before.radius - next.radius) * (before.radius + next.radius)) /
      (2.0 * distance);
  if (std::abs(along) > before.radius) return {};
  const double off = std::sqrt(std::max(0.0, before.radius * before.radius - along * along));
  const Vec2 u = way / distance;
  const bool same = before.counter_clockwise == next.counter_clockwise;
  return Vec2(before.centre + along * u + (tool.left == same ? off : -off) * left_of(u));
}

/// The angle by which the contour turns away from the tool.
double turn_away(const OffsetCurve& before, const OffsetCurve& next, const ToolSide& tool) {
  double turn =
      std::atan2(cross(before.direction, next.direction), before.direction.dot(next.direction));
  if (tool.left) turn = -turn;
  return turn < -0.5 * kPi ? turn + 2.0 * kPi : turn;
}

}  // namespace

Vec2 beside(const OffsetCurve& element, const ToolSide& tool) {
  return element.corner + (tool.left ? tool.radius : -tool.radius) * left_of(element.direction);
}

Corner corner_between(const OffsetCurve& before, const OffsetCurve& next, const ToolSide& tool) {
  const double turn = turn_away(before, next, tool);
  if (turn < -kStraightOn || turn > kPi + kStraightOn) return Corner::inside;
  if (turn <= kStraightOn) return Corner::none;
  if (turn > kPi - kStraightOn) {
    const OffsetCurve& arc = next.is_arc ? next : before;
    if (arc.is_arc && !is_tool_inside(arc, tool)) return Corner::inside;
  }
  return Corner::outside;
}

std::optional<Vec2> inside_corner(const OffsetCurve& before, const OffsetCurve& next,
                                  const ToolSide& tool) {
  if (before.is_arc && next.is_arc) return meet_arcs(before, next, tool);
  const Vec2 p = beside(before, tool);
  const Vec2 q = beside(next, tool);
  if (before.is_arc) {
    const auto chord = chord_of(q, next.direction, before.centre, before.radius);
    if (!chord) return {};
    return is_tool_inside(before, tool) ? chord->first : chord->last;
  }
  if (next.is_arc) {
    const auto chord = chord_of(p, before.direction, next.centre, next.radius);
    if (!chord) return {};
    return is_tool_inside(next, tool) ? chord->last : chord->first;
  }
  return meet_lines(p, before.direction, q, next.direction);
}

double turn_between(const Vec2& centre, const Vec2& from, const Vec2& to, bool counter_clockwise) {
  const Vec2 a = from - centre;
  const Vec2 b = to - centre;
  double angle = std::atan2(cross(a, b), a.dot(b));
  if (!counter_clockwise) angle = -angle;
  return angle <= kWholeTurn ? angle + 2.0 * kPi : angle;
}

}  // namespace smoothpost::nc
