#include "kernels/geometry/oriented_surface.h"

#include <catch2/catch.hpp>
#include <map>
#include <random>

#include "kernels/core/contract.h"
#include "tests/kernels/geometry/parts.h"

using namespace smoothpost;
using test::box;
using test::surface_of;
using test::together;
using test::turned_over;

namespace {

constexpr std::uint32_t kNone = OrientedSurface::kNone;

/// The definition: every directed side at most once, neighbours mutual and against each other.
void check_surface(const OrientedSurface& s) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> sides;
  std::size_t open = 0;
  for (std::uint32_t i = 0; i < s.mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& t = s.mesh.triangles[i];
      REQUIRE(sides.emplace(std::pair{t[k], t[(k + 1) % 3]}, i).second);
    }
  for (std::uint32_t i = 0; i < s.mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& t = s.mesh.triangles[i];
      const auto across = sides.find({t[(k + 1) % 3], t[k]});
      open += across == sides.end();
      REQUIRE(s.neighbour[i][k] == (across == sides.end() ? kNone : across->second));
    }
  CHECK(open == s.open_sides);
}

}  // namespace

TEST_CASE("orient_surface: a consistent closed mesh passes unchanged", "[kernels][geometry]") {
  const TriangleMesh mesh = weld(test::sphere(Vec3(1, 2, 3), 10.0, 12));
  const OrientedSurface s = orient_surface(mesh);
  check_surface(s);
  // The poles' cells have triangles with two equal corners.
  CHECK(s.dropped == describe(mesh).degenerate.count);
  CHECK(s.turned == 0);
  CHECK(s.open_sides == 0);
  for (std::size_t i = 0; i < s.triangle.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(s.mesh.vertices[s.mesh.triangles[i][k]] ==
            mesh.vertices[mesh.triangles[s.triangle[i]][k]]);
}

TEST_CASE("orient_surface: a minority of triangles is turned", "[kernels][geometry]") {
  test::Soup soup = test::ellipse_body(20, 12, 10, 24, 5);
  const double volume = describe(weld(soup)).signed_volume;
  std::mt19937 random(5);
  std::size_t turned = 0;
  for (std::size_t i = 0; i < soup.size(); i += 3)
    if (random() % 4 == 0) {
      std::swap(soup[i + 1], soup[i + 2]);
      ++turned;
    }
  REQUIRE(turned > 20);
  const OrientedSurface s = surface_of(soup);
  check_surface(s);
  CHECK(s.turned == turned);
  CHECK(s.open_sides == 0);
  CHECK(describe(s.mesh).signed_volume == Approx(volume));
}

TEST_CASE("orient_surface: bodies that touch stay two bodies", "[kernels][geometry]") {
  SECTION("in an edge") {
    const OrientedSurface s =
        surface_of(together({box({0, 0, 0}, {1, 1, 1}), box({1, 1, 0}, {2, 2, 1})}));
    check_surface(s);
    CHECK(s.open_sides == 0);
    CHECK(s.mesh.vertices.size() == 16);
    CHECK(describe(s.mesh).components == 2);
  }
  SECTION("in a vertex") {
    const OrientedSurface s =
        surface_of(together({box({0, 0, 0}, {1, 1, 1}), box({1, 1, 1}, {2, 2, 2})}));
    check_surface(s);
    CHECK(s.open_sides == 0);
    CHECK(describe(s.mesh).components == 2);
  }
  SECTION("in a face: they are one") {
    test::Soup second = box({1, 0, 0}, {2, 1, 1});
    // The same diagonal in the common face as the first box has.
    const test::Soup first = box({0, 0, 0}, {1, 1, 1});
    test::Soup soup = first;
    for (std::size_t i = 0; i < second.size(); i += 3) {
      const bool common = second[i].x() == 1 && second[i + 1].x() == 1 && second[i + 2].x() == 1;
      if (!common) soup.insert(soup.end(), second.begin() + long(i), second.begin() + long(i) + 3);
    }
    for (std::size_t i = 0; i < first.size(); i += 3)
      if (first[i].x() == 1 && first[i + 1].x() == 1 && first[i + 2].x() == 1)
        for (const std::size_t k : {0UL, 2UL, 1UL}) soup.push_back(first[i + k]);
    const OrientedSurface s = surface_of(soup);
    check_surface(s);
    CHECK(s.dropped == 4);
    CHECK(s.open_sides == 0);
    CHECK(describe(s.mesh).signed_volume == Approx(2.0));
  }
}

TEST_CASE("orient_surface: a Moebius band is cut open once", "[kernels][geometry]") {
  const test::Soup band = test::sheet(
      [](double u, double v) {
        const double a = 2.0 * kPi * u, w = 4.0 * (v - 0.5);
        if (u == 1.0) return Vec3(10.0 - w, 0.0, 0.0);
        return Vec3((10.0 + w * std::cos(a / 2)) * std::cos(a),
                    (10.0 + w * std::cos(a / 2)) * std::sin(a), w * std::sin(a / 2));
      },
      40, 2);
  const OrientedSurface s = surface_of(band);
  check_surface(s);
  CHECK(s.open_sides == 80 + 2 * 2);  // two rims and the cut
}

TEST_CASE("orient_surface: any soup becomes a surface", "[kernels][geometry][property]") {
  std::mt19937 random(11);
  for (int round = 0; round < 300; ++round) {
    TriangleMesh mesh;
    const std::uint32_t vertices = 4 + random() % 6;
    std::uniform_real_distribution<double> place(-1, 1);
    for (std::uint32_t v = 0; v < vertices; ++v)
      mesh.vertices.push_back(Vec3(place(random), place(random), place(random)));
    for (int i = 0; i < 14; ++i)
      mesh.triangles.push_back({std::uint32_t(random() % vertices),
                                std::uint32_t(random() % vertices),
                                std::uint32_t(random() % vertices)});
    check_surface(orient_surface(mesh));
  }
  TriangleMesh bad;
  bad.triangles.push_back({0, 1, 2});
  CHECK_THROWS_AS(orient_surface(bad), ContractViolation);
}
