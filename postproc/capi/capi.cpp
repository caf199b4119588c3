#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "postproc/jobs/job.h"
#include "postproc/report/report_json.h"
#include "smoothpost/smoothpost.h"

struct smoothpost_result {
  smoothpost::JobResult job;
  std::vector<std::string> formatted;  ///< one per diagnostic
  std::string diagnostics_json;
};

namespace {

using smoothpost::Options;

std::string text(const char* value) { return value ? std::string(value) : std::string(); }

std::vector<std::string> list(const char* const* values, size_t count) {
  std::vector<std::string> out;
  for (size_t i = 0; values && i < count; ++i) out.push_back(text(values[i]));
  return out;
}

// A caller built against an older header knows fewer members: those it does not know are "not
// given".
smoothpost_options complete(const smoothpost_options& given) {
  smoothpost_options options;
  smoothpost_options_init(&options, sizeof options);
  std::memcpy(static_cast<void*>(&options), &given, std::min(given.size, sizeof options));
  options.size = sizeof options;
  return options;
}

// Whether a caller built against a newer header asks for what this library does not know.
bool asks_for_unknown(const smoothpost_options& given) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(&given);
  return given.size > sizeof given && std::any_of(bytes + sizeof given, bytes + given.size,
                                                  [](unsigned char b) { return b != 0; });
}

smoothpost::JobResult unknown_options() {
  smoothpost::JobResult result;
  result.status = smoothpost::ExitStatus::usage;
  smoothpost::Diagnostic d;
  d.code = "US186";
  d.text = std::string("the host sets an option that smoothpost ") + smoothpost::kVersion +
           " does not know: install the library of the host's header, or leave the option out";
  result.diagnostics.push_back(std::move(d));
  return result;
}

Options options_of(const smoothpost_options& o) {
  Options out;
  out.command = text(o.command);
  out.arguments = list(o.arguments, o.argument_count);
  out.input = text(o.input);
  if (o.input_data)
    out.input_data = std::string(static_cast<const char*>(o.input_data), o.input_size);
  out.machine = text(o.machine);
  out.machine_path = text(o.machine_path);
  out.workpiece = text(o.workpiece);
  if (o.workpiece_data)
    out.workpiece_data = std::string(static_cast<const char*>(o.workpiece_data), o.workpiece_size);
  out.workpiece_unit = text(o.workpiece_unit);
  out.output = text(o.output);
  out.dialect = text(o.dialect);
  out.input_format = text(o.input_format);
  out.input_dialect = text(o.input_dialect);
  out.integer_unit = text(o.integer_unit);
  out.input_unit = text(o.input_unit);
  out.input_feed = text(o.input_feed);
  out.cl_frames = text(o.cl_frames);
  out.cl_circles = text(o.cl_circles);
  out.run_budget = text(o.run_budget);
  out.call_depth = text(o.call_depth);
  out.input_machine = text(o.input_machine);
  out.process = text(o.process);
  out.work_offset = list(o.work_offset, o.work_offset_count);
  out.input_work_offset = list(o.input_work_offset, o.input_work_offset_count);
  out.tool = list(o.tool, o.tool_count);
  out.tip_tolerance = text(o.tip_tolerance);
  out.axis_tolerance = text(o.axis_tolerance);
  out.lead = text(o.lead);
  out.tilt = text(o.tilt);
  out.smoothing = text(o.smoothing);
  out.orientation = text(o.orientation);
  out.optimise = text(o.optimise);
  out.schedule = text(o.schedule);
  out.links = text(o.links);
  out.cuts = text(o.cuts);
  out.box = text(o.box);
  out.turn = text(o.turn);
  out.against = text(o.against);
  out.json = text(o.json);
  out.report = text(o.report);
  out.plots = text(o.plots);
  out.trajectory = text(o.trajectory);
  out.line_map = text(o.line_map);
  out.pitch = text(o.pitch);
  out.depth = text(o.depth);
  out.feed = text(o.feed);
  out.rpm = text(o.rpm);
  out.from = text(o.from);
  out.to = text(o.to);
  out.lead_in = text(o.lead_in);
  out.normal_tolerance = text(o.normal_tolerance);
  out.direction = text(o.direction);
  out.stock_out = text(o.stock_out);
  out.jobs = text(o.jobs);
  out.only = text(o.only);
  out.worker = text(o.worker);
  out.list = o.list != 0;
  out.mill = text(o.mill);
  out.steepest = text(o.steepest);
  out.contours = text(o.contours);
  out.unreachable = text(o.unreachable);
  out.scale = text(o.scale);
  out.set = list(o.set, o.set_count);
  out.no_collision_check = o.no_collision_check != 0;
  out.timings = o.timings != 0;
  out.force = o.force != 0;
  out.in_place = o.in_place != 0;
  return out;
}

const char* bytes(const std::string& text, size_t* size) {
  if (size) *size = text.size();
  return text.c_str();
}

}  // namespace

extern "C" {

void smoothpost_options_init(smoothpost_options* options, size_t size) {
  if (!options) return;
  std::memset(static_cast<void*>(options), 0, size);
  if (size >= sizeof options->size) options->size = size;
}

smoothpost_status smoothpost_run(const smoothpost_options* options, smoothpost_result** result) {
  if (!options || !result || options->size < sizeof options->size) return SMOOTHPOST_USAGE;
  *result = nullptr;
  try {
    const smoothpost_options given = complete(*options);
    smoothpost::Progress progress;
    if (given.progress)
      progress.report = [&given](const char* stage, double share) {
        return given.progress(given.progress_user, stage, share) == 0;
      };
    auto out = std::make_unique<smoothpost_result>();
    out->job = asks_for_unknown(*options) ? unknown_options()
                                          : smoothpost::run_job(options_of(given), progress);
    for (const auto& d : out->job.diagnostics) out->formatted.push_back(smoothpost::to_string(d));
    out->diagnostics_json = smoothpost::diagnostics_json(out->job.diagnostics);
    *result = out.release();
    return smoothpost_result_status(*result);
  } catch (...) {  // memory; whatever a host's callback throws
    return SMOOTHPOST_INTERNAL;
  }
}

void smoothpost_result_destroy(smoothpost_result* result) { delete result; }

smoothpost_status smoothpost_result_status(const smoothpost_result* result) {
  return result ? static_cast<smoothpost_status>(result->job.status) : SMOOTHPOST_INTERNAL;
}

const char* smoothpost_result_program(const smoothpost_result* result, size_t* size) {
  return bytes(result->job.program, size);
}
const char* smoothpost_result_program_path(const smoothpost_result* result) {
  return result->job.program_path.c_str();
}
const char* smoothpost_result_report(const smoothpost_result* result, size_t* size) {
  return bytes(result->job.report, size);
}
const char* smoothpost_result_line_map(const smoothpost_result* result, size_t* size) {
  return bytes(result->job.line_map, size);
}
const char* smoothpost_result_trajectory(const smoothpost_result* result, size_t* size) {
  return bytes(result->job.trajectory, size);
}
const char* smoothpost_result_page(const smoothpost_result* result, size_t* size) {
  return bytes(result->job.page, size);
}
size_t smoothpost_result_plot_count(const smoothpost_result* result) {
  return result->job.plots.size();
}
const char* smoothpost_result_plot_name(const smoothpost_result* result, size_t index) {
  const auto& plots = result->job.plots;
  return index < plots.size() ? plots[index].name.c_str() : nullptr;
}
const char* smoothpost_result_plot(const smoothpost_result* result, size_t index, size_t* size) {
  const auto& plots = result->job.plots;
  return index < plots.size() ? bytes(plots[index].svg, size) : nullptr;
}
const char* smoothpost_result_text(const smoothpost_result* result, size_t* size) {
  return bytes(result->job.text, size);
}
const char* smoothpost_result_verdict(const smoothpost_result* result) {
  return result->job.verdict.c_str();
}
const char* smoothpost_result_summary(const smoothpost_result* result) {
  return result->job.summary.c_str();
}

size_t smoothpost_result_diagnostic_count(const smoothpost_result* result) {
  return result->job.diagnostics.size();
}

int smoothpost_result_diagnostic(const smoothpost_result* result, size_t index,
                                 smoothpost_diagnostic* diagnostic) {
  if (!result || !diagnostic || index >= result->job.diagnostics.size()) return -1;
  const auto& d = result->job.diagnostics[index];
  smoothpost_diagnostic out{};
  out.size = diagnostic->size;
  out.severity = static_cast<smoothpost_severity>(static_cast<int>(d.severity));
  out.code = d.code.c_str();
  out.text = d.text.c_str();
  out.file = d.where.file.c_str();
  out.line = d.where.line;
  out.column = d.where.column;
  out.formatted = result->formatted[index].c_str();
  std::memcpy(static_cast<void*>(diagnostic), &out, std::min(diagnostic->size, sizeof out));
  return 0;
}

const char* smoothpost_result_diagnostics_json(const smoothpost_result* result, size_t* size) {
  return bytes(result->diagnostics_json, size);
}

int smoothpost_abi_version(void) { return SMOOTHPOST_ABI_VERSION; }
const char* smoothpost_version(void) { return smoothpost::kVersion; }

}  // extern "C"
