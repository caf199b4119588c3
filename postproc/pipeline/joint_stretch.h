#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/schedule/feed_path.h"
#include "kernels/spline/chebyshev_path.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/joint_plan.h"
#include "postproc/pipeline/laser_plan.h"
#include "postproc/pipeline/planned_path.h"

// The machine's path between two stops as functions of one parameter, for the feed schedule.
namespace smoothpost {

/// Why a stretch ends.
enum class StopCause : std::uint8_t {
  path_end,   ///< of a run: a link follows
  corner,     ///< the direction or the curvature of the joints' path jumps
  event,      ///< a dwell, or an event that is not on the fly
  no_formula  ///< the joints go straight because the tool's own way has no smooth joints (a pole)
};

/// Joints and tip over a parameter s, C³ inside pieces, without a stop from its first sample to its
/// last. s is mm of the path before smoothing (SmoothedPath::length); on a leg without way of the
/// tip 50 mm a radian of the joint that turns most.
struct JointStretch {
  std::size_t first_sample = 0, last_sample = 0;  ///< of JointPlan::samples
  std::vector<double> sample_s;                   ///< of those, ascending, the first is 0
  StopCause end = StopCause::path_end;            ///< why it stops behind its last sample

  /// Pieces: breaks[i] to breaks[i + 1].
  std::vector<double> breaks;
  std::vector<double> feed;         ///< mm/s, programmed, of each piece; infinity: none
  std::vector<double> rate;         ///< of ds/dt, likewise
  std::vector<std::uint32_t> line;  ///< of the input, likewise
  std::vector<bool> beam;           ///< on, likewise

  ChebyshevPath path;                  ///< joints, then the tip (3), where nothing is `planned`
  std::vector<std::uint32_t> sub_end;  ///< of each piece: end of its pieces of `path`
  std::shared_ptr<const PlannedPath> planned;  ///< null: `path` counts

  int joints = 0;
  double length() const { return breaks.empty() ? 0.0 : breaks.back(); }
  std::size_t pieces() const { return feed.size(); }
  std::size_t piece_at(double s) const;
  JointVector joints_at(double s) const;
  PathJet jet(std::size_t piece, double s) const;

  /// Ends the stretch at its piece `piece`, where sample `sample` of the plan stands; what is
  /// behind is a stretch of its own with s from 0.   @pre nothing is planned, 0 < piece < pieces()
  JointStretch cut_off(std::size_t piece, std::size_t sample);
};

struct StretchesInput {
  const SmoothedPath& path;
  const JointPlan& plan;
  const std::vector<LaserPlanPath>& laser;
  const MachineDefinition& machine;
  const std::vector<PlannedStretch>* planned = nullptr;  ///< of other planners, ascending
};

/// All stretches of a plan, in path order; links have none. A stretch ends where a run ends, at
/// dwells and events that are not on the fly, and where q' or q'' jump at the programmed feed by
/// more than 1e-6 of the velocity or 1e-3 of the acceleration that a joint may have.
///
/// Between stops the joints are the planner's own function of the smoothed path, not a curve
/// through its samples: exact corners, blends and arcs have the derivatives that they have. Where
/// that function has no smooth joints from one sample to the next, the joints go straight from stop
/// to stop.
/// Cost: about ten solutions of the inverse a piece, linear in the legs.
std::vector<JointStretch> joint_stretches(const StretchesInput& input);

/// A laser's path over s.
std::shared_ptr<const PlannedPath> planned_path(LaserJointPath path);

}  // namespace smoothpost
