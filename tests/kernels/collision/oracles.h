#pragma once

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "kernels/collision/collision_shape.h"
#include "kernels/core/pose.h"
#include "kernels/core/units.h"
#include "kernels/geometry/weld.h"
#include "tests/kernels/geometry/shapes.h"

// Bodies and distances by other ways than the library's: a body is the function that gives a
// point's distance from it, written down from the body's definition; distances of sets are found by
// one-dimensional searches, which cannot miss because a convex body's distance is a convex
// function.
#define NEEDS_TREE()                                  \
  if (!triangle_tree_available()) {                   \
    WARN("built without CGAL: nothing to test here"); \
    return;                                           \
  }

namespace smoothpost::test {

inline double uniform(std::mt19937& random, double lo, double hi) {
  return std::uniform_real_distribution<double>(lo, hi)(random);
}
inline Vec3 random_vector(std::mt19937& random, double size) {
  const double x = uniform(random, -size, size);
  const double y = uniform(random, -size, size);
  return {x, y, uniform(random, -size, size)};
}
inline Vec3 random_direction(std::mt19937& random) {
  for (;;) {
    const Vec3 v = random_vector(random, 1.0);
    if (v.norm() > 0.1 && v.norm() <= 1.0) return v.normalized();
  }
}
inline Pose random_pose(std::mt19937& random, double size) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_exp(uniform(random, 0.0, kPi) * random_direction(random));
  pose.translation() = random_vector(random, size);
  return pose;
}

using Distance = std::function<double(const Vec3&)>;

inline double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 d = b - a;
  if (d.squaredNorm() == 0.0) return (p - a).norm();
  return (p - a - std::clamp(d.dot(p - a) / d.squaredNorm(), 0.0, 1.0) * d).norm();
}

/// The projection in the plane if it is inside, else the nearest of the three sides.
inline double distance_to_triangle(const Vec3& p, const std::array<Vec3, 3>& t) {
  const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]);
  const Vec3 projection = p - n * (n.dot(p - t[0]) / n.squaredNorm());
  bool in = true;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& u = t[k];
    const Vec3& v = t[(k + 1) % 3];
    in = in && n.dot((v - u).cross(projection - u)) >= 0.0;
    best = std::min(best, distance_to_segment(p, u, v));
  }
  return in ? (p - projection).norm() : best;
}

/// A frustum is a stack of discs: in the half plane of a point, a trapezium.
inline Distance frustum_distance(const FrustumSize& f) {
  return [f](const Vec3& p) {
    const Vec3 axis = (f.to - f.from).normalized();
    const double height = (f.to - f.from).norm();
    const double z = axis.dot(p - f.from);
    const double r = (p - f.from - z * axis).norm();
    const double here = f.radius_from + (f.radius_to - f.radius_from) * z / height;
    if (z >= 0.0 && z <= height && r <= here) return 0.0;
    const Vec3 q(r, z, 0.0);
    const Vec3 low(f.radius_from, 0.0, 0.0);
    const Vec3 high(f.radius_to, height, 0.0);
    return std::min({distance_to_segment(q, {0, 0, 0}, low), distance_to_segment(q, low, high),
                     distance_to_segment(q, high, {0, height, 0})});
  };
}
inline Distance capsule_distance(const Vec3& from, const Vec3& to, double radius) {
  return [=](const Vec3& p) { return std::max(0.0, distance_to_segment(p, from, to) - radius); };
}
inline Distance box_distance(const Vec3& a, const Vec3& b) {
  return [=](const Vec3& p) {
    const Vec3 lo = a.cwiseMin(b);
    const Vec3 hi = a.cwiseMax(b);
    return (lo - p).cwiseMax(p - hi).cwiseMax(0.0).norm();
  };
}
inline Distance posed(Distance distance, const Pose& pose) {
  return [distance = std::move(distance), inverse = pose.inverse()](const Vec3& p) {
    return distance(inverse * p);
  };
}

/// A body in the library's form and by its definition, with points of its surface.
struct Body {
  CollisionShape shape;
  Distance distance;
  std::vector<Vec3> points;
};

inline Body frustum_body(const FrustumSize& f) {
  Body out{ConvexShape::frustum(f), frustum_distance(f), {}};
  const Vec3 axis = (f.to - f.from).normalized();
  const Vec3 u = axis.unitOrthogonal();
  for (int i = 0; i < 360; ++i)
    for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const double a = 2.0 * kPi * i / 360.0;
      const double r = f.radius_from + (f.radius_to - f.radius_from) * share;
      out.points.push_back(f.from + share * (f.to - f.from) +
                           r * (std::cos(a) * u + std::sin(a) * axis.cross(u)));
    }
  return out;
}
inline Body capsule_body(const Vec3& from, const Vec3& to, double radius) {
  Body out{ConvexShape::capsule(from, to, radius), capsule_distance(from, to, radius), {}};
  std::mt19937 random(99);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 d = random_direction(random);
    out.points.push_back((d.dot(to - from) > 0.0 ? to : from) + radius * d);
  }
  return out;
}
inline Body box_body(const Vec3& a, const Vec3& b) {
  Body out{ConvexShape::box(a, b), box_distance(a, b), {}};
  for (int i = 0; i < 8; ++i)
    out.points.push_back({i & 1 ? a.x() : b.x(), i & 2 ? a.y() : b.y(), i & 4 ? a.z() : b.z()});
  return out;
}
/// The box's corners, and points inside of it that a hull must drop.
inline Body hull_body(const Vec3& a, const Vec3& b) {
  Body out = box_body(a, b);
  auto points = out.points;
  points.insert(points.begin(), 0.5 * (a + b));
  points.push_back(0.25 * a + 0.75 * b);
  points.push_back(0.5 * (out.points[0] + out.points[1]));
  out.shape = ConvexShape::hull(points);
  return out;
}

inline Body random_body(std::mt19937& random, int kind) {
  const Vec3 a = random_vector(random, 20.0);
  const Vec3 b = a + random_direction(random) * uniform(random, 2.0, 40.0);
  const double r = uniform(random, 0.5, 15.0);
  switch (kind % 6) {
    case 0:
      return frustum_body({.from = a, .to = b, .radius_from = r, .radius_to = 2.0 * r});
    case 1:
      return frustum_body({.from = a, .to = b, .radius_from = r, .radius_to = r});
    case 2:
      return frustum_body({.from = a, .to = b, .radius_from = r, .radius_to = 0.0});
    case 3:
      return capsule_body(a, b, r);
    case 4:
      return box_body(a, a + random_vector(random, 20.0));
    default:
      return hull_body(a, a + random_vector(random, 20.0));
  }
}

/// Smallest value of a convex function on [lo, hi] by golden sections.
template <class Function>
double convex_minimum(const Function& f, double lo, double hi, int steps) {
  constexpr double kShare = 0.6180339887498949;
  double a = hi - kShare * (hi - lo);
  double b = lo + kShare * (hi - lo);
  double fa = f(a);
  double fb = f(b);
  double best = std::min({fa, fb, f(lo), f(hi)});
  for (int i = 0; i < steps; ++i) {
    if (fa <= fb) {
      hi = b;
      b = a;
      fb = fa;
      a = hi - kShare * (hi - lo);
      fa = f(a);
      best = std::min(best, fa);
    } else {
      lo = a;
      a = b;
      fa = fb;
      b = lo + kShare * (hi - lo);
      fb = f(b);
      best = std::min(best, fb);
    }
  }
  return best;
}

/// Distance of a triangle from a convex body by its definition.
inline double triangle_distance(const std::array<Vec3, 3>& t, const Distance& distance,
                                int steps = 42) {
  return convex_minimum(
      [&](double u) {
        return convex_minimum(
            [&](double v) {
              return distance(t[0] + u * (t[1] - t[0]) + v * (1.0 - u) * (t[2] - t[0]));
            },
            0.0, 1.0, steps);
      },
      0.0, 1.0, steps);
}

inline std::array<Vec3, 3> corners_of(const TriangleMesh& mesh, std::size_t i) {
  const auto& t = mesh.triangles[i];
  return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

/// Distance of a mesh's triangles with area from a convex body, triangle by triangle. A triangle
/// whose middle and size say that it is not the nearest is not measured.
inline double mesh_distance(const TriangleMesh& mesh, const Distance& distance) {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (has_no_area(mesh, i)) continue;
    const auto t = corners_of(mesh, i);
    const Vec3 middle = (t[0] + t[1] + t[2]) / 3.0;
    double size = 0.0;
    for (const Vec3& c : t) size = std::max(size, (c - middle).norm());
    order.emplace_back(distance(middle) - size, i);
  }
  std::sort(order.begin(), order.end());
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [lower, i] : order) {
    if (lower >= best) break;
    best = std::min(best, triangle_distance(corners_of(mesh, i), distance));
  }
  return best;
}

inline TriangleMesh random_triangles(std::mt19937& random, int count, double spread, double size) {
  Soup soup;
  for (int i = 0; i < count; ++i) {
    const Vec3 at = random_vector(random, spread);
    for (int k = 0; k < 3; ++k) soup.push_back(at + random_vector(random, size));
  }
  return weld(soup);
}

inline MeshShape mesh_of(const TriangleMesh& mesh) {
  auto shape = mesh_shape(mesh);
  REQUIRE(shape.ok());
  return shape.value();
}

}  // namespace smoothpost::test
