#pragma once

#include <string>

#include "kernels/optimise/shape_tuning.h"
#include "postproc/pipeline/joint_plan.h"
#include "postproc/pipeline/smoothed_path.h"

// What a conversion tells about its plan.
namespace smoothpost {

/// Six decimals without trailing zeros.
std::string number(double value);
/// Four significant digits.
std::string four_digits(double value);

/// Kind, shape and shares of the tolerances by the machine's recipe.
SmoothingSettings smoothing_settings(const MachineDefinition& machine);

/// KN133: shape before and after, and what is left of the jerk. `acr`: else ramps.
Diagnostic tuning_note(const TuningResult& tuning, bool acr, const std::string& file_name);

/// KN131: what an optimised rotation about the tool has gained; KN132: the lines where an arm
/// passes near a singular posture, one message for each kind.
Diagnostics posture_notes(const JointPlan& plan, const std::string& file_name);

}  // namespace smoothpost
