#include "postproc/report/report_json.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

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

TEST_CASE("report_json: what was optimised in a cut", "[postproc][report]") {
  Conversion c = sample();
  CutSummary first, second, plain;
  first.label = "CUT 1";
  first.first = 2;
  first.last = 9;
  second.label = "CUT 2";
  second.first = 12;
  second.last = 20;
  plain.label = "CUT 3";
  plain.first = 22;
  plain.last = 23;
  c.cuts = {first, second, plain};
  LaserStretch a, b, d;
  a.first = 2;
  a.last = 5;
  a.feed = 100.0;
  a.programmed_feed = 250.0;
  a.control_points = 79;
  a.via_points = 2;
  a.passes = 6;
  a.normal_from_part = true;
  a.qp.push_back({"rotary", "ipopt", "optimal", 0.125, 11, 1, 1e-10, 2e-12});
  b = a;
  b.first = 6;
  b.last = 9;
  b.feed = 200.0;
  b.qp.clear();
  d.first = 12;
  d.last = 20;
  d.feed = 250.0;
  c.stretches = {a, b, d};
  AxisSummary axis;
  axis.name = "B";
  axis.peak_acceleration = 1.5;
  axis.peak_jerk = 2.5;
  axis.rms_jerk = 0.75;
  AxisSummary unknown;
  unknown.name = "C";
  c.axes = {axis, unknown};
  c.schedule.slowed_by = {{0, FeedWitness::Kind::jerk, 6, 8, 0.4, 2},
                          {1, FeedWitness::Kind::velocity, 9, 9, 0.75, 9},
                          {1, FeedWitness::Kind::acceleration, 30, 31, 0.5, 22}};
  const auto json = nlohmann::json::parse(report_json(c, {}));
  const auto& cut = json["cuts"][0];
  CHECK(cut["stretches"] == 2);
  CHECK(cut["control_points"] == 158);
  CHECK(cut["via_points"] == 4);
  CHECK(cut["passes"] == 12);
  CHECK(cut["normal"] == "part");
  CHECK(cut["feed_mm_per_min"] == 6000.0);
  REQUIRE(cut["qp"].size() == 1);
  CHECK(cut["qp"][0] == nlohmann::json({{"name", "rotary"},
                                        {"solver", "ipopt"},
                                        {"status", "optimal"},
                                        {"objective", 0.125},
                                        {"iterations", 11},
                                        {"windows", 1},
                                        {"kkt", 1e-10},
                                        {"violation", 2e-12}}));
  REQUIRE(cut["slowed_by"].size() == 2);
  CHECK(cut["slowed_by"][0]["joint"] == "B");
  CHECK(cut["slowed_by"][0]["limit"] == "jerk");
  CHECK(cut["slowed_by"][0]["input_lines"] == nlohmann::json({6, 8}));
  CHECK(cut["slowed_by"][0]["factor"] == 0.4);
  CHECK(cut["slowed_by"][1]["joint"] == "C");
  CHECK(cut["slowed_by"][1]["limit"] == "velocity");
  CHECK(json["cuts"][1]["normal"] == "programmed");
  CHECK(json["cuts"][1]["slowed_by"].empty());
  CHECK_FALSE(json["cuts"][2].contains("qp"));
  REQUIRE(json["cuts"][2]["slowed_by"].size() == 1);
  CHECK(json["cuts"][2]["slowed_by"][0]["limit"] == "acceleration");
  CHECK(json["axes"][0]["peak"]["acceleration"] == 1.5);
  CHECK(json["axes"][0]["peak"]["jerk"] == 2.5);
  CHECK(json["axes"][0]["rms_jerk"] == 0.75);
  CHECK(json["axes"][1]["peak"]["jerk"].is_null());
  CHECK(json["axes"][1]["rms_jerk"].is_null());
}

TEST_CASE("line_map_json: one row a motion", "[postproc][report]") {
  const std::string text = line_map_json(
      {{12, 3, MoveRole::path, 4, 2, 0.25, 1.0}, {13, 0, MoveRole::link, 0, 0, 0, 1}}, "a\"b");
  CHECK(contains(text, "[12,3,\"path\",4,0.25,1,2]"));
  CHECK(contains(text, "[13,0,\"link\",0,0,1,0]"));
  CHECK(contains(text, "\"a\\\"b\""));
}
