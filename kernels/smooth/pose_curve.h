#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "kernels/smooth/corner_path.h"
#include "kernels/spline/bspline_basis.h"

namespace smoothpost {

/// A path in tip position and tool rotation over one parameter σ (mm): a quintic spline of seven
/// components, three of the tip (mm) and four of a quaternion (w, x, y, z) that is normalised where
/// it is read. C⁴ at simple knots. Spans are counted from 0, x is σ from a span's start.
///
/// Immutable; any number of threads may read it. Memory: 400 bytes a span.
class PoseCurve {
 public:
  /// Cost: linear in the spans.
  /// @pre seven rows, degree 5, clamped, simple inner knots; the quaternion never shorter than 0.5
  /// @throws ContractViolation if not.
  explicit PoseCurve(const SplineCurve& spline);

  std::size_t spans() const { return spans_.size(); }
  /// Extent of a span in σ, mm.
  double length(std::size_t span) const { return spans_[span].length; }
  Pose at(std::size_t span, double x) const;
  /// Value and derivatives by σ; the rotation's are those of the unit quaternion.
  /// Guarantee (test): equals central differences.
  PoseDerivatives derivatives(std::size_t span, double x) const;
  /// Bounds of |d²tip/dσ²| (1/mm) and of |d²axis/dσ²| (1/mm²) on a span, of any axis fixed in the
  /// tool, by the convex hull of the derivatives' control points.
  CornerPath::Bend bend_bound(std::size_t span) const { return spans_[span].bend; }

 private:
  using Components = Eigen::Matrix<double, 7, 1>;
  struct Span {
    double length = 0.0;
    Eigen::Matrix<double, 7, 6> powers;  ///< of x
    CornerPath::Bend bend;
  };
  std::vector<Span> spans_;
};

}  // namespace smoothpost
