#include "postproc/pipeline/place.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/units.h"
#include "postproc/pipeline/conversion_parts.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

InterpretedInput program(double tilt) {
  PathMaker maker(Vec3(0, 0, 80));
  maker.rapid({0, 0, 20}).feed({0, 0, 0}).axis({tilt, 0, 1}).feed({240, 0, 0});
  maker.axis({0, -tilt, 1}).feed({240, 160, 5}).feed({0, 160, 5}).rapid({0, 160, 60});
  InterpretedInput input;
  input.path = maker.take();
  return input;
}

}  // namespace

TEST_CASE("place: angles of a rotation", "[postproc][pipeline][place]") {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  for (int n = 0; n < 2000; ++n) {
    const double b = n % 10 == 0 ? (n % 20 == 0 ? kPi / 2 : -kPi / 2) : angle(engine) / 2.0;
    const Mat3 r = rotation_from_rpy(angle(engine), b, angle(engine));
    const Vec3 got = rpy_of(r);
    CHECK((rotation_from_rpy(got.x(), got.y(), got.z()) - r).norm() < 1e-7);
  }
}

TEST_CASE("place: numbers that can be typed, inside the box, best first, every time the same",
          "[postproc][pipeline][place]") {
  const auto machine = shipped_machine("robot_6r");
  const InterpretedInput input = program(0.3);
  PlaceInput in{input, machine, Pose::Identity(), {}, {}, kPi};
  in.start.translation() = Vec3(1500, 900, 400);
  in.box = ReachBox{Vec3(-400.25, -600, -100), Vec3(300, 500.5, 120)};
  in.turn = 0.5;
  const auto a = find_places(in, {}), b = find_places(in, {});
  REQUIRE(a.ok());
  REQUIRE(a.value().best.size() == b.value().best.size());
  CHECK(a.value().before.tightest().value < 0.0);
  CHECK(a.value().best.front().margins.tightest().value > 0.1);
  for (std::size_t i = 0; i < a.value().best.size(); ++i) {
    const FoundPlace& place = a.value().best[i];
    CHECK((place.position - b.value().best[i].position).norm() == 0.0);
    CHECK((place.turn - b.value().best[i].turn).norm() == 0.0);
    CHECK((place.position.array() >= in.box->lower.array()).all());
    CHECK((place.position.array() <= in.box->upper.array()).all());
    CHECK(std::abs(place.turn.z()) <= in.turn + 0.1 * kRadiansPerDegree);
    const double tenths = degrees_from_radians(place.turn.z()) * 10.0;
    CHECK(std::abs(tenths - std::round(tenths)) < 1e-9);
    CHECK((place.placement.translation() - place.position).norm() == 0.0);
    if (i > 0)
      CHECK(place.margins.tightest().value <= a.value().best[i - 1].margins.tightest().value);
  }
}

TEST_CASE("place: an arm's path stays below the plane of its links",
          "[postproc][pipeline][place]") {
  const auto machine = shipped_machine("robot_6r");
  const InterpretedInput input = program(0.2);
  const auto found = find_places({input, machine, Pose::Identity(), {}, {}, kPi}, {});
  REQUIRE(found.ok());
  for (const FoundPlace& place : found.value().best)
    for (const auto& p : input.path.points) {
      if (p.kind == MotionKind::rapid) continue;
      const Vec3 tip = machine.workpiece.frame * (place.placement * p.location.tip);
      CHECK(tip.z() <= machine.links.retract - machine.links.clearance + 0.1);
    }
}

TEST_CASE("place: a program without cuts has nothing to place", "[postproc][pipeline][place]") {
  const auto machine = shipped_machine("robot_6r");
  InterpretedInput input;
  input.path = PathMaker(Vec3(0, 0, 80)).rapid({0, 0, 20}).rapid({50, 0, 20}).take();
  const auto found = find_places({input, machine, Pose::Identity(), {}, {}, kPi}, {});
  REQUIRE(!found.ok());
  CHECK(found.diagnostics().front().code == "KN140");
  Progress stop{[](const char*, double) { return false; }};
  const auto cancelled = find_places({program(0.1), machine, Pose::Identity(), {}, {}, kPi}, stop);
  REQUIRE(!cancelled.ok());
  CHECK(cancelled.diagnostics().front().code == "US190");
}
