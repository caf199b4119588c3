#include "kernels/collision/motion_check.h"

#include <thread>

#include "formats/mesh/stl_reader.h"
#include "kernels/core/contract.h"
#include "tests/kernels/collision/scenes.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

JointVector between(const JointVector& a, const JointVector& b, double t) {
  return (1.0 - t) * a + t * b;
}

/// A place of the head over the workshop, sometimes near to things.
JointVector random_place(std::mt19937& random) {
  const Vec3 axis = (Vec3(0, 0, 1) + 0.7 * test::random_vector(random, 1.0)).normalized();
  return test::laser_joints({test::uniform(random, -120, 120), test::uniform(random, -120, 120),
                             test::uniform(random, 0.5, 60)},
                            axis, test::uniform(random, -90, 10), 0.0);
}

/// Least margin over samples of a motion, and how many there are of them below 0.
struct Sampled {
  double least = std::numeric_limits<double>::infinity();
  bool free = true;
};
Sampled sample(const Scene& scene, const JointVector& from, const JointVector& to, int count) {
  Sampled out;
  SceneCache cache;
  for (int i = 0; i <= count; ++i) {
    const Clearance c = scene.clearance(between(from, to, double(i) / count), 5.0, &cache);
    out.least = std::min(out.least, c.margin);
    out.free = out.free && c.margin >= 0.0;
  }
  return out;
}

struct Path {
  TriangleMesh part;
  std::vector<JointVector> joints;
};

/// Case 2 of the reference data on the laser, standoff −50 mm.
std::optional<Path> case2() {
  const auto csv = test::shared_path("reference/case2.csv");
  const auto stl = test::shared_path("reference/case2.stl");
  if (!csv || !stl) return std::nullopt;
  Path out;
  const auto read = read_stl(test::read_bytes(*stl), "case2.stl");
  REQUIRE(read.ok());
  out.part = weld(read.value().corners);
  double c = 0.0;
  for (const auto& row : test::number_table(*csv)) {
    out.joints.push_back(test::laser_joints({row[0], row[1], row[2]},
                                            Vec3(row[3], row[4], row[5]).normalized(), -50.0, c));
    c = out.joints.back()[3];
  }
  return out;
}

}  // namespace

TEST_CASE("motion_check: never free where samples hit, free where they are clear",
          "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(51);
  const Scene scene = test::laser_scene(test::workshop());
  const MotionSettings settings{.resolution = 0.05, .deviation = {}};
  int counts[3] = {0, 0, 0};
  int clear = 0;
  for (int i = 0; i < 400; ++i) {
    const JointVector from = random_place(random);
    const JointVector to =
        i % 2 ? random_place(random) : JointVector(from + 0.05 * (random_place(random) - from));
    const MotionReport report = check_motion(scene, from, to, settings);
    ++counts[static_cast<int>(report.verdict)];
    const Sampled sampled = sample(scene, from, to, i % 2 ? 400 : 100);
    if (report.verdict == MotionVerdict::free) REQUIRE(sampled.free);
    if (report.verdict == MotionVerdict::hit) {
      const Clearance there = scene.clearance(between(from, to, report.t));
      REQUIRE(there.margin < 0.0);
      REQUIRE(report.at.upper < 0.0);
      REQUIRE(report.pair < 2);
    }
    // Between samples a margin falls by half of what moves from one to the next at most.
    double fall = 0.0;
    for (std::size_t pair = 0; pair < 2; ++pair)
      fall = std::max(fall, scene.movement_bound(pair, from, to).travel / (i % 2 ? 800.0 : 200.0));
    if (sampled.least - fall > 0.06) {
      ++clear;
      REQUIRE(report.verdict == MotionVerdict::free);
    }
    if (report.verdict == MotionVerdict::undecided) REQUIRE(sampled.least < 0.06 + fall);
  }
  CAPTURE(counts[0], counts[1], counts[2], clear);
  CHECK(counts[0] > 60);
  CHECK(counts[1] > 100);
  CHECK(clear > 50);
}

TEST_CASE("motion_check: a thin wall between two free places is found", "[kernels][collision]") {
  NEEDS_TREE();
  // A single upright triangle without thickness; the nozzle passes it in one step.
  const Scene scene = test::laser_scene(weld({{0, -300, -300}, {0, 300, -300}, {0, 0, 600}}), 0.0);
  for (const double reach : {30.0, 100.0, 700.0}) {
    const JointVector from = test::laser_joints({-reach - 70, 0, 0}, Vec3::UnitZ(), 0.0, 0.0);
    const JointVector to = test::laser_joints({2 * reach + 70, 0, 0}, Vec3::UnitZ(), 0.0, 0.0);
    REQUIRE(scene.free(from));
    REQUIRE(scene.free(to));
    const MotionReport report = check_motion(scene, from, to);
    CHECK(report.verdict == MotionVerdict::hit);
    CHECK_FALSE(scene.free(between(from, to, report.t)));
    const MotionReport past =
        check_motion(scene, from, between(from, to, 0.1 * reach / (3 * reach + 140)));
    CHECK(past.verdict == MotionVerdict::free);
  }
}

TEST_CASE("motion_check: the ends belong to the motion", "[kernels][collision]") {
  NEEDS_TREE();
  const Scene scene = test::laser_scene(test::workshop());
  const JointVector good = test::laser_joints({0, 40, 20}, Vec3::UnitZ(), -60.0, 0.0);
  const JointVector bad = test::laser_joints({33.2, 40, 20}, Vec3::UnitZ(), -60.0, 0.0);
  REQUIRE(scene.free(good));
  REQUIRE_FALSE(scene.free(bad));
  CHECK(check_motion(scene, good, good).verdict == MotionVerdict::free);
  CHECK(check_motion(scene, bad, bad).verdict == MotionVerdict::hit);
  CHECK(check_motion(scene, good, bad).verdict != MotionVerdict::free);
  CHECK(check_motion(scene, bad, good).verdict != MotionVerdict::free);
}

TEST_CASE("motion_check: a margin that is too small to divide is undecided",
          "[kernels][collision]") {
  NEEDS_TREE();
  // A slot: 54 mm between two walls, the casing of 50 mm with 1.99 mm required on either side.
  auto soup = test::box({-100, 27, 0}, {100, 30, 300});
  const auto other = test::box({-100, -30, 0}, {100, -27, 300});
  soup.insert(soup.end(), other.begin(), other.end());
  const Scene scene(
      test::laser_chain(),
      {{.name = "casing",
        .joint = test::kB,
        .shape = ConvexShape::frustum(
            {.from = {0, 0, 10}, .to = {0, 0, 200}, .radius_from = 25.0, .radius_to = 25.0})},
       test::part_body(weld(soup))},
      {{.first = 0, .second = 1, .clearance = 1.99, .exempt = {}}});
  JointVector from = JointVector::Zero(6);
  from[0] = -50;
  JointVector to = from;
  to[0] = 50;
  const auto coarse = check_motion(scene, from, to, {.resolution = 0.05, .deviation = {}});
  CHECK(coarse.verdict == MotionVerdict::undecided);
  CHECK(coarse.pair == 0);
  CHECK(coarse.at.lower == Approx(0.01).margin(1e-5));
  CHECK(check_motion(scene, from, to, {.resolution = 0.009, .deviation = {}}).verdict ==
        MotionVerdict::free);
  // A deviation that takes the rest away can never be proven.
  JointVector off = JointVector::Zero(6);
  off[1] = 0.011;
  CHECK(check_motion(scene, from, to, {.resolution = 0.005, .deviation = off}).verdict ==
        MotionVerdict::undecided);
  off[1] = 0.004;
  CHECK(check_motion(scene, from, to, {.resolution = 0.005, .deviation = off}).verdict ==
        MotionVerdict::free);
}

TEST_CASE("motion_check: free with a deviation is free all around", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(52);
  const Scene scene = test::laser_scene(test::workshop());
  JointVector deviation(6);
  deviation << 0.5, 0.5, 0.3, 0.01, 0.01, 0.5;
  int free = 0;
  int lost = 0;
  for (int i = 0; i < 300; ++i) {
    const JointVector from = random_place(random);
    const JointVector to = from + 0.1 * (random_place(random) - from);
    const auto report = check_motion(scene, from, to, {.resolution = 0.1, .deviation = deviation});
    if (report.verdict != MotionVerdict::free) {
      lost += check_motion(scene, from, to).verdict == MotionVerdict::free;
      continue;
    }
    ++free;
    SceneCache cache;
    for (int k = 0; k <= 200; ++k) {
      JointVector q = between(from, to, k / 200.0);
      // Corners of the box are the worst of what is allowed.
      for (int j = 0; j < 6; ++j) q[j] += (random() & 1 ? 1.0 : -1.0) * deviation[j];
      REQUIRE(scene.free(q, &cache));
    }
  }
  CHECK(free > 80);
  CHECK(lost > 3);
}

TEST_CASE("motion_check: reports with a cache are those without", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(53);
  const Scene scene = test::laser_scene(test::workshop());
  JointVector deviation = JointVector::Constant(6, 0.002);
  SceneCache cache;
  std::size_t with = 0;
  std::size_t without = 0;
  int verdicts[3] = {0, 0, 0};
  JointVector from = random_place(random);
  for (int i = 0; i < 800; ++i) {
    const JointVector to = i % 40 == 39 ? random_place(random)
                                        : JointVector(from + 0.02 * (random_place(random) - from));
    MotionSettings settings{.resolution = 0.05, .deviation = {}};
    if (i % 2) settings.deviation = deviation;
    const auto plain = check_motion(scene, from, to, settings);
    const auto cached = check_motion(scene, from, to, settings, &cache);
    REQUIRE(cached.verdict == plain.verdict);
    REQUIRE(cached.t == plain.t);
    REQUIRE(cached.pair == plain.pair);
    REQUIRE(cached.at.on_first == plain.at.on_first);
    REQUIRE(plain.skipped == 0);
    ++verdicts[static_cast<int>(plain.verdict)];
    if (plain.verdict == MotionVerdict::free) {
      with += cached.queries;
      without += plain.queries;
    }
    from = to;
  }
  CHECK(verdicts[0] > 100);
  CHECK(verdicts[1] > 50);
  CHECK(2 * with < without);
}

TEST_CASE("motion_check: bodies of the machine that fold onto each other", "[kernels][collision]") {
  const Scene scene(
      test::laser_chain(),
      {{.name = "arm", .joint = 2, .shape = ConvexShape::capsule({0, 0, 0}, {100, 0, 0}, 5.0)},
       {.name = "hand", .joint = 4, .shape = ConvexShape::capsule({60, 0, 0}, {100, 0, 0}, 5.0)}},
      {{.first = 0, .second = 1, .clearance = 1.0, .exempt = {}}});
  JointVector from = JointVector::Zero(6);
  from[3] = -1.0;
  JointVector to = from;
  to[3] = 1.0;
  // The hand sweeps through the arm; both ends are free.
  REQUIRE(scene.free(from));
  REQUIRE(scene.free(to));
  CHECK(check_motion(scene, from, to).verdict == MotionVerdict::hit);
  from[4] = to[4] = -0.5;  // lifted over it
  CHECK(check_motion(scene, from, to).verdict == MotionVerdict::free);
  to[3] = -0.3;
  CHECK(check_motion(scene, from, to).queries <= 30);
}

TEST_CASE("motion_check: Case 2 is proven free or hit as brute force says",
          "[kernels][collision]") {
  NEEDS_TREE();
  const auto path = case2();
  if (!path) {
    WARN("no ../shared/reference: skipped");
    return;
  }
  REQUIRE(path->joints.size() == 628);
  const Scene scene = test::laser_scene(path->part);
  SceneCache cache;
  std::size_t queries = 0;
  int free = 0;
  for (std::size_t i = 0; i + 1 < path->joints.size(); ++i) {
    const auto report = check_motion(scene, path->joints[i], path->joints[i + 1], {}, &cache);
    queries += report.queries;
    free += report.verdict == MotionVerdict::free;
  }
  CAPTURE(free, queries);
  CHECK(free == 627);
  CHECK(queries < 4 * 627);
  // The casing by definition, triangle by triangle, at every fortieth location.
  for (std::size_t i = 0; i < path->joints.size(); i += 40) {
    const LinkPoses links = link_poses(scene.chain(), path->joints[i]);
    const double expected = test::mesh_distance(
        path->part, test::posed(test::frustum_distance(test::kCasing), links[test::kB + 1]));
    const PairMargin found = scene.margin(1, scene.poses(path->joints[i]), 1e6);
    REQUIRE(found.distance == Approx(expected).margin(1e-3));
  }
}

TEST_CASE("motion_check: the same reports on any number of threads", "[kernels][collision]") {
  NEEDS_TREE();
  std::mt19937 random(54);
  const Scene scene = test::laser_scene(test::workshop());
  std::vector<JointVector> places;
  for (int i = 0; i < 200; ++i) places.push_back(random_place(random));
  const auto run = [&](std::size_t threads) {
    std::vector<MotionReport> out(places.size() - 1);
    std::vector<std::thread> workers;
    for (std::size_t k = 0; k < threads; ++k)
      workers.emplace_back([&, k] {
        SceneCache cache;
        for (std::size_t i = k; i + 1 < places.size(); i += threads)
          out[i] = check_motion(scene, places[i], places[i + 1], {}, &cache);
      });
    for (auto& worker : workers) worker.join();
    return out;
  };
  const auto one = run(1);
  const auto three = run(3);
  for (std::size_t i = 0; i < one.size(); ++i) {
    REQUIRE(one[i].verdict == three[i].verdict);
    REQUIRE(one[i].t == three[i].t);
    REQUIRE(one[i].at.on_second == three[i].at.on_second);
  }
}

TEST_CASE("motion_check: preconditions", "[kernels][collision]") {
  const Scene scene(test::laser_chain(), {test::nozzle_body()}, {});
  const JointVector q = JointVector::Zero(6);
  CHECK(check_motion(scene, q, q).verdict == MotionVerdict::free);
  CHECK_THROWS_AS(check_motion(scene, q, JointVector::Zero(5)), ContractViolation);
  CHECK_THROWS_AS(check_motion(scene, q, q, {.resolution = 0.0, .deviation = {}}),
                  ContractViolation);
  CHECK_THROWS_AS(check_motion(scene, q, q, {.resolution = 0.1, .deviation = JointVector::Zero(5)}),
                  ContractViolation);
  CHECK_THROWS_AS(
      check_motion(scene, q, q, {.resolution = 0.1, .deviation = JointVector::Constant(6, -1.0)}),
      ContractViolation);
}
