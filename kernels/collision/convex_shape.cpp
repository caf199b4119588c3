#include "kernels/collision/convex_shape.h"

#include <algorithm>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

/// Points as a convex set.
struct PointCloud {
  const std::vector<Vec3>& points;
  Vec3 support(const Vec3& direction) const {
    std::size_t best = 0;
    double farthest = direction.dot(points[0]);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const double d = direction.dot(points[i]);
      if (d <= farthest) continue;
      farthest = d;
      best = i;
    }
    return points[best];
  }
};

/// A start for the iteration that is never 0.
Vec3 towards(const Vec3& difference) {
  return difference.squaredNorm() > 0.0 ? difference : Vec3(Vec3::UnitX());
}

/// Drops the points that lie in the convex hull of the others.
std::vector<Vec3> corners_of(std::vector<Vec3> points, double size) {
  for (std::size_t i = points.size(); i-- > 0 && points.size() > 1;) {
    const Vec3 point = points[i];
    std::vector<Vec3> others = points;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const auto found =
        convex_distance(PointSet{point}, PointCloud{others}, towards(point - others[0]));
    if (found.upper <= 1e-13 * size || found.overlap) points = std::move(others);
  }
  return points;
}

}  // namespace

ConvexShape ConvexShape::revolved(const FrustumSize& size, double sweep) {
  ConvexShape shape;
  shape.kind_ = Kind::revolved;
  const Vec3 along = size.to - size.from;
  const double length = along.norm();
  const Vec3 axis = length > 0.0 ? Vec3(along / length) : Vec3(Vec3::UnitZ());
  const Vec3 across = axis.unitOrthogonal();
  shape.core_frame_.linear() << across, axis.cross(across), axis;
  shape.core_frame_.translation() = 0.5 * (size.from + size.to);
  shape.sweep_ = sweep;
  shape.half_length_ = 0.5 * length;
  shape.low_ = size.radius_from;
  shape.high_ = size.radius_to;
  const Eigen::Vector2d side(shape.high_ - shape.low_, length);
  shape.side_length_ = side.norm();
  if (shape.side_length_ > 0.0) shape.side_ = side / shape.side_length_;
  shape.balls_ = {{size.from, size.radius_from + sweep}, {size.to, size.radius_to + sweep}};
  return shape;
}

ConvexShape ConvexShape::frustum(const FrustumSize& size) {
  require(size.from.allFinite() && size.to.allFinite() && size.from != size.to,
          "two different ends");
  require(size.radius_from >= 0.0 && size.radius_to >= 0.0 &&
              size.radius_from + size.radius_to > 0.0 &&
              std::isfinite(size.radius_from + size.radius_to),
          "radii of at least 0, not both 0");
  return revolved(size, 0.0);
}

ConvexShape ConvexShape::capsule(const Vec3& from, const Vec3& to, double radius) {
  require(from.allFinite() && to.allFinite(), "finite ends");
  require(radius > 0.0 && std::isfinite(radius), "a radius above 0");
  return revolved({.from = from, .to = to}, radius);
}

ConvexShape ConvexShape::box(const Vec3& corner, const Vec3& opposite) {
  require(corner.allFinite() && opposite.allFinite() && corner != opposite,
          "two different corners");
  ConvexShape shape;
  shape.kind_ = Kind::box;
  shape.core_frame_.translation() = 0.5 * (corner + opposite);
  shape.half_ = 0.5 * (opposite - corner).cwiseAbs();
  for (int i = 0; i < 8; ++i)
    shape.balls_.push_back({Vec3((i & 1 ? corner : opposite).x(), (i & 2 ? corner : opposite).y(),
                                 (i & 4 ? corner : opposite).z()),
                            0.0});
  return shape;
}

ConvexShape ConvexShape::hull(const std::vector<Vec3>& points) {
  require(!points.empty(), "a hull needs a point");
  Vec3 lo = points[0];
  Vec3 hi = points[0];
  for (const Vec3& p : points) {
    require(p.allFinite(), "finite points");
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  ConvexShape shape;
  shape.kind_ = Kind::hull;
  shape.core_frame_.translation() = 0.5 * (lo + hi);
  std::vector<Vec3> centred;
  for (const Vec3& p : points) centred.push_back(p - shape.core_frame_.translation());
  shape.corners_ = corners_of(std::move(centred), (hi - lo).norm());
  for (const Vec3& p : shape.corners_)
    shape.balls_.push_back({p + shape.core_frame_.translation(), 0.0});
  return shape;
}

Vec3 ConvexShape::support_of_hull(const Vec3& direction) const {
  return PointCloud{corners_}.support(direction);
}

Projection ConvexShape::foot_on_revolved(const Vec3& point) const {
  const double radius = std::sqrt(point.x() * point.x() + point.y() * point.y());
  const double z = point.z();
  // In the half plane (radius, z): the trapezium between z = ∓half_length_ and the side.
  const double from_low = radius - low_;
  const double up = z + half_length_;
  const double outside = from_low * side_.y() - up * side_.x();
  const double along = from_low * side_.x() + up * side_.y();
  const auto radial = [&](double share, double axial) {
    return radius > 0.0 ? Vec3(point.x() / radius * share, point.y() / radius * share, axial)
                        : Vec3(share, 0.0, axial);
  };
  const bool above = z > half_length_;
  const bool below = z < -half_length_;
  if (!above && !below && outside <= 0.0) return {};
  if (above && radius <= high_) return {z - half_length_, Vec3::UnitZ()};
  if (below && radius <= low_) return {-half_length_ - z, -Vec3::UnitZ()};
  if (along > 0.0 && along < side_length_) return {outside, radial(side_.y(), -side_.x())};
  const bool at_low = along <= 0.0;
  const double dr = radius - (at_low ? low_ : high_);
  const double dz = z - (at_low ? -half_length_ : half_length_);
  const double distance = std::sqrt(dr * dr + dz * dz);
  if (distance <= 0.0) return {};
  return {distance, radial(dr / distance, dz / distance)};
}

Projection ConvexShape::foot_on_box(const Vec3& point) const {
  const Vec3 away = point - point.cwiseMax(-half_).cwiseMin(half_);
  const double distance = away.norm();
  if (distance <= 0.0) return {};
  return {distance, away / distance};
}

Projection ConvexShape::foot_on_hull(const Vec3& point) const {
  const auto found = convex_distance(PointSet{point}, PointCloud{corners_}, towards(point));
  return {found.lower, found.normal};
}

}  // namespace smoothpost
