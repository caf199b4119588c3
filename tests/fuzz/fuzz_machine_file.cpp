#include <cstddef>
#include <cstdint>
#include <string_view>

#include "machines/definition/machine_file.h"
#include "tests/fuzz/expect.h"

// Any bytes end in a machine whose limits are in order, or in diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace smoothpost;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto machine = parse_machine_file(text, "fuzz.toml");
  fuzz::expect(machine.ok() != has_error(machine.diagnostics()));
  const auto process = parse_process_file(text, "fuzz.toml");
  fuzz::expect(process.ok() != has_error(process.diagnostics()));
  if (!machine.ok()) return 0;
  fuzz::expect(machine.value().size() >= 1 && machine.value().size() <= kMaxJoints);
  for (const AxisDefinition& axis : machine.value().axes) {
    fuzz::expect(axis.joint.lower < axis.joint.upper);
    fuzz::expect(axis.joint.lower <= axis.joint.home && axis.joint.home <= axis.joint.upper);
    fuzz::expect(axis.velocity > 0.0 && axis.acceleration > 0.0 && axis.jerk > 0.0);
    fuzz::expect(std::abs(axis.joint.direction.norm() - 1.0) < 1e-9);
  }
  return 0;
}
