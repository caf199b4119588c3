#include "kernels/spline/chebyshev_path.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/core/contract.h"

using namespace smoothpost;

namespace {

PathValue vector2(double a, double b) { return Eigen::Vector2d(a, b); }

}  // namespace

TEST_CASE("chebyshev_path: values and three derivatives of analytic functions",
          "[kernels][spline]") {
  ChebyshevPath path;
  const auto f = [](double x) { return vector2(1000.0 + 30.0 * std::sin(3.0 * x), std::exp(-x)); };
  REQUIRE(path.append(f, 0.0, 2.0, {}));
  REQUIRE(path.append(f, 2.0, 5.0, {}));
  CHECK(path.from(0) == 0.0);
  CHECK(path.to(path.pieces() - 1) == 5.0);
  for (std::size_t i = 1; i < path.pieces(); ++i) CHECK(path.from(i) == path.to(i - 1));
  for (int k = 0; k <= 500; ++k) {
    const double x = 0.01 * k;
    const ChebyshevJet j = path.jet(path.piece_at(x), x);
    INFO("x = " << x);
    CHECK(std::abs(j[0][0] - f(x)[0]) < 1e-7);
    CHECK(std::abs(j[1][0] - 90.0 * std::cos(3.0 * x)) < 1e-4);
    CHECK(std::abs(j[2][0] + 270.0 * std::sin(3.0 * x)) < 1e-2);
    CHECK(std::abs(j[3][0] + 810.0 * std::cos(3.0 * x)) < 0.8);
    CHECK(std::abs(j[0][1] - std::exp(-x)) < 1e-9);
    CHECK(std::abs(j[3][1] + std::exp(-x)) < 1e-3);
    CHECK((path.value(path.piece_at(x), x) - j[0]).norm() < 1e-12 * j[0].norm());
  }
}

TEST_CASE("chebyshev_path: a polynomial of degree 9 is itself in one piece", "[kernels][spline]") {
  ChebyshevPath path;
  REQUIRE(path.append([](double x) { return vector2(std::pow(x, 9), 1.0 - x); }, -1.0, 1.0,
                      {1e30, 0.0}));
  REQUIRE(path.pieces() == 1);
  for (const double x : {-1.0, -0.3, 0.0, 0.8, 1.0}) {
    const ChebyshevJet j = path.jet(0, x);
    CHECK(j[0][0] == Approx(std::pow(x, 9)).margin(1e-13));
    CHECK(j[1][0] == Approx(9.0 * std::pow(x, 8)).margin(1e-11));
    CHECK(j[2][0] == Approx(72.0 * std::pow(x, 7)).margin(1e-10));
    CHECK(j[3][0] == Approx(504.0 * std::pow(x, 6)).margin(1e-8));
    CHECK(j[1][1] == Approx(-1.0).margin(1e-12));
    CHECK(j[3][1] == Approx(0.0).margin(1e-9));
  }
}

TEST_CASE("chebyshev_path: derivatives at a break belong to the piece that is asked",
          "[kernels][spline]") {
  ChebyshevPath path;
  REQUIRE(path.append([](double x) { return vector2(x, 0.0); }, 0.0, 1.0, {}));
  REQUIRE(
      path.append([](double x) { return vector2(1.0 + 3.0 * (x - 1.0), x * x); }, 1.0, 2.0, {}));
  CHECK(path.jet(0, 1.0)[1][0] == Approx(1.0));
  CHECK(path.jet(1, 1.0)[1][0] == Approx(3.0));
  CHECK(path.piece_at(1.0) == 1);
  CHECK(path.piece_at(-5.0) == 0);
  CHECK(path.piece_at(7.0) == 1);
}

TEST_CASE("chebyshev_path: a jump inside a piece is found and nothing is appended",
          "[kernels][spline]") {
  ChebyshevPath path;
  REQUIRE(path.append([](double x) { return vector2(x, x); }, 0.0, 1.0, {}));
  CHECK_FALSE(path.append([](double x) { return vector2(x < 1.3 ? 0.0 : 1.0, x); }, 1.0, 2.0, {}));
  CHECK(path.pieces() == 1);
  CHECK(path.to(0) == 1.0);
  // Wherever it is but beside the ends (the outermost points are 0.6 % inside), also where halving
  // ends beside it.
  for (int k = 3; k <= 397; ++k) {
    const double at = 1.0 + k / 400.0;
    INFO(at);
    CHECK_FALSE(
        path.append([at](double x) { return vector2(x < at ? 0.0 : 1e-4, x); }, 1.0, 2.0, {}));
  }
  CHECK_THROWS_AS(path.append([](double x) { return vector2(x, x); }, 1.0, 1.0, {}),
                  ContractViolation);
}

TEST_CASE("chebyshev_path: its tail is the same function moved", "[kernels][spline]") {
  ChebyshevPath path;
  const auto f = [](double x) { return vector2(std::sin(x), x * x); };
  REQUIRE(path.append(f, 0.0, 1.0, {}));
  const std::size_t first = path.pieces();
  REQUIRE(path.append(f, 1.0, 9.0, {}));
  const ChebyshevPath tail = path.tail(first, 1.0);
  CHECK(tail.from(0) == 0.0);
  CHECK(tail.to(tail.pieces() - 1) == 8.0);
  for (double x = 0.0; x <= 8.0; x += 0.1)
    CHECK((tail.value(tail.piece_at(x), x) - f(x + 1.0)).norm() < 1e-6);
}

namespace {

/// 1000 + 30 sin 3x and e^−x, with derivatives.
std::optional<ChebyshevJet> waves(double x) {
  const double s = 30.0 * std::sin(3.0 * x), c = 30.0 * std::cos(3.0 * x), e = std::exp(-x);
  return ChebyshevJet{vector2(1000.0 + s, e), vector2(3.0 * c, -e), vector2(-9.0 * s, e),
                      vector2(-27.0 * c, -e)};
}

double worst_error(const ChebyshevPath& path, std::size_t order, double from, double to) {
  double worst = 0.0;
  for (int k = 0; k <= 400; ++k) {
    const double x = from + (to - from) * k / 400.0;
    const ChebyshevJet jet = path.jet(path.piece_at(x), x);
    worst = std::max(worst, (jet[order] - (*waves(x))[order]).cwiseAbs().maxCoeff());
  }
  return worst;
}

}  // namespace

TEST_CASE("chebyshev_path: a function with derivatives keeps them, on pieces of any length",
          "[kernels][spline]") {
  const PathValue none = vector2(1e-9, 1e-9);
  const ChebyshevJetSettings close{1e-5, 1e-9, 24};
  ChebyshevPath path;
  REQUIRE(path.append_jets(waves, 0.0, 2.0, none, close));
  REQUIRE(path.append_jets(waves, 2.0, 2.0 + 1e-9, none, close));  // by values: noise of 1e14
  REQUIRE(path.append_jets(waves, 2.0 + 1e-9, 5.0, none, close));
  CHECK(worst_error(path, 0, 0.0, 5.0) < 1e-7);
  CHECK(worst_error(path, 1, 0.0, 5.0) < 1e-5);
  CHECK(worst_error(path, 2, 0.0, 5.0) < 1e-3);
  CHECK(worst_error(path, 3, 0.0, 5.0) < 2e-2);
  CHECK(worst_error(path, 3, 2.0, 2.0 + 1e-9) < 1e-5);
}

TEST_CASE("chebyshev_path: a polynomial of degree 9 with derivatives is one piece",
          "[kernels][spline]") {
  ChebyshevPath path;
  const auto f = [](double x) {
    return std::optional(
        ChebyshevJet{vector2(std::pow(x, 9), 1.0 - x), vector2(9.0 * std::pow(x, 8), -1.0),
                     vector2(72.0 * std::pow(x, 7), 0.0), vector2(504.0 * std::pow(x, 6), 0.0)});
  };
  REQUIRE(path.append_jets(f, -1.0, 1.0, vector2(1e30, 1e30), {}));
  REQUIRE(path.pieces() == 1);
  for (const double x : {-1.0, -0.3, 0.0, 0.8, 1.0})
    for (std::size_t r = 0; r < 4; ++r)
      CHECK((path.jet(0, x)[r] - (*f(x))[r]).norm() < 1e-12 * std::pow(10.0, r));
}

TEST_CASE("chebyshev_path: jumps of value and slope between equal third derivatives are found",
          "[kernels][spline]") {
  const auto zigzag = [](double slope, double jump) {
    return [=](double x) {
      const double behind = x < 0.37 ? 0.0 : 1.0;
      return std::optional(ChebyshevJet{vector2(x + behind * (slope * (x - 0.37) + jump), 0.0),
                                        vector2(1.0 + behind * slope, 0.0), vector2(0.0, 0.0),
                                        vector2(0.0, 0.0)});
    };
  };
  ChebyshevPath path;
  const PathValue third = vector2(1.0, 1.0);
  CHECK(path.append_jets(zigzag(0.0, 0.0), 0.0, 1.0, third, {}));
  CHECK_FALSE(path.append_jets(zigzag(0.1, 0.0), 0.0, 1.0, third, {}));
  CHECK_FALSE(path.append_jets(zigzag(0.0, 1e-3), 0.0, 1.0, third, {}));
  for (double end = 0.38; end < 3.0; end += 0.0137) {
    INFO(end);
    ChebyshevPath other;
    CHECK_FALSE(other.append_jets(zigzag(0.0, 1e-3), 0.0, end, third, {}));
  }
  CHECK_FALSE(
      path.append_jets([](double) { return std::optional<ChebyshevJet>(); }, 1.0, 2.0, third, {}));
  CHECK(path.pieces() == 1);
}
