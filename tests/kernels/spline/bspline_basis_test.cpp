#include "kernels/spline/bspline_basis.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "kernels/core/contract.h"
#include "tests/kernels/spline/bspline_definition.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

using test::cox_de_boor;
using test::random_controls;
using test::random_knots;

/// All weights of a row, as a vector over every control point.
Eigen::VectorXd spread(const SplineKnots& knots, const BasisRow& row) {
  Eigen::VectorXd all = Eigen::VectorXd::Zero(knots.controls());
  all.segment(row.first, row.weights.size()) = row.weights;
  return all;
}

/// Places inside every piece, not at knots.
std::vector<double> inner_places(const SplineKnots& knots) {
  std::vector<double> places;
  for (int i = 0; i < knots.spans(); ++i) {
    const double a = knots.values[i + knots.degree];
    const double b = knots.values[i + knots.degree + 1];
    for (double t : {0.07, 0.41, 0.83}) places.push_back(a + t * (b - a));
  }
  return places;
}

TEST_CASE("bspline_basis: clamped unit knots", "[spline]") {
  const SplineKnots knots = clamped_knots(5, 3);
  CHECK(knots.values == std::vector<double>{0, 0, 0, 0, 0, 0, 1, 2, 3, 3, 3, 3, 3, 3});
  CHECK(knots.controls() == 8);
  CHECK(knots.spans() == 3);
  CHECK(clamped_knots(1, 1).values == std::vector<double>{0, 0, 1, 1});
  CHECK(derivative_knots(knots, 3).values == std::vector<double>{0, 0, 0, 1, 2, 3, 3, 3});
  CHECK(derivative_knots(knots, 3).degree == 2);
  CHECK(derivative_knots(knots, 5).values == std::vector<double>{0, 1, 2, 3});
}

TEST_CASE("bspline_basis: the recursion of Cox and de Boor in degrees 1 to 7", "[spline]") {
  for (int degree = 1; degree <= kMaxSplineDegree; ++degree)
    for (const SplineKnots& knots :
         {clamped_knots(degree, 9), random_knots(degree, 11, 31u + degree)})
      for (double u : inner_places(knots)) {
        const Eigen::VectorXd all = spread(knots, bspline_basis(knots, u));
        for (int j = 0; j < knots.controls(); ++j)
          CHECK(std::abs(all[j] - cox_de_boor(knots.values, j, degree, u)) < 1e-14);
      }
}

TEST_CASE("bspline_basis: partition of unity and no negative weight", "[spline]") {
  for (int degree = 1; degree <= kMaxSplineDegree; ++degree) {
    const SplineKnots knots = random_knots(degree, 20, 77u + degree);
    for (int i = 0; i <= 400; ++i) {
      const double u =
          i == 400 ? knots.last() : knots.first() + (knots.last() - knots.first()) * i / 400.0;
      const BasisRow row = bspline_basis(knots, u);
      CHECK(std::abs(row.weights.sum() - 1.0) < 1e-14);
      CHECK(row.weights.minCoeff() >= 0.0);
      CHECK(row.weights.size() == degree + 1);
    }
  }
}

TEST_CASE("bspline_basis: derivatives are central differences and sum to 0", "[spline]") {
  for (int degree = 2; degree <= kMaxSplineDegree; ++degree) {
    const SplineKnots knots = random_knots(degree, 8, 5u + degree);
    for (double u : inner_places(knots))
      for (int order = 1; order <= degree; ++order) {
        const double h = 1e-5;
        const Eigen::VectorXd exact = spread(knots, bspline_basis(knots, u, order));
        const Eigen::VectorXd difference = (spread(knots, bspline_basis(knots, u + h, order - 1)) -
                                            spread(knots, bspline_basis(knots, u - h, order - 1))) /
                                           (2.0 * h);
        const double size = 1.0 + exact.cwiseAbs().maxCoeff();
        CHECK((exact - difference).cwiseAbs().maxCoeff() < 2e-6 * size);
        CHECK(std::abs(exact.sum()) < 1e-13 * size);
      }
  }
}

TEST_CASE("bspline_basis: clamped ends", "[spline]") {
  for (int degree = 1; degree <= kMaxSplineDegree; ++degree) {
    const SplineKnots knots = random_knots(degree, 6, 3u + degree);
    const Eigen::VectorXd controls = random_controls(knots.controls(), 9);
    CHECK(bspline_value(knots, controls, knots.first()) == controls[0]);
    CHECK(std::abs(bspline_value(knots, controls, knots.last()) - controls[knots.controls() - 1]) <
          1e-15);
    for (int order = 1; order <= degree; ++order) {
      const Eigen::VectorXd t = derivative_controls(knots, controls, order);
      const double size = 1.0 + t.cwiseAbs().maxCoeff();
      CHECK(std::abs(bspline_value(knots, controls, knots.first(), order) - t[0]) < 1e-12 * size);
      CHECK(std::abs(bspline_value(knots, controls, knots.last(), order) - t[t.size() - 1]) <
            1e-12 * size);
    }
  }
}

TEST_CASE("bspline_basis: continuous to one order less than the degree", "[spline]") {
  for (int degree = 1; degree <= kMaxSplineDegree; ++degree) {
    const SplineKnots knots = random_knots(degree, 7, 13u + degree);
    const Eigen::VectorXd controls = random_controls(knots.controls(), 21);
    for (int i = 1; i < knots.spans(); ++i) {
      const double u = knots.values[i + degree];
      const double below = std::nextafter(u, -1e9);
      for (int order = 0; order <= degree; ++order) {
        const double size = 1.0 + derivative_controls(knots, controls, order).cwiseAbs().maxCoeff();
        const double jump = std::abs(bspline_value(knots, controls, u, order) -
                                     bspline_value(knots, controls, below, order));
        if (order < degree)
          CHECK(jump < 1e-11 * size);
        else
          CHECK(jump > 1e-6 * size);  // a quintic is C4 and no more
      }
    }
  }
}

TEST_CASE("knot_span: as a search from the left on any knots", "[spline]") {
  SplineKnots repeated = clamped_knots(5, 10);
  repeated.values[8] = repeated.values[7];
  repeated.values[9] = repeated.values[7];
  SplineKnots shifted = clamped_knots(3, 40);
  for (double& value : shifted.values) value = 0.1 * value - 1.3;
  for (const SplineKnots& knots :
       {clamped_knots(5, 40), random_knots(5, 40, 1), random_knots(1, 3, 2), repeated, shifted}) {
    const int k = knots.degree;
    std::vector<double> places = inner_places(knots);
    places.insert(places.end(), knots.values.begin(), knots.values.end());
    for (double u : places) {
      int expected = 0;
      for (int i = 0; i < knots.spans(); ++i)
        if (knots.values[k + i] <= u && knots.values[k + i] < knots.last()) expected = i;
      CHECK(knot_span(knots, u) == expected);
    }
  }
}

TEST_CASE("bspline_basis: knots that meet", "[spline]") {
  SplineKnots knots = clamped_knots(4, 8);
  knots.values[7] = knots.values[6];  // double knot at 2
  for (double u : inner_places(knots)) {
    const Eigen::VectorXd all = spread(knots, bspline_basis(knots, u));
    for (int j = 0; j < knots.controls(); ++j)
      CHECK(std::abs(all[j] - cox_de_boor(knots.values, j, 4, u)) < 1e-14);
  }
}

TEST_CASE("derivative_controls: those of the derivative's own spline", "[spline]") {
  for (int degree = 1; degree <= kMaxSplineDegree; ++degree)
    for (const SplineKnots& knots :
         {clamped_knots(degree, 9), random_knots(degree, 9, 17u + degree)}) {
      const Eigen::VectorXd controls = random_controls(knots.controls(), 4u + degree);
      for (int order = 0; order <= degree; ++order) {
        const Eigen::VectorXd t = derivative_controls(knots, controls, order);
        const SplineKnots inner = derivative_knots(knots, order);
        REQUIRE(t.size() == inner.controls());
        const double size = 1.0 + t.cwiseAbs().maxCoeff();
        for (double u : inner_places(knots)) {
          double value = 0.0;
          for (int j = 0; j < t.size(); ++j)
            value += t[j] * cox_de_boor(inner.values, j, inner.degree, u);
          CHECK(std::abs(value - bspline_value(knots, controls, u, order)) < 1e-12 * size);
        }
      }
    }
}

TEST_CASE("derivative_steps: the steps of derivative_controls", "[spline]") {
  const SplineKnots knots = random_knots(5, 12, 8);
  const Eigen::VectorXd controls = random_controls(knots.controls(), 6);
  for (int level = 1; level <= 5; ++level) {
    const std::vector<double> steps = derivative_steps(knots, level);
    const Eigen::VectorXd before = derivative_controls(knots, controls, level - 1);
    const Eigen::VectorXd here = derivative_controls(knots, controls, level);
    REQUIRE(steps.size() == static_cast<std::size_t>(knots.controls() - level));
    for (int j = 0; j < here.size(); ++j) {
      const auto at = static_cast<std::size_t>(j);
      CHECK(steps[at] == Approx((knots.values[at + 6] - knots.values[at + level]) / (6 - level)));
      CHECK(std::abs(before[j] + steps[at] * here[j] - before[j + 1]) <
            1e-13 * (1.0 + before.cwiseAbs().maxCoeff()));
    }
  }
}

/// A derivative of that order in the middle of uniform knots from control points with the
/// denominators of Eq. (12) as printed, u_{j+k+1} − u_{j+1} at every level.
double as_printed(const SplineKnots& knots, Eigen::VectorXd t, double u, int order) {
  const int k = knots.degree;
  for (int l = 1; l <= order; ++l)
    for (int j = 0; j < knots.controls() - l; ++j) {
      const double length = knots.values[j + k + 1] - knots.values[j + 1];
      t[j] = (k - l + 1) / length * (t[j + 1] - t[j]);
    }
  t.conservativeResize(knots.controls() - order);
  return bspline_value(derivative_knots(knots, order), t, u);
}

TEST_CASE("derivative_controls: Eq. (12) as printed is 0.8 and 0.48 of the truth", "[spline]") {
  const SplineKnots knots = clamped_knots(5, 40);
  const Eigen::VectorXd controls = random_controls(knots.controls(), 2);
  for (double u : {18.2, 20.0, 21.7}) {
    CHECK(as_printed(knots, controls, u, 1) == Approx(bspline_value(knots, controls, u, 1)));
    CHECK(as_printed(knots, controls, u, 2) == Approx(0.8 * bspline_value(knots, controls, u, 2)));
    CHECK(as_printed(knots, controls, u, 3) == Approx(0.48 * bspline_value(knots, controls, u, 3)));
  }
}

TEST_CASE("derivative_controls: Eq. (24) to (26) hold away from clamped ends only", "[spline]") {
  const SplineKnots knots = clamped_knots(5, 20);
  const auto& u = knots.values;
  const Eigen::VectorXd x = random_controls(knots.controls(), 12);
  const Eigen::VectorXd second = derivative_controls(knots, x, 2);
  const Eigen::VectorXd third = derivative_controls(knots, x, 3);
  double worst = 0.0;
  for (int j = 0; j < third.size(); ++j) {
    const double c2 = 20.0 / ((u[j + 6] - u[j + 2]) * (u[j + 6] - u[j + 1]));
    const double c3 =
        -60.0 / ((u[j + 6] - u[j + 3]) * (u[j + 6] - u[j + 2]) * (u[j + 6] - u[j + 1]));
    const double printed2 = c2 * (x[j] - 2.0 * x[j + 1] + x[j + 2]);
    const double printed3 = c3 * (x[j] - 3.0 * x[j + 1] + 3.0 * x[j + 2] - x[j + 3]);
    if (j >= 4 && j + 7 <= knots.controls() - 1) {
      CHECK(printed2 == Approx(second[j]));
      CHECK(printed3 == Approx(third[j]));
    }
    worst = std::max(worst, std::abs(printed3 - third[j]) / std::abs(third[j]));
  }
  CHECK(worst > 0.5);
}

TEST_CASE("bspline_basis: golden values of five places", "[spline]") {
  // Exact rationals, rounded: clamped quintic, unit spans 0 … 5, at 1/3 and 2.
  const SplineKnots knots = clamped_knots(5, 5);
  const Eigen::VectorXd third = spread(knots, bspline_basis(knots, 1.0 / 3.0));
  CHECK(third[0] == Approx(32.0 / 243.0).epsilon(1e-14));
  CHECK(third[1] == Approx(0.540380658436214).epsilon(1e-14));
  CHECK(third[5] == Approx(3.429355281207133e-05).epsilon(1e-13));
  const Eigen::VectorXd two = spread(knots, bspline_basis(knots, 2.0, 3));
  const Eigen::VectorXd exact =
      (Eigen::VectorXd(10) << 0, 0, -10.0 / 9, 35.0 / 18, -1.0 / 3, -9.0 / 8, 5.0 / 8, 0, 0, 0)
          .finished();
  CHECK((two - exact).cwiseAbs().maxCoeff() < 1e-14);
}

TEST_CASE("bspline_basis: golden values of the reference", "[spline]") {
  const auto path = test::shared_path("reference/paper_b.json");
  if (!path) {
    WARN("no reference material: skipped");
    return;
  }
  const auto golden = nlohmann::json::parse(std::ifstream(*path)).at("basis_clamped_unit_n9");
  const SplineKnots knots = clamped_knots(5, 5);
  const std::vector<double> places = golden.at("x");
  for (const auto& [name, order] : {std::pair{"N", 0}, {"N1", 1}, {"N3", 3}})
    for (std::size_t i = 0; i < places.size(); ++i) {
      const std::vector<double> row = golden.at(name).at(i);
      const Eigen::VectorXd all = spread(knots, bspline_basis(knots, places[i], order));
      for (int j = 0; j < 10; ++j)
        CHECK(std::abs(all[j] - row[static_cast<std::size_t>(j)]) <
              2e-14 * (1.0 + std::abs(all[j])));
    }
}

TEST_CASE("derivative_controls: golden matrices of the reference", "[spline]") {
  const auto path = test::shared_path("reference/paper_b.json");
  if (!path) {
    WARN("no reference material: skipped");
    return;
  }
  const auto all = nlohmann::json::parse(std::ifstream(*path));
  for (const char* name : {"H_clamped_u01_n9", "H_clamped_unit_n9"}) {
    const auto& golden = all.at(name);
    const SplineKnots knots{5, golden.at("knots")};
    for (int order = 1; order <= 3; ++order) {
      const auto& rows = golden.at("D" + std::to_string(order));
      REQUIRE(rows.size() == static_cast<std::size_t>(10 - order));
      for (int c = 0; c < 10; ++c) {
        const Eigen::VectorXd column =
            derivative_controls(knots, Eigen::VectorXd::Unit(10, c), order);
        for (int j = 0; j < column.size(); ++j) {
          const double exact = rows[static_cast<std::size_t>(j)][static_cast<std::size_t>(c)];
          CHECK(std::abs(column[j] - exact) <=
                4e-15 * (1.0 + std::abs(exact)) + 1e-12 * (exact == 0.0));
        }
      }
    }
  }
}

TEST_CASE("lifted_basis: the same value as the control points", "[spline]") {
  for (int degree = 1; degree <= kMaxSplineDegree; ++degree) {
    const SplineKnots knots = random_knots(degree, 9, 41u + degree);
    const Eigen::VectorXd controls = random_controls(knots.controls(), 42);
    for (int levels = 0; levels <= degree; ++levels)
      for (int order = 0; order <= degree; ++order)
        for (double u : inner_places(knots)) {
          const BasisRow row = lifted_basis(knots, u, order, levels);
          REQUIRE(row.weights.size() == degree + 1);
          double value = 0.0;
          double size = 1.0;
          for (int p = 0; p <= degree; ++p) {
            const int level = std::min(p, levels);
            const double t = derivative_controls(knots, controls, level)[row.first + p - level];
            value += row.weights[p] * t;
            size += std::abs(row.weights[p] * t);
          }
          if (order == 0) CHECK(row.weights.minCoeff() >= 0.0);
          CHECK(std::abs(value - bspline_value(knots, controls, u, order)) < 1e-12 * size);
        }
  }
}

TEST_CASE("bspline_basis: digits are kept far from 0", "[spline]") {
  const SplineKnots knots = clamped_knots(5, 50000);
  const BasisRow far = bspline_basis(knots, 49000.375, 3);
  const BasisRow near = bspline_basis(knots, 40.375, 3);
  CHECK(far.weights == near.weights);
}

TEST_CASE("SplineCurve: every component as its own spline", "[spline]") {
  SplineCurve curve{random_knots(5, 9, 3), Eigen::MatrixXd(3, 14)};
  for (int c = 0; c < 3; ++c) curve.controls.row(c) = random_controls(14, 50u + c).transpose();
  for (int order = 0; order <= 5; ++order) {
    const Eigen::VectorXd value = curve.at(1.25, order);
    REQUIRE(value.size() == 3);
    for (int c = 0; c < 3; ++c)
      CHECK(value[c] ==
            Approx(bspline_value(curve.knots, curve.controls.row(c).transpose(), 1.25, order)));
  }
}

TEST_CASE("bspline_basis: preconditions", "[spline]") {
  const SplineKnots knots = clamped_knots(5, 4);
  CHECK_THROWS_AS(clamped_knots(0, 4), ContractViolation);
  CHECK_THROWS_AS(clamped_knots(8, 4), ContractViolation);
  CHECK_THROWS_AS(clamped_knots(5, 0), ContractViolation);
  CHECK_THROWS_AS(bspline_basis(knots, -1e-9), ContractViolation);
  CHECK_THROWS_AS(bspline_basis(knots, 4.1), ContractViolation);
  CHECK_THROWS_AS(bspline_basis(knots, std::nan("")), ContractViolation);
  CHECK_THROWS_AS(bspline_basis(knots, 1.0, -1), ContractViolation);
  CHECK_THROWS_AS(bspline_basis(knots, 1.0, 6), ContractViolation);
  CHECK_THROWS_AS(derivative_knots(knots, 6), ContractViolation);
  CHECK_THROWS_AS(derivative_steps(knots, 0), ContractViolation);
  CHECK_THROWS_AS(derivative_steps(knots, 6), ContractViolation);
  CHECK_THROWS_AS(derivative_controls(knots, Eigen::VectorXd::Zero(8), 1), ContractViolation);
  CHECK_THROWS_AS(bspline_value(knots, Eigen::VectorXd::Zero(8), 1.0), ContractViolation);
  CHECK_THROWS_AS(lifted_basis(knots, 1.0, 0, 6), ContractViolation);
  CHECK_THROWS_AS(knot_span(SplineKnots{5, {0, 1, 2}}, 1.0), ContractViolation);
  CHECK_THROWS_AS(knot_span(SplineKnots{1, {0, 1, 2, 3}}, 1.0), ContractViolation);
  CHECK_THROWS_AS(knot_span(SplineKnots{1, {0, 0, 0, 0}}, 0.0), ContractViolation);
}

}  // namespace
}  // namespace smoothpost
