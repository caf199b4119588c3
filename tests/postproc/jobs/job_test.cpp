#include "postproc/jobs/job.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <functional>

#include "postproc/jobs/files.h"
#include "postproc/jobs/golden.h"
#include "postproc/jobs/settings.h"
#include "tests/support/support.h"

using namespace smoothpost;
namespace fs = std::filesystem;

namespace {

fs::path scratch(const std::string& name) {
  const fs::path folder = fs::path(SMOOTHPOST_BINARY_DIR) / "job_test" / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

Options mill() {
  Options o;
  o.command = "convert";
  o.input = test::source_path("examples/mill_ac/mill_ac.ngc").string();
  o.input_machine = test::source_path("machines/table_table_ac/machine.toml").string();
  o.machine = test::source_path("machines/table_table_bc/machine.toml").string();
  o.tool = {"1=60"};
  o.output = "-";
  return o;
}

Options sheet() {
  Options o;
  o.command = "convert";
  o.input = test::source_path("examples/bent_sheet/bent_sheet.ngc").string();
  o.machine = test::source_path("machines/laser_5p1/machine.toml").string();
  o.input_machine = o.machine;
  o.workpiece = test::source_path("examples/bent_sheet/bent_sheet.stl").string();
  o.work_offset = {"G54=700,600,1000"};
  o.output = "-";
  return o;
}

bool says(const JobResult& result, const std::string& code, const std::string& text) {
  for (const auto& d : result.diagnostics)
    if (d.code == code && d.text.find(text) != std::string::npos) return true;
  for (const auto& d : result.diagnostics) UNSCOPED_INFO(to_string(d));
  return false;
}

int status(const JobResult& result) { return static_cast<int>(result.status); }

}  // namespace

TEST_CASE("run_job: exit statuses by the table", "[postproc][jobs]") {
  CHECK(status(run_job(mill(), {})) == 0);
  Options o = mill();
  o.machine.clear();
  CHECK(status(run_job(o, {})) == 2);
  o = mill();
  o.tool.clear();
  CHECK(status(run_job(o, {})) == 3);
  o = mill();
  o.input = "no_such_file.ngc";
  CHECK(status(run_job(o, {})) == 4);
  o = mill();
  o.input_data = "G0 X[1+1]\nM30\n";
  CHECK(status(run_job(o, {})) == 4);
  o = mill();
  o.command = "fly";
  CHECK(status(run_job(o, {})) == 2);
  o = mill();
  o.set = {"tolerance.tip_mm=-1"};
  CHECK(status(run_job(o, {})) == 2);
  o = mill();
  o.schedule = "programed";
  const JobResult typo = run_job(o, {});
  CHECK(status(typo) == 2);
  CHECK(typo.diagnostics.front().where.file == "--schedule programed");
}

TEST_CASE("run_job: an inch part, a wrong zero, a mirrored and a foreign part are refused by name",
          "[postproc][jobs]") {
  REQUIRE(status(run_job(sheet(), {})) == 0);
  Options o = sheet();
  o.workpiece_unit = "inch";
  JobResult r = run_job(o, {});
  CHECK(status(r) == 3);
  CHECK(says(r, "RG112", "25.4"));
  CHECK(r.program.empty());
  CHECK_FALSE(r.report.empty());

  // The whole program 6 mm too high: the part says so, and by how much.
  o = sheet();
  std::string text = test::read_bytes(o.input);
  const auto at = text.find("G54\n");
  REQUIRE(at != std::string::npos);
  // G52 moves the zero after the first motion has tied the part to it.
  const auto first_cut = text.find("M64 P1");
  REQUIRE(first_cut != std::string::npos);
  text.insert(first_cut, "G52 Z6\n");
  o.input_data = text;
  r = run_job(o, {});
  CHECK(status(r) == 3);
  CHECK(says(r, "RG113", "6.0"));
}

TEST_CASE("run_job: --force writes a marked program, exit status 3, but not when a beam rule fails",
          "[postproc][jobs]") {
  Options o = sheet();
  o.workpiece_unit = "inch";
  o.force = true;
  const JobResult forced = run_job(o, {});
  CHECK(status(forced) == 3);
  CHECK(forced.verdict == "forced");
  CHECK(forced.program.rfind("%\n(NOT CERTIFIED", 0) == 0);
  CHECK(forced.program.find("\nM0\n") != std::string::npos);

  o = sheet();
  std::string text = test::read_bytes(o.input);
  const auto off = text.find("M63 P0");
  text.erase(off, 6);  // the beam stays on into the next rapid
  o.input_data = text;
  o.force = true;
  const JobResult beam = run_job(o, {});
  CHECK(status(beam) == 3);
  CHECK(beam.verdict == "refused");
  CHECK(beam.program.empty());
  CHECK(says(beam, "CK101", "beam_off_in_rapid"));
}

TEST_CASE("run_job: files are written, nothing on refusal but the report", "[postproc][jobs]") {
  const fs::path folder = scratch("files with a 'quote' and ä");
  Options o = mill();
  o.output = (folder / "out.ngc").string();
  o.json = (folder / "out.json").string();
  o.line_map = (folder / "map.json").string();
  o.trajectory = (folder / "t.csv").string();
  const JobResult r = run_job(o, {});
  REQUIRE(status(r) == 0);
  CHECK(test::read_bytes(o.output) == r.program);
  CHECK(test::read_bytes(o.json) == r.report);
  CHECK(fs::file_size(o.line_map) > 1000);
  CHECK(fs::file_size(o.trajectory) > 1000);

  o.output = (folder / "refused.ngc").string();
  o.json = (folder / "refused.json").string();
  o.tool.clear();
  CHECK(status(run_job(o, {})) == 3);
  CHECK_FALSE(fs::exists(o.output));
  CHECK(test::read_bytes(o.json).find("\"refused\"") != std::string::npos);
  // No temporary is left behind.
  for (const auto& entry : fs::directory_iterator(folder))
    CHECK(entry.path().filename().string().find(".new") == std::string::npos);
  // The input itself is never the output.
  o = mill();
  o.output = o.input;
  CHECK(status(run_job(o, {})) == 2);
}

TEST_CASE("run_job: in place a certified program replaces the file and a refused one leaves it",
          "[postproc][jobs]") {
  const fs::path folder = scratch("in place");
  Options o = mill();
  const std::string input = test::read_bytes(o.input);
  o.output = (folder / "beside.ngc").string();
  const JobResult beside = run_job(o, {});
  REQUIRE(status(beside) == 0);

  const fs::path file = folder / "part.ngc";
  const auto start = [&] {
    REQUIRE(write_file(file.string(), input).empty());
    Options in_place = mill();
    in_place.input = file.string();
    in_place.output.clear();
    in_place.in_place = true;
    return in_place;
  };
  o = start();
  const JobResult r = run_job(o, {});
  CHECK(status(r) == 0);
  CHECK(r.program_path == file.string());
  CHECK(test::read_bytes(file) == r.program);
  // The title names the input file; all else is the program that is written beside it.
  const auto body = [](const std::string& text) { return text.substr(text.find("G21 ")); };
  CHECK(body(r.program) == body(beside.program));

  o = start();
  o.tool.clear();
  CHECK(status(run_job(o, {})) == 3);
  CHECK(test::read_bytes(file) == input);
  o = start();
  o.json = (folder / "none" / "report.json").string();
  CHECK(status(run_job(o, {})) == 2);
  CHECK(test::read_bytes(file) == input);

  const auto usage = [&](const std::function<void(Options&)>& change) {
    Options wrong = start();
    change(wrong);
    const JobResult told = run_job(wrong, {});
    CHECK(says(told, "US195", "--in-place"));
    CHECK(status(told) == 2);
    CHECK(test::read_bytes(file) == input);
  };
  usage([](Options& w) { w.force = true; });
  usage([&](Options& w) { w.output = (folder / "other.ngc").string(); });
  usage([](Options& w) { w.command = "check"; });
  usage([&](Options& w) { w.input_data = input; });
  CHECK(std::distance(fs::directory_iterator(folder), fs::directory_iterator()) == 2);
}

TEST_CASE("write_file: old content or new, through links, and a reason when it cannot",
          "[postproc][jobs]") {
  const fs::path folder = scratch("write");
  const fs::path file = folder / "a.txt";
  CHECK(write_file(file.string(), "one").empty());
  CHECK(test::read_bytes(file) == "one");
  fs::create_symlink(file, folder / "link.txt");
  CHECK(write_file((folder / "link.txt").string(), "two").empty());
  CHECK(test::read_bytes(file) == "two");
  CHECK(fs::is_symlink(folder / "link.txt"));
  const auto errors = write_file((folder / "none" / "b.txt").string(), "x");
  REQUIRE(errors.size() == 1);
  CHECK(errors[0].code == "US131");
  CHECK(write_file("/dev/full", "x").size() == 1);
}

TEST_CASE("read_file: missing, folder, too large", "[postproc][jobs]") {
  const fs::path folder = scratch("read");
  std::ofstream(folder / "five") << "12345";
  CHECK(read_file((folder / "five").string()).value() == "12345");
  CHECK_FALSE(read_file((folder / "five").string(), 4).ok());
  CHECK_FALSE(read_file(folder.string()).ok());
  CHECK_FALSE(read_file((folder / "none").string()).ok());
}

TEST_CASE("options of people: offsets, tools, numbers", "[postproc][jobs]") {
  CHECK(read_number("1.5").value() == 1.5);
  CHECK(read_number(" +2 ").value() == 2.0);
  for (const char* bad : {"", "1,5", "x", "1.5mm", "nan", "inf", "1e400"})
    CHECK_FALSE(read_number(bad));
  const auto offsets = read_offsets({"G54=1,-2,3.5", "G59.1=0,0,0,10,20,30"}, "--work-offset");
  REQUIRE(offsets.ok());
  CHECK(offsets.value()[0].position == Vec3(1, -2, 3.5));
  CHECK(offsets.value()[1].system == 7);
  CHECK(offsets.value()[1].turn.z() == Approx(0.5235987756));
  for (const char* bad :
       {"G54", "G54=", "G54=1,2", "G53=1,2,3", "G54=1,2,x", "1,2,3", "G54=1,2,3,4"})
    CHECK_FALSE(read_offsets({bad}, "--work-offset").ok());
  CHECK(read_tools({"1=60", "12=0.5"}).value().lengths.at(12) == 0.5);
  const auto wide = read_tools({"3=60,12.5", "D6,F:4=50,6"});
  REQUIRE(wide.ok());
  CHECK(wide.value().lengths.at(3) == 60.0);
  CHECK(wide.value().diameters.at(3) == 12.5);
  CHECK(wide.value().diameters.at(4) == 6.0);
  CHECK(wide.value().numbers.at("D6,F") == 4);
  const auto named = read_tools({"FACE MILL D50:7=80.5", "2=10"});
  REQUIRE(named.ok());
  CHECK(named.value().lengths.at(7) == 80.5);
  CHECK(named.value().numbers.at("FACE MILL D50") == 7);
  CHECK(named.value().numbers.size() == 1);
  for (const char* bad : {"1", "=5", "x=5", "1=-3", "1.5=2", "1=1e9", ":1=5", "A:=5", "A:B=5",
                          "1=60,", "1=60,x", "1=60,-2", "1=60,2,3", "1=,3"})
    CHECK_FALSE(read_tools({bad}).ok());
}

TEST_CASE("text_difference: changed lines with their numbers", "[postproc][jobs]") {
  CHECK(text_difference("a\nb\nc\n", "a\nb\nc\n").empty());
  const std::string d = text_difference("a\nb\nc\n", "a\nB\nc\n");
  CHECK(d.find("-2: b") != std::string::npos);
  CHECK(d.find("+2: B") != std::string::npos);
  CHECK(d.find("c") == std::string::npos);
  CHECK(text_difference("a\n", "a\nb\n").find("+2: b") != std::string::npos);
  CHECK_FALSE(text_difference("a", "a\n").empty());
}

TEST_CASE("golden: a changed program, check, message or status is found", "[postproc][jobs]") {
  const fs::path folder = scratch("golden");
  const fs::path c = folder / "case";
  fs::create_directories(c);
  fs::copy_file(test::source_path("examples/mill_ac/mill_ac.ngc"), c / "part.ngc");
  std::ofstream(c / "case.toml")
      << "why = \"test\"\nmode = \"exact\"\n[options]\ncommand = \"convert\"\n"
         "input = \"part.ngc\"\ntool = \"1=60\"\nmachine_path = \""
      << test::source_path("machines").string()
      << "\"\nmachine = \"table_table_bc\"\ninput_machine = \"table_table_ac\"\n";
  Options o;
  o.command = "golden";
  o.arguments = {"update", folder.string()};
  REQUIRE(status(run_job(o, {})) == 0);
  o.arguments = {"run", folder.string()};
  CHECK(status(run_job(o, {})) == 0);
  const auto spoil = [&](const char* name, const std::string& from, const std::string& to) {
    const std::string good = test::read_bytes(c / name);
    std::string bad = good;
    const auto at = bad.find(from);
    REQUIRE(at != std::string::npos);
    bad.replace(at, from.size(), to);
    std::ofstream(c / name) << bad;
    const JobResult r = run_job(o, {});
    std::ofstream(c / name) << good;
    CHECK(status(r) == 3);
    return r.text;
  };
  CHECK(spoil("expected.program", "G61", "G64").find("program:") != std::string::npos);
  CHECK(spoil("expected.json", "\"name\": \"tip_deviation\",\n   \"value\": 0.0",
              "\"name\": \"tip_deviation\",\n   \"value\": 7.0")
            .find("tip_deviation") != std::string::npos);
  CHECK(spoil("expected.exit", "0", "3").find("exit status") != std::string::npos);
  CHECK(spoil("expected.messages", "note", "warning").find("messages:") != std::string::npos);
  CHECK(status(run_job(o, {})) == 0);

  // An update that is interrupted leaves what is stored.
  const std::string stored = test::read_bytes(c / "expected.program");
  o.arguments = {"update", folder.string()};
  const JobResult interrupted = run_job(o, {[](const char*, double) { return false; }});
  CHECK(status(interrupted) != 0);
  CHECK(test::read_bytes(c / "expected.program") == stored);
  CHECK(test::read_bytes(c / "expected.exit") == "0\n");
  o.arguments = {"run", folder.string()};
  CHECK(status(run_job(o, {})) == 0);
}
