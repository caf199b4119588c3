// machines import and machines fit, as a user calls them.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/definition/machine_file.h"
#include "postproc/jobs/job.h"
#include "tests/support/machines.h"

using namespace smoothpost;
namespace fs = std::filesystem;

namespace {

fs::path scratch(const std::string& name) {
  const fs::path folder = fs::path(SMOOTHPOST_BINARY_DIR) / "machine_import_test" / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }

JobResult machines(std::vector<std::string> words, const std::string& output = {},
                   const std::string& machine = {}) {
  Options o;
  o.command = "machines";
  o.arguments = std::move(words);
  o.output = output;
  o.machine = machine;
  o.machine_path = test::source_path("machines").string();
  return run_job(o, {});
}

bool says(const JobResult& result, const std::string& code, const std::string& text) {
  for (const auto& d : result.diagnostics) {
    UNSCOPED_INFO(to_string(d));
    if (d.code == code && d.text.find(text) != std::string::npos) return true;
  }
  return false;
}

const char* const kTrunnion =
    "[KINS]\nKINEMATICS = xyzac-trt-kins\nJOINTS = 5\n[TRAJ]\nLINEAR_UNITS = mm\n"
    "[HAL]\nHALFILE = more/offsets.hal\nHALFILE = ../outside.hal\nHALFILE = sim.tcl\n"
    "[JOINT_0]\nMIN_LIMIT=-200\nMAX_LIMIT=200\nMAX_VELOCITY=20\nMAX_ACCELERATION=300\n"
    "[JOINT_1]\nMIN_LIMIT=-200\nMAX_LIMIT=200\n[JOINT_2]\nMIN_LIMIT=-200\nMAX_LIMIT=200\n"
    "[JOINT_3]\nTYPE=ANGULAR\nMIN_LIMIT=-100\nMAX_LIMIT=50\n"
    "[JOINT_4]\nTYPE=ANGULAR\nMIN_LIMIT=-3600\nMAX_LIMIT=3600\n";

}  // namespace

TEST_CASE("machines import: a LinuxCNC configuration to a valid file", "[postproc][jobs][import]") {
  const fs::path folder = scratch("ini");
  fs::create_directories(folder / "config/more");
  write(folder / "config/mill.ini", kTrunnion);
  write(folder / "config/more/offsets.hal", "setp xyzac-trt-kins.y-offset 20\n");
  write(folder / "outside.hal", "setp xyzac-trt-kins.y-offset 99\n");
  const std::string out = (folder / "machine.toml").string();
  const JobResult made = machines({"import", (folder / "config/mill.ini").string()}, out);
  CHECK(says(made, "MF206", "velocity"));
  CHECK(says(made, "MF207", "outside.hal"));
  CHECK(says(made, "MF207", "sim.tcl"));
  REQUIRE(made.status == ExitStatus::certified);
  CHECK(made.program_path == out);
  CHECK(test::read_bytes(out) == made.program);
  const JobResult valid = machines({"validate", out});
  CHECK(valid.status == ExitStatus::certified);
  const auto machine = parse_machine_file(made.program, "m");
  REQUIRE(machine.ok());
  CHECK(machine.value().axes[3].joint.origin == Vec3(0, 20, 0));  // not of the file outside
  // Without -o the text is the answer.
  CHECK(machines({"import", (folder / "config/mill.ini").string()}).text == made.program);
}

TEST_CASE("machines import: words and files that cannot be", "[postproc][jobs][import]") {
  const fs::path folder = scratch("words");
  write(folder / "mill.ini", kTrunnion);
  write(folder / "some.txt", "hello");
  write(folder / "l.yaml", "joint_limits: {a: {max_velocity: 1}}");
  const std::string ini = (folder / "mill.ini").string();
  CHECK(says(machines({"import"}), "US170", "name a URDF"));
  CHECK(says(machines({"import", ini, ini}), "US170", "one more file"));
  CHECK(says(machines({"import", ini, "D=table"}), "US170", "D=table"));
  CHECK(says(machines({"import", ini, "A=table", "A=head"}), "US170", "twice"));
  CHECK(says(machines({"import", ini, (folder / "l.yaml").string()}), "US170", "belong to a URDF"));
  CHECK(says(machines({"import", (folder / "some.txt").string()}), "US170", "is no URDF"));
  CHECK(says(machines({"import", ini}, ini), "US105", "input file"));
  const JobResult gone = machines({"import", (folder / "gone.urdf").string()});
  CHECK(gone.status == ExitStatus::unreadable);
  CHECK(says(gone, "US130", "cannot be read"));
  CHECK(test::read_bytes(ini) == kTrunnion);
}

TEST_CASE("machines fit: rotary centres of a shipped machine from readings of a sphere",
          "[postproc][jobs][fit]") {
  const fs::path folder = scratch("fit");
  const MachineDefinition nominal = test::shipped_machine("table_table_ac");
  MachineDefinition truth = nominal;
  truth.axes[3].joint.origin = Vec3(0.0, 0.231, -0.187);
  truth.axes[4].joint.origin = Vec3(-0.142, 0.309, 0.0);
  const ScrewChain chain = chain_of(truth, 60.0);
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 0.002);
  std::ostringstream table;
  table << "# taken on a Monday\nX_mm,Y_mm,Z_mm,A_deg,C_deg,sphere,dial_x_mm,dial_y_mm,dial_z_mm\n";
  for (const double a : {-90.0, -45.0, 0.0, 30.0})
    for (const double c : {0.0, 90.0, 180.0, 270.0}) {
      JointVector q = JointVector::Zero(5);
      q[3] = a * kRadiansPerDegree;
      q[4] = c * kRadiansPerDegree;
      const Vec3 off = forward_location(chain, q).tip - Vec3(40, 10, 25);
      q.head<3>() -= jacobian(chain, q).block<3, 3>(3, 0).inverse() * off;
      table << q[0] << ',' << q[1] << ',' << q[2] << ',' << a << ',' << c << ",1";
      for (int i = 0; i < 3; ++i) table << ',' << noise(random);
      table << '\n';
    }
  const std::string readings = (folder / "r.csv").string(), out = (folder / "m.toml").string();
  std::string text = table.str();
  write(readings, text);
  Options o;
  o.command = "machines";
  o.arguments = {"fit", readings};
  o.machine = test::source_path("machines/table_table_ac/machine.toml").string();
  o.tool = {"1=60"};
  o.output = out;
  const JobResult fit = run_job(o, {});
  for (const auto& d : fit.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(fit.status == ExitStatus::certified);
  INFO(fit.text);
  CHECK(fit.text.find("A.origin along Y") != std::string::npos);
  const auto fitted = parse_machine_file(test::read_bytes(out), out);
  REQUIRE(fitted.ok());
  for (const std::size_t j : {3U, 4U})
    CHECK((fitted.value().axes[j].joint.origin - truth.axes[j].joint.origin).norm() < 0.005);
  // Nothing else changed: the two lines, and nothing outside of their brackets.
  std::istringstream before(test::read_bytes(o.machine)), after(test::read_bytes(out));
  std::string was, is;
  int changed = 0;
  while (std::getline(before, was)) {
    REQUIRE(std::getline(after, is));
    if (was == is) continue;
    ++changed;
    CHECK(was.rfind("origin_mm = [", 0) == 0);
    CHECK(is.rfind("origin_mm = [", 0) == 0);
  }
  CHECK(changed == 2);
  CHECK_FALSE(std::getline(after, is));

  // The tip and both axes together cannot be told from where M is.
  o.arguments.push_back("fit=A.origin,C.origin,tool.tip");
  const JobResult hidden = run_job(o, {});
  CHECK(hidden.status == ExitStatus::refused);
  CHECK(says(hidden, "KN181", "tool.tip along Z"));
  o.arguments.back() = "fit=X.origin";
  CHECK(says(run_job(o, {}), "US171", "X.origin"));
  o.arguments.pop_back();
  o.output = readings;
  CHECK(says(run_job(o, {}), "US105", "input file"));
  o.output.clear();
  text.replace(text.find("X_mm"), 4, "X_m");
  write(readings, text);
  CHECK(says(run_job(o, {}), "CSV104", "X_mm"));
}
