#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "kernels/core/contract.h"
#include "kernels/qp/layout_equations.h"
#include "kernels/qp/qp_solver.h"

namespace smoothpost {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Variables of one straight piece with one level: its two ends and its slope, x1 = x0 + v.
constexpr int kX0 = 0, kX1 = 1, kV = 2;

QuadraticProgram one_piece() {
  QuadraticProgram qp = empty_program(spline_layout(clamped_knots(1, 1), 1, 1));
  qp.lower(kX0) = qp.upper(kX0) = 0.0;
  return qp;
}

QpSolution zero_solution(const QuadraticProgram& qp) {
  QpSolution s;
  s.x = s.bound_lower = s.bound_upper = Eigen::VectorXd::Zero(qp.layout.size());
  s.row_lower = s.row_upper = Eigen::VectorXd::Zero(qp.row_count());
  return s;
}

/// minimise v²/2 − 3v, x0 = 0, x1 ≤ 1. Solution v = x1 = 1, objective −5/2; stationarity in v, x1
/// and x0 says λ = v − 3 = −2, multiplier of x1 ≤ 1: 2, of x0 = 0: +2.
struct Bounded {
  QuadraticProgram qp = one_piece();
  QpSolution best;
  Bounded() {
    qp.hessian(1, 1) = 1.0;  // local variables: x0, v
    qp.gradient(1, 0) = -3.0;
    qp.upper(kX1) = 1.0;
    best = zero_solution(qp);
    best.x(kX1) = best.x(kV) = 1.0;
    best.bound_upper(kX1) = 2.0;
    best.bound_lower(kX0) = 2.0;
  }
};

/// minimise τ, x0 = 0, x1 ≥ 1 − τ, v ≤ τ. Solution τ = x1 = v = 1/2, multipliers 1/2.
struct Relaxed {
  QuadraticProgram qp = one_piece();
  QpSolution best;
  Relaxed() {
    qp.lower(kX1) = 1.0;
    qp.upper(kV) = 0.0;
    qp.relaxation = Relaxation{Eigen::Vector3d(0.0, 1.0, 1.0), Eigen::VectorXd(), 1.0, -10.0};
    best = zero_solution(qp);
    best.tau = best.x(kX1) = best.x(kV) = 0.5;
    best.bound_lower(kX1) = best.bound_upper(kV) = best.bound_upper(kX0) = 0.5;
  }
};

}  // namespace

TEST_CASE("certificate: zero at a solution known by hand", "[kernels][qp]") {
  const Bounded bounded;
  CHECK(certify(bounded.qp, bounded.best).kkt() < 1e-15);
  const Relaxed relaxed;
  CHECK(certify(relaxed.qp, relaxed.best).kkt() < 1e-15);
}

TEST_CASE("certificate: the same programme in other units", "[kernels][qp]") {
  Bounded scaled;
  scaled.qp = one_piece();
  scaled.qp.layout.scale(0, 1) = 2.0;  // v is 2·x(kV)
  scaled.qp.hessian(1, 1) = 4.0;
  scaled.qp.gradient(1, 0) = -6.0;
  scaled.qp.upper(kX1) = 1.0;
  scaled.best.x(kV) = 0.5;
  CHECK(certify(scaled.qp, scaled.best).kkt() < 1e-15);
}

TEST_CASE("certificate: each number sees its own fault", "[kernels][qp]") {
  const double off = 1e-3;
  const Bounded b;
  SECTION("a wrong multiplier: stationarity") {
    QpSolution s = b.best;
    s.bound_upper(kX1) += off;
    const QpCertificate c = certify(b.qp, s);
    // Left after the best λ: off·(1, 2, 1)/3 in x0, x1, v; the largest term is |−3|.
    CHECK(c.stationarity == Approx(off * 2.0 / 3.0 / 4.0));
    CHECK(c.violation + c.complementarity + c.sign < 1e-15);
  }
  SECTION("a bound passed: violation") {
    QpSolution s = b.best;
    s.x(kX1) = s.x(kV) = 1.0 + off;
    CHECK(certify(b.qp, s).violation == Approx(off));
  }
  SECTION("an equation of the layout missed: violation") {
    QpSolution s = b.best;
    s.x(kX1) = 1.0 - off;
    CHECK(certify(b.qp, s).violation == Approx(off));
  }
  SECTION("an equation of the user missed: violation") {
    QpSolution s = b.best;
    s.x(kX0) = -off;
    CHECK(certify(b.qp, s).violation == Approx(off));
  }
  SECTION("a multiplier away from its bound: complementarity") {
    QpSolution s = b.best;
    s.x(kX1) = s.x(kV) = 1.0 - off;
    const double objective = 0.5 * (1.0 - off) * (1.0 - off) - 3.0 * (1.0 - off);
    CHECK(certify(b.qp, s).complementarity == Approx(2.0 * off / (1.0 + std::abs(objective))));
  }
  SECTION("a negative multiplier: sign") {
    QpSolution s = b.best;
    s.bound_upper(kX1) = -off;
    CHECK(certify(b.qp, s).sign == Approx(off));
  }
  SECTION("a multiplier without a bound: sign") {
    QpSolution s = b.best;
    s.bound_upper(kV) = off;
    CHECK(certify(b.qp, s).sign == Approx(off));
  }
  SECTION("not a number: everything") {
    QpSolution s = b.best;
    s.x(kV) = std::nan("");
    CHECK(certify(b.qp, s).kkt() == kInfinity);
  }
}

TEST_CASE("certificate: of an equation only the difference of the multipliers counts",
          "[kernels][qp]") {
  const Bounded b;
  QpSolution s = b.best;
  s.bound_lower(kX0) += 7.0;
  s.bound_upper(kX0) += 7.0;
  CHECK(certify(b.qp, s).kkt() < 1e-15);
  s.bound_lower(kX0) = 0.0;
  s.bound_upper(kX0) = -2.0;
  CHECK(certify(b.qp, s).kkt() < 1e-15);
}

TEST_CASE("certificate: rows", "[kernels][qp]") {
  Bounded b;
  b.qp.upper(kX1) = kInfinity;
  const LocalRow slope = local_row(b.qp.layout, 0, 0.5, 1);
  set_rows(b.qp, {{slope, -5.0, 1.0, "slope", 0.5}});
  QpSolution s = zero_solution(b.qp);
  s.x = b.best.x;
  s.row_upper(0) = 2.0;
  CHECK(certify(b.qp, s).kkt() < 1e-15);
  SECTION("wrong side") {
    std::swap(s.row_upper, s.row_lower);
    CHECK(certify(b.qp, s).stationarity > 0.1);
    CHECK(certify(b.qp, s).complementarity == Approx(2.0 * 6.0 / 3.5));
  }
  SECTION("negative") {
    s.row_lower(0) = -1e-3;
    CHECK(certify(b.qp, s).sign == Approx(1e-3));
  }
  SECTION("passed") {
    b.qp.row_upper(0) = 0.75;
    CHECK(certify(b.qp, s).violation == Approx(0.25));
  }
}

TEST_CASE("certificate: a relaxation's tau", "[kernels][qp]") {
  const double off = 1e-3;
  Relaxed r;
  SECTION("limits give way by weight times tau and no further") {
    r.best.tau = 0.5 - off;
    CHECK(certify(r.qp, r.best).violation == Approx(off));
  }
  SECTION("stationarity in tau") {
    r.best.bound_lower(kX1) = r.best.bound_upper(kV) = r.best.bound_upper(kX0) = 0.5 + off;
    const QpCertificate c = certify(r.qp, r.best);
    CHECK(c.stationarity == Approx(2.0 * off / (2.0 + 2.0 * off)));
    CHECK(c.violation + c.sign < 1e-15);
  }
  SECTION("tau at its lower bound needs no multipliers of the limits") {
    r.qp.relaxation->lower = 0.7;
    QpSolution s = zero_solution(r.qp);
    s.tau = 0.7;
    s.x(kX1) = s.x(kV) = 0.6;
    CHECK(certify(r.qp, s).kkt() < 1e-15);
    s.tau = 0.8;
    CHECK(certify(r.qp, s).complementarity == Approx(0.1));
    s.tau = 0.7 - off;
    CHECK(certify(r.qp, s).violation == Approx(off));
  }
}

TEST_CASE("certificate: multipliers of thousands of equations are eliminated without loss",
          "[kernels][qp]") {
  std::mt19937 random(20261124);
  std::normal_distribution<double> normal;
  for (const double rate : {1.0, 0.02, 0.002}) {
    SplineLayout layout = spline_layout(clamped_knots(5, 4995), 3, 2);
    for (int l = 0; l <= 3; ++l) layout.scale.col(l).setConstant(std::pow(rate, l));
    const Eigen::Index count = static_cast<Eigen::Index>(layout_equations(layout).size());
    CHECK(count == 2 * (5000 * 3 - 6));
    Eigen::VectorXd known(count);
    for (Eigen::Index e = 0; e < count; ++e) known(e) = normal(random);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(layout.size());
    const Eigen::VectorXd gradient = -with_equation_terms(layout, known, zero);
    const Eigen::VectorXd found = equation_multipliers(layout, gradient);
    CHECK(with_equation_terms(layout, found, gradient).lpNorm<Eigen::Infinity>() < 1e-13);
  }
}

TEST_CASE("certificate: refuses a solution of another programme", "[kernels][qp]") {
  const Bounded b;
  QpSolution s = b.best;
  s.row_lower = Eigen::VectorXd::Zero(1);
  CHECK_THROWS_AS(certify(b.qp, s), ContractViolation);
}

TEST_CASE("certificate: words", "[kernels][qp]") {
  CHECK(to_string(QpStatus::optimal) == "optimal");
  CHECK(to_string(QpStatus::infeasible) == "infeasible");
  CHECK(to_string(QpStatus::iteration_limit) == "iteration limit");
  CHECK(to_string(QpStatus::failed) == "failed");
  CHECK(to_string(QpSolver::banded) == "banded");
  CHECK(to_string(QpSolver::ipopt) == "ipopt");
}

}  // namespace smoothpost
