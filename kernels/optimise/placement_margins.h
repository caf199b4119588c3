#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/kinematics/inverse.h"
#include "kernels/optimise/arm_reach.h"

namespace smoothpost {

/// One tool location of a path that is to be placed.
struct PlacementPoint {
  Vec3 tip = Vec3::Zero();           ///< of the chain's own tool, mm in W
  Vec3 axis = Vec3::UnitZ();         ///< unit, in W
  Mat3 rotation = Mat3::Identity();  ///< of T in W; PlacementTask::whole_rotation only
  bool joined = false;               ///< the joints go continuously from the point before to here
  std::uint32_t line = 0;            ///< input line, for messages
};

struct PlacementTask {
  std::vector<PlacementPoint> points;
  bool whole_rotation = false;     ///< the task gives the rotation about the tool, too
  std::vector<double> spins{0.0};  ///< rad: rotations about the tool to choose from (arms)
  JointVector held;                ///< values of held joints; home of the arm for the spins
};

/// How much room a path leaves, each margin with the point where it is least.
struct PlacementMargins {
  struct Margin {
    double value = 1.0;     ///< 1: in the middle; 0: at the border; negative: beyond it
    std::size_t point = 0;  ///< index of the point
  };
  std::vector<Margin> joints;  ///< by joint; 1 for held ones
  Margin singular;             ///< arms: ArmReach::singular()
  Margin reach;                ///< 1, or minus the largest lack of a point out of reach
  int branch = 0;
  double spin = 0.0;

  /// The least of them all. Not negative: every point is within reach and limits.
  double least() const;
  /// Mean of joints and singular, each from −1 up: decides between places of the same least margin.
  double mean = 0.0;
};

/// Margins of a tool path on a machine, as a function of where the part stands.
///
/// Definition. Over all branches b and spins ψ,
///   margins(X) = those of the (b, ψ) with the largest  least + 0.001 · mean,
/// where, for one of them, the joint values q_i of point i are those of branch b at the tool pose
/// X · X_WT,i, and
///  - a linear joint: min_i 1 − |q_i − m|/h, with [m − h, m + h] its range;
///  - a rotary: points are joined to stretches on which each value is at the turn nearest to the
///  one
///    before; a stretch as a whole stands at the number of turns that keeps it nearest to m; then
///    as for a linear joint;
///  - singular: min_i of ArmReach::singular (arms). The pole of a rotary pair has no margin: it
///    depends on the tool axis alone, and the tracking of branches passes it;
///  - reach: minus the largest lack of a point (1 when there is none): ArmReach::nearest for arms,
///    whose joint values are then those of the nearest pose; for a rotary pair the angle of the
///    tool axis from the nearest that can be reached, by π, and the point gives no joint values.
/// So the margins are continuous where a point goes out of reach, and slope towards reach beyond.
///
/// The rotation of T of an arm without whole_rotation is
///   M(a → n) · Rot(a, ψ) · M(h → a) · R_home,
/// with n the tool axis, h the tool axis at home (`held`), a the first of ±Z, ±X, ±Y of W that no n
/// of the path is within 20° of the opposite of (else the farthest), M(x → y) the least rotation
/// from x to y: one angle ψ for the whole path.
///
/// Clearance would be one more margin beside `singular`.
class PlacementMeasure {
 public:
  /// @pre points and spins are not empty; held.size() == number of joints
  /// @throws ContractViolation if not.
  PlacementMeasure(const Inverse& inverse, PlacementTask task);

  /// Margins with the part at `placement` (X_W0W, W0 the workpiece frame of the chain).
  /// Guarantees (tests): equals the definition evaluated branch by branch, spin by spin; continuous
  /// at the border of reach; deterministic.
  /// Cost: points × spins inverse solutions at most, usually little more than points, because a
  /// spin is left as soon as it cannot be the best.
  PlacementMargins at(const Pose& placement) const;

  /// least + 0.001 · mean of margins.
  static double score(const PlacementMargins& margins);

  const Inverse& inverse() const { return inverse_; }
  const PlacementTask& task() const { return task_; }

 private:
  struct Solutions;
  struct Walk;

  void choose_reference();
  Solutions solve(std::size_t point, const Pose& placement, const Mat3& turned_home) const;
  void solve_arm(const Pose& tool, Solutions& out) const;
  void solve_pair(const CutterLocation& tool, Solutions& out) const;
  std::optional<PlacementMargins> with_spin(const Pose& placement, double spin, double bound) const;

  Inverse inverse_;
  PlacementTask task_;
  std::optional<ArmReach> reach_;
  Vec3 reference_ = Vec3::UnitZ();  ///< a
  std::vector<Mat3> lean_;          ///< M(a → n) of every point
  Mat3 home_ = Mat3::Identity();    ///< R_home in W0
  Vec3 first_ = Vec3::UnitZ();      ///< direction of a rotary pair's first rotary, in W0
  double nearest_ = 0.0;            ///< angles between it and the tool axes that can be reached
  double farthest_ = 0.0;
};

}  // namespace smoothpost
