#pragma once

#include "kernels/kinematics/screw_chain.h"

namespace smoothpost {

/// A motion of the joints over τ ∈ [0, 1] that need not be straight.
struct JointMotionBound {
  JointVector middle;       ///< q(½)
  JointVector middle_rate;  ///< q'(½)
  JointVector rate;         ///< ≥ |q'| of each joint on the whole motion
  JointVector second;       ///< ≥ |q''|, likewise
};

/// Upper bounds of |d²tip/dτ²| (mm) and |d²axis/dτ²| (1) on such a motion, as
/// second_derivative_bound() of a straight one.
///
/// Derivation. Walk the chain from the tip inwards as there. With a rate w(τ) that has a derivative
/// α, y'' has α d×y too, so that
///   V → V + wρ,   A → A + 2wV + w²ρ + αρ   (old V),   w ≥ |q'|, α ≥ |q''|;
/// for linear joints V and A grow by what all neighbouring ones of them can add at most: the
/// length of Σ |q'| |d| and Σ |q''| |d|, component by component. V may be |x'(½)| + A/2.
///
/// Guarantees (tests): never below dense second differences of motions along random polynomials;
/// the closed form of one rotary at a constant rate.
/// Units: mm, rad.   Cost: O(joints), a sine and cosine per rotary joint, no allocation.
/// @pre every vector has chain.size() values, rate and second ≥ 0   @throws ContractViolation if
/// a size is not.
SecondDerivativeBound bent_motion_bound(const ScrewChain& chain, const JointMotionBound& motion);

}  // namespace smoothpost
