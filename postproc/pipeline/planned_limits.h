#pragma once

#include <vector>

#include "machines/definition/machine.h"
#include "postproc/pipeline/laser_plan.h"
#include "postproc/pipeline/verify.h"

namespace smoothpost {

/// acceleration_limit.<axis> and jerk_limit.<axis> of a feed schedule, and the peaks and rms jerk
/// in `axes` (machine-file order).
///
/// A value is the largest of the schedule's stretches with its input line (`peaks`, in joint
/// order), the limit the machine's own (not times limit_share), `time` the seconds of all
/// stretches. Both are `planned`: what a controller makes of it only if it keeps our times; links,
/// and at level geometry everything, it moves as it likes. Empty when `peaks` is.
/// @pre peaks is empty or has one for each axis, axes.size() == machine.size()
/// @throws ContractViolation if not.   Cost: linear in stretches and axes.
Checks planned_limit_checks(const std::vector<JointPeaks>& peaks, double time,
                            const MachineDefinition& machine, std::vector<AxisSummary>& axes);

/// What a certificate with these checks takes for granted.
std::string planned_limits_assumption();

}  // namespace smoothpost
