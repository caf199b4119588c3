#include "kernels/optimise/placement.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

#include "kernels/core/contract.h"
#include "tests/kernels/kinematics/arms.h"
#include "tests/kernels/optimise/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

PlacementMeasure measure_of(const ScrewChain& chain, std::vector<PlacementPoint> points,
                            const JointVector& held) {
  PlacementTask task;
  task.points = std::move(points);
  task.spins = spins(12);
  task.held = held;
  return PlacementMeasure(*Inverse::from(chain), task);
}

PlacementSearch search_in(const ReachBox& box, const Vec3& start) {
  PlacementSearch search;
  search.lower = box.lower;
  search.upper = box.upper;
  search.start.translation() = start;
  search.global_evaluations = 600;
  search.local_evaluations = 120;
  search.candidates = 3;
  return search;
}

}  // namespace

TEST_CASE("placement: linear axes alone end in the middle of every range", "[kernels][optimise]") {
  const Vec3 lower(-100, 200, -900), upper(500, 1100, -200), size(120, 300, 40);
  auto points = contour(size, 0.0, 33);  // its sides are met at multiples of 8 points, but for Z
  for (auto& p : points) p.tip.z() = p.tip.x() * size.z() / size.x();
  const PlacementMeasure measure = measure_of(table(lower, upper), points, JointVector::Zero(5));
  PlacementSearch search;
  search.lower = lower - Vec3::Constant(300);
  search.upper = upper + Vec3::Constant(300);
  search.turn = 0.0;
  const PlacementResult result = place_path(measure, search, {});
  CHECK(result.before.least() < 0.0);
  const PlacementCandidate& best = result.best.front();
  for (int i = 0; i < 3; ++i) {
    INFO("axis " << i);
    CHECK(best.placement.translation()[i] == Approx(0.5 * (lower[i] + upper[i])).margin(0.2));
    CHECK(best.margins.joints[static_cast<std::size_t>(i)].value ==
          Approx(1.0 - size[i] / (upper[i] - lower[i])).margin(1e-3));
  }
}

TEST_CASE("placement: a path out of an arm's reach comes into it, as good as random places",
          "[kernels][optimise]") {
  const auto points = contour({500, 350, 80}, 0.35, 33);
  const PlacementMeasure measure = measure_of(kr60(), points, kr60_home());
  PlacementSearch search = search_in(reach_box(measure.inverse(), kr60_home()), {1500, 900, 700});
  search.global_evaluations = 1200;
  const PlacementResult result = place_path(measure, search, {});
  CHECK(result.before.least() < 0.0);
  CHECK(result.before.reach.value < 0.0);
  double random = -1e9;
  Dice dice(31);
  for (int n = 0; n < 3000; ++n) {
    Pose placement = Pose::Identity();
    placement.linear() = rotation_about(Vec3::UnitZ(), dice.between(-M_PI, M_PI));
    for (int i = 0; i < 3; ++i)
      placement.translation()[i] = dice.between(search.lower[i], search.upper[i]);
    random = std::max(random, measure.at(placement).least());
  }
  WARN("least margin " << result.best.front().margins.least() << " after " << result.evaluations
                       << " evaluations; best of 3000 random places " << random);
  CHECK(result.best.front().margins.least() > 0.2);
  CHECK(result.best.front().margins.least() >= random);
  // The same places of a path eight times as dense.
  const PlacementMeasure dense =
      measure_of(kr60(), contour({500, 350, 80}, 0.35, 257), kr60_home());
  for (const auto& candidate : result.best) {
    if (candidate.margins.least() < 0.1) continue;
    CHECK(dense.at(candidate.placement).least() > candidate.margins.least() - 0.05);
  }
}

TEST_CASE("placement: never below the start, inside the box, sorted", "[kernels][optimise]") {
  Dice dice(32);
  int good_starts = 0;
  for (int n = 0; n < 12; ++n) {
    ScrewChain chain = kr60();
    for (int j : {2, 3, 4, 5})
      chain.joints[static_cast<std::size_t>(j)].origin.x() += dice.between(-100, 300) / 1.0;
    const double shift = chain.joints[3].origin.x() - kr60().joints[3].origin.x();
    for (int j : {3, 4, 5})
      chain.joints[static_cast<std::size_t>(j)].origin.x() =
          kr60().joints[static_cast<std::size_t>(j)].origin.x() + shift;
    chain.tool_home.translation().x() += shift;
    const PlacementMeasure measure =
        measure_of(chain, contour({300, 200, 50}, 0.3, 17), kr60_home());
    PlacementSearch search;
    search.start = Pose::Identity();
    search.start.translation() = 300 * Vec3(dice.between(-1, 1), dice.between(-1, 1), 0.5);
    search.pivot = Vec3(dice.between(-50, 50), 20, 5);
    search.lower = search.start * search.pivot - Vec3(200, 100, 150);
    search.upper = search.start * search.pivot + Vec3(100, 200, 50);
    search.turn = dice.between(0.0, 1.0);
    search.global_evaluations = 40;
    search.local_evaluations = 20;
    search.candidates = 2;
    const PlacementResult result = place_path(measure, search, {});
    CHECK(result.before.least() == measure.at(search.start).least());
    CHECK(result.best.front().margins.least() >= result.before.least());
    if (result.before.least() > 0.0) ++good_starts;
    for (std::size_t i = 0; i < result.best.size(); ++i) {
      const auto& c = result.best[i];
      const Vec3 pivot = c.placement * search.pivot;
      CHECK((pivot.array() >= search.lower.array() - 1e-6).all());
      CHECK((pivot.array() <= search.upper.array() + 1e-6).all());
      const Vec3 turn = rotation_log(c.placement.linear() * search.start.linear().transpose());
      CHECK(turn.head<2>().norm() < 1e-9);
      CHECK(std::abs(turn.z()) <= search.turn + 1e-9);
      CHECK(c.margins.least() == measure.at(c.placement).least());
      if (i > 0) CHECK(c.margins.least() <= result.best[i - 1].margins.least());
    }
  }
  CHECK(good_starts >= 3);
}

TEST_CASE("placement: the same bytes every time", "[kernels][optimise]") {
  const PlacementMeasure measure =
      measure_of(kr60(), contour({300, 200, 50}, 0.3, 17), kr60_home());
  const PlacementSearch search =
      search_in(reach_box(measure.inverse(), kr60_home()), {1500, 900, 700});
  const PlacementResult a = place_path(measure, search, {}), b = place_path(measure, search, {});
  REQUIRE(a.best.size() == b.best.size());
  CHECK(a.evaluations == b.evaluations);
  for (std::size_t i = 0; i < a.best.size(); ++i)
    CHECK((a.best[i].placement.matrix().array() == b.best[i].placement.matrix().array()).all());
}

TEST_CASE("placement: fixed coordinates stay, and nothing to move is no search",
          "[kernels][optimise]") {
  const PlacementMeasure measure =
      measure_of(kr60(), contour({300, 200, 50}, 0.3, 17), kr60_home());
  PlacementSearch search = search_in({Vec3(-300, 40, 100), Vec3(300, 40, 100)}, {0, 0, 0});
  const PlacementResult result = place_path(measure, search, {});
  for (const auto& c : result.best) {
    CHECK(c.placement.translation().y() == 40.0);
    CHECK(c.placement.translation().z() == 100.0);
  }
  search.lower.x() = search.upper.x() = 10.0;
  search.turn = 0.0;
  const PlacementResult single = place_path(measure, search, {});
  REQUIRE(single.best.size() == 1);
  CHECK((single.best.front().placement.translation() - Vec3(10, 40, 100)).norm() == 0.0);
  CHECK(single.evaluations == 1);
}

TEST_CASE("placement: cancelling, exceptions and preconditions", "[kernels][optimise]") {
  const PlacementMeasure measure = measure_of(kr60(), contour({300, 200, 50}, 0.3, 9), kr60_home());
  PlacementSearch search = search_in(reach_box(measure.inverse(), kr60_home()), {0, 0, 0});
  int calls = 0;
  Progress stop{[&calls](const char*, double) { return ++calls < 10; }};
  const PlacementResult result = place_path(measure, search, stop);
  CHECK(result.cancelled);
  CHECK(result.evaluations < 20);
  CHECK(!result.best.empty());
  Progress fail{[](const char*, double) -> bool { throw std::runtime_error("from outside"); }};
  CHECK_THROWS_AS(place_path(measure, search, fail), std::runtime_error);
  search.turn = -1.0;
  CHECK_THROWS_AS(place_path(measure, search, {}), ContractViolation);
  search.turn = 1.0;
  search.candidates = 0;
  CHECK_THROWS_AS(place_path(measure, search, {}), ContractViolation);
  search.candidates = 1;
  search.vertical = Vec3(0, 0, 2);
  CHECK_THROWS_AS(place_path(measure, search, {}), ContractViolation);
  search.vertical = Vec3::UnitZ();
  search.lower = search.upper + Vec3::Ones();
  CHECK_THROWS_AS(place_path(measure, search, {}), ContractViolation);
}

TEST_CASE("placement: the reach box of a table holds its tips", "[kernels][optimise]") {
  const Vec3 lower(-100, 200, -900), upper(500, 1100, -200);
  const ReachBox box = reach_box(*Inverse::from(table(lower, upper)), JointVector::Zero(5));
  CHECK((box.lower - lower).norm() < 1e-9);
  CHECK((box.upper - upper).norm() < 1e-9);
  const Inverse arm = *Inverse::from(kr60());
  const ReachBox cube = reach_box(arm, kr60_home());
  const Vec3 tip = forward(kr60(), kr60_home()).translation();
  CHECK((tip.array() > cube.lower.array()).all());
  CHECK((tip.array() < cube.upper.array()).all());
}
