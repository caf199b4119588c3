#pragma once

#include <array>
#include <vector>

#include "postproc/report/program_motion.h"

// What every axis does over time, as samples for plots.
namespace smoothpost {

/// Samples in time order; units of people: mm or deg, and s. A gap is one sample of NaN.
struct MotionRecord {
  /// What can be said of the axes: of a program that leaves its timing to the control only
  /// position and velocity.
  enum Order { position, velocity, acceleration, jerk };
  int orders = 0;     ///< of `axes` that are filled, from position on
  double step = 0.0;  ///< s, between samples; 0: at block ends
  std::vector<double> time;
  std::array<std::vector<std::vector<double>>, 4> axes;  ///< [Order][axis][sample]
  std::vector<double> tip_speed, programmed_speed;       ///< mm/s; programmed NaN: none
  std::vector<bool> cutting;
  bool empty() const { return time.empty(); }
};

/// The timeline at the machine's cycle time, or as many equal steps as kMostSamples.
/// Cost: some µs a sample.
MotionRecord planned_record(const PageInput& in);

/// Without a timeline: joints at block ends, and over each block the velocity that its printed time
/// gives.
MotionRecord printed_record(const PageInput& in, const ProgramMotion& motion);

/// What the axes would have to do if the output machine followed the input's own motion at its
/// programmed feed without any ramp, cut by cut, each cut beginning when the program's does. Joints
/// are the inverse kinematics nearest to the program's; redundant axes stand at home. Derivatives
/// are differences at `step` (4 ms or, for long programs, more): where the input has corners these
/// grow without bound as the step shrinks. Empty without reference, inverse or programmed feed.
MotionRecord input_record(const PageInput& in, const ReferencePath* reference,
                          const ScrewChain& chain, const ProgramMotion& motion);

}  // namespace smoothpost
