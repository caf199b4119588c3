#include "kernels/collision/convex_distance.h"

#include "kernels/collision/convex_shape.h"
#include "tests/kernels/collision/oracles.h"

using namespace smoothpost;

namespace {

ConvexDistance core_distance(const ConvexShape& shape, const TriangleSet& triangle,
                             double enough = std::numeric_limits<double>::infinity()) {
  const Pose in = shape.core_frame().inverse();
  const TriangleSet local{
      {in * triangle.corner[0], in * triangle.corner[1], in * triangle.corner[2]}};
  return convex_distance(shape, local, Vec3(1, 2, 3), enough);
}

/// Also of a triangle without area.
double distance_to(const TriangleSet& t, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k)
    best = std::min(best, test::distance_to_segment(p, t.corner[k], t.corner[(k + 1) % 3]));
  const Vec3 n = (t.corner[1] - t.corner[0]).cross(t.corner[2] - t.corner[0]);
  return n.norm() > 1e-9 ? std::min(best, test::distance_to_triangle(p, t.corner)) : best;
}

/// Distance of two segments by golden sections over one of them.
double segments(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return test::convex_minimum(
      [&](double t) { return test::distance_to_segment(a + t * (b - a), c, d); }, 0.0, 1.0, 60);
}

}  // namespace

TEST_CASE("convex_distance: bounds enclose the distance of bodies and triangles by definition",
          "[kernels][collision]") {
  std::mt19937 random(11);
  double gap = 0.0;
  int apart = 0;
  int touching = 0;
  for (int i = 0; i < 900; ++i) {
    const test::Body body = test::random_body(random, i);
    const Vec3 at = test::random_vector(random, i % 2 == 0 ? 15.0 : 50.0);
    const double size = std::pow(10.0, test::uniform(random, -1.0, 2.0));
    const TriangleSet triangle{{at + test::random_vector(random, size),
                                at + test::random_vector(random, size),
                                at + test::random_vector(random, size)}};
    const double expected = test::triangle_distance(triangle.corner, body.distance);
    const ConvexShape& shape = *body.shape.convex();
    const auto found = core_distance(shape, triangle);
    // The search by golden sections ends a little above the minimum.
    REQUIRE(found.lower - shape.sweep() <= expected + 1e-9);
    REQUIRE(std::max(0.0, found.upper - shape.sweep()) >= expected - 1e-5 * (1.0 + size));
    REQUIRE(std::abs((found.on_a - found.on_b).norm() - found.upper) < 1e-9);
    REQUIRE(shape.projection(found.on_a).distance < 1e-9);
    REQUIRE(body.distance(shape.core_frame() * found.on_a) < 1e-9);
    gap = std::max(gap, found.upper - found.lower);
    if (expected > 0.0) {
      ++apart;
      REQUIRE(std::max(0.0, found.upper - shape.sweep()) <= expected + 1e-7);
      const auto stopped = core_distance(shape, triangle, 0.5 * found.lower);
      REQUIRE(stopped.lower >= 0.5 * found.lower);
      REQUIRE(stopped.lower - shape.sweep() <= expected + 1e-9);
    } else {
      ++touching;
    }
  }
  CHECK(apart > 500);
  CHECK(touching > 40);
  CHECK(gap < 1e-6);
}

TEST_CASE("convex_distance: both bounds are proven by what is returned", "[kernels][collision]") {
  std::mt19937 random(13);
  const auto nozzle = ConvexShape::frustum(
      {.from = {0, 0, -30}, .to = {0, 0, 30}, .radius_from = 2.0, .radius_to = 25.0});
  test::Body other = test::random_body(random, 0);
  double gap = 0.0;
  int overlaps = 0;
  for (int i = 0; i < 60000; ++i) {
    // The shapes of a laser head and others, against triangles of all sizes, mostly near.
    if (i % 64 == 0) other = test::random_body(random, i / 64);
    const ConvexShape& shape = i % 2 ? nozzle : *other.shape.convex();
    const Vec3 at = test::random_vector(random, 40.0);
    const double size = std::pow(10.0, test::uniform(random, -1.5, 2.7));
    TriangleSet triangle{{at + test::random_vector(random, size),
                          at + test::random_vector(random, size),
                          at + test::random_vector(random, size)}};
    if (i % 5 == 0) triangle.corner[2] = 0.5 * (triangle.corner[0] + triangle.corner[1]);
    const auto found = convex_distance(shape, triangle, Vec3(1, 2, 3));
    REQUIRE(shape.projection(found.on_a).distance < 1e-9);
    REQUIRE(distance_to(triangle, found.on_b) < 1e-9 * (1.0 + size));
    REQUIRE((found.on_a - found.on_b).norm() == Approx(found.upper).margin(2e-9));
    REQUIRE(found.lower <= found.upper);
    gap = std::max(gap, found.upper - found.lower);
    overlaps += found.overlap;
    if (found.lower <= 0.0) continue;
    const double of_body = found.normal.dot(shape.support(-found.normal));
    double of_triangle = -1e9;
    for (const Vec3& c : triangle.corner) of_triangle = std::max(of_triangle, found.normal.dot(c));
    REQUIRE(of_body - of_triangle >= found.lower - 1e-9);
  }
  CHECK(overlaps > 4000);
  CHECK(gap < 1e-6);  // triangles of up to 1 m
}

TEST_CASE("convex_distance: closed forms of capsules, boxes and points", "[kernels][collision]") {
  std::mt19937 random(12);
  for (int i = 0; i < 500; ++i) {
    const Vec3 a = test::random_vector(random, 30.0);
    const Vec3 b = test::random_vector(random, 30.0);
    const Vec3 c = test::random_vector(random, 30.0);
    const Vec3 d = test::random_vector(random, 30.0);
    const auto first = ConvexShape::capsule(a, b, 1.0);
    const auto second = ConvexShape::capsule(c, d, 1.0);
    const auto cores =
        convex_distance(PosedSet<ConvexShape>{first, first.core_frame()},
                        PosedSet<ConvexShape>{second, second.core_frame()}, Vec3(1, 0, 0));
    REQUIRE(cores.upper == Approx(segments(a, b, c, d)).margin(1e-6));
    REQUIRE(cores.upper - cores.lower < 1e-6);
    const auto box = ConvexShape::box(a, b);
    const auto point =
        convex_distance(PosedSet<ConvexShape>{box, box.core_frame()}, PointSet{c}, Vec3(0, 0, 1));
    REQUIRE(point.upper == Approx(test::box_distance(a, b)(c)).margin(1e-9));
  }
}

TEST_CASE("convex_distance: thin, tiny and degenerate sets", "[kernels][collision]") {
  const auto cylinder = ConvexShape::frustum(
      {.from = {0, 0, -50}, .to = {0, 0, 50}, .radius_from = 1e-3, .radius_to = 1e-3});
  const TriangleSet needle{{Vec3(5, 0, 0), Vec3(5, 1e-9, 1000), Vec3(5, 2e-9, 500)}};
  CHECK(convex_distance(cylinder, needle, Vec3(1, 1, 1)).upper == Approx(5 - 1e-3));
  const TriangleSet point{{Vec3(0, 7, 0), Vec3(0, 7, 0), Vec3(0, 7, 0)}};
  CHECK(convex_distance(cylinder, point, Vec3(1, 1, 1)).upper == Approx(7 - 1e-3));
  const TriangleSet inside{{Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(0, 1e-5, 0)}};
  const auto found = convex_distance(cylinder, inside, Vec3(1, 1, 1));
  CHECK(found.overlap);
  CHECK(found.upper == 0.0);
  // Parallel faces: every point of the smaller one is a closest point.
  const auto box = ConvexShape::box({-10, -10, -10}, {10, 10, 10});
  const TriangleSet above{{Vec3(-1, -1, 12), Vec3(2, 0, 12), Vec3(0, 3, 12)}};
  const auto flat = convex_distance(box, above, Vec3(0.1, 0.2, 0.3));
  CHECK(flat.upper == Approx(2.0));
  CHECK(flat.lower == Approx(2.0));
  CHECK(flat.normal.isApprox(Vec3(0, 0, -1), 1e-6));
}
