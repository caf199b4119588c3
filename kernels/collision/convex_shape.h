#pragma once

#include <vector>

#include "kernels/collision/convex_distance.h"
#include "kernels/core/pose.h"

namespace smoothpost {

/// mm
struct Ball {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;
};

/// Circular cone, cut flat at both ends; equal radii: a cylinder.
struct FrustumSize {
  Vec3 from = Vec3::Zero();  ///< ends of the centre line, mm
  Vec3 to = Vec3::Zero();
  double radius_from = 0.0;  ///< mm
  double radius_to = 0.0;
};

/// A convex body as it is, round where it is round: no polygon stands for a circle.
///
/// It is a core, swept by a ball: core + {x : |x| ≤ sweep}. Core and sweep are: frustum and
/// cylinder: itself, 0; capsule: its centre line, its radius; box, hull: itself, 0. The core is
/// kept in a frame of its own (origin at the centre, centre line along z, sides of a box along the
/// axes).
///
/// Guarantees (tests): support() is the farthest of densely sampled points of the body;
/// projection() is their distance; every point lies in the convex hull of balls().
/// Units: mm.   Cost: support and projection of round bodies and boxes 5-15 ns; of hulls linear in
/// the corners. No allocation but at construction.
class ConvexShape {
 public:
  /// @pre finite; from ≠ to; radii ≥ 0, not both 0   @throws ContractViolation if not.
  static ConvexShape frustum(const FrustumSize& size);
  /// @pre finite, radius > 0; from = to: a ball   @throws ContractViolation if not.
  static ConvexShape capsule(const Vec3& from, const Vec3& to, double radius);
  /// Sides along the axes.   @pre finite, corners differ   @throws ContractViolation if not.
  static ConvexShape box(const Vec3& corner, const Vec3& opposite);
  /// Convex hull; points that add nothing to it are dropped. Cost: points² · corners.
  /// @pre at least one point, finite   @throws ContractViolation if not.
  static ConvexShape hull(const std::vector<Vec3>& points);

  /// X_BC: from the core's frame to the frame that the body was given in.
  const Pose& core_frame() const { return core_frame_; }
  double sweep() const { return sweep_; }
  /// Point of the core that is farthest in `direction` (not 0), in the core's frame.
  Vec3 support(const Vec3& direction) const;
  /// Of the core, in the core's frame.
  Projection projection(const Vec3& point) const;
  /// Balls whose convex hull contains the body (with its sweep), in the frame that it was given in.
  const std::vector<Ball>& balls() const { return balls_; }
  /// Corners of a hull, in the core's frame; empty for other bodies.
  const std::vector<Vec3>& corners() const { return corners_; }

 private:
  enum class Kind { revolved, box, hull };
  ConvexShape() = default;
  static ConvexShape revolved(const FrustumSize& size, double sweep);
  Vec3 support_of_hull(const Vec3& direction) const;
  Projection foot_on_revolved(const Vec3& point) const;
  Projection foot_on_box(const Vec3& point) const;
  Projection foot_on_hull(const Vec3& point) const;

  Kind kind_ = Kind::box;
  Pose core_frame_ = Pose::Identity();
  double sweep_ = 0.0;
  double half_length_ = 0.0;           // revolved: along z
  double low_ = 0.0, high_ = 0.0;      // revolved: radii at −half_length_ and half_length_
  Eigen::Vector2d side_ = {0.0, 1.0};  // revolved: unit along the side, (radius, z)
  double side_length_ = 0.0;
  Vec3 half_ = Vec3::Zero();   // box
  std::vector<Vec3> corners_;  // hull
  std::vector<Ball> balls_;
};

inline Vec3 ConvexShape::support(const Vec3& direction) const {
  switch (kind_) {
    case Kind::revolved: {
      const double radial =
          std::sqrt(direction.x() * direction.x() + direction.y() * direction.y());
      const double above = high_ * radial + half_length_ * direction.z();
      const double below = low_ * radial - half_length_ * direction.z();
      const bool top = above >= below;
      const double share = radial > 0.0 ? (top ? high_ : low_) / radial : 0.0;
      return {share * direction.x(), share * direction.y(), top ? half_length_ : -half_length_};
    }
    case Kind::box:
      return {direction.x() < 0.0 ? -half_.x() : half_.x(),
              direction.y() < 0.0 ? -half_.y() : half_.y(),
              direction.z() < 0.0 ? -half_.z() : half_.z()};
    default:
      return support_of_hull(direction);
  }
}

inline Projection ConvexShape::projection(const Vec3& point) const {
  switch (kind_) {
    case Kind::revolved:
      return foot_on_revolved(point);
    case Kind::box:
      return foot_on_box(point);
    default:
      return foot_on_hull(point);
  }
}

}  // namespace smoothpost
