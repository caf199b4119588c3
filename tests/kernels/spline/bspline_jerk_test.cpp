#include "kernels/spline/bspline_jerk.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "kernels/core/contract.h"
#include "tests/kernels/spline/bspline_definition.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

using test::random_controls;
using test::random_knots;

Eigen::MatrixXd dense(const SymmetricBand& gram) {
  Eigen::MatrixXd all(gram.size(), gram.size());
  for (int i = 0; i < gram.size(); ++i)
    for (int j = 0; j < gram.size(); ++j) all(i, j) = gram.at(i, j);
  return all;
}

/// D_r: its columns are the derivative control points of unit vectors.
Eigen::MatrixXd derivative_matrix(const SplineKnots& knots, int order) {
  Eigen::MatrixXd d(knots.controls() - order, knots.controls());
  for (int c = 0; c < knots.controls(); ++c)
    d.col(c) = derivative_controls(knots, Eigen::VectorXd::Unit(knots.controls(), c), order);
  return d;
}

/// Control points of the polynomial u^power: its blossom at the knots of each control point.
Eigen::VectorXd power_controls(const SplineKnots& knots, int power) {
  const int k = knots.degree;
  Eigen::VectorXd controls(knots.controls());
  for (int j = 0; j < controls.size(); ++j) {
    Eigen::VectorXd symmetric = Eigen::VectorXd::Unit(k + 1, 0);  // elementary symmetric sums
    for (int i = 1; i <= k; ++i)
      for (int m = i; m > 0; --m)
        symmetric[m] += symmetric[m - 1] * knots.values[static_cast<std::size_t>(j + i)];
    double choose = 1.0;
    for (int m = 0; m < power; ++m) choose = choose * (k - m) / (m + 1);
    controls[j] = symmetric[power] / choose;
  }
  return controls;
}

/// ∫ (q⁽ʳ⁾)² du by Simpson's rule on 256 parts of every piece.
double simpson_square(const SplineKnots& knots, const Eigen::VectorXd& controls, int order) {
  constexpr int kParts = 256;
  const SplineKnots inner = derivative_knots(knots, order);
  const Eigen::VectorXd t = derivative_controls(knots, controls, order);
  double sum = 0.0;
  for (int i = 0; i < knots.spans(); ++i) {
    const double a = knots.values[static_cast<std::size_t>(i + knots.degree)];
    const double h = (knots.values[static_cast<std::size_t>(i + knots.degree + 1)] - a) / kParts;
    for (int s = 0; s <= kParts; ++s) {
      // Just inside the piece, where the last derivative jumps at its ends.
      const double u = s == 0 ? a + 1e-12 : s == kParts ? a + kParts * h - 1e-12 : a + s * h;
      double value = 0.0;
      for (int j = i; j <= i + inner.degree; ++j)
        value += t[j] * test::cox_de_boor(inner.values, j, inner.degree, u);
      sum += h / 3.0 * (s == 0 || s == kParts ? 1.0 : s % 2 == 1 ? 4.0 : 2.0) * value * value;
    }
  }
  return sum;
}

TEST_CASE("derivative_gram: golden matrices of the reference", "[spline]") {
  const auto path = test::shared_path("reference/paper_b.json");
  if (!path) {
    WARN("no reference material: skipped");
    return;
  }
  const auto all = nlohmann::json::parse(std::ifstream(*path));
  for (const char* name : {"H_clamped_u01_n9", "H_clamped_unit_n9"}) {
    const auto& golden = all.at(name);
    const SymmetricBand gram = derivative_gram(SplineKnots{5, golden.at("knots")}, 3);
    REQUIRE(gram.size() == 10);
    CHECK(gram.half_width() == 5);
    const double largest = gram.band.cwiseAbs().maxCoeff();
    for (int i = 0; i < 10; ++i)
      for (int j = 0; j < 10; ++j) {
        const double exact =
            golden.at("H")[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
        CHECK(std::abs(gram.at(i, j) - exact) <= 1e-14 * std::abs(exact) + 2e-16 * largest);
      }
  }
}

TEST_CASE("derivative_gram: first rows of clamped unit spans in closed form", "[spline]") {
  // Rationals: 720, −2415/2, 19850/36, −1775/36, −163/12, −1.
  for (const SymmetricBand& gram :
       {derivative_gram(clamped_knots(5, 5), 3), jerk_gram_unit_spans(clamped_knots(5, 30))}) {
    CHECK(gram.at(0, 0) == Approx(720.0).epsilon(1e-14));
    CHECK(gram.at(0, 1) == Approx(-1207.5).epsilon(1e-14));
    CHECK(gram.at(0, 2) == Approx(19850.0 / 36).epsilon(1e-14));
    CHECK(gram.at(0, 3) == Approx(-1775.0 / 36).epsilon(1e-13));
    CHECK(gram.at(0, 4) == Approx(-163.0 / 12).epsilon(1e-13));
    CHECK(gram.at(0, 5) == Approx(-1.0).epsilon(1e-12));
    CHECK(gram.at(0, 6) == 0.0);
  }
}

TEST_CASE("derivative_gram: interior rows are the cardinal band", "[spline]") {
  const double band[] = {23.0 / 5, -11.0 / 4, 0.0, 5.0 / 8, -1.0 / 6, -1.0 / 120};
  const SymmetricBand quadrature = derivative_gram(clamped_knots(5, 40), 3);
  const SymmetricBand direct = jerk_gram_unit_spans(clamped_knots(5, 40));
  for (int j = 10; j < 25; ++j)
    for (int d = 0; d <= 5; ++d) {
      CHECK(std::abs(quadrature.at(j + d, j) - band[d]) < 5e-15);
      CHECK(direct.at(j, j + d) == band[d]);
    }
}

TEST_CASE("derivative_gram: polynomials of lower degree are its null space", "[spline]") {
  for (int degree = 1; degree <= kMaxSplineDegree; ++degree) {
    const SplineKnots knots = random_knots(degree, 9, 61u + degree);
    for (int order = 0; order <= degree; ++order) {
      const SymmetricBand gram = derivative_gram(knots, order);
      for (int power = 0; power <= degree; ++power) {
        const Eigen::VectorXd x = power_controls(knots, power);
        const double size = gram.band.cwiseAbs().maxCoeff() * x.cwiseAbs().maxCoeff();
        const double image = gram.times(x).cwiseAbs().maxCoeff();
        if (power < order)
          CHECK(image < 1e-13 * size);
        else
          CHECK(image > 1e-9 * size);
      }
    }
  }
}

TEST_CASE("derivative_gram: energy of a polynomial", "[spline]") {
  // ∫ ((u⁴)''')² over [0, 9] = 24² · 9³/3; ∫ ((u³)''')² = 36 · 9.
  const SymmetricBand gram = derivative_gram(clamped_knots(5, 9), 3);
  const Eigen::VectorXd fourth = power_controls(clamped_knots(5, 9), 4);
  const Eigen::VectorXd third = power_controls(clamped_knots(5, 9), 3);
  CHECK(fourth.dot(gram.times(fourth)) == Approx(576.0 * 729.0 / 3.0));
  CHECK(third.dot(gram.times(third)) == Approx(324.0));
}

TEST_CASE("derivative_gram: the integral of the squared derivative", "[spline]") {
  for (int degree : {1, 3, 5, 7}) {
    const SplineKnots knots = random_knots(degree, 5, 90u + degree);
    const Eigen::VectorXd x = random_controls(knots.controls(), 7);
    for (int order = 0; order <= degree; ++order) {
      const double energy = x.dot(derivative_gram(knots, order).times(x));
      CHECK(energy == Approx(simpson_square(knots, x, order)).epsilon(1e-7));
    }
  }
}

TEST_CASE("derivative_gram: that of the derivative's basis between the D matrices", "[spline]") {
  for (int degree = 1; degree <= kMaxSplineDegree; ++degree) {
    const SplineKnots knots = random_knots(degree, 8, 23u + degree);
    for (int order = 0; order <= degree; ++order) {
      const Eigen::MatrixXd whole = dense(derivative_gram(knots, order));
      const Eigen::MatrixXd inner = dense(derivative_gram(derivative_knots(knots, order), 0));
      const Eigen::MatrixXd d = derivative_matrix(knots, order);
      CHECK((whole - d.transpose() * inner * d).cwiseAbs().maxCoeff() <
            1e-13 * whole.cwiseAbs().maxCoeff());
    }
  }
}

TEST_CASE("derivative_gram: knots that meet", "[spline]") {
  SplineKnots knots = clamped_knots(5, 8);
  knots.values[8] = knots.values[7];
  const Eigen::VectorXd x = random_controls(knots.controls(), 7);
  const double energy = x.dot(derivative_gram(knots, 3).times(x));
  double sum = 0.0;  // midpoints
  for (int i = 0; i < 80000; ++i) sum += std::pow(bspline_value(knots, x, (i + 0.5) / 1e4, 3), 2);
  CHECK(energy == Approx(sum / 1e4).epsilon(1e-6));
}

TEST_CASE("jerk_gram_unit_spans: derivative_gram for any number of spans", "[spline]") {
  for (int spans : {1, 2, 3, 5, 8, 9, 10, 11, 12, 13, 17, 40, 623, 5000}) {
    const SplineKnots knots = clamped_knots(5, spans);
    const SymmetricBand quadrature = derivative_gram(knots, 3);
    const SymmetricBand direct = jerk_gram_unit_spans(knots);
    REQUIRE(direct.size() == quadrature.size());
    REQUIRE(direct.half_width() == quadrature.half_width());
    CHECK((direct.band - quadrature.band).cwiseAbs().maxCoeff() < 1e-13);
  }
}

TEST_CASE("SymmetricBand: at and times", "[spline]") {
  const SymmetricBand gram = derivative_gram(random_knots(3, 6, 1), 1);
  const Eigen::MatrixXd all = dense(gram);
  CHECK((all - all.transpose()).cwiseAbs().maxCoeff() == 0.0);
  const Eigen::VectorXd x = random_controls(gram.size(), 2);
  CHECK((all * x - gram.times(x)).cwiseAbs().maxCoeff() < 1e-14);
  CHECK(gram.at(0, 4) == 0.0);
  CHECK_THROWS_AS(gram.at(0, gram.size()), ContractViolation);
  CHECK_THROWS_AS(gram.at(-1, 0), ContractViolation);
  CHECK_THROWS_AS(gram.times(Eigen::VectorXd::Zero(3)), ContractViolation);
}

TEST_CASE("derivative_gram: preconditions", "[spline]") {
  CHECK_THROWS_AS(derivative_gram(clamped_knots(5, 4), 6), ContractViolation);
  CHECK_THROWS_AS(derivative_gram(clamped_knots(5, 4), -1), ContractViolation);
  CHECK_THROWS_AS(derivative_gram(SplineKnots{1, {0, 1, 2, 3}}, 1), ContractViolation);
  CHECK_THROWS_AS(jerk_gram_unit_spans(clamped_knots(4, 4)), ContractViolation);
  CHECK_THROWS_AS(jerk_gram_unit_spans(random_knots(5, 4, 1)), ContractViolation);
}

}  // namespace
}  // namespace smoothpost
