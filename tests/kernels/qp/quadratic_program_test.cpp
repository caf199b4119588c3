#include "kernels/qp/quadratic_program.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "kernels/core/contract.h"
#include "kernels/spline/bspline_jerk.h"
#include "tests/kernels/spline/bspline_definition.h"

namespace smoothpost {
namespace {

using test::random_controls;
using test::random_knots;

/// A layout with random knots and scales between 0.5 and 2.
SplineLayout random_layout(int degree, int levels, int channels, unsigned seed) {
  SplineLayout layout = spline_layout(random_knots(degree, 8, seed), levels, channels);
  const Eigen::VectorXd exponents = random_controls(channels * (levels + 1), seed + 1);
  for (int c = 0; c < channels; ++c)
    for (int l = 0; l <= levels; ++l)
      layout.scale(c, l) = std::pow(2.0, exponents[c * (levels + 1) + l]);
  return layout;
}

Eigen::MatrixXd random_curve(const SplineLayout& layout, unsigned seed) {
  Eigen::MatrixXd controls(layout.channels, layout.controls());
  for (int c = 0; c < layout.channels; ++c)
    controls.row(c) =
        random_controls(layout.controls(), seed + static_cast<unsigned>(c)).transpose();
  return controls;
}

double local_dot(const SplineLayout& layout, const LocalRow& row, const Eigen::VectorXd& x) {
  double sum = 0.0;
  for (int p = 0; p < layout.local_size(); ++p)
    sum += row.weights[p] * x[layout.local_index(row.span, p)];
  return sum;
}

TEST_CASE("spline_layout: every variable has one index", "[qp]") {
  for (int levels = 1; levels <= 5; ++levels) {
    const SplineLayout layout = random_layout(5, levels, 3, 4);
    std::set<int> seen;
    int next = 0;
    for (int c = 0; c < 3; ++c)
      for (int l = 0; l <= levels; ++l) {
        CHECK(layout.count(l) == layout.controls() - l);
        for (int j = 0; j < layout.count(l); ++j) CHECK(layout.index(c, l, j) == next++);
      }
    CHECK(layout.size() == next);
    CHECK(layout.size() == 3 * layout.channel_size());
    CHECK(layout.local_size() == 18);
    for (int span = 0; span < layout.spans(); ++span)
      for (int p = 0; p < layout.local_size(); ++p) {
        const int q = p % 6;
        const int level = std::min(q, levels);
        CHECK(layout.local_index(span, p) == layout.index(p / 6, level, span + q - level));
        seen.insert(layout.local_index(span, p));
      }
    // Those of pieces leave out the last values of the levels below the top one: they follow from
    // the equations of the layout.
    CHECK(static_cast<int>(seen.size()) ==
          3 * (levels * layout.spans() + layout.controls() - levels));
  }
}

TEST_CASE("spline_layout: place is the mean of the knots of a control point", "[qp]") {
  const SplineKnots knots = random_knots(5, 9, 2);
  const SplineLayout layout = spline_layout(knots, 5, 1);
  for (int level = 0; level < 5; ++level) {
    // The spline of that level whose control points are the places is u itself.
    const SplineKnots inner = derivative_knots(knots, level);
    Eigen::VectorXd places(layout.count(level));
    for (int j = 0; j < places.size(); ++j) places[j] = layout.place(level, j);
    for (double u : {0.0, 0.7, 3.3, knots.last()})
      CHECK(std::abs(bspline_value(inner, places, u) - u) < 1e-14 * (1.0 + u));
  }
  for (int j = 0; j < layout.count(5); ++j) {
    const auto i = static_cast<std::size_t>(j + 5);
    CHECK(layout.place(5, j) == Approx(0.5 * (knots.values[i] + knots.values[i + 1])));
  }
}

TEST_CASE("lift: scaled derivative control points that satisfy the equations", "[qp]") {
  for (int levels = 1; levels <= 5; ++levels) {
    const SplineLayout layout = random_layout(5, levels, 2, 10u + levels);
    const Eigen::MatrixXd controls = random_curve(layout, 3);
    const Eigen::VectorXd x = lift(layout, controls);
    REQUIRE(x.size() == layout.size());
    CHECK((controls_of(layout, x) - controls).cwiseAbs().maxCoeff() < 1e-15);
    for (int c = 0; c < 2; ++c)
      for (int l = 0; l <= levels; ++l) {
        const Eigen::VectorXd t = derivative_controls(layout.knots, controls.row(c).transpose(), l);
        for (int j = 0; j < layout.count(l); ++j)
          CHECK(x[layout.index(c, l, j)] * layout.scale(c, l) == Approx(t[j]));
        if (l == 0) continue;
        const std::vector<double> steps = derivative_steps(layout.knots, l);
        for (int j = 0; j < layout.count(l); ++j) {
          const double h = steps[static_cast<std::size_t>(j)];
          const double residual =
              x[layout.index(c, l - 1, j)] +
              h * layout.scale(c, l) / layout.scale(c, l - 1) * x[layout.index(c, l, j)] -
              x[layout.index(c, l - 1, j + 1)];
          CHECK(std::abs(residual) < 1e-12 * (1.0 + std::abs(x[layout.index(c, l - 1, j)])));
        }
      }
  }
}

TEST_CASE("local_row: value of the spline at any scale", "[qp]") {
  for (int levels = 1; levels <= 5; ++levels) {
    const SplineLayout layout = random_layout(5, levels, 3, 20u + levels);
    const Eigen::MatrixXd controls = random_curve(layout, 5);
    const Eigen::VectorXd x = lift(layout, controls);
    for (int c = 0; c < 3; ++c)
      for (int order = 0; order <= 5; ++order)
        for (int i = 0; i <= 30; ++i) {
          const double u = layout.knots.last() * i / 30.0;
          const LocalRow row = local_row(layout, c, u, order);
          REQUIRE(row.weights.size() == layout.local_size());
          CHECK(row.span == knot_span(layout.knots, u));
          const Eigen::VectorXd t = controls.row(c).transpose();
          const double size =
              1.0 + derivative_controls(layout.knots, t, order).cwiseAbs().maxCoeff();
          CHECK(std::abs(local_dot(layout, row, x) - bspline_value(layout.knots, t, u, order)) <
                1e-11 * size);
          for (int p = 0; p < layout.local_size(); ++p)
            if (p / 6 != c) CHECK(row.weights[p] == 0.0);
        }
  }
}

TEST_CASE("empty_program: nothing is asked", "[qp]") {
  const SplineLayout layout = random_layout(5, 3, 2, 6);
  const QuadraticProgram qp = empty_program(layout);
  const Eigen::VectorXd x = lift(layout, random_curve(layout, 1));
  CHECK(objective_value(qp, x) == 0.0);
  CHECK(qp.hessian.rows() == 12);
  CHECK(qp.hessian.cols() == 12 * layout.spans());
  CHECK(qp.gradient.cols() == layout.spans());
  CHECK(qp.lower.size() == layout.size());
  CHECK(qp.lower.maxCoeff() == -std::numeric_limits<double>::infinity());
  CHECK(qp.upper.minCoeff() == std::numeric_limits<double>::infinity());
  CHECK(qp.row_count() == 0);
  CHECK(row_values(qp, x).size() == 0);
  CHECK_FALSE(qp.relaxation);
}

TEST_CASE("add_derivative_cost: half the integral of the squared derivative", "[qp]") {
  for (int levels = 1; levels <= 5; ++levels)
    for (int order = 0; order <= 5; ++order) {
      const SplineLayout layout = random_layout(5, levels, 2, 30u + levels);
      const Eigen::MatrixXd controls = random_curve(layout, 8);
      QuadraticProgram qp = empty_program(layout);
      add_derivative_cost(qp, 1, order, 2.5);
      // Midpoints of 2000 parts of every piece.
      double sum = 0.0;
      for (int span = 0; span < layout.spans(); ++span) {
        const double a = layout.knots.values[static_cast<std::size_t>(span + 5)];
        const double h = (layout.knots.values[static_cast<std::size_t>(span + 6)] - a) / 2000;
        for (int s = 0; s < 2000; ++s)
          sum += h * std::pow(bspline_value(layout.knots, controls.row(1).transpose(),
                                            a + (s + 0.5) * h, order),
                              2);
      }
      const double value = objective_value(qp, lift(layout, controls));
      CHECK(value == Approx(0.5 * 2.5 * sum).epsilon(1e-5));
      // Exactly: the Gram matrix of the control points.
      const Eigen::VectorXd t = controls.row(1).transpose();
      CHECK(
          value ==
          Approx(0.5 * 2.5 * t.dot(derivative_gram(layout.knots, order).times(t))).epsilon(1e-12));
    }
}

TEST_CASE("add_derivative_cost: adds up over orders and channels", "[qp]") {
  const SplineLayout layout = random_layout(5, 3, 2, 9);
  const Eigen::VectorXd x = lift(layout, random_curve(layout, 2));
  QuadraticProgram both = empty_program(layout);
  both.constant = 7.0;
  both.gradient(3, 2) = -1.5;
  double sum = 7.0 - 1.5 * x[layout.local_index(2, 3)];
  for (int c = 0; c < 2; ++c)
    for (int order : {0, 3}) {
      QuadraticProgram one = empty_program(layout);
      add_derivative_cost(one, c, order, 0.5 + order);
      sum += objective_value(one, x);
      add_derivative_cost(both, c, order, 0.5 + order);
    }
  CHECK(objective_value(both, x) == Approx(sum).epsilon(1e-13));
  for (int span = 0; span < layout.spans(); ++span) {
    const Eigen::MatrixXd block = both.hessian.middleCols(12 * span, 12);
    CHECK((block - block.transpose()).cwiseAbs().maxCoeff() < 1e-14 * block.norm());
  }
}

TEST_CASE("add_derivative_cost: jerk acts on the top level alone and is definite there", "[qp]") {
  QuadraticProgram qp = empty_program(spline_layout(clamped_knots(5, 7), 3, 1));
  add_derivative_cost(qp, 0, 3, 1.0);
  for (int span = 0; span < 7; ++span) {
    const Eigen::MatrixXd block = qp.hessian.middleCols(6 * span, 6);
    CHECK(block.topRows(3).cwiseAbs().maxCoeff() == 0.0);
    CHECK(block.bottomRightCorner(3, 3).ldlt().vectorD().minCoeff() > 1e-4);
  }
}

TEST_CASE("limit_level: two-sided on every control point of one level", "[qp]") {
  const SplineLayout layout = random_layout(5, 3, 2, 12);
  QuadraticProgram qp = empty_program(layout);
  qp.lower[layout.index(1, 2, 4)] = -0.01;
  limit_level(qp, 1, 2, 5.0);
  limit_level(qp, 1, 2, 3.0);
  limit_level(qp, 1, 2, 4.0);
  for (int c = 0; c < 2; ++c)
    for (int l = 0; l <= 3; ++l)
      for (int j = 0; j < layout.count(l); ++j) {
        const int i = layout.index(c, l, j);
        if (c == 1 && l == 2) {
          CHECK(qp.upper[i] * layout.scale(1, 2) == Approx(3.0));
          CHECK(qp.lower[i] * layout.scale(1, 2) ==
                Approx(j == 4 ? -0.01 * layout.scale(1, 2) : -3.0));
        } else {
          CHECK(std::isinf(qp.lower[i]));
          CHECK(std::isinf(qp.upper[i]));
        }
      }
}

TEST_CASE("set_rows: sorted by piece and stable", "[qp]") {
  const SplineLayout layout = random_layout(5, 3, 2, 15);
  const Eigen::MatrixXd controls = random_curve(layout, 4);
  const double end = layout.knots.last();
  QuadraticProgram qp = empty_program(layout);
  std::vector<NewRow> rows;
  for (double part : {0.9, 0.1, 0.9, 0.5, 0.1})
    rows.push_back({local_row(layout, rows.size() % 2, part * end, 1), -1.0 * rows.size(), 2.0,
                    rows.size() < 2 ? "early" : "late", part * end});
  set_rows(qp, rows);
  REQUIRE(qp.row_count() == 5);
  const std::size_t order[] = {1, 4, 3, 0, 2};
  const Eigen::VectorXd values = row_values(qp, lift(layout, controls));
  for (std::size_t i = 0; i < 5; ++i) {
    const NewRow& row = rows[order[i]];
    CHECK(qp.row_span[i] == row.row.span);
    CHECK(qp.row_place[i] == row.place);
    CHECK(qp.row_name[i] == row.name);
    CHECK(qp.row_lower[static_cast<int>(i)] == row.lower);
    CHECK(qp.row_upper[static_cast<int>(i)] == row.upper);
    const Eigen::VectorXd channel = controls.row(static_cast<int>(order[i] % 2)).transpose();
    CHECK(values[static_cast<int>(i)] ==
          Approx(bspline_value(layout.knots, channel, row.place, 1)).epsilon(1e-10));
  }
  set_rows(qp, {rows[0]});
  CHECK(qp.row_count() == 1);
  CHECK(qp.rows.cols() == 1);
  CHECK(qp.row_lower.size() == 1);
}

TEST_CASE("quadratic_program: preconditions", "[qp]") {
  SplineKnots repeated = clamped_knots(5, 6);
  repeated.values[8] = repeated.values[7];
  CHECK_THROWS_AS(spline_layout(repeated, 3, 1), ContractViolation);
  CHECK_THROWS_AS(spline_layout(SplineKnots{1, {0, 1, 2, 3}}, 1, 1), ContractViolation);
  CHECK_THROWS_AS(spline_layout(clamped_knots(5, 6), 0, 1), ContractViolation);
  CHECK_THROWS_AS(spline_layout(clamped_knots(5, 6), 6, 1), ContractViolation);
  CHECK_THROWS_AS(spline_layout(clamped_knots(5, 6), 3, 0), ContractViolation);
  const SplineLayout layout = spline_layout(clamped_knots(5, 6), 3, 2);
  QuadraticProgram qp = empty_program(layout);
  CHECK_THROWS_AS(local_row(layout, 2, 1.0, 0), ContractViolation);
  CHECK_THROWS_AS(local_row(layout, 0, 7.0, 0), ContractViolation);
  CHECK_THROWS_AS(lift(layout, Eigen::MatrixXd::Zero(2, 5)), ContractViolation);
  CHECK_THROWS_AS(controls_of(layout, Eigen::VectorXd::Zero(5)), ContractViolation);
  CHECK_THROWS_AS(add_derivative_cost(qp, 0, 6, 1.0), ContractViolation);
  CHECK_THROWS_AS(limit_level(qp, 0, 4, 1.0), ContractViolation);
  CHECK_THROWS_AS(limit_level(qp, 0, 1, -1.0), ContractViolation);
  CHECK_THROWS_AS(objective_value(qp, Eigen::VectorXd::Zero(5)), ContractViolation);
  CHECK_THROWS_AS(row_values(qp, Eigen::VectorXd::Zero(5)), ContractViolation);
  CHECK_THROWS_AS(set_rows(qp, {NewRow{{9, Eigen::VectorXd::Zero(12)}, 0, 0, "", 0}}),
                  ContractViolation);
  CHECK_THROWS_AS(set_rows(qp, {NewRow{{0, Eigen::VectorXd::Zero(6)}, 0, 0, "", 0}}),
                  ContractViolation);
}

}  // namespace
}  // namespace smoothpost
