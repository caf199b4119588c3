#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "postproc/pipeline/finish_joints.h"
#include "postproc/pipeline/finish_plan.h"

// How the redundant joint of one finishing cut is chosen.
namespace smoothpost {

/// What the grid says of a cut.
struct ChosenCut {
  std::size_t cut = 0;  ///< index in FinishPath::cuts
  GlobalResolution found;
  bool turned = false;    ///< the link before has to turn the free joint
  bool collides = false;  ///< there is no way that the scene leaves free
  bool cramped = false;   ///< the links at its ends have no room for their clearance
};

/// For every cut of one path on one machine. Immutable but for choose(), which is for one thread.
class CutResolver {
 public:
  /// @pre `input` outlives it
  explicit CutResolver(const FinishPlanInput& input);
  /// Exactly one joint is redundant; else nothing else may be asked for.
  bool possible() const { return free_joint_ >= 0; }
  int free_joint() const { return free_joint_; }
  /// mm/s, of the path
  double feed() const { return feed_; }
  double tool_length(const FinishCut& cut) const {
    return in_.path.path.points[cut.first_point].tool_length;
  }

  /// Chooses from the end of the cut before (`end`), else from anywhere; closed, else free. On a
  /// grid that turns with the contour, so that one turn of it is enough however often the contour
  /// goes round.
  ChosenCut choose(std::size_t cut, std::optional<double> end) const;

  struct Made {
    std::shared_ptr<const FinishJoints> joints;  ///< nullptr: no smooth function was found
    FinishResolution told;
  };
  /// Minimum norm smoothed, else the grid smoothed, else the grid's own spline: the first that is
  /// clear. May run on several threads.   @pre chosen.found.status is ok
  Made make(const ChosenCut& chosen) const;

 private:
  static std::vector<double> stations_of(const FinishCut& cut);
  bool rotary() const;
  std::pair<double, double> free_range() const;
  void draw_in(JointVector& lower, JointVector& upper, double share) const;
  GlobalSettings global_settings() const;
  std::optional<double> change_of(const FinishCut& cut) const;
  double turn_of(const FinishCut& cut) const;
  double sign() const;
  std::vector<double> expected_at(const FinishCut& cut, const std::vector<double>& stations,
                                  std::optional<double> change) const;
  bool has_room(const JointVector& q) const;
  std::optional<double> roomiest_start(const RedundantPath& path, const FinishCut& cut,
                                       const GlobalResolution& found) const;
  MinimumNormSettings local_settings(const FinishCut& cut, const GlobalResolution& found) const;
  static FreeProfile profile_of(const GlobalResolution& found, const std::vector<double>& stations);
  bool keeps_limits(const RedundantPath& path, const FreeProfile& free) const;
  SmoothFreeSettings smooth_settings(const FinishCut& cut) const;
  RedundantPath path_of(const FinishCut& cut) const;
  bool is_clear(const RedundantPath& path, const SmoothFree& smooth, const FinishCut& cut,
                SceneCache& cache) const;

  const FinishPlanInput& in_;
  JointLimits limits_;
  JointVector near_;
  int free_joint_;
  double feed_ = 1.0;
  JointVector weight_, jerk_weight_;
  JointVector third_;                ///< that a joint's third derivative by s may be off
  std::pair<double, double> range_;  ///< of the free joint
  mutable SceneCache cache_;
};

}  // namespace smoothpost
