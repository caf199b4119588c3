#include "postproc/jobs/import_command.h"

#include <algorithm>
#include <filesystem>

#include "machines/definition/machine_file.h"
#include "machines/import/imported_machine.h"
#include "postproc/jobs/files.h"
#include "postproc/jobs/settings.h"
#include "postproc/pipeline/registry.h"

namespace smoothpost {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLargest = std::size_t{16} << 20;

enum class Kind { unknown, urdf, ini, fcm };

std::string extension_of(const std::string& file) {
  std::string out = fs::path(file).extension().string();
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  return out;
}

bool is_yaml(const std::string& file) {
  const std::string extension = extension_of(file);
  return extension == ".yaml" || extension == ".yml";
}

Kind kind_of(const std::string& file, std::string_view text) {
  const std::string extension = extension_of(file);
  if (extension == ".urdf" || extension == ".xacro" || extension == ".xml") return Kind::urdf;
  if (extension == ".ini") return Kind::ini;
  if (extension == ".fcm") return Kind::fcm;
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return Kind::unknown;
  if (text[first] == '<') return Kind::urdf;
  if (text[first] == '{') return Kind::fcm;
  return text[first] == '[' ? Kind::ini : Kind::unknown;
}

/// Files that an INI names: only those in its folder and below are read.
std::optional<std::string> read_beside(const fs::path& folder, const std::string& name) {
  std::error_code error;
  if (fs::path(name).is_absolute()) return std::nullopt;
  const fs::path root = fs::weakly_canonical(folder, error);
  if (error) return std::nullopt;
  const fs::path file = fs::weakly_canonical(root / name, error);
  if (error || !fs::is_regular_file(file, error)) return std::nullopt;
  const fs::path inside = file.lexically_relative(root);
  if (inside.empty() || *inside.begin() == "..") return std::nullopt;
  auto bytes = read_file(file.string(), kLargest);
  if (!bytes.ok()) return std::nullopt;
  return std::move(bytes.value());
}

class Import {
 public:
  explicit Import(const Options& options) : options_(options) {}

  JobResult run() {
    if (read_words() && read_files()) make();
    result_.status = status_of(result_.diagnostics);
    if (unreadable_) result_.status = ExitStatus::unreadable;
    return std::move(result_);
  }

 private:
  void add(const Diagnostics& list) {
    result_.diagnostics.insert(result_.diagnostics.end(), list.begin(), list.end());
  }
  bool usage(std::string text) {
    result_.diagnostics.push_back(usage_error("US170", std::move(text)));
    return false;
  }

  bool read_words() {
    for (std::size_t i = 1; i < options_.arguments.size(); ++i) {
      const std::string& word = options_.arguments[i];
      const auto equals = word.find('=');
      std::error_code error;
      if (equals != std::string::npos && equals > 0 && !fs::exists(word, error)) {
        const std::string key = word.substr(0, equals);
        static const std::vector<std::string> kKeys = {"A", "B", "C", "base", "tip", "order"};
        if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end())
          return usage("import: " + word +
                       ": the words are A=, B=, C= (table or head), order=, base= and tip=");
        if (!said_.emplace(key, word.substr(equals + 1)).second)
          return usage("import: " + key + "= stands twice");
      } else if (file_.empty() && !is_yaml(word)) {
        file_ = word;
      } else if (limits_file_.empty() && is_yaml(word)) {
        limits_file_ = word;
      } else {
        return usage("import: one more file, " + word);
      }
    }
    if (file_.empty()) return usage("import: name a URDF, a LinuxCNC .ini or a FreeCAD .fcm");
    return true;
  }

  bool read_files() {
    for (const auto& [name, into] :
         {std::pair{&file_, &text_}, std::pair{&limits_file_, &limits_}}) {
      if (name->empty()) continue;
      auto bytes = read_file(*name, kLargest);
      add(bytes.diagnostics());
      unreadable_ = unreadable_ || !bytes.ok();
      if (bytes.ok()) *into = std::move(bytes.value());
    }
    return !unreadable_;
  }

  Result<ImportedMachine> imported(Kind kind) const {
    if (kind == Kind::ini) {
      const fs::path folder = fs::path(file_).parent_path();
      const ini::Source beside = [&](const std::string& name) {
        return read_beside(folder.empty() ? "." : folder, name);
      };
      return import_linuxcnc(text_, file_, beside, said_);
    }
    if (kind == Kind::fcm) return import_freecad(text_, file_, said_);
    UrdfTexts texts{text_, file_, std::nullopt, limits_file_};
    if (!limits_file_.empty()) texts.limits = limits_;
    return import_urdf(texts, said_);
  }

  void make() {
    const Kind kind = kind_of(file_, text_);
    if (kind == Kind::unknown) {
      usage("import: " + file_ + " is no URDF, no LinuxCNC INI and no FreeCAD .fcm");
      return;
    }
    if (!limits_file_.empty() && kind != Kind::urdf) {
      usage("import: " + limits_file_ + ": joint limits belong to a URDF");
      return;
    }
    auto made = imported(kind);
    add(made.diagnostics());
    if (!made.ok()) return;
    ImportedMachine& machine = made.value();
    machine.source = fs::path(file_).filename().string();
    if (!options_.dialect.empty()) machine.dialect = options_.dialect;
    if (!find_dialect(machine.dialect)) {
      result_.diagnostics.push_back(no_dialect(machine.dialect));
      return;
    }
    const std::string assumed = assumptions(machine);
    if (!assumed.empty())
      result_.diagnostics.push_back(
          {Severity::warning,
           "MF206",
           "not in the file and assumed, see the comments of the machine file: " + assumed,
           {file_, 0, 0}});
    deliver(machine_text(machine));
  }

  void deliver(const std::string& text) {
    const std::string name =
        options_.output.empty() || options_.output == "-" ? "machine.toml" : options_.output;
    const auto valid = parse_machine_file(text, name);
    add(valid.diagnostics());
    if (!valid.ok()) return;
    if (options_.output.empty()) {
      result_.text = text;
      return;
    }
    result_.program = text;
    if (options_.output == "-") return;
    std::error_code error;
    if (fs::equivalent(options_.output, file_, error)) {
      result_.diagnostics.push_back(usage_error(
          "US105", "-o " + options_.output + " is the input file: name another output"));
      return;
    }
    result_.program_path = options_.output;
    const Diagnostics faults = write_file(options_.output, text);
    add(faults);
    if (!has_error(faults))
      result_.summary = "machine " + valid.value().name + " with " +
                        std::to_string(valid.value().size()) + " axes";
  }

  const Options& options_;
  JobResult result_;
  ImportWords said_;
  std::string file_, limits_file_, text_, limits_;
  bool unreadable_ = false;
};

}  // namespace

JobResult run_import_command(const Options& options) { return Import(options).run(); }

}  // namespace smoothpost
