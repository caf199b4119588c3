#pragma once

#include <algorithm>

#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/registry.h"
#include "tests/postproc/pipeline/paths.h"

// One short job for every shipped machine and every dialect that it suits.
namespace smoothpost::test {

struct DialectCase {
  std::string machine;
  std::string dialect;
  std::string curves = {};  ///< empty: the machine file's
};

inline const std::vector<std::string>& all_machines() {
  static const std::vector<std::string> names = {
      "finish_2p2r_1p1r", "head_head_ca",   "head_table_bc",    "laser_5p1",     "laser_5p1_offset",
      "robot_6r",         "table_table_ac", "table_table_b45c", "table_table_bc"};
  return names;
}

inline bool is_laser(const std::string& machine) { return machine.rfind("laser", 0) == 0; }

/// Whether the shipped machine file has words for that controller.
inline bool is_suited(const std::string& machine, const std::string& dialect) {
  const auto has = [&dialect](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(), [&](const char* n) { return dialect == n; });
  };
  if (machine == "robot_6r")
    return has({"krl", "rapid", "fanuc_ls", "urscript", "urscript_servoj", "val3", "yaskawa_jbi",
                "ros_trajectory"});
  if (has({"linuxcnc", "siemens_840d", "fanuc_30i", "beckhoff", "ros_trajectory"})) return true;
  if (is_laser(machine) || machine == "finish_2p2r_1p1r") return false;
  return dialect != "ros1_trajectory" && !is_suited("robot_6r", dialect);
}

inline std::vector<DialectCase> suited_cases() {
  std::vector<DialectCase> cases;
  for (const auto& machine : all_machines())
    for (const auto& dialect : dialects())
      if (is_suited(machine, dialect.name)) cases.push_back({machine, dialect.name, {}});
  return cases;
}

/// A cut with both rotaries moving, coolant that comes on inside it, and a second cut; a laser's is
/// two cuts with the beam on.
inline ConvertInput short_job(const DialectCase& c, std::vector<MachineOverride> overrides = {}) {
  const std::string mill =
      "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-6 Y-3 A0 C0\nG43 H1 Z30\nG0 Z2\n"
      "G1 Z0 F600\nG1 X3 A-2 C3 F1200\nM8\nG1 X5 Y2 Z1 A-4 C6\nG1 X0 Y4 A-1 C0\nG0 Z30\n"
      "G0 X8 Y8\nG0 Z2\nG1 Z1 F600\nG1 X12 A-3 C4\nG0 Z30\nM9\nM5\nM429\nM30\n%\n";
  const std::string laser =
      "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\nG0 Z1\nM62 P0\nG1 X6 F3000\n"
      "G1 Y4 B2 C3\nG1 X0 Y3 B0 C0\nM63 P0\nG0 Z20\nG0 X10\nG0 Z1\nM62 P0\nG1 X14 Y2 F3000\n"
      "M63 P0\nG0 Z50\nM429\nM30\n%\n";
  ConvertInput in;
  const bool beam = is_laser(c.machine);
  in.input = read_program(beam ? laser : mill, beam ? "laser_5p1" : "table_table_ac");
  overrides.insert(overrides.begin(), {{"dialect.name", c.dialect}, {"recipe.smoothing", "none"}});
  in.machine = shipped_machine(c.machine, overrides);
  if (beam) in.placement = shifted(700, 600, 1000);
  in.input_name = "part.ngc";
  in.collision_check = false;
  return in;
}

}  // namespace smoothpost::test
