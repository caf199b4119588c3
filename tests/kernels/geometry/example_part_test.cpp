#include <catch2/catch.hpp>

#include "formats/mesh/stl_reader.h"
#include "kernels/geometry/triangle_tree.h"
#include "kernels/geometry/weld.h"
#include "tests/support/support.h"

using namespace smoothpost;

TEST_CASE("example: the bent sheet is a clean closed solid", "[kernels][geometry][examples]") {
  const auto path = test::source_path("examples/bent_sheet/bent_sheet.stl");
  const std::string bytes = test::read_bytes(path);
  CHECK(bytes.size() <= 300000);
  const auto stl = read_stl(bytes, "bent_sheet.stl");
  REQUIRE(stl.ok());
  CHECK(stl.diagnostics().empty());
  const auto mesh = weld(stl.value().corners);
  const auto report = describe(mesh);
  CHECK(report.closed());
  CHECK(report.components == 1);
  CHECK(mesh_findings(report, "bent_sheet.stl").empty());
  // Upper and lower side are a sheet of 1.5 mm: volume = half the area of both sides times the
  // thickness.
  CHECK(report.signed_volume == Approx(0.5 * report.area * 1.5).epsilon(0.02));
  CHECK(report.min.z() == Approx(-1.5).margin(1e-5));
  CHECK(report.max.z() == Approx(60.0).margin(1e-5));
  CHECK(report.min.x() > -20.0);
  CHECK(report.max.x() < 340.0);
}
