#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"

// G38.2 to G38.5: straight motions that a probe may stop.
namespace smoothpost::nc {

/// Why there is no probing here; empty: there is.
std::string Executor::why_not_probing(const BlockPlan& plan, const AxisWords& end) const {
  if (plan.axes == 0) return "the axis words are missing";
  if (modal_.inverse_time) return "no probing in inverse time mode (G93); write G94";
  if (modal_.per_turn) return "no probing while F counts by the turn (G95); write G94";
  if (radius_.is_on()) return "no probing under cutter radius compensation; write G40";
  // The other two are content with no contact.
  const bool must_touch = plan.motion == 382 || plan.motion == 384;
  if (must_touch && (coordinates_.unknown() & plan.axes) == 0 && end == coordinates_.world())
    return "its end is where the machine stands; write a way to probe";
  return {};
}

/// The motion as it is when the probe says nothing.
void Executor::probe(const BlockWords& block, const BlockPlan& plan) {
  const AxisWords end = target(block, plan.axes);
  const AxisMask unknown = unknown_at_target(block, plan.axes);
  const std::string why = why_not_probing(plan, end);
  if (!why.empty()) {
    log_.error("NC267", g_code_text(plan.motion) + ": " + why, at(block, GGroup::motion));
    modal_.motion = kRefusedMotion;
  }
  if (!why.empty() || !feed_given(block, plan)) return coordinates_.move_to(end, unknown);
  begin_motion(block, plan);
  motion_.kind = MotionKind::feed;
  motion_.probe = true;
  motion_.end = end;
  motion_.unknown_end = unknown;
  const Vec3 way(end[0] - motion_.start[0], end[1] - motion_.start[1], end[2] - motion_.start[2]);
  motion_.duration = duration_of(motion_, way.norm(), block);
  finish_motion();
  values_->store()->set_probed();
}

}  // namespace smoothpost::nc
