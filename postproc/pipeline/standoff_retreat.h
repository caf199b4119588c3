#pragma once

#include <vector>

#include "kernels/collision/scene.h"
#include "kernels/kinematics/rotary_pair.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/joint_plan.h"

// A standoff that is held longer, so that the head stays clear where programmed joints are kept.
namespace smoothpost {

/// mm by which the standoff has to be longer for all of these samples to be free; 0 when they are,
/// or when nothing helps. The least of 10 mm, then each 1.5 times the one before and 5 mm more, at
/// last all but 10 mm of the stroke that is left.
double base_retreat(const Scene& scene, const MachineDefinition& machine, const RotaryPair& pair,
                    const std::vector<JointSample>& samples);

/// `standoff` moved away from the wrist, inside of its range less its reserve.
double retreated(const MachineDefinition& machine, double standoff, double retreat);

}  // namespace smoothpost
