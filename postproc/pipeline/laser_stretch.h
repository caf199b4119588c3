#pragma once

#include <optional>
#include <vector>

#include "kernels/optimise/rotary_jerk.h"
#include "kernels/optimise/tip_fit.h"
#include "postproc/pipeline/laser_loop.h"
#include "postproc/pipeline/laser_plan.h"
#include "postproc/pipeline/laser_samples.h"
#include "postproc/pipeline/laser_stations.h"

namespace smoothpost {

/// What one stretch of a laser's cut is planned from.
struct StretchInput {
  const LaserPlanInput& laser;
  const HeadGeometry& head;
  const CuttingFrames& frames;  ///< of its whole cut
  StretchRange range;
};

/// Joint samples of a stretch (the first is its start), and what was found.
struct PlannedLaserStretch {
  LaserJointPath path;
  std::vector<JointSample> samples;
  std::vector<double> u;  ///< of the path, one a sample
  LaserStretch report;
  std::optional<Diagnostic> not_clear;  ///< KN159
};

/// Plans one stretch: tip, rotaries, feed, standoff, clearances, samples (plan_laser).
class StretchPlanner {
 public:
  /// @param base  joint samples of the programmed path
  StretchPlanner(StretchInput input, const std::vector<JointSample>& base);

  /// Long enough for splines of its own.
  bool worth_it() const;
  /// Base samples [first_sample(), end_sample()) are the stretch, its start among them.
  std::size_t first_sample() const { return first_sample_; }
  std::size_t end_sample() const { return end_sample_; }
  Result<PlannedLaserStretch> run();

 private:
  struct Grid {
    SplineKnots knots;
    std::vector<double> s, u;  ///< length and parameter of every station
    std::vector<CutterLocation> location;
    std::vector<std::array<double, 2>> programmed;  ///< rotaries of the programmed axis, unwound
  };

  /// By how much the linear axes and the standoff need it slower than feed_, and which most.
  struct SlowJoint {
    bool found = false;
    double factor = 1.0;
    int joint = -1, derivative = 0;
    double place = 0.0;
  };

  Grid grid(double spacing, int every) const;
  bool fit_any();
  bool fit(double spacing, int every, bool explain = false);
  void seed_rotaries(Grid& grid) const;
  double normal_step(const Grid& grid, std::size_t i, const Vec3& normal) const;
  OrientationWindow window(const Grid& grid, std::size_t i) const;
  RotaryProblem rotary_problem() const;
  std::vector<RotaryVia> vias() const;
  std::vector<std::size_t> via_stations() const;
  std::vector<std::size_t> cutter_stations() const;
  void add_end_vias(std::vector<RotaryVia>& via) const;
  void add_loop_vias(std::vector<RotaryVia>& via) const;
  StandoffOptions standoff_options(double rate) const;
  bool standoff_is_held() const;
  SplineCurve held_standoff() const;
  std::optional<Diagnostic> find_feed();
  std::optional<Diagnostic> settle();
  std::optional<Diagnostic> finish(RotaryResult rotaries);
  std::optional<Diagnostic> solve_standoff(double rate);
  SlowJoint slow_joint() const;
  bool keeps_to_input(const LaserJointPath& ours, bool tip_alone = false) const;
  std::optional<Diagnostic> solve_at_best_feed();
  std::optional<Diagnostic> solve_any();
  ClearanceTask clearance_task() const;
  LoopPlanner loop_planner();
  std::optional<Diagnostic> stay_clear(PlannedLaserStretch& out);
  struct Shape;
  bool may_alternate(const PlannedLaserStretch& out) const;
  void alternate(PlannedLaserStretch& out);
  std::optional<Shape> reshaped() const;
  bool polish(Shape& shape) const;
  bool complete(Shape& shape, const StandoffOptions& options) const;
  bool schedule(Shape& shape, bool if_slowed) const;
  bool may_take(const LaserJointPath& path) const;
  Diagnostic not_smooth() const;
  Diagnostic no_orientation(const QpFeasibility& why) const;
  Diagnostic too_fast(double factor) const;
  Diagnostic broke(const char* what, const QpSolution& solution) const;
  void note_slow(const std::string& why, double u);
  LaserJointPath joint_path(SplineCurve standoff) const;
  LaserSamples sampled(const LaserJointPath& path) const;
  void sample(PlannedLaserStretch& out);
  void tell(const char* name, const QpSolution& solution);
  double tool_length() const {
    return in_.laser.reference.path().points[in_.range.first].tool_length;
  }
  double rate_of(double feed) const { return feed / path_.length() * grid_.knots.spans(); }
  double length_at(double u) const { return u / grid_.knots.spans() * path_.length(); }

  StretchInput in_;
  const MachineDefinition& machine_;
  const std::vector<JointSample>& base_;
  StretchPath path_;
  HeadGeometry head_;
  std::size_t first_sample_ = 0, end_sample_ = 0;
  RotarySettings settings_;
  Grid grid_;
  TipFit tip_;
  SplineCurve rotary_, standoff_;
  std::optional<SplineCurve> near_;   ///< rotaries that were found before, to start from
  std::optional<RotaryResult> here_;  ///< of optimise_rotaries() at feed_, where it is known
  std::optional<PathLaw> law_;        ///< of the schedule under which the shape is made anew
  double feed_ = 0.0;                 ///< mm/s
  ClearanceConditions conditions_;
  LaserStretch report_;
};

}  // namespace smoothpost
