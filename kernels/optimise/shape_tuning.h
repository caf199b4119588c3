#pragma once

#include <functional>
#include <vector>

#include "kernels/core/joints.h"
#include "kernels/kinematics/inverse.h"
#include "kernels/smooth/corner_path.h"

// The shape of corner blends chosen for a machine's joints: [Cai2025] asks for it as further work.
namespace smoothpost {

/// The free numbers of a blend function: κ and λ of acr, c1 of ramp.
struct BlendShape {
  AcrShape acr;
  double c1 = 0.0;
};

struct TuningSettings {
  CornerSettings corners;    ///< kind and tolerances; the shape is what is looked for
  JointVector jerk_limits;   ///< rad or mm by s³, to weigh joints by
  JointVector start;         ///< joints near which the corners are taken
  double tool_length = 0.0;  ///< mm
  int most_corners = 24;     ///< those that turn most count
  int evaluations = 80;
};

struct TuningResult {
  BlendShape before, after;
  double peak_before = 0.0, peak_after = 0.0;  ///< see peak_joint_jerk(), 1/mm³ of the limits' unit
  int evaluations = 0;
  int corners = 0;  ///< that the machine reaches
};

/// The largest |d³q_j/dσ³| / jerk limit of any joint over the windows of some three-node corners,
/// by differences on 96 places of each window. Joints follow continuously from the solution nearest
/// to `settings.start`; corners out of reach do not count. At constant feed the joint jerk is this
/// times feed³. Cost: corners · 96 inverse solutions.
double peak_joint_jerk(const Inverse& inverse, const std::vector<CornerPath>& corners,
                       const TuningSettings& settings, int& reached);

/// The corners of a path as paths of their own: legs shortened to half where the neighbour corner
/// takes its share, the `most` that turn most, in path order.
std::vector<CornerPath> single_corners(const std::vector<CornerPath>& runs,
                                       const CornerSettings& settings, int most);

/// κ and λ of acr in [0.4, 0.6] × [−0.5, 2.5], or c1 of ramp in [−1.09, 6.56], for the least
/// peak_joint_jerk() of the path's corners, by NLopt's Subplex from κ = λ = 1/2 (ramp: the mean of
/// ramp_c1() over the corners).
/// Guarantees (tests): never worse than the start; inside the box; deterministic.
/// Cost: evaluations · corners · 96 inverse solutions.
/// @pre runs not empty, one jerk limit > 0 for each joint   @throws ContractViolation if not.
TuningResult tune_blend_shape(const Inverse& inverse, const std::vector<CornerPath>& runs,
                              const TuningSettings& settings);

}  // namespace smoothpost
