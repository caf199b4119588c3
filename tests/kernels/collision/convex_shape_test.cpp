#include "kernels/collision/convex_shape.h"

#include "kernels/core/contract.h"
#include "tests/kernels/collision/oracles.h"

using namespace smoothpost;

namespace {

/// Point of the whole body that is farthest in a direction, in the body's frame.
Vec3 farthest(const ConvexShape& shape, const Vec3& direction) {
  const Pose& frame = shape.core_frame();
  return frame * shape.support(frame.linear().transpose() * direction) +
         shape.sweep() * direction.normalized();
}

}  // namespace

TEST_CASE("convex_shape: support is the farthest of densely sampled points",
          "[kernels][collision]") {
  std::mt19937 random(1);
  for (int i = 0; i < 120; ++i) {
    const test::Body body = test::random_body(random, i);
    for (int k = 0; k < 40; ++k) {
      const Vec3 d = test::random_direction(random);
      const Vec3 found = farthest(*body.shape.convex(), d);
      REQUIRE(body.distance(found) < 1e-9);
      double sampled = -1e9;
      for (const Vec3& p : body.points) sampled = std::max(sampled, d.dot(p));
      REQUIRE(d.dot(found) >= sampled - 1e-9);
      // The samples are a degree apart on round bodies of up to 30 mm; capsules are sampled
      // coarsely.
      REQUIRE(d.dot(found) <= sampled + (i % 6 == 3 ? 0.5 : 0.01));
    }
  }
}

TEST_CASE("convex_shape: projection is the distance by definition and its plane separates",
          "[kernels][collision]") {
  std::mt19937 random(2);
  int outside = 0;
  for (int i = 0; i < 120; ++i) {
    const test::Body body = test::random_body(random, i);
    const ConvexShape& shape = *body.shape.convex();
    const Pose& frame = shape.core_frame();
    for (int k = 0; k < 200; ++k) {
      const Vec3 p = test::random_vector(random, 60.0);
      const Vec3 local = frame.inverse() * p;
      const Projection projection = shape.projection(local);
      const double expected = body.distance(p);
      REQUIRE(std::max(0.0, projection.distance - shape.sweep()) == Approx(expected).margin(1e-7));
      if (projection.distance <= 0.0) continue;
      ++outside;
      REQUIRE(projection.normal.norm() == Approx(1.0));
      const double plane = projection.normal.dot(local) - projection.distance;
      REQUIRE(projection.normal.dot(shape.support(projection.normal)) <= plane + 1e-9);
    }
  }
  CHECK(outside > 15000);
}

TEST_CASE("convex_shape: projection on ends, sides, rims and axes of a frustum",
          "[kernels][collision]") {
  const auto shape = ConvexShape::frustum(
      {.from = {0, 0, 0}, .to = {0, 0, 60}, .radius_from = 2.0, .radius_to = 25.0});
  const auto distance = test::frustum_distance(
      {.from = {0, 0, 0}, .to = {0, 0, 60}, .radius_from = 2.0, .radius_to = 25.0});
  for (const double x : {0.0, 1.0, 2.0, 3.0, 10.0, 25.0, 40.0})
    for (const double z : {-5.0, 0.0, 1.0, 30.0, 60.0, 61.0}) {
      const Vec3 p(x, 0, z);
      CHECK(shape.projection(shape.core_frame().inverse() * p).distance ==
            Approx(distance(p)).margin(1e-12));
    }
}

TEST_CASE("convex_shape: every point lies in the hull of the balls", "[kernels][collision]") {
  std::mt19937 random(3);
  for (int i = 0; i < 60; ++i) {
    const test::Body body = test::random_body(random, i);
    for (int k = 0; k < 50; ++k) {
      const Vec3 d = test::random_direction(random);
      double most = -1e9;
      for (const Ball& ball : body.shape.balls())
        most = std::max(most, d.dot(ball.centre) + ball.radius);
      REQUIRE(most >= d.dot(farthest(*body.shape.convex(), d)) - 1e-9);
    }
  }
}

TEST_CASE("convex_shape: a hull keeps its corners only", "[kernels][collision]") {
  const test::Body body = test::hull_body({0, 0, 0}, {10, 20, 30});
  CHECK(body.shape.convex()->corners().size() == 8);
  const auto flat = ConvexShape::hull({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {2, 2, 0}});
  CHECK(flat.corners().size() == 4);
  CHECK(flat.projection(flat.core_frame().inverse() * Vec3(1, 1, 3)).distance == Approx(3.0));
  CHECK(ConvexShape::hull({{1, 2, 3}, {1, 2, 3}}).corners().size() == 1);
}

TEST_CASE("convex_shape: bodies of a machine file", "[kernels][collision]") {
  Body body;
  body.from = {0, 0, 10};
  body.to = {0, 0, 30};
  body.radius_from = body.radius_to = 5.0;
  const auto distance = [&](BodyShape shape, const Vec3& p) {
    body.shape = shape;
    const auto made = shape_of(body);
    REQUIRE(made.ok());
    const ConvexShape& convex = *made.value().convex();
    return std::max(0.0,
                    convex.projection(convex.core_frame().inverse() * p).distance - convex.sweep());
  };
  CHECK(distance(BodyShape::cylinder, {0, 0, 36}) == Approx(6.0));
  CHECK(distance(BodyShape::capsule, {0, 0, 36}) == Approx(1.0));
  body.radius_to = 8.0;
  CHECK(distance(BodyShape::frustum, {8, 0, 33}) == Approx(3.0));
  body.from = {-1, -2, -3};
  body.to = {1, 2, 3};
  CHECK(distance(BodyShape::box, {4, 6, 0}) == Approx(5.0));
  body.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  CHECK(distance(BodyShape::hull, {-2, 0, 0}) == Approx(2.0));
  body.shape = BodyShape::mesh;
  CHECK_THROWS_AS(shape_of(body), ContractViolation);
  body.mesh = std::make_shared<const TriangleMesh>(weld(test::box({0, 0, 0}, {1, 2, 3})));
  const auto mesh = shape_of(body);
  CHECK(mesh.ok() == triangle_tree_available());
  if (mesh.ok()) {
    CHECK(mesh.value().convex() == nullptr);
    CHECK(mesh.value().mesh()->seeds.size() == 1);
    CHECK(mesh.value().balls().size() == 8);
  } else {
    CHECK(mesh.diagnostics().at(0).code == "RG101");
  }
}

TEST_CASE("convex_shape: preconditions", "[kernels][collision]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(ConvexShape::frustum({.from = {0, 0, 0}, .to = {0, 0, 0}, .radius_from = 1.0}),
                  ContractViolation);
  CHECK_THROWS_AS(ConvexShape::frustum({.from = {0, 0, 0}, .to = {0, 0, 1}}), ContractViolation);
  CHECK_THROWS_AS(ConvexShape::frustum({.from = {0, 0, nan}, .to = {0, 0, 1}, .radius_to = 1.0}),
                  ContractViolation);
  CHECK_THROWS_AS(ConvexShape::capsule({0, 0, 0}, {1, 0, 0}, 0.0), ContractViolation);
  CHECK_THROWS_AS(ConvexShape::box({1, 1, 1}, {1, 1, 1}), ContractViolation);
  CHECK_THROWS_AS(ConvexShape::hull({}), ContractViolation);
  CHECK_THROWS_AS(ConvexShape::hull({{nan, 0, 0}}), ContractViolation);
}
