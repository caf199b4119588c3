#include "kernels/geometry/weld.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "kernels/core/contract.h"
#include "tests/kernels/geometry/shapes.h"

using namespace smoothpost;

namespace {

using Key = std::array<double, 3>;
Key key(const Vec3& v) { return {v.x() + 0.0, v.y() + 0.0, v.z() + 0.0}; }

/// Corners on a lattice of `side`³ places, some written with −0.
test::Soup lattice_soup(std::mt19937& random, int side, int triangles) {
  std::uniform_int_distribution<int> place(0, side - 1);
  test::Soup soup;
  for (int i = 0; i < 3 * triangles; ++i) {
    Vec3 v(place(random), place(random), place(random));
    for (int k = 0; k < 3; ++k)
      if (v[k] == 0.0 && place(random) % 2) v[k] = -0.0;
    soup.push_back(v);
  }
  return soup;
}

}  // namespace

TEST_CASE("weld: a box has 8 vertices and keeps its 12 triangles", "[kernels][geometry]") {
  const auto soup = test::box({0, 0, 0}, {1, 2, 3});
  const auto mesh = weld(soup);
  REQUIRE(mesh.vertices.size() == 8);
  REQUIRE(mesh.triangles.size() == 12);
  for (std::size_t i = 0; i < soup.size(); ++i)
    CHECK(mesh.vertices[mesh.triangles[i / 3][i % 3]] == soup[i]);
}

TEST_CASE("weld: same corners, distinct vertices in order of appearance", "[kernels][geometry]") {
  std::mt19937 random(1);
  int soups = 0;
  for (const int side : {1, 2, 5, 40})
    for (const int triangles : {1, 7, 3000}) {
      const auto soup = lattice_soup(random, side, triangles);
      const auto mesh = weld(soup);
      std::map<Key, std::uint32_t> places;
      for (std::size_t i = 0; i < soup.size(); ++i) {
        const auto [at, fresh] =
            places.try_emplace(key(soup[i]), static_cast<std::uint32_t>(places.size()));
        REQUIRE(mesh.triangles[i / 3][i % 3] == at->second);
        REQUIRE(key(mesh.vertices[at->second]) == at->first);
      }
      REQUIRE(mesh.vertices.size() == places.size());
      for (const Vec3& v : mesh.vertices)
        for (int k = 0; k < 3; ++k) REQUIRE_FALSE((v[k] == 0.0 && std::signbit(v[k])));
      ++soups;
    }
  CHECK(soups == 12);
}

TEST_CASE("weld: a difference in the last bit keeps vertices apart", "[kernels][geometry]") {
  const double x = std::nextafter(1.0, 2.0);
  const auto mesh = weld({{1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {x, 0, 0}, {2, 0, 0}, {0, 1, 0}});
  CHECK(mesh.vertices.size() == 4);
}

TEST_CASE("weld: preconditions", "[kernels][geometry]") {
  CHECK_THROWS_AS(weld({{0, 0, 0}}), ContractViolation);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(weld({{0, 0, 0}, {1, 0, 0}, {0, nan, 0}}), ContractViolation);
  CHECK(weld({}).triangles.empty());
  TriangleMesh bad;
  bad.triangles.push_back({0, 1, 2});
  CHECK_THROWS_AS(describe(bad), ContractViolation);
}

TEST_CASE("describe: a closed box", "[kernels][geometry]") {
  const auto report = describe(weld(test::box({-1, 0, 5}, {1, 3, 10})));
  CHECK(report.vertices == 8);
  CHECK(report.triangles == 12);
  CHECK(report.closed());
  CHECK(report.degenerate.count == 0);
  CHECK(report.duplicate.count == 0);
  CHECK(report.inconsistent.count == 0);
  CHECK(report.components == 1);
  CHECK(report.signed_volume == Approx(30.0));
  CHECK(report.area == Approx(2.0 * (6.0 + 10.0 + 15.0)));
  CHECK(report.min == Vec3(-1, 0, 5));
  CHECK(report.max == Vec3(1, 3, 10));
  CHECK(mesh_findings(report, "box.stl").empty());
}

TEST_CASE("describe: inside out, open, inverted, doubled and degenerate triangles are counted",
          "[kernels][geometry]") {
  const auto soup = test::box({0, 0, 0}, {1, 1, 1});
  SECTION("inside out") {
    auto turned = soup;
    for (std::size_t i = 0; i < turned.size(); i += 3) std::swap(turned[i + 1], turned[i + 2]);
    const auto report = describe(weld(turned));
    CHECK(report.closed());
    CHECK(report.inconsistent.count == 0);
    CHECK(report.signed_volume == Approx(-1.0));
    const auto findings = mesh_findings(report, "p.stl");
    REQUIRE(findings.size() == 1);
    CHECK(findings[0].code == "STL125");
  }
  SECTION("one triangle missing") {
    const auto report = describe(weld({soup.begin() + 3, soup.end()}));
    CHECK_FALSE(report.closed());
    CHECK(report.open.count == 3);
  }
  SECTION("one triangle inverted") {
    auto inverted = soup;
    std::swap(inverted[13], inverted[14]);  // triangle 4, counted from 0
    const auto report = describe(weld(inverted));
    CHECK(report.closed());
    REQUIRE(report.inconsistent.count == 3);
    const auto findings = mesh_findings(report, "p.stl");
    REQUIRE(findings.size() == 1);
    CHECK(findings[0].code == "STL124");
    CHECK(findings[0].severity == Severity::warning);
    CHECK(findings[0].where.file == "p.stl");
  }
  SECTION("a triangle twice") {
    auto doubled = soup;
    for (const int k : {7, 8, 6}) doubled.push_back(soup[static_cast<std::size_t>(k)]);
    const auto report = describe(weld(doubled));
    REQUIRE(report.duplicate.count == 1);
    CHECK(report.duplicate.triangles == std::vector<std::size_t>{12});
    CHECK(report.non_manifold.count == 3);
  }
  SECTION("a fin makes a non-manifold edge") {
    auto fin = soup;
    fin.insert(fin.end(), {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0.5, -3, -3)});
    const auto report = describe(weld(fin));
    CHECK(report.non_manifold.count == 1);
    CHECK(report.open.count == 2);
    CHECK_FALSE(report.closed());
  }
  SECTION("no area: two equal corners, three on a line") {
    auto flat = soup;
    flat.insert(flat.end(), {Vec3(0, 0, 0), Vec3(0, 0, 0), Vec3(5, 5, 5)});
    flat.insert(flat.end(), {Vec3(7, 0, 0), Vec3(8, 1, 0), Vec3(9, 2, 0)});
    const auto report = describe(weld(flat));
    REQUIRE(report.degenerate.count == 2);
    CHECK(report.degenerate.triangles == std::vector<std::size_t>{12, 13});
    // The line of three points stands apart: the first one hangs on the box.
    CHECK(report.components == 2);
  }
  SECTION("two boxes") {
    auto two = soup;
    const auto other = test::box({4, 4, 4}, {6, 6, 6});
    two.insert(two.end(), other.begin(), other.end());
    const auto report = describe(weld(two));
    CHECK(report.components == 2);
    CHECK(report.closed());
    CHECK(report.signed_volume == Approx(9.0));
  }
}

TEST_CASE("describe: counts of random soups agree with the definitions", "[kernels][geometry]") {
  std::mt19937 random(7);
  std::size_t edges_checked = 0;
  for (int run = 0; run < 40; ++run) {
    const auto mesh = weld(lattice_soup(random, 3 + run % 3, 60));
    const auto report = describe(mesh);
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<int, int>> edges;  // along, against
    std::set<std::array<std::uint32_t, 3>> seen;
    std::size_t duplicates = 0;
    for (auto t : mesh.triangles) {
      const bool whole = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
      for (int k = 0; whole && k < 3; ++k) {
        const auto a = t[k];
        const auto b = t[(k + 1) % 3];
        if (a < b) ++edges[{a, b}].first;
        if (a > b) ++edges[{b, a}].second;
      }
      std::sort(t.begin(), t.end());
      duplicates += !seen.insert(t).second;
    }
    std::size_t open = 0;
    std::size_t many = 0;
    std::size_t against = 0;
    for (const auto& [edge, n] : edges) {
      open += n.first + n.second == 1;
      many += n.first + n.second > 2;
      against += (n.first == 2 && n.second == 0) || (n.first == 0 && n.second == 2);
      ++edges_checked;
    }
    REQUIRE(report.open.count == open);
    REQUIRE(report.non_manifold.count == many);
    REQUIRE(report.inconsistent.count == against);
    REQUIRE(report.duplicate.count == duplicates);
    REQUIRE(report.open.triangles.size() == std::min<std::size_t>(open, MeshFinding::kNamed));
  }
  CHECK(edges_checked > 1000);
}

TEST_CASE("describe: volume and area of a sphere converge", "[kernels][geometry]") {
  const Vec3 centre(300, -40, 1000);
  const auto report = describe(weld(test::sphere(centre, 10.0, 100)));
  CHECK(report.signed_volume == Approx(4.0 / 3.0 * kPi * 1000.0).epsilon(2e-3));
  CHECK(report.area == Approx(4.0 * kPi * 100.0).epsilon(2e-3));
  CHECK(report.closed());
  CHECK(report.degenerate.count == 400);  // the cells at the poles have one triangle without area
}
