#pragma once

#include <optional>
#include <vector>

#include "postproc/pipeline/joint_plan.h"

namespace smoothpost {

/// What a program asks of one joint when it is run as it is: at its programmed feed, straight
/// through its corners.
struct InputMotion {
  double velocity = 0.0;               ///< mm/s or rad/s, largest
  std::optional<double> acceleration;  ///< largest; nothing where it diverges
  std::optional<double> jerk;          ///< likewise
  std::optional<double> rms_jerk;      ///< over all samples; nothing where jerk diverges
};

/// By differences of joint positions every 4 ms. A peak that is more than 1.3 times as large at 2
/// ms belongs to a corner, where it grows without bound as the step shrinks: nothing then. Runs of
/// feed motions with a time are one motion each, without ramps at their ends; rapids, what is
/// replanned and motions that the plan makes straight in the joints are left out.
///
/// @param path  the input's own path: SmoothedPath(reference)
/// @param plan  the joints on it, plan_joints() or plan_arm()
/// In joint order; empty where no run has four samples or the program is longer than 4000 s.
/// Cost: 750 inverse solutions a second of programmed motion.
std::vector<InputMotion> input_motion(const SmoothedPath& path, const JointPlan& plan, int joints);

}  // namespace smoothpost
