#pragma once

#include <string>
#include <vector>

#include "smoothpost/smoothpost.h"

namespace smoothpost::cli {

/// The command line as text, under the names of the C structure.
struct CommandLine {
  std::string command;
  std::vector<std::string> arguments;
  std::string input, machine, machine_path, workpiece, workpiece_unit, output, dialect,
      input_format, input_dialect, input_machine, run_budget, call_depth, process, tip_tolerance,
      axis_tolerance, lead, tilt, smoothing, orientation, optimise, schedule, links, cuts, against,
      json, report, plots, pitch, depth, feed, rpm, from, to, lead_in, normal_tolerance, direction,
      stock_out, mill, steepest, contours, unreachable, scale, trajectory, line_map, integer_unit,
      jobs, only, worker, box, turn, input_unit, input_feed, cl_frames, cl_circles;
  std::vector<std::string> work_offset, input_work_offset, tool, set;
  bool no_collision_check = false;
  bool timings = false;
  bool force = false;
  bool list = false;
  bool in_place = false;
  std::string progress = "auto";
  std::string diagnostics = "text";
};

/// What parsing ended with: go on, or leave with `status` (help, version, a usage error: printed).
struct Parsed {
  CommandLine line;
  bool leave = false;
  int status = 0;
};

Parsed parse_command_line(int argc, char** argv);

}  // namespace smoothpost::cli
