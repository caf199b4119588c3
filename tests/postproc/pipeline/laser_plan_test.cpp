#include "postproc/pipeline/laser_plan.h"

#include <catch2/catch.hpp>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "tests/support/machines.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

ConvertInput case_of(const std::string& csv, std::vector<MachineOverride> overrides) {
  ConvertInput in;
  InputSettings settings;
  settings.file_name = csv;
  auto read =
      interpret_csv(test::read_bytes(test::source_path("examples/paper_b/" + csv)), settings);
  REQUIRE(read.ok());
  in.input = std::move(read.value());
  in.input_name = csv;
  overrides.push_back({"tolerance.event_mm", "1"});
  in.machine = test::shipped_machine("laser_5p1", overrides);
  return in;
}

const Check& check_of(const Conversion& c, const std::string& name) {
  for (const Check& check : c.checks)
    if (check.name == name) return check;
  FAIL("no check " << name);
  return c.checks.front();
}

std::string codes(const Conversion& c) {
  std::string text;
  for (const Diagnostic& d : c.diagnostics) text += d.code + " ";
  return text;
}

}  // namespace

TEST_CASE("laser_plan: Case 2 uses its freedom and every programme has its certificate",
          "[postproc][pipeline][laser]") {
  const ConvertInput in =
      case_of("case2.csv", {{"tolerance.lead_deg", "15"}, {"tolerance.tilt_deg", "10"}});
  const Conversion c = convert(in, false, {});
  INFO(codes(c));
  REQUIRE(c.verdict == Verdict::certified);
  REQUIRE(c.stretches.size() == 1);
  const LaserStretch& s = c.stretches.front();
  CHECK(s.qp.size() == 5);  // three of the tip, rotary, standoff
  for (const QpReport& qp : s.qp) {
    CHECK(qp.solver == (qp.name == "smooth" ? "banded" : "ipopt"));
    CHECK(qp.status == "optimal");
    CHECK(qp.kkt < 1e-7);
    CHECK(qp.violation < 1e-8);
  }
  for (std::size_t j = 0; j < c.schedule.peaks.size(); ++j) {
    const AxisDefinition& axis = in.machine.axes[j];
    const JointPeaks& peak = c.schedule.peaks[j];
    INFO(axis.name);
    CHECK(peak.velocity <= in.machine.tolerance.limit_share * axis.velocity);
    CHECK(peak.acceleration <= in.machine.tolerance.limit_share * axis.acceleration);
    CHECK(peak.jerk <= in.machine.tolerance.limit_share * axis.jerk);
  }
  CHECK(check_of(c, "lead_deviation").value > 10.0);  // it does use it
  CHECK(c.program == convert(in, false, {}).program);
}

TEST_CASE("laser_plan: the height follower's axis is held", "[postproc][pipeline][laser]") {
  const Conversion c = convert(case_of("case1.csv", {{"tolerance.lead_deg", "5"},
                                                     {"tolerance.tilt_deg", "5"},
                                                     {"standoff.following", "exclusive"}}),
                               false, {});
  INFO(codes(c));
  REQUIRE(c.verdict == Verdict::certified);
  CHECK(codes(c).find("KN156") != std::string::npos);
  const int w = 5;
  for (const ReadBackMove& move : c.read.moves)
    if (move.known >> w & 1U) CHECK(move.to[w] == 0.0);
  CHECK(c.stretches.front().qp.size() == 4);
}

TEST_CASE("laser_plan: a kept axis on sharp bends keeps the programmed joints and says so",
          "[postproc][pipeline][laser]") {
  const Conversion c = convert(case_of("case2.csv", {}), false, {});
  INFO(codes(c));
  REQUIRE(c.verdict == Verdict::certified);
  CHECK(c.stretches.empty());
  CHECK(codes(c).find("KN151") != std::string::npos);
}

TEST_CASE("laser_plan: a feed that is too fast is refused with joint and line",
          "[postproc][pipeline][laser]") {
  const Conversion c = convert(case_of("case2.csv", {{"tolerance.lead_deg", "2"},
                                                     {"tolerance.tilt_deg", "2"},
                                                     {"recipe.schedule", "programmed"}}),
                               false, {});
  CHECK(c.verdict == Verdict::refused);
  CHECK(c.program.empty());
  REQUIRE(codes(c).find("KN152") != std::string::npos);
  for (const Diagnostic& d : c.diagnostics)
    if (d.code == "KN152") {
      CHECK(d.where.line > 0);
      CHECK(d.text.find("jerk") != std::string::npos);
    }
}

TEST_CASE("laser_plan: where nothing slows the schedule its shape stays as it is",
          "[postproc][pipeline][laser]") {
  const std::vector<MachineOverride> free = {{"tolerance.lead_deg", "5"},
                                             {"tolerance.tilt_deg", "5"}};
  std::vector<MachineOverride> never = free;
  never.push_back({"recipe.alternations", "0"});
  const Conversion c = convert(case_of("case1.csv", free), false, {});
  REQUIRE(c.verdict == Verdict::certified);
  CHECK(c.stretches.front().alternation.kept == 0);
  CHECK(c.program == convert(case_of("case1.csv", never), false, {}).program);
}
