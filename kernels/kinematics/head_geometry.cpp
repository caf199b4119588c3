#include "kernels/kinematics/head_geometry.h"

#include <cmath>

#include "kernels/kinematics/rotary_pair.h"

namespace smoothpost {
namespace {

// Largest sine between the standoff and the tool that a machine file's rounding explains.
constexpr double kAlong = 1e-6;

/// Sines and cosines of both rotaries, shared by everything they carry.
struct Rotaries {
  SineCosine first;
  SineCosine second;
};

VectorJet turned_by_both(const HeadGeometry& head, const Rotaries& rotaries, const Vec3& v) {
  return turned(head.axis1, rotaries.first, turned(head.axis2, rotaries.second, constant_jet(v)));
}

bool is_in_order(const ScrewChain& chain) {
  if (chain.size() != 6) return false;
  for (int i = 0; i < 6; ++i) {
    const ChainJoint& joint = chain.joints[i];
    const bool rotary = i == 3 || i == 4;
    if (joint.side != ChainSide::tool || joint.redundant != (i == 5)) return false;
    if (joint.kind != (rotary ? JointKind::rotary : JointKind::linear)) return false;
  }
  return true;
}

}  // namespace

std::optional<HeadGeometry> HeadGeometry::from(const ScrewChain& chain) {
  if (!is_in_order(chain) || !RotaryPair::from(chain)) return std::nullopt;
  HeadGeometry head;
  Mat3 directions;
  for (int i = 0; i < 3; ++i) {
    head.linear[i] = i;
    directions.col(i) = chain.joints[i].direction;
  }
  head.to_joints = directions.inverse();
  head.first_rotary = 3;
  head.second_rotary = 4;
  head.standoff = 5;
  head.axis1 = chain.joints[3].direction;
  head.origin1 = chain.joints[3].origin;
  head.axis2 = chain.joints[4].direction;
  head.origin2 = chain.joints[4].origin;
  head.along = chain.joints[5].direction;
  head.tip = chain.tool_home.translation();
  head.tool_axis = chain.tool_home.linear() * chain.tool_axis;
  head.part = chain.workpiece_home;
  if (head.along.cross(head.tool_axis).norm() > kAlong) return std::nullopt;
  return head;
}

LinearsByStandoff linears_by_standoff(const HeadGeometry& head, const VectorJet& tip, const Jet& q4,
                                      const Jet& q5) {
  const Rotaries rotaries{sine_cosine(q4), sine_cosine(q5)};
  VectorJet carried = turned(head.axis2, rotaries.second, constant_jet(head.tip - head.origin2));
  carried.col(0) += head.origin2 - head.origin1;
  carried = turned(head.axis1, rotaries.first, carried);
  VectorJet difference = head.part.linear() * tip - carried;
  difference.col(0) += head.part.translation() - head.origin1;
  return {head.to_joints * difference,
          -head.to_joints * turned_by_both(head, rotaries, head.along)};
}

VectorJet axis_jet(const HeadGeometry& head, const Jet& q4, const Jet& q5) {
  const Rotaries rotaries{sine_cosine(q4), sine_cosine(q5)};
  return head.part.linear().transpose() * turned_by_both(head, rotaries, head.tool_axis);
}

}  // namespace smoothpost
