#include "postproc/jobs/batch_file.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "formats/toml/toml.h"
#include "postproc/jobs/files.h"
#include "postproc/jobs/options_toml.h"
#include "postproc/jobs/settings.h"
#include "postproc/pipeline/hash.h"

namespace smoothpost {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLongestName = 100;
constexpr std::string Options::*kInputs[] = {&Options::input, &Options::workpiece,
                                             &Options::against, &Options::process};
constexpr std::string Options::*kOutputs[] = {
    &Options::output,     &Options::json,     &Options::report,   &Options::plots,
    &Options::trajectory, &Options::line_map, &Options::stock_out};

Diagnostic at(const SourceLocation& where, const char* code, std::string text) {
  Diagnostic d = usage_error(code, std::move(text));
  d.where = where;
  return d;
}

bool good_name(const std::string& name) {
  return !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '_' || c == '-' || c == '.';
         });
}

void replace_all(std::string& text, const std::string& what, const std::string& by) {
  for (std::size_t i = text.find(what); i != std::string::npos; i = text.find(what, i + by.size()))
    text.replace(i, what.size(), by);
}

std::string in_folder(const std::string& folder, const std::string& path) {
  return (folder == "." ? fs::path(path) : fs::path(folder) / path).lexically_normal().string();
}

class Reader {
 public:
  explicit Reader(const std::string& path) {
    file_.path = path;
    const std::string folder = fs::path(path).parent_path().string();
    file_.folder = folder.empty() ? "." : folder;
    file_.results = fs::path(path).stem().string() + "_results";
  }

  Result<BatchFile> run(const TomlTable& toml) {
    const TomlEntry* jobs = nullptr;
    for (const auto& entry : toml.entries()) {
      if (entry.key == "results" && entry.value.kind == TomlKind::string &&
          !entry.value.string.empty())
        file_.results = entry.value.string;
      else if (entry.key == "defaults" && entry.value.kind == TomlKind::table)
        read_defaults(entry.value.table);
      else if (entry.key == "job" && entry.value.kind == TomlKind::array)
        jobs = &entry;
      else
        add(at(entry.where, "US180",
               "key \"" + entry.key +
                   "\": a job file has results = \"folder\", [defaults] and one [[job]] each"));
    }
    file_.results = in_folder(file_.folder, file_.results);
    if (jobs)
      for (const auto& value : jobs->value.items) read_job(value);
    if (file_.jobs.empty() && !has_error(errors_))
      add(at({file_.path, 0, 0}, "US180", "no [[job]] in the job file"));
    for (std::size_t i = 0; i < file_.jobs.size(); ++i) check_outputs(i);
    for (std::size_t i = 0; i < file_.jobs.size(); ++i) check_inputs(i);
    if (has_error(errors_)) return Result<BatchFile>::failure(std::move(errors_));
    return std::move(file_);
  }

 private:
  void add(Diagnostic d) { errors_.push_back(std::move(d)); }
  void add(const Diagnostics& list) { errors_.insert(errors_.end(), list.begin(), list.end()); }

  void read_defaults(const TomlTable& table) {
    auto options = options_from_toml(table);
    add(options.diagnostics());
    if (options.ok()) defaults_ = std::move(options.value());
  }

  void read_job(const TomlValue& value) {
    if (value.kind != TomlKind::table) {
      add(at(value.where, "US180", "a job is a table: [[job]] with input = \"...\""));
      return;
    }
    TomlTable own;
    BatchJob job;
    SourceLocation name_at = value.where;
    for (const auto& entry : value.table.entries()) {
      if (entry.key != "name") {
        own.add(entry);
        continue;
      }
      name_at = entry.where;
      if (entry.value.kind == TomlKind::string) job.name = entry.value.string;
    }
    auto options = options_from_toml(own, defaults_);
    add(options.diagnostics());
    if (!options.ok()) return;
    job.options = std::move(options.value());
    if (job.name.empty()) job.name = fs::path(job.options.input).stem().string();
    check_name(job.name, name_at);
    places_.push_back(value.where);
    complete(job, value.where);
    file_.jobs.push_back(std::move(job));
  }

  void check_name(const std::string& name, const SourceLocation& where) {
    std::string folded = name;
    std::transform(folded.begin(), folded.end(), folded.begin(), [](unsigned char c) {
      return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
    });
    if (!good_name(name))
      add(at(where, "US181",
             "job name \"" + name + "\": expected are 1 to " + std::to_string(kLongestName) +
                 " letters, digits, _ - and ., not a point first; give name = \"...\""));
    else if (folded == "summary" || !names_.insert(folded).second)
      add(at(where, "US181",
             "job name \"" + name +
                 "\" is taken (upper and lower case count as equal): give name = \"...\""));
  }

  void complete(BatchJob& job, const SourceLocation& where) {
    Options& o = job.options;
    if (o.command.empty()) o.command = "convert";
    if (o.command != "convert" && o.command != "check" && o.command != "finish" &&
        o.command != "place")
      add(at(where, "US180",
             "command \"" + o.command + "\": a job is convert, check, finish or place"));
    if (o.input.empty() || o.input == "-")
      add(at(where, "US180", "job \"" + job.name + "\" has no input file"));
    for_each_text(o, [&job](std::string& text) { replace_all(text, "{name}", job.name); });
    job.settings_sha256 = sha256(options_text(o));
    const auto place = [this](std::string& path) {
      if (!path.empty()) path = in_folder(file_.folder, path);
    };
    for (const auto member : kInputs) place(o.*member);
    for (const auto member : kOutputs) place(o.*member);
    for (std::string* machine : {&o.machine, &o.input_machine})
      if (machine->find('/') != std::string::npos || machine->ends_with(".toml")) place(*machine);
    if (o.json.empty()) o.json = in_folder(file_.results, job.name + ".json");
    if (o.output.empty() && (o.command == "convert" || o.command == "finish"))
      o.output = in_folder(file_.results, job.name + ".{extension}");
  }

  void check_outputs(std::size_t job) {
    for (const auto& path : output_paths(file_.jobs[job].options)) {
      const auto [first, is_new] = writers_.insert({path, job});
      if (!is_new)
        add(at(places_[job], "US182",
               "job \"" + file_.jobs[job].name + "\" writes " + path + ", as job \"" +
                   file_.jobs[first->second].name +
                   "\" does: put {name} into the path, or leave it out"));
    }
  }

  void check_inputs(std::size_t job) {
    for (const auto member : kInputs) {
      const auto writer = writers_.find(file_.jobs[job].options.*member);
      if (writer != writers_.end())
        add(at(places_[job], "US182",
               "job \"" + file_.jobs[job].name + "\" reads " + writer->first + ", which job \"" +
                   file_.jobs[writer->second].name +
                   "\" writes: jobs run in any order, so this needs a second job file"));
    }
  }

  BatchFile file_;
  Options defaults_;
  Diagnostics errors_;
  std::set<std::string> names_;
  std::vector<SourceLocation> places_;          ///< of file_.jobs
  std::map<std::string, std::size_t> writers_;  ///< job by what it writes
};

}  // namespace

std::vector<std::string> output_paths(const Options& options) {
  std::vector<std::string> paths;
  for (const auto member : kOutputs)
    if (!(options.*member).empty() && options.*member != "-") paths.push_back(options.*member);
  return paths;
}

Result<BatchFile> read_batch_file(const std::string& path) {
  const auto bytes = read_file(path, kMaxTomlBytes);
  if (!bytes.ok()) return Result<BatchFile>::failure(bytes.diagnostics());
  const auto toml = parse_toml(bytes.value(), path);
  if (!toml.ok()) return Result<BatchFile>::failure(toml.diagnostics());
  return Reader(path).run(toml.value());
}

}  // namespace smoothpost
