#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace smoothpost {

/// One run of the tool: every option under the name it has on the command line, in a job file and
/// in the C structure. Text is as the user wrote it; `settings.h` reads it.
struct Options {
  std::string command;  ///< convert | check | finish | place | machines | formats | golden | batch
  std::vector<std::string> arguments;  ///< sub-command words: list, show NAME, run DIR, JOBS.toml
  std::string input;                   ///< path, or "-"
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
  std::string run_budget;    ///< nc: blocks that loops, calls and cycles may run beyond the text
  std::string call_depth;    ///< nc: calls within each other
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
  std::string plots;  ///< a folder
  std::string trajectory;
  std::string line_map;
  std::string pitch;             ///< finish: mm, between layers
  std::string depth;             ///< finish: mm, depth of cut: the stock is that much larger
  std::string feed;              ///< finish: mm/min
  std::string rpm;               ///< finish: of the spindle
  std::string from;              ///< finish: mm, height of the first layer
  std::string to;                ///< finish: mm, no layer above
  std::string lead_in;           ///< finish: mm, radius of the arcs that lead in and out
  std::string normal_tolerance;  ///< finish: deg, of the tool axis against the surface's normal
  std::string direction;         ///< finish: alternate | same | helical, of the layers
  std::string stock_out;         ///< finish: a path for the STL of the body to be printed
  std::string mill;              ///< finish: R,L: radius and free length of the end mill, mm
  std::string steepest;          ///< finish: deg, walls farther from upright are left out
  std::string contours;          ///< finish: all | outer
  std::string unreachable;       ///< finish: refuse | leave-out
  std::string scale;             ///< finish: a factor of the part's size
  std::vector<std::string> set;  ///< section.key=value
  std::string jobs;              ///< batch: how many run at a time
  std::string only;              ///< batch: the one job to run, in this process
  std::string worker;            ///< batch: the program that runs a job in a process of its own
  bool list = false;             ///< batch: name the jobs, run none
  bool no_collision_check = false;
  bool timings = false;
  bool force = false;
  bool in_place = false;  ///< convert: the program replaces the input file, if it is certified
};

}  // namespace smoothpost
