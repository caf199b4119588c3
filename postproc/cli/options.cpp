#include "postproc/cli/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "kernels/core/nearest_name.h"
#include "postproc/cli/documents.h"

namespace smoothpost::cli {

namespace {

// Each command shows its own before its options.
constexpr const char* kConvertExample =
    "Example: a program posted for an A/C table machine, for a B/C table machine:\n"
    "  smoothpost convert part.ngc --input-machine table_table_ac -m table_table_bc --tool 1=60 "
    "-o out.ngc --json out.json --report out.html\n"
    "A 3D laser program with its part, placed on the machine, certified with its gap:\n"
    "  smoothpost convert sheet.ngc --input-machine laser_5p1 -m laser_5p1 -w sheet.stl "
    "--work-offset G54=700,600,1000 -o out.ngc\n";
constexpr const char* kCheckExample =
    "Example: does out.ngc follow the CAM program, and keep the machine's limits?\n"
    "  smoothpost check out.ngc -m table_table_bc --against part.ngc --input-machine "
    "table_table_ac --tool 1=60\n";
constexpr const char* kFinishExample =
    "Example: the walls of a part that stands 35 mm above the bed, layers 1 mm apart:\n"
    "  smoothpost finish part.stl -m finish_2p2r_1p1r --work-offset G54=0,0,35 --stock-out "
    "stock.stl -o out.ngc\n";
constexpr const char* kPlaceExample =
    "Example: where to put the part, so that the robot reaches the whole path:\n"
    "  smoothpost place part.ngc --input-machine table_table_ac -m robot_6r --tool 1=60\n";
constexpr const char* kBatchExample =
    "Example: every job of a file that is not finished yet, four at a time:\n"
    "  smoothpost batch jobs.toml --jobs 4\n"
    "jobs.toml (docs/how_to/batch.md):\n"
    "  [defaults]\n"
    "  machine = \"table_table_bc\"\n"
    "  input-machine = \"table_table_ac\"\n"
    "  tool = [\"1=60\"]\n"
    "  [[job]]\n"
    "  input = \"part.ngc\"\n";
constexpr const char* kMachinesExample =
    "Examples: what a machine is, and is its file right:\n"
    "  smoothpost machines show table_table_bc\n"
    "  smoothpost machines validate machine.toml\n"
    "A slow program that proves what the machine does:\n"
    "  smoothpost machines test-program table_table_bc --tool 1=60 -o test.ngc\n"
    "A machine file from a robot description, and one from LinuxCNC's configuration:\n"
    "  smoothpost machines import robot.urdf joint_limits.yaml -o machine.toml\n"
    "  smoothpost machines import mill.ini A=table C=table -o machine.toml\n"
    "Rotary centres from readings of a sphere, into a new file:\n"
    "  smoothpost machines fit measured.csv fit=A.origin,C.origin -m machine.toml -o "
    "fitted.toml\n";
constexpr const char* kFormatsExample = "Example:\n  smoothpost formats\n";
constexpr const char* kGoldenExample =
    "Example: does this version post the shop's own programs as it did?\n"
    "  smoothpost golden run shop_cases\n";

/// Help that begins with an example.
class ExampleFirst : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override {
    const std::string example = app->get_footer();
    return CLI::Formatter::make_description(app) + (example.empty() ? "" : "\n" + example + "\n");
  }
  std::string make_footer(const CLI::App*) const override { return {}; }
};

void add_machine_options(CLI::App* app, CommandLine& l) {
  app->add_option("-m,--machine", l.machine, "the machine: a name or a machine.toml");
  app->add_option("--machine-path", l.machine_path, "folders of machines, separated by ':'");
  app->add_option("--set", l.set, "section.key=value of the machine file, repeatable")
      ->take_all()
      ->allow_extra_args(false);
}

void add_run_options(CLI::App* c, CommandLine& l) {
  c->add_option("--diagnostics", l.diagnostics, "text | json")
      ->check(CLI::IsMember({"text", "json"}));
  c->add_option("--progress", l.progress, "auto | bar | filter | none")
      ->check(CLI::IsMember({"auto", "bar", "filter", "none"}));
}

void add_output_options(CLI::App* app, CommandLine& l) {
  app->add_option("--json", l.json, "write the JSON report to FILE");
  app->add_option("--report", l.report, "write the report page, one HTML file, to FILE");
  app->add_option("--plots", l.plots, "write the plots of the report page as SVG files to DIR");
  add_run_options(app, l);
  app->add_flag("--timings", l.timings, "put the seconds of each stage into the report");
}

void add_part_options(CLI::App* app, CommandLine& l) {
  app->add_option("-w,--workpiece", l.workpiece, "the part: an STL in the program's coordinates");
  app->add_option("--workpiece-unit", l.workpiece_unit, "unit of the STL: mm | cm | m | inch");
  app->add_option(
         "--work-offset", l.work_offset,
         "G54=x,y,z[,a,b,c]: the program's zero on the output machine, mm and deg; convert: "
         "auto finds it")
      ->take_all()
      ->allow_extra_args(false);
}

// How a CAM program is to be read, and how closely it is to be followed.
void add_input_options(CLI::App* app, CommandLine& l) {
  app->add_option("--input-format", l.input_format, "nc | heidenhain | cl | csv");
  app->add_option("--input-dialect", l.input_dialect,
                  "linuxcnc | fanuc | haas | siemens | heidenhain; found out when only one fits");
  app->add_option("--integer-unit", l.integer_unit,
                  "fanuc, haas: what one unit of a number without point is, 1 or 0.001 (mm, deg)");
  app->add_option("--input-unit", l.input_unit,
                  "cl: unit of lengths before UNITS, mm or inch; no default");
  app->add_option("--input-feed", l.input_feed,
                  "cl: feed of motions before the first FEDRAT, mm/min; no default");
  app->add_option(
      "--cl-frames", l.cl_frames,
      "cl: what MSYS and CSYS do: one (a second frame is refused) | reported | applied");
  app->add_option("--cl-circles", l.cl_circles,
                  "cl: CIRCLE of the NX form about its axis: tangents (found out) | cw | ccw");
  app->add_option("--run-budget", l.run_budget,
                  "nc: blocks that loops, calls and cycles may run again; default 1000000");
  app->add_option("--call-depth", l.call_depth, "nc: calls within each other; default 9");
  app->add_option("--input-machine", l.input_machine,
                  "the machine that the input was posted for; needed for rotary words");
  app->add_option("--process", l.process,
                  "TOML with [process.events] in place of the input machine's");
  app->add_option("--input-work-offset", l.input_work_offset,
                  "G54=x,y,z[,a,b,c]: the program's zero on the input machine")
      ->take_all()
      ->allow_extra_args(false);
  app->add_option(
         "--tool", l.tool,
         "N=length, N=length,diameter (for G41, G42) or NAME:N=length in mm, NAME as the input "
         "calls the tool; repeatable")
      ->take_all()
      ->allow_extra_args(false);
  app->add_option("--tip-tolerance", l.tip_tolerance, "mm");
  app->add_option("--axis-tolerance", l.axis_tolerance, "deg");
}

void add_freedom_options(CLI::App* app, CommandLine& l) {
  app->add_option("--lead", l.lead,
                  "lasers: freedom of the beam along the cut around the programmed axis, deg");
  app->add_option("--tilt", l.tilt, "the same across the cut, deg; both default to 0: kept");
  app->add_option("--orientation", l.orientation,
                  "programmed | cone | graph | via | monotone (the last four: lasers)");
}

void add_search_options(CLI::App* app, CommandLine& l) {
  app->add_option("--box", l.box,
                  "x0,y0,z0,x1,y1,z1: where the program's zero may lie, in the coordinates of "
                  "--work-offset, mm; default: all that the machine reaches");
  app->add_option("--turn", l.turn, "largest turn about the vertical either way, deg; default 180");
}

void add_convert(CLI::App& app, CommandLine& l) {
  auto* c = app.add_subcommand("convert", "a CAM program to a certified machine program");
  c->footer(kConvertExample);
  c->add_option("input", l.input, "NC program, CL data or CSV; - for standard input")->required();
  add_machine_options(c, l);
  c->add_option("-o,--output", l.output, "the program; - for standard output");
  add_part_options(c, l);
  add_search_options(c, l);
  c->add_option("--dialect", l.dialect, "output dialect instead of the machine's");
  add_input_options(c, l);
  add_freedom_options(c, l);
  c->add_option("--smoothing", l.smoothing, "acr | ramp | none");
  c->add_option("--optimise", l.optimise, "jerk (lasers) | none");
  c->add_option("--schedule", l.schedule, "jerk (default) | constant | programmed");
  c->add_option("--links", l.links,
                "plan (default): motion between cuts is ours | keep: the input's");
  c->add_option("--cuts", l.cuts, "7, 7-40 or 7-: only these cuts, with a start of their own");
  c->add_option("--trajectory", l.trajectory,
                "write joint samples at the machine's cycle to FILE.csv");
  c->add_option("--line-map", l.line_map, "write output line -> input line to FILE.json");
  c->add_flag("--no-collision-check", l.no_collision_check,
              "leave the clearance of the machine's bodies unchecked");
  c->add_flag("--force", l.force, "write a refused program too, marked NOT CERTIFIED");
  c->add_flag("--in-place", l.in_place,
              "the program replaces the input file, which stays as it is when the program is "
              "refused");
  add_output_options(c, l);
}

void add_finish(CLI::App& app, CommandLine& l) {
  auto* c = app.add_subcommand("finish", "the mesh of a printed part to a finishing program");
  c->footer(kFinishExample);
  c->add_option("input", l.input, "the part: an STL, walls to be finished; - for standard input")
      ->required();
  add_machine_options(c, l);
  c->add_option("-o,--output", l.output, "the program; - for standard output");
  c->add_option("--workpiece-unit", l.workpiece_unit, "unit of the STL: mm | cm | m | inch");
  c->add_option("--work-offset", l.work_offset,
                "G54=x,y,z[,a,b,c]: the part's zero in the machine's workpiece frame, mm and deg | "
                "auto: over its middle, as low as can be reached")
      ->take_all()
      ->allow_extra_args(false);
  c->add_option("--pitch", l.pitch, "between layers, mm; default 1");
  c->add_option("--depth", l.depth, "depth of cut, mm; default 0.7: the stock is that much larger");
  c->add_option("--feed", l.feed, "mm/min; default 600");
  c->add_option("--rpm", l.rpm, "of the spindle; default 10000");
  c->add_option("--from", l.from,
                "height of the first layer, mm; default half a pitch above the foot");
  c->add_option("--to", l.to, "no layer above, mm; default the top");
  c->add_option("--lead-in", l.lead_in,
                "radius of the arcs that lead onto a contour and off it, mm; default 3");
  c->add_option("--normal-tolerance", l.normal_tolerance,
                "that the smoothed tool axis may leave the normal by, deg; default 1");
  c->add_option("--direction", l.direction, "of the layers: alternate (default) | same | helical");
  c->add_option("--stock-out", l.stock_out, "write the body to be printed to FILE.stl");
  c->add_option("--mill", l.mill,
                "R,L: radius of the end mill's ball end and its length in front of the machine's "
                "bodies, mm; default 1.5,30");
  c->add_option("--steepest", l.steepest,
                "leave out walls whose normal is farther from level, deg; default 80");
  c->add_option("--contours", l.contours,
                "all (default) | outer: none that lies inside of another");
  c->add_option("--unreachable", l.unreachable,
                "refuse (default) | leave-out: what the machine cannot reach, on your word");
  c->add_option("--scale", l.scale, "factor of the part's size; default 1");
  c->add_option("--tool", l.tool, "N=length: what the end mill is longer than the machine's, mm")
      ->take_all()
      ->allow_extra_args(false);
  c->add_option("--tip-tolerance", l.tip_tolerance, "mm");
  c->add_option("--axis-tolerance", l.axis_tolerance, "of the program against its path, deg");
  c->add_option("--dialect", l.dialect, "output dialect instead of the machine's");
  c->add_option("--schedule", l.schedule, "jerk (default) | constant | programmed");
  c->add_option("--cuts", l.cuts, "7, 7-40 or 7-: only these cuts, with a start of their own");
  c->add_option("--trajectory", l.trajectory,
                "write joint samples at the machine's cycle to FILE.csv");
  c->add_option("--line-map", l.line_map, "write output line -> path point to FILE.json");
  c->add_flag("--no-collision-check", l.no_collision_check,
              "leave the clearance of the machine's bodies unchecked");
  c->add_flag("--force", l.force, "write a refused program too, marked NOT CERTIFIED");
  add_output_options(c, l);
}

void add_place(CLI::App& app, CommandLine& l) {
  auto* c = app.add_subcommand("place", "where to put the part: prints a --work-offset");
  c->footer(kPlaceExample);
  c->add_option("input", l.input, "NC program, CL data or CSV; - for standard input")->required();
  add_machine_options(c, l);
  add_part_options(c, l);
  add_search_options(c, l);
  c->add_option("--dialect", l.dialect, "output dialect instead of the machine's");
  add_input_options(c, l);
  c->add_option("--smoothing", l.smoothing, "as for convert");
  c->add_option("--links", l.links, "plan | keep, as for convert");
  c->add_option("--cuts", l.cuts, "7, 7-40 or 7-: only these cuts count");
  add_output_options(c, l);
}

void add_check(CLI::App& app, CommandLine& l) {
  auto* c = app.add_subcommand("check", "certify an existing machine program");
  c->footer(kCheckExample);
  c->add_option("program", l.input, "the program; - for standard input")->required();
  add_machine_options(c, l);
  c->add_option("--dialect", l.dialect, "the program's dialect instead of the machine's");
  add_part_options(c, l);
  c->add_option("--against", l.against,
                "the CAM program that it is to follow: certifies its shape too");
  add_freedom_options(c, l);
  add_input_options(c, l);
  add_output_options(c, l);
}

void add_batch(CLI::App& app, CommandLine& l) {
  auto* c =
      app.add_subcommand("batch", "many conversions, each in a process of its own; restartable");
  c->footer(kBatchExample);
  c->add_option("jobs_file", l.arguments, "the job file, TOML")->required()->expected(1);
  c->add_option("--jobs", l.jobs, "how many run at a time; default: one for each processor");
  c->add_option("--only", l.only, "run this one job here and now, with its exit status");
  c->add_flag("--list", l.list, "name the jobs, run none");
  c->add_option("--worker", l.worker, "the smoothpost program that runs a job; default: this one");
  add_run_options(c, l);
}

CLI::App* add_words(CLI::App& app, CommandLine& l, const char* name, const char* help,
                    const char* example) {
  auto* c = app.add_subcommand(name, help);
  c->footer(example);
  c->add_option("words", l.arguments, "what to do");
  c->add_option("--machine-path", l.machine_path, "folders of machines, separated by ':'");
  c->add_option("--set", l.set, "section.key=value of the machine file, repeatable")
      ->take_all()
      ->allow_extra_args(false);
  add_run_options(c, l);
  return c;
}

/// What is wrong with the first word, where it is no command of ours; empty: nothing.
std::string unknown_command(const CLI::App& app, const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const CLI::App* c : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(c->get_name());
  std::string list;
  for (const auto& name : names) list += (list.empty() ? "" : ", ") + name;
  if (words.empty()) return "no command: " + list;
  if (words[0].empty() || words[0][0] == '-') return {};
  if (std::find(names.begin(), names.end(), words[0]) != names.end()) return {};
  const std::string guess = did_you_mean(words[0], names);
  return "unknown command \"" + words[0] + "\"" + (guess.empty() ? ": " + list : guess);
}

/// The command that was given, for messages.
std::string command_name(const CLI::App& app) {
  const auto given = app.get_subcommands();
  return given.empty() ? std::string() : given.front()->get_name() + ": ";
}

/// The first argument that no option takes; an option with the nearest one that there is.
std::string unexpected(const CLI::App& app) {
  const auto given = app.get_subcommands();
  const CLI::App& command = given.empty() ? app : *given.front();
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options())
    for (const auto& name : option->get_lnames()) known.push_back("--" + name);
  const auto rest = app.remaining(true);
  for (const std::string& word : rest) {
    if (word.size() < 2 || word[0] != '-') continue;
    const std::string name = word.substr(0, word.find('='));
    return command_name(app) + "unknown option " + name + did_you_mean(name, known);
  }
  return command_name(app) + "unexpected \"" + (rest.empty() ? "" : rest.front()) + "\"";
}

Parsed refused(const std::string& text) {
  std::cerr << "error: " << text << " (--help shows an example and all options) ["
            << "US106"
            << "]\n";
  Parsed parsed;
  parsed.leave = true;
  parsed.status = static_cast<int>(SMOOTHPOST_USAGE);
  return parsed;
}

}  // namespace

Parsed parse_command_line(int argc, char** argv) {
  Parsed parsed;
  CommandLine& l = parsed.line;
  CLI::App app("smoothpost: CAM programs to certified machine programs", "smoothpost");
  app.formatter(std::make_shared<ExampleFirst>());
  app.footer(kConvertExample);
  app.set_version_flag("--version", std::string("smoothpost ") + smoothpost_version());
  app.require_subcommand(1);
  app.add_option_function<std::string>(
         "--generate",
         [&app](const std::string& kind) {
           std::cout << document(app, kind);
           throw CLI::Success();
         },
         "print man | bash | zsh | fish: the manual page, or a shell's completion")
      ->check(CLI::IsMember({"man", "bash", "zsh", "fish"}))
      ->trigger_on_parse();
  add_convert(app, l);
  add_check(app, l);
  add_finish(app, l);
  add_place(app, l);
  add_batch(app, l);
  auto* machines = add_words(
      app, l, "machines",
      "list | show NAME | validate FILE | test-program NAME | import FILE | fit TABLE.csv",
      kMachinesExample);
  machines->add_option("-o,--output", l.output,
                       "test-program, import, fit: the file to write; - for standard output");
  machines->add_option("-m,--machine", l.machine, "fit: the machine, a name or a machine.toml");
  machines->add_option("--dialect", l.dialect, "import: output dialect of the machine file");
  machines
      ->add_option("--tool", l.tool, "test-program, fit: N=length in mm of the tool in the holder")
      ->allow_extra_args(false);
  add_words(app, l, "formats", "input formats and output dialects", kFormatsExample);
  add_words(app, l, "golden", "run DIR | update DIR: sample programs as regression cases",
            kGoldenExample);
  std::vector<std::string> words(argv + 1, argv + argc);
  if (!words.empty() && words[0] == "help") {  // help convert: convert --help
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  const std::string wrong = unknown_command(app, words);
  if (!wrong.empty()) return refused(wrong);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ExtrasError&) {
    return refused(unexpected(app));
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() != static_cast<int>(CLI::ExitCodes::Success))
      return refused(command_name(app) + e.what());
    parsed.leave = true;
    parsed.status = app.exit(e);
    return parsed;
  }
  l.command = app.get_subcommands().front()->get_name();
  return parsed;
}

}  // namespace smoothpost::cli
