#include "postproc/jobs/settings.h"

#include <dlfcn.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "formats/mesh/stl_reader.h"
#include "kernels/core/nearest_name.h"
#include "kernels/core/signed_number.h"
#include "kernels/core/units.h"
#include "kernels/geometry/weld.h"
#include "postproc/jobs/files.h"
#include "postproc/pipeline/registry.h"

namespace smoothpost {

namespace fs = std::filesystem;

namespace {

constexpr double kMostTolerance = 1000.0;  // mm or deg
constexpr double kFurthest = 1e6;          // mm or deg, of a work offset

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  while (true) {
    const auto at = text.find(separator);
    parts.emplace_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

// Meshes of bodies: read, scaled and put into M.
Diagnostics load_body_meshes(MachineDefinition& machine, std::vector<FileHash>& files) {
  for (Body& body : machine.bodies) {
    if (body.shape != BodyShape::mesh || body.mesh) continue;
    const auto bytes = read_file(body.mesh_file);
    if (!bytes.ok()) return bytes.diagnostics();
    files.push_back({body.mesh_file, sha256(bytes.value())});
    StlSettings settings;
    settings.scale = body.mesh_scale;
    const auto stl = read_stl(bytes.value(), body.mesh_file, settings);
    if (!stl.ok()) return stl.diagnostics();
    TriangleMesh mesh = weld(stl.value().corners);
    for (Vec3& v : mesh.vertices) v = body.mesh_frame * v;
    body.mesh = std::make_shared<const TriangleMesh>(std::move(mesh));
  }
  return {};
}

// The folder of the library or program that holds this code.
fs::path own_folder() {
  Dl_info info{};
  if (::dladdr(reinterpret_cast<const void*>(&machine_folders), &info) == 0 || !info.dli_fname)
    return {};
  std::error_code error;
  const fs::path path = fs::canonical(info.dli_fname, error);
  return error ? fs::path{} : path.parent_path();
}

}  // namespace

Diagnostic usage_error(const char* code, std::string text) {
  Diagnostic d;
  d.code = code;
  d.text = std::move(text);
  return d;
}

Diagnostic no_dialect(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& row : dialects()) names.emplace_back(row.name);
  const std::string guess = did_you_mean(name, names);
  return usage_error("US121", "no output dialect \"" + name + "\"" + (guess.empty() ? ":" : guess) +
                                  " `smoothpost formats` lists them");
}

std::optional<double> read_number(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  double value = 0.0;
  const auto [end, error] = from_signed(text, value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

Result<RunBounds> read_run_bounds(const Options& options) {
  RunBounds bounds;
  Diagnostics errors;
  const auto whole = [&errors](const std::string& text, const char* option, double largest) {
    std::optional<double> value;
    if (text.empty()) return value;
    value = read_number(text);
    if (!value || *value != std::floor(*value) || *value < 0.0 || *value > largest)
      errors.push_back(usage_error("US172", std::string(option) + " " + text +
                                                ": expected is a whole number from 0 to " +
                                                std::to_string(static_cast<long long>(largest))));
    return value;
  };
  const auto budget = whole(options.run_budget, "--run-budget", 1e12);
  const auto depth = whole(options.call_depth, "--call-depth", 1000.0);
  if (!errors.empty()) return Result<RunBounds>::failure(std::move(errors));
  if (budget) bounds.run_budget = static_cast<std::uint64_t>(*budget);
  if (depth) bounds.call_depth = static_cast<int>(*depth);
  return bounds;
}

std::vector<std::string> machine_folders(const Options& options) {
  std::vector<std::string> folders;
  if (!options.machine_path.empty()) folders = split(options.machine_path, ':');
  if (const char* variable = std::getenv("SMOOTHPOST_MACHINES"))
    for (auto& folder : split(variable, ':'))
      if (!folder.empty()) folders.push_back(folder);
  const fs::path own = own_folder();
  if (!own.empty()) {
    // <prefix>/lib[/arch], <prefix>/bin -> <prefix>/share; build/<preset>/lib -> the source tree.
    for (const char* way :
         {"../share/smoothpost/machines", "../../share/smoothpost/machines", "../../../machines"}) {
      std::error_code error;
      const fs::path folder = fs::canonical(own / way, error);
      if (!error && fs::is_directory(folder, error)) folders.push_back(folder.string());
    }
  }
  return folders;
}

std::string machine_file_of(const std::string& name_or_file, const Options& options) {
  std::error_code error;
  if (fs::is_regular_file(fs::path(name_or_file) / "machine.toml", error))
    return (fs::path(name_or_file) / "machine.toml").string();
  if (name_or_file.find('/') != std::string::npos || name_or_file.ends_with(".toml"))
    return name_or_file;
  for (const auto& folder : machine_folders(options)) {
    const fs::path candidate = fs::path(folder) / name_or_file / "machine.toml";
    if (fs::exists(candidate, error)) return candidate.string();
  }
  return {};
}

namespace {

/// Faults of an override under the name of the option that the user wrote.
Diagnostics by_option(Diagnostics problems, const Options& o) {
  const struct {
    const char *key, *option;
    const std::string& value;
  } all[] = {{"tolerance.tip_mm", "--tip-tolerance", o.tip_tolerance},
             {"tolerance.axis_deg", "--axis-tolerance", o.axis_tolerance},
             {"tolerance.lead_deg", "--lead", o.lead},
             {"tolerance.tilt_deg", "--tilt", o.tilt},
             {"recipe.smoothing", "--smoothing", o.smoothing},
             {"recipe.orientation", "--orientation", o.orientation},
             {"recipe.optimise", "--optimise", o.optimise},
             {"recipe.schedule", "--schedule", o.schedule},
             {"dialect.name", "--dialect", o.dialect}};
  for (Diagnostic& d : problems)
    for (const auto& each : all)
      if (!each.value.empty() && d.where.file == std::string("--set ") + each.key)
        d.where.file = std::string(each.option) + " " + each.value;
  return problems;
}

}  // namespace

Result<LoadedMachine> load_machine(const std::string& name_or_file, const Options& options,
                                   const std::vector<MachineOverride>& overrides) {
  const std::string path = machine_file_of(name_or_file, options);
  if (path.empty()) {
    std::error_code error;
    std::string where;
    std::vector<std::string> names;
    for (const auto& folder : machine_folders(options)) {
      where += (where.empty() ? "" : ", ") + folder;
      for (const auto& entry : fs::directory_iterator(folder, error))
        if (fs::exists(entry.path() / "machine.toml", error))
          names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    const std::string guess = did_you_mean(name_or_file, names);
    return Result<LoadedMachine>::failure(usage_error(
        "US140", "no machine named \"" + name_or_file + "\" in " +
                     (where.empty() ? "any folder" : where) + (guess.empty() ? ":" : guess) +
                     " `smoothpost machines list` shows what there is"));
  }
  auto bytes = read_file(path, std::size_t{16} << 20);
  if (!bytes.ok()) return Result<LoadedMachine>::failure(bytes.diagnostics());
  auto machine = parse_machine_file(bytes.value(), path, overrides);
  if (!machine.ok())
    return Result<LoadedMachine>::failure(by_option(machine.diagnostics(), options));
  std::vector<FileHash> files{{path, sha256(bytes.value())}};
  if (const Diagnostics problems = load_body_meshes(machine.value(), files); !problems.empty())
    return Result<LoadedMachine>::failure(problems);
  return Result<LoadedMachine>(
      {std::move(machine.value()), path, std::move(bytes.value()), std::move(files)},
      machine.diagnostics());
}

Result<std::vector<MachineOverride>> overrides_of(const Options& options) {
  std::vector<MachineOverride> overrides;
  Diagnostics errors;
  const auto add = [&overrides](const char* key, const std::string& value) {
    if (!value.empty()) overrides.push_back({key, value});
  };
  const auto number = [&](const char* key, const char* option, const std::string& value) {
    const auto read = read_number(value);
    if (!value.empty() && (!read || *read < 0.0 || *read > kMostTolerance))
      errors.push_back(usage_error(
          "US173",
          std::string(option) + " " + value + ": a number from 0 to 1000 is expected, mm or deg"));
    else
      add(key, value);
  };
  number("tolerance.tip_mm", "--tip-tolerance", options.tip_tolerance);
  number("tolerance.axis_deg", "--axis-tolerance", options.axis_tolerance);
  number("tolerance.lead_deg", "--lead", options.lead);
  number("tolerance.tilt_deg", "--tilt", options.tilt);
  add("recipe.smoothing", options.smoothing);
  add("recipe.orientation", options.orientation);
  add("recipe.optimise", options.optimise);
  add("recipe.schedule", options.schedule);
  add("dialect.name", options.dialect);
  for (const auto& entry : options.set) {
    const auto at = entry.find('=');
    if (at == std::string::npos || at == 0)
      errors.push_back(usage_error("US141", "--set " + entry + ": section.key=value is expected"));
    else
      overrides.push_back({entry.substr(0, at), entry.substr(at + 1)});
  }
  if (!errors.empty()) return Result<std::vector<MachineOverride>>::failure(std::move(errors));
  return overrides;
}

Result<std::vector<OffsetOption>> read_offsets(const std::vector<std::string>& texts,
                                               const std::string& option) {
  static const std::vector<std::string> kSystems = {"G54", "G55",   "G56",   "G57",  "G58",
                                                    "G59", "G59.1", "G59.2", "G59.3"};
  std::vector<OffsetOption> offsets;
  Diagnostics errors;
  for (const auto& text : texts) {
    const auto at = text.find('=');
    const auto system = std::find(kSystems.begin(), kSystems.end(), text.substr(0, at));
    std::vector<double> numbers;
    bool good = at != std::string::npos && system != kSystems.end();
    if (good)
      for (const auto& part : split(std::string_view(text).substr(at + 1), ',')) {
        const auto value = read_number(part);
        if (value && std::abs(*value) <= kFurthest)
          numbers.push_back(*value);
        else
          good = false;
      }
    if (!good || (numbers.size() != 3 && numbers.size() != 6)) {
      errors.push_back(
          usage_error("US142", option + " " + text +
                                   ": expected is G54=x,y,z or G54=x,y,z,a,b,c (G54 to "
                                   "G59.3, mm and degrees)"));
      continue;
    }
    OffsetOption offset;
    offset.system = static_cast<int>(system - kSystems.begin()) + 1;
    offset.position = Vec3(numbers[0], numbers[1], numbers[2]);
    if (numbers.size() == 6)
      offset.turn = kRadiansPerDegree * Vec3(numbers[3], numbers[4], numbers[5]);
    offsets.push_back(offset);
  }
  if (!errors.empty()) return Result<std::vector<OffsetOption>>::failure(std::move(errors));
  return offsets;
}

namespace {

/// "N=length", "N=length,diameter" or "NAME:N=length".
struct ToolOption {
  std::string name;
  int number = 0;
  double length = 0.0;
  std::optional<double> diameter;
};

std::optional<ToolOption> read_tool(const std::string& text) {
  const auto equals = text.rfind('=');
  if (equals == std::string::npos) return {};
  const auto colon = text.rfind(':', equals);
  const std::size_t begin = colon == std::string::npos ? 0 : colon + 1;
  const auto number = read_number(text.substr(begin, equals - begin));
  const auto comma = text.find(',', equals);
  const auto length = read_number(text.substr(equals + 1, comma - (equals + 1)));
  std::optional<double> diameter;
  if (comma != std::string::npos) {
    diameter = read_number(text.substr(comma + 1));
    if (!diameter || *diameter < 0.0 || *diameter >= 10000.0) return {};
  }
  if (!number || !length || *number < 1 || *number != std::floor(*number) || *number > 99999 ||
      *length < 0.0 || *length > 10000.0 || colon == 0)
    return {};
  return ToolOption{colon == std::string::npos ? "" : text.substr(0, colon),
                    static_cast<int>(*number), *length, diameter};
}

}  // namespace

Result<cl::ReaderSettings> read_cl_options(const Options& options) {
  cl::ReaderSettings settings;
  Diagnostics errors;
  const auto wrong = [&errors](const char* code, const std::string& option, const std::string& text,
                               const char* expected) {
    errors.push_back(usage_error(code, option + " " + text + ": expected is " + expected));
  };
  if (options.input_unit == "mm" || options.input_unit == "inch")
    settings.unit = options.input_unit == "mm" ? 1.0 : kMillimetresPerInch;
  else if (!options.input_unit.empty())
    wrong("US162", "--input-unit", options.input_unit, "mm or inch");
  if (!options.input_feed.empty()) {
    const auto feed = read_number(options.input_feed);
    if (feed && *feed >= 0.001 && *feed <= 1.0e6)
      settings.feed = *feed / kSecondsPerMinute;
    else
      wrong("US163", "--input-feed", options.input_feed, "mm/min, 0.001 to 1000000");
  }
  if (options.cl_frames == "reported")
    settings.frames = cl::FrameRule::reported;
  else if (options.cl_frames == "applied")
    settings.frames = cl::FrameRule::applied;
  else if (!options.cl_frames.empty() && options.cl_frames != "one")
    wrong("US164", "--cl-frames", options.cl_frames, "one, reported or applied");
  if (options.cl_circles == "cw")
    settings.nx_circles = cl::NxCircleSense::clockwise;
  else if (options.cl_circles == "ccw")
    settings.nx_circles = cl::NxCircleSense::counter_clockwise;
  else if (!options.cl_circles.empty() && options.cl_circles != "tangents")
    wrong("US165", "--cl-circles", options.cl_circles, "tangents, cw or ccw");
  if (!errors.empty()) return Result<cl::ReaderSettings>::failure(std::move(errors));
  return settings;
}

Result<ToolTable> read_tools(const std::vector<std::string>& texts) {
  ToolTable tools;
  Diagnostics errors;
  for (const auto& text : texts) {
    const auto tool = read_tool(text);
    if (!tool) {
      errors.push_back(usage_error(
          "US143", "--tool " + text +
                       ": expected is N=length, N=length,diameter or NAME:N=length: a tool number, "
                       "its length in mm (0 to 10000), its diameter in mm (0 to below 10000) for "
                       "G41 and G42, and the name that the input calls it by"));
      continue;
    }
    tools.lengths[tool->number] = tool->length;
    if (tool->diameter) tools.diameters[tool->number] = *tool->diameter;
    if (!tool->name.empty()) tools.numbers[tool->name] = tool->number;
  }
  if (!errors.empty()) return Result<ToolTable>::failure(std::move(errors));
  return tools;
}

}  // namespace smoothpost
