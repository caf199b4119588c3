#include "kernels/collision/mesh_search.h"

#include "kernels/core/contract.h"
#include "tests/kernels/collision/oracles.h"

using namespace smoothpost;

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

/// The margin of one mesh point by the definition of MarginQuery; `distance` in the mesh's frame.
double point_margin(const Vec3& x, const test::Distance& distance, const MarginQuery& query) {
  const double apart = distance(x) - query.clearance;
  if (!query.exempt) return apart;
  return std::max(apart, query.exempt->radius - (x - query.exempt->centre).norm());
}

/// Least margin of points sampled over every triangle, `n` to a side.
double sampled_margin(const TriangleMesh& mesh, const test::Distance& distance,
                      const MarginQuery& query, int n) {
  double best = kInf;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto t = test::corners_of(mesh, i);
    for (int u = 0; u <= n; ++u)
      for (int v = 0; u + v <= n; ++v)
        best = std::min(best, point_margin(t[0] + (double(u) / n) * (t[1] - t[0]) +
                                               (double(v) / n) * (t[2] - t[0]),
                                           distance, query));
  }
  return best;
}

bool same(const MarginBounds& a, const MarginBounds& b) {
  return a.found == b.found && a.upper == b.upper && a.distance == b.distance &&
         a.on_body == b.on_body && a.on_mesh == b.on_mesh && a.normal == b.normal &&
         a.triangle == b.triangle;
}

void require_witness(const MarginBounds& found, const TriangleMesh& mesh,
                     const test::Distance& distance) {
  REQUIRE(found.found);
  REQUIRE(test::distance_to_triangle(found.on_mesh, test::corners_of(mesh, found.triangle)) < 1e-7);
  REQUIRE(distance(found.on_body) < 1e-7);
  REQUIRE((found.on_body - found.on_mesh).norm() == Approx(found.distance).margin(1e-9));
  REQUIRE(found.normal.norm() == Approx(1.0));
}

}  // namespace

TEST_CASE("mesh_search: margins are those of every triangle by definition",
          "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(21);
  int apart = 0;
  int negative = 0;
  for (int i = 0; i < 360; ++i) {
    const int count = std::array{1, 2, 3, 5, 40, 150}[static_cast<std::size_t>(i % 6)];
    const auto mesh = test::random_triangles(random, count, 40.0, i % 4 == 0 ? 30.0 : 4.0);
    const MeshShape shape = test::mesh_of(mesh);
    const test::Body body = test::random_body(random, i / 6);
    const Pose pose = test::random_pose(random, i % 2 == 0 ? 25.0 : 80.0);
    const auto distance = test::posed(body.distance, pose);
    const double expected = test::mesh_distance(mesh, distance);
    const double clearance = test::uniform(random, 0.0, 5.0);
    const MarginQuery query{.clearance = clearance, .exempt = {}, .want = kInf};
    const auto found = mesh_margin(*shape.tree, *body.shape.convex(), pose, query);
    require_witness(found, mesh, distance);
    REQUIRE(found.lower <= found.upper);
    REQUIRE(found.upper - found.lower <= kMarginTolerance);
    REQUIRE(found.lower <= expected - clearance + 1e-9);
    if (expected > 0.0) {
      ++apart;
      REQUIRE(found.distance == Approx(expected).margin(2e-4));
      REQUIRE(found.distance <= expected + 1e-6);
      REQUIRE(found.upper == Approx(found.distance - clearance).margin(1e-12));
    } else {
      ++negative;
      REQUIRE(found.upper <= -clearance);
      REQUIRE(found.distance == 0.0);
    }
  }
  CHECK(apart > 150);
  CHECK(negative > 40);
}

TEST_CASE("mesh_search: hints and wishes above the margin change no bit", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(22);
  int compared = 0;
  for (int i = 0; i < 200; ++i) {
    const auto mesh = test::random_triangles(random, 80, 40.0, 5.0);
    const MeshShape shape = test::mesh_of(mesh);
    const test::Body body = test::random_body(random, i);
    const Pose pose = test::random_pose(random, 60.0);
    MarginQuery query{.clearance = 1.0, .exempt = {}, .want = kInf};
    const auto plain = mesh_margin(*shape.tree, *body.shape.convex(), pose, query);
    for (int k = 0; k < 6; ++k) {
      query.want = k < 3 ? kInf : plain.upper + test::uniform(random, 1e-3, 20.0);
      query.hint = static_cast<std::uint32_t>(test::uniform(random, 0.0, 79.9));
      REQUIRE(same(mesh_margin(*shape.tree, *body.shape.convex(), pose, query), plain));
      ++compared;
    }
    // Below the margin there is nothing to find, and the wish is proven.
    query.want = plain.lower - 1e-3;
    const auto none = mesh_margin(*shape.tree, *body.shape.convex(), pose, query);
    REQUIRE_FALSE(none.found);
    REQUIRE(none.lower == query.want);
    query.decide = true;
    query.want = std::abs(plain.upper) + 1.0;
    REQUIRE((mesh_margin(*shape.tree, *body.shape.convex(), pose, query).upper < 0.0) ==
            (plain.upper < 0.0));
  }
  CHECK(compared == 1200);
}

TEST_CASE("mesh_search: the exempt ball by its definition", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(23);
  int positive = 0;
  int negative = 0;
  int differs = 0;
  for (int i = 0; i < 150; ++i) {
    // A sheet of large or small triangles under a nozzle that nearly touches it.
    const int cells = std::array{1, 4, 30}[static_cast<std::size_t>(i % 3)];
    const double bow = i % 2 == 0 ? 0.0 : test::uniform(random, 0.0, 15.0);
    const auto mesh = weld(test::sheet(
        [&](double u, double v) {
          return Vec3(80 * u - 40, 80 * v - 40, bow * std::sin(2.0 * u) * std::cos(3.0 * v));
        },
        cells, cells));
    const MeshShape shape = test::mesh_of(mesh);
    const test::Body body = test::frustum_body(
        {.from = {0, 0, 0}, .to = {0, 0, 60}, .radius_from = 2.0, .radius_to = 25.0});
    Pose pose = Pose::Identity();
    pose.linear() = rotation_exp(test::uniform(random, 0.0, 0.8) * test::random_direction(random));
    pose.translation() = Vec3(test::uniform(random, -10, 10), test::uniform(random, -10, 10),
                              test::uniform(random, -6.0, 3.0) + bow);
    const auto distance = test::posed(body.distance, pose);
    const double radius = test::uniform(random, 1.0, 15.0);
    const MarginQuery query{
        .clearance = 2.0, .exempt = ExemptBall{pose.translation(), radius}, .want = 50.0};
    const auto found = mesh_margin(*shape.tree, *body.shape.convex(), pose, query);
    const int n = cells == 1 ? 240 : cells == 4 ? 60 : 8;
    const double sampled = sampled_margin(mesh, distance, query, n);
    const double spacing = 80.0 * std::sqrt(2.0) / cells / n;
    REQUIRE(found.found);
    REQUIRE(found.lower <= sampled + 1e-9);
    REQUIRE(found.upper >= sampled - spacing);
    REQUIRE(found.upper - found.lower <= exempt_tolerance(found.upper) + 1e-6);
    require_witness(found, mesh, distance);
    REQUIRE(point_margin(found.on_mesh, distance, query) ==
            Approx(std::max(found.upper, -2.0)).margin(1e-6));
    // What the caller decides on.
    MarginQuery yes_no = query;
    yes_no.want = 2e-3;
    yes_no.decide = true;
    const auto decided = mesh_margin(*shape.tree, *body.shape.convex(), pose, yes_no);
    if (sampled < 0.0) REQUIRE(decided.lower < 0.0);
    if (sampled > spacing + 2e-3) REQUIRE(decided.lower >= 0.0);
    (found.upper < 0.0 ? negative : positive) += 1;
    MarginQuery without = query;
    without.exempt = std::nullopt;
    differs += mesh_margin(*shape.tree, *body.shape.convex(), pose, without).upper < 0.0 &&
               found.lower >= 0.0;
  }
  CHECK(positive > 30);
  CHECK(negative > 30);
  CHECK(differs > 20);
}

TEST_CASE("mesh_search: an exempt ball that holds everything, and one that holds nothing",
          "[kernels][collision]") {
  NEEDS_TREE();
  const auto mesh = weld(test::box({-1, -1, -1}, {1, 1, 1}));
  const MeshShape shape = test::mesh_of(mesh);
  const auto ball = ConvexShape::capsule({0, 0, 2}, {0, 0, 2}, 0.5);
  MarginQuery query{.clearance = 3.0, .exempt = ExemptBall{{0, 0, 2}, 100.0}, .want = 1000.0};
  const auto all = mesh_margin(*shape.tree, ball, Pose::Identity(), query);
  // The farthest corner is the nearest to the ball's surface: 100 − √11.
  CHECK(all.upper >= 100.0 - std::sqrt(11.0) - 1e-9);
  CHECK(all.lower <= 100.0 - std::sqrt(11.0) + 1e-9);
  CHECK(all.lower <= all.upper);
  CHECK(all.upper - all.lower <= exempt_tolerance(all.upper));
  query.exempt = ExemptBall{{0, 0, 2}, 0.9};
  const auto none = mesh_margin(*shape.tree, ball, Pose::Identity(), query);
  // Sideways of the box the distance grows as the ball's surface is left behind: r − 0.5 − 3 and
  // 0.9 − r meet at r = 2.2.
  CHECK(none.upper == Approx(-1.3).margin(exempt_tolerance(-1.3)));
  CHECK(none.lower == Approx(-1.3).margin(exempt_tolerance(-1.3)));
}

TEST_CASE("mesh_search: a sheet that leaves the exempt ball sideways", "[kernels][collision]") {
  NEEDS_TREE();
  // Parallel to the body's face, 3 mm below it: too near by 0.5 mm, and out of the ball beyond 5.2
  // mm from the middle, where both terms of the margin, taken at the middle, are still above 0.
  const auto body = ConvexShape::box({-30, -30, 0}, {30, 30, 20});
  for (const int cells : {1, 7, 60}) {
    const MeshShape shape = test::mesh_of(weld(test::sheet(
        [](double u, double v) { return Vec3(40 * u - 20, 40 * v - 20, -3); }, cells, cells)));
    MarginQuery query{
        .clearance = 3.5, .exempt = ExemptBall{{0, 0, 100}, 104.0}, .want = 2e-3, .decide = true};
    CHECK(mesh_margin(*shape.tree, body, Pose::Identity(), query).upper < 0.0);
    query.decide = false;
    query.want = 10.0;
    CHECK(mesh_margin(*shape.tree, body, Pose::Identity(), query).upper ==
          Approx(-0.5).margin(0.03));
    query.exempt->radius = 110.0;  // holds all of the sheet
    CHECK(mesh_margin(*shape.tree, body, Pose::Identity(), query).upper ==
          Approx(110.0 - std::sqrt(103.0 * 103.0 + 800.0)).epsilon(0.06));
  }
}

TEST_CASE("mesh_search: two meshes, against every pair of triangles", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(24);
  int apart = 0;
  int cut = 0;
  for (int i = 0; i < 40; ++i) {
    const auto mesh = test::random_triangles(random, 30, 20.0, 5.0);
    const auto other = test::random_triangles(random, 1 + i % 20, 10.0, 5.0);
    const Pose pose = test::random_pose(random, i % 4 == 0 ? 10.0 : 60.0);
    double expected = kInf;
    for (std::size_t k = 0; k < other.triangles.size(); ++k) {
      auto t = test::corners_of(other, k);
      for (Vec3& c : t) c = pose * c;
      expected = std::min(expected, test::mesh_distance(mesh, [&](const Vec3& p) {
                            return test::distance_to_triangle(p, t);
                          }));
    }
    const MeshShape a = test::mesh_of(mesh);
    const MeshShape b = test::mesh_of(other);
    const MarginQuery query{.clearance = 0.0, .exempt = {}, .want = kInf};
    const auto found = mesh_margin(*a.tree, *b.tree, pose, query);
    REQUIRE(found.upper - found.lower <= kMarginTolerance);
    REQUIRE(found.distance <= expected + 1e-6);
    REQUIRE(found.distance >= expected - 1e-3);
    require_witness(found, mesh, [&](const Vec3& p) {
      const Vec3 local = pose.inverse() * p;
      double best = kInf;
      for (std::size_t k = 0; k < other.triangles.size(); ++k)
        best = std::min(best, test::distance_to_triangle(local, test::corners_of(other, k)));
      return best;
    });
    (found.distance > 0.0 ? apart : cut) += 1;
    // The exempt ball between meshes, against samples.
    const MarginQuery exempt{
        .clearance = 1.0, .exempt = ExemptBall{pose.translation(), 15.0}, .want = 100.0};
    const auto margin = mesh_margin(*a.tree, *b.tree, pose, exempt);
    const double sampled = sampled_margin(
        mesh,
        [&](const Vec3& p) {
          const Vec3 local = pose.inverse() * p;
          double best = kInf;
          for (std::size_t k = 0; k < other.triangles.size(); ++k)
            best = std::min(best, test::distance_to_triangle(local, test::corners_of(other, k)));
          return best;
        },
        exempt, 30);
    REQUIRE(margin.lower <= sampled + 1e-9);
    REQUIRE(margin.upper >= sampled - 0.7);
  }
  CHECK(apart > 15);
  CHECK(cut > 3);
}

TEST_CASE("mesh_search: triangles without area do not count", "[kernels][collision]") {
  NEEDS_TREE();
  const auto mesh = weld({{0, 0, 0},
                          {10, 0, 0},
                          {0, 10, 0},
                          {1, 1, 5},
                          {1, 1, 5},
                          {2, 2, 5},
                          {3, 3, 4},
                          {3, 3, 4},
                          {3, 3, 4},
                          {0, 0, 6},
                          {1, 1, 6},
                          {2, 2, 6}});
  const MeshShape shape = test::mesh_of(mesh);
  CHECK(shape.tree->size() == 1);
  const auto ball = ConvexShape::capsule({1, 1, 5}, {1, 1, 5}, 0.5);
  const auto found = mesh_margin(*shape.tree, ball, Pose::Identity(),
                                 {.clearance = 0.0, .exempt = {}, .want = kInf});
  CHECK(found.distance == Approx(4.5));
  CHECK(found.triangle == 0);
}

TEST_CASE("mesh_search: inside of solids only, whichever way they are wound",
          "[kernels][collision]") {
  NEEDS_TREE();
  auto soup = test::box({0, 0, 0}, {10, 10, 10});
  const MeshShape solid = test::mesh_of(weld(soup));
  CHECK(inside(*solid.tree, {5, 5, 5}));
  CHECK_FALSE(inside(*solid.tree, {5, 5, 11}));
  CHECK_FALSE(inside(*solid.tree, {500, 5, 5}));
  for (std::size_t i = 0; i < soup.size(); i += 3) std::swap(soup[i], soup[i + 1]);
  const MeshShape reversed = test::mesh_of(weld(soup));
  CHECK(reversed.tree->solid());
  CHECK(inside(*reversed.tree, {5, 5, 5}));
  CHECK_FALSE(inside(*reversed.tree, {5, 5, 11}));
  soup.resize(soup.size() - 3);
  const MeshShape open = test::mesh_of(weld(soup));
  CHECK_FALSE(open.tree->solid());
  CHECK_FALSE(inside(*open.tree, {5, 5, 5}));
  // Closed, but one triangle wound against its neighbours.
  soup = test::box({0, 0, 0}, {10, 10, 10});
  std::swap(soup[0], soup[1]);
  CHECK_FALSE(test::mesh_of(weld(soup)).tree->solid());
}

TEST_CASE("mesh_search: the normal of a cut points out of the mesh", "[kernels][collision]") {
  NEEDS_TREE();
  const MeshShape solid = test::mesh_of(weld(test::box({-50, -50, -10}, {50, 50, 0})));
  const MeshShape sheet = test::mesh_of(weld(
      test::sheet([](double u, double v) { return Vec3(100 * v - 50, 100 * u - 50, 0); }, 2, 2)));
  const auto post = ConvexShape::box({-1, -1, -2}, {1, 1, 8});
  const MarginQuery query{.clearance = 1.0, .exempt = {}, .want = kInf};
  const auto in_solid = mesh_margin(*solid.tree, post, Pose::Identity(), query);
  CHECK(in_solid.upper <= -1.0);
  CHECK(in_solid.normal.isApprox(Vec3(0, 0, 1)));
  // The sheet's triangles look down; the body's middle is above.
  const auto in_sheet = mesh_margin(*sheet.tree, post, Pose::Identity(), query);
  CHECK(in_sheet.upper <= -1.0);
  CHECK(in_sheet.normal.isApprox(Vec3(0, 0, 1)));
}

TEST_CASE("mesh_search: parts of a tree hold all triangles in their boxes",
          "[kernels][collision][geometry]") {
  NEEDS_TREE();
  std::mt19937 random(25);
  for (const int count : {1, 2, 3, 4, 5, 7, 8, 100, 1001}) {
    const auto mesh = test::random_triangles(random, count, 50.0, 5.0);
    const MeshShape shape = test::mesh_of(mesh);
    std::vector<int> seen(static_cast<std::size_t>(count), 0);
    int deepest = 0;
    const std::function<MeshBox(const TreePart&, int)> walk = [&](const TreePart& part,
                                                                  int depth) -> MeshBox {
      const MeshBox box = shape.tree->box(part);
      deepest = std::max(deepest, depth);
      if (part.size() == 1) {
        ++seen[shape.tree->triangle(part)];
        const auto t = test::corners_of(mesh, shape.tree->triangle(part));
        for (std::size_t k = 0; k < 3; ++k) {
          REQUIRE(shape.tree->corners(part)[k] == t[k]);
          REQUIRE(((t[k] - box.centre).cwiseAbs() - box.half).maxCoeff() <= 1e-12);
        }
        return box;
      }
      const auto [left, right] = shape.tree->halves(part);
      REQUIRE(left.size() + right.size() == part.size());
      for (const TreePart& half : {left, right}) {
        const MeshBox inner = walk(half, depth + 1);
        REQUIRE(((inner.centre - box.centre).cwiseAbs() + inner.half - box.half).maxCoeff() <=
                1e-11);
      }
      return box;
    };
    walk(shape.tree->whole(), 0);
    for (const int n : seen) REQUIRE(n == 1);
    CHECK(deepest <= static_cast<int>(std::ceil(std::log2(count))));
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i)
      REQUIRE(shape.tree->triangle(*shape.tree->part_of(i)) == i);
    CHECK_THROWS_AS(shape.tree->part_of(static_cast<std::uint32_t>(count)), ContractViolation);
  }
}
