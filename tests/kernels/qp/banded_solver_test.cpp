#include "kernels/qp/banded_solver.h"

#include <catch2/catch.hpp>
#include <cstring>
#include <sstream>

#include "kernels/core/contract.h"
#include "kernels/qp/ipopt_solver.h"
#include "tests/kernels/qp/random_programmes.h"

namespace smoothpost {
namespace {

using test::golden_programme;
using test::known_programme;
using test::KnownProgramme;
using test::ProgrammeRandom;
using test::ProgrammeSize;
using test::via_programme;
using test::with_shares;

// qp_eq and qp_ineq of paper_b.json: active-set solutions in exact arithmetic.
constexpr double kObjectiveEquations = 0.13253037819983485;
constexpr double kObjectiveLimited = 0.1330456620328299;
constexpr double kControlsEquations[] = {0.0,
                                         0.0,
                                         0.0,
                                         0.029416350123864576,
                                         0.18834900082576383,
                                         0.5417974731626755,
                                         0.895367828241123,
                                         1.0714793889347647,
                                         0.9566370272502065,
                                         0.5884366143682906,
                                         0.0995296779521057,
                                         -0.3384119405450041,
                                         -0.5707314285714286,
                                         -0.5158223451692816,
                                         -0.2211639636663914,
                                         0.1874090999174236,
                                         0.5564372584640793,
                                         0.7555663253509496,
                                         0.7282778860445912,
                                         0.5426196696944674,
                                         0.32495385631709334,
                                         0.21995507844756398,
                                         0.2,
                                         0.2,
                                         0.2};

std::string told(const QpSolution& s) {
  std::ostringstream out;
  out << to_string(s.status) << " after " << s.iterations << ", objective " << s.objective
      << ", stationarity " << s.certificate.stationarity << ", violation "
      << s.certificate.violation << ", complementarity " << s.certificate.complementarity
      << ", sign " << s.certificate.sign << " " << s.message;
  return out.str();
}

bool equal_bytes(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), sizeof(double) * a.size()) == 0;
}

/// Sizes and kinds by turns.
ProgrammeSize size_of(int n, int most_spans, ProgrammeRandom& random) {
  return {n % 2 == 0 ? 5 : 3, 12 + random.below(most_spans - 12), 1 + (n / 2) % 3};
}

double largest_violation(const QuadraticProgram& qp, const Eigen::VectorXd& x) {
  double worst = 0.0;
  for (Eigen::Index k = 0; k < x.size(); ++k)
    worst = std::max({worst, qp.lower[k] - x[k], x[k] - qp.upper[k]});
  const Eigen::VectorXd value = row_values(qp, x);
  for (Eigen::Index r = 0; r < value.size(); ++r)
    worst = std::max({worst, qp.row_lower[r] - value[r], value[r] - qp.row_upper[r]});
  const Eigen::VectorXd lifted = lift(qp.layout, controls_of(qp.layout, x));
  return std::max(worst, (lifted - x).cwiseAbs().maxCoeff() * 1e-3);
}

/// Every programme's certificate, and that the optimum is feasible and no worse than the point
/// known to be inside. Returns how many rows are active.
int check_random_programmes(unsigned seed, int count, int most_spans) {
  ProgrammeRandom random(seed);
  int active = 0;
  for (int n = 0; n < count; ++n) {
    const ProgrammeSize size = size_of(n, most_spans, random);
    const KnownProgramme known = known_programme(size, random, n % 3 == 0 ? 0.02 : 0.2);
    REQUIRE(largest_violation(known.qp, known.inside) < 1e-9);
    const QpSolution s = solve_by_banded(known.qp, {});
    INFO(n << " degree " << size.degree << " spans " << size.spans << " channels " << size.channels
           << ": " << told(s));
    CHECK(s.status == QpStatus::optimal);
    CHECK(s.certificate.kkt() <= 1e-8);
    CHECK(certify(known.qp, s).kkt() == s.certificate.kkt());
    CHECK(largest_violation(known.qp, s.x) < 1e-8);
    CHECK(s.objective == Approx(objective_value(known.qp, s.x)).epsilon(1e-12));
    CHECK(s.objective <= objective_value(known.qp, known.inside));
    CHECK(s.iterations <= 40);
    for (Eigen::Index r = 0; r < s.row_lower.size(); ++r)
      if (known.qp.row_lower[r] < known.qp.row_upper[r])
        active += s.row_lower[r] + s.row_upper[r] > 1e-5 ? 1 : 0;
  }
  return active;
}

/// Twelve via points 1 s apart with limits of `shares` of what the equations alone need on
/// velocity, acceleration and jerk, and positions within max(101, 0.97 of the largest).
QuadraticProgram timed_programme(int controls, const std::array<double, 3>& shares) {
  ProgrammeRandom random(1);
  const int spans = controls - 5;
  std::vector<std::pair<double, double>> via;
  for (int i = 0; i < 12; ++i) via.emplace_back(spans * i / 11.0, random.between(-100.0, 100.0));
  const double h = 11.0 / spans;
  const Eigen::Vector4d first(100.0, 100.0 * h, 100.0 * h * h, 100.0 * h * h * h);
  const auto priced = [spans](QuadraticProgram qp, double jerk) {
    qp.hessian /= jerk * jerk * spans;
    return qp;
  };
  const QuadraticProgram free = priced(via_programme(spans, via, first), first[3]);
  const QpSolution s = solve_by_banded(free, {});
  REQUIRE(s.status == QpStatus::optimal);
  const Eigen::VectorXd theta = controls_of(free.layout, s.x).row(0);
  Eigen::Vector4d scale(std::max(101.0, 0.97 * theta.cwiseAbs().maxCoeff()), 0.0, 0.0, 0.0);
  for (int level = 1; level <= 3; ++level)
    scale[level] = shares[static_cast<std::size_t>(level - 1)] *
                   derivative_controls(free.layout.knots, theta, level).cwiseAbs().maxCoeff();
  QuadraticProgram qp = priced(via_programme(spans, via, scale), scale[3]);
  for (int level = 0; level <= 3; ++level) limit_level(qp, 0, level, scale[level]);
  return qp;
}

}  // namespace

TEST_CASE("banded_solver: golden programme of equations", "[kernels][qp][paper]") {
  const QuadraticProgram qp = golden_programme();
  const QpSolution s = solve_by_banded(qp, {});
  INFO(told(s));
  REQUIRE(s.status == QpStatus::optimal);
  CHECK(s.solver == QpSolver::banded);
  CHECK(s.objective == Approx(kObjectiveEquations).epsilon(1e-9).margin(0.0));
  for (int j = 0; j < 25; ++j) CHECK(std::abs(s.x[j] - kControlsEquations[j]) < 1e-9);
}

TEST_CASE("banded_solver: golden programme with a limit", "[kernels][qp][paper]") {
  QuadraticProgram qp = golden_programme();
  limit_level(qp, 0, 3, 0.22);
  const QpSolution s = solve_by_banded(qp, {});
  INFO(told(s));
  REQUIRE(s.status == QpStatus::optimal);
  CHECK(s.objective == Approx(kObjectiveLimited).epsilon(1e-9).margin(0.0));
  for (int j = 0; j < qp.layout.count(3); ++j) {
    const int at = qp.layout.index(0, 3, j);
    CHECK((s.bound_upper[at] > 1e-6) == (j == 0));
    CHECK(s.bound_lower[at] < 1e-6);
  }
}

TEST_CASE("banded_solver: random feasible programmes", "[kernels][qp]") {
  CHECK(check_random_programmes(11, 60, 100) > 60);  // rows are active, or they did not matter
}

TEST_CASE("banded_solver: 1400 random feasible programmes", "[.slow][slow][kernels][qp]") {
  CHECK(check_random_programmes(101, 450, 150) > 450);
  CHECK(check_random_programmes(102, 450, 150) > 450);
  CHECK(check_random_programmes(104, 450, 150) > 450);
  CHECK(check_random_programmes(103, 50, 800) > 50);
}

TEST_CASE("banded_solver: both solvers agree", "[kernels][qp]") {
  if (!ipopt_available()) return;
  ProgrammeRandom random(12);
  int feasible = 0, infeasible = 0;
  for (int n = 0; n < 24; ++n) {
    const ProgrammeSize size = size_of(n, 145, random);
    const KnownProgramme known = known_programme(size, random, n % 3 == 0 ? 0.02 : 0.2);
    const QuadraticProgram qp = n % 4 == 3 ? with_shares(known.qp, random, 0.4) : known.qp;
    const QpFeasibility answer = feasibility(qp);
    const QpSolution mine = solve_by_banded(qp, {});
    QpSettings settings;
    settings.solver = QpSolver::ipopt;
    const QpSolution theirs = solve_by_ipopt(qp, settings);
    INFO(n << " degree " << size.degree << " spans " << size.spans << " channels " << size.channels
           << " shortfall " << answer.shortfall << " of " << answer.name << "\n"
           << told(mine) << "\n"
           << told(theirs));
    if (n % 4 != 3) CHECK(answer.feasible);
    if (!answer.feasible) {
      ++infeasible;
      CHECK(answer.shortfall > 0.0);
      CHECK(mine.status != QpStatus::optimal);
      CHECK(theirs.status != QpStatus::optimal);
      continue;
    }
    ++feasible;
    REQUIRE(theirs.status == QpStatus::optimal);
    REQUIRE(mine.status == QpStatus::optimal);
    CHECK(std::abs(mine.objective - theirs.objective) <= 1e-7 * (1.0 + std::abs(theirs.objective)));
    CHECK(largest_violation(qp, mine.x) <= 1e-8);
    CHECK(largest_violation(qp, theirs.x) <= 1e-8);
  }
  CHECK(feasible >= 18);
  CHECK(infeasible >= 3);
}

TEST_CASE("banded_solver: a start nearby gives the same optimum sooner", "[kernels][qp]") {
  ProgrammeRandom random(15);
  int cold = 0, warm = 0;
  for (int n = 0; n < 24; ++n) {
    const KnownProgramme known = known_programme(size_of(n, 80, random), random);
    const QpSolution before = solve_by_banded(known.qp, {});
    // ranges a little wider and turned a little about the point that is known to be inside
    QuadraticProgram qp = known.qp;
    for (int r = 0; r < qp.row_count(); ++r) {
      if (qp.row_lower[r] == qp.row_upper[r]) continue;
      const double turn = 1.0 + 1e-3 * random.between(-1.0, 1.0);
      qp.rows.col(r) *= turn;
      qp.row_lower[r] = turn * qp.row_lower[r] - 1e-4 * random.between(0.0, 1.0);
      qp.row_upper[r] = turn * qp.row_upper[r] + 1e-4 * random.between(0.0, 1.0);
    }
    QpSettings settings;
    const QpSolution without = solve_by_banded(qp, settings);
    settings.start = &before;
    const QpSolution with = solve_by_banded(qp, settings);
    INFO(n << ": " << told(without) << "\n" << told(with));
    REQUIRE(without.status == QpStatus::optimal);
    REQUIRE(with.status == QpStatus::optimal);
    CHECK(std::abs(with.objective - without.objective) <=
          1e-8 * (1.0 + std::abs(without.objective)));
    cold += without.iterations;
    warm += with.iterations;
  }
  CHECK(warm < 0.7 * cold);
}

TEST_CASE("banded_solver: a start far away gives the same optimum", "[kernels][qp]") {
  ProgrammeRandom random(16);
  for (int n = 0; n < 12; ++n) {
    const KnownProgramme known = known_programme(size_of(n, 60, random), random);
    const QpSolution without = solve_by_banded(known.qp, {});
    QpSolution far = without;
    far.x *= -1.0;
    std::swap(far.row_lower, far.row_upper);
    QpSettings settings;
    settings.start = &far;
    const QpSolution with = solve_by_banded(known.qp, settings);
    INFO(n << ": " << told(without) << "\n" << told(with));
    REQUIRE(with.status == QpStatus::optimal);
    CHECK(std::abs(with.objective - without.objective) <=
          1e-8 * (1.0 + std::abs(without.objective)));
  }
}

TEST_CASE("banded_solver: infeasible programmes end quickly", "[kernels][qp]") {
  ProgrammeRandom random(13);
  for (int n = 0; n < 24; ++n) {
    const ProgrammeSize size = size_of(n, 80, random);
    KnownProgramme known = known_programme(size, random);
    // a row above what every control point allows
    const double u = 0.5 * known.qp.layout.knots.last();
    known.qp.row_lower[known.qp.row_count() / 2] = 50.0;
    known.qp.row_upper[known.qp.row_count() / 2] = 60.0;
    const QpSolution s = solve_by_banded(known.qp, {});
    INFO(n << " at " << u << ": " << told(s));
    CHECK(s.status != QpStatus::optimal);
    CHECK(s.iterations <= QpSettings().max_iterations);
    CHECK(s.certificate.kkt() > 1e-3);
    CHECK(s.x.size() == known.qp.layout.size());
    CHECK_FALSE(feasibility(known.qp).feasible);
  }
}

TEST_CASE("banded_solver: a relaxation's least tau", "[kernels][qp]") {
  // Ranges 1 … 2 and −2 … −1 at one place: half of the gap is least, shared by both rows.
  QuadraticProgram qp = golden_programme();
  qp.hessian *= 1e-9;
  set_rows(qp, {{local_row(qp.layout, 0, 7.5, 0), 1.0, 2.0, "above", 7.5},
                {local_row(qp.layout, 0, 7.5, 0), -2.0, -1.0, "below", 7.5}});
  limit_level(qp, 0, 0, 3.0);
  qp.relaxation = Relaxation{Eigen::VectorXd::Zero(qp.layout.size()), Eigen::Vector2d(1.0, 1.0)};
  const QpSolution s = solve_by_banded(qp, {});
  INFO(told(s));
  REQUIRE(s.status == QpStatus::optimal);
  CHECK(s.tau == Approx(1.0).margin(1e-7));
  CHECK(s.row_lower[0] == Approx(0.5).margin(1e-6));
  CHECK(s.row_upper[1] == Approx(0.5).margin(1e-6));
}

TEST_CASE("banded_solver: a second run gives equal bytes", "[kernels][qp]") {
  ProgrammeRandom random(14);
  for (int n = 0; n < 6; ++n) {
    const KnownProgramme known = known_programme(size_of(n, 60, random), random);
    const QpSolution a = solve_by_banded(known.qp, {});
    const QpSolution b = solve_by_banded(known.qp, {});
    CHECK(equal_bytes(a.x, b.x));
    CHECK(equal_bytes(a.bound_lower, b.bound_lower));
    CHECK(equal_bytes(a.row_upper, b.row_upper));
    CHECK(a.iterations == b.iterations);
    CHECK(a.objective == b.objective);
  }
}

TEST_CASE("banded_solver: a limit of iterations", "[kernels][qp]") {
  QuadraticProgram qp = golden_programme();
  limit_level(qp, 0, 3, 0.22);
  QpSettings settings;
  settings.max_iterations = 2;
  const QpSolution s = solve_by_banded(qp, settings);
  CHECK(s.status == QpStatus::iteration_limit);
  CHECK(s.iterations == 2);
}

TEST_CASE("banded_solver: twelve via points with tight limits", "[kernels][qp]") {
  for (const int controls : {100, 628, 5000}) {
    const QuadraticProgram qp = timed_programme(controls, {0.96, 0.93, 0.92});
    const QpFeasibility answer = feasibility(qp);
    const QpSolution s = solve_by_banded(qp, {});
    INFO(controls << " shortfall " << answer.shortfall << ": " << told(s));
    CHECK(answer.feasible);
    REQUIRE(s.status == QpStatus::optimal);
    CHECK(s.certificate.kkt() <= 1e-8);
    CHECK(s.iterations <= 30);
    int active = 0;
    for (int level = 0; level <= 3; ++level)
      for (int j = 0; j < qp.layout.count(level); ++j) {
        const int k = qp.layout.index(0, level, j);
        active += qp.lower[k] < qp.upper[k] && 1.0 - std::abs(s.x[k]) < 1e-6 ? 1 : 0;
      }
    CHECK(active >= 4);
    if (controls != 628 || !ipopt_available()) continue;
    QpSettings settings;
    settings.solver = QpSolver::ipopt;
    const QpSolution theirs = solve_by_ipopt(qp, settings);
    INFO(told(theirs));
    REQUIRE(theirs.status == QpStatus::optimal);
    CHECK(s.objective == Approx(theirs.objective).epsilon(1e-7).margin(0.0));
  }
}

TEST_CASE("banded_solver: layouts that it does not take", "[kernels][qp]") {
  QuadraticProgram four = empty_program(spline_layout(clamped_knots(5, 6), 3, 4));
  CHECK_THROWS_AS(solve_by_banded(four, {}), ContractViolation);
  QuadraticProgram quartic = empty_program(spline_layout(clamped_knots(4, 6), 3, 1));
  CHECK_THROWS_AS(solve_by_banded(quartic, {}), ContractViolation);
}

}  // namespace smoothpost
