#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "postproc/pipeline/feed_schedule.h"
#include "postproc/pipeline/laser_stretch.h"

// The shape of a stretch under the law of its own schedule, and back: what is smoothest at one
// constant feed is not what a schedule under every joint's limits runs fastest.
namespace smoothpost {

namespace {

constexpr double kWorth = 1e-4;  // relative gain of time that a new shape is worth
constexpr double kFull = 0.99;   // of the programmed feed: not slowed

/// The path of a shape as the schedule takes it.
struct ScheduledPath {
  JointStretch joints;
  FeedPath path;
};

ScheduledPath scheduled_path(const LaserJointPath& shape, const StretchPath& places,
                             const ReferencePath& reference) {
  ScheduledPath out;
  out.joints.planned = planned_path(shape);
  out.path.breaks = out.joints.planned->breaks();
  for (std::size_t i = 1; i < out.path.breaks.size(); ++i) {
    const double middle = 0.5 * (out.path.breaks[i - 1] + out.path.breaks[i]);
    const std::uint32_t segment = places.place(std::min(middle, places.length())).segment;
    const double duration = reference.path().points[segment].duration;
    out.path.feed.push_back(duration > 0.0 ? reference.length(segment) / duration
                                           : std::numeric_limits<double>::infinity());
  }
  return out;
}

/// Whether the law slows down and speeds up again below the programmed feed, or never reaches it.
bool is_slowed(const FeedPath& path, const FeedProfile& profile) {
  double top = 0.0, low = 0.0;  // shares of the feed: the largest so far, the least since then
  for (std::size_t i = 0; i < path.feed.size(); ++i) {
    const double s = 0.5 * (path.breaks[i] + path.breaks[i + 1]);
    const double share = profile.at(profile.time(s)).first / path.feed[i];
    if (low < kFull && share > low + (1.0 - kFull) && low < top) return true;
    low = share > top ? share : std::min(low, share);
    top = std::max(top, share);
  }
  return top < kFull;
}

PathLaw law_of(const LaserJointPath& path, const FeedProfile& profile) {
  const double scale = (path.last() - path.first()) / path.length;
  const double first = path.first();
  return {profile.duration(), [profile, scale, first](double u) {
            const FeedState state = profile.at(profile.time((u - first) / scale));
            return PathSpeed{scale * state.first, scale * state.second, scale * state.third};
          }};
}

}  // namespace

/// Rotaries and standoff of a stretch under a law, with the schedule that they have themselves.
struct StretchPlanner::Shape {
  std::optional<PathLaw> law;  ///< nothing: of a constant feed
  RotaryResult rotaries;
  std::optional<StandoffResult> standoff;  ///< nothing: it is held
  LaserJointPath path;
  FeedProfile profile;
};

// Where the schedule goes as fast as it may, along a shape that is the programmes' own.
bool StretchPlanner::may_alternate(const PlannedLaserStretch& out) const {
  const RecipeSettings& recipe = machine_.recipe;
  return recipe.alternations > 0 && recipe.schedule == "jerk" &&
         (recipe.orientation == "programmed" || recipe.orientation == "cone") && !out.not_clear &&
         report_.clear.method != "graph";
}

void StretchPlanner::alternate(PlannedLaserStretch& out) {
  Shape best;
  best.path = out.path;
  if (!schedule(best, true)) return;
  AlternationReport& report = report_.alternation;
  report.time_before = report.time_after = best.profile.duration();
  while (report.tried < machine_.recipe.alternations) {
    ++report.tried;
    law_ = law_of(best.path, best.profile);
    near_ = best.path.rotary;
    std::optional<Shape> next = reshaped();
    const double worth = (1.0 - kWorth) * best.profile.duration();
    if (!next || !schedule(*next, false) || next->profile.duration() >= worth ||
        !may_take(next->path))
      break;
    best = std::move(*next);
    ++report.kept;
  }
  if (report.kept > 0) {
    law_ = best.law;
    if (settings_.hybrid && !polish(best)) report.kept = 0;
  }
  law_.reset();
  if (report.kept == 0) return;
  report.time_after = best.profile.duration();
  report_.passes += best.rotaries.passes;
  std::erase_if(report_.qp, [](const QpReport& qp) { return qp.name != "smooth"; });
  tell("rotary", best.rotaries.solution);
  if (best.standoff) tell("standoff", best.standoff->solution);
  out.path = std::move(best.path);
}

// By the banded solver where Ipopt is to have the last word.
std::optional<StretchPlanner::Shape> StretchPlanner::reshaped() const {
  RotarySettings settings = settings_;
  if (settings_.hybrid) settings.solver.solver = QpSolver::banded;
  settings.hybrid = false;
  Shape shape{law_, {}, {}, {}, {}};
  shape.rotaries = optimise_rotaries(rotary_problem(), settings);
  if (shape.rotaries.status != RotaryStatus::optimal) return {};
  StandoffOptions options = standoff_options(1.0);
  options.solver = settings.solver;
  options.hybrid = false;
  if (!complete(shape, options)) return {};
  return shape;
}

bool StretchPlanner::polish(Shape& shape) const {
  shape.rotaries = polish_rotaries(rotary_problem(), std::move(shape.rotaries), settings_);
  return shape.rotaries.status == RotaryStatus::optimal && complete(shape, standoff_options(1.0));
}

// The standoff and the path of a shape's rotaries.
bool StretchPlanner::complete(Shape& shape, const StandoffOptions& options) const {
  SplineCurve q6 = held_standoff();
  if (!standoff_is_held()) {
    shape.standoff = optimise_standoff(head_, tip_.curve, shape.rotaries.q, options);
    if (shape.standoff->solution.status != QpStatus::optimal) return false;
    q6 = shape.standoff->q6;
  }
  shape.path = joint_path(std::move(q6));
  shape.path.rotary = shape.rotaries.q;
  return true;
}

// False: there is no law, or (`if_slowed`) it has nothing to gain.
bool StretchPlanner::schedule(Shape& shape, bool if_slowed) const {
  ScheduledPath scheduled = scheduled_path(shape.path, path_, in_.laser.reference);
  scheduled.path.jet = [&scheduled](std::size_t piece, double s) {
    return scheduled.joints.jet(piece, s);
  };
  FeedResult result =
      schedule_feed(scheduled.path, feed_limits(machine_), {}, {}, feed_settings(machine_), {});
  if (result.status != FeedStatus::solved) return false;
  if (if_slowed && !is_slowed(scheduled.path, result.profile)) return false;
  shape.profile = std::move(result.profile);
  return true;
}

// Tolerances, blocks that are long enough for the control, and clearances.
bool StretchPlanner::may_take(const LaserJointPath& path) const {
  if (!keeps_to_input(path)) return false;
  const LaserSamples samples = sampled(path);
  if (samples.rate < rate_of(feed_)) return false;
  return in_.laser.scene == nullptr ||
         check_path(clearance_task(), samples.samples, samples.u).hits.empty();
}

}  // namespace smoothpost
