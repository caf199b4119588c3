#include "postproc/report/report_json.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

using namespace smoothpost;

namespace {

Conversion sample() {
  Conversion c;
  c.verdict = Verdict::certified;
  c.program = "%\nG0 X1\n%\n";
  c.not_checked = {"clearance"};
  Check check;
  check.name = "tip_deviation";
  check.value = 0.00123456789012345;
  check.limit = 0.01;
  check.unit = "mm";
  check.input_line = 7;
  c.checks.push_back(check);
  c.stages.push_back({"read", 0.25});
  return c;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("report_json: keys of schema 1, nine digits, stages only with timings",
          "[postproc][report]") {
  ReportContext context;
  context.machine = "m";
  const std::string text = report_json(sample(), context);
  for (const char* key :
       {"\"schema\": 1", "\"tool\"", "\"machine\": \"m\"", "\"dialect\"",
        "\"verdict\": \"certified\"", "\"level\": \"geometry\"", "\"assumes\"", "\"not_checked\"",
        "\"budget_mm\"", "\"input_sha256\"", "\"cutter_locations\"", "\"length_mm\"", "\"checks\"",
        "\"axes\"", "\"time_s\"", "\"diagnostics\"", "\"value\": 0.00123456789",
        "\"input_line\": 7"})
    CHECK(contains(text, key));
  CHECK_FALSE(contains(text, "stages"));
  CHECK_FALSE(contains(text, "0.0012345678901"));
  context.timings = true;
  CHECK(contains(report_json(sample(), context), "\"stages\""));
}

TEST_CASE("report_json: what is not a number is null, what is not UTF-8 does not lose the report",
          "[postproc][report]") {
  Conversion c = sample();
  c.checks[0].value = std::numeric_limits<double>::infinity();
  Diagnostic d;
  d.text = "bad \xff byte";
  c.diagnostics.push_back(d);
  const std::string text = report_json(c, {});
  CHECK(contains(text, "\"value\": null"));
  CHECK(contains(text, "bad"));
  CHECK_FALSE(contains(text, "inf"));
}

TEST_CASE("changed_checks: verdicts, values, new and absent checks", "[postproc][report]") {
  const std::string before = report_json(sample(), {});
  CHECK(changed_checks(before, before, 0.0).empty());
  Conversion other = sample();
  other.checks[0].value *= 1.01;
  CHECK(contains(changed_checks(before, report_json(other, {}), 0.0), "tip_deviation"));
  CHECK(changed_checks(before, report_json(other, {}), 0.05).empty());
  other.checks[0].ok = false;
  CHECK(contains(changed_checks(before, report_json(other, {}), 0.05), "FAILED"));
  other = sample();
  other.checks[0].name = "axis_deviation";
  const std::string renamed = changed_checks(before, report_json(other, {}), 0.05);
  CHECK(contains(renamed, "now absent"));
  CHECK(contains(renamed, "new"));
  other = sample();
  other.verdict = Verdict::refused;
  CHECK(contains(changed_checks(before, report_json(other, {}), 0.05), "verdict"));
  CHECK_FALSE(changed_checks("", before, 0.05).empty());
}

TEST_CASE("line_map_json: one row a motion", "[postproc][report]") {
  const std::string text = line_map_json(
      {{12, 3, MoveRole::path, 4, 2, 0.25, 1.0}, {13, 0, MoveRole::link, 0, 0, 0, 1}}, "a\"b");
  CHECK(contains(text, "[12,3,\"path\",4,0.25,1,2]"));
  CHECK(contains(text, "[13,0,\"link\",0,0,1,0]"));
  CHECK(contains(text, "\"a\\\"b\""));
}
