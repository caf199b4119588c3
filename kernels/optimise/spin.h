#pragma once

#include <string>
#include <vector>

#include "kernels/kinematics/jet.h"
#include "kernels/kinematics/six_r.h"
#include "kernels/optimise/arm_reach.h"

// The rotation about the tool axis of an arm whose task leaves it free, as a smooth function of the
// path's length.
namespace smoothpost {

/// ψ(x) = Σ cᵢ·Nᵢ(x): a uniform quintic B-spline (C⁴) over path length, rad over mm.
/// With one coefficient ψ is that constant.
class SpinProfile {
 public:
  SpinProfile() = default;
  /// @pre coefficients.size() is 1 or at least 6, length > 0   @throws ContractViolation if not.
  SpinProfile(std::vector<double> coefficients, double length);
  /// ψ at path length x, held at the ends of [0, length].   Cost: O(1), no allocation.
  double at(double x) const;
  /// ψ with its derivatives by x inside [0, length], constant beyond.   Cost: likewise.
  Jet jet(double x) const;
  const std::vector<double>& coefficients() const { return coefficients_; }

 private:
  std::vector<double> coefficients_ = {0.0};
  double length_ = 1.0;
};

/// A point of the path for the choice of the rotation.
struct SpinPoint {
  Pose tool = Pose::Identity();  ///< X_WT that the arm is asked for at ψ = 0
  double length = 0.0;           ///< mm along the path, not decreasing
  bool cut = false;              ///< joined to the point before by a cut (links may turn freely)
};

/// What a rotation does to the arm, over all points on the best branch.
struct SpinMeasure {
  double margin = -1.0;  ///< least share of a joint's half range (below 0 beyond it), or of
                         ///< singular(), that is left; with points out of reach: the same or 0,
                         ///< whichever is less, minus the share of the points that are lost
  double jerk = 0.0;     ///< rad/mm³, root mean square of the joints' third differences by length
};

/// The measure of ψ(x) on the points.
///
/// X_WT(ψ) = X_WT(0)·Rot(tool axis, ψ). Of the eight branches the one with the best margin counts;
/// joints keep their turn from point to point and are centred in their range where they start.
/// Guarantee (test): the margin is that of its definition at every point.
/// Cost: O(points), about 1 µs each.
SpinMeasure measure_spin(const SixR& arm, const std::vector<SpinPoint>& points,
                         const SpinProfile& profile);

struct SpinResult {
  SpinProfile profile;
  SpinMeasure before, after;
  int evaluations = 0;
};

/// The profile, around the constant `start`, that keeps the arm farther from its limits and from
/// singular postures and lowers its jerk: least of −margin + 0.05·log10(1 + jerk/jerk_before) over
/// `coefficients` numbers by NLopt's Subplex (no gradient: the margin has kinks), at most
/// `evaluations` measures; deterministic.
/// Guarantee (tests): the margin is never below the start's; a path that a constant cannot follow
/// without a limit is followed.
/// @pre points not empty, coefficients ≥ 6   @throws ContractViolation if not.
SpinResult optimise_spin(const SixR& arm, const std::vector<SpinPoint>& points, double start,
                         int coefficients = 10, int evaluations = 600);

/// A smooth profile near wanted angles at path lengths (unwrapped): every coefficient is the mean
/// of the angles over its basis function. Follows slow changes, rounds fast ones off.
/// @pre same sizes, not empty; lengths do not decrease; coefficients ≥ 6
SpinProfile spin_near(const std::vector<double>& lengths, const std::vector<double>& angles,
                      int coefficients);

}  // namespace smoothpost
