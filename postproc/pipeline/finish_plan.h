#pragma once

#include <string>
#include <vector>

#include "kernels/collision/scene.h"
#include "kernels/core/progress.h"
#include "kernels/kinematics/rotary_pair.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/finish_path.h"
#include "postproc/pipeline/joint_plan.h"
#include "postproc/pipeline/planned_path.h"

namespace smoothpost {

/// How the free joint of one cut was chosen.
struct FinishResolution {
  std::size_t cut = 0;
  std::uint32_t first_line = 0;   ///< of the path
  std::string seed;               ///< "minimum norm", or "grid" where that leaves a limit
  double start = 0.0, end = 0.0;  ///< of the free joint, rad or mm
  bool wound_back = false;        ///< the link before it has to turn the free joint
  double jerk_before = 0.0, jerk_after = 0.0;  ///< Σ ∫ (q'''/limit)² ds before and after smoothing
  int passes = 0;
  bool collides = false;  ///< somewhere along the cut, whatever the free joint does
};

struct FinishPlan {
  JointPlan joints;
  std::vector<PlannedStretch> paths;  ///< one a cut
  std::vector<FinishResolution> resolutions;
};

struct FinishPlanInput {
  const FinishPath& path;
  const std::vector<Cut>& cuts;  ///< of path.path; omitted ones have no samples
  const MachineDefinition& machine;
  const RotaryPair& pair;        ///< of the output chain: tool length 0, part placed
  std::string file_name;         ///< for messages
  const Scene* scene = nullptr;  ///< what must not meet; nullptr: not looked at
};

/// The joints of a finishing path on a machine with one redundant joint, cut by cut: by
/// resolve_globally a value of the free joint that keeps every joint inside its limits, for a
/// closed contour such that it ends as it started but for its turn; from there the closed minimum
/// norm (minimum_norm, weights 1/v² of the velocity limits) where that keeps the limits too; then
/// smooth_free for the jerk. Where the scene is not free the grid goes another way if there is one,
/// and what follows from minimum norm and smoothing is taken only if it is free as well, looked at
/// every millimetre; if there is no way, the cut is planned without the scene and the certificate
/// says what collides. A cut starts where the one before ended if it can, else the link turns the
/// free joint. Failures, with the place on the path and the joint: KN170 no value of the free joint
/// keeps the limits; KN171 no way through; KN172 the machine does not have one redundant joint.
/// Cost: about 50 ms a cut of 300 mm; cuts are smoothed on all threads, with the same result on any
/// number of them.
Result<FinishPlan> plan_finish(const FinishPlanInput& input, const Progress& progress);

/// The cuts (indices, ascending) that plan_finish() would refuse or find to collide, or whose links
/// have no room for their clearance, each by itself between its neighbours that are none of that.
/// Failures: KN172. Cost: that of the grid, about 20 ms a cut of 300 mm.
Result<std::vector<std::size_t>> cuts_out_of_reach(const FinishPlanInput& input,
                                                   const Progress& progress);

/// What was chosen, for the user: a note KN173.
Diagnostics finish_notes(const FinishPlan& plan, const MachineDefinition& machine,
                         const std::string& file_name);

}  // namespace smoothpost
