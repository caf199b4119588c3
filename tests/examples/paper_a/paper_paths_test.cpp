#include "examples/paper_a/paper_paths.h"

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>

#include "examples/paper_a/joint_jerk.h"
#include "machines/definition/machine_file.h"
#include "tests/support/support.h"

namespace smoothpost::paper_a {
namespace {

constexpr auto kSign = SignOfM2::of_the_tables;

std::array<double, 3> jerk(const auto& path, const SixR& arm) {
  constexpr std::array<double, 3> kTimes = {1e-3, 4e-4, 2e-4};
  std::array<double, 3> peak{};
  for (std::size_t i = 0; i < 3; ++i)
    peak[i] = peak_joint_jerk(arm, sample(path, 30.0 * kTimes[i]), kTimes[i], {});
  return peak;
}

}  // namespace

TEST_CASE("paper_paths: the literal links are not synchronous", "[examples][paper]") {
  for (const Tolerances& t : {Tolerances{0.8, 0.01}, {1.2, 0.005}}) {
    const auto e = synchronisation(paper_path(t, kSign, Links::literal));
    CHECK(e.at_junctions[0] > 0.2 * e.peak[0]);
  }
}

TEST_CASE("paper_paths: septic links are synchronous", "[examples][paper]") {
  for (const Tolerances& t : {Tolerances{0.8, 0.01}, {1.2, 0.005}}) {
    const auto e = synchronisation(paper_path(t, kSign, Links::septic));
    CHECK(e.at_junctions[0] < 1e-11 * e.peak[0]);
    CHECK(e.at_junctions[1] < 1e-9 * e.peak[1]);
    CHECK(e.at_junctions[2] < 1e-8 * e.peak[2]);
  }
}

TEST_CASE("paper_paths: CornerPath is synchronous without links", "[examples][paper]") {
  for (const Tolerances& t : {Tolerances{0.8, 0.01}, {1.2, 0.005}})
    for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
      const auto e = synchronisation(common_parameter(t, kind));
      for (std::size_t k = 0; k < 3; ++k) CHECK(e.at_junctions[k] < 1e-12 * e.peak[k]);
    }
}

TEST_CASE("paper_paths: the ramp bends at least 2.3 times less than the printed ACR",
          "[examples][paper]") {
  for (const Tolerances& t : {Tolerances{0.8, 0.01}, {1.2, 0.005}}) {
    const double printed = peak_curvature(paper_path(t, kSign, Links::literal));
    CHECK(printed > 2.3 * peak_curvature(common_parameter(t, BlendKind::ramp)));
    CHECK(printed > peak_curvature(common_parameter(t, BlendKind::acr)));
  }
  // Measured by the independent check: 12.82 and 8.55.
  CHECK(peak_curvature(paper_path({0.8, 0.01}, kSign, Links::literal)) ==
        Approx(12.82).epsilon(1e-3));
  CHECK(peak_curvature(paper_path({1.2, 0.005}, kSign, Links::literal)) ==
        Approx(8.55).epsilon(1e-3));
}

TEST_CASE("joint_jerk: polyline and literal path diverge and CornerPath converges",
          "[examples][paper]") {
  std::ifstream file(test::source_path("machines/robot_6r/machine.toml"));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto arm = SixR::from(chain_of(parse_machine_file(text, "robot_6r").value(), 100.0));
  REQUIRE(arm);
  const Tolerances t{0.8, 0.01};
  const auto line = jerk(polyline(), *arm);
  const auto literal = jerk(paper_path(t, kSign, Links::literal), *arm);
  REQUIRE(line[0] > 0.0);
  CHECK(line[2] > 3.0 * line[1]);
  CHECK(literal[2] > 1.8 * literal[1]);
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    const auto ours = jerk(common_parameter(t, kind), *arm);
    REQUIRE(ours[0] > 0.0);
    CHECK(ours[2] < 1.1 * ours[1]);
    CHECK(literal[2] > 5.0 * ours[2]);
    CHECK(line[2] > 50.0 * ours[2]);
  }
}

}  // namespace smoothpost::paper_a
