#include "kernels/kinematics/head_geometry.h"

#include <cmath>

#include "kernels/kinematics/rotary_pair.h"

namespace smoothpost {
namespace {

// Largest sine between the standoff and the tool that a machine file's rounding explains.
constexpr double kAlong = 1e-6;

/// Binomial coefficients: row r has what the derivatives s and r − s of the factors weigh in the
/// r-th derivative of a product.
constexpr double kBinomial[4][4] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {1, 2, 1, 0}, {1, 3, 3, 1}};

VectorJet product(const Jet& f, const VectorJet& v) {
  VectorJet out = VectorJet::Zero();
  for (int r = 0; r < 4; ++r)
    for (int s = 0; s <= r; ++s) out.col(r) += kBinomial[r][s] * f[s] * v.col(r - s);
  return out;
}

struct SineCosine {
  Jet sine;
  Jet cosine;
};

SineCosine sine_cosine(const Jet& angle) {
  const double s = std::sin(angle[0]);
  const double c = std::cos(angle[0]);
  const double square = angle[1] * angle[1];
  const double mixed = 3.0 * angle[1] * angle[2];
  const double third = angle[3] - square * angle[1];
  return {{s, c * angle[1], c * angle[2] - s * square, c * third - s * mixed},
          {c, -s * angle[1], -s * angle[2] - c * square, -s * third - c * mixed}};
}

/// v turned about a fixed unit axis: n (n·v) + cos φ (v − n (n·v)) + sin φ n × v.
VectorJet turned(const Vec3& axis, const SineCosine& angle, const VectorJet& v) {
  const VectorJet along = axis * (axis.transpose() * v);
  return along + product(angle.cosine, v - along) + product(angle.sine, cross_matrix(axis) * v);
}

VectorJet constant(const Vec3& v) {
  VectorJet jet = VectorJet::Zero();
  jet.col(0) = v;
  return jet;
}

/// Sines and cosines of both rotaries, shared by everything they carry.
struct Rotaries {
  SineCosine first;
  SineCosine second;
};

VectorJet turned_by_both(const HeadGeometry& head, const Rotaries& rotaries, const Vec3& v) {
  return turned(head.axis1, rotaries.first, turned(head.axis2, rotaries.second, constant(v)));
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
  VectorJet carried = turned(head.axis2, rotaries.second, constant(head.tip - head.origin2));
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
