#include "kernels/geometry/surface_normal.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr std::uint32_t kNone = OrientedSurface::kNone;
constexpr std::size_t kMostVertices = 400;  // of a fit
constexpr std::size_t kMostCoplanar = 64;   // faces of a fan that are compared with each other
constexpr double kSamePlane = 0.99996;      // cosine of half a degree
constexpr double kLargeFace = 2.0;          // times the smallest of a fan

Mat3 frame_of(const Vec3& normal) {
  Mat3 frame;
  frame.col(2) = normal;
  frame.col(0) = normal.unitOrthogonal();
  frame.col(1) = normal.cross(frame.col(0));
  return frame;
}

}  // namespace

SurfaceNormals::SurfaceNormals(const OrientedSurface& surface, SurfaceNormalSettings settings)
    : surface_(surface), settings_(settings) {
  require(settings.rings >= 1, "at least one ring of vertices");
  face_normal_.reserve(surface.mesh.triangles.size());
  for (const auto& t : surface.mesh.triangles) {
    const Vec3& a = surface.mesh.vertices[t[0]];
    const Vec3 n = (surface.mesh.vertices[t[1]] - a).cross(surface.mesh.vertices[t[2]] - a);
    const double size = n.norm();
    face_normal_.push_back(size > 0.0 ? Vec3(n / size) : Vec3::Zero());
  }
  make_fans();
  make_normals();
}

void SurfaceNormals::make_fans() {
  const auto& triangles = surface_.mesh.triangles;
  const std::size_t n = triangles.size();
  std::vector<std::uint32_t> parent(3 * n);
  std::iota(parent.begin(), parent.end(), std::uint32_t{0});
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto corner_at = [&](std::uint32_t t, std::uint32_t vertex) {
    std::uint32_t k = 0;
    while (k < 2 && triangles[t][k] != vertex) ++k;
    return 3 * t + k;
  };
  const double least_cosine = std::cos(settings_.crease);
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t j = surface_.neighbour[i][k];
      if (j == kNone || j < i) continue;
      const bool no_area = face_normal_[i].isZero() || face_normal_[j].isZero();
      if (!no_area && face_normal_[i].dot(face_normal_[j]) < least_cosine) continue;
      for (const std::uint32_t c : {k, (k + 1) % 3}) {
        const std::uint32_t a = root(3 * i + c);
        const std::uint32_t b = root(corner_at(j, triangles[i][c]));
        if (a != b) parent[std::max(a, b)] = std::min(a, b);
      }
    }
  std::vector<std::uint32_t> number(3 * n, kNone);
  fan_.resize(n);
  std::vector<std::uint32_t> count;
  for (std::uint32_t c = 0; c < 3 * n; ++c) {
    const std::uint32_t r = root(c);
    if (number[r] == kNone) {
      number[r] = static_cast<std::uint32_t>(fan_vertex_.size());
      fan_vertex_.push_back(triangles[c / 3][c % 3]);
      count.push_back(0);
    }
    fan_[c / 3][c % 3] = number[r];
    ++count[number[r]];
  }
  fan_first_.assign(fan_vertex_.size() + 1, 0);
  std::partial_sum(count.begin(), count.end(), fan_first_.begin() + 1);
  fan_triangle_.resize(3 * n);
  auto next = fan_first_;
  for (std::uint32_t c = 0; c < 3 * n; ++c) fan_triangle_[next[fan_[c / 3][c % 3]]++] = c / 3;
}

// Weights of the faces of a fan besides their angle.
std::vector<double> SurfaceNormals::face_weights(std::uint32_t first, std::uint32_t last) const {
  const std::size_t n = last - first;
  std::vector<double> area(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto& t = surface_.mesh.triangles[fan_triangle_[first + i]];
    const Vec3& a = surface_.mesh.vertices[t[0]];
    area[i] = (surface_.mesh.vertices[t[1]] - a).cross(surface_.mesh.vertices[t[2]] - a).norm();
  }
  std::vector<double> in_plane = area;
  for (std::size_t i = 0; i < n && n <= kMostCoplanar; ++i)
    for (std::size_t j = 0; j < n; ++j)
      if (j != i && face_normal_[fan_triangle_[first + i]].dot(
                        face_normal_[fan_triangle_[first + j]]) > kSamePlane)
        in_plane[i] += area[j];
  double least = 0.0;
  for (const double a : in_plane)
    if (a > 0.0 && (least == 0.0 || a < least)) least = a;
  for (double& a : in_plane) {
    const double ratio = least > 0.0 ? a / (kLargeFace * least) : 1.0;
    a = ratio > 1.0 ? ratio * ratio : 1.0;
  }
  return in_plane;
}

void SurfaceNormals::make_normals() {
  const auto& mesh = surface_.mesh;
  fan_normal_.assign(fan_vertex_.size(), Vec3::Zero());
  for (std::size_t f = 0; f < fan_vertex_.size(); ++f) {
    const std::vector<double> weights = face_weights(fan_first_[f], fan_first_[f + 1]);
    for (std::uint32_t i = fan_first_[f]; i < fan_first_[f + 1]; ++i) {
      const std::uint32_t triangle = fan_triangle_[i];
      const auto& t = mesh.triangles[triangle];
      std::size_t k = 0;
      while (k < 2 && t[k] != fan_vertex_[f]) ++k;
      const Vec3& p = mesh.vertices[t[k]];
      const Vec3 a = mesh.vertices[t[(k + 1) % 3]] - p;
      const Vec3 b = mesh.vertices[t[(k + 2) % 3]] - p;
      const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
      fan_normal_[f] += angle * weights[i - fan_first_[f]] * face_normal_[triangle];
    }
    const double size = fan_normal_[f].norm();
    if (size > 0.0) fan_normal_[f] /= size;
  }
}

Vec3 SurfaceNormals::interpolated(std::uint32_t triangle, const Vec3& point) const {
  const auto& t = surface_.mesh.triangles[triangle];
  const Vec3& a = surface_.mesh.vertices[t[0]];
  const Vec3 e = surface_.mesh.vertices[t[1]] - a;
  const Vec3 f = surface_.mesh.vertices[t[2]] - a;
  const Vec3 n = e.cross(f);
  const double square = n.squaredNorm();
  if (!(square > 0.0)) {
    const Vec3 sum = fan_normal_[fan_[triangle][0]] + fan_normal_[fan_[triangle][1]] +
                     fan_normal_[fan_[triangle][2]];
    return sum.norm() > 0.0 ? Vec3(sum.normalized()) : Vec3::UnitZ();
  }
  const Vec3 d = point - a;
  Vec3 share;
  share[1] = std::clamp(d.cross(f).dot(n) / square, 0.0, 1.0);
  share[2] = std::clamp(e.cross(d).dot(n) / square, 0.0, 1.0 - share[1]);
  share[0] = 1.0 - share[1] - share[2];
  Vec3 normal = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    normal += share[k] * fan_normal_[fan_[triangle][static_cast<std::size_t>(k)]];
  return normal.dot(face_normal_[triangle]) > 0.0 ? Vec3(normal.normalized())
                                                  : face_normal_[triangle];
}

// The vertices of the rings; with more than one ring all others too that are as near and hang
// together with them, so that more of them answer for the noise in every direction.
std::vector<std::uint32_t> SurfaceNormals::ring(std::uint32_t triangle, const Vec3& point,
                                                int rings) const {
  const auto square_to = [&](std::uint32_t fan) {
    return (surface_.mesh.vertices[fan_vertex_[fan]] - point).squaredNorm();
  };
  std::vector<std::uint32_t> fans(fan_[triangle].begin(), fan_[triangle].end());
  std::size_t from = 0;
  double radius = INFINITY;
  for (int r = 0; from < fans.size() && fans.size() < kMostVertices; ++r) {
    const std::size_t to = fans.size();
    if (r == rings) {
      if (rings == 1) break;
      radius = 0.0;
      for (const std::uint32_t f : fans) radius = std::max(radius, square_to(f));
    }
    for (std::size_t i = from; i < to && fans.size() < kMostVertices; ++i)
      for (std::uint32_t k = fan_first_[fans[i]]; k < fan_first_[fans[i] + 1]; ++k)
        for (const std::uint32_t f : fan_[fan_triangle_[k]])
          if (square_to(f) <= radius && std::find(fans.begin(), fans.end(), f) == fans.end())
            fans.push_back(f);
    from = to;
  }
  return fans;
}

SurfaceNormals::Fit SurfaceNormals::fit(std::uint32_t triangle, const Vec3& point,
                                        const Mat3& frame, int rings) const {
  using Row = Eigen::Matrix<double, 6, 1>;
  Fit out;
  const std::vector<std::uint32_t> fans = ring(triangle, point, rings);
  if (fans.size() < 6) return out;
  std::vector<Vec3> data;
  data.reserve(fans.size());
  for (const std::uint32_t f : fans) {
    data.push_back(frame.transpose() * (surface_.mesh.vertices[fan_vertex_[f]] - point));
    out.radius = std::max(out.radius, data.back().head<2>().norm());
  }
  if (!(out.radius > 0.0)) return out;
  const double h = out.radius;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Row right = Row::Zero();
  const auto row_of = [h](const Vec3& p) {
    const double x = p.x() / h;
    const double y = p.y() / h;
    Row row;
    row << 1.0, x, y, x * x, x * y, y * y;
    return row;
  };
  const auto weight_of = [h](const Vec3& p) {
    return std::exp(-p.head<2>().squaredNorm() / (h * h));
  };
  double weights = 0.0;
  for (const Vec3& p : data) {
    const Row row = row_of(p);
    const double w = weight_of(p);
    weights += w;
    normal += w * row * row.transpose();
    right += w * p.z() * row;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(normal,
                                                                         Eigen::EigenvaluesOnly);
  const double least = eigen.eigenvalues()[0];
  out.condition = least > 0.0 ? std::sqrt(eigen.eigenvalues()[5] / least) : INFINITY;
  if (!(out.condition <= settings_.condition)) return out;
  const Row c = normal.ldlt().solve(right);
  double square = 0.0;
  for (const Vec3& p : data) {
    const double miss = p.z() - c.dot(row_of(p));
    square += weight_of(p) * miss * miss;
  }
  out.residual = std::sqrt(square / weights);
  out.c << c[0], c[1] / h, c[2] / h, c[3] / (h * h), c[4] / (h * h), c[5] / (h * h);
  // Principal curvatures of the graph at (0, 0): shape operator, first fundamental form.
  Eigen::Matrix2d second;
  second << 2.0 * out.c[3], out.c[4], out.c[4], 2.0 * out.c[5];
  const Eigen::Vector2d slope(out.c[1], out.c[2]);
  const Eigen::Matrix2d first = Eigen::Matrix2d::Identity() + slope * slope.transpose();
  second /= std::sqrt(1.0 + slope.squaredNorm());
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> bend(second, first,
                                                                       Eigen::EigenvaluesOnly);
  out.curvature = {bend.eigenvalues()[0], bend.eigenvalues()[1]};
  const double most = std::max(std::abs(out.curvature[0]), std::abs(out.curvature[1]));
  out.good = h * most <= settings_.extent_share;
  return out;
}

SurfaceSample SurfaceNormals::at(std::uint32_t triangle, const Vec3& point) const {
  require(triangle < surface_.mesh.triangles.size(), "triangle out of range");
  require(point.allFinite(), "point is not finite");
  SurfaceSample out;
  out.point = point;
  out.normal = interpolated(triangle, point);
  out.source = out.normal == face_normal_[triangle] ? SurfaceSample::Source::face
                                                    : SurfaceSample::Source::interpolated;
  const Mat3 frame = frame_of(out.normal);
  const Fit found = fit(triangle, point, frame, settings_.rings);
  out.residual = found.residual;
  if (!found.good ||
      found.residual > settings_.residual_share * found.radius + 3.0 * settings_.noise)
    return out;
  out.source = SurfaceSample::Source::quadric;
  out.point = point + found.c[0] * frame.col(2);
  out.normal = frame * Vec3(-found.c[1], -found.c[2], 1.0).normalized();
  out.curvature = found.curvature;
  return out;
}

double SurfaceNormals::typical_residual(int rings, std::size_t count) const {
  const std::size_t n = surface_.mesh.triangles.size();
  std::vector<double> residuals;
  const std::size_t step = std::max<std::size_t>(1, n / std::max<std::size_t>(1, count));
  for (std::size_t i = 0; i < n; i += step) {
    const auto triangle = static_cast<std::uint32_t>(i);
    const auto& t = surface_.mesh.triangles[i];
    const Vec3 middle = (surface_.mesh.vertices[t[0]] + surface_.mesh.vertices[t[1]] +
                         surface_.mesh.vertices[t[2]]) /
                        3.0;
    const Fit found = fit(triangle, middle, frame_of(interpolated(triangle, middle)), rings);
    if (found.good) residuals.push_back(found.residual);
  }
  if (residuals.empty()) return 0.0;
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return *middle;
}

}  // namespace smoothpost
