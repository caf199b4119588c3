#pragma once

#include <cstdint>

#include "kernels/kinematics/branch_tracking.h"
#include "postproc/pipeline/joint_plan.h"

// What a planner says when there is no way: kernels count joints from 1, people know axes by name.
namespace smoothpost {

/// KN101, KN102 or KN103 (one for each rewind).   @pre tracking.status is not ok
Diagnostics tracking_failure(const BranchTracking& tracking, std::uint32_t line,
                             const JointPlanSettings& settings);
/// KN104: a motion that cannot be followed inside the tolerances.
Diagnostic too_steep(std::uint32_t line, const JointPlanSettings& settings);
Diagnostic plan_cancelled();

}  // namespace smoothpost
