#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace smoothpost {

/// One run of the tool: every option under the name it has on the command line, in a job file and
/// in the C structure. Text is as the user wrote it; `settings.h` reads it.
struct Options {
  std::string command;                    ///< convert | check | place | machines | formats | golden
  std::vector<std::string> arguments;     ///< sub-command words: list, show NAME, run DIR ...
  std::string input;                      ///< path, or "-"
  std::optional<std::string> input_data;  ///< bytes given by the host instead of a file
  std::string machine;
  std::string machine_path;  ///< folders separated by ':', searched before the others
  std::string workpiece;     ///< STL path
  std::optional<std::string> workpiece_data;
  std::string workpiece_unit;  ///< mm (default) | inch: the unit of the STL's numbers
  std::string output;          ///< path, "-", or empty for the default
  std::string dialect;
  std::string input_format;
  std::string input_dialect;
  std::string integer_unit;  ///< fanuc, haas: 1 | 0.001, mm or deg of a number without point
  std::string input_unit;    ///< cl: mm | inch, of lengths before UNITS
  std::string input_feed;    ///< cl: mm/min, of feed motions before FEDRAT
  std::string cl_frames;     ///< cl: one | reported | applied
  std::string cl_circles;    ///< cl: tangents | cw | ccw, CIRCLE of the NX form about its axis
  std::string input_machine;
  std::string process;
  std::vector<std::string> work_offset;        ///< G54=x,y,z[,a,b,c] | auto: on the output machine
  std::vector<std::string> input_work_offset;  ///< G54=x,y,z[,a,b,c]: on the input machine
  std::vector<std::string> tool;               ///< N=length
  std::string tip_tolerance;
  std::string axis_tolerance;
  std::string lead;
  std::string tilt;
  std::string smoothing;
  std::string orientation;
  std::string optimise;
  std::string schedule;
  std::string links;
  std::string cuts;
  std::string box;   ///< place: x0,y0,z0,x1,y1,z1, mm: where the program's zero may lie
  std::string turn;  ///< place: deg, largest turn about the vertical
  std::string against;
  std::string json;
  std::string report;
  std::string trajectory;
  std::string line_map;
  std::vector<std::string> set;  ///< section.key=value
  bool no_collision_check = false;
  bool timings = false;
  bool force = false;
};

}  // namespace smoothpost
