#include <catch2/catch.hpp>

#include "kernels/core/units.h"
#include "postproc/jobs/job.h"
#include "postproc/pipeline/interpret.h"
#include "postproc/pipeline/registry.h"
#include "tests/support/machines.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

const char* const kVectors =
    "0 BEGIN PGM PART MM\n1 TOOL CALL 1 Z S5000 F800\n2 M3 M8\n3 L M128\n"
    "4 LN X+0 Y+0 Z+20 TX+0 TY+0 TZ+1 FMAX\n5 LN Z+0,5 TX+0 TY+0 TZ+1\n"
    "6 LN X+10 TX+0.1 TY+0 TZ+0.995\n7 LN X+20 Y+5 TX+0.2 TY+0.1 TZ+0.9747\n"
    "8 LN Z+20 FMAX M9\n9 M5\n10 M30\n11 END PGM PART MM\n";

std::string machine_file(const char* name) {
  return test::source_path(std::string("machines/") + name + "/machine.toml").string();
}

Options convert(const std::string& text, const char* machine) {
  Options o;
  o.command = "convert";
  o.input = "part.h";
  o.input_data = text;
  o.machine = machine_file(machine);
  o.tool = {"1=60"};
  o.output = "-";
  return o;
}

std::string messages(const JobResult& result) {
  std::string out;
  for (const auto& d : result.diagnostics) out += to_string(d) + "\n";
  return out + result.report;
}

bool has(const JobResult& result, const std::string& code) {
  for (const auto& d : result.diagnostics)
    if (d.code == code) return true;
  return false;
}

InterpretedInput read_input(const std::string& text, const InputSettings& settings) {
  auto read = interpret_heidenhain(text, settings);
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  return std::move(read.value());
}

}  // namespace

TEST_CASE("heidenhain input: vectors become a certified program", "[postproc][jobs][heidenhain]") {
  for (const char* machine : {"table_table_bc", "robot_6r"}) {
    const JobResult result = run_job(convert(kVectors, machine), {});
    INFO(machine << "\n" << messages(result));
    CHECK(static_cast<int>(result.status) == 0);
    CHECK(result.report.find("\"format\": \"heidenhain\"") != std::string::npos);
    CHECK(result.report.find("great circles") != std::string::npos);
    CHECK_FALSE(result.program.empty());
  }
}

TEST_CASE("heidenhain input: how it is recognised", "[postproc][jobs][heidenhain]") {
  CHECK(std::string(format_by_extension("A/PART.H")->name) == "heidenhain");
  Options o = convert(kVectors, "table_table_bc");
  o.input = "part.nc";
  JobResult result = run_job(o, {});
  INFO(messages(result));
  CHECK(static_cast<int>(result.status) == 0);
  CHECK(has(result, "NC315"));
  o.input_dialect = "heidenhain";
  result = run_job(o, {});
  CHECK(static_cast<int>(result.status) == 0);
  CHECK_FALSE(has(result, "NC315"));
  o.input = "part.unknown";
  CHECK(static_cast<int>(run_job(o, {}).status) == 0);
  o.input_dialect = "linuxcnc";
  o.input = "part.nc";
  CHECK(static_cast<int>(run_job(o, {}).status) == 4);
}

TEST_CASE("heidenhain input: rotary words need the machine", "[postproc][jobs][heidenhain]") {
  const char* const text =
      "0 BEGIN PGM P MM\n1 TOOL CALL 1 Z S5000 F600\n2 L Z+100 B+0 C+0 FMAX\n"
      "3 FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR\n4 L X+0 Y+0 Z+5 B+10 C+0 FMAX\n"
      "5 L X+10 B+20\n6 L X+20 C+30\n7 FUNCTION RESET TCPM\n8 L Z+100 FMAX\n9 END PGM P MM\n";
  Options o = convert(text, "table_table_bc");
  JobResult result = run_job(o, {});
  CHECK(has(result, "NC412"));
  o.input_machine = machine_file("head_table_bc");
  result = run_job(o, {});
  INFO(messages(result));
  CHECK(static_cast<int>(result.status) == 0);
}

TEST_CASE("heidenhain input: PATHCTRL VECTOR goes on the great circle between positions",
          "[postproc][jobs][heidenhain]") {
  // One program by positions of head_table_bc and one by the vectors that they stand for.
  InputSettings settings;
  settings.file_name = "p.h";
  settings.tool_lengths[1] = 60.0;
  settings.machine = test::shipped_machine("head_table_bc");
  const auto path = [&](const char* control) {
    return read_input(
        "0 BEGIN PGM P MM\n1 L B+0 C+0 FMAX\n2 FUNCTION TCPM F TCP AXIS POS PATHCTRL " +
            std::string(control) +
            "\n3 L X+0 Y+0 Z+5 B+10 C+0 FMAX\n4 L X+10 B+40 C+90 F600\n5 END PGM P MM\n",
        settings);
  };
  const InterpretedInput vectors = path("VECTOR");
  const InterpretedInput axes = path("AXIS");
  const ReferencePath by_vectors(vectors.path, vectors.frames);
  const ReferencePath by_axes(axes.path, axes.frames);
  const std::size_t last = by_vectors.segments();
  REQUIRE(last == by_axes.segments());
  const auto a0 = by_vectors.at(last, 0.0), a1 = by_vectors.at(last, 1.0);
  CHECK((a0.axis - by_axes.at(last, 0.0).axis).norm() < 1e-9);
  CHECK((a1.axis - by_axes.at(last, 1.0).axis).norm() < 1e-9);
  const Vec3 pole = a0.axis.cross(a1.axis).normalized();
  for (const double s : {0.2, 0.5, 0.8}) {
    const auto here = by_vectors.at(last, s);
    CHECK(std::abs(pole.dot(here.axis)) < 1e-9);
    CHECK((here.tip - Vec3(10.0 * s, 0, 5)).norm() < 1e-9);
    CHECK((by_axes.at(last, s).tip - here.tip).norm() < 1e-9);
  }
  CHECK(std::abs(pole.dot(by_axes.at(last, 0.5).axis)) > 0.01);  // linear axes leave it
}
