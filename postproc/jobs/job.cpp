#include "postproc/jobs/job.h"

#include <algorithm>
#include <exception>
#include <filesystem>

#include "kernels/core/contract.h"
#include "postproc/jobs/batch.h"
#include "postproc/jobs/files.h"
#include "postproc/jobs/finish.h"
#include "postproc/jobs/golden.h"
#include "postproc/jobs/job_input.h"
#include "postproc/jobs/job_texts.h"
#include "postproc/jobs/machine_commands.h"
#include "postproc/jobs/place.h"
#include "postproc/jobs/report_files.h"
#include "postproc/jobs/settings.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/hash.h"
#include "postproc/pipeline/registry.h"
#include "postproc/pipeline/timeline.h"
#include "postproc/report/report_json.h"

namespace smoothpost {

namespace fs = std::filesystem;

namespace {

std::string base_name(const std::string& path) { return fs::path(path).filename().string(); }

/// One run of convert or check: reads the options, runs the pipeline, writes the files.
class Run {
 public:
  Run(const Options& options, const Progress& progress) : options_(options) {
    // Once the host has said no, it is no to the end, whoever asks.
    progress_.report = [this, &progress](const char* stage, double share) {
      cancelled_ = cancelled_ || !progress(stage, share);
      return !cancelled_;
    };
  }
  Run(const Run&) = delete;  // progress_ refers to it
  Run& operator=(const Run&) = delete;

  JobResult convert_command() {
    if (!options_make_sense() || !load_output_machine() || !load_input()) return finish();
    ConvertInput in;
    if (!read_convert_input(in)) return finish();
    in.stream = !options_.trajectory.empty();
    in.timed = in.stream || wants_page();
    in.collision_check = !options_.no_collision_check;
    std::optional<Conversion> made;
    if (automatic())
      made = convert_at_best_place(in, options_.force);
    else
      made = convert(in, options_.force, progress_);
    if (!made) return finish();
    return deliver(in, *made);
  }

  JobResult finish_command() {
    if (!options_make_sense() || !load_output_machine() || !load_input()) return finish();
    ConvertInput in;
    FinishPath path;
    if (!read_finish_input(in, path)) return finish();
    in.stream = !options_.trajectory.empty();
    in.timed = in.stream || wants_page();
    in.collision_check = !options_.no_collision_check;
    in.finish = &path;
    return deliver(in, convert(in, options_.force, progress_));
  }

  JobResult place_command() {
    if (!options_make_sense() || !load_output_machine() || !load_input()) return finish();
    ConvertInput in;
    if (!read_convert_input(in)) return finish();
    context_.cutter_locations = in.input.path.points.size();
    context_.input_lines = in.input.lines;
    in.timed = wants_page();
    if (const auto conversion = convert_at_best_place(in, false)) report(*conversion, shown(in));
    return finish();
  }

  JobResult check_command() {
    if (!options_make_sense() || !load_output_machine() || !load_input()) return finish();
    CheckInput in;
    std::optional<Pose> placement = read_placement(std::nullopt);
    if (!placement || !read_part(in.part, in.part_name)) return finish();
    in.placement = *placement;
    const auto tools = read_tools(options_.tool);
    add(tools.diagnostics());
    if (!tools.ok()) return finish();
    if (!tools.value().lengths.empty()) in.tool_length = tools.value().lengths.begin()->second;
    in.text = std::move(input_bytes_);
    if (!options_.against.empty() && !read_against(in)) return finish();
    in.file_name = input_name_;
    in.collision_check = !options_.no_collision_check;
    in.machine = machine_.definition;
    context_.input_lines =
        static_cast<std::size_t>(std::count(in.text.begin(), in.text.end(), '\n'));
    context_.program_sha256 = context_.input_sha256;
    report(check_program(in, progress_),
           {in.placement, in.against ? &*in.against : nullptr, in.part ? &*in.part : nullptr,
            in.tool_length, page_text_, in.text});
    return finish();
  }

 private:
  JobResult deliver(const ConvertInput& in, const Conversion& conversion) {
    context_.cutter_locations = in.input.path.points.size();
    context_.input_lines = in.input.lines;
    report(conversion, shown(in));
    result_.line_map = line_map_json(conversion.line_map, base_name(input_name_));
    if (conversion.verdict == Verdict::certified || conversion.verdict == Verdict::forced) {
      result_.program = conversion.program;
      // --force does not write a stream: it has no place for a warning and no operator stop.
      if (conversion.stream && conversion.stream->ok())
        result_.trajectory = conversion.stream->text;
    }
    return finish();
  }

  // The part, the path along its walls, and the stock in the part's place.
  bool read_finish_input(ConvertInput& in, FinishPath& path) {
    std::optional<TriangleMesh> part;
    const auto request = read_finish_options(options_, machine_.definition.tolerance.tip,
                                             machine_.definition.tolerance.axis);
    add(request.diagnostics());
    FinishOnMachine on{machine_.definition, {}, input_name_, !options_.no_collision_check};
    if (!automatic()) {
      on.placement = read_placement(std::nullopt);
      if (!on.placement) return false;
    }
    if (!request.ok() || !read_mesh(input_bytes_, input_name_, part)) return false;
    context_.input_format = "stl";
    auto made = make_placed_finish(*part, request.value(), on, progress_);
    add(made.diagnostics());
    if (!made.ok()) return false;
    PlacedFinish& placed = made.value();
    path = std::move(placed.path);
    if (!options_.stock_out.empty()) {
      const std::string stock = stl_bytes(path.stock);
      const Diagnostics errors = write_file(options_.stock_out, stock);
      add(errors);
      if (has_error(errors)) return false;
      result_.written.push_back({options_.stock_out, sha256(stock)});
    }
    in.input.path = path.path;
    in.input.reference = "the walls of " + base_name(input_name_) + ", " +
                         std::to_string(path.layers.size()) + " layers";
    in.input.lines = path.path.points.size();
    for (std::string& text : placed.assumes) in.input.assumes.push_back(std::move(text));
    for (const Diagnostic& d : made.diagnostics())
      if (d.code == "RG141" || d.code == "RG142" || d.code == "RG143")
        in.input.assumes.push_back(d.text);
    in.placement = placed.placement;
    in.placement_text = automatic() ? placed.placement_text : placement_text_;
    in.part = path.stock;
    in.part_name = input_name_;
    return complete(in);
  }

  void note(const std::vector<FileHash>& files) {
    result_.read.insert(result_.read.end(), files.begin(), files.end());
  }
  void add(Diagnostic d) { result_.diagnostics.push_back(std::move(d)); }
  void add(const Diagnostics& list) {
    result_.diagnostics.insert(result_.diagnostics.end(), list.begin(), list.end());
  }

  bool options_make_sense() {
    if (!options_.links.empty() && options_.links != "plan" && options_.links != "keep")
      add(usage_error("US148", "--links " + options_.links + ": expected is plan or keep"));
    for (const std::string& path : {options_.output, options_.json, options_.report,
                                    options_.line_map, options_.trajectory, options_.stock_out})
      add(check_target(path));
    const bool other_target = !options_.output.empty() || options_.force;
    if (options_.in_place && (options_.command != "convert" || options_.input == "-" ||
                              options_.input_data || other_target))
      add(usage_error(
          "US195",
          "--in-place puts the certified program of convert into the input file: name a "
          "file, and leave out -o and --force"));
    return !has_error(result_.diagnostics);
  }

  bool load_output_machine() {
    if (options_.machine.empty()) {
      add(usage_error("US101",
                      "no machine: say -m MACHINE (`smoothpost machines list` shows them)"));
      return false;
    }
    const auto overrides = overrides_of(options_);
    add(overrides.diagnostics());
    if (!overrides.ok()) return false;
    auto machine = load_machine(options_.machine, options_, overrides.value());
    add(machine.diagnostics());
    if (!machine.ok()) return false;
    machine_ = std::move(machine.value());
    if (!find_dialect(machine_.definition.dialect.name)) {
      add(no_dialect(machine_.definition.dialect.name));
      return false;
    }
    note(machine_.files);
    context_.machine = machine_.definition.name;
    context_.dialect = machine_.definition.dialect.name;
    std::string with_overrides = machine_.text;
    for (const auto& o : overrides.value()) with_overrides += "\n# --set " + o.key + "=" + o.value;
    context_.machine_sha256 = sha256(with_overrides);
    return true;
  }

  bool load_input() {
    if (options_.input.empty()) {
      add(usage_error("US102", "no input file"));
      return false;
    }
    input_name_ = options_.input == "-" ? "<stdin>" : options_.input;
    if (options_.input_data) {
      input_bytes_ = *options_.input_data;
    } else {
      auto bytes = read_file(options_.input);
      add(bytes.diagnostics());
      if (!bytes.ok()) {
        unreadable_ = true;
        return false;
      }
      input_bytes_ = std::move(bytes.value());
      note({{options_.input, sha256(input_bytes_)}});
    }
    if (!options_.output.empty() && options_.output != "-" && !options_.input_data) {
      std::error_code error;
      if (fs::equivalent(options_.output, options_.input, error)) {
        add(usage_error("US105", "-o " + options_.output +
                                     " is the input file: name another output, or say --in-place"));
        return false;
      }
    }
    context_.input_file = base_name(input_name_);
    context_.input_sha256 = sha256(input_bytes_);
    context_.version = kVersion;
    context_.timings = options_.timings;
    return true;
  }

  bool wants_page() const { return !options_.report.empty() || !options_.plots.empty(); }

  PageParts shown(const ConvertInput& in) const {
    return {in.placement, &in.input, in.part ? &*in.part : nullptr, 0.0, page_text_, {}};
  }

  bool automatic() const {
    return options_.work_offset.size() == 1 && options_.work_offset.front() == "auto";
  }

  /// What every conversion has besides its path.
  bool complete(ConvertInput& in) {
    if (!options_.cuts.empty()) {
      const auto cuts = parse_cut_range(options_.cuts);
      add(cuts.diagnostics());
      if (!cuts.ok()) return false;
      in.cuts = cuts.value();
    }
    in.machine = machine_.definition;
    in.input_name = input_name_;
    in.title = program_title(in, base_name(input_name_), context_.input_sha256);
    return true;
  }

  bool read_convert_input(ConvertInput& in) {
    if (!read_program(in) || !place(in) || !read_part(in.part, in.part_name)) return false;
    in.keep_links = options_.links == "keep";
    return complete(in);
  }

  /// Of the places that the search finds the best that gives a certified program; `in` is then
  /// placed there. With `force` the best place, when none does.
  std::optional<Conversion> convert_at_best_place(ConvertInput& in, bool force) {
    const auto wanted = read_place_options(options_);
    add(wanted.diagnostics());
    if (!wanted.ok()) return {};
    PlaceInput search{in.input, in.machine,         in.placement,
                      {},       wanted.value().box, wanted.value().turn};
    search.links = {in.keep_links, in.machine.links.micro_joint, in.cuts};
    const auto places = find_places(search, progress_);
    for (auto d : places.diagnostics()) {
      if (d.where.file.empty()) d.where.file = input_name_;
      add(std::move(d));
    }
    if (!places.ok()) return {};
    const int system = in.input.system;
    const auto convert_at = [&](const FoundPlace& place, bool forced) {
      in.placement = place.placement;
      in.placement_text = placement_sentence({system, place.position, place.turn}) +
                          ", a place that smoothpost has found: the part has to stand there";
      in.title = program_title(in, base_name(input_name_), context_.input_sha256);
      return convert(in, forced, progress_);
    };
    const auto placed = first_certified(
        places.value(), system, [&](const FoundPlace& place) { return convert_at(place, false); });
    for (auto d : placed.diagnostics()) {
      if (d.where.file.empty()) d.where.file = input_name_;
      add(std::move(d));
    }
    std::optional<std::size_t> place;
    if (placed.ok()) place = placed.value().place;
    context_.placement = placement_report(places.value(), place, system);
    if (!placed.ok())
      return force ? std::optional<Conversion>(convert_at(places.value().best.front(), true))
                   : std::nullopt;
    if (options_.command == "place") result_.text = place_text(places.value(), *place, system);
    return placed.value().conversion;
  }

  bool read_program(ConvertInput& in) {
    auto input = read_cam(input_name_, std::move(input_bytes_));
    if (!input) return false;
    in.input = std::move(*input);
    return true;
  }

  bool read_against(CheckInput& in) {
    auto bytes = read_file(options_.against);
    add(bytes.diagnostics());
    if (!bytes.ok()) {
      unreadable_ = true;
      return false;
    }
    context_.input_files.push_back(
        {base_name(options_.against), sha256(bytes.value()), options_.against});
    note({{options_.against, sha256(bytes.value())}});
    in.against = read_cam(options_.against, std::move(bytes.value()));
    return in.against.has_value();
  }

  std::optional<InterpretedInput> read_cam(const std::string& name, std::string bytes) {
    if (wants_page()) page_text_ = bytes;
    CamProgram program = read_cam_program(options_, name, std::move(bytes));
    context_.input_format = program.format;
    note(program.files);
    add(program.input.diagnostics());
    if (!program.input.ok()) return {};
    InterpretedInput& input = program.input.value();
    context_.input_dialect = input.dialect;
    context_.input_files.insert(context_.input_files.end(), input.files.begin(), input.files.end());
    return std::move(input);
  }

  // Where the program's zero lies on the output machine. `system`: the one that the program uses.
  std::optional<Pose> read_placement(std::optional<int> system) {
    if (automatic()) {
      if (options_.command == "convert") return Pose::Identity();
      add(usage_error("US122", "--work-offset auto is for convert and finish: give G54=x,y,z"));
      return {};
    }
    const auto offsets = read_offsets(options_.work_offset, "--work-offset");
    add(offsets.diagnostics());
    if (!offsets.ok()) return {};
    Pose placement = Pose::Identity();
    if (offsets.value().empty()) {
      placement_text_ =
          "the program's zero lies at the zero of the machine's workpiece frame (no --work-offset)";
      return placement;
    }
    if (offsets.value().size() > 1 || (system && offsets.value().front().system != *system)) {
      add(usage_error("US144",
                      "--work-offset places the program's zero, which is that of " +
                          system_name(system.value_or(1)) +
                          " here: give exactly that one (others follow by --input-work-offset)"));
      return {};
    }
    const OffsetOption& o = offsets.value().front();
    placement.translation() = o.position;
    placement.linear() = rotation_from_rpy(o.turn.x(), o.turn.y(), o.turn.z());
    placement_text_ = placement_sentence(o);
    return placement;
  }

  bool place(ConvertInput& in) {
    const bool words = context_.input_format == "nc";
    const auto placement =
        read_placement(words ? std::optional<int>(in.input.system) : std::nullopt);
    if (!placement) return false;
    in.placement = *placement;
    in.placement_text = placement_text_;
    return true;
  }

  bool read_part(std::optional<TriangleMesh>& part, std::string& part_name) {
    if (options_.workpiece.empty() && !options_.workpiece_data) return true;
    part_name = options_.workpiece.empty() ? "<workpiece>" : options_.workpiece;
    std::string bytes;
    if (options_.workpiece_data) {
      bytes = *options_.workpiece_data;
    } else {
      auto read = read_file(options_.workpiece);
      add(read.diagnostics());
      if (!read.ok()) {
        unreadable_ = true;
        return false;
      }
      bytes = std::move(read.value());
      note({{options_.workpiece, sha256(bytes)}});
    }
    return read_mesh(bytes, part_name, part);
  }

  bool read_mesh(const std::string& bytes, const std::string& name,
                 std::optional<TriangleMesh>& part) {
    auto mesh = smoothpost::read_mesh(options_, bytes, name);
    add(mesh.diagnostics());
    if (mesh.ok()) part = std::move(mesh.value());
    return mesh.ok();
  }

  void report(const Conversion& conversion, const PageParts& parts) {
    add(conversion.diagnostics);
    if (!conversion.program.empty()) context_.program_sha256 = sha256(conversion.program);
    if (conversion.stream) {
      context_.stream_file = base_name(options_.trajectory);
      context_.stream_sha256 = sha256(conversion.stream->text);
    }
    Conversion told = conversion;
    told.diagnostics = result_.diagnostics;
    result_.report = report_json(told, context_);
    if (wants_page()) make_page(told, parts);
    result_.verdict = to_string(conversion.verdict);
    verdict_ = conversion.verdict;
    result_.summary = summary_text(conversion);
  }

  void make_page(const Conversion& conversion, const PageParts& parts) {
    const bool known = !machine_.definition.axes.empty();
    ReportPage page = page_of(conversion, context_, known ? &machine_.definition : nullptr, parts,
                              result_.report);
    result_.page = std::move(page.html);
    result_.plots = std::move(page.plots);
  }

  /// A cancelled run has no program, also when what is left undone was not needed for one or force
  /// was said.
  void forget_all() {
    Diagnostics told = std::move(result_.diagnostics);
    result_ = JobResult{};
    std::erase_if(told, [](const Diagnostic& d) { return d.code == "US190"; });
    add(told);
    add(usage_error("US190", "cancelled"));
    verdict_.reset();
  }

  /// Without a conversion there is still a report that says why.
  void report_failure() {
    Conversion none;
    none.diagnostics = result_.diagnostics;
    result_.report = report_json(none, context_);
    if (wants_page()) make_page(none, {});
    result_.verdict = to_string(Verdict::refused);
    verdict_ = Verdict::refused;
  }

  JobResult finish() {
    context_.version = kVersion;
    if (cancelled_) forget_all();
    if (!verdict_) report_failure();
    result_.status = status_of(result_.diagnostics);
    if (unreadable_) result_.status = ExitStatus::unreadable;
    if (verdict_ == Verdict::forced) result_.status = ExitStatus::refused;
    write_files();
    return std::move(result_);
  }

  void write_files() {
    const auto write = [this](const std::string& path, const std::string& bytes) {
      if (path.empty() || path == "-" || bytes.empty()) return true;
      if (!check_target(path).empty()) return false;  // told at the start
      const Diagnostics errors = write_file(path, bytes);
      add(errors);
      if (has_error(errors)) {
        result_.status = ExitStatus::usage;
        return false;
      }
      result_.written.push_back({path, sha256(bytes)});
      return true;
    };
    write(options_.json, result_.report);
    write(options_.report, result_.page);
    if (!options_.plots.empty() && options_.plots != "-") {
      const Diagnostics errors = write_plots(options_.plots, result_.plots, result_.written);
      add(errors);
      if (has_error(errors)) result_.status = ExitStatus::usage;
    }
    write(options_.line_map, result_.line_map);
    write(options_.trajectory, result_.trajectory);
    if (result_.program.empty() || options_.output == "-") return;
    // The input is only given up for a run without any fault, of its other files neither.
    if (options_.in_place && result_.status != ExitStatus::certified) return;
    result_.program_path = output_path();
    if (!write(result_.program_path, result_.program)) result_.program_path.clear();
  }

  std::string output_path() const {
    if (options_.in_place) return options_.input;
    return options_.output.empty() ? default_output() : options_.output;
  }

  // The input's stem in the working directory with the dialect's extension, never the input itself.
  std::string default_output() const {
    const fs::path stem =
        options_.input == "-" ? fs::path("stdin") : fs::path(options_.input).stem();
    const std::string extension = "." + machine_.definition.dialect.extension;
    const fs::path wanted = stem.string() + extension;
    std::error_code error;
    if (fs::equivalent(wanted, options_.input, error))
      return stem.string() + "_smoothpost" + extension;
    return wanted.string();
  }

  const Options& options_;
  Progress progress_;
  bool cancelled_ = false;
  JobResult result_;
  LoadedMachine machine_;
  std::string input_name_;
  std::string input_bytes_;
  std::string placement_text_;
  std::string page_text_;  ///< of the CAM program, for the page
  ReportContext context_;
  std::optional<Verdict> verdict_;
  bool unreadable_ = false;
};

JobResult dispatch(const Options& options, const Progress& progress) {
  if (options.command == "convert") return Run(options, progress).convert_command();
  if (options.command == "check") return Run(options, progress).check_command();
  if (options.command == "finish") return Run(options, progress).finish_command();
  if (options.command == "place") return Run(options, progress).place_command();
  if (options.command == "machines") return run_machines_command(options);
  if (options.command == "formats") return run_formats_command(options);
  if (options.command == "golden") return run_golden_command(options, progress);
  if (options.command == "batch") return run_batch_command(options, progress);
  JobResult result;
  result.status = ExitStatus::usage;
  result.diagnostics.push_back(usage_error(
      "US100", "unknown command \"" + options.command +
                   "\": convert, check, finish, place, batch, machines, formats or golden"));
  return result;
}

}  // namespace

ExitStatus status_of(const Diagnostics& diagnostics) {
  bool internal = false, usage = false, unreadable = false, refused = false;
  for (const auto& d : diagnostics) {
    if (d.severity != Severity::error) continue;
    const std::string family = d.code.substr(0, d.code.find_first_of("0123456789"));
    if (family == "IN")
      internal = true;
    else if (family == "US" || d.where.file.rfind("--", 0) == 0)
      usage = true;  // --set and the options that stand for one
    else if (family == "NC" || family == "CL" || family == "CSV" || family == "STL" ||
             family == "MF")
      unreadable = true;
    else
      refused = true;
  }
  if (internal) return ExitStatus::internal;
  if (usage) return ExitStatus::usage;
  if (unreadable) return ExitStatus::unreadable;
  if (refused) return ExitStatus::refused;
  return ExitStatus::certified;
}

JobResult run_job(const Options& options, const Progress& progress) {
  try {
    return dispatch(options, progress);
  } catch (const std::exception& e) {
    JobResult result;
    result.status = ExitStatus::internal;
    Diagnostic d;
    d.code = "IN101";
    d.text = std::string("internal error, please report it: ") + e.what();
    result.diagnostics.push_back(std::move(d));
    return result;
  }
}

}  // namespace smoothpost
