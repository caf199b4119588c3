#pragma once

#include "kernels/kinematics/screw_chain.h"

// A six-axis arm written out: KR 60 HA, stretched along X at 0, a tool at 45 degrees.
namespace smoothpost::test {

inline ScrewChain kr60() {
  const auto joint = [](const Vec3& direction, const Vec3& origin, double low, double high) {
    ChainJoint j;
    j.kind = JointKind::rotary;
    j.direction = direction;
    j.origin = origin;
    j.lower = low * M_PI / 180.0;
    j.upper = high * M_PI / 180.0;
    return j;
  };
  ScrewChain chain;
  chain.joints = {joint(-Vec3::UnitZ(), Vec3::Zero(), -185, 185),
                  joint(Vec3::UnitY(), Vec3(350, 0, 815), -135, 35),
                  joint(Vec3::UnitY(), Vec3(1200, 0, 815), -120, 158),
                  joint(-Vec3::UnitX(), Vec3(1665, 0, 960), -350, 350),
                  joint(Vec3::UnitY(), Vec3(2020, 0, 960), -119, 119),
                  joint(-Vec3::UnitX(), Vec3(2190, 0, 960), -350, 350)};
  chain.tool_home.translation() = Vec3(2410, 0, 840);
  chain.tool_axis = Vec3(-1, 0, 1).normalized();
  chain.workpiece_home.translation() = Vec3(1400, 0, 600);
  return chain;
}

inline JointVector kr60_home() {
  JointVector q = JointVector::Zero(6);
  q[1] = -M_PI_2;
  q[2] = M_PI_2;
  q[4] = M_PI_4;
  return q;
}

}  // namespace smoothpost::test
