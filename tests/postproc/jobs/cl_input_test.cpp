#include <catch2/catch.hpp>

#include "kernels/core/units.h"
#include "postproc/jobs/job.h"
#include "postproc/jobs/settings.h"
#include "postproc/pipeline/interpret.h"
#include "postproc/pipeline/registry.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

const char* const kProgram =
    "LOADTL/1\nSPINDL/5000,RPM,CLW\nRAPID\nGOTO/0,0,1\nGOTO/0.4,0,0\n"
    "CIRCLE/0.4,0.4,0,0,0,1\nGOTO/0.8,0.4,0,0.1,0,0.99498744\nSPINDL/OFF\nFINI\n";

Options convert(const std::string& text) {
  Options o;
  o.command = "convert";
  o.input = "part.apt";
  o.input_data = text;
  o.machine = test::source_path("machines/table_table_bc/machine.toml").string();
  o.tool = {"1=60"};
  o.output = "-";
  return o;
}

bool has(const Diagnostics& diagnostics, const std::string& code) {
  for (const auto& d : diagnostics)
    if (d.code == code) return true;
  for (const auto& d : diagnostics) UNSCOPED_INFO(to_string(d));
  return false;
}

}  // namespace

TEST_CASE("cl input: unit and feed are the user's word", "[postproc][jobs][cl]") {
  Options o = convert(kProgram);
  JobResult result = run_job(o, {});
  CHECK(static_cast<int>(result.status) == 4);
  CHECK(has(result.diagnostics, "CL111"));
  o.input_unit = "inch";
  result = run_job(o, {});
  CHECK(static_cast<int>(result.status) == 4);
  CHECK(has(result.diagnostics, "CL114"));
  o.input_feed = "600";
  result = run_job(o, {});
  INFO(result.report);
  CHECK(static_cast<int>(result.status) == 0);
  CHECK(result.report.find("one unit of length is 25.4 mm: the user's word") != std::string::npos);
  CHECK(result.report.find("the feed is 600 mm/min: the user's word") != std::string::npos);
  CHECK(result.report.find("\"format\": \"cl\"") != std::string::npos);
}

TEST_CASE("cl input: options that mean nothing are refused", "[postproc][jobs][cl]") {
  const auto code_of = [](std::string Options::*option, const char* text) {
    Options o = convert(kProgram);
    o.*option = text;
    const auto read = read_cl_options(o);
    return read.ok() ? std::string() : read.diagnostics().front().code;
  };
  CHECK(code_of(&Options::input_unit, "cm") == "US162");
  CHECK(code_of(&Options::input_unit, "mm").empty());
  CHECK(code_of(&Options::input_feed, "fast") == "US163");
  CHECK(code_of(&Options::input_feed, "0") == "US163");
  CHECK(code_of(&Options::input_feed, "1e9") == "US163");
  CHECK(code_of(&Options::cl_frames, "all") == "US164");
  CHECK(code_of(&Options::cl_circles, "left") == "US165");
  Options o = convert(kProgram);
  o.input_unit = "inch";
  o.input_feed = "600";
  o.cl_frames = "applied";
  o.cl_circles = "ccw";
  const auto read = read_cl_options(o);
  REQUIRE(read.ok());
  CHECK(read.value().unit == kMillimetresPerInch);
  CHECK(read.value().feed == 10.0);
  CHECK(read.value().frames == cl::FrameRule::applied);
  CHECK(read.value().nx_circles == cl::NxCircleSense::counter_clockwise);
}

TEST_CASE("cl input: the path is tip and axis in the part", "[postproc][jobs][cl]") {
  InputSettings settings;
  settings.file_name = "part.apt";
  settings.cl.unit = 25.4;
  settings.cl.feed = 10.0;
  settings.tool_lengths[1] = 60.0;
  const auto read = interpret_cl(kProgram, settings);
  REQUIRE(read.ok());
  const InterpretedInput& input = read.value();
  REQUIRE(input.path.points.size() == 3);
  CHECK((input.path.points[0].location.tip - Vec3(0, 0, 25.4)).norm() < 1e-9);
  CHECK((input.path.points[1].location.tip - Vec3(10.16, 0, 0)).norm() < 1e-9);
  const PathPoint& end = input.path.points[2];
  CHECK(end.is_arc);
  CHECK(end.line == 7);
  CHECK(end.tool == 1);
  CHECK(end.tool_length == 60.0);
  CHECK(end.interpolation == PathInterpolation::great_circle);
  CHECK((end.location.tip - Vec3(20.32, 10.16, 0)).norm() < 1e-9);
  CHECK(end.location.axis.x() == Approx(0.1).margin(1e-7));
  CHECK(end.duration == Approx(10.16 * 0.5 * kPi / 10.0));
  // Half way along the quarter and along the great circle of the axis.
  const ReferencePath reference(input.path, input.frames);
  const CutterLocation middle = reference.at(2, 0.5);
  const double corner = 10.16 * std::sqrt(0.5);
  CHECK((middle.tip - Vec3(10.16 + corner, 10.16 - corner, 0)).norm() < 1e-9);
  CHECK(angle_between(middle.axis, Vec3::UnitZ()) ==
        Approx(0.5 * angle_between(end.location.axis, Vec3::UnitZ())));
  CHECK(input.path.events.size() == 3);
  CHECK(input.uses_tools);
}

TEST_CASE("cl input: rows of a process file", "[postproc][jobs][cl]") {
  InputSettings settings;
  settings.cl.unit = 1.0;
  settings.cl.feed = 10.0;
  const auto table = parse_process_file(
      "[process]\nunmapped = \"comment\"\n[process.events]\nbeam_on = \"AUXFUN/10\"\n"
      "beam_off = \"AUXFUN/11\"\nmessage = \"PPRINT/{text}\"\n",
      "process.toml");
  for (const auto& d : table.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(table.ok());
  settings.process = table.value();
  const auto read = interpret_cl(
      "GOTO/0,0,5\nAUXFUN/10\nGOTO/5,0,5\nPPRINT half way\nINSERT/G4 F1\nGOTO/9,0,5\nAUXFUN/11\n"
      "FINI\n",
      settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  const ToolPath& path = read.value().path;
  REQUIRE(path.events.size() == 4);
  CHECK(path.events[0].event.name == "beam_on");
  CHECK(path.events[1].event.parameters.front().second == "half way");
  CHECK(path.events[2].text == "unmapped: INSERT/G4 F1");
  CHECK(path.events[3].event.name == "beam_off");
  REQUIRE(path.points.size() == 3);
  CHECK_FALSE(path.points[0].beam);
  CHECK(path.points[1].beam);
  CHECK(path.points[2].beam);
  bool told = false;
  for (const auto& text : read.value().assumes)
    told = told || (text.find("without a mapping") != std::string::npos &&
                    text.find("lines 5") != std::string::npos);
  CHECK(told);
}

TEST_CASE("cl input: extensions", "[postproc][jobs][cl]") {
  for (const char* name :
       {"a.apt", "a.APTSOURCE", "a.as", "a.cl", "a.cls", "a.clsf", "a.ncl", "a.clf", "b/a.cld"}) {
    INFO(name);
    REQUIRE(format_by_extension(name) != nullptr);
    CHECK(std::string(format_by_extension(name)->name) == "cl");
  }
}
