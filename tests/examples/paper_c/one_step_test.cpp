#include "examples/paper_c/one_step.h"

#include <catch2/catch.hpp>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/support/support.h"

using namespace smoothpost;
using namespace smoothpost::paper_c;

namespace {

std::map<std::string, Contour> contours() {
  return {{"cross1", cross(90, 34, 10)},
          {"cross2", cross(150, 48, 15)},
          {"ellipse1", ellipse(50, 35)},
          {"ellipse2", ellipse(75, 45)}};
}

}  // namespace

TEST_CASE("paper_c: contours have their derivatives and lengths", "[examples][paper]") {
  CHECK(cross(90, 34, 10).length() == Approx(308.495559215).epsilon(1e-11));
  CHECK(cross(150, 48, 15).length() == Approx(522.743338823).epsilon(1e-11));
  CHECK(ellipse(50, 35).length() == Approx(269.118449074).epsilon(1e-11));
  for (const auto& [name, contour] : contours()) {
    CAPTURE(name);
    for (double s = 1.234; s < contour.length() - 1; s += 7.77) {
      bool smooth = true;  // no break nearby
      for (const double b : contour.breaks) smooth = smooth && std::abs(s - b) > 0.01;
      if (!smooth) continue;
      const LocationJet at = contour.at(s);
      CHECK(at.axis.col(0).norm() == Approx(1.0));
      CHECK(at.tip.col(1).norm() == Approx(1.0));
      CHECK(std::abs(at.tip.col(1).dot(at.axis.col(0))) < 1e-12);
      const double h = 1e-3;
      const LocationJet up = contour.at(s + h), down = contour.at(s - h);
      for (int r = 0; r < 3; ++r) {
        CHECK(((up.tip.col(r) - down.tip.col(r)) / (2 * h) - at.tip.col(r + 1)).norm() < 1e-7);
        CHECK(((up.axis.col(r) - down.axis.col(r)) / (2 * h) - at.axis.col(r + 1)).norm() < 1e-7);
      }
    }
  }
}

// Orientation: no free parameter. The figures of the paper, rms and peak in nrad.
TEST_CASE("paper_c: orientation errors of Table 2 are those of one linear step",
          "[examples][paper]") {
  const std::map<std::string, std::pair<double, double>> printed{
      {"cross1", {2.04, 2.62}}, {"cross2", {0.57, 0.77}}, {"ellipse1", {0.07, 0.17}}};
  for (const auto& [name, contour] : contours()) {
    const auto paper = printed.find(name);
    if (paper == printed.end()) continue;
    CAPTURE(name);
    const OneStep found = one_step_scheme(contour, {});
    // To 2 %, or to the last printed digit where that is coarser.
    CHECK(found.orientation_rms * 1e9 ==
          Approx(paper->second.first).margin(std::max(0.02 * paper->second.first, 0.005)));
    CHECK(found.orientation_peak * 1e9 ==
          Approx(paper->second.second).margin(std::max(0.02 * paper->second.second, 0.0075)));
  }
}

TEST_CASE("paper_c: one-step errors as in the reference data", "[examples][paper]") {
  const auto file = test::shared_path("reference/paper_c.json");
  if (!file) {
    WARN("no shared reference files: skipped");
    return;
  }
  const auto golden =
      nlohmann::json::parse(test::read_bytes(*file)).at("table2_like_Le90").at("data");
  for (const auto& [name, contour] : contours())
    for (const double unit : {1.0, 1000.0})
      for (const TwistKind kind :
           {TwistKind::skew, TwistKind::skew_spatial, TwistKind::logarithm}) {
        if (name != "cross1" && (unit != 1.0 || kind == TwistKind::logarithm)) continue;
        OneStepSettings settings;
        settings.length_unit = unit;
        settings.twist = kind;
        const OneStep found = one_step_scheme(contour, settings);
        const auto& row =
            golden.at(name + "|" + to_string(kind) + "|" + (unit == 1.0 ? "mm" : "m"));
        CAPTURE(name, to_string(kind), unit);
        CHECK(found.steps.size() == row.at("N").get<std::size_t>());
        CHECK(found.position_rms * 1e6 == Approx(row.at("pos_nm_rms").get<double>()).epsilon(1e-3));
        CHECK(found.position_peak * 1e6 ==
              Approx(row.at("pos_nm_max").get<double>()).epsilon(1e-3));
        CHECK(found.orientation_rms * 1e9 ==
              Approx(row.at("ori_nrad_rms").get<double>()).epsilon(1e-3).margin(1e-4));
      }
}

TEST_CASE("paper_c: the closed form is exact", "[examples][paper]") {
  for (const auto& [name, contour] : contours()) {
    const OneStep found = closed_form(contour, {});
    CHECK(found.position_peak < 1e-9);
    CHECK(found.orientation_peak < 1e-12);
  }
}
