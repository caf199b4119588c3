#include "kernels/geometry/part_registration.h"

#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "formats/mesh/stl_reader.h"
#include "kernels/core/contract.h"
#include "kernels/geometry/weld.h"
#include "tests/kernels/geometry/shapes.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

using Points = std::vector<CutterLocation>;

TriangleTree tree_of(const TriangleMesh& mesh) {
  auto tree = build_triangle_tree(mesh);
  REQUIRE(tree.ok());
  return std::move(tree.value());
}
TriangleTree tree_of(const test::Soup& soup) { return tree_of(weld(soup)); }

Points shifted(Points points, const Vec3& by) {
  for (auto& p : points) p.tip += by;
  return points;
}
Points scaled(Points points, double ratio) {
  for (auto& p : points) p.tip *= ratio;
  return points;
}
Points mirrored(Points points, int axis) {
  for (auto& p : points) {
    p.tip[axis] = -p.tip[axis];
    p.axis[axis] = -p.axis[axis];
  }
  return points;
}
test::Soup scaled_soup(test::Soup soup, double ratio) {
  for (auto& v : soup) v *= ratio;
  return soup;
}

test::Soup turned(test::Soup soup) {
  for (std::size_t i = 0; i < soup.size(); i += 3) std::swap(soup[i + 1], soup[i + 2]);
  return soup;
}

const RegistrationSettings kOneMillimetre{
    .nominal_gap = 1.0, .allowed_gap_deviation = 0.3, .allowed_angle = radians_from_degrees(15.0)};

/// Deviation and angle of a point from the definition: both limits hold for at least 95 % of the
/// points.
bool within_by_definition(const Points& points, const TriangleTree& tree,
                          const RegistrationSettings& settings) {
  std::size_t gaps = 0;
  std::size_t angles = 0;
  for (const auto& p : points) {
    const auto c = tree.closest(p.tip);
    // Sheets: the side of the tool.
    const double side = p.axis.dot(c.normal) < 0.0 ? -1.0 : 1.0;
    gaps +=
        std::abs(side * c.signed_distance - settings.nominal_gap) <= settings.allowed_gap_deviation;
    angles += angle_between(p.axis, side * c.normal) <= settings.allowed_angle;
  }
  return 20 * gaps >= 19 * points.size() && 20 * angles >= 19 * points.size();
}

/// Tips and axes of one of the reference CSV files (x, y, z, i, j, k, ...).
Points reference_points(const std::string& name) {
  Points points;
  const std::string text = test::read_bytes(*test::shared_path("reference/" + name));
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin);
    begin = end + 1;
    CutterLocation p;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf", &p.tip[0], &p.tip[1], &p.tip[2],
                    &p.axis[0], &p.axis[1], &p.axis[2]) != 6)
      continue;
    p.axis.normalize();
    points.push_back(p);
  }
  return points;
}

TriangleMesh reference_mesh(const std::string& name) {
  const auto stl = read_stl(test::read_bytes(*test::shared_path("reference/" + name)), name);
  REQUIRE(stl.ok());
  return weld(stl.value().corners);
}

#define NEEDS_TREE()                                  \
  if (!triangle_tree_available()) {                   \
    WARN("built without CGAL: nothing to test here"); \
    return;                                           \
  }
#define NEEDS_REFERENCE()                                                    \
  NEEDS_TREE();                                                              \
  if (!test::shared_path("reference/case2.stl")) {                           \
    WARN("no reference material beside the checkout: nothing to test here"); \
    return;                                                                  \
  }

}  // namespace

TEST_CASE("part_registration: a contour on its part", "[kernels][geometry]") {
  NEEDS_TREE();
  const auto tree = tree_of(test::bowl());
  const auto points = test::contour_on_bowl(1.0);
  const auto r = register_part(points, tree, kOneMillimetre);
  CHECK(r.verdict == RegistrationVerdict::registered);
  CHECK(registration_code(r.verdict).empty());
  CHECK(r.gap.points == points.size());
  CHECK(r.gap.within == points.size());
  CHECK(r.gap.min > 0.98);
  CHECK(r.gap.max < 1.02);
  CHECK(r.gap.worst_deviation == Approx(std::max(1.0 - r.gap.min, r.gap.max - 1.0)));
  CHECK(r.gap.worst_angle < radians_from_degrees(2.0));
  CHECK(r.gap.median_angle <= r.gap.worst_angle);
  CHECK(r.unseen.empty());
  const auto gaps = measure_gaps(points, tree, kOneMillimetre);
  CHECK(gaps.worst_deviation == r.gap.worst_deviation);
  CHECK_FALSE(gaps.sides_exchanged);
  const auto again = register_part(points, tree, kOneMillimetre);
  CHECK(again.sentence == r.sentence);
}

TEST_CASE("part_registration: program or part 25.4 times too large or small",
          "[kernels][geometry]") {
  NEEDS_TREE();
  const auto soup = test::bowl();
  const auto points = test::contour_on_bowl(1.0);
  struct Case {
    double program, part, ratio;
    UnitSuspect suspect;
  };
  for (const Case& c :
       {Case{25.4, 1, 1 / 25.4, UnitSuspect::program},
        Case{1 / 25.4, 1, 25.4, UnitSuspect::program}, Case{1, 25.4, 25.4, UnitSuspect::part},
        Case{1, 1 / 25.4, 1 / 25.4, UnitSuspect::part}}) {
    const auto tree = tree_of(scaled_soup(soup, c.part));
    const auto r = register_part(scaled(points, c.program), tree, kOneMillimetre);
    INFO(r.sentence);
    REQUIRE(r.verdict == RegistrationVerdict::unit_ratio);
    CHECK(r.program_ratio == Approx(c.ratio));
    CHECK(r.suspect == c.suspect);
    CHECK(r.explained.within == points.size());
    CHECK(r.explained.worst_deviation < 0.05);
    CHECK(r.sentence.find("25.4") != std::string::npos);
  }
}

TEST_CASE("part_registration: shifted programs, and the shift is found", "[kernels][geometry]") {
  NEEDS_TREE();
  const auto tree = tree_of(test::bowl());
  const auto points = test::contour_on_bowl(1.0);
  for (const Vec3& by : {Vec3(3, -2, 5), Vec3(0, 0, 1), Vec3(-18, 11, 40), Vec3(700, 600, 1000)}) {
    const auto moved = shifted(points, by);
    const auto r = register_part(moved, tree, kOneMillimetre);
    INFO(r.sentence);
    REQUIRE(r.verdict == RegistrationVerdict::offset);
    CHECK((r.offset + by).norm() < 0.1);
    CHECK(within_by_definition(shifted(moved, r.offset), tree, kOneMillimetre));
    CHECK(r.unseen.empty());
    CHECK(r.gap.within < r.gap.points);
  }
}

TEST_CASE("part_registration: mirrored programs", "[kernels][geometry]") {
  NEEDS_TREE();
  const auto tree = tree_of(test::bowl());
  const auto points = test::contour_on_bowl(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto r = register_part(mirrored(points, axis), tree, kOneMillimetre);
    INFO(r.sentence);
    REQUIRE(r.verdict == RegistrationVerdict::mirrored);
    CHECK(r.mirror_axis == axis);
    CHECK(r.offset.norm() == 0.0);
    CHECK(r.sentence.find("XYZ"[axis]) != std::string::npos);
  }
  // Mirrored about a plane of its own.
  const auto image = shifted(mirrored(points, 0), {40, 0, 0});
  const auto r = register_part(image, tree, kOneMillimetre);
  INFO(r.sentence);
  REQUIRE(r.verdict == RegistrationVerdict::mirrored);
  CHECK(r.mirror_axis == 0);
  CHECK((r.offset - Vec3(40, 0, 0)).norm() < 0.1);
  CHECK(within_by_definition(shifted(mirrored(image, 0), r.offset), tree, kOneMillimetre));
}

TEST_CASE("part_registration: another part, outliers, turned triangles, tilted axes",
          "[kernels][geometry]") {
  NEEDS_TREE();
  const auto soup = test::bowl();
  const auto points = test::contour_on_bowl(1.0);
  SECTION("another part") {
    const auto tree = tree_of(test::sphere({20, 20, 0}, 60.0, 60));
    const auto r = register_part(points, tree, kOneMillimetre);
    INFO(r.sentence);
    CHECK(r.verdict == RegistrationVerdict::wrong_part);
    CHECK(registration_code(r.verdict) == "RG117");
    CHECK_FALSE(within_by_definition(points, tree, kOneMillimetre));
  }
  SECTION("few points off the part") {
    auto some = points;
    for (std::size_t i = 300; i < 310; ++i) some[i].tip += 4.0 * some[i].axis;
    const auto r = register_part(some, tree_of(soup), kOneMillimetre);
    CHECK(r.verdict == RegistrationVerdict::outliers);
    CHECK(r.gap.within == points.size() - 10);
    CHECK(r.gap.worst >= 300);
    CHECK(r.gap.worst < 310);
    CHECK(r.gap.worst_deviation == Approx(4.0).margin(0.1));
  }
  SECTION("a sheet facing away has no outside: its other side is taken, and that is said") {
    const auto tree = tree_of(turned(soup));
    const auto r = register_part(points, tree, kOneMillimetre);
    INFO(r.sentence);
    CHECK(r.verdict == RegistrationVerdict::registered);
    CHECK(r.gap.sides_exchanged);
    CHECK(r.gap.min > 0.9);
    CHECK(r.sentence.find("face away") != std::string::npos);
    const auto moved = register_part(shifted(points, {3, -2, 5}), tree, kOneMillimetre);
    CHECK(moved.verdict == RegistrationVerdict::offset);
    CHECK((moved.offset - Vec3(-3, 2, -5)).norm() < 0.1);
  }
  SECTION("a solid turned inside out") {
    const auto ball = test::sphere({20, 20, 0}, 60.0, 60);
    Points on_ball;
    for (int i = 0; i < 200; ++i) {
      const double a = 0.1 + 0.01 * i;
      const Vec3 n = Vec3(std::cos(a), std::sin(a), 0.3 + 0.002 * i).normalized();
      on_ball.push_back({Vec3(20, 20, 0) + 61.0 * n, n});
    }
    REQUIRE(register_part(on_ball, tree_of(ball), kOneMillimetre).verdict ==
            RegistrationVerdict::registered);
    const auto r = register_part(on_ball, tree_of(turned(ball)), kOneMillimetre);
    INFO(r.sentence);
    CHECK(r.verdict == RegistrationVerdict::reversed_triangles);
    CHECK(r.gap.max < 0.0);
    CHECK(r.explained.within == on_ball.size());
    // Inside the right way round is a shift or a wrong part, never a reversed one.
    Points below = on_ball;
    for (auto& p : below) p.tip -= 2.0 * p.axis;
    CHECK(register_part(below, tree_of(ball), kOneMillimetre).verdict !=
          RegistrationVerdict::reversed_triangles);
  }
  SECTION("axes that do not follow the surface") {
    auto tilted = points;
    for (auto& p : tilted) p.axis = rotation_about(Vec3::UnitX(), 0.6) * p.axis;
    const auto r = register_part(tilted, tree_of(soup), kOneMillimetre);
    INFO(r.sentence);
    CHECK(r.verdict == RegistrationVerdict::tilted_axes);
    CHECK(r.gap.median_angle == Approx(0.6).margin(0.15));
  }
  SECTION("noise beyond what is allowed is no shift") {
    auto noisy = points;
    std::mt19937 random(2);
    std::uniform_real_distribution<double> u(-4.0, 4.0);
    for (auto& p : noisy) p.tip += u(random) * p.axis;
    CHECK(register_part(noisy, tree_of(soup), kOneMillimetre).verdict ==
          RegistrationVerdict::wrong_part);
  }
}

TEST_CASE("part_registration: what cannot be seen is said", "[kernels][geometry]") {
  NEEDS_TREE();
  SECTION("flat sheet") {
    const auto tree =
        tree_of(test::sheet([](double u, double v) { return Vec3(100 * u, 80 * v, 7); }, 10, 8));
    Points points;
    for (int i = 0; i < 60; ++i) points.push_back({Vec3(20 + i, 30 + 0.3 * i, 8.0), Vec3::UnitZ()});
    const auto on = register_part(points, tree, kOneMillimetre);
    CHECK(on.verdict == RegistrationVerdict::registered);
    REQUIRE(on.unseen.size() == 2);
    for (const Vec3& d : on.unseen) CHECK(std::abs(d.z()) < 1e-9);
    const auto r = register_part(shifted(points, {4, -3, 2.5}), tree, kOneMillimetre);
    REQUIRE(r.verdict == RegistrationVerdict::offset);
    CHECK((r.offset - Vec3(0, 0, -2.5)).norm() < 1e-6);
    CHECK(r.unseen.size() == 2);
  }
  SECTION("a bend extruded along y") {
    const auto at = [](double s, double y) { return test::bend_point(s, y); };
    const auto tree =
        tree_of(test::sheet([&](double u, double v) { return at(140 * u, 100 * v); }, 280, 10));
    Points points;
    for (int i = 0; i < 100; ++i) {
      Vec3 normal;
      const Vec3 p = test::bend_point(20 + i, 30 + 0.4 * i, &normal);
      points.push_back({p + normal, normal});
    }
    REQUIRE(register_part(points, tree, kOneMillimetre).verdict == RegistrationVerdict::registered);
    const auto r = register_part(shifted(points, {3, -2, 5}), tree, kOneMillimetre);
    INFO(r.sentence);
    REQUIRE(r.verdict == RegistrationVerdict::offset);
    REQUIRE(r.unseen.size() == 1);
    CHECK(std::abs(std::abs(r.unseen[0].y()) - 1.0) < 1e-6);
    CHECK((r.offset - Vec3(-3, 0, -5)).norm() < 0.1);
  }
}

TEST_CASE("part_registration: Case 2 of paper B", "[kernels][geometry][paper]") {
  NEEDS_REFERENCE();
  const auto points = reference_points("case2.csv");
  REQUIRE(points.size() == 628);
  const auto mesh = reference_mesh("case2.stl");
  const auto tree = tree_of(mesh);
  const auto on = register_part(points, tree, kOneMillimetre);
  INFO(on.sentence);
  REQUIRE(on.verdict == RegistrationVerdict::registered);

  const auto large = register_part(scaled(points, 25.4), tree, kOneMillimetre);
  CHECK(large.verdict == RegistrationVerdict::unit_ratio);
  CHECK(large.program_ratio == Approx(1 / 25.4));
  const auto small = register_part(scaled(points, 1 / 25.4), tree, kOneMillimetre);
  CHECK(small.verdict == RegistrationVerdict::unit_ratio);
  CHECK(small.program_ratio == Approx(25.4));

  const auto moved = register_part(shifted(points, {3, -2, 5}), tree, kOneMillimetre);
  INFO(moved.sentence);
  REQUIRE(moved.verdict == RegistrationVerdict::offset);
  Vec3 error = moved.offset + Vec3(3, -2, 5);
  for (const Vec3& d : moved.unseen) error -= d * d.dot(error);
  CHECK(error.norm() < 0.3);
  CHECK(within_by_definition(shifted(points, Vec3(3, -2, 5) + moved.offset), tree, kOneMillimetre));

  const auto image = register_part(mirrored(points, 0), tree, kOneMillimetre);
  INFO(image.sentence);
  CHECK(image.verdict == RegistrationVerdict::mirrored);
  CHECK(image.mirror_axis == 0);

  const auto other = tree_of(reference_mesh("case1.stl"));
  const auto wrong = register_part(points, other, kOneMillimetre);
  INFO(wrong.sentence);
  CHECK(wrong.verdict == RegistrationVerdict::wrong_part);
  CHECK(register_part(reference_points("case1.csv"), other, kOneMillimetre).verdict ==
        RegistrationVerdict::registered);
  CHECK(register_part(reference_points("case1.csv"), tree, kOneMillimetre).verdict ==
        RegistrationVerdict::wrong_part);
}

TEST_CASE("part_registration: preconditions", "[kernels][geometry]") {
  NEEDS_TREE();
  const auto tree = tree_of(test::box({0, 0, 0}, {1, 1, 1}));
  const Points point{{Vec3(0, 0, 2), Vec3::UnitZ()}};
  CHECK_THROWS_AS(register_part({}, tree, kOneMillimetre), ContractViolation);
  CHECK_THROWS_AS(register_part({{Vec3(0, 0, 2), Vec3(0, 0, 2)}}, tree, kOneMillimetre),
                  ContractViolation);
  CHECK_THROWS_AS(register_part(point, tree, {.nominal_gap = -1.0}), ContractViolation);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(register_part({{Vec3(0, nan, 2), Vec3::UnitZ()}}, tree, kOneMillimetre),
                  ContractViolation);
}
