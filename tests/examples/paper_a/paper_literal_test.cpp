#include "examples/paper_a/paper_literal.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/support.h"

namespace smoothpost::paper_a {
namespace {

/// A cell of Table 2 or 3 as printed, with the last printed digit's place.
struct Printed {
  double eps = 0.0;
  std::size_t corner = 0;
  double e = 0.0, e_digit = 0.0, kappa = 0.0, lambda = 0.0, lambda_digit = 0.0;
};

constexpr std::array<Printed, 6> kTipRows = {{
    {0.8, 1, 5.4858e-06, 1e-10, 0.48, -5.4e-4, 1e-5},
    {0.8, 2, 2.3160e-06, 1e-10, 0.51, -1.4e-4, 1e-5},
    {0.8, 3, 3.9818e-05, 1e-9, 0.47, 5.3e-4, 1e-5},
    {1.2, 1, 1.8557e-05, 1e-9, 0.48, -8.1e-4, 1e-5},
    {1.2, 2, 7.8179e-06, 1e-10, 0.51, -2.2e-4, 1e-5},
    {1.2, 3, 1.3406e-04, 1e-8, 0.47, 7.9e-4, 1e-5},
}};
// Corner 3 at 0.01: the paper prints lambda +3.0e-3; Table 3 and the formula say minus.
constexpr std::array<Printed, 6> kAngleRows = {{
    {0.01, 1, 2.2647e-11, 1e-15, 0.46, -2.4e-3, 1e-4},
    {0.01, 2, 1.2184e-10, 1e-14, 0.49, 7.2e-3, 1e-4},
    {0.01, 3, 2.8408e-11, 1e-15, 0.47, -3.0e-3, 1e-4},
    {0.005, 1, 2.8111e-12, 1e-16, 0.46, -1.2e-3, 1e-4},
    {0.005, 2, 1.5905e-11, 1e-15, 0.49, 3.6e-3, 1e-4},
    {0.005, 3, 3.5244e-12, 1e-16, 0.47, -1.5e-3, 1e-4},
}};

void check_row(const LiteralCorner& corner, const Printed& row) {
  INFO(row.eps << " corner " << row.corner);
  const LiteralFit fit = literal_fit(corner, SignOfM2::of_the_tables);
  CHECK(std::abs(fit.shape.kappa - row.kappa) <= 0.5 * 0.01);
  CHECK(std::abs(fit.shape.lambda - row.lambda) <= 0.51 * row.lambda_digit);
  CHECK(std::abs(fit.error - row.e) <= 0.55 * row.e_digit);
}

}  // namespace

TEST_CASE("paper_literal: Tables 2 and 3 to their printed digits", "[examples][paper]") {
  for (const Printed& row : kTipRows) check_row(tip_corner(row.corner, row.eps), row);
  for (const Printed& row : kAngleRows) check_row(angle_corner(row.corner, row.eps), row);
}

TEST_CASE("paper_literal: golden lengths and fits of all twelve corners", "[examples][paper]") {
  const auto path = test::shared_path("reference/paper_a.json");
  if (!path) {
    WARN("no shared reference files: skipped");
    return;
  }
  const auto golden = nlohmann::json::parse(std::ifstream(*path));
  int compared = 0;
  for (const auto& g : golden.at("paper_path")) {
    const auto number = g.at("corner").get<std::size_t>();
    const double eps = g.at("eps").get<double>();
    const LiteralCorner corner =
        g.at("kind") == "position" ? tip_corner(number, eps) : angle_corner(number, eps);
    CHECK(corner.length == Approx(g.at("L").get<double>()).epsilon(1e-11));
    for (const auto sign : {SignOfM2::of_the_tables, SignOfM2::printed}) {
      const auto& expected = g.at(sign == SignOfM2::printed ? "eq" : "authors");
      const LiteralFit fit = literal_fit(corner, sign);
      CHECK(fit.shape.kappa == Approx(expected.at("kappa").get<double>()).epsilon(1e-6));
      CHECK(fit.shape.lambda == Approx(expected.at("lam").get<double>()).epsilon(1e-6));
      CHECK(fit.error == Approx(expected.at("e").get<double>()).epsilon(1e-4));
    }
    ++compared;
  }
  CHECK(compared == 12);
}

TEST_CASE("paper_literal: with the printed sign lambda does not depend on the tolerance",
          "[examples][paper]") {
  for (std::size_t i = 1; i <= 3; ++i) {
    const auto fit = [&](double eps, SignOfM2 sign) {
      return literal_fit(tip_corner(i, eps), sign).shape.lambda;
    };
    CHECK(fit(0.8, SignOfM2::printed) == Approx(fit(1.2, SignOfM2::printed)).epsilon(1e-6));
    // The tables' lambda grows with the tolerance, which no optimum of a similar figure can.
    CHECK(fit(1.2, SignOfM2::of_the_tables) / fit(0.8, SignOfM2::of_the_tables) ==
          Approx(1.5).epsilon(0.01));
  }
}

TEST_CASE("paper_literal: a leg along the first coordinate stops the curve", "[examples][paper]") {
  LiteralCorner corner;
  corner.points = acr_corner_points(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), 1.0);
  const LiteralFit fit = literal_fit(corner, SignOfM2::printed);
  CHECK(std::abs(fit.shape.kappa) < 1e-12);
  CHECK(std::abs(fit.shape.lambda) < 1e-12);
}

TEST_CASE("paper_literal: tool axis and its Jacobian", "[examples][paper]") {
  for (const Vec3& angles : kAngles) {
    const Mat3 r = rotation_from_rpy(angles.z(), angles.y(), angles.x());
    CHECK((tool_axis(angles) - r.col(2)).norm() < 1e-15);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Vec3 step = 1e-6 * Vec3::Unit(k);
      const Vec3 difference = (tool_axis(angles + step) - tool_axis(angles - step)) / 2e-6;
      CHECK((difference - tool_axis_jacobian(angles).col(k)).norm() < 1e-9);
    }
  }
}

}  // namespace smoothpost::paper_a
