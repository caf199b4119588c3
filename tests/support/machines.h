#pragma once

#include <string>

#include "machines/definition/machine_file.h"
#include "tests/support/support.h"

namespace smoothpost::test {

/// A machine of the source tree, with overrides.
inline MachineDefinition shipped_machine(const std::string& name,
                                         const std::vector<MachineOverride>& overrides = {}) {
  const auto path = source_path("machines/" + name + "/machine.toml");
  auto machine = parse_machine_file(read_bytes(path), name, overrides);
  for (const auto& d : machine.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(machine.ok());
  return machine.value();
}

inline const std::vector<std::string>& shipped_machine_names() {
  static const std::vector<std::string> names = {"laser_5p1", "table_table_ac", "table_table_bc"};
  return names;
}

}  // namespace smoothpost::test
