#include <csignal>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>

#include "postproc/cli/options.h"
#include "postproc/cli/progress_view.h"

namespace {

using smoothpost::cli::CommandLine;

volatile std::sig_atomic_t interrupted = 0;

/// The first time the run is asked to stop where it can; the second time it ends at once.
void on_interrupt(int number) {
  if (interrupted) {
    std::signal(number, SIG_DFL);
    std::raise(number);
  }
  interrupted = 1;
}

int on_progress(void* user, const char* stage, double share) {
  static_cast<smoothpost::cli::ProgressView*>(user)->show(stage, share);
  return interrupted;
}

const char* or_null(const std::string& text) { return text.empty() ? nullptr : text.c_str(); }

std::vector<const char*> pointers(const std::vector<std::string>& list) {
  std::vector<const char*> out;
  for (const auto& text : list) out.push_back(text.c_str());
  return out;
}

/// The C structure of a command line; owns the pointer lists that the structure refers to.
struct CallOptions {
  smoothpost_options c;
  std::vector<const char*> arguments, work_offset, input_work_offset, tool, set;
  std::string input_bytes;

  explicit CallOptions(const CommandLine& l)
      : arguments(pointers(l.arguments)),
        work_offset(pointers(l.work_offset)),
        input_work_offset(pointers(l.input_work_offset)),
        tool(pointers(l.tool)),
        set(pointers(l.set)) {
    smoothpost_options_init(&c, sizeof c);
    c.command = or_null(l.command);
    c.arguments = arguments.data();
    c.argument_count = arguments.size();
    c.input = or_null(l.input);
    c.machine = or_null(l.machine);
    c.machine_path = or_null(l.machine_path);
    c.workpiece = or_null(l.workpiece);
    c.workpiece_unit = or_null(l.workpiece_unit);
    c.output = or_null(l.output);
    c.dialect = or_null(l.dialect);
    c.input_format = or_null(l.input_format);
    c.input_dialect = or_null(l.input_dialect);
    c.integer_unit = or_null(l.integer_unit);
    c.input_unit = or_null(l.input_unit);
    c.input_feed = or_null(l.input_feed);
    c.cl_frames = or_null(l.cl_frames);
    c.cl_circles = or_null(l.cl_circles);
    c.run_budget = or_null(l.run_budget);
    c.call_depth = or_null(l.call_depth);
    c.input_machine = or_null(l.input_machine);
    c.process = or_null(l.process);
    c.work_offset = work_offset.data();
    c.work_offset_count = work_offset.size();
    c.input_work_offset = input_work_offset.data();
    c.input_work_offset_count = input_work_offset.size();
    c.tool = tool.data();
    c.tool_count = tool.size();
    c.tip_tolerance = or_null(l.tip_tolerance);
    c.axis_tolerance = or_null(l.axis_tolerance);
    c.lead = or_null(l.lead);
    c.tilt = or_null(l.tilt);
    c.smoothing = or_null(l.smoothing);
    c.orientation = or_null(l.orientation);
    c.optimise = or_null(l.optimise);
    c.schedule = or_null(l.schedule);
    c.links = or_null(l.links);
    c.cuts = or_null(l.cuts);
    c.box = or_null(l.box);
    c.turn = or_null(l.turn);
    c.against = or_null(l.against);
    c.json = or_null(l.json);
    c.report = or_null(l.report);
    c.plots = or_null(l.plots);
    c.trajectory = or_null(l.trajectory);
    c.line_map = or_null(l.line_map);
    c.pitch = or_null(l.pitch);
    c.depth = or_null(l.depth);
    c.feed = or_null(l.feed);
    c.rpm = or_null(l.rpm);
    c.from = or_null(l.from);
    c.to = or_null(l.to);
    c.lead_in = or_null(l.lead_in);
    c.normal_tolerance = or_null(l.normal_tolerance);
    c.direction = or_null(l.direction);
    c.stock_out = or_null(l.stock_out);
    c.jobs = or_null(l.jobs);
    c.only = or_null(l.only);
    c.worker = or_null(l.worker);
    c.list = l.list;
    c.mill = or_null(l.mill);
    c.steepest = or_null(l.steepest);
    c.contours = or_null(l.contours);
    c.unreachable = or_null(l.unreachable);
    c.scale = or_null(l.scale);
    c.set = set.data();
    c.set_count = set.size();
    c.no_collision_check = l.no_collision_check;
    c.timings = l.timings;
    c.force = l.force;
    c.in_place = l.in_place;
    if (l.input == "-") {
      input_bytes.assign(std::istreambuf_iterator<char>(std::cin), {});
      c.input_data = input_bytes.data();
      c.input_size = input_bytes.size();
    }
  }
};

void print_diagnostics(const smoothpost_result* result, bool json) {
  if (json) {
    std::cerr << smoothpost_result_diagnostics_json(result, nullptr);
    return;
  }
  const size_t count = smoothpost_result_diagnostic_count(result);
  for (size_t i = 0; i < count; ++i) {
    smoothpost_diagnostic d;
    d.size = sizeof d;
    if (smoothpost_result_diagnostic(result, i, &d) == 0) std::cerr << d.formatted << '\n';
  }
}

int finish(const CommandLine& line, const smoothpost_result* result) {
  int status = smoothpost_result_status(result);
  const bool json = line.diagnostics == "json";
  print_diagnostics(result, json);
  size_t size = 0;
  const char* text = smoothpost_result_text(result, &size);
  std::cout.write(text, static_cast<std::streamsize>(size));
  const char* program = smoothpost_result_program(result, &size);
  if (line.output == "-") std::cout.write(program, static_cast<std::streamsize>(size));
  std::cout.flush();
  if (!std::cout) {
    std::cerr << "error: standard output cannot be written ["
              << "US132"
              << "]\n";
    return SMOOTHPOST_USAGE;
  }
  const std::string summary = smoothpost_result_summary(result);
  const std::string path = smoothpost_result_program_path(result);
  if (!json && !summary.empty())
    std::cerr << summary << (path.empty() ? "" : "; written to " + path) << '\n';
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  const auto parsed = smoothpost::cli::parse_command_line(argc, argv);
  if (parsed.leave) return parsed.status;
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, on_interrupt);
  std::signal(SIGPIPE, SIG_IGN);
  CallOptions options(parsed.line);
  smoothpost::cli::ProgressView view(smoothpost::cli::bar_of(parsed.line.progress));
  options.c.progress = on_progress;
  options.c.progress_user = &view;
  smoothpost_result* raw = nullptr;
  const int status = smoothpost_run(&options.c, &raw);
  view.clear();
  if (!raw) {
    std::cerr << "error: internal error: out of memory ["
              << "IN102"
              << "]\n";
    return status;
  }
  const std::unique_ptr<smoothpost_result, void (*)(smoothpost_result*)> result(
      raw, smoothpost_result_destroy);
  return finish(parsed.line, result.get());
}
