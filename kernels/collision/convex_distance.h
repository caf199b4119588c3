#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "kernels/core/pose.h"

namespace smoothpost {

/// Distance of two convex sets A and B as far as it is known.
struct ConvexDistance {
  double lower = 0.0;           ///< proven by a separating plane: no two points are closer
  double upper = 0.0;           ///< |on_a − on_b|, to kConvexTouching
  Vec3 on_a = Vec3::Zero();     ///< a point of A
  Vec3 on_b = Vec3::Zero();     ///< a point of B
  Vec3 normal = Vec3::UnitZ();  ///< unit, from B to A, of the plane that proves `lower`
  bool overlap = false;         ///< a common point was found, to kConvexTouching: both bounds are 0
};

inline constexpr double kConvexTolerance = 1e-8;  ///< mm, where bounds have met
inline constexpr double kConvexTouching = 1e-9;   ///< mm, below which there is no direction

/// Corners of a simplex in the difference A − B with the points that they come from, and the
/// weights of the point of it that is closest to the origin.
class DifferenceSimplex {
 public:
  int size() const { return size_; }
  bool has(const Vec3& w) const {
    for (int i = 0; i < size_; ++i)
      if (corner_[static_cast<std::size_t>(i)].w == w) return true;
    return false;
  }
  void add(const Vec3& on_a, const Vec3& on_b) {
    corner_[static_cast<std::size_t>(size_++)] = {on_a - on_b, on_a, on_b, 0.0};
  }
  /// Keeps only the corners of the face that the closest point lies on. True when the simplex has
  /// four corners with the origin between them: the sets overlap.
  bool reduce();
  Vec3 closest() const {
    return sum([](const Corner& c) { return c.w; });
  }
  Vec3 on_a() const {
    return sum([](const Corner& c) { return c.on_a; });
  }
  Vec3 on_b() const {
    return sum([](const Corner& c) { return c.on_b; });
  }

 private:
  struct Corner {
    Vec3 w, on_a, on_b;
    double weight = 0.0;
  };
  template <class Get>
  Vec3 sum(Get get) const {
    Vec3 out = Vec3::Zero();
    for (int i = 0; i < size_; ++i) {
      const Corner& c = corner_[static_cast<std::size_t>(i)];
      out += c.weight * get(c);
    }
    return out;
  }
  void keep(const std::array<double, 4>& weights);
  bool hold_origin();
  std::array<double, 4> nearest_face(bool only_beyond) const;

  std::array<Corner, 4> corner_;
  int size_ = 0;
};

/// Weights of the corners a, b, c of a triangle (for |ab|: of a segment) at the point closest to
/// the origin, by the Voronoi regions of its corners and sides [Ericson2005] §5.1.2, §5.1.5.
std::array<double, 4> closest_weights(const Vec3& a, const Vec3& b);
std::array<double, 4> closest_weights(const Vec3& a, const Vec3& b, const Vec3& c);

/// Distance of two convex sets that are given by their support functions.
///
/// A::support(d) is the point of A that is farthest in direction d (any length but 0). With v the
/// point of a simplex in A − B that is closest to the origin, the support of A − B against v gives
/// the lower bound v·w/|v| for the whole sets; v itself is an upper bound. The simplex takes w in
/// and loses what is not needed, until the bounds meet [Gilbert1988].
///
/// Guarantees: lower ≤ distance ≤ upper to round-off, whatever the number of steps; on_a and on_b
/// lie in the sets (convex combinations of supports) and are `upper` apart. It ends when
/// upper − lower ≤ kConvexTolerance, when lower ≥ enough (then upper says little), on overlap, or
/// when round-off stops it.
/// Units: mm, one frame for both.   Cost: 3-20 supports of each; no allocation.
/// @param start  a guess of on_a − on_b; not 0
///
/// Implements [Gilbert1988], the lower bound being theirs of Eq. (3.4) (docs/references.bib).
template <class A, class B>
ConvexDistance convex_distance(const A& a, const B& b, const Vec3& start,
                               double enough = std::numeric_limits<double>::infinity()) {
  constexpr int kMaxSteps = 100;
  ConvexDistance out;
  out.upper = std::numeric_limits<double>::infinity();
  DifferenceSimplex simplex;
  Vec3 v = start;
  double length = v.norm();
  for (int step = 0; step < kMaxSteps; ++step) {
    const Vec3 on_a = a.support(-v);
    const Vec3 on_b = b.support(v);
    const Vec3 w = on_a - on_b;
    const double lower = v.dot(w) / length;
    if (lower > out.lower || step == 0) {
      out.normal = v / length;
      out.lower = std::max(lower, 0.0);
    }
    if (out.lower >= enough && step > 0) break;
    if (out.upper - out.lower <= kConvexTolerance || simplex.has(w)) break;
    const DifferenceSimplex before = simplex;
    simplex.add(on_a, on_b);
    if (simplex.reduce()) {
      out.overlap = true;
      break;
    }
    const Vec3 next = simplex.closest();
    const double next_length = next.norm();
    if (!(next_length < out.upper)) {
      simplex = before;
      break;
    }
    v = next;
    out.upper = length = next_length;
    if (length <= kConvexTouching) {
      out.overlap = true;
      break;
    }
  }
  if (out.overlap) out.upper = 0.0;
  out.lower = std::min(out.lower, out.upper);
  out.on_a = simplex.on_a();
  out.on_b = simplex.on_b();
  return out;
}

/// A point as a convex set.
struct PointSet {
  Vec3 at = Vec3::Zero();
  const Vec3& support(const Vec3&) const { return at; }
};

/// A convex set seen from another frame.
template <class Shape>
struct PosedSet {
  const Shape& shape;
  const Pose& pose;  ///< from the shape's frame to this one
  Vec3 support(const Vec3& direction) const {
    return pose * shape.support(pose.linear().transpose() * direction);
  }
};

/// Where a point is beside a convex set: the set lies behind the plane through
/// point − distance · normal, so that the distance of any y from it is at least
/// (y − point)·normal + distance. `normal` is arbitrary when distance = 0.
struct Projection {
  double distance = 0.0;        ///< 0 for points of the set
  Vec3 normal = Vec3::UnitZ();  ///< unit, out of the set
};

/// A triangle as a convex set.
struct TriangleSet {
  std::array<Vec3, 3> corner;
  const Vec3& support(const Vec3& direction) const {
    const double d0 = direction.dot(corner[0]);
    const double d1 = direction.dot(corner[1]);
    const double d2 = direction.dot(corner[2]);
    return corner[d0 >= d1 ? (d0 >= d2 ? 0U : 2U) : (d1 >= d2 ? 1U : 2U)];
  }
  Projection projection(const Vec3& point) const;
  double sweep() const { return 0.0; }
};

}  // namespace smoothpost
