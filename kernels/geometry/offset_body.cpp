#include "kernels/geometry/offset_body.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr double kSmooth = 0.02;  // of the largest eigenvalue: normals that differ by about 16°

Vec3 normal_of(const TriangleMesh& mesh, std::size_t i) {
  const auto& t = mesh.triangles[i];
  const Vec3& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

/// Σ α n nᵀ and Σ α n over the faces of a vertex.
struct Planes {
  Mat3 square = Mat3::Zero();
  Vec3 sum = Vec3::Zero();
};

/// The shortest d with n·d = 1 for all planes, in the sense of least squares.
Vec3 unit_step(const Planes& planes) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(planes.square);
  const Vec3& values = eigen.eigenvalues();
  if (!(values[2] > 0.0)) return Vec3::Zero();
  Vec3 d = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    if (values[k] > kSmooth * values[2])
      d += eigen.eigenvectors().col(k) * (eigen.eigenvectors().col(k).dot(planes.sum) / values[k]);
  // Where only one direction counts the normals' mean is shorter than 1; the step is not.
  if (values[1] <= kSmooth * values[2] && d.norm() > 0.0) d.normalize();
  return d;
}

}  // namespace

OffsetBody offset_body(const OrientedSurface& surface, double distance) {
  require(std::isfinite(distance), "distance is not finite");
  const TriangleMesh& mesh = surface.mesh;
  std::vector<Planes> planes(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    Vec3 n = normal_of(mesh, i);
    if (!(n.norm() > 0.0)) continue;
    n.normalize();
    const auto& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]];
      const Vec3 b = mesh.vertices[t[(k + 2) % 3]] - mesh.vertices[t[k]];
      const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
      planes[t[k]].square += angle * n * n.transpose();
      planes[t[k]].sum += angle * n;
    }
  }
  OffsetBody out;
  out.mesh = mesh;
  std::vector<Vec3> step(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    step[v] = unit_step(planes[v]);
    out.mesh.vertices[v] += distance * step[v];
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vec3 before = normal_of(mesh, i);
    if (!(before.norm() > 0.0)) continue;
    if (!(before.dot(normal_of(out.mesh, i)) > 0.0)) {
      ++out.folded.count;
      if (out.folded.triangles.size() < MeshFinding::kNamed)
        out.folded.triangles.push_back(surface.triangle[i]);
    }
    for (const std::uint32_t v : mesh.triangles[i])
      out.largest_miss =
          std::max(out.largest_miss, std::abs(distance * (before.normalized().dot(step[v]) - 1.0)));
  }
  return out;
}

}  // namespace smoothpost
