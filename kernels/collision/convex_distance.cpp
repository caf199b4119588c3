#include "kernels/collision/convex_distance.h"

namespace smoothpost {

namespace {

/// Three corners of a tetrahedron, and the fourth.
constexpr std::array<std::array<std::size_t, 4>, 4> kFaces = {
    {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}}};

double squared_at(const std::array<double, 4>& weights, const Vec3& a, const Vec3& b,
                  const Vec3& c) {
  return (weights[0] * a + weights[1] * b + weights[2] * c).squaredNorm();
}

/// True when the origin is not on the inner side of the plane of a, b, c, or when `inner` is so
/// near to that plane that it has no inner side.
bool beyond(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& inner) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ai = inner - a;
  const Vec3 n = ab.cross(ac);
  const double side = n.dot(ai);
  if (std::abs(side) <= 1e-12 * n.norm() * ai.norm()) return true;
  return -n.dot(a) * side <= 0.0;
}

/// Weights of the origin in a tetrahedron; some are negative when it is outside.
std::array<double, 4> weights_in(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ad = d - a;
  const double volume = ab.dot(ac.cross(ad));
  const double at_b = -a.dot(ac.cross(ad)) / volume;
  const double at_c = -ab.dot(a.cross(ad)) / volume;
  const double at_d = -ab.dot(ac.cross(a)) / volume;
  return {1.0 - at_b - at_c - at_d, at_b, at_c, at_d};
}

}  // namespace

std::array<double, 4> closest_weights(const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double along = -ab.dot(a);
  const double whole = ab.squaredNorm();
  if (along <= 0.0 || whole <= 0.0) return {1.0, 0.0, 0.0, 0.0};
  if (along >= whole) return {0.0, 1.0, 0.0, 0.0};
  const double share = along / whole;
  return {1.0 - share, share, 0.0, 0.0};
}

std::array<double, 4> closest_weights(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const double d1 = -ab.dot(a);
  const double d2 = -ac.dot(a);
  if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0, 0.0};
  const double d3 = -ab.dot(b);
  const double d4 = -ac.dot(b);
  if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0, 0.0};
  // Ericson's differences of products of dot products lose all digits on a triangle that is thin
  // against its distance, as simplices on round bodies are; the same areas by cross products do
  // not.
  const Vec3 n = ab.cross(ac);
  const double vc = n.dot(a.cross(b));
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double share = d1 / (d1 - d3);
    return {1.0 - share, share, 0.0, 0.0};
  }
  const double d5 = -ab.dot(c);
  const double d6 = -ac.dot(c);
  if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0, 0.0};
  const double vb = n.dot(c.cross(a));
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double share = d2 / (d2 - d6);
    return {1.0 - share, 0.0, share, 0.0};
  }
  const double va = n.dot(b.cross(c));
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0.0, 1.0 - share, share, 0.0};
  }
  const double whole = va + vb + vc;
  const double at_b = vb / whole;
  const double at_c = vc / whole;
  return {1.0 - at_b - at_c, at_b, at_c, 0.0};
}

void DifferenceSimplex::keep(const std::array<double, 4>& weights) {
  int kept = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(size_); ++i) {
    if (weights[i] <= 0.0) continue;
    corner_[static_cast<std::size_t>(kept)] = corner_[i];
    corner_[static_cast<std::size_t>(kept++)].weight = weights[i];
  }
  size_ = kept;
}

bool DifferenceSimplex::reduce() {
  const auto& p = corner_;
  switch (size_) {
    case 1:
      keep({1.0, 0.0, 0.0, 0.0});
      return false;
    case 2:
      keep(closest_weights(p[0].w, p[1].w));
      return false;
    case 3:
      keep(closest_weights(p[0].w, p[1].w, p[2].w));
      return false;
    default:
      break;
  }
  bool outside = false;
  for (const auto& f : kFaces)
    outside = outside || beyond(p[f[0]].w, p[f[1]].w, p[f[2]].w, p[f[3]].w);
  if (!outside && hold_origin()) return true;
  keep(nearest_face(outside));
  return false;
}

bool DifferenceSimplex::hold_origin() {
  const auto weights = weights_in(corner_[0].w, corner_[1].w, corner_[2].w, corner_[3].w);
  for (const double w : weights)
    if (!(w >= 0.0)) return false;
  DifferenceSimplex held = *this;
  held.keep(weights);
  // In a tetrahedron without thickness the signs of four planes may be those of an inner point by
  // round-off alone: the common point has to be one.
  if (held.closest().norm() > kConvexTouching) return false;
  *this = held;
  return true;
}

std::array<double, 4> DifferenceSimplex::nearest_face(bool only_beyond) const {
  double best = std::numeric_limits<double>::infinity();
  std::array<double, 4> weights{};
  for (const auto& f : kFaces) {
    const Vec3& a = corner_[f[0]].w;
    const Vec3& b = corner_[f[1]].w;
    const Vec3& c = corner_[f[2]].w;
    if (only_beyond && !beyond(a, b, c, corner_[f[3]].w)) continue;
    const auto on_face = closest_weights(a, b, c);
    const double squared = squared_at(on_face, a, b, c);
    if (squared >= best) continue;
    best = squared;
    weights = {};
    for (std::size_t k = 0; k < 3; ++k) weights[f[k]] = on_face[k];
  }
  return weights;
}

Projection TriangleSet::projection(const Vec3& point) const {
  const auto w = closest_weights(corner[0] - point, corner[1] - point, corner[2] - point);
  const Vec3 away = point - (w[0] * corner[0] + w[1] * corner[1] + w[2] * corner[2]);
  const double distance = away.norm();
  if (distance <= 0.0) return {};
  return {distance, away / distance};
}

}  // namespace smoothpost
