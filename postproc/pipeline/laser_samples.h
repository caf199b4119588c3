#pragma once

#include <vector>

#include "kernels/kinematics/rotary_pair.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/joint_plan.h"
#include "postproc/pipeline/laser_joint_path.h"
#include "postproc/pipeline/laser_plan.h"
#include "postproc/pipeline/laser_stations.h"

namespace smoothpost {

/// What the blocks of a stretch are made from.
struct LaserSampling {
  const LaserJointPath& path;
  const StretchPath& places;
  const RotaryPair& pair;  ///< of the output chain
  const MachineDefinition& machine;
  double tool_length = 0.0;   ///< mm, that the output chain does not have
  JointSample start;          ///< place and branch of the start
  std::vector<double> stops;  ///< u where a block has to end, ascending; the last one: path.last()
};

/// Blocks along a stretch, the first sample being its start.
struct LaserSamples {
  std::vector<JointSample> samples;
  std::vector<double> u;  ///< one a sample, ascending
  double rate = 0.0;      ///< of u by time, 1/s; below the one asked for when blocks are too short
};

/// Blocks of usual_block_time() at du/dt = rate, shorter where straight motion of the joints leaves
/// the path by more than the chord share of the tolerances at a quarter of its way; all of them
/// slower when one would be shorter than cycle.min_block.   Cost: about 10 µs a block.
LaserSamples sample_path(const LaserSampling& input, double rate);

}  // namespace smoothpost
