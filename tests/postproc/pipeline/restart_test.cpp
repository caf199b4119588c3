#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "kernels/core/process.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/registry.h"
#include "tests/postproc/pipeline/paths.h"

// A program that is started again at the label of a cut does what the whole program does there.
using namespace smoothpost;
using namespace smoothpost::test;

namespace {

namespace fs = std::filesystem;

struct Case {
  const char* input;
  const char* from;
  const char* to;
  Pose placement;
};

std::vector<Case> cases() {
  return {{"examples/bent_sheet/bent_sheet.ngc", "laser_5p1", "laser_5p1", shifted(700, 600, 1000)},
          {"examples/mill_ac/mill_ac.ngc", "table_table_ac", "table_table_bc", Pose::Identity()}};
}

Conversion converted(const Case& c, MachineDefinition& machine) {
  machine = shipped_machine(c.to);
  ConvertInput in;
  in.input = read_program(read_bytes(source_path(c.input)), c.from);
  in.machine = machine;
  in.input_name = "part.ngc";
  in.placement = c.placement;
  return convert(in, false, {});
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Line numbers (from 1) of the cut labels.
std::vector<std::uint32_t> labels_of(const std::vector<std::string>& lines) {
  std::vector<std::uint32_t> labels;
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (lines[i].rfind("(CUT ", 0) == 0) labels.push_back(static_cast<std::uint32_t>(i + 1));
  return labels;
}

std::string from_label(const std::vector<std::string>& lines, std::uint32_t first_label,
                       std::uint32_t label) {
  std::string text;
  for (std::uint32_t i = 1; i <= lines.size(); ++i)
    if (i < first_label || i >= label) text += lines[i - 1] + "\n";
  return text;
}

/// Moves of the approach behind a label: those before the first one of the path.
std::size_t approach_moves(const Conversion& c, std::size_t first) {
  std::size_t n = 0;
  while (first + n < c.line_map.size() && c.line_map[first + n].role == MoveRole::link) ++n;
  return n;
}

std::size_t first_move_behind(const ReadBack& read, std::uint32_t line) {
  std::size_t i = 0;
  while (i < read.moves.size() && read.moves[i].line <= line) ++i;
  return i;
}

/// The last event of each kind of state before a move; the tool is not one that a label states
/// anew.
std::map<std::string, std::string> states(const ReadBack& read, std::size_t before) {
  std::map<std::string, std::string> out;
  for (const auto& e : read.events) {
    const std::string group = state_group(e.name);
    if (e.before > before || group.empty() || group == "tool") continue;
    if (ends_state(e.name))
      out.erase(group);
    else
      out[group] = e.name;
  }
  return out;
}

}  // namespace

TEST_CASE("restart: from every label the moves are those of the whole program",
          "[postproc][pipeline][restart]") {
  for (const Case& which : cases()) {
    MachineDefinition machine;
    const Conversion c = converted(which, machine);
    REQUIRE(c.verdict == Verdict::certified);
    const auto lines = lines_of(c.program);
    const auto labels = labels_of(lines);
    REQUIRE(labels.size() == c.cuts.size());
    REQUIRE(labels.size() >= 3);
    for (const std::uint32_t label : labels) {
      INFO(which.input << ": " << lines[label - 1]);
      auto result = find_dialect("linuxcnc")
                        ->read_back(machine, from_label(lines, labels.front(), label), "restart");
      for (const auto& d : result.diagnostics()) UNSCOPED_INFO(to_string(d));
      REQUIRE(result.ok());
      const ReadBack& again = result.value();
      CHECK(again.offset_guard);
      CHECK(again.exact_path);
      const std::size_t begin = first_move_behind(c.read, label);
      REQUIRE(again.moves.size() == c.read.moves.size() - begin);
      const std::size_t approach = approach_moves(c, begin);
      REQUIRE(approach >= 2);
      for (std::size_t i = approach - 1; i < again.moves.size(); ++i) {
        const ReadBackMove& a = again.moves[i];
        const ReadBackMove& b = c.read.moves[begin + i];
        REQUIRE(a.to == b.to);
        REQUIRE(a.known == (1U << machine.size()) - 1U);
        REQUIRE(a.rapid == b.rapid);
        REQUIRE(a.beam == b.beam);
        REQUIRE(a.duration == b.duration);
      }
      CHECK(states(again, approach) == states(c.read, begin + approach));
      // Behind the label: the events of the whole program, in their order.
      std::vector<std::string> ours, theirs;
      for (const auto& e : again.events)
        if (e.before >= approach) ours.push_back(e.name + std::to_string(e.before));
      for (const auto& e : c.read.events)
        if (e.before >= begin + approach)
          theirs.push_back(e.name + std::to_string(e.before - begin));
      CHECK(ours == theirs);
    }
  }
}

namespace {

/// The calls that rs274 prints, without its counters; nothing when it refuses the program.
std::optional<std::vector<std::string>> canonical_lines(const std::string& text,
                                                        const fs::path& folder) {
  std::ofstream(folder / "p.ngc", std::ios::binary) << text;
  std::ofstream(folder / "v.var", std::ios::binary);
  std::ofstream(folder / "tool.tbl") << "T1 P1 Z0 D0.1\nT2 P2 Z0 D0.1\n";
  // rs274 maps its tool table from a file in HOME: two runs at once must not share it.
  const std::string command =
      "cd '" + folder.string() +
      "' && HOME=\"$PWD\" rs274 -g -t tool.tbl -v v.var p.ngc >out.txt 2>err.txt </dev/null";
  if (std::system(command.c_str()) != 0) return {};
  std::vector<std::string> calls;
  std::ifstream out(folder / "out.txt");
  for (std::string line; std::getline(out, line);) {
    const auto open = line.find('(');
    if (open == std::string::npos) continue;
    const auto begin = line.find_last_of(" \t.", open - 1);
    calls.push_back(line.substr(begin == std::string::npos ? 0 : begin + 1));
  }
  return calls;
}

/// The calls from the `count`-th last motion on.
std::vector<std::string> tail_of(const std::vector<std::string>& calls, std::size_t count) {
  std::size_t i = calls.size();
  while (i > 0 && count > 0)
    if (calls[--i].rfind("STRAIGHT_", 0) == 0) --count;
  return {calls.begin() + static_cast<std::ptrdiff_t>(i), calls.end()};
}

}  // namespace

TEST_CASE("restart: LinuxCNC's interpreter sees the same from every label",
          "[postproc][pipeline][restart]") {
  if (std::system("command -v rs274 >/dev/null 2>&1") != 0) {
    WARN("skipped: rs274 is not installed");
    return;
  }
  const fs::path folder = fs::temp_directory_path() / "smoothpost_restart_test";
  fs::create_directories(folder);
  MachineDefinition machine;
  const Case which = cases()[1];
  const Conversion c = converted(which, machine);
  REQUIRE(c.verdict == Verdict::certified);
  const auto lines = lines_of(c.program);
  const auto labels = labels_of(lines);
  const auto whole = canonical_lines(c.program, folder);
  REQUIRE(whole);
  for (const std::uint32_t label : labels) {
    INFO(lines[label - 1]);
    const auto again = canonical_lines(from_label(lines, labels.front(), label), folder);
    REQUIRE(again);
    const std::size_t begin = first_move_behind(c.read, label);
    const std::size_t count = c.read.moves.size() - begin - approach_moves(c, begin) + 1;
    const auto ours = tail_of(*again, count);
    CHECK(ours.size() > count);
    CHECK(ours == tail_of(*whole, count));
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
}
