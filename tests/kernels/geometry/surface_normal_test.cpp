#include "kernels/geometry/surface_normal.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/contract.h"
#include "tests/kernels/geometry/parts.h"

using namespace smoothpost;
using test::surface_of;
using Source = SurfaceSample::Source;

namespace {

struct Miss {
  double angle = 0.0, position = 0.0;  // largest, rad and mm
  int fitted = 0, asked = 0;
};

/// Largest error on an elliptic wall at 600 places between its rings, against the true ellipse.
Miss on_wall(const OrientedSurface& wall, const SurfaceNormals& normals, double a, double b, int nu,
             int nv) {
  Miss miss;
  for (int m = 0; m < 600; ++m) {
    const double f = std::fmod(0.618 * m, 1.0), g = 0.01 + std::fmod(0.377 * m, 0.98);
    const auto at = test::wall_place(wall, nv, m * nu / 600, nv / 2, f, g);
    const SurfaceSample s = normals.at(at.triangle, at.point);
    // Foot on the ellipse by Newton.
    double t = std::atan2(s.point.y() / b, s.point.x() / a);
    for (int i = 0; i < 30; ++i) {
      const Eigen::Vector2d p(a * std::cos(t), b * std::sin(t));
      const Eigen::Vector2d d(-a * std::sin(t), b * std::cos(t));
      const Eigen::Vector2d gap = p - s.point.head<2>();
      t -= gap.dot(d) / (d.squaredNorm() - gap.dot(p));
    }
    const Vec3 normal = Vec3(b * std::cos(t), a * std::sin(t), 0.0).normalized();
    miss.angle = std::max(miss.angle, angle_between(normal, s.normal));
    miss.position =
        std::max(miss.position,
                 (Eigen::Vector2d(a * std::cos(t), b * std::sin(t)) - s.point.head<2>()).norm());
    miss.fitted += s.source == Source::quadric;
    ++miss.asked;
  }
  return miss;
}

test::Soup with_noise(test::Soup soup, double sigma) {
  // The same shift for corners at one place.
  TriangleMesh mesh = weld(soup);
  std::mt19937 random(3);
  std::normal_distribution<double> shift(0.0, sigma);
  for (Vec3& v : mesh.vertices) v += Vec3(shift(random), shift(random), shift(random));
  soup.clear();
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) soup.push_back(mesh.vertices[v]);
  return soup;
}

}  // namespace

TEST_CASE("SurfaceNormals: cylinder walls as fine as the findings' table", "[kernels][geometry]") {
  SECTION("edges of 0.8 mm: quadric of one ring") {
    const OrientedSurface wall = surface_of(test::ellipse_wall(50, 35, 40, 384, 50));
    const Miss miss = on_wall(wall, SurfaceNormals(wall), 50, 35, 384, 50);
    CHECK(miss.fitted == miss.asked);
    CHECK(miss.angle < 0.15e-3);
    CHECK(miss.position < 0.1e-3);
  }
  SECTION("edges of 1.6 mm") {
    const OrientedSurface wall = surface_of(test::ellipse_wall(50, 35, 40, 192, 29));
    const Miss miss = on_wall(wall, SurfaceNormals(wall), 50, 35, 192, 29);
    CHECK(miss.fitted == miss.asked);
    CHECK(miss.angle < 0.45e-3);
    CHECK(miss.position < 0.5e-3);
  }
  SECTION("the wall of a prism of two rings: interpolated") {
    for (const int nu : {192, 384}) {
      const OrientedSurface wall = surface_of(test::ellipse_body(50, 35, 40, nu, 1));
      const Miss miss = on_wall(wall, SurfaceNormals(wall), 50, 35, nu, 1);
      CHECK(miss.fitted == 0);
      CHECK(miss.angle < (nu == 192 ? 0.3e-3 : 0.08e-3));
      CHECK(miss.position < (nu == 192 ? 7e-3 : 1.8e-3));  // of the chord, which stands
    }
  }
  SECTION("5 um of noise: two rings") {
    const OrientedSurface wall =
        surface_of(with_noise(test::ellipse_wall(50, 35, 40, 384, 50), 0.005));
    SurfaceNormalSettings settings;
    settings.rings = 2;
    settings.noise = 0.005;
    const Miss miss = on_wall(wall, SurfaceNormals(wall, settings), 50, 35, 384, 50);
    CHECK(miss.fitted == miss.asked);
    CHECK(miss.angle < 4e-3);
    // What such a mesh says of itself.
    const double told = SurfaceNormals(wall).typical_residual(2);
    CHECK(SurfaceNormals(wall).typical_residual(1) > 0.6 * told);
    CHECK(told > 0.002);
    CHECK(told < 0.008);
    const OrientedSurface exact = surface_of(test::ellipse_wall(50, 35, 40, 384, 50));
    CHECK(SurfaceNormals(exact).typical_residual(2) < 3e-4);
    CHECK(SurfaceNormals(exact).typical_residual(1) <
          0.4 * SurfaceNormals(exact).typical_residual(2));
  }
}

TEST_CASE("SurfaceNormals: ellipsoid", "[kernels][geometry]") {
  const auto point = [](double u, double v) {
    const double a = u == 1.0 ? 0.0 : 2.0 * kPi * u, b = 0.15 + (kPi - 0.3) * (1.0 - v);
    return Vec3(50 * std::sin(b) * std::cos(a), 40 * std::sin(b) * std::sin(a), 35 * std::cos(b));
  };
  const auto shell = surface_of(test::sheet(point, 200, 100));
  const SurfaceNormals normals(shell);
  double worst = 0.0, off = 0.0;
  for (std::uint32_t i = 40'0; i < 39'000; i += 97) {
    const auto& t = shell.mesh.triangles[i];
    if (i % 200 < 8 || i % 200 > 191) continue;  // the rims have half a ring
    const Vec3 middle =
        (shell.mesh.vertices[t[0]] + shell.mesh.vertices[t[1]] + shell.mesh.vertices[t[2]]) / 3.0;
    const SurfaceSample s = normals.at(i, middle);
    REQUIRE(s.source == Source::quadric);
    const Vec3 p = s.point;
    const Vec3 gradient(2 * p.x() / 2500, 2 * p.y() / 1600, 2 * p.z() / 1225);
    const double level = p.x() * p.x() / 2500 + p.y() * p.y() / 1600 + p.z() * p.z() / 1225 - 1.0;
    worst = std::max(worst, angle_between(gradient.normalized(), s.normal));
    off = std::max(off, std::abs(level) / gradient.norm());
  }
  CHECK(worst < 1.0e-3);
  CHECK(off < 0.5e-3);
}

TEST_CASE("SurfaceNormals: principal curvatures", "[kernels][geometry]") {
  const auto at_middle = [](const std::function<Vec3(double, double)>& f) {
    const OrientedSurface s = surface_of(test::sheet(f, 41, 41));
    const std::uint32_t k = 2 * (20 * 41 + 20);
    const auto& t = s.mesh.triangles[k];
    return SurfaceNormals(s).at(
        k, (s.mesh.vertices[t[0]] + s.mesh.vertices[t[1]] + s.mesh.vertices[t[2]]) / 3.0);
  };
  const auto graph = [](double xx, double yy) {
    return [=](double u, double v) {
      const double x = 10 * (u - 0.5), y = 10 * (v - 0.5);
      return Vec3(x, y, 0.5 * (xx * x * x + yy * y * y));
    };
  };
  const SurfaceSample saddle = at_middle(graph(0.05, -0.1));
  CHECK(saddle.curvature[0] == Approx(-0.1).epsilon(0.01));
  CHECK(saddle.curvature[1] == Approx(0.05).epsilon(0.01));
  const SurfaceSample hollow = at_middle(graph(0.04, 0.0));  // hollow on the normal's side
  CHECK(hollow.curvature[0] == Approx(0.0).margin(1e-4));
  CHECK(hollow.curvature[1] == Approx(0.04).epsilon(0.01));
}

TEST_CASE("SurfaceNormals: edges and planes keep their faces' normals", "[kernels][geometry]") {
  SECTION("a box up to its edges") {
    const OrientedSurface s = surface_of(test::box({0, 0, 0}, {10, 6, 4}));
    const SurfaceNormals normals(s);
    for (std::uint32_t i = 0; i < 12; ++i) {
      const auto& t = s.mesh.triangles[i];
      const Vec3 a = s.mesh.vertices[t[0]], b = s.mesh.vertices[t[1]], c = s.mesh.vertices[t[2]];
      const Vec3 face = (b - a).cross(c - a).normalized();
      for (const Vec3& p : {a, Vec3(0.5 * (a + b)), Vec3((a + b + c) / 3)}) {
        const SurfaceSample sample = normals.at(i, p);
        CHECK(angle_between(sample.normal, face) < 1e-12);
        CHECK((sample.point - p).norm() < 1e-9);
      }
    }
  }
  SECTION("a plane that passes into a round of 8 facets") {
    // Plane x in −30 … 0, then a quarter of a cylinder of radius 5, extruded 20 along z.
    const auto profile = [](double u) {
      const double s = 9.0 * u;
      if (s <= 1.0) return Vec3(-30.0 + 30.0 * s, 5.0, 0.0);
      const double a = 0.5 * kPi * (s - 1.0) / 8.0;
      return Vec3(5.0 * std::sin(a), 5.0 * std::cos(a), 0.0);
    };
    const OrientedSurface s = surface_of(test::sheet(
        [&](double u, double v) { return Vec3(profile(u) + Vec3(0, 0, -20.0 * v)); }, 9, 1));
    const SurfaceNormals normals(s);
    for (const double x : {-29.0, -15.0, -3.0, -0.1}) {
      const SurfaceSample sample = normals.at(x < -15.0 ? 1 : 0, Vec3(x, 5.0, -10.0));
      CHECK(angle_between(sample.normal, Vec3(0, 1, 0)) < 3e-3);
      CHECK((sample.point - Vec3(x, 5.0, -10.0)).norm() < 1e-3);
    }
  }
}

TEST_CASE("SurfaceNormals: what it asks for", "[kernels][geometry]") {
  const OrientedSurface s = surface_of(test::box({0, 0, 0}, {1, 1, 1}));
  const SurfaceNormals normals(s);
  CHECK_THROWS_AS(normals.at(12, Vec3::Zero()), ContractViolation);
  CHECK_THROWS_AS(normals.at(0, Vec3(NAN, 0, 0)), ContractViolation);
  SurfaceNormalSettings none;
  none.rings = 0;
  CHECK_THROWS_AS(SurfaceNormals(s, none), ContractViolation);
}
