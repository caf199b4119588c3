#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "tests/formats/nc/recording.h"
#include "tests/formats/nc/rs274_oracle.h"
#include "tests/support/support.h"

// LinuxCNC's own interpreter tests (corpus/7_linuxcnc_interp), judged by what they expect.
namespace smoothpost::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolder = "corpus/7_linuxcnc_interp";

/// A row of COMMANDS.tsv.
struct Case {
  std::string name;
  std::string kind;  ///< "A pure: ...", "B file suites ...", ...
  std::string arguments;
  std::string judged_by;
};

std::vector<Case> cases() {
  std::vector<Case> out;
  const auto root = shared_path(kFolder);
  if (!root) return out;
  std::ifstream in(*root / "COMMANDS.tsv");
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream row(line);
    Case c;
    std::getline(row, c.name, '\t');
    std::getline(row, c.kind, '\t');
    std::getline(row, c.arguments, '\t');
    std::getline(row, c.judged_by, '\t');
    out.push_back(c);
  }
  return out;
}

bool missing() {
  if (shared_path(kFolder)) return false;
  WARN("no corpus beside the checkout: skipped");
  return true;
}

/// Why a case is refused here on purpose, and the code that says so.
struct Refusal {
  const char* code;
  const char* why;
};

const std::map<std::string, Refusal>& refusals() {
  static const std::map<std::string, Refusal> kRefusals = {
      {"interp/g84/g18/g98",
       {"NC261", "the expected feeds go along X, though G18 taps along Y: a fault of LinuxCNC"}},
      {"interp/g84/g19/g98",
       {"NC261", "the expected feeds go along Y, though G19 taps along X: a fault of LinuxCNC"}}};
  return kRefusals;
}

/// The program that the arguments name; a test folder has one of that name.
std::string program_of(const Case& c) {
  std::istringstream words(c.arguments);
  for (std::string word; words >> word;) {
    if (word.ends_with(".ngc")) return word;
  }
  return {};
}

/// A row of LinuxCNC's tool table: T1 P1 Z0.511 D0.1 Q2 ; comment. mm.
struct ToolRow {
  int tool = 0;
  double length = 0.0;
  double radius = 0.0;
  int orientation = 0;
};

/// The tools of the table beside the program.
std::vector<ToolRow> tools_beside(const fs::path& folder) {
  std::vector<ToolRow> tools;
  if (!fs::exists(folder / "test.tbl")) return tools;
  std::istringstream text(read_bytes(folder / "test.tbl"));
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line.substr(0, line.find(';')));
    ToolRow row;
    for (std::string word; words >> word;) {
      const double value = std::stod(word.substr(1));
      if (word[0] == 'T') row.tool = static_cast<int>(value);
      if (word[0] == 'Z') row.length = value * kMillimetresPerInch;
      if (word[0] == 'D') row.radius = 0.5 * value * kMillimetresPerInch;
      if (word[0] == 'Q') row.orientation = static_cast<int>(value);
    }
    if (row.tool > 0) tools.push_back(row);
  }
  return tools;
}

/// Blocks that give the radii and orientations of those tools, in millimetres.
std::string tool_blocks(const fs::path& folder) {
  std::string text;
  for (const ToolRow& row : tools_beside(folder)) {
    text += "G10 L1 P" + std::to_string(row.tool) + " R" + std::to_string(row.radius) + " Q" +
            std::to_string(row.orientation) + "\n";
  }
  return text;
}

/// rs274 alone is an inch machine whose programs begin in millimetres.
nc::InterpreterSettings settings_of(const fs::path& folder) {
  nc::InterpreterSettings settings = oracle_settings();
  settings.inch_default = true;
  for (const ToolRow& row : tools_beside(folder)) settings.tool_lengths[row.tool] = row.length;
  settings.subroutine_folders = {folder.string(), (folder / "subs").string()};
  return settings;
}

Run run_case(const fs::path& program) {
  std::string text = read_bytes(program);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  const bool percent = first != std::string::npos && text[first] == '%';
  const std::size_t at = percent ? text.find('\n', first) + 1 : 0;
  text.insert(at, "G21\n" + tool_blocks(program.parent_path()));
  return run(text, settings_of(program.parent_path()));
}

/// The words of a message with one blank between; `behind_first`: without the first one.
std::string words_of(const std::string& text, bool behind_first) {
  std::istringstream in(text);
  std::string word, out;
  if (behind_first) in >> word;
  while (in >> word) out += " " + word;
  return out;
}

std::string without_negative_zero(std::string text) {
  for (std::size_t at = text.find("-0.000000"); at != std::string::npos;
       at = text.find("-0.000000", at)) {
    text.erase(at, 1);
  }
  return text;
}

/// What DEBUG and PRINT comments showed. Where the first field of each line was deleted, a printed
/// text has lost its first word.
std::vector<std::string> messages(const Run& r, bool deleted) {
  std::vector<std::string> out;
  for (const std::string& text : r.sink.comments) {
    const bool print = text.starts_with("PRINT,");
    if (!print && !text.starts_with("DEBUG,")) continue;
    out.push_back(without_negative_zero(words_of(text.substr(6), print && deleted)));
  }
  return out;
}

/// Refused with a line of the program.
bool refused_with_place(const Run& r) {
  if (r.ok) return false;
  for (const Diagnostic& d : r.diagnostics) {
    if (d.severity == Severity::error && d.where.line > 0 && !d.where.file.empty()) return true;
  }
  return false;
}

/// What differs from the expected text; empty: nothing.
std::string difference(const Run& ours, const fs::path& expected, bool messages_only = false) {
  const std::string bytes = read_bytes(expected);
  std::istringstream text(bytes);
  OracleRun oracle;
  read_canonical(text, oracle);
  if (!ours.ok) return "refused: " + ours.errors().front() + "\n" + ours.all_text();
  if (!messages_only) {
    const Comparison result = compare(ours.sink.motions, oracle);
    if (!result.problem.empty()) return result.problem;
  }
  std::vector<std::string> theirs = oracle.messages;
  for (std::string& message : theirs) message = without_negative_zero(words_of(message, false));
  const std::vector<std::string> mine = messages(ours, bytes.starts_with(" N"));
  if (mine == theirs) return {};
  std::string out = "messages differ:";
  for (std::size_t i = 0; i < std::max(mine.size(), theirs.size()); ++i) {
    const std::string a = i < mine.size() ? mine[i] : "(none)";
    const std::string b = i < theirs.size() ? theirs[i] : "(none)";
    if (a != b) out += "\n    \"" + a + "\" for \"" + b + "\"";
  }
  return out;
}

bool must_fail(const fs::path& expected) { return read_bytes(expected).starts_with("executing"); }

}  // namespace

TEST_CASE("conformance: LinuxCNC's pure interpreter tests give the expected motions",
          "[formats][nc][conformance]") {
  if (missing()) return;
  const fs::path root = *shared_path(kFolder);
  std::size_t same = 0, failing = 0, refused = 0, all = 0;
  std::string reasons;
  for (const Case& c : cases()) {
    const bool good = c.kind.ends_with(" good");
    if (!c.kind.starts_with("A pure") && !good) continue;
    const fs::path folder = good ? (root / c.name).parent_path() : root / c.name;
    if (program_of(c).empty()) continue;  // judged below
    ++all;
    const fs::path program = folder / program_of(c);
    const fs::path expected = good ? fs::path(program.string() + ".expected") : folder / "expected";
    INFO(c.name);
    REQUIRE(fs::exists(expected));
    const Run ours = run_case(program);
    const auto refusal = refusals().find(c.name);
    if (refusal != refusals().end()) {
      INFO(ours.all_text());
      CHECK(ours.has(refusal->second.code));
      CHECK(refused_with_place(ours));
      reasons += "\n  " + c.name + ": " + refusal->second.why;
      ++refused;
    } else if (must_fail(expected)) {
      INFO(ours.all_text());
      CHECK(refused_with_place(ours));
      ++failing;
    } else {
      const std::string problem =
          difference(ours, expected, c.judged_by.find("MESSAGE lines only") != std::string::npos);
      INFO(problem);
      CHECK(problem.empty());
      same += problem.empty() ? 1 : 0;
    }
  }
  WARN("of " << all << " pure cases " << same << " give the expected motions and messages, "
             << failing << " fail as they must, " << refused
             << " are refused on purpose:" << reasons);
  CHECK(all >= 31);
  CHECK(same + failing + 2 >= all);
  CHECK(refused <= 2);
}

TEST_CASE("conformance: programs that LinuxCNC refuses are refused with their place",
          "[formats][nc][conformance]") {
  if (missing()) return;
  const fs::path root = *shared_path(kFolder);
  std::vector<fs::path> programs;
  for (const Case& c : cases()) {
    if (c.kind.ends_with(" bad")) programs.push_back(root / c.name);
  }
  for (const auto& entry :
       fs::directory_iterator(root / "interp/m98m99/06-error-mixed-sub-styles")) {
    if (entry.path().extension() == ".ngc") programs.push_back(entry.path());
  }
  for (const char* name :
       {"interp/abort-hot-comment/test.ngc", "interp/iniparam-failassign/test.ngc",
        "interp/nested-sub-error/test.ngc",
        "interp/g71-endless-loop2/"
        "g71-endless-loop2.ngc",
        "interp/g72-facing/g72-iterations-present.ngc",
        "interp/m98m99/03-error-M98-no-P-word/test.ngc"}) {
    programs.push_back(root / name);
  }
  for (const fs::path& program : programs) {
    const Run ours = run_case(program);
    INFO(program.string() << "\n" << ours.all_text());
    CHECK(refused_with_place(ours));
  }
  WARN("refused with their place: " << programs.size() << " programs");
  CHECK(programs.size() >= 15);
}

TEST_CASE("conformance: tests with files of subroutines", "[formats][nc][conformance]") {
  if (missing()) return;
  const fs::path root = *shared_path(kFolder);
  for (const char* name : {"interp/sub-call-from-sub", "interp/sequence-number"}) {
    std::string text = read_bytes(root / name / "test.ngc");
    const Run ours = run(text, settings_of(root / name));
    const std::string problem = difference(ours, root / name / "expected");
    INFO(name << "\n" << problem);
    CHECK(problem.empty());
  }
}

}  // namespace smoothpost::test
