#include "kernels/schedule/feed_solver.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <optional>

#include "kernels/core/contract.h"
#include "kernels/schedule/band_cholesky.h"
#include "tests/kernels/schedule/feed_paths.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

std::optional<nlohmann::json> golden() {
  const auto file = test::shared_path("reference/schedule.json");
  if (!file) return std::nullopt;
  return nlohmann::json::parse(test::read_bytes(*file));
}

/// The stretch of the golden numbers: path6 under its map, in mm.
struct Golden {
  FeedPath path = test::path6();
  FeedStretch stretch{&path, FeedLanes::from(test::path6_limits()), 0.0, 400.0,
                      RestMap(400.0, {250.0, 8e3, 80e3}, {})};

  FeedGrid grid(const std::vector<double>& ends) const {
    std::vector<FeedElement> elements;
    for (std::size_t e = 0; e + 1 < ends.size(); ++e)
      elements.push_back(
          {ends[e], ends[e + 1], 0, stretch.map.zone(0.5 * (ends[e] + ends[e + 1]))});
    return feed_grid(stretch, std::move(elements), 5, false);
  }
  FeedProgram program(const FeedGrid& grid) const {
    FeedProgram result;
    result.grid = &grid;
    result.lanes = &stretch.lanes;
    result.factors.resize(grid.points());
    return result;
  }
};

}  // namespace

TEST_CASE("feed_solver: golden rows", "[kernels][schedule]") {
  const auto reference = golden();
  if (!reference) {
    WARN("no ../shared/reference/schedule.json: skipped");
    return;
  }
  const Golden golden;
  const auto& check = (*reference)["row_check"];
  for (int i = 0; i < 3; ++i) {
    FeedElement element;
    const double w = check["w"][i];
    element.zone = golden.stretch.map.zone(w);
    const FeedRow row = feed_row(golden.stretch, element, w);
    const FeedLanes& lanes = golden.stretch.lanes;
    for (int l = 0; l < 8; ++l) {
      const double q1 = row.q[l], q2 = row.q[8 + l], q3 = row.q[16 + l];
      const double ia = lanes.acceleration[l], ij = lanes.jerk[l];
      const double jerk[3] = {q3 * ij, 1.5 * q2 * ij, 0.5 * q1 * ij};
      const double acceleration[2] = {q2 * ia, 0.5 * q1 * ia};
      for (int k = 0; k < 3; ++k)
        CHECK(std::abs(jerk[k] - check["jerk_rows"][i][k][l].get<double>()) < 1e-12);
      for (int k = 0; k < 2; ++k)
        CHECK(std::abs(acceleration[k] - check["acc_rows"][i][k][l].get<double>()) < 1e-12);
    }
    CHECK(feed_cap(lanes, row) == Approx(check["ub"][i].get<double>()).epsilon(1e-12));
  }
}

TEST_CASE("feed_solver: golden coefficients", "[kernels][schedule]") {
  const auto reference = golden();
  if (!reference) {
    WARN("no ../shared/reference/schedule.json: skipped");
    return;
  }
  const Golden golden;
  const auto& check = (*reference)["ipm_check"];
  const FeedGrid grid = golden.grid(check["brk"].get<std::vector<double>>());
  const FeedProgram program = golden.program(grid);
  const double beta = constant_law(program);
  CHECK(beta == Approx(check["b_const"].get<double>()).epsilon(1e-12));
  const FeedSolution solution =
      solve_feed(program, std::vector<double>(grid.controls(), 0.5 * beta), {1e-9, 200});
  REQUIRE(solution.converged);
  CHECK(solution.feasible);
  CHECK(solution.time == Approx(check["T_quadrature"].get<double>()).epsilon(1e-10));
  for (std::size_t k = 0; k < solution.controls.size(); ++k)
    CHECK(std::abs(solution.controls[k] - check["coefficients"][k].get<double>()) < 1e-9);
  const FeedProgram::Factors ratios = point_ratios(program, solution.controls);
  CHECK(std::max({ratios.velocity, ratios.acceleration, ratios.jerk}) <= 1.0);
}

TEST_CASE("feed_solver: any start leads to one optimum", "[kernels][schedule]") {
  const Golden golden;
  std::vector<double> ends;
  for (int e = 0; e <= 40; ++e) ends.push_back(golden.stretch.map.extent() * e / 40);
  const FeedGrid grid = golden.grid(ends);
  const FeedProgram program = golden.program(grid);
  const double beta = constant_law(program);
  std::vector<double> times;
  for (double share : {0.9, 0.5, 0.2}) {
    const FeedSolution solution =
        solve_feed(program, std::vector<double>(grid.controls(), share * beta), {1e-8, 200});
    REQUIRE(solution.converged);
    times.push_back(solution.time);
  }
  for (double time : times) CHECK(time == Approx(times[0]).epsilon(1e-7));
}

TEST_CASE("feed_solver: fixed controls stay", "[kernels][schedule]") {
  const Golden golden;
  std::vector<double> ends;
  for (int e = 0; e <= 40; ++e) ends.push_back(golden.stretch.map.extent() * e / 40);
  const FeedGrid grid = golden.grid(ends);
  FeedProgram program = golden.program(grid);
  program.fixed_first = program.fixed_last = 2;
  const double start = 0.5 * constant_law(program);
  const FeedSolution solution =
      solve_feed(program, std::vector<double>(grid.controls(), start), {1e-8, 200});
  REQUIRE(solution.converged);
  for (int k : {0, 1, grid.controls() - 2, grid.controls() - 1})
    CHECK(solution.controls[k] == start);
  CHECK(solution.controls[5] > start);
}

TEST_CASE("feed_solver: preconditions", "[kernels][schedule]") {
  const Golden golden;
  const FeedGrid grid = golden.grid({0.0, 0.5, golden.stretch.map.extent()});
  const FeedProgram program = golden.program(grid);
  CHECK_THROWS_AS(solve_feed(program, {1.0, 1.0}, {}), ContractViolation);
  CHECK_THROWS_AS(solve_feed(program, std::vector<double>(grid.controls(), -1.0), {}),
                  ContractViolation);
}

TEST_CASE("band_cholesky: the solution of a random system", "[kernels][schedule]") {
  test::FeedRandom random(5);
  for (int n : {1, 2, 3, 4, 40}) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
    std::vector<BandRow> band(n, BandRow{});
    for (int i = 0; i < n; ++i)
      for (int d = 0; d < 4 && d <= i; ++d) {
        band[i][d] = d == 0 ? random.between(7.0, 9.0) : random.between(-1.0, 1.0);
        a(i, i - d) = a(i - d, i) = band[i][d];
      }
    Eigen::VectorXd b(n);
    for (double& value : b) value = random.between(-1.0, 1.0);
    std::vector<double> x(b.begin(), b.end());
    REQUIRE(factor_band(band));
    solve_band(band, x);
    CHECK((a * Eigen::Map<Eigen::VectorXd>(x.data(), n) - b).norm() < 1e-13);
  }
}

}  // namespace smoothpost
