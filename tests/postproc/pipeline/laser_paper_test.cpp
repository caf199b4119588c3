// Case 2 of paper B (two bends of 77 degrees inside 36 mm) with its part, through conversions at
// the full limits of Table 2. Least constant feeds by an independent linear programme: 11.5 m/min
// inside the cone of lead 15 and tilt 10 degrees, 10.05 m/min through the ten via points.
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "formats/mesh/stl_reader.h"
#include "kernels/geometry/weld.h"
#include "postproc/pipeline/convert.h"
#include "tests/support/machines.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

// At a feed that is so many times slower than that of the file.
std::optional<Conversion> case2(std::vector<MachineOverride> overrides, double slower = 1.0) {
  const auto csv = test::shared_path("reference/case2.csv");
  const auto stl = test::shared_path("reference/case2.stl");
  if (!csv || !stl) {
    WARN("no ../shared, not tested");
    return std::nullopt;
  }
  ConvertInput in;
  InputSettings settings;
  settings.file_name = "case2.csv";
  auto read = interpret_csv(test::read_bytes(*csv), settings);
  REQUIRE(read.ok());
  in.input = std::move(read.value());
  in.input_name = "case2.csv";
  for (PathPoint& point : in.input.path.points) point.duration *= slower;
  const auto mesh = read_stl(test::read_bytes(*stl), "case2.stl", {});
  REQUIRE(mesh.ok());
  in.part = weld(mesh.value().corners);
  in.part_name = "case2.stl";
  in.collision_check = false;  // the paper's head has no size; ours: clearance_check_test
  overrides.insert(overrides.begin(), {{"tolerance.lead_deg", "15"},
                                       {"tolerance.tilt_deg", "10"},
                                       {"tolerance.limit_share", "1"},
                                       {"recipe.schedule", "constant"}});
  in.machine = test::shipped_machine("laser_5p1", overrides);
  return convert(in, false, {});
}

double metres_a_minute(double mm_a_second) { return mm_a_second * 60.0 / 1000.0; }

const std::string kVia = "[100, 200, 236, 290, 340, 391, 427, 530]";

void check_programmes(const LaserStretch& s) {
  for (const QpReport& qp : s.qp) {
    INFO(qp.name);
    CHECK(qp.solver == (qp.name == "smooth" ? "banded" : "ipopt"));
    CHECK(qp.status == "optimal");
    CHECK(qp.kkt < 1e-7);
    CHECK(qp.violation < 1e-8);
  }
}

/// How often a rotary of the program turns back; at via points alone it may.
int turns_back(const Conversion& c, int joint) {
  int turns = 0;
  double way = 0.0;
  for (std::size_t k = 1; k < c.read.moves.size(); ++k) {
    if (!c.read.moves[k].beam || !c.read.moves[k - 1].beam) continue;
    const double step = c.read.moves[k].to[joint] - c.read.moves[k - 1].to[joint];
    if (std::abs(step) < 1e-7) continue;
    if (step * way < 0.0) ++turns;
    way = step;
  }
  return turns;
}

}  // namespace

TEST_CASE("laser_plan: Case 2 at full limits is certified at 11.3 m/min and more",
          "[postproc][pipeline][laser][paper]") {
  // The paper has no condition on the gap of the nozzle; with one the feed is lower (next case).
  const auto c = case2({{"tool.min_gap_mm", "0"}});
  if (!c) return;
  REQUIRE(c->verdict == Verdict::certified);
  REQUIRE(c->stretches.size() == 1);
  const LaserStretch& s = c->stretches.front();
  CHECK(metres_a_minute(s.feed) >= 11.3);
  CHECK(metres_a_minute(s.feed) <= 11.6);
  CHECK(s.slowed_by.find("jerk") != std::string::npos);
  check_programmes(s);
}

TEST_CASE("laser_plan: the gap of a tilted nozzle costs feed",
          "[postproc][pipeline][laser][paper]") {
  const auto c = case2({{"tool.min_gap_mm", "0.4"}});
  if (!c) return;
  REQUIRE(c->verdict == Verdict::certified);
  REQUIRE(c->stretches.size() == 1);
  const double feed = metres_a_minute(c->stretches.front().feed);
  CHECK(feed >= 10.0);
  CHECK(feed < 11.0);
}

TEST_CASE("laser_plan: via points alone reach their feed and are refused",
          "[postproc][pipeline][laser][paper]") {
  // Short blocks: with the usual ones the chord of the swinging head is what limits the feed.
  const auto c =
      case2({{"recipe.orientation", "via"}, {"recipe.via_mm", kVia}, {"cycle.min_block_ms", "1"}});
  if (!c) return;
  REQUIRE(c->stretches.size() == 1);
  const LaserStretch& s = c->stretches.front();
  CHECK(s.via_points == 10);
  CHECK(metres_a_minute(s.feed) >= 9.8);
  CHECK(metres_a_minute(s.feed) <= 10.1);
  check_programmes(s);
  CHECK(c->verdict == Verdict::refused);
}

TEST_CASE("laser_plan: monotone rotaries have a certified optimum",
          "[postproc][pipeline][laser][paper]") {
  const auto c = case2({{"recipe.orientation", "monotone"}, {"recipe.via_mm", kVia}});
  if (!c) return;
  REQUIRE(c->stretches.size() == 1);
  const LaserStretch& s = c->stretches.front();
  CHECK(s.via_points == 10);
  CHECK(s.slowed_by.find("turns back") != std::string::npos);
  check_programmes(s);
  CHECK(turns_back(*c, 3) <= 8);
  CHECK(turns_back(*c, 4) <= 8);
}

TEST_CASE("laser_plan: Case 2 by its schedule and with its shape made anew for it",
          "[postproc][pipeline][laser][paper]") {
  // What is smoothest at the largest constant feed takes 2.97 s; the reference has 2.8085 s for a
  // shape without limits of its own.
  const auto plain =
      case2({{"tool.min_gap_mm", "0"}, {"recipe.schedule", "jerk"}, {"recipe.alternations", "0"}});
  const auto anew = case2({{"tool.min_gap_mm", "0"}, {"recipe.schedule", "jerk"}});
  if (!plain || !anew) return;
  for (const Conversion* c : {&*plain, &*anew}) {
    REQUIRE(c->verdict == Verdict::certified);
    REQUIRE(c->stretches.size() == 1);
    check_programmes(c->stretches.front());
    const MachineDefinition machine = test::shipped_machine("laser_5p1", {});
    for (std::size_t j = 0; j < c->schedule.peaks.size(); ++j) {
      CHECK(c->schedule.peaks[j].velocity <= machine.axes[j].velocity);
      CHECK(c->schedule.peaks[j].acceleration <= machine.axes[j].acceleration);
      CHECK(c->schedule.peaks[j].jerk <= machine.axes[j].jerk);
    }
  }
  CHECK(plain->schedule.time <= 3.0);
  CHECK(plain->stretches.front().alternation.tried == 0);
  CHECK(anew->schedule.time <= 2.76);
  const AlternationReport& report = anew->stretches.front().alternation;
  CHECK(report.kept >= 1);
  CHECK(report.time_before == Approx(plain->schedule.time).epsilon(1e-3));
  CHECK(report.time_after == Approx(anew->schedule.time).epsilon(1e-3));
}

TEST_CASE("laser_plan: a shape that is no faster is not kept",
          "[postproc][pipeline][laser][paper]") {
  // At a feed that is hardly too fast one pass is all there is to gain: the next is tried and left
  // out.
  const auto all = case2({{"recipe.schedule", "jerk"}, {"recipe.alternations", "8"}}, 1.3);
  if (!all) return;
  REQUIRE(all->verdict == Verdict::certified);
  const AlternationReport report = all->stretches.front().alternation;
  REQUIRE(report.kept >= 1);
  CHECK(report.kept == report.tried - 1);
  const auto without = case2(
      {{"recipe.schedule", "jerk"}, {"recipe.alternations", std::to_string(report.kept)}}, 1.3);
  CHECK(without->program == all->program);
}
