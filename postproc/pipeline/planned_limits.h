#pragma once

#include <vector>

#include "machines/definition/machine.h"
#include "postproc/pipeline/laser_plan.h"
#include "postproc/pipeline/verify.h"

namespace smoothpost {

/// acceleration_limit.<axis> and jerk_limit.<axis> of the stretches that were optimised, and the
/// peaks and rms jerk in `axes` (machine-file order), from the splines of the plan.
///
/// A value is the largest of all stretches with its input line, the limit the machine's own (not
/// times limit_share). Both are `planned`: true of the plan inside the stretches, which is what a
/// controller makes of it only if it keeps our times; between the stretches, and at level geometry,
/// it moves as it likes. Empty when there is no stretch.
/// @pre every stretch has a JointPeaks for each axis, axes.size() == machine.size()
/// @throws ContractViolation if not.   Cost: linear in stretches and axes.
Checks planned_limit_checks(const std::vector<LaserStretch>& stretches,
                            const MachineDefinition& machine, std::vector<AxisSummary>& axes);

/// What a certificate with these checks takes for granted.
std::string planned_limits_assumption();

}  // namespace smoothpost
