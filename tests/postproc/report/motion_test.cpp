#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/units.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/report/motion_record.h"
#include "tests/postproc/report/drawn.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

struct Motions {
  Drawn d;
  ScrewChain chain = {};
  ProgramMotion motion = {};
  MotionRecord after = {}, before = {};
};

Motions motions(const char* machine) {
  Motions m{drawn(machine)};
  const ReferencePath reference(m.d.conversion.path, m.d.in.input.frames);
  m.chain = placed_chain(m.d.in.machine, m.d.in.placement);
  m.motion = program_motion(m.d.page(), &reference, m.chain);
  m.after = planned_record(m.d.page());
  m.before = input_record(m.d.page(), &reference, m.chain, m.motion);
  return m;
}

double check_value(const Conversion& c, const std::string& name) {
  for (const Check& k : c.checks)
    if (k.name == name) return k.value;
  return NAN;
}

}  // namespace

TEST_CASE("program_motion: every place is on the program and within its certificate",
          "[postproc][report]") {
  for (const char* machine : {"table_table_bc", "robot_6r"}) {
    INFO(machine);
    const Motions m = motions(machine);
    const Conversion& c = m.d.conversion;
    const double tip = check_value(c, "tip_deviation");
    const double axis = check_value(c, "axis_deviation");
    double largest_tip = 0.0;
    std::size_t compared = 0;
    for (std::size_t i = 0; i < m.motion.points.size(); ++i) {
      const ProgramPoint& p = m.motion.points[i];
      if (i > 0) CHECK(p.time >= m.motion.points[i - 1].time - 1e-9);
      const CutterLocation holder = forward_location(m.chain, p.joints);
      CHECK((holder.tip - p.tool_length * holder.axis - p.tip).norm() < 1e-9);
      if (!p.deviation) continue;
      ++compared;
      largest_tip = std::max(largest_tip, p.deviation->norm());
      CHECK(p.deviation->norm() <= tip);
      CHECK(degrees_from_radians(p.axis_deviation) <= axis + 1e-9);
    }
    CHECK(compared > 50);
    // the drawing comes near to the bound that was certified
    CHECK(largest_tip > 0.1 * tip);
    CHECK(m.motion.points.back().joints == c.read.moves.back().to);
    CHECK(m.motion.duration() <= c.timeline.duration() + 1e-9);
    CHECK(m.motion.duration() > 0.95 * c.timeline.duration());
    for (const ProgramPoint& p : m.motion.points)
      if (!p.link) CHECK(p.tool_length == 60.0);
  }
}

TEST_CASE("planned_record: derivatives of the positions within every limit", "[postproc][report]") {
  const Motions m = motions("table_table_bc");
  const MotionRecord& r = m.after;
  REQUIRE(r.orders == 4);
  REQUIRE(r.time.size() > 500);
  CHECK(r.step == m.d.in.machine.cycle.time);
  CHECK(r.time.back() == Approx(m.d.conversion.timeline.duration()));
  std::size_t compared = 0;
  for (std::size_t j = 0; j < m.d.in.machine.axes.size(); ++j) {
    const AxisDefinition& axis = m.d.in.machine.axes[j];
    const double unit = axis.joint.kind == JointKind::rotary ? kDegreesPerRadian : 1.0;
    double speed = 0.0, acceleration = 0.0, jerk = 0.0, apart = 0.0;
    for (std::size_t i = 1; i + 2 < r.time.size(); ++i) {
      speed = std::max(speed, std::abs(r.axes[1][j][i]));
      acceleration = std::max(acceleration, std::abs(r.axes[2][j][i]));
      jerk = std::max(jerk, std::abs(r.axes[3][j][i]));
      const double difference =
          (r.axes[0][j][i + 1] - r.axes[0][j][i - 1]) / (r.time[i + 1] - r.time[i - 1]);
      apart = std::max(apart, std::abs(difference - r.axes[1][j][i]));
      ++compared;
    }
    CHECK(speed <= unit * axis.velocity * 1.001);
    CHECK(acceleration <= unit * axis.acceleration * 1.001);
    CHECK(jerk <= unit * axis.jerk * 1.001);
    CHECK(speed > 0.0);
    // the jerk may step, so differences of the position follow the velocity to J·h²/3
    CHECK(apart <= unit * axis.jerk * r.step * r.step);
  }
  CHECK(compared > 2000);
}

TEST_CASE("input_record: the axes of the output machine on the input's own motion",
          "[postproc][report]") {
  for (const char* machine : {"table_table_bc", "robot_6r"}) {
    INFO(machine);
    const Motions m = motions(machine);
    const MotionRecord& r = m.before;
    REQUIRE(r.orders == 4);
    CHECK(r.step == 0.004);
    const ReferencePath reference(m.d.conversion.path, m.d.in.input.frames);
    const auto& points = reference.path().points;
    // Line 11, G1 X20 F600 from X-20: 4 s at 10 mm/s; behind the plunge of 0.4 s on line 10.
    std::uint32_t first = 1;
    while (points[first].replanned) ++first;
    REQUIRE(points[first].line == 10);
    REQUIRE(points[first + 1].duration == Approx(4.0));
    std::size_t compared = 0;
    for (std::size_t i = 1; i + 1 < r.time.size(); ++i) {
      const double t = r.time[i] - r.time[0] - points[first].duration;
      if (t < 0.0 || t > 3.9) continue;
      JointVector q(static_cast<int>(m.d.in.machine.axes.size()));
      JointVector v(q.size());
      for (int j = 0; j < q.size(); ++j) {
        const auto a = static_cast<std::size_t>(j);
        const bool rotary = m.d.in.machine.axes[a].joint.kind == JointKind::rotary;
        q[j] = r.axes[0][a][i] * (rotary ? kRadiansPerDegree : 1.0);
        v[j] = r.axes[1][a][i];
        if (i > 2 && t > 0.02) {
          CHECK(v[j] == Approx((r.axes[0][a][i + 1] - r.axes[0][a][i]) / r.step).margin(1e-6));
        }
      }
      const CutterLocation holder = forward_location(m.chain, q);
      const Vec3 tip = holder.tip - 60.0 * holder.axis;
      CHECK((tip - Vec3(-20.0 + 10.0 * t, -10.0, 0.0)).norm() < 1e-6);
      CHECK((holder.axis - Vec3::UnitZ()).norm() < 1e-9);
      ++compared;
    }
    CHECK(compared > 900);
  }
}

TEST_CASE("printed_record: without a schedule only positions and velocities are told",
          "[postproc][report]") {
  Drawn d = drawn();
  d.conversion.timeline = {};
  const ScrewChain chain = placed_chain(d.in.machine, d.in.placement);
  const PageInput page = d.page();
  const ProgramMotion motion = program_motion(page, nullptr, chain);
  CHECK(planned_record(page).empty());
  const MotionRecord r = printed_record(page, motion);
  CHECK(r.orders == 2);
  // Times are those of the certificate.
  CHECK(motion.duration() == Approx(d.conversion.scheduled_time));
  for (std::size_t j = 0; j < d.in.machine.axes.size(); ++j) {
    const bool rotary = d.in.machine.axes[j].joint.kind == JointKind::rotary;
    double most = 0.0, wanted = 0.0;
    for (std::size_t i = 0; i < r.time.size(); ++i)
      if (r.cutting[i]) most = std::max(most, std::abs(r.axes[1][j][i]));
    const auto& moves = d.conversion.read.moves;
    const int k = static_cast<int>(j);
    for (std::size_t i = 1; i < moves.size(); ++i)
      if (d.conversion.line_map[i].role == MoveRole::path)
        wanted = std::max(wanted, std::abs(moves[i].to[k] - moves[i - 1].to[k]) /
                                      moves[i].duration * (rotary ? kDegreesPerRadian : 1.0));
    CHECK(wanted > 0.0);
    CHECK(most == Approx(wanted).epsilon(1e-6));
  }
  CHECK(input_record(page, nullptr, chain, motion).empty());
}
