#include <cstddef>
#include <cstdint>
#include <string_view>

#include "machines/definition/machine_file.h"
#include "machines/import/imported_machine.h"
#include "tests/fuzz/expect.h"

// Any bytes, read as a URDF, joint limits, an INI and a machine of FreeCAD, end in a machine whose
// text is a valid machine file, or in diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace smoothpost;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto check = [](const Result<ImportedMachine>& made) {
    fuzz::expect(made.ok() != has_error(made.diagnostics()));
    if (!made.ok()) return;
    fuzz::expect(parse_machine_file(machine_text(made.value()), "fuzz.toml").ok());
  };
  const ImportWords said = {{"A", "table"}, {"B", "head"}, {"C", "table"}, {"order", "C,A"}};
  const ini::Source itself = [&](const std::string&) {
    return size < 4096 ? std::optional<std::string>(text) : std::nullopt;
  };
  check(import_urdf({text, "fuzz.urdf", std::nullopt, ""}, {}));
  constexpr std::string_view kRobot =
      "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='revolute'>"
      "<parent link='a'/><child link='b'/><limit lower='-1' upper='1'/></joint></robot>";
  check(import_urdf({kRobot, "fuzz.urdf", text, "fuzz.yaml"}, {}));
  check(import_linuxcnc(text, "fuzz.ini", itself, said));
  check(import_freecad(text, "fuzz.fcm", said));
  return 0;
}
