#pragma once

#include "kernels/kinematics/screw_chain.h"

namespace smoothpost {

struct NumericInverseSettings {
  double tip_tolerance = 1e-9;        ///< mm
  double rotation_tolerance = 1e-12;  ///< rad, of the pose or of the tool axis
  double length = 100.0;  ///< mm that count as much as 1 rad, in residuals and default weights
  JointVector weight;     ///< cost of one mm or rad of each joint, > 0; empty: 1 linear, `length`
                          ///< rotary
  JointVector centre;     ///< where free motion goes; empty: it stays as near as it can
  bool limits = true;     ///< keep every joint within lower..upper
  int max_iterations = 100;
};

/// What was found, and how far it is from the target.
struct NumericInverse {
  enum class Status {
    ok,          ///< within both tolerances
    limit,       ///< joint `joint` is at its limit and would have to go on
    unreachable  ///< no joint motion brings the tool nearer, or max_iterations
  } status = Status::unreachable;
  JointVector q;                ///< the best that was found
  double tip_error = 0.0;       ///< mm
  double rotation_error = 0.0;  ///< rad
  int joint = -1;               ///< status limit: the first joint that stops it
  int iterations = 0;           ///< linear systems solved
};

/// Inverse of any chain from a start value: joints of either kind on both sides, more or fewer of
/// them than the task has rows. The result is the one that the start value leads to; a closed form
/// (RotaryPair, SixR) finds them all.
///
/// Definition. With e the error in W (rotation vector times `length`, then tip), J the geometric
/// Jacobian with its rotation rows times `length`, A = J W⁻¹ and W = diag(weight), each step is the
/// weighted least-norm one under damping,
///   W Δq = Aᵀ (A Aᵀ + λ²)⁻¹ e,   λ² = μ |e|²/length²,
/// with μ raised until |e| falls and lowered when it does. So the last steps are Newton steps, a
/// singular pose costs steps and not digits, and a chain with more joints than rows moves as little
/// as it can. A joint that a step would take beyond its limit is set to the limit, its column is
/// taken out and the step is solved again; the next step lets it free again. `centre`: afterwards
/// the joints go along the null space, (1 − A⁺A) W (centre − q), back onto the target after each
/// step, until |W (q − centre)| is least.
///
/// Guarantees (tests): FK(q) = target within the tolerances whenever status is ok; converges from
/// 0.05 rad off on every reference machine; within limits; least norm to first order; an
/// unreachable target ends with the nearest pose found and no NaN.
///
/// Units: mm, rad, W.
/// Cost: a Jacobian, a forward kinematics and a Cholesky factor (5 or 6 rows) a step; three to five
/// steps from near by; no allocation.
///
/// @param start  where to begin, of any turn; clamped to the limits when they are respected
/// @pre start.size() == chain.size(); weight and centre empty or of that size; weights, tolerances
///      and length positive; the target's axis a unit vector within 1e-6
/// @throws ContractViolation if not.
///
/// Implements [Sugihara2011] (Levenberg-Marquardt with a damping of the squared residual).
/// Differences from the paper: the damping's factor adapts; damping acts on the rows, not on the
/// joints, so free motion is least-norm; limits.
NumericInverse numeric_inverse(const ScrewChain& chain, const Pose& target,
                               const JointVector& start,
                               const NumericInverseSettings& settings = {});

/// The same for a tip and tool axis: five rows, rotation about the tool is free.
NumericInverse numeric_inverse(const ScrewChain& chain, const CutterLocation& target,
                               const JointVector& start,
                               const NumericInverseSettings& settings = {});

}  // namespace smoothpost
