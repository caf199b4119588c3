#include "kernels/geometry/slicing.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <random>

#include "formats/mesh/stl_reader.h"
#include "kernels/core/contract.h"
#include "kernels/geometry/triangle_tree.h"
#include "tests/kernels/geometry/parts.h"
#include "tests/support/support.h"

using namespace smoothpost;
using test::box;
using test::surface_of;
using test::together;

namespace {

std::vector<SliceLayer> layers_of(const OrientedSurface& surface, const SliceSettings& settings) {
  auto sliced = slice_surface(surface, settings);
  REQUIRE(sliced.ok());
  return std::move(sliced.value());
}

SliceLayer layer_of(const test::Soup& soup, double z) {
  return layers_of(surface_of(soup), {z, z, 1.0}).front();
}

/// The definition of a slice: the cut of every triangle that has corners on both sides, walked from
/// triangle to triangle. Cuts by the middle of their ends, sorted.
std::vector<Vec3> cuts_of(const OrientedSurface& s, double z) {
  std::vector<Vec3> middles;
  for (const auto& t : s.mesh.triangles) {
    std::vector<Vec3> ends;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& a = s.mesh.vertices[t[k]];
      const Vec3& b = s.mesh.vertices[t[(k + 1) % 3]];
      if ((a.z() > z) != (b.z() > z)) ends.push_back(a + (z - a.z()) / (b.z() - a.z()) * (b - a));
    }
    if (ends.size() == 2 && (ends[0] - ends[1]).norm() > 1e-9)
      middles.push_back(0.5 * (ends[0] + ends[1]));
  }
  return middles;
}

std::size_t steps_of(const SliceContour& c) { return c.points.size() - (c.closed ? 0 : 1); }

/// Every step of a layer's contours is the cut of a triangle, and every cut is one of them.
void check_against_walk(const OrientedSurface& s, const SliceLayer& layer) {
  std::vector<Vec3> walk = cuts_of(s, layer.height);
  std::size_t steps = 0;
  std::map<std::array<std::int64_t, 2>, int> cells;
  const auto cell = [](const Vec3& p) {
    return std::array<std::int64_t, 2>{std::llround(p.x() * 1e4), std::llround(p.y() * 1e4)};
  };
  for (const Vec3& m : walk) ++cells[cell(m)];
  for (const SliceContour& c : layer.contours)
    for (std::size_t i = 0; i < steps_of(c); ++i) {
      ++steps;
      const Vec3 middle = 0.5 * (c.points[i] + c.points[(i + 1) % c.points.size()]);
      const auto at = cell(middle);
      int near = 0;
      for (int dx = -1; dx <= 1; ++dx)
        for (int dy = -1; dy <= 1; ++dy)
          if (const auto found = cells.find({at[0] + dx, at[1] + dy}); found != cells.end())
            near += found->second;
      REQUIRE(near > 0);
    }
  CHECK(steps == walk.size());
}

}  // namespace

TEST_CASE("slice_surface: a box gives rectangles at the pitch", "[kernels][geometry]") {
  const OrientedSurface s = surface_of(box({-3, 0, 0}, {5, 4, 10}));
  const auto layers = layers_of(s, {0.5, 10.0, 1.0});
  REQUIRE(layers.size() == 10);
  for (std::size_t k = 0; k < layers.size(); ++k) {
    CHECK(layers[k].asked == 0.5 + double(k));
    CHECK(layers[k].height == layers[k].asked);
    REQUIRE(layers[k].contours.size() == 1);
    const SliceContour& c = layers[k].contours[0];
    CHECK(c.closed);
    CHECK_FALSE(c.against_mesh);
    CHECK(signed_area(c) == Approx(32.0).epsilon(1e-12));
    CHECK(length(c) == Approx(24.0).epsilon(1e-12));
    CHECK(c.points[0] == Vec3(-3, 0, layers[k].height));
    for (const Vec3& p : c.points) CHECK(p.z() == layers[k].height);
  }
}

TEST_CASE("slice_surface: planes stay clear of vertices", "[kernels][geometry]") {
  const test::Soup wall = test::ellipse_body(50, 35, 40, 48, 40);
  const OrientedSurface s = surface_of(wall);
  // Asked for at the rings of vertices, and at the caps.
  for (const auto& layer : layers_of(s, {0.0, 40.0, 1.0})) {
    CHECK(std::abs(layer.height - layer.asked - 1e-6) < 1e-12);
    for (const Vec3& v : s.mesh.vertices) REQUIRE(std::abs(v.z() - layer.height) >= kVertexGap);
    if (layer.asked == 40.0)
      CHECK(layer.contours.empty());
    else
      CHECK(layer.contours.size() == 1);
    check_against_walk(s, layer);
  }
}

TEST_CASE("slice_surface: area of a sphere's slices", "[kernels][geometry]") {
  const OrientedSurface s = surface_of(test::sphere(Vec3(5, -2, 1), 20.0, 200));
  for (const auto& layer : layers_of(s, {-18.3, 21.0, 3.7})) {
    REQUIRE(layer.contours.size() == 1);
    const double h = layer.height - 1.0;
    CHECK(signed_area(layer.contours[0]) == Approx(kPi * (400.0 - h * h)).epsilon(4e-4));
    check_against_walk(s, layer);
  }
}

TEST_CASE("slice_surface: nested contours have the body on their left", "[kernels][geometry]") {
  const auto ring = [](double r) { return test::ellipse_body(r, r, 10, 40, 2); };
  const auto beside = [&](double x) {
    test::Soup soup = ring(2);
    for (Vec3& p : soup) p.x() += x;
    return soup;
  };
  // A disc with a hole in which a pin stands that has a hole; beside it a second pin.
  const test::Soup part = together({ring(3), test::turned_over(ring(20)), ring(30),
                                    test::turned_over(ring(10)), ring(15), beside(50)});
  const auto check = [](const SliceLayer& layer, bool outer_against) {
    REQUIRE(layer.contours.size() == 6);
    const std::array<double, 6> radius{30, 20, 15, 10, 3, 2};
    for (std::size_t i = 0; i < 6; ++i) {
      const SliceContour& c = layer.contours[i];
      const int depth = i < 5 ? int(i) : 0;
      CHECK(c.depth == depth);
      CHECK(c.parent == depth - 1);
      CHECK(signed_area(c) ==
            Approx((depth % 2 ? -1 : 1) * radius[i] * radius[i] * 20 * std::sin(kPi / 20)));
      CHECK(c.against_mesh == (i == 0 && outer_against));
    }
  };
  check(layer_of(part, 4.0), false);
  // Wound inside out the outermost wall is told, and its contour the same.
  const test::Soup wrong =
      together({ring(3), test::turned_over(ring(20)), test::turned_over(ring(30)),
                test::turned_over(ring(10)), ring(15), beside(50)});
  check(layer_of(wrong, 4.0), true);
}

TEST_CASE("slice_surface: an open sheet gives an open contour", "[kernels][geometry]") {
  // A quarter of a tube: its outside is on the right.
  const auto quarter = [](double u, double v) {
    return test::on_ellipse(10, 10, 0.5 * kPi * u, 8.0 * v);
  };
  const test::Soup wall = test::sheet(quarter, 12, 4);
  for (const bool inside_out : {false, true}) {
    const SliceLayer layer = layer_of(inside_out ? test::turned_over(wall) : wall, 3.0);
    REQUIRE(layer.contours.size() == 1);
    const SliceContour& c = layer.contours[0];
    CHECK_FALSE(c.closed);
    CHECK(length(c) == Approx(240.0 * std::sin(kPi / 48)));
    const Vec3 first(10, 0, 3), last(0, 10, 3);
    CHECK((c.points.front() - (inside_out ? last : first)).norm() < 1e-9);
    CHECK((c.points.back() - (inside_out ? first : last)).norm() < 1e-9);
  }
}

TEST_CASE("slice_surface: non-manifold edges do not open contours", "[kernels][geometry]") {
  const test::Soup two = together({box({0, 0, 0}, {1, 1, 5}), box({1, 1, 0}, {2, 2, 5})});
  const SliceLayer layer = layer_of(two, 2.0);
  REQUIRE(layer.contours.size() == 2);
  for (const SliceContour& c : layer.contours) {
    CHECK(c.closed);
    CHECK(signed_area(c) == Approx(1.0));
  }
  // Three walls in an edge: no body at all, but nothing is lost.
  test::Soup fan;
  for (const double a : {0.0, 2.0, 4.0})
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(std::cos(a), std::sin(a), 0), Vec3(0, 0, 2)})
      fan.push_back(p);
  const OrientedSurface s = surface_of(fan);
  const SliceLayer cut = layers_of(s, {1.0, 1.0, 1.0}).front();
  CHECK(cut.contours.size() == 3);
  check_against_walk(s, cut);
}

TEST_CASE("slice_surface: what cannot be", "[kernels][geometry]") {
  const OrientedSurface s = surface_of(box({0, 0, 0}, {1, 1, 1}));
  CHECK(layers_of(s, {2.0, 1.0, 0.1}).empty());
  CHECK(layers_of({}, {0.0, 1.0, 0.1}).empty());
  const auto many = slice_surface(s, {0.0, 1.0, 1e-9});
  REQUIRE_FALSE(many.ok());
  CHECK(many.diagnostics()[0].code == "RG131");
  CHECK_THROWS_AS(slice_surface(s, {0.0, 1.0, 0.0}), ContractViolation);
  CHECK_THROWS_AS(slice_surface(s, {0.0, INFINITY, 1.0}), ContractViolation);
}

TEST_CASE("slice_surface: parts of the corpus as the walk over triangles says",
          "[kernels][geometry]") {
  int parts = 0;
  for (const auto& path : test::corpus_files("5_stl", {".stl", ".STL"})) {
    const std::string bytes = test::read_bytes(path);
    if (bytes.size() > 4'000'000) continue;
    const auto stl = read_stl(bytes, path.filename().string(), {});
    if (!stl.ok() || stl.value().corners.empty()) continue;
    const OrientedSurface s = orient_surface(weld(stl.value().corners));
    if (s.mesh.vertices.empty()) continue;
    ++parts;
    double low = INFINITY, high = -INFINITY;
    for (const Vec3& v : s.mesh.vertices) {
      low = std::min(low, v.z());
      high = std::max(high, v.z());
    }
    INFO(path);
    for (const double share : {0.21, 0.5, 0.83}) {
      const double z = low + share * (high - low);
      const SliceLayer layer = layers_of(s, {z, z, 1.0}).front();
      // Long sides of the cuts, so that cells tell them apart.
      double walked = 0.0, cut = 0.0;
      for (const auto& t : s.mesh.triangles) {
        std::vector<Vec3> ends;
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3& a = s.mesh.vertices[t[k]];
          const Vec3& b = s.mesh.vertices[t[(k + 1) % 3]];
          if ((a.z() > layer.height) != (b.z() > layer.height))
            ends.push_back(a + (layer.height - a.z()) / (b.z() - a.z()) * (b - a));
        }
        if (ends.size() == 2) walked += (ends[0] - ends[1]).norm();
      }
      for (const SliceContour& c : layer.contours) cut += length(c);
      CHECK(cut == Approx(walked).epsilon(1e-6).margin(1e-6));
      if (s.open_sides == 0)
        for (const SliceContour& c : layer.contours) CHECK(c.closed);
    }
  }
  if (parts == 0) WARN("no corpus beside the checkout: skipped");
}
