#pragma once

#include <vector>

#include "kernels/collision/scene.h"
#include "kernels/core/units.h"
#include "tests/kernels/collision/oracles.h"

namespace smoothpost::test {

/// X, Y, Z, C, B, W of the shipped laser: tip where C and B cross at W = 0.
inline ScrewChain laser_chain() {
  ScrewChain chain;
  const auto add = [&](JointKind kind, const Vec3& direction) {
    ChainJoint joint;
    joint.kind = kind;
    joint.direction = direction;
    chain.joints.push_back(joint);
  };
  add(JointKind::linear, Vec3::UnitX());
  add(JointKind::linear, Vec3::UnitY());
  add(JointKind::linear, Vec3::UnitZ());
  add(JointKind::rotary, Vec3::UnitZ());
  add(JointKind::rotary, Vec3::UnitY());
  add(JointKind::linear, Vec3::UnitZ());
  return chain;
}
constexpr int kB = 4;
constexpr int kW = 5;

inline const FrustumSize kNozzle{
    .from = {0, 0, 0}, .to = {0, 0, 60}, .radius_from = 2.0, .radius_to = 25.0};
inline const FrustumSize kCasing{
    .from = {0, 0, 160}, .to = {0, 0, 400}, .radius_from = 60.0, .radius_to = 60.0};
inline SceneBody nozzle_body() {
  return {.name = "nozzle", .joint = kW, .shape = ConvexShape::frustum(kNozzle)};
}
inline SceneBody casing_body() {
  return {.name = "casing", .joint = kB, .shape = ConvexShape::frustum(kCasing)};
}
inline SceneBody part_body(const TriangleMesh& mesh) {
  return {.name = "part", .joint = SceneBody::kWorkpiece, .shape = mesh_of(mesh)};
}

/// Nozzle and casing against a part: the nozzle with an exempt ball about its tip.
inline Scene laser_scene(const TriangleMesh& part, double clearance = 2.0,
                         double exempt_radius = 8.0) {
  return Scene(laser_chain(), {nozzle_body(), casing_body(), part_body(part)},
               {{.first = 0,
                 .second = 2,
                 .clearance = clearance,
                 .exempt = ExemptSphere{Vec3::Zero(), exempt_radius}},
                {.first = 1, .second = 2, .clearance = clearance, .exempt = {}}});
}

/// Joints that put the tip at a point with a tool axis, at a standoff w; C near `c`.
inline JointVector laser_joints(const Vec3& tip, const Vec3& axis, double w, double c) {
  JointVector q(6);
  const double angle = std::atan2(axis.y(), axis.x());
  q << tip - w * axis, angle + 2.0 * kPi * std::round((c - angle) / (2.0 * kPi)),
      std::atan2(std::hypot(axis.x(), axis.y()), axis.z()), w;
  return q;
}

/// A chain with joints of both kinds on both sides, everything askew.
inline ScrewChain random_chain(std::mt19937& random, int joints) {
  ScrewChain chain;
  for (int i = 0; i < joints; ++i) {
    ChainJoint joint;
    joint.kind = uniform(random, 0, 1) < 0.4 ? JointKind::linear : JointKind::rotary;
    joint.side = uniform(random, 0, 1) < 0.6 ? ChainSide::tool : ChainSide::workpiece;
    joint.direction = random_direction(random);
    joint.origin = random_vector(random, 50.0);
    chain.joints.push_back(joint);
  }
  chain.workpiece_home = random_pose(random, 60.0);
  chain.tool_home = random_pose(random, 60.0);
  return chain;
}
inline JointVector random_joints(std::mt19937& random, const ScrewChain& chain, double length,
                                 double angle) {
  JointVector q(chain.size());
  for (int i = 0; i < chain.size(); ++i) {
    const double range =
        chain.joints[static_cast<std::size_t>(i)].kind == JointKind::linear ? length : angle;
    q[i] = uniform(random, -range, range);
  }
  return q;
}

/// A flat sheet with an upright wall and a post: what a head meets.
inline TriangleMesh workshop() {
  Soup soup = box({-150, -150, -5}, {150, 150, 0});
  for (const auto& part : {box({60, -150, 0}, {64, 150, 90}), box({-90, -10, 0}, {-70, 10, 250})})
    soup.insert(soup.end(), part.begin(), part.end());
  return weld(soup);
}

}  // namespace smoothpost::test
