#include "kernels/geometry/refine_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr std::uint32_t kNone = OrientedSurface::kNone;
constexpr double kAlike = 0.96;     // cosine of two normals (16°) of one surface
constexpr double kMostShare = 0.2;  // of a side's length: its middle moves no farther

/// A level of the refinement: the surface so far, and of each triangle the input's that it is of.
class Refiner {
 public:
  Refiner(const OrientedSurface& surface, const SurfaceNormals& normals,
          const RefineSettings& settings)
      : input_(surface), normals_(normals), settings_(settings), now_(surface) {
    origin_.resize(surface.mesh.triangles.size());
    std::iota(origin_.begin(), origin_.end(), std::uint32_t{0});
  }

  OrientedSurface run() {
    for (int level = 0; level < settings_.most_levels; ++level)
      if (!halve_sides()) break;
    OrientedSurface out = std::move(now_);
    for (std::size_t i = 0; i < origin_.size(); ++i) out.triangle[i] = input_.triangle[origin_[i]];
    return out;
  }

 private:
  const Vec3& corner(std::size_t triangle, std::size_t k) const {
    return now_.mesh.vertices[now_.mesh.triangles[triangle][k % 3]];
  }
  Vec3 face(std::size_t triangle) const {
    const Vec3 n = (corner(triangle, 1) - corner(triangle, 0))
                       .cross(corner(triangle, 2) - corner(triangle, 0));
    const double length = n.norm();
    return length > 0.0 ? Vec3(n / length) : Vec3::Zero();
  }

  // The faces around a side bend by at most that, rad: a bound of what it can be off.
  double bend(std::size_t triangle) const {
    double most = 0.0;
    const Vec3 n = face(triangle);
    for (const std::uint32_t other : now_.neighbour[triangle]) {
      if (other == kNone) continue;
      const double angle = angle_between(n, face(other));
      if (angle <= normals_.settings().crease) most = std::max(most, angle);
    }
    return most;
  }

  // By which the middle of a side has to move: nothing where that is little.
  Vec3 move_of(std::size_t triangle, std::size_t k) const {
    const Vec3 a = corner(triangle, k), b = corner(triangle, k + 1);
    const Vec3 middle = 0.5 * (a + b);
    std::array<Vec3, 2> normal;
    std::array<double, 2> off{};
    std::size_t sides = 0;
    for (const std::uint32_t t :
         {static_cast<std::uint32_t>(triangle), now_.neighbour[triangle][k]}) {
      if (t == kNone) continue;
      const SurfaceSample at = normals_.at(origin_[t], middle);
      normal[sides] = at.normal;
      off[sides] = (at.point - middle).dot(at.normal);
      ++sides;
    }
    Vec3 d = off[0] * normal[0];
    if (sides == 2) {
      const double c = normal[0].dot(normal[1]);
      if (c > kAlike)
        d = 0.5 * (off[0] + off[1]) * (normal[0] + normal[1]).normalized();
      else
        d = ((off[0] - c * off[1]) * normal[0] + (off[1] - c * off[0]) * normal[1]) /
            std::max(1.0 - c * c, 1.0 - kAlike * kAlike);
    }
    if (d.norm() <= settings_.tolerance || d.norm() > kMostShare * (b - a).norm())
      return Vec3::Zero();
    return d;
  }

  // False: nothing left to halve.
  bool halve_sides() {
    const std::size_t n = now_.mesh.triangles.size();
    std::vector<double> bend_of(n);
    for (std::size_t i = 0; i < n; ++i) bend_of[i] = bend(i);
    std::vector<std::array<std::uint32_t, 3>> middle(n, {kNone, kNone, kNone});
    TriangleMesh mesh = now_.mesh;
    std::size_t halved = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t other = now_.neighbour[i][k];
        if (other != kNone && other < i) continue;  // looked at from there
        const double most = std::max(bend_of[i], other == kNone ? 0.0 : bend_of[other]);
        if (0.5 * most * (corner(i, k) - corner(i, k + 1)).norm() <= settings_.tolerance) continue;
        const Vec3 d = move_of(i, k);
        if (d.isZero()) continue;
        middle[i][k] = static_cast<std::uint32_t>(mesh.vertices.size());
        if (other != kNone)
          for (std::size_t m = 0; m < 3; ++m)
            if (now_.neighbour[other][m] == i &&
                now_.mesh.triangles[other][m] == now_.mesh.triangles[i][(k + 1) % 3] &&
                now_.mesh.triangles[other][(m + 1) % 3] == now_.mesh.triangles[i][k])
              middle[other][m] = middle[i][k];
        mesh.vertices.push_back(0.5 * (corner(i, k) + corner(i, k + 1)) + d);
        ++halved;
      }
    if (halved == 0 || n + 2 * halved > settings_.most_triangles) return false;
    divide(middle, mesh);
    return true;
  }

  void divide(const std::vector<std::array<std::uint32_t, 3>>& middle, TriangleMesh& mesh) {
    std::vector<std::uint32_t> origin;
    mesh.triangles.clear();
    for (std::size_t i = 0; i < middle.size(); ++i) {
      const std::size_t before = mesh.triangles.size();
      add_parts(now_.mesh.triangles[i], middle[i], mesh);
      origin.insert(origin.end(), mesh.triangles.size() - before, origin_[i]);
    }
    now_ = orient_surface(mesh);
    origin_.resize(now_.triangle.size());
    for (std::size_t i = 0; i < origin_.size(); ++i) origin_[i] = origin[now_.triangle[i]];
  }

  static void add_parts(const std::array<std::uint32_t, 3>& t,
                        const std::array<std::uint32_t, 3>& m, TriangleMesh& mesh) {
    const auto count =
        std::count_if(m.begin(), m.end(), [](std::uint32_t v) { return v != kNone; });
    auto& out = mesh.triangles;
    if (count == 0) {
      out.push_back(t);
    } else if (count == 3) {
      out.push_back({t[0], m[0], m[2]});
      out.push_back({m[0], t[1], m[1]});
      out.push_back({m[2], m[1], t[2]});
      out.push_back({m[0], m[1], m[2]});
    } else {
      // Turned so that side 0 is halved, and with two of them side 2 is not.
      std::size_t r = 0;
      while (m[r] == kNone || (count == 2 && m[(r + 2) % 3] != kNone)) ++r;
      const std::uint32_t a = t[r], b = t[(r + 1) % 3], c = t[(r + 2) % 3], ab = m[r],
                          bc = m[(r + 1) % 3];
      if (count == 1) {
        out.push_back({a, ab, c});
        out.push_back({ab, b, c});
      } else {
        out.push_back({ab, b, bc});
        out.push_back({a, ab, c});
        out.push_back({ab, bc, c});
      }
    }
  }

  const OrientedSurface& input_;
  const SurfaceNormals& normals_;
  const RefineSettings& settings_;
  OrientedSurface now_;
  std::vector<std::uint32_t> origin_;
};

}  // namespace

OrientedSurface refine_surface(const OrientedSurface& surface, const SurfaceNormals& normals,
                               const RefineSettings& settings) {
  require(settings.tolerance > 0.0, "tolerance > 0");
  return Refiner(surface, normals, settings).run();
}

}  // namespace smoothpost
