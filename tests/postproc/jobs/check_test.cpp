// smoothpost check, as a user calls it.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "kernels/core/units.h"
#include "postproc/jobs/job.h"
#include "tests/support/support.h"

using namespace smoothpost;
namespace fs = std::filesystem;

namespace {

fs::path scratch() {
  const fs::path folder = fs::path(SMOOTHPOST_BINARY_DIR) / "check_test";
  fs::create_directories(folder);
  return folder;
}

/// A cut along X and then along Y whose beam leans along the cut by `lead` and across by `tilt`,
/// deg.
std::string cut_file(const std::string& name, double lead, double tilt) {
  const fs::path file = scratch() / name;
  std::ofstream out(file);
  out << "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min,beam\n";
  const auto row = [&](double x, double y, double along_x, double along_y, int beam) {
    out << x << ',' << y << ",0," << along_x << ',' << along_y << ",1,1200," << beam << '\n';
  };
  const double l = std::tan(lead * kRadiansPerDegree), t = std::tan(tilt * kRadiansPerDegree);
  // Along X the tangent is X and the binormal Y.
  row(0, 0, l, t, 0);
  for (const double x : {10.0, 20.0, 30.0}) row(x, 0, l, t, 1);
  return file.string();
}

Options laser(const std::string& command, const std::string& input) {
  Options o;
  o.command = command;
  o.input = input;
  o.machine = test::source_path("machines/laser_5p1/machine.toml").string();
  o.work_offset = {"G54=700,600,1000"};
  o.set = {"recipe.optimise=none", "recipe.smoothing=none"};
  o.no_collision_check = true;
  o.output = "-";
  if (command == "convert") o.set.push_back("recipe.orientation=programmed");
  return o;
}

JobResult checked(double lead, double tilt, const std::string& lead_allowed,
                  const std::string& tilt_allowed, const std::string& exit_edge = {}) {
  const JobResult made = run_job(laser("convert", cut_file("leaning.csv", lead, tilt)), {});
  for (const auto& d : made.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(made.status == ExitStatus::certified);
  const fs::path program = scratch() / "leaning.ngc";
  std::ofstream(program) << made.program;
  Options o = laser("check", program.string());
  o.output.clear();
  o.against = cut_file("upright.csv", 0, 0);
  o.lead = lead_allowed;
  o.tilt = tilt_allowed;
  if (!lead_allowed.empty() || !tilt_allowed.empty()) o.orientation = "cone";
  if (!exit_edge.empty()) o.set.push_back("tolerance.exit_edge_mm=" + exit_edge);
  return run_job(o, {});
}

bool reports(const JobResult& result, const std::string& words) {
  UNSCOPED_INFO(result.summary);
  for (const auto& d : result.diagnostics) UNSCOPED_INFO(to_string(d));
  return result.report.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("check: a freed beam is compared by lead and tilt", "[postproc][jobs][check]") {
  const JobResult kept = checked(0, 0, "", "");
  CHECK(kept.verdict == "certified");
  CHECK(reports(kept, "axis_deviation"));
  CHECK(checked(3, 0, "", "").verdict == "refused");
  const JobResult lead = checked(3, 0, "5", "1");
  CHECK(lead.verdict == "certified");
  CHECK(reports(lead, "lead_deviation"));
  CHECK(reports(lead, "tilted_gap"));  // among what is not checked
  CHECK_FALSE(reports(lead, "axis_deviation"));
  CHECK(checked(3, 0, "1", "5").verdict == "refused");
  CHECK(checked(0, 3, "1", "5").verdict == "certified");
  CHECK(checked(0, 3, "5", "1").verdict == "refused");
  CHECK(checked(0, -3, "1", "2.9").verdict == "refused");
  CHECK(checked(0, -3, "1", "3.2").verdict == "certified");
}

TEST_CASE("check: the exit edge of a freed beam has a limit of its own",
          "[postproc][jobs][check]") {
  // The far side of the sheet of 1.5 mm is off by 1.5 tan 3 deg = 0.0786 mm.
  CHECK(checked(0, 3, "1", "5", "0.1").verdict == "certified");
  CHECK(checked(0, 3, "1", "5", "0.07").verdict == "refused");
}
