#include <cstddef>
#include <cstdint>
#include <string_view>

#include "formats/csv/cutter_locations.h"
#include "tests/fuzz/expect.h"

// Any bytes end in a tool path of finite numbers and unit axes, or in diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace smoothpost;
  const auto path = read_cutter_locations({reinterpret_cast<const char*>(data), size}, "fuzz.csv");
  fuzz::expect(path.ok() != has_error(path.diagnostics()));
  if (!path.ok()) return 0;
  for (const PathPoint& point : path.value().points) {
    fuzz::expect(point.location.tip.allFinite());
    fuzz::expect(std::abs(point.location.axis.norm() - 1.0) < 1e-9);
    fuzz::expect(std::isfinite(point.duration) && point.duration >= 0.0);
  }
  return 0;
}
