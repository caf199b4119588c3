#include "postproc/pipeline/arm_plan.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/units.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/tool_motion.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

ToolPath milled(double tool_length, double tilt = 0.3) {
  PathMaker maker(Vec3(0, 0, 80));
  maker.rapid({0, 0, 20}).feed({0, 0, 0}).axis({tilt, 0, 1}).feed({120, 0, 0});
  maker.arc({120, 40, 0}, kPi, 5.0).axis({0, -tilt, 1}).feed({0, 80, 5}).rapid({0, 80, 60});
  maker.axis({-tilt, tilt, 1}).rapid({-100, 0, 20}).feed({-100, 0, 0}).axis({0, 0, 1});
  maker.feed({-100, 90, 0}).rapid({-100, 90, 80});
  ToolPath path = maker.take();
  for (auto& p : path.points) p.tool_length = tool_length;
  find_cuts(path, {});
  return path;
}

JointPlanSettings settings_for(const MachineDefinition& machine) {
  JointPlanSettings s;
  s.tip_tolerance = 0.03;
  s.axis_tolerance = 5e-4;
  s.held = home_of(machine);
  s.file_name = "part.ngc";
  for (const auto& a : machine.axes) s.axis_names.push_back(a.name);
  return s;
}

SixR arm_at(const MachineDefinition& machine, const Pose& placement) {
  ScrewChain chain = chain_of(machine);
  chain.workpiece_home = chain.workpiece_home * placement;
  return *SixR::from(chain);
}

}  // namespace

TEST_CASE("arm_plan: samples and the motion between them follow the reference",
          "[postproc][pipeline][arm_plan]") {
  const auto machine = shipped_machine("robot_6r");
  const SixR arm = arm_at(machine, Pose::Identity());
  const ScrewChain& chain = arm.chain();
  for (const bool tool_moves : {false, true})
    for (const double length : {0.0, 90.0}) {
      const ToolPath path = milled(length);
      const ReferencePath reference(path, {});
      JointPlanSettings settings = settings_for(machine);
      settings.tool_moves = tool_moves;
      const auto plan = plan_arm(SmoothedPath(reference), arm, settings, {});
      for (const auto& d : plan.diagnostics()) UNSCOPED_INFO(to_string(d));
      REQUIRE(plan.ok());
      const auto& samples = plan.value().samples;
      REQUIRE(plan.value().splits.empty());
      double tip = 0.0, axis = 0.0;
      for (std::size_t i = 0; i < samples.size(); ++i) {
        const auto& s = samples[i];
        const CutterLocation wanted =
            s.segment == 0 ? path.points[0].location : reference.at(s.segment, s.s);
        const Pose got = tip_pose(chain, s.q, length);
        CHECK((got.translation() - wanted.tip).norm() < 1e-7);
        CHECK((got.linear() * chain.tool_axis - wanted.axis).norm() < 1e-9);
        for (int j = 0; j < 6; ++j) {
          CHECK(s.q[j] >= chain.joints[static_cast<std::size_t>(j)].lower - 1e-9);
          CHECK(s.q[j] <= chain.joints[static_cast<std::size_t>(j)].upper + 1e-9);
        }
        if (i == 0 || path.points[s.segment].replanned) continue;
        const double begin = samples[i - 1].segment == s.segment ? samples[i - 1].s : 0.0;
        CHECK(s.s > begin);
        const Pose a = tip_pose(chain, samples[i - 1].q, length), b = got;
        for (int k = 1; k < 20; ++k) {
          const double t = k / 20.0;
          const Pose at =
              tool_moves ? tool_motion(a, b, t, ToolTurn::slerp, chain.tool_axis)
                         : tip_pose(chain, samples[i - 1].q + t * (s.q - samples[i - 1].q), length);
          const CutterLocation want = reference.at(s.segment, begin + t * (s.s - begin));
          tip = std::max(tip, (at.translation() - want.tip).norm());
          axis = std::max(axis, angle_between(at.linear() * chain.tool_axis, want.axis));
        }
      }
      INFO("tool moves " << tool_moves << " tip " << tip << " axis " << axis);
      CHECK(tip <= settings.tip_tolerance);
      CHECK(axis <= settings.axis_tolerance);
      // The last sample of every segment that is cut is at its end.
      for (std::size_t i = 0; i < samples.size(); ++i)
        if (i + 1 == samples.size() || samples[i + 1].segment != samples[i].segment)
          CHECK(samples[i].s == 1.0);
    }
}

TEST_CASE("arm_plan: a given rotation about the tool axis is kept",
          "[postproc][pipeline][arm_plan]") {
  const auto machine = shipped_machine("robot_6r");
  const SixR arm = arm_at(machine, Pose::Identity());
  const ScrewChain& chain = arm.chain();
  const ToolPath path = milled(40.0);
  const ReferencePath reference(path, {});
  const Mat3 home = forward(chain, home_of(machine)).linear();
  const auto least = [](const Vec3& x, const Vec3& y) {
    return rotation_exp(angle_between(x, y) * x.cross(y).normalized().eval());
  };
  const Vec3 z = Vec3::UnitZ();
  for (const double spin : {-1.2, -0.8, -0.1, 0.0, 0.5, 1.0}) {
    JointPlanSettings settings = settings_for(machine);
    settings.spin = spin;
    const auto plan = plan_arm(SmoothedPath(reference), arm, settings, {});
    INFO("spin " << spin);
    for (const auto& d : plan.diagnostics()) UNSCOPED_INFO(to_string(d));
    REQUIRE(plan.ok());  // at -0.1 the wrist passes a singular posture closely
    const Vec3 h = home * chain.tool_axis;
    const Mat3 upright = (h - z).norm() < 1e-12 ? home : Mat3(least(h, z) * home);
    for (const auto& s : plan.value().samples) {
      const Vec3 n =
          s.segment == 0 ? path.points[0].location.axis : reference.at(s.segment, s.s).axis;
      const Mat3 wanted = ((n - z).norm() < 1e-12 ? Mat3::Identity() : least(z, n)) *
                          rotation_about(z, spin) * upright;
      CHECK((forward(chain, s.q).linear() - wanted).norm() < 1e-7);
    }
  }
}

TEST_CASE("arm_plan: the chosen rotation makes a way where there is one",
          "[postproc][pipeline][arm_plan]") {
  const auto machine = shipped_machine("robot_6r");
  std::mt19937 rng(12);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::string why;
  int chosen_ok = 0, zero_ok = 0, any_ok = 0, missed = 0;
  for (int round = 0; round < 24; ++round) {
    Pose placement = shifted(500 * u(rng), 1400 * u(rng), 500 * u(rng));
    placement.linear() = rotation_about(Vec3::UnitZ(), kPi * u(rng));
    const SixR arm = arm_at(machine, placement);
    const ToolPath path = milled(40.0);
    const ReferencePath reference(path, {});
    JointPlanSettings settings = settings_for(machine);
    const auto plan = plan_arm(SmoothedPath(reference), arm, settings, {});
    const bool chosen = plan.ok();
    bool any = false;
    for (int k = 0; k < 24; ++k) {
      settings.spin = 2.0 * kPi * k / 24;
      const bool ok = plan_arm(SmoothedPath(reference), arm, settings, {}).ok();
      any = any || ok;
      if (k == 0) zero_ok += ok;
    }
    chosen_ok += chosen;
    any_ok += any;
    missed += any && !chosen;
    if (any && !chosen) why += to_string(plan.diagnostics().front()) + "\n";
  }
  INFO("chosen " << chosen_ok << ", spin 0 " << zero_ok << ", any of 24 " << any_ok << "\n" << why);
  CHECK(any_ok >= 8);
  CHECK(missed == 0);
  CHECK(chosen_ok >= zero_ok);
}

TEST_CASE("arm_plan: no way is told with code and line", "[postproc][pipeline][arm_plan]") {
  const auto machine = shipped_machine("robot_6r");
  const ToolPath path = milled(40.0);
  const ReferencePath reference(path, {});
  const auto far = plan_arm(SmoothedPath(reference), arm_at(machine, shifted(5000, 0, 0)),
                            settings_for(machine), {});
  REQUIRE_FALSE(far.ok());
  CHECK(far.diagnostics().front().code == "KN101");
  CHECK(far.diagnostics().front().where.line > 0);
  CHECK(far.diagnostics().front().where.file == "part.ngc");
  Progress stop;
  stop.report = [](const char*, double) { return false; };
  CHECK_FALSE(plan_arm(SmoothedPath(reference), arm_at(machine, Pose::Identity()),
                       settings_for(machine), stop)
                  .ok());
}
