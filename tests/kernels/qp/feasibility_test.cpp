#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "kernels/qp/qp_solver.h"
#include "tests/kernels/qp/random_programmes.h"

namespace smoothpost {
namespace {

using test::golden_programme;
using test::known_programme;
using test::KnownProgramme;
using test::ProgrammeRandom;
using test::via_programme;
using test::with_shares;

/// The row of the quintic's value at u within a range.
NewRow range(const SplineLayout& layout, double u, double lower, double upper,
             std::string_view name) {
  return {local_row(layout, 0, u, 0), lower, upper, name, u};
}

/// The same programme with levels and rows in other units, 1e-6 to 1e6 times as large.
QuadraticProgram in_other_units(QuadraticProgram qp, ProgrammeRandom& random) {
  const SplineLayout& layout = qp.layout;
  Eigen::VectorXd local = Eigen::VectorXd::Ones(layout.local_size());
  for (int c = 0; c < layout.channels; ++c)
    for (int level = 0; level <= layout.levels; ++level) {
      const double unit = std::pow(10.0, random.between(-6.0, 6.0));  // x = unit·x'
      qp.layout.scale(c, level) *= unit;
      for (int j = 0; j < layout.count(level); ++j) {
        const int k = layout.index(c, level, j);
        qp.lower[k] /= unit;
        qp.upper[k] /= unit;
        qp.relaxation->bound_weight[k] /= unit;
      }
      for (int p = 0; p < local.size(); ++p)
        if (layout.local_index(0, p) >= layout.index(c, level, 0) &&
            layout.local_index(0, p) < layout.index(c, level, 0) + layout.count(level))
          local[p] = unit;
    }
  const int size = layout.local_size();
  for (int span = 0; span < layout.spans(); ++span)
    qp.hessian.middleCols(span * size, size) =
        (local.asDiagonal() * qp.hessian.middleCols(span * size, size) * local.asDiagonal()).eval();
  qp.gradient = (local.asDiagonal() * qp.gradient).eval();
  for (int r = 0; r < qp.row_count(); ++r) {
    const double unit = std::pow(10.0, random.between(-6.0, 6.0));
    qp.rows.col(r) = unit * qp.rows.col(r).cwiseProduct(local);
    qp.row_lower[r] *= unit;
    qp.row_upper[r] *= unit;
    qp.relaxation->row_weight[r] *= unit;
  }
  return qp;
}

/// 0 to 1 from rest to rest (q' = q'' = 0) with that limit on the jerk's control points.
QuadraticProgram single_move(int spans, double jerk) {
  Eigen::Vector4d scale = Eigen::Vector4d::Ones();
  const double t = spans;
  scale << 1.0, 2.0 / t, 8.0 / (t * t), jerk;
  QuadraticProgram qp = via_programme(spans, {{0.0, 0.0}, {double(spans), 1.0}}, scale);
  qp.hessian /= jerk * jerk * spans;
  limit_level(qp, 0, 3, jerk);
  return qp;
}

}  // namespace

TEST_CASE("feasibility: jerk of a single move", "[kernels][qp]") {
  // 32 D/T³ is the least jerk from rest to rest when it may jump; a spline needs a little more, and
  // the least jerk it needs does not depend on the limit: J (1 + τ) is the same for every J.
  const int spans = 400;
  const double needed = 32.0 / std::pow(spans, 3);
  double first = 0.0;
  for (const double share : {0.5, 0.8, 1.25, 2.0}) {
    const double limit = share * needed;
    const QpFeasibility answer = feasibility(single_move(spans, limit));
    INFO(share << " " << answer.shortfall << " " << answer.solution.iterations);
    CHECK(answer.feasible == (share > 1.0));
    const double least = limit * (1.0 + answer.shortfall) / needed;
    CHECK(least == Approx(1.0).epsilon(0.03));
    CHECK(least > 1.0 - 1e-6);
    if (first == 0.0) first = least;
    CHECK(least == Approx(first).epsilon(1e-5));
    CHECK(answer.name == "bound");
    CHECK(answer.channel == 0);
    CHECK(answer.level == 3);
  }
}

TEST_CASE("feasibility: contradictory rows", "[kernels][qp]") {
  // ranges d apart: weights w1 and w2 give τ = d/(w1 + w2)
  struct Case {
    double gap, first, second;
  };
  for (const Case& c : {Case{2.0, 1.0, 1.0}, Case{0.5, 1.0, 1.0}, Case{3.0, 1.0, 2.0},
                        Case{1.0, 0.0, 4.0}, Case{0.3, 5.0, 1.0}, Case{-0.4, 1.0, 1.0}}) {
    QuadraticProgram qp = golden_programme();
    set_rows(qp, {range(qp.layout, 3.0, -1.0, 1.0, "elsewhere"),
                  range(qp.layout, 7.5, 1.0, 9.0, "above"),
                  range(qp.layout, 7.5, -9.0, 1.0 - c.gap, "below")});
    qp.relaxation = Relaxation{Eigen::VectorXd::Zero(qp.layout.size()),
                               Eigen::Vector3d(1.0, c.first, c.second)};
    const QpFeasibility answer = feasibility(qp);
    INFO(c.gap << " " << answer.shortfall << " " << answer.name);
    CHECK(answer.shortfall == Approx(c.gap / (c.first + c.second)).margin(1e-6));
    CHECK(answer.feasible == (c.gap < 0.0));
    CHECK(answer.place == 7.5);
    CHECK((answer.name == "above" || answer.name == "below"));
    if (c.first > c.second) CHECK(answer.name == "above");
    if (c.first < c.second) CHECK(answer.name == "below");
  }
}

TEST_CASE("feasibility: weights are 1 without a relaxation", "[kernels][qp]") {
  QuadraticProgram qp = golden_programme();
  set_rows(qp,
           {range(qp.layout, 7.5, 1.0, 2.0, "above"), range(qp.layout, 7.5, -2.0, -1.0, "below"),
            range(qp.layout, 12.0, 0.25, 0.25, "via point")});
  const QpFeasibility answer = feasibility(qp);
  CHECK(answer.shortfall == Approx(1.0).margin(1e-6));
  CHECK(answer.place == 7.5);
  // equations give no way
  CHECK(std::abs(row_values(qp, answer.solution.x)[2] - 0.25) < 1e-7);
}

TEST_CASE("feasibility: a row against a bound", "[kernels][qp]") {
  // 3 above u = 10 against positions within 1: both give way by 1; more room where it needs none.
  QuadraticProgram qp = golden_programme();
  set_rows(qp, {range(qp.layout, 10.0, 3.0, 4.0, "shelf")});
  limit_level(qp, 0, 0, 1.0);
  const QpFeasibility answer = feasibility(qp);
  INFO(answer.shortfall << " " << answer.name << " " << answer.place);
  CHECK_FALSE(answer.feasible);
  CHECK(answer.shortfall == Approx(1.0).margin(1e-6));
  CHECK(answer.place == Approx(10.0).margin(2.0));
  CHECK((answer.name == "shelf" || (answer.name == "bound" && answer.level == 0)));

  // velocity level: from −4 to 4 in 4 pieces with |q'| ≤ 1, the second channel alone.
  QuadraticProgram two = empty_program(spline_layout(clamped_knots(5, 20), 3, 2));
  for (const int c : {0, 1}) add_derivative_cost(two, c, 3, 1.0);
  std::vector<NewRow> rows;
  for (const int c : {0, 1}) {
    const double size = c == 0 ? 0.1 : 4.0;
    rows.push_back({local_row(two.layout, c, 8.0, 0), -size, -size, "via point", 8.0});
    rows.push_back({local_row(two.layout, c, 12.0, 0), size, size, "via point", 12.0});
    limit_level(two, c, 1, 1.0);
  }
  set_rows(two, rows);
  const QpFeasibility fast = feasibility(two);
  INFO(fast.shortfall << " " << fast.name << " " << fast.place);
  CHECK(fast.shortfall == Approx(1.0).margin(1e-3));
  CHECK(fast.name == "bound");
  CHECK(fast.channel == 1);
  CHECK(fast.level == 1);
  CHECK(fast.place > 7.0);
  CHECK(fast.place < 13.0);
}

TEST_CASE("feasibility: strictly inside when there is room", "[kernels][qp]") {
  ProgrammeRandom random(21);
  for (int n = 0; n < 24; ++n) {
    const KnownProgramme known =
        known_programme({n % 2 == 0 ? 5 : 3, 12 + random.below(60), 1 + n % 3}, random);
    const QuadraticProgram& qp = known.qp;
    const QpFeasibility answer = feasibility(qp);
    INFO(n << " " << answer.shortfall << " " << answer.name);
    REQUIRE(answer.feasible);
    CHECK(answer.shortfall < 0.0);
    const Eigen::VectorXd& x = answer.solution.x;
    double room = 1.0;
    for (Eigen::Index k = 0; k < x.size(); ++k)
      if (qp.lower[k] < qp.upper[k])
        room = std::min({room, x[k] - qp.lower[k], qp.upper[k] - x[k]});
    const Eigen::VectorXd value = row_values(qp, x);
    for (Eigen::Index r = 0; r < value.size(); ++r) {
      if (qp.row_lower[r] < qp.row_upper[r])
        room = std::min({room, value[r] - qp.row_lower[r], qp.row_upper[r] - value[r]});
      else
        CHECK(std::abs(value[r] - qp.row_lower[r]) < 1e-6);
    }
    CHECK(room == Approx(-answer.shortfall).margin(1e-6));
  }
}

TEST_CASE("feasibility: the same answer in any units", "[kernels][qp]") {
  ProgrammeRandom random(22);
  int infeasible = 0;
  for (int n = 0; n < 60; ++n) {
    const KnownProgramme known =
        known_programme({n % 2 == 0 ? 5 : 3, 12 + random.below(60), 1 + n % 3}, random);
    const QuadraticProgram qp = n % 3 == 2 ? with_shares(known.qp, random, 0.4) : known.qp;
    QuadraticProgram weighted = qp;
    weighted.relaxation =
        Relaxation{Eigen::VectorXd::Ones(qp.layout.size()), Eigen::VectorXd::Ones(qp.row_count())};
    for (Eigen::Index k = 0; k < qp.lower.size(); ++k)
      if (qp.lower[k] == qp.upper[k]) weighted.relaxation->bound_weight[k] = 0.0;
    for (Eigen::Index r = 0; r < qp.row_lower.size(); ++r)
      if (qp.row_lower[r] == qp.row_upper[r]) weighted.relaxation->row_weight[r] = 0.0;
    const QuadraticProgram other = in_other_units(weighted, random);
    QuadraticProgram unweighted = other;
    unweighted.relaxation.reset();
    const QpFeasibility a = feasibility(weighted), b = feasibility(other);
    INFO(n << " " << a.shortfall << " " << a.name << " / " << b.shortfall << " " << b.name);
    CHECK(a.feasible == b.feasible);
    CHECK(b.shortfall == Approx(a.shortfall).margin(1e-6));
    CHECK(feasibility(unweighted).feasible == a.feasible);
    infeasible += a.feasible ? 0 : 1;
    // Back in the first units it is within every limit relaxed by τ.
    Eigen::VectorXd x = b.solution.x;
    for (int c = 0; c < qp.layout.channels; ++c)
      for (int level = 0; level <= qp.layout.levels; ++level)
        x.segment(qp.layout.index(c, level, 0), qp.layout.count(level)) *=
            other.layout.scale(c, level) / qp.layout.scale(c, level);
    const Relaxation& relaxed = *weighted.relaxation;
    double outside = 0.0;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double way = relaxed.bound_weight[k] * b.shortfall;
      outside = std::max({outside, qp.lower[k] - way - x[k], x[k] - way - qp.upper[k]});
    }
    const Eigen::VectorXd value = row_values(qp, x);
    for (Eigen::Index r = 0; r < value.size(); ++r) {
      const double way = relaxed.row_weight[r] * b.shortfall;
      outside =
          std::max({outside, qp.row_lower[r] - way - value[r], value[r] - way - qp.row_upper[r]});
    }
    CHECK(outside < 1e-6);
  }
  CHECK(infeasible >= 5);
}

TEST_CASE("feasibility: a second run gives equal bytes", "[kernels][qp]") {
  const QuadraticProgram qp = single_move(60, 1e-4);
  const QpFeasibility a = feasibility(qp), b = feasibility(qp);
  CHECK(a.shortfall == b.shortfall);
  CHECK(std::memcmp(a.solution.x.data(), b.solution.x.data(),
                    sizeof(double) * static_cast<std::size_t>(a.solution.x.size())) == 0);
}

}  // namespace smoothpost
