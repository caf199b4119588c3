#include "postproc/jobs/job_input.h"

#include <filesystem>
#include <map>
#include <utility>

#include "formats/mesh/stl_reader.h"
#include "kernels/core/units.h"
#include "kernels/geometry/mesh_report.h"
#include "kernels/geometry/weld.h"
#include "postproc/jobs/files.h"
#include "postproc/jobs/settings.h"
#include "postproc/pipeline/registry.h"

namespace smoothpost {
namespace {

namespace fs = std::filesystem;

constexpr const char* kConversational = "heidenhain";  // a dialect that is a format of its own

void append(Diagnostics& all, const Diagnostics& more) {
  all.insert(all.end(), more.begin(), more.end());
}

/// --input-dialect heidenhain is the format of that name for every name of a file but CL and CSV.
const InputFormat* format_of(const Options& options, const std::string& name) {
  const InputFormat* format = options.input_format.empty()
                                  ? format_by_extension(name)
                                  : find_input_format(options.input_format);
  const bool words = format == nullptr ? options.input_format.empty() : format->has_words;
  return words && options.input_dialect == kConversational ? find_input_format(kConversational)
                                                           : format;
}

Diagnostic unknown_format(const Options& options, const std::string& name) {
  return usage_error(
      "US103",
      options.input_format.empty()
          ? "the format of " + name + " cannot be told from its name: say --input-format nc|cl|csv"
          : "--input-format " + options.input_format +
                " is not read in this version; possible: cl, csv, heidenhain, nc");
}

Diagnostics read_dialect(const Options& options, InputSettings& settings) {
  if (!options.input_dialect.empty() && options.input_dialect != kConversational) {
    settings.dialect = input_dialect(options.input_dialect);
    if (!settings.dialect)
      return {usage_error("US122", "--input-dialect " + options.input_dialect +
                                       " is not read in this version; possible: linuxcnc, fanuc, "
                                       "haas, siemens, heidenhain")};
  }
  if (options.integer_unit.empty()) return {};
  settings.integer_unit = read_number(options.integer_unit);
  if (settings.integer_unit && (*settings.integer_unit == 1.0 || *settings.integer_unit == 0.001))
    return {};
  return {usage_error("US159", "--integer-unit " + options.integer_unit +
                                   ": expected is 1 (X10 is 10 mm) or 0.001 (X10 is 0.010 mm)")};
}

nc::WorkOffset words_of(const OffsetOption& offset) {
  nc::WorkOffset words;
  for (int i = 0; i < 3; ++i) {
    words.words[static_cast<std::size_t>(i)] = offset.position[i];
    words.words[static_cast<std::size_t>(i) + 3] = offset.turn[i];
  }
  return words;
}

/// `told` gets what is said on the way; with an error in it the settings are not whole.
void read_settings(const Options& options, InputSettings& settings, std::vector<FileHash>& files,
                   Diagnostics& told) {
  // The value of a reading, or nullptr when it failed.
  const auto value_of = [&told](auto& read) {
    append(told, read.diagnostics());
    return read.ok() ? &read.value() : nullptr;
  };
  append(told, read_dialect(options, settings));
  if (has_error(told)) return;
  const bool from_file = !options.against.empty() || (!options.input_data && options.input != "-");
  if (from_file) {
    const auto folder = fs::path(settings.file_name).parent_path();
    settings.subroutine_folders = {folder.empty() ? "." : folder.string()};
  }
  const auto bounds = read_run_bounds(options);
  if (value_of(bounds) == nullptr) return;
  settings.run_budget = bounds.value().run_budget;
  settings.call_depth = bounds.value().call_depth;
  auto cl = read_cl_options(options);
  if (value_of(cl) == nullptr) return;
  settings.cl = std::move(cl.value());
  if (!options.input_machine.empty()) {
    auto machine = load_machine(options.input_machine, options, {});
    if (value_of(machine) == nullptr) return;
    files.insert(files.end(), machine.value().files.begin(), machine.value().files.end());
    settings.machine = std::move(machine.value().definition);
  }
  if (!options.process.empty()) {
    const auto bytes = read_file(options.process, std::size_t{16} << 20);
    if (value_of(bytes) == nullptr) return;
    files.push_back({options.process, sha256(bytes.value())});
    auto process = parse_process_file(bytes.value(), options.process);
    if (value_of(process) == nullptr) return;
    settings.process = std::move(process.value());
  }
  auto tools = read_tools(options.tool);
  const auto offsets = read_offsets(options.input_work_offset, "--input-work-offset");
  const bool both = (value_of(tools) != nullptr) & (value_of(offsets) != nullptr);
  if (!both) return;
  settings.tool_lengths = std::move(tools.value().lengths);
  settings.tool_diameters = std::move(tools.value().diameters);
  settings.tool_numbers = std::move(tools.value().numbers);
  for (const auto& offset : offsets.value())
    settings.work_offsets[offset.system] = words_of(offset);
}

Result<InterpretedInput> with_told(Diagnostics told, Result<InterpretedInput> read) {
  append(told, read.diagnostics());
  if (!read.ok()) return Result<InterpretedInput>::failure(std::move(told));
  return {std::move(read.value()), std::move(told)};
}

}  // namespace

CamProgram read_cam_program(const Options& options, const std::string& name, std::string bytes) {
  using Read = Result<InterpretedInput>;
  const InputFormat* format = format_of(options, name);
  if (format == nullptr) return {Read::failure(unknown_format(options, name)), "", {}};
  InputSettings settings;
  settings.file_name = name;
  std::vector<FileHash> files;
  Diagnostics told;
  read_settings(options, settings, files, told);
  if (has_error(told)) return {Read::failure(std::move(told)), format->name, std::move(files)};
  Read input = with_told(std::move(told), format->read(std::move(bytes), settings));
  if (input.ok())
    for (const InputFile& file : input.value().files) files.push_back({file.path, file.sha256});
  return {std::move(input), format->name, std::move(files)};
}

Result<TriangleMesh> read_mesh(const Options& options, const std::string& bytes,
                               const std::string& name) {
  const std::map<std::string, double> units{
      {"", 1.0}, {"mm", 1.0}, {"cm", 10.0}, {"m", 1000.0}, {"inch", kMillimetresPerInch}};
  const auto unit = units.find(options.workpiece_unit);
  if (unit == units.end())
    return Result<TriangleMesh>::failure(usage_error(
        "US145", "--workpiece-unit " + options.workpiece_unit + ": expected is mm, cm, m or inch"));
  StlSettings settings;
  settings.scale = unit->second;
  const auto stl = read_stl(bytes, name, settings);
  if (!stl.ok()) return Result<TriangleMesh>::failure(stl.diagnostics());
  Diagnostics told = stl.diagnostics();
  TriangleMesh mesh = weld(stl.value().corners);
  append(told, mesh_findings(describe(mesh), name));
  append(told, surface_findings(report_surface(mesh), name));
  return {std::move(mesh), std::move(told)};
}

}  // namespace smoothpost
