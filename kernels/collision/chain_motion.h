#pragma once

#include <array>
#include <vector>

#include "kernels/collision/convex_shape.h"
#include "kernels/core/joints.h"
#include "kernels/kinematics/screw_chain.h"

// How far bodies move against each other while joints move.
namespace smoothpost {

/// The joints between two links, from the first body inwards and on outwards to the second:
/// x_second = Π (last … first) e^(sign [S] q) x_first, in M with every joint at 0.
struct ChainStep {
  int joint = 0;
  double sign = 1.0;
};
using ChainPath = std::vector<ChainStep>;

/// @param first, second  joints that carry the two links, −1 for the base
/// @pre −1 ≤ first, second < chain.size()   @throws ContractViolation if not.
ChainPath path_between(const ScrewChain& chain, int first, int second);

/// X_M of every link at q: index 0 the base, i + 1 the link of joint i; the identity with every
/// joint at 0. Cost: a sine and cosine per rotary joint, no allocation.
/// @pre q.size() == chain.size() ≤ kMaxJoints   @throws ContractViolation if not.
using LinkPoses = std::array<Pose, kMaxJoints + 1>;
LinkPoses link_poses(const ScrewChain& chain, const JointVector& q);

/// No point of the convex hull of `balls` is further from where `from` puts it than this, mm:
///   max over the balls of |X_to c − X_from c| + r |R_to − R_from|.
/// Derivation. x = Σ λ (c + r u) with |u| ≤ 1 moves by Σ λ ((X_to − X_from) c + r (R_to − R_from)
/// u); the spectral norm of a difference of rotations by θ is 2 sin(θ/2) = its Frobenius norm / √2.
double displacement(const std::vector<Ball>& balls, const Pose& from, const Pose& to);

/// Bounds of how a body moves, seen from another one, while the joints go linearly from `from` to
/// `to`, τ ∈ [0, 1].
struct MovementBound {
  /// mm: no point of the body goes a longer way. So it is never further than half of it from where
  /// it is at τ = ½.
  double travel = 0.0;
  /// mm per joint unit, for every joint of the chain (0 where a joint moves neither body against
  /// the other): at any τ, changing the joints by e from there displaces no point of the body by
  /// more than Σ lever·|e|.
  JointVector lever;
};

/// See MovementBound.
///
/// Derivation. Walk the path as second_derivative_bound() does. For the centre x of a ball, with
/// V ≥ |x'| and A ≥ |x''| over the motion, a rotary joint with rate w and ρ ≥ distance of x to its
/// axis (the distance at τ = ½ and V/2) gives
///   V → min(V + wρ, |x'(½)| + A/2),   A → A + 2wV + w²ρ   (old V);
/// neighbouring linear joints add as vectors. A ball's surface adds r Σ|w| to V.
/// lever of a rotary joint = ρ + r there, of a linear one 1. That a change e of the joints moves
/// points by Σ lever·|e|: change the joint next to the second body first and go on towards the
/// first; when a joint turns, those between it and the body are still where they were, so that its
/// lever is the one of the motion, and those already changed are isometries.
///
/// Guarantees (tests): never below dense sampling; within 1.5 times the true way for short motions.
/// Units: mm, rad.   Cost: per ball as second_derivative_bound().
/// @pre from.size() == to.size() == chain.size()   @throws ContractViolation if not.
MovementBound movement_bound(const ScrewChain& chain, const ChainPath& path,
                             const std::vector<Ball>& balls, const JointVector& from,
                             const JointVector& to);

}  // namespace smoothpost
