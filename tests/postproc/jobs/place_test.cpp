#include "postproc/jobs/place.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "kernels/core/units.h"
#include "postproc/jobs/job.h"
#include "tests/support/support.h"

using namespace smoothpost;
namespace fs = std::filesystem;

namespace {

/// A closed contour of 300 x 200 mm at two depths, the tool leaning inwards, for the robot.
std::string contour_file() {
  const fs::path folder = fs::path(SMOOTHPOST_BINARY_DIR) / "place_test";
  fs::create_directories(folder);
  const fs::path file = folder / "contour.csv";
  std::ofstream out(file);
  out << "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n";
  const char* rows[] = {"0,0,0,0.19245,0.19245,0.96225",       "300,0,0,-0.19245,0.19245,0.96225",
                        "300,200,0,-0.19245,-0.19245,0.96225", "0,200,0,0.19245,-0.19245,0.96225",
                        "0,0,0,0.19245,0.19245,0.96225",       "150,0,-20,0,0.196116,0.980581",
                        "150,200,-20,0,-0.196116,0.980581"};
  for (const char* row : rows) out << row << ",3000\n";
  return file.string();
}

Options robot(const std::string& command) {
  Options o;
  o.command = command;
  o.input = contour_file();
  o.machine = test::source_path("machines/robot_6r/machine.toml").string();
  if (command == "convert") o.output = "-";
  return o;
}

Options mill_on_table(const std::string& command) {
  Options o;
  o.command = command;
  o.input = test::source_path("examples/mill_ac/mill_ac.ngc").string();
  o.input_machine = test::source_path("machines/table_table_ac/machine.toml").string();
  o.machine = test::source_path("machines/table_table_bc/machine.toml").string();
  o.tool = {"1=60"};
  if (command == "convert") o.output = "-";
  return o;
}

bool says(const JobResult& result, const std::string& code, const std::string& text) {
  for (const auto& d : result.diagnostics)
    if (d.code == code && d.text.find(text) != std::string::npos) return true;
  for (const auto& d : result.diagnostics) UNSCOPED_INFO(to_string(d));
  return false;
}

int status(const JobResult& result) {
  for (const auto& d : result.diagnostics) UNSCOPED_INFO(to_string(d));
  return static_cast<int>(result.status);
}

/// What `place` prints to be pasted.
std::string offset_in(const std::string& text) {
  const std::string lead = "--work-offset ";
  REQUIRE(text.rfind(lead, 0) == 0);
  return text.substr(lead.size(), text.find('\n') - lead.size());
}

/// The least value of a list of margins in a report.
double least_in(const std::string& report, const std::string& list) {
  std::size_t at = report.find("\"" + list + "\"", report.find("\"placement\""));
  REQUIRE(at != std::string::npos);
  const std::size_t end = report.find(']', at);
  double least = 1e9;
  while ((at = report.find("\"value\": ", at)) < end) {
    at += 9;
    least = std::min(least, std::stod(report.substr(at, 24)));
  }
  return least;
}

}  // namespace

TEST_CASE("place: a robot's contour out of reach comes to a certified program",
          "[postproc][jobs][place]") {
  Options bad = robot("convert");
  bad.work_offset = {"G54=1200,900,500"};
  REQUIRE(status(run_job(bad, {})) == 3);

  Options place = robot("place");
  place.work_offset = bad.work_offset;
  const JobResult found = run_job(place, {});
  REQUIRE(status(found) == 0);
  CHECK(found.program.empty());
  WARN(found.text);
  CHECK(least_in(found.report, "before") < 0.0);
  CHECK(least_in(found.report, "after") > 0.25);

  Options good = robot("convert");
  good.work_offset = {offset_in(found.text)};
  const JobResult program = run_job(good, {});
  CHECK(status(program) == 0);
  CHECK(program.verdict == "certified");
  CHECK(run_job(place, {}).text == found.text);
}

TEST_CASE("place: --work-offset auto says where the part has to stand", "[postproc][jobs][place]") {
  Options o = robot("convert");
  o.work_offset = {"auto"};
  o.box = "-200,-300,0,200,300,50";
  o.turn = "20";
  const JobResult program = run_job(o, {});
  REQUIRE(status(program) == 0);
  CHECK(program.verdict == "certified");
  std::string unwrapped = program.program;  // comments are broken into lines
  for (std::size_t at; (at = unwrapped.find("\n; ")) != std::string::npos;)
    unwrapped.replace(at, 3, " ");
  while (unwrapped.find("  ") != std::string::npos) unwrapped.erase(unwrapped.find("  "), 1);
  CHECK(unwrapped.find("the part has to stand there") != std::string::npos);
  CHECK(program.report.find("the part has to stand there") != std::string::npos);
  CHECK(program.report.find("\"work_offset\": \"G54=") != std::string::npos);
  o.command = "check";
  CHECK(says(run_job(o, {}), "US122", "auto"));
}

TEST_CASE("place: a five-axis table", "[postproc][jobs][place]") {
  Options bad = mill_on_table("convert");
  bad.work_offset = {"G54=380,0,0"};
  REQUIRE(status(run_job(bad, {})) == 3);
  Options place = mill_on_table("place");
  place.work_offset = bad.work_offset;
  const JobResult found = run_job(place, {});
  REQUIRE(status(found) == 0);
  CHECK(least_in(found.report, "before") < 0.0);
  CHECK(least_in(found.report, "after") > 0.0);
  Options good = mill_on_table("convert");
  good.work_offset = {offset_in(found.text)};
  CHECK(status(run_job(good, {})) == 0);
}

TEST_CASE("place: no place is a refusal that names what is tightest", "[postproc][jobs][place]") {
  Options o = robot("place");
  o.box = "3000,0,0,3500,100,50";
  const JobResult result = run_job(o, {});
  CHECK(static_cast<int>(result.status) == 3);
  CHECK(says(result, "KN141", "reach -"));
  CHECK(says(result, "KN141", "input line"));
  CHECK(result.text.empty());
  CHECK(result.report.find("\"found\": false") != std::string::npos);
}

TEST_CASE("place: options are read or refused", "[postproc][jobs][place]") {
  Options o;
  o.box = "-1,-2,-3,1,2.5,3";
  o.turn = "90";
  const auto read = read_place_options(o);
  REQUIRE(read.ok());
  CHECK((read.value().box->lower - Vec3(-1, -2, -3)).norm() == 0.0);
  CHECK((read.value().box->upper - Vec3(1, 2.5, 3)).norm() == 0.0);
  CHECK(read.value().turn == Approx(kPi / 2));
  CHECK(!read_place_options(Options()).value().box);
  for (const char* box :
       {"1,2,3", "1,2,3,4,5,6,7", "a,0,0,1,1,1", "0,0,2,1,1,1", "0,0,0,1,1,", ","}) {
    Options wrong;
    wrong.box = box;
    const auto result = read_place_options(wrong);
    CHECK(!result.ok());
    CHECK(result.diagnostics().front().code == "US160");
  }
  for (const char* turn : {"-1", "181", "x"}) {
    Options wrong;
    wrong.turn = turn;
    const auto result = read_place_options(wrong);
    CHECK(!result.ok());
    CHECK(result.diagnostics().front().code == "US161");
  }
  Options job = robot("place");
  job.turn = "x";
  CHECK(status(run_job(job, {})) == 2);
}

TEST_CASE("place: an offset is read back as it is printed", "[postproc][jobs][place]") {
  const OffsetOption offset{7, Vec3(120.5, -0.1, 0.0), Vec3(0.0, 0.0, -12.3 * kRadiansPerDegree)};
  const std::string text = work_offset_text(7, offset);
  CHECK(text == "G59.1=120.5,-0.1,0,0,0,-12.3");
  const auto read = read_offsets({text}, "--work-offset");
  REQUIRE(read.ok());
  CHECK(read.value().front().system == 7);
  CHECK((read.value().front().position - offset.position).norm() == 0.0);
  CHECK((read.value().front().turn - offset.turn).norm() < 1e-12);
}
