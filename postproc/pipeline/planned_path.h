#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "kernels/core/joints.h"
#include "kernels/kinematics/joint_jet.h"

namespace smoothpost {

/// Joints along a stretch of the path that a planner of its own has made, as functions of s: mm of
/// the programmed tip's way, 0 … length(). C³ inside, smooth between breaks(). Every function takes
/// any s and clamps it. Immutable; several threads may read it.
class PlannedPath {
 public:
  virtual ~PlannedPath() = default;
  virtual double length() const = 0;
  /// Ascending, 0 and length() among them.
  virtual std::vector<double> breaks() const = 0;
  virtual JointVector joints(double s) const = 0;
  /// With derivatives by s; mm or rad.
  virtual JointJet jet(double s) const = 0;
  /// The tip, mm, W, with derivatives by s.
  virtual VectorJet tip_jet(double s) const = 0;
};

/// Such a path between the samples that stand for it in a JointPlan.
struct PlannedStretch {
  std::shared_ptr<const PlannedPath> path;
  /// Sample first_sample + i of the plan is path->joints(s[i]); the first one is the stretch's
  /// start, which is the end of a stretch that went right before.
  std::size_t first_sample = 0;
  std::vector<double> s;  ///< ascending, from 0 to path->length()

  std::size_t last_sample() const { return first_sample + s.size() - 1; }
};

}  // namespace smoothpost
