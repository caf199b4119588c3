#include "kernels/collision/feasible_domain.h"

#include <ctime>

#include "tests/kernels/collision/scenes.h"

using namespace smoothpost;

namespace {

/// The shipped laser beside the workshop's wall and post.
struct Shop {
  Scene scene{
      test::laser_chain(),
      {test::nozzle_body(), test::casing_body(), test::part_body(test::workshop())},
      {{.first = 0, .second = 2, .clearance = 0.2}, {.first = 1, .second = 2, .clearance = 2.0}}};
  std::optional<RotaryPair> pair;
  DomainProblem problem;

  Shop() {
    // The pair holds W.
    ScrewChain chain = test::laser_chain();
    chain.joints[test::kW].redundant = true;
    pair = RotaryPair::from(chain);
    REQUIRE(pair.has_value());
    problem.pair = &*pair;
    problem.scene = &scene;
    problem.standoff = test::kW;
    problem.held = JointVector::Zero(6);
    problem.lower.resize(6);
    problem.upper.resize(6);
    problem.lower << -1600, -1400, -3000, -2 * kPi, -kPi / 2, -100;
    problem.upper << 1600, 1400, 3000, 2 * kPi, kPi / 2, 20;
    problem.standoffs = {-95, -77, -59, -41, -23, -5, 13};
  }
};

DomainPlace place_at(const Vec3& tip, double reach) {
  DomainPlace p;
  p.tip = tip;
  p.lead_low = -reach;
  p.lead_high = reach;
  p.tilt_low = -0.6 * reach;
  p.tilt_high = 0.6 * reach;
  return p;
}

std::vector<DomainPlace> places() {
  std::vector<DomainPlace> list;
  std::mt19937 random(77);
  for (int i = 0; i < 24; ++i)
    list.push_back(
        place_at({test::uniform(random, -140, 58), test::uniform(random, -80, 80), 1.0}, 0.4));
  list.push_back(place_at({-60, 0, 1}, 0.4));
  list.push_back(place_at({45, 0, 1}, 0.4));
  return list;
}

}  // namespace

TEST_CASE("feasible_domain: verdicts are those of every cell on its own", "[kernels][collision]") {
  NEEDS_TREE();
  Shop shop;
  shop.problem.gap = [](const DomainPlace& p, const Vec3& axis) {
    return axis.dot(p.normal) > std::cos(0.42);
  };
  shop.problem.upper[4] = 0.38;
  shop.problem.margin = 0.5;
  std::size_t count[5] = {}, queries = 0, cells = 0;
  for (const DomainPlace& place : places()) {
    const FeasibleDomain domain = feasible_domain(shop.problem, place);
    queries += domain.queries;
    for (std::size_t n = 0; n < domain.cells.size(); ++n) {
      const DomainCell& cell = domain.cells[n];
      const DomainIndex at = domain.index(n);
      REQUIRE(domain.flat(at) == n);
      ++count[static_cast<int>(cell.verdict)];
      ++cells;
      const auto q = domain_joints(shop.problem, place, at);
      REQUIRE(q.has_value());
      const CutterLocation tool = forward_location(test::laser_chain(), *q);
      REQUIRE((tool.tip - place.tip).norm() < 1e-9);
      const Vec3 axis =
          place.axis(lead_at(shop.problem, place, at.lead), tilt_at(shop.problem, place, at.tilt));
      REQUIRE((tool.axis - axis).norm() < 1e-9);
      REQUIRE((*q)[test::kW] == shop.problem.standoffs[static_cast<std::size_t>(at.standoff)]);
      const bool in_range = (*q)[4] >= -kPi / 2 && (*q)[4] <= 0.38;
      if (!in_range) {
        REQUIRE(cell.verdict == CellVerdict::out_of_range);
        REQUIRE(cell.culprit == 4);
      } else if (!(axis.z() > std::cos(0.42))) {
        REQUIRE(cell.verdict == CellVerdict::gap);
      } else {
        const Clearance c = shop.scene.clearance(*q, 50.0);
        if (cell.verdict == CellVerdict::free) {
          REQUIRE(c.margin >= 0.5);
          REQUIRE(c.margin >= 0.5 + std::min(cell.spare, 40.0) - 3e-3);
        } else {
          REQUIRE(cell.verdict == CellVerdict::collision);
          REQUIRE(c.margin <= 0.5 + 3e-3);
          const auto pair = static_cast<std::size_t>(cell.culprit);
          REQUIRE(shop.scene.margin(pair, shop.scene.poses(*q), 5.0).upper <= 0.5 + 3e-3);
        }
      }
    }
  }
  CHECK(count[0] > 2000);  // free
  CHECK(count[2] > 300);   // out of range
  CHECK(count[3] > 100);   // gap
  CHECK(count[4] > 3000);  // collision
  CHECK(queries < cells);  // of two pairs
}

TEST_CASE("feasible_domain: the same on any number of threads", "[kernels][collision]") {
  NEEDS_TREE();
  const Shop shop;
  const auto list = places();
  const auto one = feasible_domains(shop.problem, list, 1);
  for (const int threads : {2, 4}) {
    const auto more = feasible_domains(shop.problem, list, threads);
    REQUIRE(more.size() == one.size());
    for (std::size_t i = 0; i < one.size(); ++i) {
      CHECK(more[i].queries == one[i].queries);
      for (std::size_t n = 0; n < one[i].cells.size(); ++n) {
        REQUIRE(more[i].cells[n].verdict == one[i].cells[n].verdict);
        REQUIRE(more[i].cells[n].culprit == one[i].cells[n].culprit);
        REQUIRE(more[i].cells[n].spare == one[i].cells[n].spare);
      }
    }
  }
}

TEST_CASE("feasible_domain: without a scene and far away nothing is asked",
          "[kernels][collision]") {
  NEEDS_TREE();
  Shop shop;
  const DomainPlace away = place_at({-60, 0, 900}, 0.3);
  const FeasibleDomain far = feasible_domain(shop.problem, away);
  CHECK(far.free_cells() == far.cells.size());
  CHECK(far.queries == 4);  // two pairs, two branches
  shop.problem.scene = nullptr;
  CHECK(feasible_domain(shop.problem, place_at({-60, 0, 1}, 0.3)).free_cells() == far.cells.size());
  shop.problem.leads = shop.problem.tilts = 1;
  shop.problem.standoffs = {0.0};
  const FeasibleDomain one = feasible_domain(shop.problem, away);
  CHECK(one.cells.size() == 2);
  CHECK_THROWS_AS(
      [&] {
        DomainProblem bad = shop.problem;
        bad.standoffs.clear();
        return feasible_domain(bad, away);
      }(),
      ContractViolation);
}

TEST_CASE("feasible_domain: 819 cells in 10 ms", "[kernels][collision][slow]") {
  NEEDS_TREE();
  const Shop shop;
  std::vector<double> times;
  for (const DomainPlace& place : places()) {
    double best = 1e9;
    for (int round = 0; round < 5; ++round) {
      const std::clock_t start = std::clock();
      (void)feasible_domain(shop.problem, place);
      best = std::min(best, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    times.push_back(best);
  }
  std::sort(times.begin(), times.end());
  // Of 2 x 819 cells, in a build with assertions; a branch is half of it.
  WARN("a domain of 819 cells: median " << 500.0 * times[times.size() / 2] << " ms, largest "
                                        << 500.0 * times.back() << " ms");
  CHECK(0.5 * times[times.size() / 2] < 0.020);
}
