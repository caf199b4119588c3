#pragma once

#include "kernels/core/joint_bend.h"
#include "kernels/core/joints.h"

// Joints that follow polynomials of degree 5 at most, or an arc, from one end of a move to the
// other.
namespace smoothpost {

/// A move of all joints over τ ∈ [0, 1]; see JointBend and JointArc. The joints of an arc have no
/// bend.
struct BentMove {
  const JointVector& from;
  const JointVector& to;
  const JointBend& bend;
  JointArc arc = {};
  bool is_straight() const { return bend.rows() == 0 && arc.turn == 0; }
};

/// The joints at τ, mm or rad.   Cost: O(joints), no allocation.
/// @pre to, and bend unless it has no rows, have as many rows as from; an arc has two different
/// joints of them
/// @throws ContractViolation if not; so have the others below.
JointVector joints_at(const BentMove& move, double tau);

/// Their derivatives by τ, the first and the second one.
JointVector rates_at(const BentMove& move, double tau);
JointVector second_at(const BentMove& move, double tau);

/// For each joint, a bound of |dq/dτ| and of |d²q/dτ²| on the whole move.
///
/// Derivation. A polynomial on [0, 1] lies in the hull of its Bernstein coefficients, so its size
/// is at most the largest of them. An arc with radii r0, r1 and angle S has |x'| ≤ |r1 − r0| + r S
/// and |x''| ≤ 2|r1 − r0| S + r S², r the larger radius, for the pair and so for each of the two.
/// Guarantees (tests): never below dense samples; exact for moves whose derivative is monotone.
/// Cost: O(joints), no allocation.
struct BendBounds {
  JointVector rate;
  JointVector second;
};
BendBounds bend_bounds(const BentMove& move);

/// Radii at both ends, mm, and the angle gone, rad, signed as JointArc::turn.
struct ArcShape {
  double from_radius = 0.0, to_radius = 0.0;
  double sweep = 0.0;
};
/// @pre the move has an arc
ArcShape arc_shape(const BentMove& move);

/// How far the two joints of an arc may be from where it has them, mm, whatever a control does
/// about radii that differ: 2·|r1 − r0|. No arc: 0.
///
/// Derivation. Controls keep the ends and (a) let the radius go linearly, as JointArc does, (b)
/// keep the first radius and end on a straight line, (c) move the centre along the chord until both
/// radii agree. (a) and (b) differ by |r1 − r0|. (c) moves the centre by e = |r1 − r0| / (2 sin
/// S/2); seen from the middle of the arc the place at angle θ then moves by e sin θ along the
/// radius and by e (cos θ − cos S/2) across, less what is linear between the ends, which for S ≤
/// 3π/2 is below 1.3·|r1 − r0|. Guarantee (test): (a), (b) and (c) are within it for all sweeps up
/// to 3π/2.
/// @pre the sweep is at most kMostSweep
double arc_spread(const BentMove& move);

/// rad: 3π/2, of arcs that are printed and read.
inline constexpr double kMostSweep = 4.71238898038469;

/// A place of a smooth joint path with derivatives by its parameter s.
struct PathEnd {
  JointVector joints, first, second;
};

/// The bend of the polynomial that goes from `from` to `to` over `length` of s with the path's
/// first derivative at both ends (degree 3) and its second one, too (degree 5), so that moves one
/// behind the other meet with a continuous tangent, or tangent and curvature.
///
/// With D = q1 − q0, d = length·q', k = length²·q'':
///   degree 3: c2 = 3D − 2d0 − d1, c3 = −2D + d0 + d1;
///   degree 5: c2 = k0/2, c3 = 10D − 6d0 − 4d1 − 3/2 k0 + 1/2 k1,
///             c4 = −15D + 8d0 + 7d1 + 3/2 k0 − k1, c5 = 6D − 3d0 − 3d1 − 1/2 k0 + 1/2 k1.
/// Guarantee (test): a polynomial of that degree comes back.
/// @pre degree is 3 or 5, length > 0, one value per joint   @throws ContractViolation if not.
JointBend hermite_bend(const PathEnd& from, const PathEnd& to, double length, int degree);

}  // namespace smoothpost
