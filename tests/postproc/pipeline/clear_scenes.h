#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>
#include <string>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "tests/kernels/collision/exact.h"
#include "tests/support/machines.h"

// Sheets with walls and posts beside a cut of the shipped laser, and the question whether a program
// meets them, answered without the library's own collision checks.
namespace smoothpost::test {

inline void add_quad(TriangleMesh& mesh, const Vec3& a, const Vec3& b, const Vec3& c,
                     const Vec3& d) {
  const auto at = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
  mesh.triangles.push_back({at, at + 1, at + 2});
  mesh.triangles.push_back({at, at + 2, at + 3});
}

/// A box from `low` to `high` in `frame`, all six sides outwards.
inline void add_box(TriangleMesh& mesh, const Vec3& low, const Vec3& high, const Pose& frame) {
  const auto p = [&](int i) {
    return Vec3(frame * Vec3(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                             i & 4 ? high.z() : low.z()));
  };
  add_quad(mesh, p(0), p(2), p(3), p(1));
  add_quad(mesh, p(4), p(5), p(7), p(6));
  add_quad(mesh, p(0), p(1), p(5), p(4));
  add_quad(mesh, p(2), p(6), p(7), p(3));
  add_quad(mesh, p(0), p(4), p(6), p(2));
  add_quad(mesh, p(1), p(3), p(7), p(5));
}

/// A cut with the beam on, and what stands around it. W.
struct ClearScene {
  TriangleMesh part;
  std::vector<CutterLocation> cut;
};

inline std::string csv_of(const std::vector<CutterLocation>& cut) {
  std::string text = "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min,beam\n";
  for (std::size_t i = 0; i < cut.size(); ++i) {
    const CutterLocation& c = cut[i];
    for (const double v : {c.tip.x(), c.tip.y(), c.tip.z(), c.axis.x(), c.axis.y(), c.axis.z()})
      text += std::to_string(v) + ",";
    text += i == 0 ? "0,0\n" : "6000,1\n";
  }
  return text;
}

/// The conversion of a scene for the shipped laser, 1 m in.
inline ConvertInput conversion_of(const ClearScene& scene, std::vector<MachineOverride> overrides) {
  InputSettings settings;
  settings.file_name = "cut.csv";
  auto read = interpret_csv(csv_of(scene.cut), settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  overrides.push_back({"tolerance.event_mm", "1"});
  overrides.push_back({"process.power.min_cut_speed_mm_per_s", "0"});
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine("laser_5p1", overrides);
  in.placement.translation() = Vec3(700, 600, 1000);
  in.part = scene.part;
  in.part_name = "part.stl";
  in.input_name = "cut.csv";
  return in;
}

#ifdef SMOOTHPOST_EXACT_ORACLE
/// Places of a program's motions, straight in the joints and `finer` times finer than its blocks,
/// at which a prism inside of nozzle or casing of the shipped laser cuts a triangle of the part.
/// The machine is written down once more here: X Y Z carry C about z, B about y, and W along the
/// tool the nozzle.
struct DenseHits {
  std::size_t nozzle = 0, casing = 0;
  std::set<std::size_t> nozzle_moves, casing_moves;
};
inline DenseHits dense_hits(const Conversion& c, const ConvertInput& in, int finer = 10) {
  constexpr std::size_t kSides = 16;
  const Polyhedron nozzle =
      prism({.from = {0, 0, 0}, .to = {0, 0, 60}, .radius_from = 2.0, .radius_to = 25.0}, kSides,
            1.0 - 1e-9, 0.0);
  const Polyhedron casing =
      prism({.from = {0, 0, 160}, .to = {0, 0, 400}, .radius_from = 60.0, .radius_to = 60.0},
            kSides, 1.0 - 1e-9, 0.0);
  std::vector<std::array<Vec3, 3>> triangles;
  std::vector<Vec3> lows, highs;
  for (const auto& t : in.part->triangles) {
    triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      triangles.back()[k] = in.placement * in.part->vertices[t[k]];
    const auto& corners = triangles.back();
    lows.push_back(corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]));
    highs.push_back(corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]));
  }
  DenseHits out;
  const auto meet = [&](const Polyhedron& body, const Pose& pose, const Vec3& middle) {
    Polyhedron there = body;
    for (Vec3& v : there.corners) v = pose * v;
    Vec3 low = there.corners.front(), high = low;
    for (const Vec3& v : there.corners) {
      low = low.cwiseMin(v);
      high = high.cwiseMax(v);
    }
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if ((lows[i].array() > high.array()).any() || (low.array() > highs[i].array()).any())
        continue;
      if (meets(there, triangles[i], pose * middle)) return true;
    }
    return false;
  };
  const auto& moves = c.read.moves;
  for (std::size_t i = 1; i < moves.size(); ++i) {
    if (moves[i].known != 63U || moves[i - 1].known != 63U) continue;
    for (int k = 1; k <= finer; ++k) {
      const double t = static_cast<double>(k) / finer;
      const JointVector q = (1.0 - t) * moves[i - 1].to + t * moves[i].to;
      Pose head = Pose::Identity();
      head.translation() = q.head<3>();
      head.linear() = rotation_about(Vec3::UnitZ(), q[3]) * rotation_about(Vec3::UnitY(), q[4]);
      Pose tip = head;
      tip.translation() += q[5] * head.linear().col(2);
      if (meet(nozzle, tip, {0, 0, 30})) {
        ++out.nozzle;
        out.nozzle_moves.insert(i);
      }
      if (meet(casing, head, {0, 0, 280})) {
        ++out.casing;
        out.casing_moves.insert(i);
      }
    }
  }
  return out;
}
#endif

/// A flat sheet, a straight cut across it, and around it walls that lean and posts; by seed.
inline ClearScene random_scene(unsigned seed) {
  std::mt19937 random(seed);
  const auto between = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  ClearScene scene;
  add_quad(scene.part, {-100, -120, 0}, {160, -120, 0}, {160, 120, 0}, {-100, 120, 0});
  const double lean = between(0.0, 5.0) * kRadiansPerDegree, turn = between(0.0, 2.0 * kPi);
  const Vec3 axis(std::sin(lean) * std::cos(turn), std::sin(lean) * std::sin(turn), std::cos(lean));
  const double bow = between(-4.0, 4.0);
  for (int i = 0; i <= 60; ++i)
    scene.cut.push_back({Vec3(i, bow * std::sin(kPi * i / 60.0), 1.0), axis});
  const int walls = 1 + static_cast<int>(between(0.0, 2.0));
  for (int w = 0; w < walls; ++w) {
    Pose frame = Pose::Identity();
    const double side = w == 0 ? 1.0 : -1.0;
    frame.translation() = Vec3(between(0.0, 60.0), side * between(38.0, 90.0), 0.0);
    frame.linear() = rotation_about(Vec3::UnitZ(), between(-0.3, 0.3)) *
                     rotation_about(Vec3::UnitX(), side * between(-5.0, 10.0) * kRadiansPerDegree);
    const double half = between(10.0, 60.0);
    add_box(scene.part, {-half, -1.5, 0.0}, {half, 1.5, between(40.0, 320.0)}, frame);
  }
  const int posts = static_cast<int>(between(0.0, 3.0));
  for (int p = 0; p < posts; ++p) {
    Pose frame = Pose::Identity();
    const double side = between(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
    const bool low = between(0.0, 1.0) < 0.5;
    frame.translation() =
        Vec3(between(-20.0, 80.0), side * (low ? between(14.0, 40.0) : between(40.0, 90.0)), 0.0);
    frame.linear() = rotation_about(Vec3::UnitZ(), between(0.0, 1.5));
    const double half = between(2.0, 6.0);
    add_box(scene.part, {-half, -half, 0.0},
            {half, half, low ? between(10.0, 45.0) : between(60.0, 300.0)}, frame);
  }
  return scene;
}

/// A sheet of 70 mm, bent down by 40 degrees about a radius of 40 mm, 70 mm more; across it from x
/// = 0 a cut along its middle. A fixture post stands beside the first half, near enough for the
/// nozzle; a flange stands on the second half, too high for the casing.
inline ClearScene bent_part() {
  constexpr double kFlat = 70.0, kRadius = 40.0, kBend = 40.0 * kRadiansPerDegree;
  constexpr int kSteps = 20;
  ClearScene scene;
  struct Section {
    Vec3 point, normal;
  };
  const auto at = [&](double s) -> Section {
    if (s <= kFlat) return {Vec3(s, 0, 0), Vec3::UnitZ()};
    const double a = std::min((s - kFlat) / kRadius, kBend);
    const Vec3 n(std::sin(a), 0, std::cos(a)), t(std::cos(a), 0, -std::sin(a));
    const Vec3 p(kFlat + kRadius * std::sin(a), 0, -kRadius * (1.0 - std::cos(a)));
    return {p + std::max(0.0, s - kFlat - kRadius * kBend) * t, n};
  };
  const double length = 2.0 * kFlat + kRadius * kBend;
  std::vector<double> sections{-30.0, kFlat};
  for (int k = 1; k <= kSteps; ++k) sections.push_back(kFlat + kRadius * kBend * k / kSteps);
  sections.push_back(length + 30.0);
  for (std::size_t k = 1; k < sections.size(); ++k) {
    const Vec3 a = at(sections[k - 1]).point, b = at(sections[k]).point;
    const Vec3 left(0, 70, 0);
    add_quad(scene.part, a - left, b - left, b + left, a + left);
  }
  for (double s = 0.0; s <= length; s += 1.0) {
    const Section here = at(s);
    scene.cut.push_back({here.point + here.normal, here.normal});
  }
  Pose post = Pose::Identity();
  post.translation() = Vec3(22, -20, 0);
  add_box(scene.part, {-3, -3, 0}, {3, 3, 45}, post);
  const Section end = at(length - 45.0);
  Pose flange = Pose::Identity();
  flange.linear().col(2) = end.normal;
  flange.linear().col(1) = Vec3::UnitY();
  flange.linear().col(0) = Vec3::UnitY().cross(end.normal);
  flange.translation() = end.point;
  add_box(scene.part, {-10, 50, 0}, {40, 52, 230}, flange);
  return scene;
}

}  // namespace smoothpost::test
