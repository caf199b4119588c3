#include "postproc/jobs/finish.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "formats/mesh/stl_reader.h"
#include "kernels/geometry/weld.h"
#include "postproc/jobs/job.h"
#include "tests/kernels/geometry/parts.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

Options box_options() {
  Options o;
  o.command = "finish";
  o.machine = "finish_2p2r_1p1r";
  o.machine_path = test::source_path("machines").string();
  o.input = "box.stl";
  o.input_data = stl_bytes(weld(test::box({-20, -15, 0}, {20, 15, 30})));
  o.output = "-";
  o.work_offset = {"G54=0,0,25"};
  o.from = "10";
  o.to = "10";
  return o;
}

bool says(const JobResult& result, const std::string& code) {
  for (const auto& d : result.diagnostics)
    if (d.code == code) return true;
  for (const auto& d : result.diagnostics) UNSCOPED_INFO(to_string(d));
  return false;
}

int status(const JobResult& result) { return static_cast<int>(result.status); }

}  // namespace

TEST_CASE("stl_bytes: the reader has the same mesh", "[postproc][jobs][finish]") {
  const TriangleMesh mesh = weld(test::ellipse_body(50, 35, 40, 30, 4));
  const auto read = read_stl(stl_bytes(mesh), "stock.stl", {});
  REQUIRE(read.ok());
  CHECK(read.value().binary);
  CHECK(read.value().normals_against_winding == 0);
  const TriangleMesh back = weld(read.value().corners);
  REQUIRE(back.triangles.size() == mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      CHECK((back.vertices[back.triangles[i][k]] - mesh.vertices[mesh.triangles[i][k]]).norm() <
            1e-5);
}

TEST_CASE("finish: a box to a certified program and its stock", "[postproc][jobs][finish]") {
  Options o = box_options();
  const auto stock = std::filesystem::temp_directory_path() / "smoothpost_finish_test_stock.stl";
  o.stock_out = stock.string();
  o.depth = "0.5";
  const JobResult done = run_job(o, {});
  for (const auto& d : done.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(status(done) == 0);
  CHECK(done.verdict == "certified");
  CHECK(done.program.find("M3 S10000") != std::string::npos);
  CHECK(done.program.find("CUT 4") != std::string::npos);
  CHECK(done.report.find("depth_of_cut") != std::string::npos);
  const auto read = read_stl(test::read_bytes(stock), "stock.stl", {});
  REQUIRE(read.ok());
  const MeshReport report = describe(weld(read.value().corners));
  CHECK((report.min - Vec3(-20.5, -15.5, -0.5)).norm() < 1e-5);
  CHECK((report.max - Vec3(20.5, 15.5, 30.5)).norm() < 1e-5);
  std::filesystem::remove(stock);
}

TEST_CASE("finish: refusals and options", "[postproc][jobs][finish]") {
  Options o = box_options();
  o.pitch = "0";
  o.direction = "up";
  JobResult done = run_job(o, {});
  CHECK(status(done) == 2);
  CHECK(says(done, "US166"));
  o = box_options();
  o.work_offset = {"G54=500,0,25"};
  done = run_job(o, {});
  CHECK(status(done) == 3);
  CHECK((says(done, "KN170") || says(done, "KN171")));
  CHECK(done.program.empty());
  o = box_options();
  o.from = "50";
  o.to = "60";
  done = run_job(o, {});
  CHECK(status(done) == 3);
  CHECK(says(done, "RG132"));
  o = box_options();
  o.machine = "table_table_ac";
  done = run_job(o, {});
  CHECK(status(done) == 3);
  CHECK(says(done, "KN172"));
  o = box_options();
  o.input_data = "solid\n";
  CHECK(status(run_job(o, {})) == 4);
  for (const auto& [option, value] :
       std::vector<std::pair<std::string Options::*, std::string>>{{&Options::mill, "2"},
                                                                   {&Options::mill, "2,1"},
                                                                   {&Options::mill, "x,30"},
                                                                   {&Options::steepest, "95"},
                                                                   {&Options::contours, "inner"},
                                                                   {&Options::unreachable, "skip"},
                                                                   {&Options::scale, "0"}}) {
    o = box_options();
    o.*option = value;
    done = run_job(o, {});
    CAPTURE(value);
    CHECK(status(done) == 2);
    CHECK(says(done, "US166"));
  }
  o = box_options();
  o.workpiece_unit = "foot";
  CHECK(says(run_job(o, {}), "US145"));
  // An inch file is 25.4 times larger.
  o = box_options();
  o.input_data = stl_bytes(weld(test::box({-0.8, -0.6, 0}, {0.8, 0.6, 1.2})));
  o.workpiece_unit = "inch";
  CHECK(status(run_job(o, {})) == 0);
}

TEST_CASE("finish: a place is found, and what it leaves out is told", "[postproc][jobs][finish]") {
  // In metres and ten times too large: 40 x 30 x 30 mm again.
  Options o = box_options();
  o.input_data = stl_bytes(weld(test::box({0.1, 0.3, 0.2}, {0.5, 0.6, 0.5})));
  o.workpiece_unit = "m";
  o.scale = "0.1";
  o.from = o.to = "30";
  o.work_offset = {"auto"};
  JobResult done = run_job(o, {});
  for (const auto& d : done.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(done.verdict == "certified");
  CHECK(says(done, "RG144"));
  CHECK(done.report.find("a place that smoothpost has found") != std::string::npos);
  // On the bed itself the spindle has no room at the lowest layer.
  o = box_options();
  o.work_offset = {"G54=0,0,0"};
  o.from = "8";
  o.to = "28";
  o.pitch = "20";
  done = run_job(o, {});
  CHECK(status(done) == 3);
  CHECK(done.program.empty());
  o.unreachable = "leave-out";
  done = run_job(o, {});
  for (const auto& d : done.diagnostics) UNSCOPED_INFO(to_string(d));
  CHECK(done.verdict == "certified");
  CHECK(says(done, "RG141"));
  CHECK(done.report.find("left out on your word") != std::string::npos);
  CHECK(done.program.find("CUT 4") != std::string::npos);
  CHECK(done.program.find("CUT 5") == std::string::npos);
}
