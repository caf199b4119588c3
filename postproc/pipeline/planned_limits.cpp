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

Checks planned_limit_checks(const std::vector<LaserStretch>& stretches,
                            const MachineDefinition& machine, std::vector<AxisSummary>& axes) {
  require(axes.size() == machine.axes.size(), "a summary for each axis");
  if (stretches.empty()) return {};
  double time = 0.0;
  for (const LaserStretch& stretch : stretches) {
    require(stretch.peaks.size() == machine.axes.size(), "peaks of each joint");
    if (stretch.feed > 0.0) time += stretch.length / stretch.feed;
  }
  Checks accelerations, jerks;
  for (std::size_t j = 0; j < machine.axes.size(); ++j) {
    const AxisDefinition& axis = machine.axes[j];
    const double scale = axis.joint.kind == JointKind::rotary ? kDegreesPerRadian : 1.0;
    Worst acceleration, jerk;
    double square = 0.0;
    for (const LaserStretch& stretch : stretches) {
      const JointPeaks& p = stretch.peaks[j];
      acceleration.see(p.acceleration * scale, 0, 0.0, p.acceleration_line);
      jerk.see(p.jerk * scale, 0, 0.0, p.jerk_line);
      square += p.jerk_square_integral * scale * scale;
    }
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
  return "acceleration and jerk are those of the plan inside the optimised stretches of the cuts, "
         "at their constant feed: at their ends the control comes to rest as it likes, and at "
         "level "
         "geometry it may move otherwise in time";
}

}  // namespace smoothpost
