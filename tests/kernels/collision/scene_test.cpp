#include "kernels/collision/scene.h"

#include <thread>

#include "kernels/core/contract.h"
#include "tests/kernels/collision/scenes.h"

using namespace smoothpost;

namespace {

bool same(const Clearance& a, const Clearance& b) {
  return a.margin == b.margin && a.pair == b.pair && a.at.upper == b.at.upper &&
         a.at.distance == b.at.distance && a.at.on_first == b.at.on_first &&
         a.at.on_second == b.at.on_second && a.at.normal == b.at.normal &&
         a.at.triangle == b.at.triangle;
}

/// A wandering path of joint vectors over the workshop.
std::vector<JointVector> wander(std::mt19937& random, int count, double step) {
  JointVector q = test::laser_joints({0, 0, 30}, Vec3::UnitZ(), -40.0, 0.0);
  JointVector rate = JointVector::Zero(6);
  std::vector<JointVector> out;
  for (int i = 0; i < count; ++i) {
    if (i % 25 == 0) {
      rate << test::random_vector(random, step), test::random_vector(random, 0.02 * step);
      rate[5] = test::uniform(random, -step, step);
      rate[0] -= 0.02 * q[0];
      rate[1] -= 0.02 * q[1];
      rate[2] -= 0.02 * (q[2] - 40.0);
      rate.segment<2>(3) -= 0.05 * q.segment<2>(3);
      rate[5] -= 0.05 * (q[5] + 40.0);
    }
    q += rate;
    out.push_back(q);
  }
  return out;
}

Scene mixed_scene() {
  auto bodies = std::vector<SceneBody>{
      test::nozzle_body(),
      test::casing_body(),
      test::part_body(test::workshop()),
      {.name = "post",
       .joint = SceneBody::kBase,
       .shape = ConvexShape::box({100, 100, 0}, {120, 140, 300})},
      {.name = "hose", .joint = 2, .shape = ConvexShape::capsule({90, 0, 300}, {90, 0, 500}, 20)}};
  return Scene(test::laser_chain(), bodies,
               {{.first = 0, .second = 2, .clearance = 2.0, .exempt = ExemptSphere{{0, 0, 0}, 8.0}},
                {.first = 1, .second = 2, .clearance = 3.0, .exempt = {}},
                {.first = 0, .second = 3, .clearance = 2.0, .exempt = {}},
                {.first = 1, .second = 3, .clearance = 2.0, .exempt = {}},
                {.first = 1, .second = 4, .clearance = 2.0, .exempt = {}}});
}

}  // namespace

TEST_CASE("scene: margins on moving tables are those of the placed bodies",
          "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(41);
  int apart = 0;
  for (int i = 0; i < 80; ++i) {
    ScrewChain chain = test::random_chain(random, 6);
    chain.joints[0].side = ChainSide::tool;
    chain.joints[5].side = ChainSide::workpiece;
    const auto mesh = test::random_triangles(random, 60, 60.0, 6.0);
    const test::Body tool = test::random_body(random, i);
    const test::Body fixed = test::random_body(random, i + 1);
    const Scene scene(
        chain,
        {{.name = "tool", .joint = 0, .shape = tool.shape},
         {.name = "part", .joint = SceneBody::kWorkpiece, .shape = test::mesh_of(mesh)},
         {.name = "table", .joint = 5, .shape = fixed.shape}},
        {{.first = 0, .second = 1, .clearance = 1.0, .exempt = {}},
         {.first = 2, .second = 0, .clearance = 1.0, .exempt = {}}});
    const JointVector q = test::random_joints(random, chain, 60.0, 2.0);
    const LinkPoses links = link_poses(chain, q);
    const Pose x_wm = (links[6] * chain.workpiece_home).inverse();
    const auto in_w = test::posed(tool.distance, x_wm * links[1]);
    const double expected = test::mesh_distance(mesh, in_w);
    const PairMargin found = scene.margin(0, scene.poses(q), 1e6);
    REQUIRE(found.found);
    REQUIRE(found.distance == Approx(expected).margin(3e-4));
    REQUIRE(in_w(found.on_first) < 1e-6);
    REQUIRE(test::distance_to_triangle(found.on_second, test::corners_of(mesh, found.triangle)) <
            1e-6);
    REQUIRE((found.on_first - found.on_second).norm() == Approx(found.distance).margin(1e-9));
    if (found.distance > 1e-3)
      REQUIRE((found.on_second + found.distance * found.normal).isApprox(found.on_first, 1e-6));
    apart += expected > 0.0;
    // Two convex bodies, the outer one first: by samples of one of them.
    const PairMargin convex = scene.margin(1, scene.poses(q), 1e6);
    const auto table_in_w = test::posed(fixed.distance, x_wm * links[6]);
    double sampled = 1e9;
    for (const Vec3& p : tool.points) sampled = std::min(sampled, table_in_w(x_wm * links[1] * p));
    REQUIRE(convex.distance <= sampled + 1e-6);
    REQUIRE(convex.triangle == PairMargin::kNoTriangle);
    REQUIRE(in_w(convex.on_second) < 1e-6);
    REQUIRE(table_in_w(convex.on_first) < 1e-6);
    REQUIRE((convex.on_first - convex.on_second).norm() == Approx(convex.distance).margin(1e-9));
    REQUIRE(convex.upper - convex.lower < 2e-6);
    // The least of both, and the one with it.
    const Clearance least = scene.clearance(q);
    REQUIRE(least.margin == std::min(found.upper, convex.upper));
    REQUIRE(least.pair == (found.upper <= convex.upper ? 0U : 1U));
    REQUIRE(scene.free(q) == (least.at.lower >= 0.0));
  }
  CHECK(apart > 40);
}

TEST_CASE("scene: either order of a pair gives the same margin", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(42);
  const auto mesh = test::random_triangles(random, 40, 30.0, 6.0);
  for (int i = 0; i < 60; ++i) {
    const test::Body body = test::random_body(random, i);
    const auto other = i % 2 == 0 ? test::random_triangles(random, 10, 20.0, 6.0) : mesh;
    const CollisionShape mover = i % 3 == 0 ? CollisionShape(test::mesh_of(other)) : body.shape;
    const Scene scene(test::laser_chain(),
                      {{.name = "a", .joint = 5, .shape = mover},
                       {.name = "b", .joint = SceneBody::kBase, .shape = test::mesh_of(mesh)}},
                      {{.first = 0, .second = 1, .clearance = 1.0, .exempt = {}},
                       {.first = 1, .second = 0, .clearance = 1.0, .exempt = {}}});
    const JointVector q = test::random_joints(random, scene.chain(), 60.0, 2.0);
    const auto poses = scene.poses(q);
    const auto there = scene.margin(0, poses, 1e6);
    const auto back = scene.margin(1, poses, 1e6);
    REQUIRE(there.upper == Approx(back.upper).margin(1e-6));
    if (there.distance > 1e-3) REQUIRE(there.normal.isApprox(-back.normal, 1e-4));
  }
}

TEST_CASE("scene: what is inside of a solid is not free", "[kernels][collision]") {
  NEEDS_TREE();
  const JointVector q = JointVector::Zero(6);
  const auto scene_of = [](const CollisionShape& first, const CollisionShape& second) {
    return Scene(test::laser_chain(),
                 {{.name = "a", .joint = 5, .shape = first},
                  {.name = "b", .joint = SceneBody::kWorkpiece, .shape = second}},
                 {{.first = 0, .second = 1, .clearance = 0.0, .exempt = {}}});
  };
  const auto large = test::box({-100, -100, -100}, {100, 100, 100});
  auto open = large;
  open.resize(open.size() - 3);
  const CollisionShape ball = ConvexShape::capsule({0, 0, 0}, {0, 0, 0}, 1.0);
  const CollisionShape full = ConvexShape::box({-100, -100, -100}, {100, 100, 100});
  const CollisionShape solid = test::mesh_of(weld(large));
  const CollisionShape shell = test::mesh_of(weld(open));
  const CollisionShape small = test::mesh_of(weld(test::box({-1, -1, -1}, {1, 1, 1})));
  for (const auto& [outer, inner] : {std::pair{solid, ball}, std::pair{full, ball},
                                     std::pair{full, small}, std::pair{solid, small}}) {
    CHECK_FALSE(scene_of(inner, outer).free(q));
    CHECK_FALSE(scene_of(outer, inner).free(q));
    const auto found = scene_of(inner, outer).clearance(q);
    CHECK(found.margin <= 0.0);
    CHECK(found.at.distance == 0.0);
    CHECK(found.at.on_first == found.at.on_second);
  }
  // An open mesh has no inside.
  CHECK(scene_of(ball, shell).free(q));
  CHECK(scene_of(small, shell).free(q));
  // Of a mesh of two pieces the second one is inside.
  auto two = test::box({300, 300, 300}, {310, 310, 310});
  const auto piece = test::box({-1, -1, -1}, {1, 1, 1});
  two.insert(two.end(), piece.begin(), piece.end());
  CHECK_FALSE(scene_of(test::mesh_of(weld(two)), solid).free(q));
  CHECK_FALSE(scene_of(solid, test::mesh_of(weld(two))).free(q));
  CHECK_FALSE(scene_of(solid, solid).free(q));
  // With an exempt ball it is the part outside of the ball that must not be inside.
  const auto exempt_scene = [&](double radius) {
    const CollisionShape stick = ConvexShape::capsule({0, 0, 0}, {0, 0, 50}, 1.0);
    return Scene(
        test::laser_chain(),
        {{.name = "a", .joint = 5, .shape = stick},
         {.name = "b", .joint = SceneBody::kWorkpiece, .shape = solid}},
        {{.first = 0, .second = 1, .clearance = 0.0, .exempt = ExemptSphere{{0, 0, 0}, radius}}});
  };
  CHECK_FALSE(exempt_scene(40.0).free(q));
  CHECK(exempt_scene(200.0).free(q));
}

TEST_CASE("scene: touching bodies are not free, whatever the clearance", "[kernels][collision]") {
  const auto at = [](double x, double clearance) {
    const Scene scene(test::laser_chain(),
                      {{.name = "a", .joint = 5, .shape = ConvexShape::box({0, 0, 0}, {1, 1, 1})},
                       {.name = "b", .joint = -1, .shape = ConvexShape::box({2, 0, 0}, {3, 1, 1})}},
                      {{.first = 0, .second = 1, .clearance = clearance, .exempt = {}}});
    JointVector q = JointVector::Zero(6);
    q[0] = x;
    return std::pair{scene.free(q), scene.clearance(q).margin};
  };
  CHECK(at(0.0, 0.0).first);
  CHECK(at(0.0, 0.0).second == Approx(1.0).margin(2e-6));
  CHECK(at(0.999, 0.0).first);
  CHECK_FALSE(at(1.0, 0.0).first);
  CHECK_FALSE(at(1.5, 0.0).first);
  CHECK(at(1.5, 0.0).second <= 0.0);
  CHECK(at(0.499, 0.5).first);
  CHECK_FALSE(at(0.501, 0.5).first);
  CHECK(at(0.501, 0.5).second == Approx(-0.001).margin(1e-6));
}

TEST_CASE("scene: swept bodies that overlap share a point", "[kernels][collision]") {
  std::mt19937 random(43);
  int deep = 0;
  for (int i = 0; i < 200; ++i) {
    const test::Body a = test::random_body(random, i % 2 ? 3 : i);
    const test::Body b = test::random_body(random, 3);
    const Scene scene(
        test::laser_chain(),
        {{.name = "a", .joint = 5, .shape = a.shape}, {.name = "b", .joint = -1, .shape = b.shape}},
        {{.first = 0, .second = 1, .clearance = 1.0, .exempt = {}}});
    const auto found = scene.clearance(JointVector::Zero(6));
    REQUIRE(a.distance(found.at.on_first) < 1e-6);
    REQUIRE(b.distance(found.at.on_second) < 1e-6);
    if (found.at.distance > 0.0) continue;
    ++deep;
    REQUIRE(found.at.on_first == found.at.on_second);
    REQUIRE(found.margin <= -1.0);
  }
  CHECK(deep > 30);
}

TEST_CASE("scene: the sheet under the nozzle is exempt, a wall beside it is not",
          "[kernels][collision]") {
  NEEDS_TREE();
  const Scene scene = test::laser_scene(test::workshop());
  const auto joints = [](double x, double z) {
    return test::laser_joints({x, 40, z}, Vec3::UnitZ(), -60.0, 0.0);
  };
  const Scene strict = test::laser_scene(test::workshop(), 2.0, 1e-3);
  CHECK(scene.free(joints(0, 1.0)));
  CHECK_FALSE(strict.free(joints(0, 1.0)));
  // The wall at x = 60 … 64, 90 mm high: the nozzle is 25 mm wide at 61 mm.
  CHECK(scene.free(joints(32.9, 1.0)));
  CHECK_FALSE(scene.free(joints(33.1, 1.0)));
  CHECK(scene.clearance(joints(33.1, 1.0)).pair == 0);
  const auto hit = scene.clearance(joints(33.1, 1.0));
  CHECK(hit.at.on_second.x() == Approx(60.0));
  CHECK(hit.at.normal.isApprox(Vec3(-1, 0, 0), 1e-3));
  // What the ball holds is not looked at: even a nozzle through the sheet is not seen.
  CHECK(scene.free(joints(0, -1.0)));
  CHECK_FALSE(scene.free(joints(0, -9.0)));
}

TEST_CASE("scene: answers with a cache are those without", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(44);
  const Scene scene = mixed_scene();
  int free = 0;
  int hit = 0;
  std::size_t queries = 0;
  std::size_t skipped = 0;
  for (const double step : {0.1, 1.0, 8.0}) {
    SceneCache yes_no;
    SceneCache least;
    SceneCache both;
    for (const JointVector& q : wander(random, 1500, step)) {
      const bool expected = scene.free(q);
      REQUIRE(scene.free(q, &yes_no) == expected);
      REQUIRE(scene.free(q, &both) == expected);
      const Clearance clearance = scene.clearance(q, 5.0);
      REQUIRE(same(scene.clearance(q, 5.0, &least), clearance));
      REQUIRE(same(scene.clearance(q, 5.0, &both), clearance));
      if (clearance.pair != Clearance::kNoPair) REQUIRE(same(scene.clearance(q), clearance));
      REQUIRE((clearance.margin >= 0.0) >= expected);
      (expected ? free : hit) += 1;
    }
    if (step > 0.5) continue;
    queries += yes_no.queries();
    skipped += yes_no.skipped();
  }
  CHECK(free > 300);
  CHECK(hit > 300);
  CHECK(skipped > 3 * queries);
}

TEST_CASE("scene: what a cache knows is never above the margin", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(45);
  const Scene scene = mixed_scene();
  SceneCache cache;
  int known = 0;
  for (const JointVector& q : wander(random, 600, 2.0)) {
    const auto poses = scene.poses(q);
    for (std::size_t pair = 0; pair < scene.pairs().size(); ++pair) {
      const double proven = scene.known_margin(pair, poses, cache);
      const PairMargin now = scene.margin(pair, poses, 1e6);
      REQUIRE(proven <= now.upper);
      known += proven > 0.0;
      if (test::uniform(random, 0, 1) < 0.2)
        static_cast<void>(scene.margin(pair, poses, 1e6, &cache));
    }
  }
  CHECK(known > 500);
}

TEST_CASE("scene: margins change no more than the bodies move", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(46);
  const Scene scene = mixed_scene();
  double tightest = 0.0;
  for (int i = 0; i < 400; ++i) {
    const JointVector a = test::laser_joints(test::random_vector(random, 60.0) + Vec3(0, 0, 65),
                                             test::random_direction(random), -40.0, 0.0);
    const JointVector b = a + 0.1 * test::random_joints(random, scene.chain(), 60.0, 1.0);
    for (std::size_t pair = 0; pair < scene.pairs().size(); ++pair) {
      const auto at_a = scene.poses(a);
      const auto at_b = scene.poses(b);
      const double moved = scene.movement(pair, at_a, at_b);
      REQUIRE(scene.movement_bound(pair, a, b).travel >= moved - 1e-9);
      const PairMargin from = scene.margin(pair, at_a, 1e6);
      const PairMargin to = scene.margin(pair, at_b, 1e6);
      if (from.distance == 0.0 || to.distance == 0.0) continue;  // no depth is promised
      REQUIRE(to.upper >= from.lower - moved);
      tightest = std::max(tightest, (from.upper - to.upper) / moved);
    }
  }
  CHECK(tightest > 0.8);
}

TEST_CASE("scene: an exempt ball that moves more than its body", "[kernels][collision]") {
  NEEDS_TREE();
  // The ball's centre is far from the tip about which B turns the nozzle, the part 40 mm deep in
  // the ball: the margin follows the ball.
  auto part = test::box({-1, -1, -301}, {1, 1, -299});
  const auto far = test::box({-1, -1, -3001}, {1, 1, -2999});  // makes the nozzle the smaller one
  part.insert(part.end(), far.begin(), far.end());
  const Scene scene(test::laser_chain(), {test::nozzle_body(), test::part_body(weld(part))},
                    {{.first = 0,
                      .second = 1,
                      .clearance = 290.0,
                      .exempt = ExemptSphere{{300, 0, -300}, 340.0}}});
  std::mt19937 random(48);
  int more = 0;
  for (int i = 0; i < 200; ++i) {
    const JointVector a = 1e-3 * test::random_joints(random, scene.chain(), 500.0, 20.0);
    JointVector b = a;
    b[test::kB] += test::uniform(random, -0.05, 0.05);
    const auto from = scene.poses(a);
    const auto to = scene.poses(b);
    SceneCache cache;
    const PairMargin before = scene.margin(0, from, 200.0, &cache);
    const PairMargin after = scene.margin(0, to, 200.0);
    REQUIRE(after.upper >= before.lower - scene.movement(0, from, to));
    REQUIRE(after.upper >= scene.known_margin(0, to, cache));
    REQUIRE(scene.movement_bound(0, a, b).travel >= scene.movement(0, from, to) - 1e-9);
    const double nozzle =
        displacement(scene.bodies()[0].shape.balls(), link_poses(scene.chain(), a)[6],
                     link_poses(scene.chain(), b)[6]);
    more += before.lower - after.upper > nozzle;
  }
  CHECK(more > 50);
}

TEST_CASE("scene: decide agrees with the margin", "[kernels][collision]") {
  NEEDS_TREE();
  const Scene scene = mixed_scene();
  std::mt19937 random(47);
  int yes = 0, no = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3 tip(test::uniform(random, -120, 58), test::uniform(random, -80, 80), 1.0);
    const Vec3 axis = (Vec3::UnitZ() + 0.4 * test::random_vector(random, 1.0)).normalized();
    const ScenePoses poses =
        scene.poses(test::laser_joints(tip, axis, test::uniform(random, -100, 20), 0.0));
    const double need = i % 3 ? test::uniform(random, 0.0, 30.0) : 0.0;
    for (std::size_t pair = 0; pair < scene.pairs().size(); ++pair) {
      const PairMargin exact = scene.margin(pair, poses, 200.0);
      const PairMargin quick = scene.decide(pair, poses, need);
      if (quick.upper < 0.0)
        REQUIRE(quick.lower < 0.0);
      else
        REQUIRE(quick.lower <= exact.upper + 1e-9);
      REQUIRE(quick.upper >= std::min(exact.lower, need) - 1e-9);
      if (exact.lower >= need + 2.0 * scene.tolerance(pair)) {
        REQUIRE(quick.lower >= need);
        ++yes;
      } else if (exact.upper < need) {
        REQUIRE(quick.lower < need);
        ++no;
      }
    }
  }
  CHECK(yes > 300);
  CHECK(no > 100);
}

TEST_CASE("scene: bodies of the machine against each other", "[kernels][collision]") {
  // Two arms of a scissor on joints C and B with a joint between them: W is the third.
  ScrewChain chain = test::laser_chain();
  std::vector<SceneBody> bodies = {
      {.name = "arm", .joint = 2, .shape = ConvexShape::capsule({0, 0, 0}, {100, 0, 0}, 5.0)},
      {.name = "hand", .joint = 4, .shape = ConvexShape::capsule({60, 0, 20}, {100, 0, 20}, 5.0)}};
  const Scene scene(chain, bodies, {{.first = 1, .second = 0, .clearance = 1.0}});
  JointVector q = JointVector::Zero(6);
  CHECK(scene.free(q));
  CHECK(scene.clearance(q).margin == Approx(20.0 - 10.0 - 1.0));
  q[4] = std::asin(0.1);  // B turns +x down
  CHECK(scene.clearance(q).margin < 5.0);
  q[4] = std::atan2(20.0, 60.0);
  CHECK_FALSE(scene.free(q));
  q[3] = 0.5 * kPi;  // C takes the hand away
  CHECK(scene.free(q));
  // X, Y, Z carry both: nothing changes.
  const double before = scene.clearance(q).margin;
  q.head<3>() << 100, 200, 300;
  CHECK(scene.clearance(q).margin == Approx(before));
}

TEST_CASE("scene: the same bits on any number of threads", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(47);
  const Scene scene = mixed_scene();
  const auto path = wander(random, 800, 1.0);
  const auto run = [&](std::size_t threads) {
    std::vector<Clearance> out(path.size());
    std::vector<char> free(path.size());
    std::vector<std::thread> workers;
    for (std::size_t k = 0; k < threads; ++k)
      workers.emplace_back([&, k] {
        SceneCache cache;
        for (std::size_t i = k; i < path.size(); i += threads) {
          free[i] = scene.free(path[i], &cache);
          out[i] = scene.clearance(path[i], 10.0, &cache);
        }
      });
    for (auto& worker : workers) worker.join();
    return std::pair{out, free};
  };
  const auto one = run(1);
  for (const std::size_t threads : {2U, 5U}) {
    const auto more = run(threads);
    CHECK(more.second == one.second);
    for (std::size_t i = 0; i < path.size(); ++i) REQUIRE(same(more.first[i], one.first[i]));
  }
}

TEST_CASE("scene: preconditions", "[kernels][collision]") {
  const auto chain = test::laser_chain();
  const std::vector<SceneBody> bodies = {test::nozzle_body(), test::casing_body()};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto make = [&](const ScenePair& pair) { return Scene(chain, bodies, {pair}); };
  CHECK_NOTHROW(make({.first = 0, .second = 1, .clearance = 0.0, .exempt = {}}));
  CHECK_THROWS_AS(make({.first = 0, .second = 0, .clearance = 0.0, .exempt = {}}),
                  ContractViolation);
  CHECK_THROWS_AS(make({.first = 0, .second = 2, .clearance = 0.0, .exempt = {}}),
                  ContractViolation);
  CHECK_THROWS_AS(make({.first = 0, .second = 1, .clearance = -1.0, .exempt = {}}),
                  ContractViolation);
  CHECK_THROWS_AS(make({.first = 0, .second = 1, .clearance = nan, .exempt = {}}),
                  ContractViolation);
  CHECK_THROWS_AS(
      make({.first = 0, .second = 1, .clearance = 1.0, .exempt = ExemptSphere{{0, 0, 0}, 1.0}}),
      ContractViolation);
  auto bad = bodies;
  bad[0].joint = 6;
  CHECK_THROWS_AS(Scene(chain, bad, {}), ContractViolation);
  const Scene scene = make({.first = 0, .second = 1, .clearance = 0.0, .exempt = {}});
  CHECK_THROWS_AS(scene.free(JointVector::Zero(5)), ContractViolation);
  CHECK_THROWS_AS(scene.free(JointVector::Constant(6, nan)), ContractViolation);
  CHECK_THROWS_AS(scene.clearance(JointVector::Zero(6), nan), ContractViolation);
  CHECK_THROWS_AS(scene.margin(1, scene.poses(JointVector::Zero(6)), 1.0), ContractViolation);
  SceneCache cache;
  scene.free(JointVector::Zero(6), &cache);
  const Scene other = make({.first = 0, .second = 1, .clearance = 0.0, .exempt = {}});
  CHECK_THROWS_AS(other.free(JointVector::Zero(6), &cache), ContractViolation);
  const Scene copy = scene;
  CHECK_NOTHROW(copy.free(JointVector::Zero(6), &cache));
}
