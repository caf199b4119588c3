#pragma once

#include <array>

#include "kernels/kinematics/six_r.h"

namespace smoothpost {

/// How far a tool pose lies beyond the reach of a six-axis arm, and how near its posture is to a
/// singular one: what a search for a better place needs to know where SixR::solve() only says no.
///
/// Definition, in the words of six_r.h: F is the frame at the first axis (z = e1, y = e2), (X, b,
/// Z) the wrist centre after −q1, A, U, V the second axis, upper arm and forearm in the arm's
/// plane, D = |(Z, X) − A|. The front side has X on the side of A, the back side on the other.
///  - lack(side) = [max(0, D − |U| − |V|, ||U| − |V|| − D) + max(0, b − r)] / (|U| + |V|), with r
///  the
///    distance of the wrist centre from the first axis and X = ±√max(0, r² − b²);
///  - singular(q) = the least of |sin| of the angle between axes 4 and 6 (wrist), |sin γ| of the
///    angle between U and V (elbow), and min(1, |X| / (|U| + |V|)) (shoulder).
///
/// Units: mm, rad, W; both measures are shares without unit.
class ArmReach {
 public:
  /// Cost: once per machine.
  explicit ArmReach(const SixR& arm);

  /// A pose out of reach, and the nearest pose of the same rotation on that side that is not.
  struct Nearest {
    double lack = 0.0;  ///< 0: within reach
    Pose tool = Pose::Identity();
  };

  /// Guarantees (tests): lack is 0 exactly where SixR::solve() has a solution on that side (but for
  /// 1e-8 of |U| + |V| at its border); it is continuous and grows with the distance; the nearest
  /// pose has a solution on that side, unless the way to it crosses the first axis.
  /// @param side 0 front, 1 back: bit 0 of SixR's branch
  /// Cost: three square roots, no allocation.
  Nearest nearest(const Pose& X_WT, int side) const;

  /// Guarantee (test): equals the three measures taken from jacobian() and forward().
  /// Cost: four sines and cosines, no allocation.
  /// @pre q.size() == 6   @throws ContractViolation if not.
  double singular(const JointVector& q) const;

  /// The three measures that singular() is the least of.
  struct Posture {
    double wrist = 0.0, elbow = 0.0, shoulder = 0.0;
  };
  Posture posture(const JointVector& q) const;

  /// |U| + |V|, mm.
  double length() const { return upper_ + fore_; }
  /// Centre, in W, of the ball that holds every place of the tip, and its radius, mm.
  Vec3 centre() const;
  double radius() const;

 private:
  struct Planar {
    double z = 0.0;
    double x = 0.0;
  };

  Mat3 to_arm_ = Mat3::Identity();  ///< R_FW
  Vec3 shift_ = Vec3::Zero();       ///< p_F = to_arm · p_W + shift
  Vec3 wrist_ = Vec3::Zero();       ///< wrist centre in T
  Planar second_;                   ///< A
  Planar up_;                       ///< U with every joint 0
  Planar out_;                      ///< V with every joint 0
  double front_ = 1.0;              ///< sign of X on the front side
  double offset_ = 0.0;             ///< b
  double upper_ = 0.0;
  double fore_ = 0.0;
  double elbow_turn_ = 1.0;               ///< e3·e2
  std::array<double, 2> bend_{0.0, 0.0};  ///< sin γ = bend[0] cos q3 + bend[1] sin q3
  std::array<double, 2> hand_{0.0, 0.0};  ///< the same of the wrist with q5
};

}  // namespace smoothpost
