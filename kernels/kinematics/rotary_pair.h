#pragma once

#include <array>
#include <optional>
#include <vector>

#include "kernels/kinematics/screw_chain.h"

namespace smoothpost {

/// The solutions of one cutter location: at most two branches (index = branch, stable per chain).
struct RotaryPairSolutions {
  std::array<JointVector, 2> q;
  std::array<bool, 2> valid{false, false};
  /// The tool axis is parallel to the first rotary: its angle is free and was held.
  bool at_pole = false;
};

/// A tool axis at which the first rotary does not turn the tool axis.
struct RotaryPole {
  Vec3 axis = Vec3::UnitZ();  ///< unit, in W: plus or minus the first rotary's direction
  double second = 0.0;        ///< value of the second rotary there, rad in (−π, π]
  double angle = 0.0;         ///< rad from the tool axis that was asked for to `axis`
};

/// Universal closed form for chains with two free rotaries and three free linears, in any order and
/// direction, with any number of held (redundant) joints.
///
/// Definition. Along the flattened chain let e1, e2 be the directions of the first and second free
/// rotary, a0 the tool axis at 0, all at the held joints' values, ẑ = ±e1 with ẑ·a0 ≥ 0, and let
/// θk, θm, θa be the angles (ẑ, e2), (e2, a0), (ẑ, tool axis). They are the sides of a spherical
/// triangle, so the second rotary is β0 ± Δ, where β0 brings the tool axis nearest to ẑ, and
///   P = cos(θk−θm) − cos θa,   Q = cos θa − cos(θk+θm),   tan²(Δ/2) = P/Q;
/// it can be reached when P ≥ 0 and Q ≥ 0. The first rotary is the angle about ẑ between the two
/// axes. The linears then solve a 3×3 system whose columns are their directions.
///
/// Branch 0 is β0 + Δ, branch 1 is β0 − Δ with Δ ∈ [0, π]: the sign of the square root. The index
/// is stable along a path; the branches meet only where the tool axis is nearest to or farthest
/// from ±e1. For the laser of paper B that is q5 ≥ 0 (branch 0) and q5 ≤ 0 (branch 1).
class RotaryPair {
 public:
  /// Nothing when the chain is not of this kind (count of free joints, parallel rotaries, tool axis
  /// along the second rotary, dependent linears). Cost: once per machine; everything constant is
  /// computed here.
  static std::optional<RotaryPair> from(const ScrewChain& chain);

  /// Joint values that bring the tool to `location`; held joints and, at the pole, the first rotary
  /// take their value from `held`. Rotary angles are in (−π, π] (no turns, no limits applied).
  ///
  /// Guarantees (tests): FK(IK(x)) = x; every pose reached by the chain has a solution, with its
  /// own branch among them; relative accuracy of the tilt down to 1e-9 rad (no acos; the chord
  /// |axis − ẑ| in place of 1 − cos θa).
  ///
  /// At the pole, sin θa < 1e-9: the first rotary is held, both branches are the same joint values
  /// and the tool axis is the pole exactly, so the axis differs by less than 1e-9 rad; the tip does
  /// not. An axis beyond reach by no more than 1e-12 rad takes the nearest reachable one; beyond
  /// that both branches are invalid.
  ///
  /// Units: mm, rad, W.
  ///
  /// Cost: three atan2, six square roots; no sine or cosine unless at the pole, no allocation.
  /// Chains with a held rotary compute their constants anew at each call.
  ///
  /// @param location  unit tool axis within 1e-6 (it is normalised)
  /// @pre held.size() == number of joints
  /// @throws ContractViolation if not, or if the axis is no unit vector
  ///
  /// Implements [Ding2025] Eq. (2)-(3), which is the laser's case of it.
  ///
  /// Differences from the paper: Eq. (3) prints atan2(Ox, Oy) and +acos(Oz) for both k = ±1. Right
  /// is q4 = atan2(Oy, Ox) with +q5 and + π with −q5, q5 = atan2(hypot(Ox, Oy), Oz); Eq. (46) has
  /// the opposite sign of (2)-(3). Golden cases of the corrected form are tests.
  RotaryPairSolutions solve(const CutterLocation& location, const JointVector& held) const;

  /// `q` with its three free linears replaced so that the tip is at `tip` (mm, W); the rotaries and
  /// held joints are taken as they are. Nothing when the linears are dependent at these rotaries.
  /// Cost: two sines and cosines, no allocation.
  /// @pre q.size() == number of joints   @throws ContractViolation if not.
  std::optional<JointVector> with_linears(const Vec3& tip, const JointVector& q) const;

  /// The reachable pole nearest to `axis` (unit, W), or nothing when the chain cannot bring its
  /// tool along the first rotary. `held`: values of the held joints.
  /// @pre held.size() == number of joints   @throws ContractViolation if not.
  std::optional<RotaryPole> nearest_pole(const Vec3& axis, const JointVector& held) const;

  /// Joint index of the rotary next to the workpiece end of the chain: the one that is free at a
  /// pole.
  int first_rotary() const { return first_; }
  int second_rotary() const { return second_; }
  const ScrewChain& chain() const { return chain_; }

 private:
  /// A linear joint in the flattened chain: before the first rotary (group 0), between the two (1),
  /// after the second (2).
  struct Linear {
    int joint = 0;
    int group = 0;
    Vec3 direction = Vec3::UnitX();  ///< in F
  };

  /// The chain at given held rotaries, seen in F: origin at the first rotary's, z = ẑ, e2 in the
  /// x-z plane, the second rotary counted from β0.
  struct Geometry {
    Mat3 rotation = Mat3::Identity();  ///< R_FW
    Vec3 shift = Vec3::Zero();         ///< p_F = rotation·p_W + shift
    double sign = 1.0;                 ///< ẑ = sign · e1
    double cosine = 0.0;               ///< e2 = (sine, 0, cosine): of θk
    double sine = 1.0;
    double sine_tool = 1.0;     ///< of θm
    double sine_gap = 0.0;      ///< of θk − θm
    double near_gap = 0.0;      ///< |θk − θm|: nearest that the axis comes to ẑ
    double far_gap = 0.0;       ///< |π − θk − θm|: nearest that the axis comes to −ẑ
    double near_versine = 0.0;  ///< 1 − cos(θk − θm)
    double far_versine = 0.0;   ///< 1 + cos(θk + θm)
    double offset = 0.0;        ///< β0
    Vec3 second_origin = Vec3::Zero();
    Vec3 tip = Vec3::Zero();  ///< from the second origin, second rotary at β0
    std::array<Linear, 3> free;
    std::vector<Linear> held;         ///< held linears
    int group = 0;                    ///< the free linears' group; −1: several
    Mat3 inverse = Mat3::Identity();  ///< of the free directions, when they are one group
  };
  struct Rotation;  ///< sines and cosines of one solution, in F
  struct Reach;

  static std::optional<Geometry> geometry_of(const ScrewChain& chain, const JointVector& held);
  static bool linears_independent(const Geometry& geometry);
  static Reach reach_of(const Geometry& geometry, const Vec3& axis);
  static bool solve_linears(const Geometry& geometry, const Rotation& rotation, const Vec3& tip,
                            JointVector& q);

  ScrewChain chain_;
  int first_ = 0;
  int second_ = 0;
  bool held_rotary_ = false;
  Geometry geometry_;  ///< of the chain when no rotary is held
};

}  // namespace smoothpost
