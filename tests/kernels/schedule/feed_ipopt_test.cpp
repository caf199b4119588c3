#include <catch2/catch.hpp>

#include "kernels/schedule/feed_survey.h"
#include "kernels/schedule/stretch_solver.h"
#include "tests/kernels/schedule/feed_paths.h"
#include "tests/kernels/schedule/feed_transcription.h"

#ifdef SMOOTHPOST_WITH_IPOPT
#include "tests/kernels/schedule/feed_ipopt.h"
#endif

namespace smoothpost {
namespace {

using test::FeedTranscription;
using test::PlainMap;

/// A path from rest to rest with what the scheduler made of it.
struct Scheduled {
  test::LimitedPath given;
  FeedResult result;
  PlainMap map;
  std::vector<double> ends;      ///< w, of the scheduler's elements
  std::vector<double> controls;  ///< of its b(w), dilated

  double duration() const { return result.profile.duration(); }
  FeedTranscription transcription(const std::vector<double>& at) const {
    return {given.path, given.limits, map, at};
  }
};

/// Runs the scheduler, and its own steps for one stretch at rest once more to see the elements.
Scheduled schedule(test::LimitedPath given, double element_time) {
  Scheduled s;
  s.given = std::move(given);
  const FeedPath& path = s.given.path;
  FeedSettings settings;
  settings.element_time = element_time;
  s.result = test::from_rest_to_rest(path, s.given.limits, settings);
  REQUIRE(s.result.status == FeedStatus::solved);
  REQUIRE(path.breaks.front() == 0.0);
  const FeedSurvey found = survey(path, s.given.limits, settings.smooth_share);
  const RestGrading grade = grading(path, s.given.limits, found, {0.0, s.given.length()});
  const FeedStretch stretch{&path, FeedLanes::from(s.given.limits), 0.0, s.given.length(),
                            RestMap(s.given.length(), grade, {})};
  StretchSettings steps;
  steps.element_time = element_time;
  steps.least_elements = settings.least_elements;
  StretchLaw law = solve_resting(stretch, steps);
  dilate(law, law.dilation() * (1.0 + settings.margin));
  s.map = {s.given.length(), stretch.map.speed(), stretch.map.ramp()};
  for (const FeedElement& element : law.grid.elements) s.ends.push_back(element.begin);
  s.ends.push_back(law.grid.elements.back().end);
  s.controls = law.controls;
  return s;
}

test::LimitedPath line300() {
  FeedLimits limits = test::no_limits(1);
  limits.tip_acceleration = 8e3;
  limits.tip_jerk = 80e3;
  return {test::line(300.0, 250.0), limits};
}

test::LimitedPath analytic() { return {test::path6(), test::path6_limits()}; }

/// A random C3 path without limits of the tip but its feed: they fade where the tool turns in
/// place, which is not part of the definition above.
test::LimitedPath random_joints(unsigned seed, double length) {
  test::LimitedPath random = test::random_path(seed, length);
  random.limits.tip_acceleration = random.limits.tip_jerk = test::kNone;
  return random;
}

}  // namespace

TEST_CASE("feed_transcription: the scheduler's law keeps every row", "[kernels][schedule]") {
  for (const Scheduled& s : {schedule(line300(), 0.007), schedule(analytic(), 0.007),
                             schedule(random_joints(1, 60.0), 0.007)}) {
    const FeedTranscription problem = s.transcription(s.ends);
    CHECK(problem.worst(s.controls) <= 1.0);
    CHECK(problem.worst(s.controls) > 0.99);
    CHECK(problem.time(s.controls) == Approx(s.duration()).epsilon(1e-9));
    const auto constant = problem.constant_law();
    CHECK(problem.worst(constant) <= 1.0 + 1e-12);
    CHECK(problem.time(constant) > s.duration());
  }
}

TEST_CASE("feed_transcription: derivatives of the rows equal central differences",
          "[kernels][schedule]") {
  test::FeedRandom random(7);
  for (int n = 0; n < 100; ++n) {
    FeedTranscription::Row row;
    std::array<double, 3> v{random.between(0.5, 2.0), 0.0, 0.0};
    for (double& k : row.k) k = random.between(-1.0, 1.0);
    for (int i : {1, 2}) v[i] = random.between(-2.0, 2.0);
    row.jerk = n % 2 == 0;
    const auto gradient = row.gradient(v), bend = row.bend(v);
    const double h = 1e-5;
    for (int i = 0; i < 3; ++i) {
      auto less = v, more = v;
      less[i] -= h;
      more[i] += h;
      CHECK(std::abs((row.at(more) - row.at(less)) / (2.0 * h) - gradient[i]) < 1e-8);
      CHECK(std::abs((row.gradient(more)[0] - row.gradient(less)[0]) / (2.0 * h) - bend[i]) < 1e-8);
      for (int k : {1, 2})  // only b bends the rows
        if (i > 0) CHECK(std::abs(row.gradient(more)[k] - row.gradient(less)[k]) < 1e-12);
    }
  }
}

#ifdef SMOOTHPOST_WITH_IPOPT

namespace {

/// Elements of equal time of the scheduler's law, `count` about, with the breaks and the kinks.
std::vector<double> even_ends(const Scheduled& s, int count) {
  std::vector<double> must{0.0, s.map.ramp, s.map.extent() - s.map.ramp, s.map.extent()};
  for (std::size_t i = 1; i + 1 < s.given.path.breaks.size(); ++i)
    must.push_back(s.map.inverse(s.given.path.breaks[i]));
  std::sort(must.begin(), must.end());
  std::vector<double> ends = must;
  const double least = 0.1 * s.map.extent() / count;
  for (int i = 1; i < count; ++i) {
    const double w = s.map.inverse(s.result.profile.at(s.duration() * i / count).s);
    const auto next = std::lower_bound(must.begin(), must.end(), w);
    if (*next - w > least && w - *(next - 1) > least) ends.push_back(w);
  }
  std::sort(ends.begin(), ends.end());
  return ends;
}

/// The scheduler's law keeps all rows of the transcription on its own elements, so that no time can
/// be below the optimum there; and it may be 0.2 per cent above.
void compare_on_own_elements(const Scheduled& s) {
  const FeedTranscription problem = s.transcription(s.ends);
  std::vector<double> start = s.controls;
  for (double& b : start) b *= 0.9;
  const test::IpoptLaw best = test::solve_by_ipopt(problem, start, {1e-10, 1e-4});
  CAPTURE(problem.points.size(), best.iterations, best.seconds, best.time, s.duration());
  REQUIRE(best.solved);
  CHECK(problem.worst(best.controls) <= 1.0 + 1e-7);
  CHECK(s.duration() >= best.time * (1.0 - 1e-6));
  CHECK(s.duration() <= best.time * 1.002);
}

/// On elements of half the size that the scheduler does not know, from the constant law: what the
/// size of the scheduler's elements costs, and that no other optimum is found from afar.
/// @return the optimum
double compare_on_finer_elements(const Scheduled& s, double most) {
  const FeedTranscription problem =
      s.transcription(even_ends(s, 2 * static_cast<int>(s.ends.size())));
  std::vector<double> start = problem.constant_law();
  for (double& b : start) b *= 0.5;
  const test::IpoptLaw best = test::solve_by_ipopt(problem, start, {});
  CAPTURE(problem.points.size(), best.iterations, best.seconds, best.time, s.duration());
  REQUIRE(best.solved);
  CHECK(problem.worst(best.controls) <= 1.0 + 1e-7);
  CHECK(s.duration() >= best.time * (1.0 - 1e-6));
  CHECK(s.duration() <= best.time * most);
  return best.time;
}

}  // namespace

TEST_CASE("schedule_feed: Ipopt's optimum on the same elements", "[kernels][schedule]") {
  SECTION("line") { compare_on_own_elements(schedule(line300(), 0.007)); }
  SECTION("analytic path") { compare_on_own_elements(schedule(analytic(), 0.010)); }
  SECTION("random path") { compare_on_own_elements(schedule(random_joints(1, 80.0), 0.007)); }
}

TEST_CASE("schedule_feed: Ipopt's optimum on more and finer elements and from afar",
          "[kernels][schedule][.slow][slow]") {
  SECTION("analytic path") {
    const Scheduled s = schedule(analytic(), 0.007);
    compare_on_own_elements(s);
    compare_on_finer_elements(s, 1.002);
  }
  SECTION("line") { compare_on_finer_elements(schedule(line300(), 0.007), 1.002); }
  SECTION("random paths") {
    for (unsigned seed = 1; seed < 11; ++seed) {
      INFO("seed " << seed);
      const Scheduled s = schedule(random_joints(seed, 80.0), 0.007);
      compare_on_own_elements(s);
      // Knots every few milliseconds of motion: elements of 7 ms are too large for 0.2 per cent.
      const double best = compare_on_finer_elements(s, 1.01);
      CHECK(schedule(random_joints(seed, 80.0), 0.0035).duration() <= 1.003 * best);
    }
  }
}

#endif

}  // namespace smoothpost
