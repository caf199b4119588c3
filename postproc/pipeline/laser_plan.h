#pragma once

#include <string>
#include <vector>

#include "kernels/optimise/standoff.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/cutting_frame.h"
#include "postproc/pipeline/joint_plan.h"
#include "postproc/pipeline/laser_joint_path.h"
#include "postproc/pipeline/laser_loop.h"

namespace smoothpost {

/// One quadratic programme that was solved for a cut, for the report.
struct QpReport {
  std::string name;    ///< smooth | rotary | standoff
  std::string solver;  ///< ipopt | banded
  std::string status;
  double objective = 0.0;
  int iterations = 0;
  int windows = 1;  ///< that it was solved in, one after the other
  double kkt = 0.0;
  double violation = 0.0;
};

/// Peaks of one joint over what is scheduled; mm or rad and s.
struct JointPeaks {
  double velocity = 0.0, acceleration = 0.0, jerk = 0.0;
  double jerk_square_integral = 0.0;                                      ///< ∫ jerk² dt
  std::uint32_t velocity_line = 0, acceleration_line = 0, jerk_line = 0;  ///< of the input
};

/// What its own schedule made of a stretch's shape (reshape()).
struct AlternationReport {
  int tried = 0, kept = 0;                     ///< passes
  double time_before = 0.0, time_after = 0.0;  ///< s, rest to rest by the schedule; 0: not tried
};

/// A stretch of a cut at constant feed that was optimised as one.
struct LaserStretch {
  std::uint32_t first = 0, last = 0;  ///< segments of the input
  double length = 0.0;                ///< mm, of the tip
  double feed = 0.0;                  ///< mm/s, constant, of the shape before any alternation
  double programmed_feed = 0.0;       ///< mm/s, the least on the stretch
  std::string slowed_by;              ///< what keeps the feed below the programmed one; empty
  std::vector<std::uint32_t> slowed_lines;
  int control_points = 0;  ///< of the rotaries
  int via_points = 0;
  int passes = 0;  ///< convex passes of the rotaries
  std::vector<QpReport> qp;
  bool normal_from_part = false;
  ClearanceLoopReport clear;
  AlternationReport alternation;
};

/// The joints of a planned stretch between the samples that stand for it in a LaserPlan.
struct LaserPlanPath {
  LaserJointPath path;
  /// joints.samples[first_sample + i] is path.joints(u[i]); the first one is the stretch's start,
  /// which is the end of a stretch that went right before.
  std::size_t first_sample = 0;
  std::vector<double> u;  ///< ascending, from path.first() to path.last()

  std::size_t last_sample() const { return first_sample + u.size() - 1; }
};

struct LaserPlan {
  JointPlan joints;
  std::vector<LaserStretch> stretches;
  std::vector<LaserPlanPath> paths;  ///< one a stretch
  Diagnostics not_clear;             ///< KN159: stretches that are not free of collisions, and why
  bool keeps_programmed = false;     ///< a stretch has the joints of the programmed path
};

struct LaserPlanInput {
  const ReferencePath& reference;
  const std::vector<Cut>& cuts;
  const MachineDefinition& machine;
  const RotaryPair& pair;              ///< of the output chain: tool length 0, part placed
  const TriangleTree* part = nullptr;  ///< in W; nullptr: none
  std::string file_name;               ///< for messages
  const Scene* scene =
      nullptr;  ///< of `pair`'s chain: what must not meet; nullptr: nothing is known
};

/// The joints of a laser's cuts, stretch by stretch (stretches_of): the tip smoothed inside the
/// merge and smoothing shares of its tolerance (fit_tip), the rotaries by minimum jerk inside the
/// orientation windows (optimise_rotaries) at the largest constant feed that every joint's limits
/// allow, the standoff by minimum jerk of the linear axes (optimise_standoff), then joint samples
/// whose straight connection stays inside the chord share. With a scene each stretch is then kept
/// clear (keep_clear); recipe.orientation "graph" takes the way of plan_by_graph() at once. With
/// recipe.schedule = "jerk" it is then shaped anew under the law of its own schedule, up to
/// recipe.alternations times (StretchPlanner::alternate).
///
/// `base` are the joints of the programmed path: branches, turns and everything outside of the
/// stretches are theirs. Where a stretch does not start or end its cut its joints are those of
/// `base`. Limits are the machine's times tolerance.limit_share.
/// Failures, each with input lines: KN150 a machine that is no such head; KN151 no orientation
/// keeps the windows; KN152 the programmed feed is too fast (schedule = "programmed"); KN153 the
/// tip cannot be smoothed inside its tolerance; KN154 a solver broke down; KN159 (graph) no way.
/// The tip's programmes and all passes are the banded solver's; with recipe.solver = "hybrid" Ipopt
/// solves the last programmes of rotaries and standoff once more.
/// Cost: about 0.7 s for 160 control points, 0.1 s of it Ipopt's.
Result<LaserPlan> plan_laser(const LaserPlanInput& input, const JointPlan& base,
                             const Progress& progress);

/// The base's samples whose joints a plan keeps: where stretches of a cut join, and segments of
/// cuts that belong to no stretch.
std::vector<JointSample> joined_samples(const ReferencePath& reference,
                                        const std::vector<Cut>& cuts, const ProcessTable& process,
                                        const std::vector<JointSample>& base);
/// The base's samples of all cuts.
std::vector<JointSample> samples_of_cuts(const std::vector<Cut>& cuts,
                                         const std::vector<JointSample>& base);

}  // namespace smoothpost
