#include "postproc/pipeline/timeline.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "postproc/pipeline/convert.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

Conversion timed(const char* machine) {
  InputSettings settings;
  settings.file_name = "part.ngc";
  settings.machine = shipped_machine("table_table_ac");
  settings.tool_lengths = {{1, 60.0}};
  auto read = interpret_nc(
      "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-20 Y-10 A0 C0\nG43 H1 Z30\n"
      "G0 Z2\nG1 Z0 F300\nG1 X20 F600\nG4 P0.25\nG2 X20 Y10 I0 J10\nG0 Z30\nG0 X0 Y0 A-20 C30\n"
      "G0 Z10\nG1 Z5 F300\nG1 X10 Y5 A-30 C40\nG0 Z40\nM5\nM429\nM30\n%\n",
      settings);
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine(machine);
  in.input_name = "part.ngc";
  in.timed = true;
  Conversion c = convert(in, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(c.verdict == Verdict::certified);
  return c;
}

/// The item that a time is in.
const TimelineItem& item_at(const Timeline& timeline, double t) {
  std::size_t i = 0;
  while (i + 1 < timeline.items.size() && timeline.items[i + 1].start <= t) ++i;
  return timeline.items[i];
}

}  // namespace

TEST_CASE("timeline: one item ends where and as the next begins",
          "[postproc][pipeline][schedule]") {
  for (const char* machine : {"table_table_bc", "robot_6r"}) {
    const Conversion c = timed(machine);
    const Timeline& timeline = c.timeline;
    INFO(machine);
    REQUIRE(timeline.items.size() > 10);
    double dwells = 0.0;
    for (std::size_t i = 1; i < timeline.items.size(); ++i) {
      const TimelineItem& before = timeline.items[i - 1];
      const TimelineItem& item = timeline.items[i];
      CHECK(item.start == Approx(before.start + before.duration));
      const auto end = timeline.at(before, item.start);
      const auto begin = timeline.at(item, item.start);
      CHECK((end.position - begin.position).cwiseAbs().maxCoeff() < 1e-6);
      CHECK((end.velocity - begin.velocity).cwiseAbs().maxCoeff() < 1e-4);
      CHECK((end.acceleration - begin.acceleration).cwiseAbs().maxCoeff() < 1e-2);
      if (item.law < 0) dwells += item.duration;
    }
    CHECK(dwells >= 0.25);
  }
}

TEST_CASE("timeline: differences keep every limit from the first move to the last",
          "[postproc][pipeline][schedule]") {
  const Conversion c = timed("table_table_bc");
  const MachineDefinition machine = shipped_machine("table_table_bc");
  const double h = 1e-3, end = c.timeline.duration();
  std::vector<JointVector> q;
  for (double t = 0.0; t < end; t += h)
    q.push_back(c.timeline.at(item_at(c.timeline, t), t).position);
  for (std::size_t i = 3; i < q.size(); ++i)
    for (int j = 0; j < machine.size(); ++j) {
      const auto& axis = machine.axes[static_cast<std::size_t>(j)];
      const double v = (q[i][j] - q[i - 1][j]) / h;
      const double a = (q[i][j] - 2.0 * q[i - 1][j] + q[i - 2][j]) / (h * h);
      const double jerk =
          (q[i][j] - 3.0 * q[i - 1][j] + 3.0 * q[i - 2][j] - q[i - 3][j]) / (h * h * h);
      if (std::abs(v) > axis.velocity || std::abs(a) > axis.acceleration ||
          std::abs(jerk) > axis.jerk * 1.001 + 1e-3)
        FAIL("axis " << axis.name << " at " << h * static_cast<double>(i) << " s: " << v << ", "
                     << a << ", " << jerk);
    }
}

TEST_CASE("timeline: its file has a row a cycle and ends at rest at the last position",
          "[postproc][pipeline][schedule]") {
  const Conversion c = timed("table_table_bc");
  const MachineDefinition machine = shipped_machine("table_table_bc");
  ScrewChain chain = chain_of(machine);
  const std::string csv = trajectory_csv(c.timeline, machine, chain, 60.0);
  const auto rows = std::count(csv.begin(), csv.end(), '\n') - 1;
  CHECK(rows == static_cast<long>(std::ceil(c.timeline.duration() / machine.cycle.time - 1e-6)) + 1);
  CHECK(csv.rfind("t_s,X_mm,Y_mm,Z_mm,B_deg,C_deg,x_mm,y_mm,z_mm,i,j,k,beam\n", 0) == 0);
  CHECK(trajectory_csv({}, machine, chain, 60.0).find('\n') + 1 ==
        trajectory_csv({}, machine, chain, 60.0).size());
}
