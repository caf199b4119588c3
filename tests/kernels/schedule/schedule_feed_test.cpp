#include <catch2/catch.hpp>

#include "kernels/schedule/feed_profile.h"
#include "tests/kernels/schedule/feed_paths.h"

namespace smoothpost {
namespace {

using test::from_rest_to_rest;
using test::kNone;
using test::LineLimits;

FeedResult run_line(double length, const LineLimits& l, int elements) {
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = l.a;
  limits.tip_jerk = l.j;
  FeedSettings settings;
  settings.least_elements = elements;
  settings.element_time = 1e3;
  return from_rest_to_rest(test::line(length, l.v), limits, settings);
}

/// No limit exceeded on a grid that the scheduler does not know.
void check_kept(const FeedPath& path, const FeedLimits& limits, const FeedResult& result) {
  REQUIRE(result.status == FeedStatus::solved);
  CHECK(result.load.largest() <= 1.0);
  CHECK(test::used_limits(path, limits, result.profile, 20011).largest() <= 1.0);
}

/// Checks the random paths of seeds from … to − 1: none refused, no limit exceeded.
void check_random_paths(unsigned from, unsigned to) {
  double worst = 0.0;
  for (unsigned seed = from; seed < to; ++seed) {
    const test::LimitedPath random = test::random_path(seed);
    const FeedResult result = from_rest_to_rest(random.path, random.limits);
    INFO("seed " << seed);
    CHECK(result.status == FeedStatus::solved);
    const double used =
        test::used_limits(random.path, random.limits, result.profile, 5003).largest();
    CHECK(used <= 1.0);
    CHECK(used > 0.95);
    worst = std::max(worst, used);
  }
  CHECK(worst > 0.9995);
}

}  // namespace

TEST_CASE("schedule_feed: lines within 1.002 of seven phases and never below",
          "[kernels][schedule]") {
  for (const LineLimits& l :
       {LineLimits{250, 8e3, 80e3}, LineLimits{250, 1e3, 1e6}, LineLimits{2e3, 8e3, 80e3},
        LineLimits{20, 8e3, 80e3}, LineLimits{500, 5e3, 50e3}})
    for (double length : {0.05, 0.1, 1.0, 10.0, 100.0, 1000.0}) {
      const FeedResult result = run_line(length, l, 400);
      REQUIRE(result.status == FeedStatus::solved);
      const double ratio = result.profile.duration() / test::seven_phases(length, l);
      INFO(length << " mm, " << l.v << " " << l.a << " " << l.j);
      CHECK(ratio >= 1.0);
      CHECK(ratio <= 1.002);
    }
}

TEST_CASE("schedule_feed: the analytic path of the reference", "[kernels][schedule]") {
  const FeedResult result = from_rest_to_rest(test::path6(), test::path6_limits());
  check_kept(test::path6(), test::path6_limits(), result);
  CHECK(result.profile.duration() >= 1.76342);
  CHECK(result.profile.duration() <= 1.7650);
  FeedSettings fine;
  fine.element_time = 0.00175;
  const double finer =
      from_rest_to_rest(test::path6(), test::path6_limits(), fine).profile.duration();
  CHECK(finer >= 1.76342);
  CHECK(finer <= 1.7637);
}

TEST_CASE("schedule_feed: units of length do not matter", "[kernels][schedule]") {
  // 65: an even number of elements on the second grid, for with an odd one a rounding decides which
  // half has one more.
  const double mm = run_line(1.0, {250, 8e3, 80e3}, 65).profile.duration();
  const double m = run_line(1e-3, {0.25, 8.0, 80.0}, 65).profile.duration();
  CHECK(m == Approx(mm).epsilon(1e-6));
}

TEST_CASE("schedule_feed: a circle runs at the speed of its curvature", "[kernels][schedule]") {
  // Two joints on a circle of radius R: |q''| = 1/R, |q'''| = 1/R² at unit speed, so that constant
  // speed v asks for v²/R and v³/R² of each joint in turn.
  constexpr double kRadius = 5.0;
  FeedPath path;
  path.breaks = {0.0, 40.0 * kRadius};
  path.feed = {kNone};
  path.jet = [](std::size_t, double s) {
    const double c = std::cos(s / kRadius), d = std::sin(s / kRadius);
    PathJet jet{test::joints({-d, c}), test::joints({-c / kRadius, -d / kRadius}),
                test::joints({d / (kRadius * kRadius), -c / (kRadius * kRadius)})};
    jet.tip_first = 1.0;
    return jet;
  };
  FeedLimits limits = test::no_limits(2);
  limits.acceleration.setConstant(2e3);
  limits.jerk.setConstant(1e6);
  limits.tip_acceleration = 10.0;  // holds the speed nearly constant over a turn
  limits.tip_jerk = 1e3;
  const FeedResult result = from_rest_to_rest(path, limits);
  check_kept(path, limits, result);
  // tangential 10 mm/s² over 200 mm: √(2·10·100) = 44.7 mm/s at most, below √(2e3·5) = 100
  const double best = test::seven_phases(40.0 * kRadius, {kNone, 10.0, 1e3});
  CHECK(result.profile.duration() >= best);
  CHECK(result.profile.duration() <= 1.003 * best);

  limits.tip_acceleration = kNone;
  limits.tip_jerk = kNone;
  const FeedResult fast = from_rest_to_rest(path, limits);
  check_kept(path, limits, fast);
  const FeedState middle = fast.profile.at(0.5 * fast.profile.duration());
  const double circle = std::min(std::sqrt(2e3 * kRadius), std::cbrt(1e6 * kRadius * kRadius));
  CHECK(middle.first == Approx(circle).epsilon(0.15));
}

TEST_CASE("schedule_feed: one joint alone", "[kernels][schedule]") {
  FeedPath path = test::line(30.0, kNone);
  FeedLimits limits{test::joints({90.0}), test::joints({700.0}), test::joints({9e3})};
  FeedSettings settings;
  settings.least_elements = 400;
  settings.element_time = 1e3;
  const FeedResult result = from_rest_to_rest(path, limits, settings);
  check_kept(path, limits, result);
  const double best = test::seven_phases(30.0, {90.0, 700.0, 9e3});
  CHECK(result.profile.duration() >= best);
  CHECK(result.profile.duration() <= 1.002 * best);
}

TEST_CASE("schedule_feed: a step of the feed", "[kernels][schedule]") {
  FeedPath path = test::line(300.0, 250.0);
  path.breaks = {0.0, 100.0, 200.0, 300.0};
  path.feed = {250.0, 50.0, 250.0};
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = 8e3;
  limits.tip_jerk = 80e3;
  FeedSettings settings;
  settings.element_time = 2.98 / 400;
  const FeedResult result = from_rest_to_rest(path, limits, settings);
  check_kept(path, limits, result);
  CHECK(result.profile.duration() >= 2.9795);
  CHECK(result.profile.duration() <= 2.9840);
  // below the law that has constant speed in the slow zone
  CHECK(result.profile.duration() < 2.9918);
}

TEST_CASE("schedule_feed: the rate of the parameter is a limit of its own", "[kernels][schedule]") {
  FeedPath path = test::line(100.0, 200.0);
  path.breaks = {0.0, 50.0, 100.0};
  path.feed = {200.0, 200.0};
  path.rate = {kNone, 20.0};
  const auto moving = path.jet;
  path.jet = [moving](std::size_t piece, double s) {
    PathJet jet = moving(piece, s);
    jet.turn_first = 0.01;
    return jet;
  };
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = 3e3;
  limits.tip_jerk = 5e4;
  const FeedResult result = from_rest_to_rest(path, limits);
  check_kept(path, limits, result);
  double fastest = 0.0;
  for (int i = 0; i <= 1000; ++i) {
    const FeedState at = result.profile.at(result.profile.time(50.0 + 0.05 * i));
    fastest = std::max(fastest, at.first);
  }
  CHECK(fastest <= 20.0 * (1.0 + 1e-9));
  CHECK(fastest > 19.9);
  limits.turn_rate = 0.5;  // 50 mm/s
  const FeedResult turning = from_rest_to_rest(path, limits);
  check_kept(path, limits, turning);
  CHECK(turning.profile.at(turning.profile.time(25.0)).first == Approx(50.0).epsilon(1e-3));
}

TEST_CASE("schedule_feed: 100 random paths keep every limit", "[kernels][schedule]") {
  check_random_paths(0, 100);
}

TEST_CASE("schedule_feed: 900 more random paths", "[kernels][schedule][.slow][slow]") {
  check_random_paths(100, 1000);
}

TEST_CASE("schedule_feed: looser limits are not slower", "[kernels][schedule]") {
  for (unsigned seed = 2000; seed < 2012; ++seed) {
    test::LimitedPath random = test::random_path(seed, 150.0);
    const double before = from_rest_to_rest(random.path, random.limits).profile.duration();
    const auto shorter = [&](const FeedLimits& limits) {
      INFO("seed " << seed);
      CHECK(from_rest_to_rest(random.path, limits).profile.duration() <= 1.001 * before);
    };
    FeedLimits looser = random.limits;
    looser.jerk *= 1.3;
    shorter(looser);
    looser = random.limits;
    looser.acceleration *= 1.3;
    looser.tip_acceleration *= 1.3;
    shorter(looser);
    looser = random.limits;
    looser.velocity *= 1.3;
    looser.turn_rate *= 1.3;
    shorter(looser);
  }
}

TEST_CASE("schedule_feed: turning in place between lines", "[kernels][schedule]") {
  // x runs, stands while the tool turns, runs again: x' falls to 0 and rises by C3 steps. Limits of
  // the tip and of the turn rate only.
  FeedPath path;
  path.breaks = {0.0, 20.0, 40.0, 60.0, 80.0, 100.0};
  path.feed.assign(5, 200.0);
  path.jet = [](std::size_t piece, double s) {
    const auto fade = [](double u) {  // 1 → 0, C3
      const double u4 = u * u * u * u;
      return std::array<double, 3>{1.0 - u4 * (35.0 + u * (-84.0 + u * (70.0 - 20.0 * u))),
                                   -140.0 * std::pow(u * (1.0 - u), 3),
                                   -420.0 * std::pow(u * (1.0 - u), 2) * (1.0 - 2.0 * u)};
    };
    std::array<double, 3> x{1.0, 0.0, 0.0};
    if (piece == 1) x = fade((s - 20.0) / 20.0);
    if (piece == 2) x = {0.0, 0.0, 0.0};
    if (piece == 3) {
      x = fade((80.0 - s) / 20.0);
      x[1] = -x[1];
    }
    PathJet jet{test::joints({x[0]}), test::joints({x[1] / 20.0}), test::joints({x[2] / 400.0})};
    jet.tip_first = x[0];
    jet.tip_second = x[1] / 20.0;
    jet.tip_third = x[2] / 400.0;
    jet.turn_first = (1.0 - x[0]) / 75.0;
    return jet;
  };
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = 3e3;
  limits.tip_jerk = 3e4;
  limits.turn_rate = 2.0;
  const FeedResult result = from_rest_to_rest(path, limits);
  check_kept(path, limits, result);
  CHECK(result.dilation < 1.005);
  // the limit of the turn rate is reached: 150 mm/s of s while the tip stands
  CHECK(result.profile.at(result.profile.time(50.0)).first == Approx(150.0).epsilon(1e-3));
}

TEST_CASE("schedule_feed: bindings are where a limit is met", "[kernels][schedule]") {
  const FeedPath path = test::path6();
  const FeedLimits limits = test::path6_limits();
  const FeedResult result = from_rest_to_rest(path, limits);
  REQUIRE(!result.bindings.empty());
  double before = 0.0;
  for (const FeedBinding& binding : result.bindings) {
    CHECK(binding.from >= before);
    CHECK(binding.to >= binding.from);
    before = binding.from;
    const double s = 0.5 * (binding.from + binding.to);
    const FeedState at = result.profile.at(result.profile.time(s));
    const PathJet jet = path.jet(0, at.s);
    if (binding.kind == FeedWitness::Kind::feed) CHECK(at.first * jet.tip_first / 250.0 >= 0.989);
    if (binding.kind == FeedWitness::Kind::jerk && binding.joint >= 0) {
      FeedLimits one = test::no_limits(6);
      one.jerk[binding.joint] = limits.jerk[binding.joint];
      test::Used used;
      test::use(used, jet, at, one);
      CHECK(used.jerk >= 0.97);
    }
  }
  const auto feed = std::find_if(result.bindings.begin(), result.bindings.end(), [](auto& b) {
    return b.kind == FeedWitness::Kind::feed && b.to - b.from > 200.0;
  });
  CHECK(feed != result.bindings.end());
}

TEST_CASE("schedule_feed: few evaluations of the path", "[kernels][schedule]") {
  FeedPath path = test::path6();
  std::size_t calls = 0;
  const auto jet = path.jet;
  path.jet = [&](std::size_t piece, double s) {
    ++calls;
    return jet(piece, s);
  };
  const FeedResult result = from_rest_to_rest(path, test::path6_limits());
  CHECK(calls < 10u * result.elements + 300u);
}

TEST_CASE("schedule_feed: the same bits twice", "[kernels][schedule]") {
  const FeedResult a = from_rest_to_rest(test::path6(), test::path6_limits());
  const FeedResult b = from_rest_to_rest(test::path6(), test::path6_limits());
  CHECK(a.profile.duration() == b.profile.duration());
  for (int i = 0; i <= 100; ++i) CHECK(a.profile.at(0.0176 * i).s == b.profile.at(0.0176 * i).s);
}

}  // namespace smoothpost
