#include "postproc/pipeline/planned_limits.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

std::vector<AxisSummary> summaries(const MachineDefinition& machine) {
  std::vector<AxisSummary> axes;
  for (const auto& axis : machine.axes) {
    AxisSummary summary;
    summary.name = axis.name;
    summary.unit = axis.joint.kind == JointKind::rotary ? "deg" : "mm";
    axes.push_back(summary);
  }
  return axes;
}

Check get(const Checks& checks, const std::string& name) {
  for (const auto& c : checks)
    if (c.name == name) return c;
  FAIL("no check " << name);
  return {};
}

}  // namespace

TEST_CASE("planned_limits: the largest of a schedule against the machine's own limit",
          "[postproc][pipeline]") {
  const MachineDefinition machine = shipped_machine("laser_5p1");
  const auto b = static_cast<std::size_t>(machine.axis_by_name("B"));
  std::vector<JointPeaks> peaks(machine.axes.size());
  peaks[0] = {100.0, 3000.0, 30000.0, 32.0, 1, 17, 8};
  peaks[b].jerk = 0.5 * machine.axes[b].jerk;
  peaks[b].jerk_line = 21;
  peaks[b].jerk_square_integral = 9.0;
  auto axes = summaries(machine);
  const Checks checks = planned_limit_checks(peaks, 4.0, machine, axes);
  CHECK(checks.size() == 2 * machine.axes.size());
  const Check acceleration = get(checks, "acceleration_limit.X");
  CHECK(acceleration.value == 3000.0);
  CHECK(acceleration.limit == machine.axes[0].acceleration);
  CHECK(acceleration.unit == "mm/s2");
  CHECK(acceleration.input_line == 17);
  CHECK(acceleration.planned);
  CHECK(acceleration.ok);
  const Check jerk = get(checks, "jerk_limit.X");
  CHECK(jerk.value == 30000.0);
  CHECK(jerk.input_line == 8);
  CHECK(jerk.unit == "mm/s3");
  const Check rotary = get(checks, "jerk_limit.B");
  CHECK(rotary.value == Approx(0.5 * degrees_from_radians(machine.axes[b].jerk)));
  CHECK(rotary.limit == Approx(degrees_from_radians(machine.axes[b].jerk)));
  CHECK(rotary.unit == "deg/s3");
  CHECK(rotary.input_line == 21);
  // sqrt(32 mm²/s⁵ / 4 s), sqrt(9 rad²/s⁵ / 4 s).
  CHECK(axes[0].rms_jerk == Approx(std::sqrt(8.0)));
  CHECK(axes[0].peak_acceleration == 3000.0);
  CHECK(axes[0].peak_jerk == 30000.0);
  CHECK(axes[b].rms_jerk == Approx(degrees_from_radians(1.5)));
}

TEST_CASE("planned_limits: beyond a limit the check fails with its line", "[postproc][pipeline]") {
  const MachineDefinition machine = shipped_machine("laser_5p1");
  std::vector<JointPeaks> peaks(machine.axes.size());
  peaks[1].acceleration = machine.axes[1].acceleration;
  peaks[1].jerk = 1.001 * machine.axes[1].jerk;
  peaks[1].jerk_line = 33;
  peaks[2].jerk = std::nan("");
  auto axes = summaries(machine);
  const Checks checks = planned_limit_checks(peaks, 1.0, machine, axes);
  CHECK(get(checks, "acceleration_limit.Y").ok);
  CHECK_FALSE(get(checks, "jerk_limit.Y").ok);
  CHECK(get(checks, "jerk_limit.Y").input_line == 33);
  CHECK_FALSE(get(checks, "jerk_limit.Z").ok);
}

TEST_CASE("planned_limits: without a plan nothing is said", "[postproc][pipeline]") {
  const MachineDefinition machine = shipped_machine("laser_5p1");
  auto axes = summaries(machine);
  CHECK(planned_limit_checks({}, 0.0, machine, axes).empty());
  CHECK_FALSE(axes[0].peak_jerk.has_value());
  std::vector<JointPeaks> peaks(machine.axes.size() - 1);
  CHECK_THROWS_AS(planned_limit_checks(peaks, 1.0, machine, axes), ContractViolation);
  peaks.emplace_back();
  axes.pop_back();
  CHECK_THROWS_AS(planned_limit_checks(peaks, 1.0, machine, axes), ContractViolation);
}
