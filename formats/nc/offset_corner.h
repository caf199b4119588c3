#pragma once

#include <Eigen/Core>
#include <optional>

namespace smoothpost::nc {

/// A point or direction of a plane, along its first and second axis. mm.
using Vec2 = Eigen::Vector2d;

/// A quarter turn counter-clockwise.
inline Vec2 left_of(const Vec2& v) { return {-v.y(), v.x()}; }

/// The curve beside a line or arc of a contour, at the distance of a tool's radius, as far as one
/// end of it says.
struct OffsetCurve {
  Vec2 corner = Vec2::Zero();     ///< end of the contour's element
  Vec2 direction = Vec2::Zero();  ///< of the contour there, along its way, unit
  bool is_arc = false;
  bool counter_clockwise = false;  ///< of an arc
  Vec2 centre = Vec2::Zero();      ///< of an arc
  double radius = 0.0;             ///< of the curve beside an arc, mm
};

/// How the tool goes from one element of a contour to the next.
enum class Corner {
  none,     ///< straight on
  outside,  ///< round the corner
  inside    ///< both curves end where they meet
};

/// Which side of the contour the tool is on, and how far from it.
struct ToolSide {
  double radius = 0.0;  ///< mm, above 0
  bool left = false;    ///< of the direction of motion
};

/// The point of the curve beside `element` at its corner: corner ± radius · normal.
Vec2 beside(const OffsetCurve& element, const ToolSide& tool);

/// Whether the tool lies on the side of an arc's centre.
inline bool is_tool_inside(const OffsetCurve& arc, const ToolSide& tool) {
  return tool.left == arc.counter_clockwise;
}

/// LinuxCNC's rule. With b the angle by which the contour turns away from the tool, in
/// [-π/2, 3π/2], and e = 0.05 rad: inside for b < -e and b > π + e, none for |b| <= e, outside
/// else. For b within e of π, a turn on the spot, the tool goes round, but inside when the arc
/// that begins there has the tool outside of it, or, before a line, when the arc that ends there
/// has.
/// Tests "corner: ...", "radius against rs274 ...".
Corner corner_between(const OffsetCurve& before, const OffsetCurve& next, const ToolSide& tool);

/// Where the curves of an inside corner meet; nothing: they do not. Of two points a line behind an
/// arc takes the first on its way when the tool is inside of the arc, else the last; a line before
/// an arc the other way round. Between arcs it is the point on the left of the way from the first
/// centre to the second when the tool is left of arcs of one sense, or right of arcs of opposite
/// sense; else the other.
std::optional<Vec2> inside_corner(const OffsetCurve& before, const OffsetCurve& next,
                                  const ToolSide& tool);

/// Angle from one point to another about a centre in the given sense, rad, above 0; points within
/// 1e-6 rad of each other are a whole turn apart, as in arc_by_centre().
double turn_between(const Vec2& centre, const Vec2& from, const Vec2& to, bool counter_clockwise);

}  // namespace smoothpost::nc
