#pragma once

#include <string>
#include <vector>

#include "postproc/pipeline/convert.h"
#include "tests/postproc/mutation/oracle.h"
#include "tests/postproc/pipeline/dialect_cases.h"

// Short certified programs of every dialect, with what is needed to check them again.
namespace smoothpost::test {

struct MutationCase {
  std::string name;
  CheckInput check;  ///< of the unchanged program
  ReadBack read;
  OracleMachine machine;
  bool beam = false;
  std::vector<CutTrace> wanted;     ///< the input's cuts
  std::vector<CutTrace> unchanged;  ///< the program's
  std::vector<std::string> events;  ///< what event lines hold
};

/// Two cuts with an arc, both rotaries moving, coolant that comes on inside the first.
inline const char* const kMillProgram =
    "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-6 Y-3 A0 C0\nG43 H1 Z30\nG0 Z2\n"
    "G1 Z0 F600\nG1 X-2 A-2 C3 F1200\nM8\nG1 X2 Y0 Z0.5 A-4 C6\nG3 X0 Y2 I-2 J0\nM9\n"
    "G1 X-3 Y3 A-1 C0\nG0 Z30\nG0 X8 Y8\nG0 Z2\nG1 Z1 F600\nM8\nG1 X12 A-3 C4\nG0 Z30\nM9\nM5\n"
    "M429\nM30\n%\n";

/// Two cuts with the beam on, both axes of the head moving in the first.
inline const char* const kLaserProgram =
    "%\nM428\nG21 G90 G17 G94\nG54\nG0 X0 Y0 Z50 C0 B0\nG0 Z1\nM64 P1\nM62 P0\nG1 X4 F3000\n"
    "G1 Y3 B2 C3\nG3 X2 Y5 I-2 J0\nG1 X0 Y3 B0 C0\nM63 P0\nG0 Z20\nG0 X10\nG0 Z1\nM62 P0\n"
    "G1 X13 Y2 F3000\nM63 P0\nM65 P1\nG0 Z50\nM429\nM30\n%\n";

/// Two cuts along arcs and helices in all three planes, coolant that comes on inside the first.
inline const char* const kArcProgram =
    "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-6 Y0 A0 C0\nG43 H1 Z30\nG0 Z2\n"
    "G1 Z0 F600\nG3 X6 Y0 Z-1 I6 J0 F900\nG3 X-6 Y0 I-6 J0\nM8\nG2 X0 Y-6 I6 J0\n"
    "G18 G3 X-4 Z3 I-4 K0\nG17\nM9\nG0 Z30\nG0 X8 Y8\nG0 Z2\nG1 Z1 F600\n"
    "G19 G3 Y12 Z5 J0 K4\nG17\nG0 Z30\nM5\nM429\nM30\n%\n";

inline std::vector<std::string> event_lines(const MachineDefinition& machine) {
  std::vector<std::string> words;
  for (const auto& row : machine.process.events) {
    std::string text = row.text.substr(0, row.text.find('{'));
    while (!text.empty() && text.back() == ' ') text.pop_back();
    if (text.size() > 1) words.push_back(text);
  }
  return words;
}

/// `program`: of a five-axis mill or, on a laser, of laser_5p1; empty: the ones above.
inline MutationCase make_case(const DialectCase& c, std::string program = {},
                              std::vector<MachineOverride> overrides = {}) {
  MutationCase out;
  out.name = c.dialect + " on " + c.machine + (c.curves.empty() ? "" : " with " + c.curves);
  out.beam = is_laser(c.machine);
  ConvertInput in;
  if (program.empty())
    program = c.curves == "arcs" ? kArcProgram : out.beam ? kLaserProgram : kMillProgram;
  in.input = read_program(program, out.beam ? "laser_5p1" : "table_table_ac");
  overrides.insert(overrides.begin(), {{"dialect.name", c.dialect},
                                       {"recipe.smoothing", "none"},
                                       {"tolerance.tip_mm", "0.05"},
                                       {"tolerance.axis_deg", "0.25"},
                                       {"tolerance.limit_share", "0.85"}});
  if (!c.curves.empty()) {
    overrides.push_back({"dialect.mode", "joint"});
    overrides.push_back({"dialect.curves", c.curves});
  }
  if (c.dialect == "ros1_trajectory")
    for (const char* event : {"beam_on", "beam_off", "gas_on", "gas_off"})
      overrides.push_back({std::string("process.events.") + event,
                           std::string("{ text = \"") + event + "\", motion = \"stop\" }"});
  if (out.beam) {
    overrides.push_back({"recipe.optimise", "none"});
    overrides.push_back({"recipe.orientation", "programmed"});
  }
  in.machine = shipped_machine(c.machine, overrides);
  if (out.beam) in.placement = shifted(700, 600, 1000);
  in.input_name = "part.ngc";
  in.collision_check = false;
  const Conversion made = convert(in, false, {});
  for (const auto& d : made.diagnostics) UNSCOPED_INFO(to_string(d));
  INFO(out.name);
  REQUIRE(made.verdict == Verdict::certified);
  out.check.text = made.program;
  out.check.file_name = "program";
  out.check.machine = in.machine;
  out.check.placement = in.placement;
  out.check.tool_length = out.beam ? 0.0 : 60.0;
  out.check.against = in.input;
  out.check.collision_check = false;
  const Dialect* dialect = find_dialect(c.dialect);
  auto read = dialect->read_back(in.machine, made.program, "program");
  REQUIRE(read.ok());
  out.read = std::move(read.value());
  out.machine = {in.machine, in.placement, out.check.tool_length, dialect->tool_turn};
  out.wanted = trace_input(in.input, in.machine.tolerance, out.beam);
  out.unchanged = trace_program(out.read, out.machine, out.beam);
  out.events = event_lines(in.machine);
  return out;
}

/// One machine for every dialect, and some more.
inline const std::vector<DialectCase>& mutation_cases() {
  static const std::vector<DialectCase> cases = {{"table_table_ac", "linuxcnc"},
                                                 {"laser_5p1", "linuxcnc"},
                                                 {"head_head_ca", "linuxcnc"},
                                                 {"head_table_bc", "siemens_840d"},
                                                 {"laser_5p1", "siemens_840d"},
                                                 {"table_table_bc", "fanuc_30i"},
                                                 {"laser_5p1", "fanuc_30i"},
                                                 {"head_table_bc", "fanuc_30i_vectors"},
                                                 {"head_table_bc", "heidenhain"},
                                                 {"table_table_bc", "heidenhain"},
                                                 {"head_table_bc", "heidenhain_vectors"},
                                                 {"table_table_bc", "beckhoff"},
                                                 {"laser_5p1", "beckhoff"},
                                                 {"table_table_bc", "grbl_fluidnc"},
                                                 {"table_table_bc", "grbl"},
                                                 {"table_table_bc", "grbl_klipper"},
                                                 {"table_table_bc", "grbl_marlin"},
                                                 {"table_table_bc", "grbl_reprapfirmware"},
                                                 {"robot_6r", "krl"},
                                                 {"robot_6r", "rapid"},
                                                 {"robot_6r", "fanuc_ls"},
                                                 {"robot_6r", "urscript"},
                                                 {"robot_6r", "urscript_servoj"},
                                                 {"robot_6r", "val3"},
                                                 {"robot_6r", "yaskawa_jbi"},
                                                 {"laser_5p1", "ros1_trajectory"},
                                                 {"laser_5p1", "ros_trajectory"},
                                                 {"table_table_bc", "linuxcnc", "arcs"},
                                                 {"table_table_bc", "siemens_840d", "arcs"},
                                                 {"table_table_bc", "fanuc_30i", "arcs"},
                                                 {"table_table_bc", "beckhoff", "arcs"}};
  return cases;
}

}  // namespace smoothpost::test
