#include <cstddef>
#include <cstdint>
#include <string_view>

#include "formats/mesh/stl_reader.h"
#include "kernels/geometry/weld.h"
#include "tests/fuzz/expect.h"

// Any bytes end in finite triangles that weld, or in diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace smoothpost;
  const auto mesh = read_stl({reinterpret_cast<const char*>(data), size}, "fuzz.stl");
  fuzz::expect(mesh.ok() != has_error(mesh.diagnostics()));
  if (!mesh.ok()) return 0;
  fuzz::expect(mesh.value().corners.size() % 3 == 0);
  for (const Vec3& corner : mesh.value().corners)
    fuzz::expect(corner.allFinite() && corner.cwiseAbs().maxCoeff() <= kLargestStlCoordinate);
  const TriangleMesh welded = weld(mesh.value().corners);
  fuzz::expect(welded.triangles.size() == mesh.value().triangles());
  const MeshReport report = describe(welded);
  fuzz::expect(std::isfinite(report.area) && report.area >= 0.0);
  fuzz::expect(!has_error(mesh_findings(report, "fuzz.stl")));
  return 0;
}
