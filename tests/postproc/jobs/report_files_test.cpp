#include "postproc/jobs/report_files.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "postproc/jobs/job.h"
#include "tests/support/support.h"

using namespace smoothpost;
namespace fs = std::filesystem;

namespace {

fs::path scratch(const std::string& name) {
  const fs::path folder = fs::path(SMOOTHPOST_BINARY_DIR) / "report_files_test" / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

Options on_table(const char* command, const fs::path& input) {
  Options o;
  o.command = command;
  o.input = input.string();
  o.machine = test::source_path("machines/table_table_bc/machine.toml").string();
  return o;
}

}  // namespace

TEST_CASE("run_job: page and plots of convert and of check and of an input that cannot be read",
          "[postproc][jobs][report]") {
  const fs::path folder = scratch("pages");
  const fs::path cam = folder / "part.csv";
  std::ofstream(cam) << "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n"
                        "0,0,0,0,0,1,600\n10,0,0,0,0,1,600\n10,10,0,0.0998334,0,0.9950042,600\n"
                        "0,10,0,0,0,1,600\n";
  Options o = on_table("convert", cam);
  o.output = (folder / "out.ngc").string();
  o.report = (folder / "convert.html").string();
  o.plots = (folder / "plots/of this").string();
  const JobResult made = run_job(o, {});
  for (const auto& d : made.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(made.status == ExitStatus::certified);
  const std::string page = test::read_bytes(o.report);
  CHECK(page == made.page);
  CHECK(contains(page, "CERTIFIED"));
  CHECK(contains(page, "10,10,0,0.0998334"));  // the text of a line that a picked point shows
  CHECK(made.trajectory.empty());              // the timeline is made for the page alone
  for (const char* plot : {"axis_B_jerk.svg", "deviation_tip.svg", "jerk_distribution.svg"})
    CHECK(contains(test::read_bytes(fs::path(o.plots) / plot), "<svg xmlns="));
  CHECK(made.plots.size() ==
        static_cast<std::size_t>(std::distance(fs::directory_iterator(o.plots), {})));

  Options check = on_table("check", folder / "out.ngc");
  check.report = (folder / "check.html").string();
  const JobResult checked = run_job(check, {});
  REQUIRE(checked.verdict == "limits_only");
  const std::string second = test::read_bytes(check.report);
  CHECK(contains(second, "LIMITS ONLY"));
  CHECK(contains(second, "B velocity"));
  CHECK_FALSE(contains(second, "B jerk"));

  std::ofstream(cam) << "x_mm,y_mm,z_mm\nno number,0,0\n";
  o.report = (folder / "unread.html").string();
  CHECK(run_job(o, {}).status == ExitStatus::unreadable);
  CHECK(contains(test::read_bytes(o.report), "REFUSED"));
}

TEST_CASE("write_plots: a folder that cannot be made is told", "[postproc][jobs][report]") {
  const fs::path folder = scratch("blocked");
  std::ofstream(folder / "file") << "x";
  std::vector<FileHash> written;
  const auto problems = write_plots((folder / "file/below").string(), {}, written);
  REQUIRE(problems.size() == 1);
  CHECK(problems[0].code == "US131");
}
