#include "postproc/pipeline/event_latency.h"

#include <catch2/catch.hpp>
#include <random>

#include "postproc/pipeline/tool_motion.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition machine_with(double latency) {
  MachineDefinition machine = shipped_machine("laser_5p1");
  for (auto& row : machine.process.events) row.latency = row.on_the_fly ? latency : 0.0;
  return machine;
}

class Maker {
 public:
  Maker() { move(0.0, MoveRole::link); }
  Maker& move(double seconds, MoveRole role = MoveRole::path) {
    MachineMove m;
    q_[0] += 10.0;
    q_[1] += 3.0 * seconds;
    m.to = q_;
    m.joints = 0x3f;
    m.role = role;
    m.rapid = role == MoveRole::link;
    m.duration = seconds;
    m.segment = static_cast<std::uint32_t>(program.moves.size());
    m.tool.translation() = q_.head<3>();
    m.tool.linear() =
        rotation_about(Vec3::UnitX(), 0.1 * static_cast<double>(program.moves.size()));
    program.moves.push_back(m);
    return *this;
  }
  Maker& event(const char* name) {
    MachineAction a;
    a.before = program.moves.size();
    a.event.name = name;
    program.actions.push_back(a);
    return *this;
  }
  Maker& dwell() {
    MachineAction a;
    a.kind = MachineAction::Kind::dwell;
    a.before = program.moves.size();
    program.actions.push_back(a);
    return *this;
  }
  MachineProgram program;

 private:
  JointVector q_ = JointVector::Zero(6);
};

double total(const MachineProgram& p, std::size_t moves) {
  double time = 0.0;
  for (std::size_t i = 0; i < moves; ++i) time += p.moves[i].duration;
  return time;
}

/// Program time of the n-th event of that name.
double time_of(const MachineProgram& p, const std::string& name) {
  for (const auto& a : p.actions)
    if (a.kind == MachineAction::Kind::event && a.event.name == name) return total(p, a.before);
  FAIL("no event " << name);
  return 0.0;
}

/// The joints at a time.
JointVector joints_at(const MachineProgram& p, double time) {
  for (std::size_t i = 1; i < p.moves.size(); ++i) {
    const auto& m = p.moves[i];
    if (time <= m.duration + 1e-15 && m.duration > 0.0)
      return p.moves[i - 1].to + std::min(1.0, time / m.duration) * (m.to - p.moves[i - 1].to);
    time -= m.duration;
  }
  return p.moves.back().to;
}

void check_same_motion(const MachineProgram& a, const MachineProgram& b) {
  CHECK(total(a, a.moves.size()) == Approx(total(b, b.moves.size())));
  CHECK((a.moves.back().to - b.moves.back().to).norm() < 1e-12);
  const double time = total(a, a.moves.size());
  for (int i = 0; i <= 300; ++i)
    CHECK((joints_at(a, time * i / 300) - joints_at(b, time * i / 300)).norm() < 1e-9);
  // Every share of every segment once, in order.
  double end = 1.0;
  for (const auto& m : b.moves) {
    if (m.role != MoveRole::path) continue;
    CHECK(m.from_share == Approx(end == 1.0 ? 0.0 : end));
    CHECK(m.to_share > m.from_share);
    end = m.to_share;
  }
  CHECK(end == 1.0);
  for (std::size_t i = 1; i < b.actions.size(); ++i)
    CHECK(b.actions[i - 1].before <= b.actions[i].before);
  CHECK(a.actions.size() == b.actions.size());
}

}  // namespace

TEST_CASE("event_latency: an event on the fly stands its latency ahead",
          "[postproc][pipeline][event_latency]") {
  for (const double latency : {0.001, 0.004, 0.01, 0.015, 0.03, 0.034}) {
    Maker m;
    m.move(0.01).move(0.01).move(0.004).move(0.01).event("beam_off").move(0.02);
    const MachineProgram before = m.program;
    compensate_latency(m.program, machine_with(latency), ToolTurn::none);
    INFO(latency);
    CHECK(time_of(m.program, "beam_off") == Approx(0.034 - latency).margin(1e-12));
    check_same_motion(before, m.program);
  }
}

TEST_CASE("event_latency: not past the start of the run", "[postproc][pipeline][event_latency]") {
  Maker m;
  m.move(0.01).move(0.0, MoveRole::link).event("beam_on").move(0.004).event("power").move(0.02);
  const MachineProgram before = m.program;
  compensate_latency(m.program, machine_with(0.1), ToolTurn::none);
  CHECK(time_of(m.program, "beam_on") == Approx(0.01));  // where it was
  CHECK(time_of(m.program, "power") == Approx(0.01));    // at the start
  REQUIRE(m.program.actions.size() == 2);
  CHECK(m.program.actions[0].event.name == "beam_on");
  CHECK(m.program.actions[0].before == 3);
  CHECK(m.program.actions[1].before == 3);
  check_same_motion(before, m.program);
}

TEST_CASE("event_latency: a first move without a known start is not split",
          "[postproc][pipeline][event_latency]") {
  Maker m;
  m.program.moves[0].role = MoveRole::path;
  m.program.moves[0].rapid = false;
  m.program.moves[0].duration = 1.0;
  m.event("beam_on").move(0.01);
  compensate_latency(m.program, machine_with(0.5), ToolTurn::none);
  CHECK(m.program.moves.size() == 2);
  CHECK(m.program.actions[0].before == 1);
}

TEST_CASE("event_latency: not past a stop", "[postproc][pipeline][event_latency]") {
  for (const char* stop : {"pierce", "gas_on", "stop", "dwell"}) {
    Maker m;
    m.move(0.02);
    if (std::string(stop) == "dwell")
      m.dwell();
    else
      m.event(stop);
    m.event("beam_on").move(0.01).event("beam_off").move(0.01);
    compensate_latency(m.program, machine_with(0.015), ToolTurn::none);
    INFO(stop);
    CHECK(time_of(m.program, "beam_on") == Approx(0.02));
    CHECK(time_of(m.program, "beam_off") == Approx(0.02));
    REQUIRE(m.program.actions.size() == 3);  // and in their order
    CHECK(m.program.actions[1].event.name == "beam_on");
    CHECK(m.program.actions[2].event.name == "beam_off");
  }
}

TEST_CASE("event_latency: events without latency and stops stay where they are",
          "[postproc][pipeline][event_latency]") {
  Maker m;
  m.move(0.02).event("beam_on").move(0.02).event("gas_off").move(0.02);
  const MachineProgram before = m.program;
  compensate_latency(m.program, machine_with(0.0), ToolTurn::none);
  CHECK(m.program.moves.size() == before.moves.size());
  compensate_latency(m.program, machine_with(0.005), ToolTurn::none);
  CHECK(time_of(m.program, "gas_off") == Approx(0.04));
  CHECK(time_of(m.program, "beam_on") == Approx(0.015));
}

TEST_CASE("event_latency: random programs keep their motion and the order of what waits",
          "[postproc][pipeline][event_latency]") {
  std::mt19937 rng(4);
  for (int round = 0; round < 200; ++round) {
    Maker m;
    for (int i = 0; i < 20; ++i) {
      static const char* kNames[] = {"beam_on", "beam_off", "power", "gas_on", "pierce"};
      m.move(0.002 + 0.001 * (rng() % 20));
      if (rng() % 2 == 0) m.event(kNames[rng() % 5]);
      if (rng() % 9 == 0) m.move(0.0, MoveRole::link);
    }
    m.move(0.01);
    const MachineProgram before = m.program;
    const MachineDefinition machine = machine_with(0.002 * (1 + rng() % 10));
    compensate_latency(m.program, machine, ToolTurn::none);
    check_same_motion(before, m.program);
    // Stops split the program in stretches that no event leaves.
    const auto order = [](const MachineProgram& p) {
      std::vector<std::string> text{""};
      for (const auto& a : p.actions) {
        if (a.event.name == "gas_on" || a.event.name == "pierce") text.emplace_back();
        text.back() += a.event.name + " ";
      }
      return text;
    };
    CHECK(order(before) == order(m.program));
  }
}

TEST_CASE("event_latency: tool moves are split on the tool's own way",
          "[postproc][pipeline][event_latency]") {
  for (const ToolTurn turn : {ToolTurn::slerp, ToolTurn::great_circle}) {
    Maker m;
    m.move(0.01).move(0.01).event("beam_off").move(0.01);
    for (auto& move : m.program.moves) move.interpolation = MoveInterpolation::tool;
    const MachineProgram before = m.program;
    const MachineDefinition machine = machine_with(0.004);
    compensate_latency(m.program, machine, turn);
    REQUIRE(m.program.moves.size() == before.moves.size() + 1);
    const Pose wanted =
        tool_motion(before.moves[1].tool, before.moves[2].tool, 0.6, turn, machine.tool.axis);
    CHECK(m.program.moves[2].tool.isApprox(wanted, 1e-12));
    CHECK(m.program.moves[2].duration == Approx(0.006));
    CHECK(m.program.moves[3].duration == Approx(0.004));
    CHECK(m.program.moves[3].tool.isApprox(before.moves[2].tool, 1e-12));
  }
}
