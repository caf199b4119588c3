#include "postproc/pipeline/cutting_frame.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

Vec3 direction(double lead_deg, double tilt_deg) {
  // tan(lead) and tan(tilt) are the slopes in the two planes of the frame.
  return Vec3(std::tan(radians_from_degrees(lead_deg)), std::tan(radians_from_degrees(tilt_deg)), 1)
      .normalized();
}

/// A square of `side` mm about the origin in the plane z = 0, or a block below it.
TriangleMesh plate(double side, bool block = false) {
  const double h = 0.5 * side;
  TriangleMesh mesh;
  for (const double z : {0.0, -5.0})
    for (const auto& [x, y] : {std::pair{-h, -h}, {h, -h}, {h, h}, {-h, h}})
      mesh.vertices.push_back({x, y, z});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  if (!block) {
    mesh.vertices.resize(4);
    return mesh;
  }
  mesh.triangles.insert(mesh.triangles.end(), {{6, 5, 4}, {7, 6, 4}});
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::uint32_t next = (k + 1) % 4;
    mesh.triangles.push_back({k, 4 + k, 4 + next});
    mesh.triangles.push_back({k, 4 + next, next});
  }
  return mesh;
}

}  // namespace

TEST_CASE("cutting_frame: angles are those of the two slopes", "[postproc][pipeline]") {
  CuttingFrame frame;  // N = Z, T = X, B = Y
  std::mt19937 random(3);
  std::uniform_real_distribution<double> degrees(-60, 60);
  for (int i = 0; i < 200; ++i) {
    const double lead = degrees(random), tilt = degrees(random);
    const LeadTilt got = frame.angles(direction(lead, tilt));
    CHECK(degrees_from_radians(got.lead) == Approx(lead).margin(1e-12));
    CHECK(degrees_from_radians(got.tilt) == Approx(tilt).margin(1e-12));
  }
}

TEST_CASE("cutting_frame: without a part N is the programmed axis", "[postproc][pipeline]") {
  const ToolPath path =
      PathMaker({0, 0, 5}, direction(10, 5)).feed({20, 0, 5}).feed({20, 10, 5}).take();
  const ReferencePath reference(path, {});
  const CuttingFrames frames(reference, 1, 2, nullptr);
  CHECK_FALSE(frames.from_part());
  const CuttingFrame first = frames.at({1, 0.0});
  CHECK(first.normal == reference.at(1, 0.0).axis);
  CHECK(first.programmed.lead == 0.0);
  CHECK(first.programmed.tilt == 0.0);
  CHECK(first.tangent.dot(first.normal) == Approx(0.0).margin(1e-15));
  CHECK(first.tangent.y() < 0.0);  // X without its part along N
  CHECK((first.normal.cross(first.tangent) - first.binormal).norm() < 1e-15);
  CHECK(first.binormal.norm() == Approx(1.0));
  // Half a millimetre before and behind the corner: half way between the two directions.
  const Vec3 middle = Vec3(1, 1, 0).normalized();
  const CuttingFrame corner = frames.at({1, 1.0});
  const Vec3 n = corner.normal;
  CHECK((corner.tangent - (middle - n.dot(middle) * n).normalized()).norm() < 1e-12);
  CHECK((frames.at({2, 0.0}).tangent - corner.tangent).norm() < 1e-12);
}

TEST_CASE("cutting_frame: frames are orthonormal and turn smoothly along a path",
          "[postproc][pipeline]") {
  PathMaker maker({0, 0, 0});
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Vec3 at(0, 0, 0);
  for (int i = 0; i < 40; ++i) {
    at += Vec3(1.0 + 0.2 * normal(random), 0.3 * normal(random), 0.1 * normal(random));
    maker.axis(Vec3(0.1 * normal(random), 0.1 * normal(random), 1)).feed(at);
    if (i % 7 == 3) maker.axis(Vec3(0.1 * normal(random), 0.1 * normal(random), 1)).feed(at);
  }
  const ToolPath path = maker.take();
  const ReferencePath reference(path, {});
  const auto last = static_cast<std::uint32_t>(reference.segments());
  const CuttingFrames frames(reference, 1, last, nullptr);
  Vec3 before = frames.at({1, 0.0}).tangent;
  for (std::uint32_t k = 1; k <= last; ++k)
    for (int i = 0; i <= 50; ++i) {
      const CuttingFrame f = frames.at({k, i / 50.0});
      Mat3 m;
      m << f.tangent, f.binormal, f.normal;
      CHECK((m.transpose() * m - Mat3::Identity()).norm() < 1e-12);
      CHECK(m.determinant() > 0.0);
      CHECK((f.tangent - before).norm() < 0.08);
      before = f.tangent;
    }
}

TEST_CASE("cutting_frame: where the tip stands or turns back the last direction holds",
          "[postproc][pipeline]") {
  const ToolPath back = PathMaker({0, 0, 0}).feed({10, 0, 0}).feed({0, 0, 0}).take();
  const ReferencePath turning(back, {});
  CHECK((CuttingFrames(turning, 1, 2, nullptr).at({1, 1.0}).tangent - Vec3::UnitX()).norm() <
        1e-12);
  const ToolPath still = PathMaker({0, 0, 0}).axis({1, 0, 1}).feed({0, 0, 0}).take();
  const ReferencePath standing(still, {});
  const CuttingFrame f = CuttingFrames(standing, 1, 1, nullptr).at({1, 0.5});
  CHECK(f.tangent.norm() == Approx(1.0));
  CHECK(f.tangent.dot(f.normal) == Approx(0.0).margin(1e-12));
  CHECK_THROWS_AS(CuttingFrames(standing, 0, 1, nullptr), ContractViolation);
  CHECK_THROWS_AS(CuttingFrames(standing, 1, 2, nullptr), ContractViolation);
}

TEST_CASE("cutting_frame: N of the part and the programmed angles in it", "[postproc][pipeline]") {
  auto tree = build_triangle_tree(plate(100));
  REQUIRE(tree.ok());
  const ToolPath path = PathMaker({-20, 0, 1}, direction(12, -7)).feed({20, 0, 1}).take();
  const ReferencePath reference(path, {});
  const CuttingFrames frames(reference, 1, 1, &tree.value());
  CHECK(frames.from_part());
  const CuttingFrame f = frames.at({1, 0.25});
  CHECK((f.normal - Vec3::UnitZ()).norm() < 1e-12);
  CHECK(degrees_from_radians(f.programmed.lead) == Approx(12));
  CHECK(degrees_from_radians(f.programmed.tilt) == Approx(-7));

  // From below: N is on the side of the programmed axis.
  const ToolPath below =
      PathMaker({-20, 0, -1}, Vec3(0, 0, -1)).axis({0, 0, -1}).feed({20, 0, -1}).take();
  const ReferencePath under(below, {});
  CHECK((CuttingFrames(under, 1, 1, &tree.value()).at({1, 0.5}).normal + Vec3::UnitZ()).norm() <
        1e-12);
  // On the part itself the way to it says nothing.
  const ToolPath on = PathMaker({-20, 0, 0}).feed({20, 0, 0}).take();
  const ReferencePath flat(on, {});
  CHECK((CuttingFrames(flat, 1, 1, &tree.value()).at({1, 0.5}).normal - Vec3::UnitZ()).norm() <
        1e-12);
}

TEST_CASE("cutting_frame: over the rim of a block N stays the top's", "[postproc][pipeline]") {
  auto tree = build_triangle_tree(plate(100, true));
  REQUIRE(tree.ok());
  for (const double outside : {-0.01, 0.0, 0.01}) {
    const double y = 50.0 + outside;
    const ToolPath path = PathMaker({-20, y, 1}).feed({20, y, 1}).take();
    const ReferencePath reference(path, {});
    const CuttingFrame f = CuttingFrames(reference, 1, 1, &tree.value()).at({1, 0.5});
    CHECK(f.normal.z() > std::cos(0.0101));  // no more than the 0.01 mm in 1 mm of height
  }
}

TEST_CASE("cutting_frame: the gap under a tilted nozzle", "[postproc][pipeline]") {
  // [Ding2025] with a land of 2 and 3 mm at a gap of 1 mm: findings section 1.
  const auto rad = [](double d) { return radians_from_degrees(d); };
  CHECK(tilted_gap(1, 2, rad(10)) == Approx(0.6375).margin(5e-5));
  CHECK(tilted_gap(1, 2, rad(15)) == Approx(0.4483).margin(5e-5));
  CHECK(tilted_gap(1, 3, rad(15)) == Approx(0.1895).margin(5e-5));
  CHECK(degrees_from_radians(largest_beam_angle(1, 2, 0)) == Approx(26.565).margin(5e-4));
  CHECK(degrees_from_radians(largest_beam_angle(1, 3, 0)) == Approx(18.435).margin(5e-4));
  CHECK(largest_beam_angle(1, 0, 0) == Approx(kPi / 2));
  CHECK(largest_beam_angle(0, 0, 0) == Approx(kPi / 2));
  CHECK(largest_beam_angle(1, 2, 1) == Approx(0.0).margin(1e-12));
  CHECK(largest_beam_angle(1, 2, 2) == 0.0);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 200; ++i) {
    const double gap = 0.1 + unit(random), land = 4 * unit(random), least = gap * unit(random);
    const double t = largest_beam_angle(gap, land, least);
    CHECK(tilted_gap(gap, land, t) == Approx(least).margin(1e-12));
    CHECK(tilted_gap(gap, land, t + 1e-3) < least);
  }
}
