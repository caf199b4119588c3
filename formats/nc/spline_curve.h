#pragma once

#include <cstddef>
#include <vector>

#include "kernels/core/pose.h"

namespace smoothpost::nc {

/// How far the straight pieces of a spline may be from it, mm.
inline constexpr double kSplineTolerance = 1e-3;

struct ControlPoint {
  Vec3 point = Vec3::Zero();  ///< mm
  double weight = 1.0;        ///< above 0
};

/// The control points of a rational Bézier curve of degree size - 1, or of a NURBS.
using ControlNet = std::vector<ControlPoint>;

/// The Bézier curves that a NURBS of the given order (degree + 1) with uniform clamped knots
/// 0, .., 0, 1, 2, .., n - order + 1, .. consists of, for its n control points.
/// @pre 2 <= order <= net.size()
std::vector<ControlNet> bezier_spans(const ControlNet& net, std::size_t order);

/// The ends of straight pieces that follow a rational Bézier curve within `tolerance`; the start is
/// left out, the last one is the curve's end. Empty: more than `most` pieces would be needed.
///
/// The curve is halved until ‖r''‖ / 8 <= tolerance with r'' bounded from the differences of its
/// homogeneous control points: ‖r'‖ <= (‖P'‖ + R·|w'|) / w, ‖r''‖ <= (‖P''‖ + 2·‖r'‖·|w'| +
/// R·|w''|) / w, where R is the reach of the control points from the first one and w the smallest
/// weight. Test "splines: no piece is farther from the curve than the tolerance".
std::vector<Vec3> follow_bezier(const ControlNet& net, double tolerance, std::size_t most);

}  // namespace smoothpost::nc
