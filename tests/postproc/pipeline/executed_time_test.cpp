#include "postproc/pipeline/executed_time.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

struct Step {
  std::vector<double> by;  ///< of the joints, from the first
  double seconds = 0.0;    ///< 0: a rapid
};

ReadBack program(const MachineDefinition& machine, const std::vector<Step>& steps) {
  ReadBack read;
  ReadBackMove move;
  move.to = JointVector::Zero(machine.size());
  move.known = (1U << machine.size()) - 1U;
  move.rapid = true;
  read.moves.push_back(move);
  for (const Step& step : steps) {
    for (std::size_t j = 0; j < step.by.size(); ++j)
      move.to[static_cast<Eigen::Index>(j)] += step.by[j];
    move.rapid = !(step.seconds > 0.0);
    move.duration = step.seconds;
    read.moves.push_back(move);
  }
  return read;
}

double time_of(const MachineDefinition& machine, const std::vector<Step>& steps) {
  const ExecutedTime t = executed_time(program(machine, steps), machine);
  REQUIRE(t.seconds.has_value());
  return *t.seconds;
}

}  // namespace

TEST_CASE("executed_time: one block is a trapezoid and rotary blocks stop between",
          "[postproc][pipeline][schedule]") {
  MachineDefinition machine = shipped_machine("table_table_bc");
  const double cycle = machine.cycle.time;
  REQUIRE(machine.axes[0].joint.kind == JointKind::linear);
  REQUIRE(machine.axes[3].joint.kind == JointKind::rotary);
  const double a = machine.axes[0].acceleration, v = machine.axes[0].velocity;
  // 10 mm in 1 s: t + v/a.
  CHECK(time_of(machine, {{{10}, 1.0}}) == Approx(1.0 + 10.0 / a).margin(cycle));
  // Too short for its speed: 2 sqrt(way/a).
  const double speed = std::min(1e3, v);
  CHECK(time_of(machine, {{{1.0}, 1e-3}}) ==
        Approx(speed * speed > a ? 2.0 / std::sqrt(a) : 1.0 / speed + speed / a).margin(cycle));
  // A rapid at the velocity limit.
  CHECK(time_of(machine, {{{100.0}, 0.0}}) == Approx(100.0 / v + v / a).margin(cycle));
  // Ten blocks in line: as one. With a rotary, each by itself.
  std::vector<Step> line(10, {{1.0}, 0.1});
  CHECK(time_of(machine, line) == Approx(1.0 + 10.0 / a).margin(cycle));
  std::vector<Step> turning(10, {{1.0, 0, 0, 0.01}, 0.1});
  const double slowest = std::max(1.0 / a, 0.01 / machine.axes[3].acceleration);
  CHECK(time_of(machine, turning) == Approx(10.0 * (0.1 + slowest / 0.1)).margin(10.0 * cycle));
  // A right angle stops nearly; a hair of a turn does not.
  CHECK(time_of(machine, {{{10}, 1.0}, {{0, 10}, 1.0}}) > 2.0 + 1.5 * 10.0 / a);
  CHECK(time_of(machine, {{{10}, 1.0}, {{10, 1e-4}, 1.0}}) ==
        Approx(2.0 + 10.0 / a).margin(2.0 * cycle));
}

TEST_CASE("executed_time: waits count and other controls have no estimate",
          "[postproc][pipeline][schedule]") {
  MachineDefinition machine = shipped_machine("table_table_bc");
  ReadBack read = program(machine, {{{10}, 1.0}, {{10}, 1.0}});
  const double without = *executed_time(read, machine).seconds;
  read.events.push_back({2, "dwell", 0.5, false, 3});
  const double ramp = 10.0 / machine.axes[0].acceleration;
  CHECK(*executed_time(read, machine).seconds ==
        Approx(without + 0.5 + ramp).margin(3.0 * machine.cycle.time));
  machine.dialect.path_mode = "blend";
  CHECK_FALSE(executed_time(read, machine).seconds.has_value());
  machine.dialect.path_mode = "exact";
  machine.dialect.name = "siemens_840d";
  const ExecutedTime none = executed_time(read, machine);
  CHECK_FALSE(none.seconds.has_value());
  CHECK(none.model.find("not measured") != std::string::npos);
}
