#include "postproc/report/scene_mesh.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr std::uint32_t kSides = 24;
constexpr std::size_t kMostHull = 64;

TriangleMesh clustered(const TriangleMesh& mesh, const Vec3& low, double cell) {
  TriangleMesh out;
  std::unordered_map<std::uint64_t, std::uint32_t> index;
  std::vector<std::uint32_t> of(mesh.vertices.size());
  std::vector<double> count;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    std::uint64_t key = 0;
    for (int k = 0; k < 3; ++k) {
      const double at = std::floor((mesh.vertices[i][k] - low[k]) / cell);
      key = key << 21U | (static_cast<std::uint64_t>(std::max(at, 0.0)) & 0x1FFFFFU);
    }
    const auto [found, fresh] = index.emplace(key, static_cast<std::uint32_t>(out.vertices.size()));
    of[i] = found->second;
    if (fresh) {
      out.vertices.push_back(Vec3::Zero());
      count.push_back(0.0);
    }
    out.vertices[of[i]] += mesh.vertices[i];
    ++count[of[i]];
  }
  for (std::size_t i = 0; i < out.vertices.size(); ++i) out.vertices[i] /= count[i];
  for (const auto& t : mesh.triangles) {
    const std::array<std::uint32_t, 3> moved = {of[t[0]], of[t[1]], of[t[2]]};
    if (moved[0] != moved[1] && moved[1] != moved[2] && moved[0] != moved[2])
      out.triangles.push_back(moved);
  }
  return out;
}

void add_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c,
              std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

/// Rings about the line from `from` to `to`: at `along` (mm) of it with radius `radius`.
struct Ring {
  double along = 0.0, radius = 0.0;
};

TriangleMesh turned(const Body& body, const std::vector<Ring>& rings) {
  TriangleMesh mesh;
  const Vec3 way = body.to - body.from;
  const Vec3 axis = way.norm() > 0.0 ? Vec3(way.normalized()) : Vec3::UnitZ();
  const Vec3 u = axis.unitOrthogonal(), v = axis.cross(u);
  for (const Ring& ring : rings)
    for (std::uint32_t k = 0; k < kSides; ++k) {
      const double angle = 2.0 * kPi * k / kSides;
      mesh.vertices.push_back(body.from + ring.along * axis +
                              ring.radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
  for (std::uint32_t r = 0; r + 1 < rings.size(); ++r)
    for (std::uint32_t k = 0; k < kSides; ++k) {
      const std::uint32_t next = (k + 1) % kSides;
      add_quad(mesh, r * kSides + k, r * kSides + next, (r + 1) * kSides + next,
               (r + 1) * kSides + k);
    }
  const auto last = static_cast<std::uint32_t>(rings.size() - 1) * kSides;
  for (std::uint32_t k = 1; k + 1 < kSides; ++k) {
    mesh.triangles.push_back({0, k + 1, k});
    mesh.triangles.push_back({last, last + k, last + k + 1});
  }
  return mesh;
}

TriangleMesh capsule(const Body& body) {
  constexpr int kRings = 6;
  const double length = (body.to - body.from).norm();
  std::vector<Ring> rings;
  for (int k = 0; k <= kRings; ++k) {
    const double angle = 0.5 * kPi * k / kRings;
    rings.push_back({-body.radius_from * std::cos(angle), body.radius_from * std::sin(angle)});
  }
  for (int k = 0; k <= kRings; ++k) {
    const double angle = 0.5 * kPi * k / kRings;
    rings.push_back(
        {length + body.radius_from * std::sin(angle), body.radius_from * std::cos(angle)});
  }
  return turned(body, rings);
}

TriangleMesh box(const Vec3& a, const Vec3& b) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.vertices.emplace_back(k & 1 ? b.x() : a.x(), k & 2 ? b.y() : a.y(), k & 4 ? b.z() : a.z());
  add_quad(mesh, 0, 2, 3, 1);
  add_quad(mesh, 4, 5, 7, 6);
  add_quad(mesh, 0, 1, 5, 4);
  add_quad(mesh, 2, 6, 7, 3);
  add_quad(mesh, 0, 4, 6, 2);
  add_quad(mesh, 1, 3, 7, 5);
  return mesh;
}

/// Every three points with all others on one side are a facet's triangle.
TriangleMesh hull(const std::vector<Vec3>& points) {
  TriangleMesh mesh;
  Vec3 low = points.front(), high = low;
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if (points.size() > kMostHull) return box(low, high);
  const double flat = 1e-9 * (high - low).squaredNorm() * (high - low).norm();
  mesh.vertices = points;
  const auto n = static_cast<std::uint32_t>(points.size());
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t b = a + 1; b < n; ++b)
      for (std::uint32_t c = b + 1; c < n; ++c) {
        const Vec3 normal = (points[b] - points[a]).cross(points[c] - points[a]);
        double least = 0.0, most = 0.0;
        for (const Vec3& p : points) {
          least = std::min(least, normal.dot(p - points[a]));
          most = std::max(most, normal.dot(p - points[a]));
        }
        if (most <= flat && least < -flat) mesh.triangles.push_back({a, b, c});
        if (least >= -flat && most > flat) mesh.triangles.push_back({a, c, b});
      }
  return mesh;
}

}  // namespace

TriangleMesh decimated(const TriangleMesh& mesh, std::size_t most) {
  if (mesh.triangles.size() <= most || mesh.vertices.empty()) return mesh;
  Vec3 low = mesh.vertices.front(), high = low;
  for (const Vec3& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  double cell = std::max((high - low).maxCoeff() / 1024.0, 1e-12);
  TriangleMesh out = clustered(mesh, low, cell);
  for (int round = 0; round < 24 && out.triangles.size() > most; ++round)
    out = clustered(mesh, low, cell *= 1.35);
  return out;
}

TriangleMesh surface_of(const Body& body) {
  const double length = (body.to - body.from).norm();
  switch (body.shape) {
    case BodyShape::frustum:
    case BodyShape::cylinder:
      return turned(body, {{0.0, body.radius_from}, {length, body.radius_to}});
    case BodyShape::capsule:
      return capsule(body);
    case BodyShape::box:
      return box(body.from.cwiseMin(body.to), body.from.cwiseMax(body.to));
    case BodyShape::hull:
      return body.points.size() < 4 ? TriangleMesh{} : hull(body.points);
    case BodyShape::mesh:
      return body.mesh ? *body.mesh : TriangleMesh{};
  }
  return {};
}

}  // namespace smoothpost
