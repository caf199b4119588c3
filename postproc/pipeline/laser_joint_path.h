#pragma once

#include <vector>

#include "kernels/core/joints.h"
#include "kernels/core/tool_path.h"
#include "kernels/kinematics/head_geometry.h"
#include "kernels/kinematics/joint_jet.h"
#include "kernels/spline/bspline_basis.h"

namespace smoothpost {

/// The joints along one stretch of a laser's cut, as a function of one parameter u: splines for
/// tip, rotaries and standoff, and the linear axes that follow from them. C⁴ between first() and
/// last(); the pieces of all three splines meet at breaks().
struct LaserJointPath {
  HeadGeometry head;     ///< with the tool on: head.tip is the tip of the beam
  SplineCurve tip;       ///< 3 components, mm, W
  SplineCurve rotary;    ///< 2 components, rad, unwound
  SplineCurve standoff;  ///< 1 component, mm
  JointVector held;      ///< joints that are none of the head's; those of the head do not matter
  double length = 0.0;   ///< mm, of the programmed tip's way

  double first() const { return rotary.knots.first(); }
  double last() const { return rotary.knots.last(); }
  /// u is this share of the programmed tip's way: the smoothed tip's own length is that up to its
  /// tolerance.
  double length_at(double u) const { return (u - first()) / (last() - first()) * length; }
  double parameter_at(double s) const { return first() + s / length * (last() - first()); }
  /// Where pieces begin and end, ascending, first() and last() among them.
  std::vector<double> breaks() const;

  /// The joints at u; every one below takes first() ≤ u ≤ last().   Cost: about 1 µs.
  JointVector joints(double u) const;
  /// Derivatives by u; mm or rad.
  JointJet jet(double u) const;
  /// Derivatives by u of the tip, mm, W.
  VectorJet tip_jet(double u) const;
  /// Tip and tool axis that the joints stand for.
  CutterLocation tool(double u) const;
};

/// The same component of a curve with its derivatives.
Jet jet_of(const SplineCurve& curve, int component, double u);

}  // namespace smoothpost
