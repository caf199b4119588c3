#include "kernels/geometry/mesh_report.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <ctime>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "formats/mesh/stl_reader.h"
#include "kernels/core/contract.h"
#include "kernels/geometry/triangle_crossing.h"
#include "kernels/geometry/triangle_tree.h"
#include "tests/kernels/geometry/shapes.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

using Corners = std::array<Vec3, 3>;
using Lattice = Eigen::Matrix<std::int64_t, 3, 1>;

/// The definition in integers: the relative interiors of two convex sets are disjoint exactly when
/// a plane separates them and does not contain both. The normals that have to be tried are those of
/// the facets of the Minkowski difference.
bool cross_on_lattice(const std::array<Lattice, 3>& a, const std::array<Lattice, 3>& b) {
  const auto edge = [](const std::array<Lattice, 3>& t, std::size_t i) -> Lattice {
    return t[(i + 1) % 3] - t[i];
  };
  const Lattice na = edge(a, 0).cross(edge(a, 1));
  const Lattice nb = edge(b, 0).cross(edge(b, 1));
  std::vector<Lattice> normals{na, nb};
  for (std::size_t i = 0; i < 3; ++i) {
    normals.push_back(na.cross(edge(a, i)));
    normals.push_back(nb.cross(edge(b, i)));
    for (std::size_t j = 0; j < 3; ++j) normals.push_back(edge(a, i).cross(edge(b, j)));
  }
  for (const Lattice& n : normals) {
    std::int64_t lo = std::numeric_limits<std::int64_t>::max();
    std::int64_t hi = std::numeric_limits<std::int64_t>::min();
    for (const Lattice& p : a)
      for (const Lattice& q : b) {
        lo = std::min(lo, n.dot(q - p));
        hi = std::max(hi, n.dot(q - p));
      }
    if ((hi <= 0 || lo >= 0) && hi != lo) return false;  // separated, not in one plane both
    if (hi == lo && hi != 0) return false;               // parallel planes
  }
  return true;
}

std::array<Lattice, 3> lattice_triangle(std::mt19937& random, int side, bool flat) {
  std::uniform_int_distribution<int> place(0, side - 1);
  while (true) {
    std::array<Lattice, 3> t;
    for (Lattice& p : t) p = Lattice(place(random), place(random), flat ? 1 : place(random));
    if (!(t[1] - t[0]).cross(t[2] - t[0]).isZero()) return t;
  }
}

Corners corners(const std::array<Lattice, 3>& t) {
  return {t[0].cast<double>(), t[1].cast<double>(), t[2].cast<double>()};
}

test::Soup joined(std::vector<test::Soup> soups) {
  test::Soup out;
  for (const auto& soup : soups) out.insert(out.end(), soup.begin(), soup.end());
  return out;
}

test::Soup turned(test::Soup soup) {
  for (std::size_t i = 0; i < soup.size(); i += 3) std::swap(soup[i + 1], soup[i + 2]);
  return soup;
}

test::Soup without(test::Soup soup, std::vector<std::size_t> triangles) {
  std::sort(triangles.rbegin(), triangles.rend());
  for (const std::size_t t : triangles) {
    const auto at = soup.begin() + static_cast<std::ptrdiff_t>(3 * t);
    soup.erase(at, at + 3);
  }
  return soup;
}

SurfaceReport report_of(const test::Soup& soup) { return report_surface(weld(soup)); }

std::string codes(const SurfaceReport& report) {
  std::string all;
  for (const auto& d : surface_findings(report, "p.stl")) all += d.code + " ";
  return all;
}

}  // namespace

TEST_CASE("triangles_cross: as separating axes in integers say", "[kernels][geometry][paper]") {
  std::mt19937 random(21);
  int crossing = 0;
  int apart = 0;
  int in_plane = 0;
  for (const int side : {3, 4, 6, 50})
    for (int i = 0; i < 30000; ++i) {
      const bool flat = i % 5 == 0;
      const auto a = lattice_triangle(random, side, flat);
      const auto b = lattice_triangle(random, side, flat);
      const bool expected = cross_on_lattice(a, b);
      if (triangles_cross(corners(a), corners(b)) != expected ||
          triangles_cross(corners(b), corners(a)) != expected)
        FAIL(a[0].transpose() << ", " << a[1].transpose() << ", " << a[2].transpose() << " | "
                              << b[0].transpose() << ", " << b[1].transpose() << ", "
                              << b[2].transpose() << " expected " << expected);
      ++(expected ? crossing : apart);
      in_plane += flat && expected;
    }
  CHECK(crossing > 10000);
  CHECK(apart > 50000);
  CHECK(in_plane > 5000);
}

TEST_CASE("triangles_cross: exact where the distance is one unit in the last place",
          "[kernels][geometry]") {
  const Corners floor = {Vec3(0, 0, 1), Vec3(3, 0, 1), Vec3(0, 3, 1)};
  const double above = std::nextafter(1.0, 2.0);
  const double below = std::nextafter(1.0, 0.0);
  const auto wall = [](double foot) {
    return Corners{Vec3(0.5, 0.5, foot), Vec3(1, 0.5, foot), Vec3(0.7, 0.5, 5)};
  };
  CHECK(triangles_cross(floor, wall(below)));
  CHECK_FALSE(triangles_cross(floor, wall(1.0)));  // stands on it
  CHECK_FALSE(triangles_cross(floor, wall(above)));
}

TEST_CASE("report_surface: a closed box has nothing to report", "[kernels][geometry]") {
  const auto report = report_of(test::box({0, 0, 0}, {1, 2, 3}));
  CHECK(report.boundaries == 0);
  CHECK(report.components == 1);
  CHECK(report.closed_components == 1);
  CHECK(report.inside_out.count == 0);
  CHECK(report.crossings == 0);
  CHECK(report.crossings_complete);
  CHECK(surface_findings(report, "p.stl").empty());
  const auto none = report_surface({});
  CHECK(none.components == 0);
  CHECK(none.crossings_complete);
}

TEST_CASE("report_surface: a hole with its length and place", "[kernels][geometry]") {
  // The top (z = 3, triangles 2 and 3) of a box of 1 x 2 x 3.
  const auto soup = without(test::box({0, 0, 0}, {1, 2, 3}), {2, 3});
  const auto report = report_of(soup);
  REQUIRE(report.boundaries == 1);
  CHECK(report.longest_boundaries[0].edges == 4);
  CHECK(report.longest_boundaries[0].perimeter == Approx(6.0));
  CHECK(report.longest_boundaries[0].centre == Vec3(0.5, 1, 3));
  CHECK(report.closed_components == 0);
  CHECK(report.crossings == 0);
  const auto findings = surface_findings(report, "p.stl");
  REQUIRE(findings.size() == 1);
  CHECK(findings[0].code == "STL127");
  CHECK(findings[0].severity == Severity::note);
  CHECK(findings[0].text.find("6.00 mm round (4 edges), about (0.50, 1.00, 3.00)") !=
        std::string::npos);
  // The triangle that is named has an edge on the rim.
  const auto mesh = weld(soup);
  const auto& t = mesh.triangles[report.longest_boundaries[0].triangle];
  int on_rim = 0;
  for (const auto v : t) on_rim += mesh.vertices[v].z() == 3.0;
  CHECK(on_rim == 2);
}

TEST_CASE("report_surface: several boundaries with the longest first", "[kernels][geometry]") {
  // A sheet of 10 x 10 cells of 1 mm without three of them: one outer rim and three holes, two of
  // which meet in a corner and are one boundary.
  std::vector<std::size_t> cells;
  for (const std::size_t cell : {22U, 33U, 77U}) {
    cells.push_back(2 * cell);
    cells.push_back(2 * cell + 1);
  }
  const auto at = [](double u, double v) {
    return Vec3(std::round(10 * u), std::round(10 * v), 0.0);
  };
  const auto report = report_of(without(test::sheet(at, 10, 10), cells));
  REQUIRE(report.boundaries == 3);
  REQUIRE(report.longest_boundaries.size() == 3);
  CHECK(report.longest_boundaries[0].perimeter == 40.0);
  CHECK(report.longest_boundaries[0].edges == 40);
  CHECK(report.longest_boundaries[0].centre == Vec3(5, 5, 0));
  CHECK(report.longest_boundaries[1].perimeter == 8.0);
  CHECK(report.longest_boundaries[1].centre == Vec3(3, 3, 0));
  CHECK(report.longest_boundaries[2].perimeter == 4.0);
  CHECK(report.longest_boundaries[2].centre == Vec3(7.5, 7.5, 0));
  CHECK(report.components == 1);
  // More of them than are named.
  std::vector<std::size_t> many;
  for (std::size_t i = 1; i < 9; i += 2)
    for (std::size_t j = 1; j < 9; j += 2) {
      many.push_back(2 * (10 * i + j));
      many.push_back(2 * (10 * i + j) + 1);
    }
  const auto holes = report_of(without(test::sheet(at, 10, 10), many));
  CHECK(holes.boundaries == 17);
  CHECK(holes.longest_boundaries.size() == SurfaceReport::kNamed);
}

TEST_CASE("report_surface: boundary edges are the open edges", "[kernels][geometry]") {
  std::mt19937 random(5);
  std::size_t edges = 0;
  for (int run = 0; run < 30; ++run) {
    test::Soup soup;
    std::uniform_int_distribution<int> place(0, 2 + run % 3);
    for (int i = 0; i < 90; ++i) soup.push_back(Vec3(place(random), place(random), place(random)));
    const auto mesh = weld(soup);
    const auto report = report_surface(mesh);
    const auto open = describe(mesh).open.count;
    // All boundaries are listed when there are few.
    if (report.boundaries > SurfaceReport::kNamed) continue;
    std::size_t listed = 0;
    for (const auto& boundary : report.longest_boundaries) listed += boundary.edges;
    CHECK(listed == open);
    edges += open;
  }
  CHECK(edges > 300);
}

TEST_CASE("report_surface: two boxes that pass through each other", "[kernels][geometry]") {
  const auto a = test::box({0, 0, 0}, {2, 2, 2});
  const auto b = test::box({1.1, 0.9, 0.7}, {3.1, 2.9, 2.6});
  const auto report = report_of(joined({a, b}));
  CHECK(report.components == 2);
  CHECK(report.closed_components == 2);
  CHECK(report.inside_out.count == 0);
  // Brute force over all pairs.
  const auto mesh = weld(joined({a, b}));
  std::vector<std::pair<std::size_t, std::size_t>> expected;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t j = i + 1; j < mesh.triangles.size(); ++j) {
      const auto corner = [&](std::size_t t) {
        Corners c;
        for (std::size_t k = 0; k < 3; ++k) c[k] = mesh.vertices[mesh.triangles[t][k]];
        return c;
      };
      if (triangles_cross(corner(i), corner(j))) expected.emplace_back(i, j);
    }
  REQUIRE(expected.size() >= 6);
  CHECK(report.crossings == expected.size());
  expected.resize(SurfaceReport::kNamed);
  CHECK(report.crossing_triangles == expected);
  CHECK(report.crossings_complete);
  for (const auto& [i, j] : report.crossing_triangles) {
    CHECK(i < 12);
    CHECK(j >= 12);
  }
  const auto findings = surface_findings(report, "p.stl");
  REQUIRE(findings.size() == 1);
  CHECK(findings[0].code == "STL128");
  CHECK(findings[0].severity == Severity::warning);
  CHECK(findings[0].text.find(std::to_string(report.crossings) + " pairs") == 0);
}

TEST_CASE("report_surface: crossings of lattice soups as the integer test counts them",
          "[kernels][geometry]") {
  std::mt19937 random(31);
  std::size_t crossings = 0;
  for (int run = 0; run < 20; ++run) {
    std::vector<std::array<Lattice, 3>> triangles;
    test::Soup soup;
    for (int i = 0; i < 120; ++i) {
      triangles.push_back(lattice_triangle(random, 4 + run % 8, i % 4 == 0));
      for (const Lattice& p : triangles.back()) soup.push_back(p.cast<double>());
    }
    std::vector<std::pair<std::size_t, std::size_t>> expected;
    for (std::size_t i = 0; i < triangles.size(); ++i)
      for (std::size_t j = i + 1; j < triangles.size(); ++j) {
        const auto is_of = [&](const Lattice& p) {
          return std::find(triangles[i].begin(), triangles[i].end(), p) != triangles[i].end();
        };
        const bool same = std::all_of(triangles[j].begin(), triangles[j].end(), is_of);
        if (!same && cross_on_lattice(triangles[i], triangles[j])) expected.emplace_back(i, j);
      }
    const auto report = report_of(soup);
    REQUIRE(report.crossings == expected.size());
    if (expected.size() > SurfaceReport::kNamed) expected.resize(SurfaceReport::kNamed);
    REQUIRE(report.crossing_triangles == expected);
    crossings += report.crossings;
  }
  CHECK(crossings > 1000);
}

TEST_CASE("report_surface: touching is no crossing", "[kernels][geometry]") {
  const auto cube = test::box({0, 0, 0}, {2, 2, 2});
  // A face on a face, a smaller box that stands on a face, an edge on an edge, a corner in a face.
  CHECK(report_of(joined({cube, test::box({0.3, 0.4, 2}, {1.2, 1.1, 3})})).crossings > 0);
  const auto standing = test::Soup{Vec3(0.5, 0.5, 2), Vec3(1, 0.5, 2), Vec3(0.7, 0.5, 3)};
  CHECK(report_of(joined({cube, standing})).crossings == 0);
  CHECK(report_of(joined({cube, test::box({2, 2, 0}, {4, 4, 2})})).crossings == 0);
  const auto corner = test::Soup{Vec3(0.5, 0.6, 2), Vec3(1, 0.5, 3), Vec3(0.7, 1.5, 3)};
  CHECK(report_of(joined({cube, corner})).crossings == 0);
  // Fans and folds: neighbours that share a vertex or an edge do not cross unless they overlap.
  const auto fold = test::Soup{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0.4, 1, 0),
                               Vec3(1, 0, 0), Vec3(0, 0, 0), Vec3(0.5, 0.7, 0)};
  CHECK(report_of(fold).crossings == 1);
  auto opened = fold;
  opened[5].z() = 1e-12;
  CHECK(report_of(opened).crossings == 0);
}

TEST_CASE("report_surface: triangles without area and doubled ones are left out",
          "[kernels][geometry]") {
  const auto cube = test::box({0, 0, 0}, {2, 2, 2});
  const auto needle = test::Soup{Vec3(-1, 1, 1), Vec3(3, 1, 1), Vec3(5, 1, 1)};
  const auto point = test::Soup{Vec3(1, 1, 0), Vec3(1, 1, 0), Vec3(1, 1, 5)};
  const auto report = report_of(joined({cube, needle, point}));
  CHECK(report.crossings == 0);
  CHECK(report.crossings_complete);
  const auto twice = report_of(joined({cube, {cube[0], cube[1], cube[2]}}));
  CHECK(twice.crossings == 0);
}

TEST_CASE("report_surface: components inside out", "[kernels][geometry]") {
  const auto a = test::box({0, 0, 0}, {1, 1, 1});
  const auto b = test::box({5, 0, 0}, {6, 1, 1});
  const auto c = test::box({0, 5, 0}, {1, 6, 1});
  const auto report = report_of(joined({a, turned(b), c}));
  CHECK(report.components == 3);
  CHECK(report.closed_components == 3);
  CHECK(report.inside_out.count == 1);
  CHECK(report.inside_out.triangles == std::vector<std::size_t>{12});
  CHECK(report.cavities == 0);
  const auto findings = surface_findings(report, "p.stl");
  REQUIRE(findings.size() == 1);
  CHECK(findings[0].code == "STL129");
  CHECK(findings[0].text == "1 of 3 closed components wound inside out (triangle 13)");
  // Alone it is STL125 of mesh_findings already.
  CHECK(report_of(turned(a)).inside_out.count == 1);
  CHECK(codes(report_of(turned(a))).empty());
  // Boxes that touch in a vertex are two components, in an edge one that is not closed.
  CHECK(report_of(joined({a, test::box({1, 1, 1}, {2, 2, 2})})).closed_components == 2);
  const auto edge = report_of(joined({a, test::box({1, 1, 0}, {2, 2, 1})}));
  CHECK(edge.components == 1);
  CHECK(edge.closed_components == 0);
  // Of an open or inconsistent one nothing is said.
  CHECK(report_of(joined({without(turned(a), {0}), b})).inside_out.count == 0);
  auto inconsistent = turned(a);
  std::swap(inconsistent[1], inconsistent[2]);
  CHECK(report_of(joined({inconsistent, b})).inside_out.count == 0);
}

TEST_CASE("report_surface: cavities are no components inside out", "[kernels][geometry][paper]") {
  const auto outer = test::sphere({3, 4, 5}, 10.0, 12);
  const auto cavity = turned(test::sphere({4, 4, 5}, 3.0, 8));
  const auto report = report_of(joined({outer, cavity}));
  CHECK(report.closed_components == 2);
  CHECK(report.cavities == 1);
  CHECK(report.inside_out.count == 0);
  CHECK(codes(report).empty());
  // Beside the sphere, but inside its box: no cavity.
  const auto beside = turned(test::box({10.5, 11.5, 12.5}, {11, 12, 13}));
  const auto second = report_of(joined({outer, beside}));
  CHECK(second.cavities == 0);
  CHECK(second.inside_out.count == 1);
  // A shell in a cavity of a shell.
  const auto nested =
      report_of(joined({test::box({0, 0, 0}, {9, 9, 9}), turned(test::box({1, 1, 1}, {8, 8, 8})),
                        test::box({2, 2, 2}, {7, 7, 7}), turned(test::box({3, 3, 3}, {6, 6, 6}))}));
  CHECK(nested.cavities == 2);
  CHECK(nested.inside_out.count == 0);
}

TEST_CASE("report_surface: the work is bounded", "[kernels][geometry]") {
  // 600 triangles through one point: 179,700 pairs.
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  test::Soup soup;
  for (int i = 0; i < 600; ++i) {
    const Vec3 u(uniform(random), uniform(random), uniform(random));
    const Vec3 v(uniform(random), uniform(random), uniform(random));
    for (const Vec3& p : {Vec3(u + v), Vec3(u - 2 * v), Vec3(v - 2 * u)}) soup.push_back(p);
  }
  const auto mesh = weld(soup);
  const auto all = report_surface(mesh);
  CHECK(all.crossings_complete);
  CHECK(all.crossings > 20000);
  const auto some = report_surface(mesh, {.neighbours = 1000, .solid_angles = 0});
  CHECK_FALSE(some.crossings_complete);
  CHECK(some.crossings > 0);
  CHECK(some.crossings <= 1000);
  const auto findings = surface_findings(some, "p.stl");
  REQUIRE(findings.size() == 2);
  CHECK(findings[1].text.rfind("at least ", 0) == 0);
  const auto again = report_surface(mesh, {.neighbours = 1000, .solid_angles = 0});
  CHECK(again.crossings == some.crossings);
  CHECK(again.crossing_triangles == some.crossing_triangles);
  // Cavities that nobody may look for.
  const auto shell =
      joined({test::box({0, 0, 0}, {9, 9, 9}), turned(test::box({1, 1, 1}, {8, 8, 8}))});
  const auto undecided = report_surface(weld(shell), {.solid_angles = 5});
  CHECK(undecided.undecided == 1);
  CHECK(undecided.cavities == 0);
  CHECK(undecided.inside_out.count == 0);
}

TEST_CASE("report_surface: preconditions", "[kernels][geometry]") {
  TriangleMesh mesh = weld(test::box({0, 0, 0}, {1, 1, 1}));
  mesh.triangles.push_back({0, 1, 99});
  CHECK_THROWS_AS(report_surface(mesh), ContractViolation);
  mesh.triangles.back() = {0, 1, 2};
  mesh.vertices[0].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(report_surface(mesh), ContractViolation);
}

namespace {

/// Meshes of the corpus with more or less than 50,000 triangles: a line each.
void describe_corpus(bool large) {
  auto files = test::corpus_files("5_stl", {".stl", "formatdetection"});
  const auto robots = test::corpus_files("6_robot_model", {".stl"});
  files.insert(files.end(), robots.begin(), robots.end());
  if (files.empty()) {
    WARN("no reference material beside the checkout: nothing to test here");
    return;
  }
  std::string table =
      "file: triangles | open edges, boundaries | non-manifold | inconsistent | degenerate | "
      "components, closed, cavities, inside out | crossings | ms\n";
  std::map<std::string, int> counts;
  double slowest = 0.0;
  for (const auto& path : files) {
    const std::string name = path.filename().string();
    const auto stl = read_stl(test::read_bytes(path), name);
    if (!stl.ok()) {
      if (large) continue;
      REQUIRE_FALSE(stl.diagnostics().empty());
      table +=
          name + ": REFUSED " + stl.diagnostics()[0].code + " " + stl.diagnostics()[0].text + "\n";
      ++counts["refused by the reader"];
      continue;
    }
    if ((stl.value().triangles() > 50000) != large) continue;
    const auto mesh = weld(stl.value().corners);
    const auto parts = describe(mesh);
    const std::clock_t begin = std::clock();
    const auto surface = report_surface(mesh);
    const double time = 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    slowest = std::max(slowest, time);
    INFO(name);
    CHECK((surface.boundaries > 0) == (parts.open.count > 0));
    CHECK(surface.closed_components <= surface.components);
    CHECK(surface.cavities + surface.inside_out.count + surface.undecided <=
          surface.closed_components);
    CHECK(surface.crossings_complete);
    CHECK(surface.undecided == 0);
    for (const auto& [i, j] : surface.crossing_triangles) {
      CHECK(i < j);
      CHECK(j < parts.triangles);
    }
    CHECK_FALSE(has_error(surface_findings(surface, name)));
    const auto tree = build_triangle_tree(mesh);
    const bool messy = surface.crossings > 0 || surface.inside_out.count > 0 ||
                       parts.non_manifold.count > 0 || parts.inconsistent.count > 0;
    ++counts[!tree.ok() ? "refused by the tree" : messy ? "described, with warnings" : "described"];
    const auto n = [](std::size_t count) { return std::to_string(count); };
    table += name + ": " + n(parts.triangles) + " | " + n(parts.open.count) + ", " +
             n(surface.boundaries) + " | " + n(parts.non_manifold.count) + " | " +
             n(parts.inconsistent.count) + " | " + n(parts.degenerate.count) + " | " +
             n(surface.components) + ", " + n(surface.closed_components) + ", " +
             n(surface.cavities) + ", " + n(surface.inside_out.count) + " | " +
             n(surface.crossings) + " | " + n(static_cast<std::size_t>(time)) +
             (tree.ok() ? "" : " | REFUSED " + tree.diagnostics()[0].code) + "\n";
  }
  std::string sums;
  for (const auto& [what, count] : counts) sums += what + " " + std::to_string(count) + "; ";
  WARN(table << sums << "slowest " << slowest << " ms");
  if (large) {
    CHECK(counts["described, with warnings"] == 2);
    return;
  }
  CHECK(counts["described"] > 20);
  CHECK(counts["described, with warnings"] > 20);
  CHECK(counts["refused by the reader"] == 3);
}

}  // namespace

TEST_CASE("report_surface: every mesh of the corpus is described or refused with the reason",
          "[kernels][geometry][corpus]") {
  describe_corpus(false);
}

TEST_CASE("report_surface: the large meshes of the corpus are described",
          "[kernels][geometry][corpus][.slow]") {
  describe_corpus(true);
}
