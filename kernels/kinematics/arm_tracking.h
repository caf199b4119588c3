#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/kinematics/branch_tracking.h"
#include "kernels/kinematics/six_r.h"

namespace smoothpost {

/// A pose to be reached by a six-axis arm, and how.
struct ArmPoint {
  Pose tool = Pose::Identity();  ///< X_WT
  bool cut = false;              ///< the joints must be continuous on the motion that ends here
  std::uint32_t line = 0;        ///< input line, for messages
};

struct ArmTrackingSettings {
  JointVector start;              ///< where the joints are before the first point
  double continuity = 0.8726646;  ///< rad: largest step of a joint on a cutting motion
};

/// One global choice of branch and turns of a six-axis arm along a path, by dynamic programming.
///
/// Definition. A choice gives each point one of the branches of SixR::solve() and whole turns of
/// all joints. It is allowed when every joint is within its limits (1e-9 of slack) and, on a motion
/// that cuts, no joint steps by more than `continuity`. The result has the least
///   0.01 Σ|q − start| at the first point + Σ over motions of Σ_j |Δq_j|   (rad).
/// At a singular wrist (shoulder) the free angle is that of the previous point's best choice.
///
/// Guarantees (tests): cost of an exhaustive search on small paths; limits; continuity; a wrist
/// that winds up is unwound on a motion that does not cut; dead ends are listed as track_branches()
/// does. Status, messages and units as there; joints count from 1 in texts. Cost: O(points ·
/// candidates²), candidates ≤ 8 · turns within the limits, at most 512 a point (the first by branch
/// and turn).
/// @pre settings.start.size() == 6   @throws ContractViolation if not.
BranchTracking track_arm(const SixR& arm, const std::vector<ArmPoint>& points,
                         const ArmTrackingSettings& settings);

}  // namespace smoothpost
