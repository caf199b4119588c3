#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "kernels/core/pose.h"
#include "kernels/core/tool_path.h"
#include "kernels/core/units.h"

// Shapes for tests, as triangle soups: three corners per triangle, counter-clockwise from outside.
namespace smoothpost::test {

using Soup = std::vector<Vec3>;

inline Soup box(const Vec3& lo, const Vec3& hi) {
  const auto corner = [&](int i) {
    return Vec3(i & 1 ? hi.x() : lo.x(), i & 2 ? hi.y() : lo.y(), i & 4 ? hi.z() : lo.z());
  };
  constexpr std::array<std::array<int, 4>, 6> faces = {
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  Soup soup;
  for (const auto& f : faces)
    for (const int k : {0, 1, 2, 0, 2, 3}) soup.push_back(corner(f[static_cast<std::size_t>(k)]));
  return soup;
}

/// A sheet over the grid u, v ∈ [0, 1] with `nu` x `nv` cells; upper side where ∂u × ∂v points.
inline Soup sheet(const std::function<Vec3(double, double)>& at, int nu, int nv) {
  Soup soup;
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const auto p = [&](int di, int dj) { return at(double(i + di) / nu, double(j + dj) / nv); };
      for (const Vec3& corner : {p(0, 0), p(1, 0), p(1, 1), p(0, 0), p(1, 1), p(0, 1)})
        soup.push_back(corner);
    }
  return soup;
}

inline Soup sphere(const Vec3& centre, double radius, int n) {
  const auto at = [&](double u, double v) {
    // Seam and poles bit by bit the same, so that the sphere is closed.
    const double a = u == 1.0 ? 0.0 : 2.0 * kPi * u;
    if (v == 0.0 || v == 1.0) return Vec3(centre + radius * Vec3(0, 0, v == 0.0 ? -1 : 1));
    const double b = kPi * (1.0 - v);
    return Vec3(centre +
                radius * Vec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)));
  };
  return sheet(at, 2 * n, n);
}

/// A bowl: z = f(x, y) with normals in every direction around the vertical.
inline double bowl_height(double x, double y) {
  return 0.004 * (x * x + 1.5 * y * y) + 8.0 * std::sin(x / 31.0) + 5.0 * std::cos(y / 23.0);
}
inline Vec3 bowl_normal(double x, double y) {
  const double dx = 0.008 * x + 8.0 / 31.0 * std::cos(x / 31.0);
  const double dy = 0.012 * y - 5.0 / 23.0 * std::sin(y / 23.0);
  return Vec3(-dx, -dy, 1.0).normalized();
}
inline Soup bowl() {
  return sheet(
      [](double u, double v) {
        const double x = 160.0 * u - 60.0;
        const double y = 120.0 * v - 40.0;
        return Vec3(x, y, bowl_height(x, y));
      },
      160, 120);
}
/// A closed contour `gap` mm above the bowl, axis = normal.
inline std::vector<CutterLocation> contour_on_bowl(double gap, int n = 700) {
  std::vector<CutterLocation> points;
  for (int i = 0; i <= n; ++i) {
    const double a = 2.0 * kPi * i / n;
    const double x = 25.0 + 50.0 * std::cos(a) + 8.0 * std::cos(3.0 * a);
    const double y = 15.0 + 30.0 * std::sin(a) + 5.0 * std::sin(2.0 * a);
    const Vec3 normal = bowl_normal(x, y);
    points.push_back({Vec3(x, y, bowl_height(x, y)) + gap * normal, normal});
  }
  return points;
}

/// A strip of flat sheet with one bend (radius 25, 60 degrees) about y, extruded along y.
inline Vec3 bend_point(double s, double y, Vec3* normal = nullptr) {
  const double radius = 25.0;
  const double turn = kPi / 3.0;
  const double arc = radius * turn;
  const double a = std::clamp((s - 60.0) / radius, 0.0, turn);
  const double after = std::max(0.0, s - 60.0 - arc);
  const double before = std::min(s, 60.0);
  if (normal) *normal = Vec3(std::sin(a), 0.0, std::cos(a));
  return {before + radius * std::sin(a) + after * std::cos(a), y,
          -radius * (1.0 - std::cos(a)) - after * std::sin(a)};
}

}  // namespace smoothpost::test
