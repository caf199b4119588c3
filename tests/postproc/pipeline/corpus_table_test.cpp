#include <algorithm>
#include <catch2/catch.hpp>
#include <cctype>
#include <filesystem>
#include <map>

#include "postproc/pipeline/registry.h"
#include "tests/support/machines.h"
#include "tests/support/support.h"

// What becomes of every program of the corpus, as the command line would read it.
namespace smoothpost::test {
namespace {

struct Outcome {
  std::string format;
  Diagnostics diagnostics;
  bool ok = false;
};

std::string extension_of(const std::filesystem::path& path) {
  std::string text = path.extension().string();
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// What a user says of files that leave it open.
InputSettings with_options(const std::filesystem::path& path, const char* machine) {
  InputSettings settings;
  settings.file_name = path.filename().string();
  settings.machine = shipped_machine(machine);
  settings.machine->process.unmapped = UnmappedWords::comment;
  settings.cl.unit = 1.0;
  settings.cl.feed = 10.0;
  for (int tool = 1; tool < 1000; ++tool) settings.tool_lengths[tool] = 60.0;
  settings.subroutine_folders = {path.parent_path().string()};
  return settings;
}

Outcome read_file(const std::filesystem::path& path) {
  Outcome out;
  const std::string extension = extension_of(path);
  const std::string text = read_bytes(path);
  const char* robot = extension == ".src"   ? "krl"
                      : extension == ".mod" ? "rapid"
                      : extension == ".ls"  ? "fanuc_ls"
                                            : nullptr;
  if (robot != nullptr) {
    out.format = robot;
    const auto read =
        find_dialect(robot)->read_back(shipped_machine("robot_6r"), text, path.filename().string());
    out.ok = read.ok();
    out.diagnostics = read.diagnostics();
    return out;
  }
  const InputFormat* format =
      extension == ".txt" ? find_input_format("nc") : format_by_extension(path.filename().string());
  REQUIRE(format != nullptr);
  out.format = format->name;
  auto read = format->read(text, with_options(path, "table_table_bc"));
  const bool other_machine =
      std::any_of(read.diagnostics().begin(), read.diagnostics().end(),
                  [](const Diagnostic& d) { return d.code == "NC212"; });  // an axis that it lacks
  if (other_machine) read = format->read(text, with_options(path, "table_table_ac"));
  out.ok = read.ok();
  out.diagnostics = read.diagnostics();
  if (read.ok() && !read.value().dialect.empty()) out.format += " " + read.value().dialect;
  return out;
}

/// Code and the first words of a message, without the numbers and names of the file.
std::string reason_of(const Diagnostic& d) {
  std::string words;
  int count = 0;
  for (const char c : d.text) {
    if (c == ' ' && ++count == 8) break;
    words += c >= '0' && c <= '9' ? '#' : c;
  }
  return d.code + " " + words;
}

}  // namespace

TEST_CASE("corpus: every program is read or refused by what stands in it",
          "[postproc][pipeline][corpus]") {
  std::vector<std::filesystem::path> files;
  for (const char* folder :
       {"1_five_axis", "2_apt_cl", "3_three_axis", "4_robot", "7_linuxcnc_interp"})
    for (const auto& path :
         corpus_files(folder, {".ngc",   ".nc",  ".mpf", ".spf", ".eia", ".EIA", ".tap",
                               ".gcode", ".cnc", ".h",   ".apt", ".as",  ".cl",  ".cls",
                               ".csv",   ".src", ".SRC", ".mod", ".ls",  ".LS"}))
      files.push_back(path);
  for (const auto& path : corpus_files("1_five_axis", {".txt"})) files.push_back(path);
  if (files.empty()) {
    WARN("no corpus beside the checkout: skipped");
    return;
  }
  std::map<std::string, int> read;
  std::map<std::string, int> refused;
  std::map<std::string, int> reasons;
  std::string five_axis;  // of the folder 1_five_axis, file by file
  const std::string told = read_bytes(SMOOTHPOST_SOURCE_DIR "/docs/diagnostics.md");
  int five_axis_read = 0;
  for (const auto& path : files) {
    INFO(path.string());
    const Outcome outcome = read_file(path);
    const bool is_five_axis = path.string().find("/1_five_axis/") != std::string::npos;
    if (is_five_axis && outcome.ok) ++five_axis_read;
    if (outcome.ok) {
      ++read[outcome.format];
      continue;
    }
    const auto error =
        std::find_if(outcome.diagnostics.begin(), outcome.diagnostics.end(),
                     [](const Diagnostic& d) { return d.severity == Severity::error; });
    REQUIRE(error != outcome.diagnostics.end());
    CHECK_FALSE(error->text.empty());
    ++refused[outcome.format.substr(0, outcome.format.find(' '))];
    ++reasons[outcome.format + ": " + reason_of(*error)];
    if (!is_five_axis) continue;
    five_axis += "\n  " + path.filename().string() + ":" + std::to_string(error->where.line) + " " +
                 error->code + " " + error->text.substr(0, 80);
    // Of a file of subroutines the whole is meant: no motion.
    CHECK((error->where.line > 0 || error->code == "NC311"));
    CHECK(told.find("| " + error->code + " |") != std::string::npos);
  }
  std::string table = std::to_string(files.size()) + " files. Read:";
  for (const auto& [format, count] : read) table += "\n  " + std::to_string(count) + "  " + format;
  table += "\nRefused, by the first reason:";
  for (const auto& [reason, count] : reasons)
    table += "\n  " + std::to_string(count) + "  " + reason;
  table += "\n1_five_axis: " + std::to_string(five_axis_read) + " read, refused are" + five_axis;
  WARN(table);
  CHECK(five_axis_read >= 5);
  const auto sinumerik = std::count_if(files.begin(), files.end(), [](const auto& path) {
    return extension_of(path) == ".mpf" || extension_of(path) == ".spf";
  });
  CHECK(sinumerik >= 2);
  CHECK(read["nc siemens"] == sinumerik);
  CHECK(read.size() >= 4);
  CHECK(reasons.size() > 5);
}

}  // namespace smoothpost::test
