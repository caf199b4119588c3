#include "postproc/pipeline/planned_limits.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "postproc/pipeline/worst.h"

namespace smoothpost {

namespace {

constexpr double kRounding = 1e-9;  // relative, of a peak that lies at its limit

Check as_planned(Check c) {
  c.ok = std::isfinite(c.value) && c.value <= c.limit * (1.0 + kRounding);
  c.planned = true;
  return c;
}

}  // namespace

Checks planned_limit_checks(const std::vector<JointPeaks>& peaks, double time,
                            const MachineDefinition& machine, std::vector<AxisSummary>& axes) {
  require(axes.size() == machine.axes.size(), "a summary for each axis");
  if (peaks.empty()) return {};
  require(peaks.size() == machine.axes.size(), "peaks of each joint");
  Checks accelerations, jerks;
  for (std::size_t j = 0; j < machine.axes.size(); ++j) {
    const AxisDefinition& axis = machine.axes[j];
    const double scale = axis.joint.kind == JointKind::rotary ? kDegreesPerRadian : 1.0;
    Worst acceleration, jerk;
    const JointPeaks& p = peaks[j];
    acceleration.see(p.acceleration * scale, 0, 0.0, p.acceleration_line);
    jerk.see(p.jerk * scale, 0, 0.0, p.jerk_line);
    const double square = p.jerk_square_integral * scale * scale;
    AxisSummary& summary = axes[j];
    summary.peak_acceleration = acceleration.value();
    summary.peak_jerk = jerk.value();
    if (time > 0.0) summary.rms_jerk = std::sqrt(square / time);
    accelerations.push_back(as_planned(acceleration.check(
        "acceleration_limit." + axis.name, axis.acceleration * scale, summary.unit + "/s2")));
    jerks.push_back(
        as_planned(jerk.check("jerk_limit." + axis.name, axis.jerk * scale, summary.unit + "/s3")));
  }
  accelerations.insert(accelerations.end(), jerks.begin(), jerks.end());
  return accelerations;
}

std::string planned_limits_assumption() {
  return "acceleration and jerk are those of the feed schedule, on the way between two stops of "
         "the path: at level geometry the control may move otherwise in time, and links are its "
         "own";
}

}  // namespace smoothpost
