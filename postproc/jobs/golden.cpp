#include "postproc/jobs/golden.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "formats/toml/toml.h"
#include "postproc/jobs/files.h"
#include "postproc/jobs/options_toml.h"
#include "postproc/jobs/settings.h"
#include "postproc/report/report_json.h"

namespace smoothpost {

namespace fs = std::filesystem;

namespace {

struct Case {
  std::string name;
  fs::path folder;
  std::string why;
  bool exact = true;  ///< compare bytes; else the checks of the report with a tolerance
  Options options;
};

struct Outcome {
  std::string program;
  std::string report;
  std::string messages;
  std::string status;
  bool cancelled = false;
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

Result<Case> read_case(const fs::path& folder) {
  const fs::path file = folder / "case.toml";
  const auto bytes = read_file(file.string(), std::size_t{1} << 20);
  if (!bytes.ok()) return Result<Case>::failure(bytes.diagnostics());
  const auto toml = parse_toml(bytes.value(), file.string());
  if (!toml.ok()) return Result<Case>::failure(toml.diagnostics());
  Case c;
  c.name = folder.filename().string();
  c.folder = folder;
  Diagnostics errors;
  for (const auto& entry : toml.value().entries()) {
    if (entry.key == "why" && entry.value.kind == TomlKind::string) {
      c.why = entry.value.string;
    } else if (entry.key == "mode" && entry.value.kind == TomlKind::string &&
               (entry.value.string == "exact" || entry.value.string == "measured")) {
      c.exact = entry.value.string == "exact";
    } else if (entry.key == "options" && entry.value.kind == TomlKind::table) {
      auto options = options_from_toml(entry.value.table);
      if (options.ok())
        c.options = std::move(options.value());
      else
        errors.insert(errors.end(), options.diagnostics().begin(), options.diagnostics().end());
    } else {
      Diagnostic d = usage_error(
          "US150", "key \"" + entry.key +
                       "\": a case has why, mode = \"exact\" | \"measured\" and [options]");
      d.where = entry.where;
      errors.push_back(std::move(d));
    }
  }
  if (!errors.empty()) return Result<Case>::failure(std::move(errors));
  return c;
}

Outcome run_case(const Case& c, const Progress& progress) {
  Options options = c.options;
  Outcome outcome;
  // Bytes go in and out by value, so that messages name files as the case does, wherever it lies.
  const auto load = [&](const std::string& name, std::optional<std::string>& data) {
    if (name.empty()) return;
    auto bytes = read_file((c.folder / name).string());
    if (bytes.ok()) data = std::move(bytes.value());
  };
  load(options.input, options.input_data);
  load(options.workpiece, options.workpiece_data);
  const auto local = [&c](std::string& name) {
    if (!name.empty() && name.ends_with(".toml")) name = (c.folder / name).string();
  };
  local(options.machine);
  local(options.input_machine);
  local(options.process);
  options.output = "-";
  options.json.clear();
  options.line_map.clear();
  options.trajectory.clear();
  const JobResult result = run_job(options, progress);
  outcome.program = result.program;
  outcome.report = result.report;
  for (const auto& d : result.diagnostics) {
    outcome.messages += to_string(d) + "\n";
    outcome.cancelled = outcome.cancelled || d.code == "US190";
  }
  outcome.status = std::to_string(static_cast<int>(result.status)) + "\n";
  return outcome;
}

std::string stored(const Case& c, const char* name) {
  const auto bytes = read_file((c.folder / name).string());
  return bytes.ok() ? bytes.value() : std::string();
}

std::string compare(const Case& c, const Outcome& now) {
  std::string text;
  const auto section = [&text](const char* title, const std::string& difference) {
    if (!difference.empty()) text += std::string("  ") + title + "\n" + difference;
  };
  section("exit status:", text_difference(stored(c, "expected.exit"), now.status));
  if (c.exact) section("program:", text_difference(stored(c, "expected.program"), now.program));
  section("messages:", text_difference(stored(c, "expected.messages"), now.messages));
  const std::string before = stored(c, "expected.json");
  section("checks:", changed_checks(before, now.report, c.exact ? 0.0 : 0.05));
  if (c.exact && before != now.report && text.empty())
    section("report:", text_difference(before, now.report));
  return text;
}

Diagnostics update(const Case& c, const Outcome& now) {
  Diagnostics errors;
  const auto store = [&](const char* name, const std::string& bytes) {
    const fs::path path = c.folder / name;
    std::error_code ignored;
    if (bytes.empty()) {
      fs::remove(path, ignored);
      return;
    }
    const auto failed = write_file(path.string(), bytes);
    errors.insert(errors.end(), failed.begin(), failed.end());
  };
  store("expected.exit", now.status);
  store("expected.program", now.program);
  store("expected.messages", now.messages);
  store("expected.json", now.report);
  return errors;
}

}  // namespace

std::string text_difference(const std::string& expected, const std::string& actual,
                            std::size_t max_lines) {
  if (expected == actual) return {};
  const auto a = lines_of(expected), b = lines_of(actual);
  // Equal head and tail are left out; what is between is shown line by line.
  std::size_t head = 0;
  while (head < a.size() && head < b.size() && a[head] == b[head]) ++head;
  std::size_t tail = 0;
  while (tail + head < a.size() && tail + head < b.size() &&
         a[a.size() - 1 - tail] == b[b.size() - 1 - tail])
    ++tail;
  std::string text;
  std::size_t shown = 0, left = 0;
  const auto show = [&](char sign, std::size_t number, const std::string& line) {
    if (shown++ < max_lines)
      text += "    " + std::string(1, sign) + std::to_string(number) + ": " + line + "\n";
    else
      ++left;
  };
  for (std::size_t i = head; i + tail < std::max(a.size(), b.size()); ++i) {
    const bool in_a = i + tail < a.size(), in_b = i + tail < b.size();
    if (in_a && in_b && a[i] == b[i]) continue;
    if (in_a) show('-', i + 1, a[i]);
    if (in_b) show('+', i + 1, b[i]);
  }
  if (left > 0) text += "    ... and " + std::to_string(left) + " more lines differ\n";
  if (text.empty()) text = "    the texts differ in their line ends only\n";
  return text;
}

JobResult run_golden_command(const Options& options, const Progress& progress) {
  JobResult result;
  const auto& words = options.arguments;
  if (words.size() != 2 || (words[0] != "run" && words[0] != "update")) {
    result.diagnostics.push_back(usage_error("US104", "golden: run DIR or update DIR"));
    result.status = ExitStatus::usage;
    return result;
  }
  std::vector<fs::path> folders;
  std::error_code error;
  if (fs::exists(fs::path(words[1]) / "case.toml", error)) {
    folders.push_back(fs::path(words[1]));
  } else {
    for (const auto& entry : fs::directory_iterator(words[1], error))
      if (fs::exists(entry.path() / "case.toml", error)) folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  if (folders.empty()) {
    result.diagnostics.push_back(
        usage_error("US151", words[1] + ": no case.toml in it or in its folders"));
    result.status = ExitStatus::usage;
    return result;
  }
  std::size_t failed = 0;
  for (const auto& folder : folders) {
    auto c = read_case(folder);
    result.diagnostics.insert(result.diagnostics.end(), c.diagnostics().begin(),
                              c.diagnostics().end());
    if (!c.ok()) {
      ++failed;
      continue;
    }
    const Outcome now = run_case(c.value(), progress);
    if (now.cancelled) {
      result.diagnostics.push_back(usage_error(
          "US190",
          "cancelled at " + c.value().name + "; it and the cases behind it stay as they are"));
      result.status = status_of(result.diagnostics);
      return result;
    }
    if (words[0] == "update") {
      const auto errors = update(c.value(), now);
      result.diagnostics.insert(result.diagnostics.end(), errors.begin(), errors.end());
      result.text += "stored " + c.value().name + "\n";
      continue;
    }
    const std::string difference = compare(c.value(), now);
    result.text +=
        (difference.empty() ? "ok     " : "FAILED ") + c.value().name + "\n" + difference;
    if (!difference.empty()) ++failed;
  }
  result.text += std::to_string(folders.size() - failed) + " of " + std::to_string(folders.size()) +
                 (words[0] == "run" ? " cases agree\n" : " cases stored\n");
  result.status = status_of(result.diagnostics);
  if (failed > 0 && result.status == ExitStatus::certified) result.status = ExitStatus::refused;
  return result;
}

}  // namespace smoothpost
