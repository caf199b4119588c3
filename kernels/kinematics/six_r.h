#pragma once

#include <array>
#include <optional>

#include "kernels/kinematics/screw_chain.h"

namespace smoothpost {

/// The solutions of one tool pose: at most eight branches (index = branch, stable per chain).
struct SixRSolutions {
  std::array<JointVector, 8> q;
  std::array<bool, 8> valid{};
  bool shoulder_singular = false;  ///< the wrist centre is on the first axis: q1 is free, was held
  bool elbow_singular = false;     ///< the wrist centre is on the second axis: q2 is free, was held
  /// Per shoulder and elbow (branch & 3): the fourth and sixth axis are parallel; only the sum or
  /// difference of their angles is determined and the fourth was held.
  std::array<bool, 4> wrist_singular{};
};

/// Closed form of the ortho-parallel six-axis arm with spherical wrist: six rotary joints on the
/// tool side with e1 ⊥ e2 ∥ e3 ⊥ e4 ⊥ e5 ⊥ e6 whose last three axes meet in one point. Lengths,
/// offsets (a1, a2, b, c1..c4 of the OPW literature), zeros and directions of the joints, base
/// placement and tool are whatever the screws say; there is no second place for them.
///
/// Definition. Frame F: origin on the first axis, z = e1, y = e2, x = y × z. A point (x, z) of the
/// arm's plane is ζ = z + i·x, so that a turn θ about y is ζ e^(iθ). With
///   A = ζ of axis 2,  U = ζ of axis 3 − A,  V = ζ of the wrist centre − ζ of axis 3  (joints at
///   0), b = y of the wrist centre,  s = e3·e2 = ±1,
/// the wrist centre is at p_F = Rz(q1)·(X, b, Z) with
///   Z + iX = A + e^(iq2) (U + e^(i·s·q3) V).
/// So X = ±√(px² + py² − b²) gives q1. With D = |Z + iX − A| and ±γ the angle from U to V there,
///   P = (|U|+|V|)² − D²,  Q = D² − (|U|−|V|)²,  tan²(γ/2) = P/Q   (no acos),
/// gives q3, and then q2. The wrist is what remains of the rotation, Rz(q4+ε) Ry(q5+δ) Rz(q6) with
/// constants ε, δ of the chain; q4 is read from its third column and q6 from its second row seen
/// from axis 4, which has no small denominator.
///
/// Branch index:
///  - bit 0, shoulder: 0 = front, the wrist centre is on that side of the first axis where the
///    second axis is (the sign of A's x; X ≥ 0 when the two axes meet); 1 = back, the other side.
///  - bit 1, elbow: 0 = +γ, V turned from U in the sense of e2; 1 = −γ.
///  - bit 2, wrist: 0 = q5 + δ in [0, π]; 1 = the flipped wrist, q5 + δ in [−π, 0].
class SixR {
 public:
  /// Nothing when the chain is not of this kind (within 1e-9 of the directions, 1e-9 mm of the
  /// wrist's crossing, and |U|, |V| > 1e-6 mm). `redundant` flags and limits are not looked at.
  /// Cost: once per machine.
  static std::optional<SixR> from(const ScrewChain& chain);

  /// Joint values of all eight branches that bring the tool to X_WT; angles in (−π, π] (no turns,
  /// no limits applied). Free angles of singular poses take the value in `near`.
  ///
  /// Guarantees (tests): FK(IK(x)) = x to 1e-9 mm and 1e-12 rad; every pose reached by the chain
  /// has a solution, with its own branch among them; no NaN.
  ///
  /// Singular poses: a wrist centre within 1e-10 mm of the first (second) axis holds q1 (q2); a
  /// wrist within 1e-12 rad of parallel axes 4 and 6 holds q4, and both wrist branches are the same
  /// joint values. Out of reach: the branch is invalid; by no more than 1e-10 mm: the nearest.
  ///
  /// Units: mm, rad, W.   Cost: 20 atan2, 9 square roots; no allocation; no sine or cosine unless
  /// held.
  /// @pre near.size() == 6; the linear part of X_WT is a rotation
  /// @throws ContractViolation if the size is another.
  ///
  /// Implements [Brandstotter2014], the closed form of the ortho-parallel arm.
  /// Differences from the paper: it has the elbow by acos and q5 by √(1 − m²), which lose half the
  /// digits at their ends, and q4 and q6 apart, which leaves their sum undetermined near q5 = 0;
  /// the tests of the singular poses show both. Screws take the place of its seven lengths.
  SixRSolutions solve(const Pose& X_WT, const JointVector& near) const;

  /// The same with free angles of singular poses at 0.
  SixRSolutions solve(const Pose& X_WT) const;

  /// The branch that q belongs to: bits as above, by the signs of X, γ and q5 + δ.
  /// Cost: three sines and cosines.
  /// @pre q.size() == 6   @throws ContractViolation if not.
  int branch_of(const JointVector& q) const;

  const ScrewChain& chain() const { return chain_; }

 private:
  /// z + i·x: a vector of the arm's plane, or (of length 1) a turn about y.
  struct Planar {
    double z = 1.0;
    double x = 0.0;
  };
  struct Target;
  struct Shoulder;
  struct Elbow;
  struct Arm;
  friend Planar operator*(const Planar& a, const Planar& b) {
    return {a.z * b.z - a.x * b.x, a.z * b.x + a.x * b.z};
  }

  bool set_arm();
  bool set_wrist();
  Target target_of(const Pose& X_WT) const;
  Shoulder shoulder_of(const Vec3& wrist, double side, double near) const;
  Elbow elbow_of(const Shoulder& shoulder) const;
  Arm arm_of(const Shoulder& shoulder, const Elbow& elbow, double bend, double near) const;
  bool solve_wrist(const Mat3& rotation, const Arm& arm, double near, JointVector& plain,
                   JointVector& flipped) const;

  ScrewChain chain_;
  Mat3 base_ = Mat3::Identity();    ///< R_MF
  Mat3 to_arm_ = Mat3::Identity();  ///< R_FW
  Vec3 shift_ = Vec3::Zero();       ///< p_F = to_arm · p_W + shift
  Mat3 hand_ = Mat3::Identity();    ///< from the wrist's frame after the sixth joint to T
  Vec3 wrist_ = Vec3::Zero();       ///< wrist centre in T
  Planar second_{0.0, 0.0};         ///< A
  Planar upper_;                    ///< U / |U|
  Planar bend_;                     ///< e^(i·arg(V/U))
  Planar fore_;                     ///< e^(iη) with e4 = Ry(η) z
  double upper_length_ = 0.0;       ///< |U|
  double fore_length_ = 0.0;        ///< |V|
  double bend_angle_ = 0.0;         ///< arg(V/U)
  double elbow_sign_ = 1.0;         ///< s
  double front_ = 1.0;              ///< sign of X on the front side
  double offset_ = 0.0;             ///< b
  double fourth_ = 0.0;             ///< ε
  double fifth_ = 0.0;              ///< δ
};

}  // namespace smoothpost
