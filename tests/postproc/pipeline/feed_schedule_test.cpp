#include "postproc/pipeline/feed_schedule.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

const std::string kHead = "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\n";
const std::string kEnd = "G0 Z40\nM5\nM429\nM30\n%\n";
// Corners in the plane, an arc, both rotaries moving.
const std::string kCut =
    "G0 X-20 Y-10 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F300\nG1 X20 F600\n"
    "G2 X20 Y10 I0 J10\nG1 X-20 Y10 Z1\nG1 X-10 Y5 A-20 C20\nG1 X0 Y0 A-30 C40\n";

ConvertInput prepare(const std::string& text, const char* to) {
  InputSettings settings;
  settings.file_name = "part.ngc";
  settings.machine = shipped_machine("table_table_ac");
  settings.tool_lengths = {{1, 60.0}};
  auto read = interpret_nc(text, settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  ConvertInput in;
  in.input = std::move(read.value());
  in.machine = shipped_machine(to);
  in.input_name = "part.ngc";
  return in;
}

Conversion converted(const ConvertInput& in) {
  Conversion c = convert(in, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(c.verdict == Verdict::certified);
  return c;
}

/// Largest share of a limit that the joints use by differences of their positions alone.
struct Shares {
  double velocity = 0.0, acceleration = 0.0, jerk = 0.0;
};

Shares by_differences(const ScheduledStretch& stretch, const MachineDefinition& machine) {
  Shares most;
  const double duration = stretch.duration();
  const double h = std::min(1e-3, duration / 20.0);
  const auto at = [&](double t) {
    return stretch.at(std::clamp(t, 0.0, duration)).position;  // at rest outside
  };
  const auto raise = [](double& value, double now) { value = std::max(value, now); };
  for (double t = -3.0 * h; t < duration + 3.0 * h; t += h) {
    const JointVector a = at(t), b = at(t + h), c = at(t + 2.0 * h), d = at(t + 3.0 * h);
    for (int j = 0; j < machine.size(); ++j) {
      const auto& axis = machine.axes[static_cast<std::size_t>(j)];
      raise(most.velocity, std::abs(b[j] - a[j]) / h / axis.velocity);
      raise(most.acceleration, std::abs(c[j] - 2.0 * b[j] + a[j]) / (h * h) / axis.acceleration);
      raise(most.jerk, std::abs(d[j] - 3.0 * c[j] + 3.0 * b[j] - a[j]) / (h * h * h) / axis.jerk);
    }
  }
  return most;
}

}  // namespace

TEST_CASE("feed_schedule: differences of the joints keep every limit on every kind of machine",
          "[postproc][pipeline][schedule]") {
  for (const char* machine : {"table_table_bc", "head_table_bc", "robot_6r"}) {
    const ConvertInput in = prepare(kHead + kCut + kEnd, machine);
    const Conversion c = converted(in);
    INFO(machine);
    REQUIRE_FALSE(c.schedule.stretches.empty());
    double time = 0.0;
    for (const ScheduledStretch& stretch : c.schedule.stretches) {
      time += stretch.duration();
      if (!(stretch.duration() > 0.0)) continue;
      const Shares most = by_differences(stretch, in.machine);
      // A difference quotient is a mean of the derivative: it never goes beyond it. What is left
      // is rounding of the positions, 1e-12 / h³.
      CHECK(most.velocity <= in.machine.tolerance.limit_share + 1e-6);
      CHECK(most.acceleration <= in.machine.tolerance.limit_share + 1e-4);
      CHECK(most.jerk <= in.machine.tolerance.limit_share + 1e-2);
    }
    CHECK(c.schedule.time == Approx(time));
  }
}

TEST_CASE("feed_schedule: joints are those of the samples and derivatives those of the joints",
          "[postproc][pipeline][schedule]") {
  const ConvertInput in = prepare(kHead + kCut + kEnd, "table_table_bc");
  const Conversion c = converted(in);
  std::size_t compared = 0;
  for (const ScheduledStretch& stretch : c.schedule.stretches) {
    const JointStretch& joints = stretch.joints;
    for (std::size_t p = 0; p < joints.pieces(); ++p) {
      const double a = joints.breaks[p], b = joints.breaks[p + 1];
      const double h = 1e-3 * (b - a);
      for (const double share : {0.2, 0.5, 0.8}) {
        const double s = a + share * (b - a);
        const PathJet jet = joints.jet(p, s);
        const JointVector slope = (joints.joints_at(s + h) - joints.joints_at(s - h)) / (2.0 * h);
        const PathJet left = joints.jet(p, s - h), right = joints.jet(p, s + h);
        const double scale = jet.first.cwiseAbs().maxCoeff() + 1e-9;
        CHECK((slope - jet.first).cwiseAbs().maxCoeff() < 1e-4 * scale + 1e-9 / h);
        const JointVector bend = (right.first - left.first) / (2.0 * h);
        CHECK((bend - jet.second).cwiseAbs().maxCoeff() <
              1e-2 * jet.second.cwiseAbs().maxCoeff() + 1e-7 + 1e-9 / h);
        const double way = (right.tip_first - left.tip_first) / (2.0 * h);
        CHECK(std::abs(way - jet.tip_second) < 1e-3 * std::abs(jet.tip_second) + 1e-7 + 1e-9 / h);
        ++compared;
      }
    }
  }
  CHECK(compared > 60);
}

TEST_CASE("feed_schedule: the tip is never faster than programmed and reaches that feed",
          "[postproc][pipeline][schedule]") {
  ConvertInput in = prepare(
      kHead + "G0 X-80 Y0 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F60\nG1 X80\n" + kEnd, "table_table_bc");
  in.machine.recipe.smoothing = "none";
  const Conversion c = converted(in);
  double fastest = 0.0;
  for (const ScheduledStretch& stretch : c.schedule.stretches)
    for (int k = 0; k <= 4000; ++k) {
      const double t = stretch.duration() * k / 4000;
      const FeedState state = stretch.profile.at(t / stretch.slowing);
      const JointStretch& joints = stretch.joints;
      fastest = std::max(fastest, joints.jet(joints.piece_at(state.s), state.s).tip_first *
                                      state.first / stretch.slowing);
    }
  CHECK(fastest <= 1.0 + 1e-9);  // 60 mm/min
  CHECK(fastest > 0.998);
}

TEST_CASE("feed_schedule: without smoothing the path stops at its corners and nowhere else",
          "[postproc][pipeline][schedule]") {
  ConvertInput in = prepare(kHead +
                                "G0 X0 Y0 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F300\nG1 X10 F600\n"
                                "G1 X20\nG1 Y10\nG4 P0.5\nG1 Y20\n" +
                                kEnd,
                            "table_table_bc");
  in.machine.recipe.smoothing = "none";
  const Conversion c = converted(in);
  // Down; X10 and X20 in one; Y10 up to the dwell; Y20.
  std::vector<double> lengths;
  std::vector<StopCause> causes;
  for (const ScheduledStretch& s : c.schedule.stretches) {
    if (!(s.duration() > 0.0)) continue;
    lengths.push_back(s.joints.length());
    causes.push_back(s.joints.end);
    for (const double t : {0.0, s.duration()}) {
      CHECK(s.at(t).velocity.norm() < 1e-6);
      CHECK(s.at(t).acceleration.norm() < 1e-4);
    }
  }
  REQUIRE(lengths.size() == 4);
  CHECK(lengths[1] == Approx(20.0));
  CHECK(lengths[2] == Approx(10.0));
  CHECK(lengths[3] == Approx(10.0));
  CHECK(causes[0] == StopCause::corner);
  CHECK(causes[1] == StopCause::corner);
  CHECK(causes[2] == StopCause::event);
  CHECK(causes[3] == StopCause::path_end);
  CHECK(c.schedule.stops == 3);
}

TEST_CASE("feed_schedule: a straight move takes its seven phase time",
          "[postproc][pipeline][schedule]") {
  ConvertInput in =
      prepare(kHead + "G0 X0 Y0 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F300\nG1 X10 F60000\n" + kEnd,
              "table_table_bc");
  in.machine.recipe.smoothing = "none";
  const Conversion c = converted(in);
  const auto& axis = in.machine.axes[0];
  const double share = in.machine.tolerance.limit_share;
  const FeedLimits limits = feed_limits(in.machine);
  const double v = limits.velocity[0], a = limits.acceleration[0], j = limits.jerk[0];
  CHECK(a == Approx(share * axis.acceleration));
  const auto ramp = [&](double top) {
    return top <= a * a / j ? 2.0 * std::sqrt(top / j) : top / a + a / j;
  };
  const double way = 10.0;
  double time = 0.0;
  if (v * ramp(v) <= way) {
    time = way / v + ramp(v);
  } else {
    const double top = std::pow(way * std::sqrt(j) / 2.0, 2.0 / 3.0);
    REQUIRE(top <= a * a / j);
    time = 2.0 * ramp(top);
  }
  const ScheduledStretch& last = c.schedule.stretches.back();
  CHECK(last.duration() >= time * (1.0 - 1e-9));
  CHECK(last.duration() <= time * 1.01);
}

TEST_CASE("feed_schedule: constant keeps one feed between the ramps of a cut",
          "[postproc][pipeline][schedule]") {
  ConvertInput in = prepare(kHead +
                                "G0 X-40 Y-10 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F300\n"
                                "G2 X-40 Y30 I0 J20 F6000\nG2 X-40 Y-10 I0 J-20\n" +
                                kEnd,
                            "table_table_bc");
  in.machine.recipe.smoothing = "none";
  in.machine.recipe.schedule = "constant";
  const Conversion c = converted(in);
  // Arcs meet with the same circle: one stretch. Jerk: F³/r² = J on this machine.
  const FeedLimits limits = feed_limits(in.machine);
  const double r = 20.0;
  const double wanted = std::min({limits.velocity[0], std::sqrt(limits.acceleration[0] * r),
                                  std::cbrt(limits.jerk[0] * r * r)});
  const auto circle = std::max_element(
      c.schedule.stretches.begin(), c.schedule.stretches.end(),
      [](const auto& x, const auto& y) { return x.joints.length() < y.joints.length(); });
  REQUIRE(circle->joints.length() == Approx(2.0 * kPi * r).epsilon(1e-4));
  // In the middle half of the way nothing else happens.
  for (int k = 0; k <= 100; ++k) {
    const double s = circle->joints.length() * (0.25 + 0.005 * k);
    const FeedState state = circle->profile.at(circle->profile.time(s));
    CHECK(state.first / circle->slowing == Approx(wanted).epsilon(0.01));
  }
}

TEST_CASE("feed_schedule: programmed refuses with lines joints and factors",
          "[postproc][pipeline][schedule]") {
  ConvertInput in = prepare(kHead +
                                "G0 X-40 Y-10 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F30\n"
                                "G1 X40 F600\nG1 Y0 F30\nG1 X-40 F6000\n" +
                                kEnd,
                            "table_table_bc");
  in.machine.recipe.smoothing = "none";
  in.machine.recipe.schedule = "programmed";
  const Conversion c = convert(in, false, {});
  CHECK(c.verdict == Verdict::refused);
  CHECK(c.program.empty());
  const auto refusal = std::find_if(c.diagnostics.begin(), c.diagnostics.end(),
                                    [](const Diagnostic& d) { return d.code == "KN152"; });
  REQUIRE(refusal != c.diagnostics.end());
  // 100 mm/s against the velocity of X, line 13 of the program; 10 mm/s in line 11 is allowed.
  const double factor = 100.0 / feed_limits(in.machine).velocity[0];
  REQUIRE(factor > 1.0);
  CHECK(refusal->where.line == 13);
  CHECK(refusal->text.find("line 13: axis X needs ") != std::string::npos);
  CHECK(refusal->text.find("times its velocity") != std::string::npos);
  CHECK(refusal->text.find("line 11") == std::string::npos);

  in.machine.recipe.schedule = "jerk";
  CHECK(converted(in).schedule.time > 0.0);
}

TEST_CASE("feed_schedule: programmed stops in sharp corners and keeps the feed elsewhere",
          "[postproc][pipeline][schedule]") {
  // Right angles that are blended, and legs of 60 and 30 mm.
  ConvertInput in = prepare(kHead +
                                "G0 X-30 Y-10 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F30\n"
                                "G1 X30 F960\nG1 Y20\nG1 X-30\n" +
                                kEnd,
                            "table_table_bc");
  in.machine.recipe.schedule = "jerk";
  const Conversion fast = converted(in);
  in.machine.recipe.schedule = "programmed";
  const Conversion c = converted(in);
  CHECK(c.schedule.stops >= fast.schedule.stops + 2);
  // The blends are still there: stops are no other path.
  REQUIRE(c.corners.size() == fast.corners.size());
  for (std::size_t k = 0; k < c.corners.size(); ++k)
    CHECK(c.corners[k].half_width == fast.corners[k].half_width);
  // Of the way in the plane at least nine tenths of the time are at 16 mm/s but for ramps, and what
  // is slower lies within half a second of a rest.
  int at_feed = 0;
  for (const ScheduledStretch& stretch : c.schedule.stretches) {
    if (stretch.joints.feed.front() < 15.5 || stretch.joints.length() < 20.0) continue;
    for (double t = 0.5; t < stretch.duration() - 0.5; t += 0.01) {
      CHECK(stretch.tip_speed(t) == Approx(16.0).epsilon(0.005));
      ++at_feed;
    }
  }
  CHECK(at_feed > 500);
  for (const auto& stretch : c.schedule.stretches) {
    const Shares most = by_differences(stretch, in.machine);
    CHECK(most.velocity <= 1.0);
    CHECK(most.acceleration <= 1.0);
    CHECK(most.jerk <= 1.001);
  }

  // A corner of 10 degrees is part of a curve: it has to be passed, or the feed is refused.
  in = prepare(kHead +
                   "G0 X-30 Y-10 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F30\n"
                   "G1 X0 F3000\nG1 X30 Y-4.7\n" +
                   kEnd,
               "table_table_bc");
  in.machine.recipe.schedule = "programmed";
  const Conversion refused = convert(in, false, {});
  CHECK(refused.verdict == Verdict::refused);
  CHECK(std::count_if(refused.diagnostics.begin(), refused.diagnostics.end(),
                      [](const Diagnostic& d) { return d.code == "KN152"; }) == 1);
}

TEST_CASE("feed_schedule: no block is shorter than the control's least block",
          "[postproc][pipeline][schedule]") {
  const ConvertInput in = prepare(kHead + kCut + kEnd, "table_table_bc");
  const Conversion c = converted(in);
  for (const ScheduledStretch& stretch : c.schedule.stretches)
    for (std::size_t i = 1; i < stretch.joints.sample_s.size(); ++i) {
      const double a = stretch.joints.sample_s[i - 1], b = stretch.joints.sample_s[i];
      if (b - a < 1e-5 * stretch.joints.length()) continue;
      CHECK(stretch.time_at(b) - stretch.time_at(a) >= in.machine.cycle.min_block * (1.0 - 1e-6));
    }
}

TEST_CASE("feed_schedule: what slows the path is named and ramps are not",
          "[postproc][pipeline][schedule]") {
  // A slow line needs nothing but its ramps; a circle is faster than its axes may be.
  ConvertInput slow = prepare(
      kHead + "G0 X-40 Y0 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F60\nG1 X40\n" + kEnd, "table_table_bc");
  slow.machine.recipe.smoothing = "none";
  CHECK(converted(slow).schedule.slowed_by.empty());
  ConvertInput fast = prepare(kHead +
                                  "G0 X-5 Y0 A0 C0\nG43 H1 Z30\nG0 Z2\nG1 Z0 F60\n"
                                  "G2 X5 Y0 I5 J0 F1200\nG2 X-5 Y0 I-5 J0\n" +
                                  kEnd,
                              "table_table_bc");
  fast.machine.recipe.smoothing = "none";
  const Conversion c = converted(fast);
  REQUIRE_FALSE(c.schedule.slowed_by.empty());
  for (const SlowedBy& s : c.schedule.slowed_by) {
    CHECK(s.factor < 1.0);
    CHECK(s.factor > 0.0);
    CHECK((s.first_line == 11 || s.first_line == 12));
    CHECK(s.limit == FeedWitness::Kind::velocity);  // 20 mm/s on a radius of 5
    CHECK((s.joint == 0 || s.joint == 1));
  }
}
