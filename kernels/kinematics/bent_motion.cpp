#include "kernels/kinematics/bent_motion.h"

#include <algorithm>
#include <limits>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

// A hair more than the arithmetic's own rounding.
constexpr double kRoundOff = 1.0 + 1e-12;

/// A vector function of τ at τ = ½ with its derivative, and bounds of its derivatives.
struct Motion {
  Vec3 x = Vec3::Zero();
  Vec3 x1 = Vec3::Zero();
  double v = 0.0;
  double a = 0.0;
};

/// A rotary joint at τ = ½, and what its rates are at most.
struct Rotary {
  Vec3 axis;
  Mat3 turn;
  double middle_rate = 0.0;
  double rate = 0.0;
  double second = 0.0;
};

/// `x` counts from the joint's origin; it cannot be farther from the axis than `longest`.
void through(const Rotary& r, double longest, Motion& m) {
  m.x = r.turn * m.x;
  m.x1 = r.turn * m.x1 + r.middle_rate * r.axis.cross(m.x);
  const double distance = std::min(r.axis.cross(m.x).norm() + 0.5 * m.v, longest);
  m.a += 2.0 * r.rate * m.v + (r.rate * r.rate + r.second) * distance;
  m.v = std::min(m.v + r.rate * distance, m.x1.norm() + 0.5 * m.a);
}

/// What neighbouring linear joints add.
struct LinearSum {
  Vec3 middle_rate = Vec3::Zero(), rate = Vec3::Zero(), second = Vec3::Zero();

  void add_to(Motion& m) {
    m.a += second.norm();
    m.x1 += middle_rate;
    m.v = std::min(m.v + rate.norm(), m.x1.norm() + 0.5 * m.a);
    *this = {};
  }
};

class Walk {
 public:
  Walk(const ScrewChain& chain, const JointMotionBound& motion) : chain_(chain), motion_(motion) {
    tip_.x = chain.tool_home.translation();
    axis_.x = chain.tool_home.linear() * chain.tool_axis;
  }

  /// Joint i with its screw, or the negative one (joints of the workpiece's side).
  void pass(int i, double sign) {
    const ChainJoint& joint = chain_.joints[static_cast<std::size_t>(i)];
    const double value = sign * motion_.middle[i], rate = sign * motion_.middle_rate[i];
    if (joint.kind == JointKind::linear) {
      tip_.x += value * joint.direction;
      linear_.middle_rate += rate * joint.direction;
      linear_.rate += motion_.rate[i] * joint.direction.cwiseAbs();
      linear_.second += motion_.second[i] * joint.direction.cwiseAbs();
      return;
    }
    linear_.add_to(tip_);
    const Rotary rotary{joint.direction, rotation_about(joint.direction, value), rate,
                        motion_.rate[i], motion_.second[i]};
    tip_.x -= joint.origin;
    through(rotary, std::numeric_limits<double>::infinity(), tip_);
    tip_.x += joint.origin;
    through(rotary, 1.0, axis_);
  }

  SecondDerivativeBound end() {
    linear_.add_to(tip_);
    return {kRoundOff * tip_.a, kRoundOff * axis_.a};
  }

 private:
  const ScrewChain& chain_;
  const JointMotionBound& motion_;
  Motion tip_, axis_;
  LinearSum linear_;
};

}  // namespace

SecondDerivativeBound bent_motion_bound(const ScrewChain& chain, const JointMotionBound& motion) {
  for (const JointVector* v : {&motion.middle, &motion.middle_rate, &motion.rate, &motion.second})
    require(v->size() == chain.size(), "one value per joint");
  Walk walk(chain, motion);
  for (int i = chain.size() - 1; i >= 0; --i)
    if (chain.joints[static_cast<std::size_t>(i)].side == ChainSide::tool) walk.pass(i, 1.0);
  for (int i = 0; i < chain.size(); ++i)
    if (chain.joints[static_cast<std::size_t>(i)].side == ChainSide::workpiece) walk.pass(i, -1.0);
  return walk.end();
}

}  // namespace smoothpost
