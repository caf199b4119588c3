#include "kernels/qp/ipopt_solver.h"

#include <array>
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace smoothpost {
namespace {

// Quintic, 25 control points, 20 unit spans; minimise ½∫(q''')² through five via points with
// q' = q'' = 0 at both ends, without and with |jerk control points| ≤ 0.22. From an active-set
// solution in exact arithmetic, computed apart from this project's code.
constexpr double kObjectiveEquations = 0.13253037819983485;
constexpr double kObjectiveLimited = 0.1330456620328299;
constexpr std::array<double, 25> kControlsLimited = {0.0,
                                                     0.0,
                                                     0.0,
                                                     0.022,
                                                     0.17832638864752476,
                                                     0.5298975530196066,
                                                     0.8890550172334538,
                                                     1.0718430048125465,
                                                     0.9622032960985001,
                                                     0.5957479827215217,
                                                     0.10559046168349631,
                                                     -0.33543705715935357,
                                                     -0.571010174793709,
                                                     -0.5182088450989243,
                                                     -0.2241254665834797,
                                                     0.18512140141636377,
                                                     0.5554267998441453,
                                                     0.7557161049752588,
                                                     0.7289716780273053,
                                                     0.5432552455588419,
                                                     0.32523231482666476,
                                                     0.2200030998220213,
                                                     0.2,
                                                     0.2,
                                                     0.2};

QuadraticProgram via_program(double jerk_limit) {
  QuadraticProgram qp = empty_program(spline_layout(clamped_knots(5, 20), 3, 1));
  add_derivative_cost(qp, 0, 3, 1.0);
  std::vector<NewRow> rows;
  const std::array<double, 5> via = {0.0, 1.0, -0.5, 0.7, 0.2};
  for (int k = 0; k < 5; ++k) {
    const double u = 5.0 * k;
    rows.push_back({local_row(qp.layout, 0, u, 0), via[k], via[k], "via point", u});
  }
  for (const double u : {0.0, 20.0}) {
    for (const int order : {1, 2}) {
      rows.push_back({local_row(qp.layout, 0, u, order), 0.0, 0.0, "end", u});
    }
  }
  set_rows(qp, rows);
  if (jerk_limit > 0.0) limit_level(qp, 0, 3, jerk_limit);
  return qp;
}

QpSettings precise() {
  QpSettings settings;
  settings.solver = QpSolver::ipopt;
  settings.tolerance = 1e-11;
  return settings;
}

bool equal_bytes(const QpSolution& a, const QpSolution& b) {
  return a.x.size() == b.x.size() &&
         std::memcmp(a.x.data(), b.x.data(), sizeof(double) * a.x.size()) == 0;
}

/// The working directory changed for one test.
class WorkingDirectory {
 public:
  explicit WorkingDirectory(const std::filesystem::path& path)
      : before_(std::filesystem::current_path()) {
    std::filesystem::create_directories(path);
    std::filesystem::current_path(path);
  }
  ~WorkingDirectory() { std::filesystem::current_path(before_); }
  WorkingDirectory(const WorkingDirectory&) = delete;
  WorkingDirectory& operator=(const WorkingDirectory&) = delete;

 private:
  std::filesystem::path before_;
};

}  // namespace

TEST_CASE("ipopt_solver: says when it is not there", "[kernels][qp]") {
  if (ipopt_available()) return;
  const QpSolution solution = solve_by_ipopt(via_program(0.22), precise());
  CHECK(solution.status == QpStatus::failed);
  CHECK(solution.message.find("SMOOTHPOST_WITH_IPOPT") != std::string::npos);
}

TEST_CASE("ipopt_solver: golden programme of equations", "[kernels][qp][paper]") {
  if (!ipopt_available()) return;
  const QpSolution solution = solve_by_ipopt(via_program(0.0), precise());
  CHECK(solution.status == QpStatus::optimal);
  CHECK(solution.objective == Approx(kObjectiveEquations).epsilon(1e-12));
  CHECK(solution.certificate.kkt() < 1e-11);
  CHECK(solution.message.empty());
}

TEST_CASE("ipopt_solver: golden programme with a limit", "[kernels][qp][paper]") {
  if (!ipopt_available()) return;
  const QuadraticProgram qp = via_program(0.22);
  const QpSolution solution = solve_by_ipopt(qp, precise());
  CHECK(solution.status == QpStatus::optimal);
  CHECK(solution.solver == QpSolver::ipopt);
  CHECK(solution.objective == Approx(kObjectiveLimited).epsilon(1e-8));
  CHECK(solution.certificate.kkt() < 1e-9);
  CHECK(solution.iterations <= 20);
  for (int j = 0; j < 25; ++j) CHECK(std::abs(solution.x(j) - kControlsLimited[j]) < 1e-6);
  // Only the first jerk control point is at its limit, from below.
  for (int j = 0; j < qp.layout.count(3); ++j) {
    const int at = qp.layout.index(0, 3, j);
    CHECK((solution.bound_upper(at) > 1e-6) == (j == 0));
    CHECK(solution.bound_lower(at) < 1e-6);
  }
}

TEST_CASE("ipopt_solver: a second run gives equal bytes", "[kernels][qp]") {
  if (!ipopt_available()) return;
  const QuadraticProgram qp = via_program(0.22);
  CHECK(equal_bytes(solve_by_ipopt(qp, precise()), solve_by_ipopt(qp, precise())));
}

TEST_CASE("ipopt_solver: contradictory rows end with a status", "[kernels][qp]") {
  if (!ipopt_available()) return;
  QuadraticProgram qp = via_program(0.22);
  std::vector<NewRow> rows = {{local_row(qp.layout, 0, 7.5, 0), 1.0, 2.0, "above", 7.5},
                              {local_row(qp.layout, 0, 7.5, 0), -2.0, -1.0, "below", 7.5}};
  set_rows(qp, rows);
  QpSettings settings = precise();
  settings.max_iterations = 40;
  const QpSolution solution = solve_by_ipopt(qp, settings);
  CHECK(solution.status != QpStatus::optimal);
  CHECK(solution.iterations <= 40);
  CHECK(solution.message.rfind("Ipopt: ", 0) == 0);
  CHECK(solution.certificate.kkt() > 1e-3);
  CHECK(solution.x.size() == qp.layout.size());
}

TEST_CASE("ipopt_solver: stops at the limit of iterations", "[kernels][qp]") {
  if (!ipopt_available()) return;
  QpSettings settings = precise();
  settings.max_iterations = 2;
  const QpSolution solution = solve_by_ipopt(via_program(0.22), settings);
  CHECK(solution.status == QpStatus::iteration_limit);
  CHECK(solution.iterations == 2);
  CHECK(solution.message == "Ipopt: Maximum_Iterations_Exceeded");
}

TEST_CASE("ipopt_solver: least tau of a relaxation", "[kernels][qp]") {
  if (!ipopt_available()) return;
  // Rows of 10.5 ± 0.5 above 1 and below −1 at one place: half of the gap is least.
  QuadraticProgram qp = via_program(0.0);
  qp.hessian *= 1e-9;
  set_rows(qp, {{local_row(qp.layout, 0, 7.5, 0), 1.0, 2.0, "above", 7.5},
                {local_row(qp.layout, 0, 7.5, 0), -2.0, -1.0, "below", 7.5}});
  limit_level(qp, 0, 0, 3.0);
  qp.relaxation = Relaxation{Eigen::VectorXd::Zero(qp.layout.size()), Eigen::Vector2d(1.0, 1.0)};
  QpSettings settings = precise();
  settings.tolerance = 1e-9;
  const QpSolution solution = solve_by_ipopt(qp, settings);
  CHECK(solution.status == QpStatus::optimal);
  CHECK(solution.tau == Approx(1.0).margin(1e-7));
  CHECK(solution.row_lower(0) == Approx(0.5).margin(1e-6));
  CHECK(solution.row_upper(1) == Approx(0.5).margin(1e-6));
}

TEST_CASE("ipopt_solver: bounds that give way are rows with the bounds' multipliers",
          "[kernels][qp]") {
  if (!ipopt_available()) return;
  // With every jerk bound at 0.2 relaxed by 0.02·τ and τ almost free, τ = 1 is the limit 0.22.
  QuadraticProgram qp = via_program(0.2);
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(qp.layout.size());
  for (int j = 0; j < qp.layout.count(3); ++j) weight(qp.layout.index(0, 3, j)) = 0.02;
  qp.relaxation = Relaxation{weight, Eigen::VectorXd::Zero(qp.row_count()), 0.0, 0.0};
  const QpSolution free = solve_by_ipopt(qp, precise());
  CHECK(free.status == QpStatus::optimal);
  CHECK(free.objective == Approx(kObjectiveEquations).epsilon(1e-8));
  // The price that makes τ = 1 best is the weight times the multiplier of the golden solution.
  const QpSolution golden = solve_by_ipopt(via_program(0.22), precise());
  const double multiplier = golden.bound_upper(qp.layout.index(0, 3, 0));
  qp.relaxation->cost = 0.02 * multiplier;
  const QpSolution priced = solve_by_ipopt(qp, precise());
  CHECK(priced.status == QpStatus::optimal);
  CHECK(priced.tau == Approx(1.0).epsilon(1e-4));
  CHECK(priced.bound_upper(qp.layout.index(0, 3, 0)) == Approx(multiplier).epsilon(1e-6));
}

TEST_CASE("ipopt_solver: a start at the solution saves iterations", "[kernels][qp]") {
  if (!ipopt_available()) return;
  const QuadraticProgram qp = via_program(0.22);
  const QpSolution cold = solve_by_ipopt(qp, precise());
  QpSettings settings = precise();
  settings.start = &cold;
  const QpSolution warm = solve_by_ipopt(qp, settings);
  CHECK(warm.status == QpStatus::optimal);
  CHECK(warm.iterations < cold.iterations);
  CHECK(warm.objective == Approx(cold.objective).epsilon(1e-9));
}

TEST_CASE("ipopt_solver: an option file in the working directory changes nothing",
          "[kernels][qp]") {
  if (!ipopt_available()) return;
  const QuadraticProgram qp = via_program(0.22);
  const QpSolution without = solve_by_ipopt(qp, precise());
  const std::filesystem::path folder =
      std::filesystem::path(SMOOTHPOST_BINARY_DIR) / "ipopt_solver_test";
  std::filesystem::remove_all(folder);
  {
    const WorkingDirectory here(folder);
    std::ofstream("ipopt.opt") << "max_iter 1\noutput_file printed.txt\nfile_print_level 5\n";
    CHECK(equal_bytes(solve_by_ipopt(qp, precise()), without));
    CHECK_FALSE(std::filesystem::exists("printed.txt"));
  }
  std::filesystem::remove_all(folder);
}

}  // namespace smoothpost
