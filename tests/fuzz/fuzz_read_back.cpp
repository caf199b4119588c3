#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "machines/definition/machine_file.h"
#include "machines/dialects/dialect_table.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace smoothpost;

struct Control {
  const Dialect* dialect;
  MachineDefinition machine;
};

// Every output dialect with a shipped machine that has words for it.
std::vector<Control> controls() {
  std::vector<Control> out;
  for (const Dialect& dialect : dialects()) {
    const std::string name = dialect.name;
    for (const char* machine : {"table_table_bc", "head_table_bc", "robot_6r", "laser_5p1"}) {
      const std::string path =
          SMOOTHPOST_SOURCE_DIR "/machines/" + std::string(machine) + "/machine.toml";
      std::ifstream file(path);
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      auto read = parse_machine_file(text, path, {{"dialect.name", name}});
      if (read.ok()) out.push_back({&dialect, std::move(read.value())});
    }
  }
  fuzz::expect(out.size() >= dialects().size());
  return out;
}

}  // namespace

// In every output dialect any bytes end in a program of finite motions or in diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<Control> kControls = controls();
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const Control& control : kControls) {
    const auto read = control.dialect->read_back(control.machine, text, "fuzz");
    fuzz::expect(read.ok() != has_error(read.diagnostics()));
    if (!read.ok()) continue;
    for (const ReadBackMove& move : read.value().moves) {
      fuzz::expect(move.to.allFinite() && move.tool.matrix().allFinite());
      fuzz::expect(std::isfinite(move.duration) && move.duration >= 0.0);
      fuzz::expect(move.line >= 1 && move.line <= read.value().line_count);
    }
    for (const ReadBackEvent& event : read.value().events)
      fuzz::expect(event.before <= read.value().moves.size() && std::isfinite(event.seconds));
  }
  return 0;
}
