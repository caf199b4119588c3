#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/result.h"
#include "machines/definition/machine.h"

namespace smoothpost {

/// One `--set section.key=value`: `key` is a dotted path of the machine file (`tolerance.tip_mm`,
/// `axis.B.max_deg` for an axis by name), `value` a TOML value (a bare word counts as a string).
struct MachineOverride {
  std::string key;
  std::string value;
};

/// Reads a machine definition (docs/machine_file.md). Every unknown key, missing key, wrong type,
/// missing unit, reversed limit or unknown name is an error with line and column [MF1xx]; all are
/// collected.
Result<MachineDefinition> parse_machine_file(std::string_view text, const std::string& file_name,
                                             const std::vector<MachineOverride>& overrides = {});

/// Reads a process file (`--process`): [process], [process.events] of docs/machine_file.md only.
Result<ProcessTable> parse_process_file(std::string_view text, const std::string& file_name);

}  // namespace smoothpost
