#include "postproc/jobs/batch.h"

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <thread>

#include "postproc/jobs/batch_file.h"
#include "postproc/jobs/files.h"
#include "postproc/jobs/settings.h"
#include "postproc/jobs/workers.h"
#include "postproc/report/batch_report.h"

namespace smoothpost {

namespace fs = std::filesystem;

namespace {

constexpr double kMostAtOnce = 1024.0;
constexpr std::size_t kLargestRecord = std::size_t{64} << 20;

JobResult failed(Diagnostics diagnostics) {
  JobResult result;
  result.status = status_of(diagnostics);
  result.diagnostics = std::move(diagnostics);
  return result;
}

std::string below(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

std::string record_path(const BatchFile& file, const BatchJob& job) {
  return below(below(file.results, "records"), job.name + ".json");
}

std::string log_path(const BatchFile& file, const BatchJob& job) {
  return below(file.results, job.name + ".log");
}

/// `path` as seen from `folder` where it lies below; else absolute.
std::string seen_from(const std::string& folder, const std::string& path) {
  std::error_code error;
  const fs::path from = fs::weakly_canonical(folder, error);
  const fs::path whole = fs::weakly_canonical(path, error);
  const fs::path relative = whole.lexically_relative(from);
  return relative.empty() || *relative.begin() == ".." ? whole.string() : relative.string();
}

/// The machine file of a job's option, as records name it; "" without such an option.
std::string machine_seen(const BatchFile& file, const std::string& machine, const Options& o) {
  return machine.empty() ? "" : seen_from(file.folder, machine_file_of(machine, o));
}

/// Hashes of files, each read once.
class Hashes {
 public:
  explicit Hashes(std::string folder) : folder_(std::move(folder)) {}
  bool same(const std::vector<FileHash>& files) {
    return std::all_of(files.begin(), files.end(),
                       [this](const FileHash& f) { return now(f.path) == f.sha256; });
  }

 private:
  const std::string& now(const std::string& path) {
    const auto [entry, is_new] = known_.insert({path, ""});
    if (is_new) {
      const fs::path whole = fs::path(path).is_absolute() ? fs::path(path) : folder_ / path;
      if (const auto bytes = read_file(whole.string()); bytes.ok())
        entry->second = sha256(bytes.value());
    }
    return entry->second;
  }

  fs::path folder_;
  std::map<std::string, std::string> known_;
};

bool has_read(const BatchRecord& record, const std::string& path) {
  return path.empty() || std::any_of(record.read.begin(), record.read.end(),
                                     [&](const FileHash& f) { return f.path == path; });
}

std::optional<BatchRecord> stored_record(const BatchFile& file, const BatchJob& job) {
  const auto bytes = read_file(record_path(file, job), kLargestRecord);
  if (!bytes.ok()) return {};
  auto record = read_batch_record(bytes.value());
  if (!record || record->job != job.name || record->version != kVersion ||
      record->settings_sha256 != job.settings_sha256)
    return {};
  return record;
}

/// The record of a job that need not run again.
std::optional<BatchRecord> finished(const BatchFile& file, const BatchJob& job, Hashes& hashes) {
  auto record = stored_record(file, job);
  if (!record || record->status != 0) return {};
  const Options& o = job.options;
  // A name may stand for another machine file than it did.
  if (!has_read(*record, machine_seen(file, o.machine, o)) ||
      !has_read(*record, machine_seen(file, o.input_machine, o)))
    return {};
  if (!hashes.same(record->read) || !hashes.same(record->written)) return {};
  return record;
}

// --- one job, in this process
// ------------------------------------------------------------------------

Diagnostics make_folder_of(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error)
    return {
        usage_error("US131", "folder " + folder.string() + " cannot be made: " + error.message())};
  return {};
}

/// The dialect's extension; "out" where the machine cannot be had: the run will say why.
std::string extension_of(const Options& options) {
  const auto overrides = overrides_of(options);
  if (!overrides.ok() || options.machine.empty()) return "out";
  const auto machine = load_machine(options.machine, options, overrides.value());
  return machine.ok() ? machine.value().definition.dialect.extension : "out";
}

bool was_cancelled(const JobResult& result) {
  return std::any_of(result.diagnostics.begin(), result.diagnostics.end(),
                     [](const Diagnostic& d) { return d.code == "US190"; });
}

std::string message_of(const JobResult& result) {
  for (const auto& d : result.diagnostics)
    if (d.severity == Severity::error) return to_string(d);
  return result.summary;
}

std::string log_text(const JobResult& result) {
  std::string text;
  for (const auto& d : result.diagnostics) text += to_string(d) + "\n";
  return text + result.summary + (result.summary.empty() ? "" : "\n");
}

/// Links of the summary, which stands in the results folder.
void add_links(const BatchFile& file, const Options& o, const std::string& program,
               BatchRecord& record) {
  const auto link = [&](const std::string& path) {
    const bool there =
        std::any_of(record.written.begin(), record.written.end(),
                    [&](const auto& f) { return f.path == seen_from(file.folder, path); });
    return !path.empty() && there ? fs::path(path).lexically_relative(file.results).string() : "";
  };
  record.program = link(program);
  record.report = link(o.json);
  record.page = link(o.report);
}

BatchRecord record_of(const BatchFile& file, const BatchJob& job, const Options& ran,
                      const JobResult& result) {
  BatchRecord record;
  record.job = job.name;
  record.version = kVersion;
  record.settings_sha256 = job.settings_sha256;
  record.status = static_cast<int>(result.status);
  record.verdict = result.verdict.empty() ? "refused" : result.verdict;
  if (result.status == ExitStatus::internal) record.verdict = "crashed";
  record.message = message_of(result);
  add_report_figures(result.report, record);
  for (const auto& f : result.read)
    record.read.push_back({seen_from(file.folder, f.path), f.sha256});
  for (const auto& f : result.written)
    record.written.push_back({seen_from(file.folder, f.path), f.sha256});
  add_links(file, ran, result.program_path, record);
  return record;
}

JobResult run_here(const BatchFile& file, const BatchJob& job, const Progress& progress) {
  Options options = job.options;
  const std::string wanted = "{extension}";
  if (const auto place = options.output.find(wanted); place != std::string::npos)
    options.output.replace(place, wanted.size(), extension_of(options));
  std::vector<std::string> targets = output_paths(options);
  targets.push_back(log_path(file, job));
  targets.push_back(record_path(file, job));
  for (const auto& path : targets)
    if (auto problems = make_folder_of(path); !problems.empty()) return failed(std::move(problems));
  std::error_code ignored;
  fs::remove(targets.back(), ignored);
  JobResult result = run_job(options, progress);
  if (was_cancelled(result)) return result;
  const BatchRecord record = record_of(file, job, options, result);
  auto problems = write_file(log_path(file, job), log_text(result));
  if (problems.empty()) problems = write_file(targets.back(), batch_record_json(record));
  if (!problems.empty()) {
    result.diagnostics.insert(result.diagnostics.end(), problems.begin(), problems.end());
    result.status = status_of(result.diagnostics);
  }
  return result;
}

// --- all jobs
// ----------------------------------------------------------------------------------------

/// The tool beside the library that holds this code; empty where there is none.
std::string own_tool() {
  Dl_info info{};
  if (::dladdr(reinterpret_cast<const void*>(&run_batch_command), &info) == 0 || !info.dli_fname)
    return {};
  std::error_code error;
  const fs::path own = fs::canonical(info.dli_fname, error);
  if (error) return {};
  for (const char* way : {"../bin/smoothpost", "../../bin/smoothpost"}) {
    const fs::path tool = fs::canonical(own.parent_path() / way, error);
    if (!error) return tool.string();
  }
  return {};
}

class Batch {
 public:
  Batch(const Options& options, const BatchFile& file, const Progress& progress)
      : options_(options), file_(file), progress_(progress), hashes_(file.folder) {}

  JobResult run() {
    if (!read_settings()) return finish();
    records_.resize(file_.jobs.size());
    for (std::size_t i = 0; i < file_.jobs.size(); ++i) look_at(i);
    const std::size_t kept = file_.jobs.size() - waiting_.size();
    ended_ = kept;
    std::vector<WorkerTask> tasks;
    for (const std::size_t i : waiting_)
      tasks.push_back(
          {{worker_, "batch", file_.path, "--only", file_.jobs[i].name, "--progress", "none"},
           log_path(file_, file_.jobs[i])});
    const bool whole = run_workers(
        tasks, at_once_, [this](const WorkerEnd& end) { job_ended(end); },
        [this] { return going(); });
    if (!whole) add(usage_error("US190", "cancelled; run the same command again for the rest"));
    write_summary();
    text(kept);
    return finish();
  }

 private:
  void add(Diagnostic d) { result_.diagnostics.push_back(std::move(d)); }

  bool read_settings() {
    at_once_ = std::max(1U, std::thread::hardware_concurrency());
    if (!options_.jobs.empty()) {
      const auto number = read_number(options_.jobs);
      if (number && *number >= 1.0 && *number <= kMostAtOnce && *number == std::floor(*number))
        at_once_ = static_cast<std::size_t>(*number);
      else
        add(usage_error("US183", "--jobs " + options_.jobs +
                                     ": expected is 1 to 1024, how many "
                                     "jobs run at a time"));
    }
    worker_ = options_.worker.empty() ? own_tool() : options_.worker;
    if (worker_.empty() || ::access(worker_.c_str(), X_OK) != 0)
      add(usage_error("US185", "no program to run a job with" +
                                   (worker_.empty() ? std::string() : " at " + worker_) +
                                   ": say --worker, the path of the smoothpost program"));
    for (const auto& problem : make_folder_of(below(file_.results, "x"))) add(problem);
    return !has_error(result_.diagnostics);
  }

  void look_at(std::size_t job) {
    BatchRecord& record = records_[job];
    if (auto done = finished(file_, file_.jobs[job], hashes_)) {
      record = std::move(*done);
    } else {
      record.job = file_.jobs[job].name;
      record.verdict = "not run";
      std::error_code ignored;
      fs::remove(record_path(file_, file_.jobs[job]), ignored);
      waiting_.push_back(job);
    }
    add_log(job);
  }

  void add_log(std::size_t job) {
    std::error_code error;
    const std::string log = log_path(file_, file_.jobs[job]);
    records_[job].log = fs::exists(log, error) ? fs::path(log).filename().string() : "";
  }

  void job_ended(const WorkerEnd& end) {
    const std::size_t index = waiting_[end.task];
    const BatchJob& job = file_.jobs[index];
    ++ended_;
    if (end.signal != 0)
      for (const auto& path : output_paths(job.options))
        remove_temporaries(fs::path(path).parent_path().string(), end.process);
    if (auto record = stored_record(file_, job)) {
      records_[index] = std::move(*record);
    } else if (going_) {
      crashed(index, end);
    }
    add_log(index);
  }

  void crashed(std::size_t index, const WorkerEnd& end) {
    BatchRecord& record = records_[index];
    record.verdict = "crashed";
    record.message =
        end.signal != 0
            ? "the process was ended by signal " + std::to_string(end.signal)
            : "the process ended with status " + std::to_string(end.status) + " and left no result";
    Diagnostic d;
    d.code = "IN103";
    d.text = "job \"" + record.job + "\": " + record.message + "; its messages are in " +
             log_path(file_, file_.jobs[index]) + ". The other jobs were run";
    add(std::move(d));
  }

  bool going() {
    const std::string stage =
        "job " + std::to_string(ended_) + " of " + std::to_string(file_.jobs.size());
    going_ = progress_(stage.c_str(),
                       static_cast<double>(ended_) / static_cast<double>(file_.jobs.size()));
    return going_;
  }

  void write_summary() {
    const std::string name = fs::path(file_.path).filename().string();
    result_.report = batch_summary_json(name, records_);
    result_.page = batch_summary_page(name, records_);
    for (const auto& [path, bytes] :
         {std::pair(below(file_.results, "summary.json"), result_.report),
          std::pair(below(file_.results, "summary.html"), result_.page)})
      for (const auto& problem : write_file(path, bytes)) add(problem);
  }

  void text(std::size_t kept) {
    for (const BatchRecord& r : records_)
      result_.text += r.job + ": " + r.verdict +
                      (r.status == 0 || r.message.empty() ? "" : ": " + r.message) + "\n";
    result_.summary = batch_count_words(records_) + "; " + std::to_string(kept) +
                      " finished before; summary in " + below(file_.results, "summary.html");
  }

  JobResult finish() {
    result_.status = status_of(result_.diagnostics);
    for (const ExitStatus status :
         {ExitStatus::internal, ExitStatus::usage, ExitStatus::unreadable, ExitStatus::refused}) {
      const bool has = result_.status == status ||
                       std::any_of(records_.begin(), records_.end(), [&](const BatchRecord& r) {
                         return r.status == static_cast<int>(status) && r.verdict != "not run";
                       });
      if (!has) continue;
      result_.status = status;
      break;
    }
    return std::move(result_);
  }

  const Options& options_;
  const BatchFile& file_;
  const Progress& progress_;
  Hashes hashes_;
  std::size_t at_once_ = 1;
  std::string worker_;
  std::vector<BatchRecord> records_;  ///< one for each job
  std::vector<std::size_t> waiting_;  ///< jobs that have to run
  std::size_t ended_ = 0;
  bool going_ = true;
  JobResult result_;
};

}  // namespace

JobResult run_batch_command(const Options& options, const Progress& progress) {
  if (options.arguments.size() != 1) return failed({usage_error("US104", "batch: JOBS.toml")});
  const auto file = read_batch_file(options.arguments.front());
  if (!file.ok()) return failed(file.diagnostics());
  if (options.list) {
    JobResult result;
    result.status = ExitStatus::certified;
    for (const auto& job : file.value().jobs) result.text += job.name + "\n";
    return result;
  }
  if (options.only.empty()) return Batch(options, file.value(), progress).run();
  const auto& jobs = file.value().jobs;
  const auto job = std::find_if(jobs.begin(), jobs.end(),
                                [&](const BatchJob& j) { return j.name == options.only; });
  if (job == jobs.end())
    return failed({usage_error("US184", "--only " + options.only + ": no such job in " +
                                            file.value().path + "; --list names them")});
  Hashes hashes(file.value().folder);
  const auto done = finished(file.value(), *job, hashes);
  if (!done) return run_here(file.value(), *job, progress);
  JobResult result;
  result.status = ExitStatus::certified;
  result.verdict = done->verdict;
  result.summary = job->name + " was finished before: " + done->message;
  return result;
}

}  // namespace smoothpost
