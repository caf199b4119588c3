#pragma once

#include "kernels/geometry/oriented_surface.h"
#include "kernels/geometry/weld.h"
#include "tests/kernels/geometry/shapes.h"

// Parts for the finishing stage.
namespace smoothpost::test {

inline Vec3 on_ellipse(double a, double b, double t, double z = 0.0) {
  return {a * std::cos(t), b * std::sin(t), z};
}

/// Wall of an elliptic cylinder from z = 0 to `height`, without caps: `nu` cells around, `nv` up.
inline Soup ellipse_wall(double a, double b, double height, int nu, int nv) {
  return sheet(
      [=](double u, double v) {
        return on_ellipse(a, b, 2.0 * kPi * (u == 1.0 ? 0.0 : u), height * v);
      },
      nu, nv);
}

/// The same with caps: a fan of triangles around the middle, above and below.
inline Soup ellipse_body(double a, double b, double height, int nu, int nv) {
  Soup soup = ellipse_wall(a, b, height, nu, nv);
  for (int i = 0; i < nu; ++i) {
    const auto p = [&](int k, double z) {
      return on_ellipse(a, b, 2.0 * kPi * (double(k % nu) / nu), z);
    };
    for (const Vec3& c : {Vec3(0, 0, height), p(i, height), p(i + 1, height), Vec3(0, 0, 0),
                          p(i + 1, 0.0), p(i, 0.0)})
      soup.push_back(c);
  }
  return soup;
}

/// The prism from z = 0 to `height` on an outline that runs counter-clockwise and whose first point
/// sees all of it.
inline Soup prism(const std::vector<Vec3>& outline, double height) {
  Soup soup;
  const Vec3 up(0, 0, height);
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3& a = outline[i];
    const Vec3& b = outline[(i + 1) % n];
    for (const Vec3& c : {a, b, Vec3(b + up), a, Vec3(b + up), Vec3(a + up)}) soup.push_back(c);
    if (i == 0 || i + 1 == n) continue;
    for (const Vec3& c : {Vec3(outline[0] + up), Vec3(a + up), Vec3(b + up), outline[0], b, a})
      soup.push_back(c);
  }
  return soup;
}

inline Soup turned_over(Soup soup) {
  for (std::size_t i = 0; i < soup.size(); i += 3) std::swap(soup[i + 1], soup[i + 2]);
  return soup;
}

inline Soup together(std::initializer_list<Soup> soups) {
  Soup out;
  for (const Soup& soup : soups) out.insert(out.end(), soup.begin(), soup.end());
  return out;
}

inline OrientedSurface surface_of(const Soup& soup) { return orient_surface(weld(soup)); }

/// The triangle, and the point of it, where the wall's cell at (u, v) of ellipse_wall() is cut.
struct WallPlace {
  std::uint32_t triangle = 0;
  Vec3 point;
};
inline WallPlace wall_place(const OrientedSurface& wall, int nv, int i, int j, double f, double g) {
  const auto k = static_cast<std::uint32_t>(2 * (i * nv + j) + (f > g ? 0 : 1));
  const auto& t = wall.mesh.triangles[k];
  const Vec3 share = f > g ? Vec3(1 - f, f - g, g) : Vec3(1 - g, f, g - f);
  Vec3 p = Vec3::Zero();
  for (int c = 0; c < 3; ++c) p += share[c] * wall.mesh.vertices[t[static_cast<std::size_t>(c)]];
  return {k, p};
}

}  // namespace smoothpost::test
