#include "kernels/qp/hybrid_solver.h"

#include <catch2/catch.hpp>
#include <cstring>
#include <sstream>

#include "kernels/core/units.h"
#include "kernels/qp/banded_solver.h"
#include "kernels/qp/ipopt_solver.h"
#include "tests/kernels/qp/random_programmes.h"

namespace smoothpost {
namespace {

using test::known_programme;
using test::KnownProgramme;
using test::ProgrammeRandom;

QpSettings by_ipopt() {
  QpSettings settings;
  settings.solver = QpSolver::ipopt;
  return settings;
}

std::string told(const QpSolution& s) {
  std::ostringstream out;
  out << to_string(s.status) << " after " << s.iterations << ", objective " << s.objective
      << ", kkt " << s.certificate.kkt() << " (stationarity " << s.certificate.stationarity
      << ", complementarity " << s.certificate.complementarity << ", sign " << s.certificate.sign
      << "), violation " << s.certificate.violation << " "
      << s.message;
  return out.str();
}

double largest_row_violation(const QuadraticProgram& qp, const Eigen::VectorXd& x) {
  const Eigen::VectorXd value = row_values(qp, x);
  double worst = 0.0;
  for (Eigen::Index r = 0; r < value.size(); ++r)
    worst = std::max({worst, qp.row_lower[r] - value[r], value[r] - qp.row_upper[r]});
  return worst;
}

}  // namespace

TEST_CASE("hybrid_solver: Ipopt's optimum of the whole programme", "[kernels][qp]") {
  if (!ipopt_available()) return;
  ProgrammeRandom random(31);
  for (int n = 0; n < 12; ++n) {
    const KnownProgramme known =
        known_programme({n % 2 == 0 ? 5 : 3, 20 + random.below(60), 1 + n % 3}, random);
    const QpSolution banded = solve_by_banded(known.qp, {});
    REQUIRE(banded.status == QpStatus::optimal);
    const QpSolution hybrid = solve_by_hybrid(known.qp, by_ipopt(), banded);
    const QpSolution whole = solve_by_ipopt(known.qp, by_ipopt());
    INFO(n << " hybrid " << told(hybrid) << "\nwhole " << told(whole));
    REQUIRE(hybrid.status == QpStatus::optimal);
    REQUIRE(whole.status == QpStatus::optimal);
    CHECK(hybrid.solver == QpSolver::ipopt);
    CHECK(std::abs(hybrid.objective - whole.objective) <= 1e-8 * (1.0 + whole.objective));
    CHECK(hybrid.row_lower.size() == known.qp.row_count());
    CHECK(hybrid.certificate.kkt() <= 1e-7);
    CHECK(certify(known.qp, hybrid).kkt() == hybrid.certificate.kkt());
    CHECK(largest_row_violation(known.qp, hybrid.x) <= 1e-8);
  }
}

TEST_CASE("hybrid_solver: a row that was far is added when it is violated", "[kernels][qp]") {
  if (!ipopt_available()) return;
  // `banded` is the optimum of a programme with the opposite wish: there the corridor's rows are
  // far and without multipliers, at this programme's optimum they hold it back.
  QuadraticProgram qp =
      test::via_programme(20, {{0.0, 0.0}, {5.0, 1.0}, {10.0, -0.5}, {15.0, 0.7}, {20.0, 0.2}});
  std::vector<NewRow> rows;
  for (const double u : {0.0, 5.0, 15.0, 20.0}) {
    const double value = u == 0.0 ? 0.0 : u == 5.0 ? 1.0 : u == 15.0 ? 0.7 : 0.2;
    rows.push_back({local_row(qp.layout, 0, u, 0), value, value, "via point", u});
  }
  for (const double u : {8.0, 10.0, 12.0})
    rows.push_back({local_row(qp.layout, 0, u, 0), -0.2, 5.0, "corridor", u});
  set_rows(qp, rows);
  QuadraticProgram lifted = qp;
  lifted.gradient.setZero();
  for (int i = 8; i < 12; ++i) lifted.gradient(0, i) = -0.02;
  QuadraticProgram pushed = qp;
  for (int i = 8; i < 12; ++i) pushed.gradient(0, i) = 0.1;
  QpSolution far = solve_by_banded(lifted, {});
  REQUIRE(far.status == QpStatus::optimal);
  const Eigen::VectorXd value = row_values(pushed, far.x);
  for (int r = 0; r < pushed.row_count(); ++r)
    if (pushed.row_name[static_cast<std::size_t>(r)] == "corridor") {
      REQUIRE(value[r] > 0.0);
      REQUIRE(value[r] < 4.9);
    }
  const QpSolution hybrid = solve_by_hybrid(pushed, by_ipopt(), far);
  const QpSolution whole = solve_by_ipopt(pushed, by_ipopt());
  INFO(told(hybrid) << "\n" << told(whole));
  REQUIRE(hybrid.status == QpStatus::optimal);
  REQUIRE(whole.status == QpStatus::optimal);
  CHECK(hybrid.objective == Approx(whole.objective).epsilon(1e-7));
  CHECK(hybrid.row_lower.maxCoeff() > 1e-3);  // a corridor holds it back
  CHECK(largest_row_violation(pushed, hybrid.x) <= 1e-8);
  CHECK(hybrid.certificate.kkt() <= 1e-7);
}

TEST_CASE("hybrid_solver: window by window the same optimum", "[kernels][qp]") {
  if (!ipopt_available()) return;
  ProgrammeRandom random(33);
  for (int n = 0; n < 6; ++n) {
    const int channels = 1 + n % 3;
    const KnownProgramme known = known_programme({5, 700, channels}, random);
    const QpSolution banded = solve_by_banded(known.qp, {});
    REQUIRE(banded.status == QpStatus::optimal);
    const QpSolution whole = solve_by_hybrid(known.qp, by_ipopt(), banded);
    const QpSolution parts = solve_by_hybrid(known.qp, by_ipopt(), banded, 300 * channels);
    INFO(n << " whole " << told(whole) << "\nwindows " << parts.windows << " " << told(parts));
    REQUIRE(whole.status == QpStatus::optimal);
    CHECK(whole.windows == 1);
    REQUIRE(parts.status == QpStatus::optimal);
    CHECK(parts.windows == 5);  // 705 control points, at most 150 each
    CHECK(parts.solver == QpSolver::ipopt);
    CHECK(std::abs(parts.objective - whole.objective) <= 1e-7 * (1.0 + whole.objective));
    CHECK(certify(known.qp, parts).kkt() == parts.certificate.kkt());
    CHECK(parts.certificate.kkt() <= 1e-7);
    CHECK(largest_row_violation(known.qp, parts.x) <= 1e-8);
  }
}

TEST_CASE("hybrid_solver: windows do not make an optimum of a point that is none",
          "[kernels][qp]") {
  if (!ipopt_available()) return;
  // What is outside a window is held where it was: one sweep from afar ends elsewhere, and that
  // must show in the certificate.
  QuadraticProgram qp = empty_program(spline_layout(clamped_knots(5, 400), 3, 1));
  add_derivative_cost(qp, 0, 3, 1.0);
  std::vector<NewRow> rows;
  for (int u = 0; u <= 400; u += 20) {
    const double value = std::sin(0.11 * u);
    rows.push_back({local_row(qp.layout, 0, u, 0), value, value, "via point", 1.0 * u});
  }
  set_rows(qp, rows);
  const QpSolution optimum = solve_by_banded(qp, {});
  REQUIRE(optimum.status == QpStatus::optimal);
  REQUIRE(solve_by_hybrid(qp, by_ipopt(), optimum, 200).status == QpStatus::optimal);
  QpSolution afar = optimum;
  Eigen::MatrixXd controls = controls_of(qp.layout, optimum.x);
  for (Eigen::Index j = 0; j < controls.cols(); ++j)
    controls(0, j) += std::sin(kPi * static_cast<double>(j) / 20.0) * 0.01;
  afar.x = lift(qp.layout, controls);
  const QpSolution parts = solve_by_hybrid(qp, by_ipopt(), afar, 200);
  INFO(told(parts));
  CHECK(parts.status != QpStatus::optimal);
}

TEST_CASE("hybrid_solver: without Ipopt its status", "[kernels][qp]") {
  QuadraticProgram qp = test::golden_programme();
  const QpSolution banded = solve_by_banded(qp, {});
  REQUIRE(banded.status == QpStatus::optimal);
  const QpSolution hybrid = solve_by_hybrid(qp, by_ipopt(), banded);
  CHECK(hybrid.status == QpStatus::optimal);
  CHECK((hybrid.solver == QpSolver::ipopt) == ipopt_available());
}

TEST_CASE("hybrid_solver: a second run gives equal bytes", "[kernels][qp]") {
  if (!ipopt_available()) return;
  ProgrammeRandom random(32);
  const KnownProgramme known = known_programme({5, 40, 2}, random);
  const QpSolution banded = solve_by_banded(known.qp, {});
  const QpSolution a = solve_by_hybrid(known.qp, by_ipopt(), banded);
  const QpSolution b = solve_by_hybrid(known.qp, by_ipopt(), banded);
  CHECK(std::memcmp(a.x.data(), b.x.data(),
                    sizeof(double) * static_cast<std::size_t>(a.x.size())) == 0);
}

}  // namespace smoothpost
