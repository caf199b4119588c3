#include "postproc/pipeline/input_motion.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/units.h"
#include "tests/postproc/pipeline/paths.h"

namespace smoothpost {
namespace {

/// A machine whose joints are the tip's coordinates.
struct Cartesian {
  ToolPath path;
  ReferencePath reference;
  SmoothedPath raw;
  JointPlan plan;

  explicit Cartesian(ToolPath p) : path(std::move(p)), reference(path, {}), raw(reference) {
    for (std::size_t leg = 0; leg <= raw.legs(); ++leg) {
      JointSample sample;
      sample.leg = sample.segment = static_cast<std::uint32_t>(leg);
      sample.q = raw.at(leg, 1.0).tip;
      plan.samples.push_back(sample);
    }
    plan.joints_on_leg = [this](std::size_t leg, double share, const JointVector&) {
      return std::optional<JointVector>(raw.at(leg, share).tip);
    };
  }
  Cartesian(const Cartesian&) = delete;
};

}  // namespace

TEST_CASE("input_motion: an arc at constant feed", "[postproc][pipeline]") {
  // Half a turn of radius 20 mm in 1 s: F = 20π mm/s, a = F²/R, j = F³/R².
  const Cartesian c(test::PathMaker(Vec3(20, 0, 0)).arc(Vec3::Zero(), kPi).take());
  const auto motion = input_motion(c.raw, c.plan, 3);
  REQUIRE(motion.size() == 3);
  const double feed = 20.0 * kPi;
  for (std::size_t j : {0u, 1u}) {
    CHECK(motion[j].velocity == Approx(feed).epsilon(1e-3));
    REQUIRE(motion[j].acceleration.has_value());
    CHECK(*motion[j].acceleration == Approx(feed * feed / 20.0).epsilon(1e-3));
    REQUIRE(motion[j].jerk.has_value());
    CHECK(*motion[j].jerk == Approx(feed * feed * feed / 400.0).epsilon(1e-3));
    // the mean square of a sine over half a turn
    CHECK(*motion[j].rms_jerk == Approx(feed * feed * feed / 400.0 / std::sqrt(2.0)).epsilon(1e-2));
  }
  CHECK(motion[2].velocity == 0.0);
}

TEST_CASE("input_motion: at a corner acceleration and jerk grow without bound",
          "[postproc][pipeline]") {
  const Cartesian c(
      test::PathMaker(Vec3(0, 0, 0)).feed({30, 0, 0}, 0.5).feed({30, 30, 0}, 0.5).take());
  const auto motion = input_motion(c.raw, c.plan, 3);
  REQUIRE(motion.size() == 3);
  for (std::size_t j : {0u, 1u}) {
    CHECK(motion[j].velocity == Approx(60.0));
    CHECK_FALSE(motion[j].acceleration.has_value());
    CHECK_FALSE(motion[j].jerk.has_value());
    CHECK_FALSE(motion[j].rms_jerk.has_value());
  }
  REQUIRE(motion[2].acceleration.has_value());
  CHECK(*motion[2].acceleration == Approx(0.0).margin(1e-6));
}

TEST_CASE("input_motion: a rapid parts two motions", "[postproc][pipeline]") {
  const Cartesian c(test::PathMaker(Vec3(0, 0, 0))
                        .feed({30, 0, 0}, 0.5)
                        .rapid({30, 0, 50})
                        .feed({30, 30, 50}, 0.5)
                        .take());
  const auto motion = input_motion(c.raw, c.plan, 3);
  REQUIRE(motion.size() == 3);
  REQUIRE(motion[0].acceleration.has_value());  // the corner is not run through
  CHECK(*motion[0].acceleration == Approx(0.0).margin(1e-3));
  CHECK(motion[2].velocity == 0.0);
}

TEST_CASE("input_motion: nothing where nothing is fed", "[postproc][pipeline]") {
  const Cartesian c(test::PathMaker(Vec3(0, 0, 0)).rapid({30, 0, 0}).take());
  CHECK(input_motion(c.raw, c.plan, 3).empty());
}

}  // namespace smoothpost
