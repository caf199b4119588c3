#include "examples/paper_b/study.h"

#include <catch2/catch.hpp>

#include "kernels/core/units.h"
#include "tests/support/support.h"

using namespace smoothpost;
using namespace smoothpost::paper_b;

namespace {

constexpr int kSteps = 6276;

/// A case of the shared reference; the last word is the banded solver's, for speed.
std::optional<Study> shared_case(int number) {
  const auto file = test::shared_path("reference/case" + std::to_string(number) + ".csv");
  if (!file) {
    WARN("no ../shared, not tested");
    return std::nullopt;
  }
  return Study(read_case(*file, number), false);
}

Study own_case(int number) {
  return Study(
      read_case(test::source_path("examples/paper_b/case" + std::to_string(number) + ".csv"),
                number),
      false);
}

Request unlimited(const Study& study, Method method) {
  return {method, study.path().feed, false, 0.0, {}};
}

/// Peak jerk of q4 and q5 and deviation at the programmed feed, limits off.
struct Row {
  double q4, q5;
  Deviation deviation;
};
Row row(const Study& study, const Request& request) {
  const RotaryResult r = study.rotaries(request);
  REQUIRE(r.status == RotaryStatus::optimal);
  const Motion m = motion_of_splines(study, r.q, {0.0, request.feed, nullptr, kSteps});
  return {jerk_numbers(m, 3).peak, jerk_numbers(m, 4).peak, deviation(study, m)};
}

struct Rms {
  double held, optimised;
};
/// Of q1 … q3 by the cone's rotaries, same time, 5 mm reserve.
Rms linear_rms(const Study& study, double arm, double feed) {
  const RotaryResult r = study.rotaries({Method::cone, feed, true, 0.0, {}});
  REQUIRE(r.status == RotaryStatus::optimal);
  const StandoffResult s = optimise_standoff(*HeadGeometry::from(laser(arm)), study.tip(), r.q,
                                             standoff_options(study, feed, true));
  REQUIRE(s.solution.status == QpStatus::optimal);
  const Motion held = motion_of_splines(study, r.q, {arm, feed, nullptr, kSteps});
  const Motion moved = motion_of_splines(study, r.q, {arm, feed, &s.q6, kSteps});
  for (const auto& q : moved.joints) {
    CHECK(q[5] <= 15.0 + 1e-6);
    CHECK(q[5] >= -95.0 - 1e-6);
  }
  return {linear_jerk_rms(held), linear_jerk_rms(moved)};
}

}  // namespace

TEST_CASE("paper B study: standoff lowers the linear jerk of Case 2", "[examples][paper]") {
  const auto study = shared_case(2);
  if (!study) return;
  const double feed = 180.0;  // 10.8 m/min
  const Rms near = linear_rms(*study, 0.0, feed);
  CHECK(1.0 - near.optimised / near.held >= 0.65);
  const Rms far = linear_rms(*study, 200.0, feed);
  CHECK(1.0 - far.optimised / far.held >= 0.33);
  CHECK(far.held / 1000.0 == Approx(44.4).epsilon(0.02));
}

TEST_CASE("paper B study: what keeps Case 2 near the programmed axis", "[examples][paper]") {
  const auto study = shared_case(2);
  if (!study) return;
  const Row via = row(*study, unlimited(*study, Method::via));
  CHECK(via.q4 == Approx(1140.0).epsilon(0.02));
  CHECK(via.q5 == Approx(683.0).epsilon(0.02));
  CHECK(degrees_from_radians(via.deviation.total) == Approx(41.2).margin(0.3));
  CHECK(degrees_from_radians(via.deviation.lead) == Approx(29.9).margin(0.3));
  CHECK(degrees_from_radians(via.deviation.tilt) == Approx(39.2).margin(0.3));

  const Row cone = row(*study, unlimited(*study, Method::cone));
  CHECK(cone.q4 == Approx(757.0).epsilon(0.02));
  CHECK(cone.q5 == Approx(686.0).epsilon(0.02));
  CHECK(degrees_from_radians(cone.deviation.total) == Approx(17.8).epsilon(0.02));
  CHECK(degrees_from_radians(cone.deviation.lead) < 15.01);
  CHECK(degrees_from_radians(cone.deviation.tilt) < 10.01);

  Request tension = unlimited(*study, Method::via);
  tension.tension = 4e4;
  const Row tense = row(*study, tension);
  CHECK(tense.q4 == Approx(1735.0).epsilon(0.02));
  CHECK(degrees_from_radians(tense.deviation.total) == Approx(23.2).epsilon(0.02));

  const Row both = row(*study, unlimited(*study, Method::via_cone));
  CHECK(both.q4 == Approx(3108.0).epsilon(0.02));
  CHECK(both.q5 == Approx(2592.0).epsilon(0.02));
}

TEST_CASE("paper B study: largest constant feeds of Case 2", "[examples][paper]") {
  const auto study = shared_case(2);
  if (!study) return;
  CHECK(study->largest_feed(Method::via) * 0.06 == Approx(10.05).epsilon(0.01));
  CHECK(study->largest_feed(Method::cone) * 0.06 == Approx(11.5).epsilon(0.01));
}

TEST_CASE("paper B study: via points are enough in Case 1", "[examples][paper]") {
  const auto study = shared_case(1);
  if (!study) return;
  const Row via = row(*study, unlimited(*study, Method::via));
  CHECK(via.q4 <= 20.0);
  CHECK(degrees_from_radians(via.deviation.total) <= 0.6);
  CHECK(study->largest_feed(Method::via) * 0.06 >= 20.0);
}

TEST_CASE("paper B study: baselines of Case 2 are exact at via points", "[examples][paper]") {
  const Study study = own_case(2);
  for (const Method method : {Method::qi, Method::qi_c2}) {
    const auto axis = study.baseline_axis(method);
    for (const RotaryVia& via : study.via_points({}))
      CHECK(angle_between(axis(via.u), study.window(via.u).normal) < 1e-7);
  }
  // The slerp's rate steps: third differences of 4 ms grow with 1/dt² and are no property of the
  // path; the cubic spline's are far lower and its axis leaves the tolerance.
  const Motion qi = motion_of_baseline(study, Method::qi, {0.0, 250.0, nullptr, 0});
  const Motion smooth = motion_of_baseline(study, Method::qi_c2, {0.0, 250.0, nullptr, 0});
  CHECK(jerk_numbers(qi, 3).peak > 10.0 * jerk_numbers(smooth, 3).peak);
  CHECK(deviation(study, smooth).lead > study.path().lead);
}

TEST_CASE("paper B study: jerk in closed form equals third differences", "[examples][paper]") {
  const Study study = own_case(2);
  const RotaryResult r = study.rotaries(unlimited(study, Method::via));
  REQUIRE(r.status == RotaryStatus::optimal);
  const Motion m = motion_of_splines(study, r.q, {200.0, 250.0, nullptr, 4000});
  const double h = m.time[1] - m.time[0];
  for (std::size_t c = 3; c < 5; ++c)
    for (std::size_t i = 2; i + 2 < m.time.size(); i += 37) {
      const auto q = [&](std::size_t k) { return m.joints[k][c]; };
      const double difference =
          (q(i + 2) - 2.0 * q(i + 1) + 2.0 * q(i - 1) - q(i - 2)) / (2.0 * h * h * h);
      CHECK(m.jerk[i][c] == Approx(difference).epsilon(1e-2).margin(5.0));
    }
}

TEST_CASE("paper B study: in our own Case 2 the cone keeps lead and tilt", "[examples][paper]") {
  const Study study = own_case(2);
  CHECK(study.path().length() == Approx(627.5).margin(0.01));
  const Row via = row(study, unlimited(study, Method::via));
  const Row cone = row(study, unlimited(study, Method::cone));
  CHECK(degrees_from_radians(cone.deviation.lead) < 15.02);
  CHECK(degrees_from_radians(cone.deviation.tilt) < 10.02);
  CHECK(degrees_from_radians(via.deviation.total) > 20.0);
  CHECK(cone.q4 < via.q4);
  CHECK(study.largest_feed(Method::cone) > study.largest_feed(Method::via));
  for (const double arm : {0.0, 200.0}) {
    const Rms rms = linear_rms(study, arm, 160.0);
    CHECK(rms.optimised < 0.8 * rms.held);
  }
}

TEST_CASE("paper B study: in our own Case 1 the cone keeps lead and tilt", "[examples][paper]") {
  const Study study = own_case(1);
  CHECK(study.path().length() == Approx(1200.0).margin(0.01));
  const Row via = row(study, unlimited(study, Method::via));
  const Row cone = row(study, unlimited(study, Method::cone));
  CHECK(degrees_from_radians(via.deviation.total) < 0.6);
  CHECK(degrees_from_radians(cone.deviation.lead) < 5.01);
  CHECK(degrees_from_radians(cone.deviation.tilt) < 5.01);
  CHECK(cone.q4 < 0.1 * via.q4);
}
