#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/progress.h"
#include "kernels/core/result.h"
#include "kernels/kinematics/joint_jet.h"
#include "kernels/kinematics/rotary_pair.h"
#include "postproc/pipeline/smoothed_path.h"

namespace smoothpost {

struct JointPlanSettings {
  double tip_tolerance =
      0.0;  ///< mm, for the difference between joint-linear motion and the reference
  double axis_tolerance = 0.0;  ///< rad, likewise
  JointVector held;             ///< redundant joints' values; also where the joints start from
  std::string file_name;        ///< for messages
  std::vector<std::string> axis_names;  ///< for messages, in joint order
  bool tool_moves = false;              ///< the controller interpolates tip and axis, not joints
  bool whole_rotation = false;          ///< arms: the input's rotation about the tool counts too
  std::string spin_policy = "fixed";  ///< arms, unless whole_rotation: fixed | tangent | optimised
  std::optional<double> spin;         ///< rad, arms: the rotation about the tool axis (plan_arm)
  bool may_split = false;             ///< a cut may be split where a rotary has to be unwound
};

/// Joint values on the way: at share `s` of `segment` (segment 0: the first path point).
struct JointSample {
  std::uint32_t segment = 0;
  double s = 1.0;
  int branch = 0;
  JointVector q;
  bool guide = false;      ///< there for the choice of the joints, or at a break inside a leg
  bool by_joints = false;  ///< with tool moves: the way here is straight in the joints all the same
  double time = 0.0;       ///< s, of the way here where it was planned (feed_schedule); else 0
  std::int32_t stretch = -1;  ///< of the schedule, that the way here is on; −1: none
  double stretch_time = 0.0;  ///< s, of that stretch, here
  std::uint32_t leg = 0;   ///< of the SmoothedPath that the joints were planned on, and the share
  double leg_share = 1.0;  ///< of it, where (segment, s) is the place of the input
};

/// The joints at a share of a leg of the SmoothedPath that the samples were planned on: of all
/// solutions the one nearest to `near`; nothing where the pose cannot be reached.
using JointsOnLeg = std::function<std::optional<JointVector>(std::size_t leg, double share,
                                                             const JointVector& near)>;

/// The same with the derivatives by the share, where the leg has them and the joints follow from
/// the tool alone. `tool`: SmoothedPath::jet() there. `near`: column 0 as above, column 1 the rate
/// of joints that do not follow from the tool (the first rotary while the tool axis stands on its
/// pole).
using JointJetOnLeg = std::function<std::optional<JointJet>(
    std::size_t leg, double share, const PoseJet& tool, const JointJet& near)>;

/// A place inside a cut that has no continuous way on: the cut has to be split there.
using SplitPlace = PathPlace;

/// Drops guides that a move from the sample before to the one behind does without:
/// `follows(before, behind)`, with `before` at share 0 of the leg of `behind` if it ends another.
template <class Follows>
void drop_guides(std::vector<JointSample>& samples, const Follows& follows) {
  std::size_t kept = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    bool needed = !samples[i].guide || i + 1 == samples.size() || samples[i + 1].by_joints ||
                  samples[i].by_joints;
    if (!needed) {
      JointSample before = samples[kept];
      if (before.segment != samples[i + 1].segment) {
        before.segment = samples[i + 1].segment;
        before.s = 0.0;
      }
      needed = !follows(before, samples[i + 1]);
    }
    if (needed) samples[++kept] = samples[i];
  }
  if (!samples.empty()) samples.resize(kept + 1);
}

/// What a rotation about the tool that was optimised has gained (kernels/optimise/spin.h).
struct SpinGain {
  double margin_before = 0.0, margin_after = 0.0;
  double jerk_before = 0.0, jerk_after = 0.0;  ///< rad/mm³
};

/// A place where an arm passes near a singular posture.
struct SingularPlace {
  std::uint32_t line = 0;  ///< of the input
  std::string_view kind;   ///< wrist | elbow | shoulder
  double measure = 0.0;    ///< 0: singular (ArmReach::posture)
};

struct JointPlan {
  std::vector<JointSample> samples;
  JointsOnLeg
      joints_on_leg;         ///< the path, SmoothedPath and chain of the planner have to outlive it
  JointJetOnLeg jet_on_leg;  ///< likewise
  std::optional<SpinGain> spin_gain;
  std::vector<SingularPlace> singular;  ///< arms: the nearest of each stretch of one kind
  std::vector<SplitPlace> splits;       ///< not empty: no samples; split there and plan again
};

/// Joint values along the whole path, close enough that straight joint motion from each
/// sample to the next stays inside the tolerances (checked at quarter points; the certificate
/// bounds it). One global choice of branch and winding; every leg ends with a
/// sample, and samples are places of the input. With settings.tool_moves a step whose joints would
/// jump on the tool's own way (over the pole, where the first rotary has to turn while the tool
/// axis stands) goes straight in the joints. Of a run of replanned segments only its end has a
/// sample: where the next run starts. `pair` is the output machine's chain with tool length 0 and
/// the part placed in it. Failures: KN101 unreachable, KN102 limits, KN103 rewind needed (input
/// lines named; with settings.may_split the places are in JointPlan::splits instead), KN104 a
/// motion that cannot be followed inside the tolerances. Cost: linear in the samples.
Result<JointPlan> plan_joints(const SmoothedPath& path, const RotaryPair& pair,
                              const JointPlanSettings& settings, const Progress& progress);

/// The holder's reference point for a tool of `tool_length`: what a chain of tool length 0 is asked
/// for.
CutterLocation holder_location(const CutterLocation& tip, double tool_length);

}  // namespace smoothpost
