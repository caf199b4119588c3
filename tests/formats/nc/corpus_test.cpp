#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>

#include "tests/formats/nc/recording.h"
#include "tests/support/support.h"

// Real files that nobody of this project wrote: what is read of them, and that no damage to them
// ends in anything but a value or diagnostics.
namespace smoothpost::test {
namespace {

struct File {
  std::filesystem::path path;
  std::string text;
};

/// Every file of the corpus that holds NC text or calls itself so, in this and other dialects.
const std::vector<File>& nc_files() {
  static const std::vector<File> files = [] {
    std::vector<File> out;
    for (const char* folder : {"1_five_axis", "2_apt_cl", "3_three_axis", "4_robot", "5_stl",
                               "6_robot_model", "7_linuxcnc_interp"}) {
      for (auto& path :
           corpus_files(folder, {".ngc", ".nc", ".mpf", ".txt", ".eia", ".tap", ".gcode", ".cnc",
                                 ".h", ".spf", ".ls", ".src", ".apt"})) {
        out.push_back({path, read_bytes(path)});
      }
    }
    return out;
  }();
  return files;
}

/// Counts of the sink's calls, so that nothing is thrown away unseen.
struct CountingSink final : CanonicalSink {
  std::size_t calls = 0;
  bool finite = true;
  void motion(const CanonicalMotion& m) override {
    ++calls;
    for (const double v : m.end) finite = finite && std::isfinite(v);
    finite = finite && std::isfinite(m.duration) && m.duration >= 0.0 && std::isfinite(m.arc.sweep);
  }
  void dwell(double, std::uint32_t) override { ++calls; }
  void event(const ProcessEvent&) override { ++calls; }
  void comment(std::string_view, std::uint32_t) override { ++calls; }
  void tool_length(double, int, std::uint32_t) override { ++calls; }
  void work_offset(const Vec3&, double, int, std::uint32_t) override { ++calls; }
  void program_end(std::uint32_t) override { ++calls; }
};

const nc::InterpreterSettings& lenient() {
  static const nc::InterpreterSettings settings = [] {
    nc::InterpreterSettings s = mill_settings();
    s.process.unmapped = UnmappedWords::comment;
    s.run_budget = 50'000;  // endless mutants end soon
    return s;
  }();
  return settings;
}

struct Outcome {
  std::size_t value = 0;
  std::size_t refused = 0;
  std::size_t bytes = 0;
};

/// A value or diagnostics with an error; the text comes back; numbers are finite.
void require_outcome(std::string text, Outcome& outcome,
                     nc::InputDialect dialect = nc::InputDialect::linuxcnc) {
  const std::size_t size = text.size();
  const nc::ParsedProgram parsed = nc::parse(std::move(text), "t.nc", dialect);
  CountingSink sink;
  const auto result = nc::interpret(parsed.program, lenient(), sink);
  const bool sound =
      result.ok() ? !has_error(result.diagnostics()) : has_error(result.diagnostics());
  if (!sound || !sink.finite || nc::print(parsed.program) != parsed.program.text ||
      parsed.program.text.size() != size) {
    INFO(parsed.program.text.substr(0, 2000));
    REQUIRE(sound);
    REQUIRE(sink.finite);
    REQUIRE(nc::print(parsed.program) == parsed.program.text);
  }
  // What the parser refuses has no value either: nothing is skipped.
  if (has_error(parsed.diagnostics) && result.ok()) {
    INFO(to_string(parsed.diagnostics.front()));
    INFO(parsed.program.text.substr(0, 2000));
    REQUIRE_FALSE(result.ok());
  }
  ++(result.ok() ? outcome.value : outcome.refused);
  outcome.bytes += size;
}

void random_prefixes(const File& file, int count, std::mt19937& random, Outcome& outcome) {
  for (int i = 0; i < count; ++i) {
    require_outcome(file.text.substr(0, random() % (file.text.size() + 1)), outcome);
  }
}

void report(const char* what, const Outcome& outcome) {
  WARN(what << ": " << outcome.value + outcome.refused << " texts, " << outcome.bytes / 1000000
            << " MB; read: " << outcome.value << ", refused: " << outcome.refused);
}

bool corpus_missing() {
  if (!nc_files().empty()) return false;
  WARN("no corpus beside the checkout: skipped");
  return true;
}

constexpr std::size_t kSmall = 8192;
constexpr std::size_t kLarge = 40'000;

}  // namespace

TEST_CASE("corpus: print(parse(text)) == text for every file", "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  std::size_t bytes = 0;
  std::map<std::string, int> kinds;
  for (const File& file : nc_files()) {
    const nc::ParsedProgram parsed = nc::parse(file.text, file.path.filename().string());
    INFO(file.path.string());
    REQUIRE(nc::print(parsed.program) == file.text);
    std::uint32_t next = 0;
    bool tiled = true;
    for (const nc::Piece& piece : parsed.program.pieces) {
      tiled = tiled && piece.begin == next && piece.length > 0;
      next = piece.begin + piece.length;
    }
    REQUIRE(tiled);
    REQUIRE(next == file.text.size());
    bytes += file.text.size();
    ++kinds[file.path.extension().string()];
  }
  std::string list;
  for (const auto& [kind, count] : kinds) list += " " + kind + ":" + std::to_string(count);
  WARN("identity: " << nc_files().size() << " files, " << bytes << " bytes," << list);
  CHECK(nc_files().size() >= 200);
}

TEST_CASE("corpus: every prefix of every file up to 8 kB", "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  Outcome outcome;
  for (const File& file : nc_files()) {
    if (file.text.size() > kSmall) continue;
    for (std::size_t n = 0; n <= file.text.size(); ++n)
      require_outcome(file.text.substr(0, n), outcome);
  }
  report("every prefix up to 8 kB", outcome);
  CHECK(outcome.value + outcome.refused > 100'000);
}

TEST_CASE("corpus: 2,000 random prefixes of each file up to 40 kB", "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  std::mt19937 random(2);
  Outcome outcome;
  for (const File& file : nc_files()) {
    if (file.text.size() > kSmall && file.text.size() <= kLarge) {
      random_prefixes(file, 2'000, random, outcome);
    }
  }
  report("2,000 random prefixes of files from 8 to 40 kB", outcome);
}

TEST_CASE("corpus: 20 random prefixes of each larger file", "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  std::mt19937 random(3);
  Outcome outcome;
  for (const File& file : nc_files()) {
    if (file.text.size() > kLarge) random_prefixes(file, 20, random, outcome);
  }
  report("20 random prefixes of files above 40 kB", outcome);
}

TEST_CASE("corpus: 2,000 random prefixes of each file above 40 kB", "[formats][nc][corpus][slow]") {
  if (corpus_missing()) return;
  std::mt19937 random(4);
  Outcome outcome;
  for (const File& file : nc_files()) {
    if (file.text.size() > kLarge) random_prefixes(file, 2'000, random, outcome);
  }
  report("2,000 random prefixes of files above 40 kB", outcome);
}

TEST_CASE("corpus: 10,000 byte mutations, a quarter of them in each dialect",
          "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  std::mt19937 random(5);
  static const std::string kSigns = "GXYZABCIJKRPQFSTMNOEe0123456789.+-()[]#/%;=\"<> \t\n\r";
  std::vector<const File*> pool;
  for (const File& file : nc_files()) {
    if (file.text.size() > 0 && file.text.size() <= 100'000) pool.push_back(&file);
  }
  Outcome outcome;
  for (int i = 0; i < 10'000; ++i) {
    std::string text = pool[random() % pool.size()]->text;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int c = 0; c < changes && !text.empty(); ++c) {
      const std::size_t at = random() % text.size();
      const char byte =
          random() % 2 == 0 ? static_cast<char>(random() & 0xff) : kSigns[random() % kSigns.size()];
      switch (random() % 4) {
        case 0:
          text.erase(at, 1);
          break;
        case 1:
          text.insert(text.begin() + static_cast<std::ptrdiff_t>(at), byte);
          break;
        default:
          text[at] = byte;
          break;
      }
    }
    require_outcome(std::move(text), outcome, static_cast<nc::InputDialect>(i % 4));
  }
  report("byte mutations", outcome);
  CHECK(outcome.value + outcome.refused == 10'000);
  CHECK(outcome.value > 100);
}

TEST_CASE("corpus: lines of the language in random order", "[formats][nc][corpus]") {
  // Valid words in senseless company reach the rules that real programs keep.
  std::mt19937 random(6);
  static const char* kWords[] = {
      "G0",    "G1",    "G2",  "G3",       "G4",   "G10",   "G17",   "G18",   "G19",   "G20",
      "G21",   "G28",   "G30", "G28.1",    "G40",  "G43",   "G43.1", "G49",   "G52",   "G53",
      "G54",   "G59.3", "G61", "G64",      "G80",  "G90",   "G91",   "G90.1", "G91.1", "G92",
      "G92.1", "G92.3", "G93", "G94",      "G81",  "G43.4", "M0",    "M2",    "M3",    "M5",
      "M6",    "M8",    "M62", "M428",     "M429", "M104",  "X1",    "Y-2.5", "Z3",    "A10",
      "B-20",  "C30",   "U1",  "I1",       "J2",   "K3",    "R5",    "R-9",   "P1",    "P2",
      "L2",    "L20",   "Q3",  "H1",       "H9",   "F100",  "S500",  "T1",    "T2",    "E1",
      "D1",    "X[1]",  "(c)", "(MSG, m)", "/"};
  Outcome outcome;
  for (int i = 0; i < 20'000; ++i) {
    std::string text;
    for (int line = 0; line < 6; ++line) {
      const int n = 1 + static_cast<int>(random() % 5);
      for (int w = 0; w < n; ++w) text += std::string(kWords[random() % std::size(kWords)]) + " ";
      text += "\n";
    }
    require_outcome(std::move(text), outcome);
  }
  report("random lines of the language", outcome);
  CHECK(outcome.value > 100);
}

TEST_CASE("corpus: the boat programs are read without error", "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  const std::string folder =
      "corpus/1_five_axis/LinuxCNC/configs/sim/axis/vismach/5axis/table-rotary-tilting/demos/";
  for (const auto& [name, axes] : {std::pair<const char*, AxisMask>{"boat-xyzac.ngc", 0x2f},
                                   std::pair<const char*, AxisMask>{"boat-xyzbc.ngc", 0x37}}) {
    nc::InterpreterSettings settings = mill_settings();
    settings.axes = axes;
    const Run r = run(read_bytes(*shared_path(folder + name)), settings);
    INFO(name << "\n" << r.all_text());
    REQUIRE(r.ok);
    CHECK(r.diagnostics.empty());
    CHECK(r.summary.uses_tcp);
    CHECK(r.summary.uses_rotary);
    CHECK(r.summary.ended);
    CHECK(r.summary.tools == std::vector<int>{1});
    CHECK(r.sink.motions.size() > 1000);
    CHECK(r.sink.events.front().name == "tool_change");
    const auto feeds =
        std::count_if(r.sink.motions.begin(), r.sink.motions.end(), [](const CanonicalMotion& m) {
          return m.kind == MotionKind::feed && (m.unknown_start & 7) != 0;
        });
    CHECK(feeds == 0);
    WARN(name << ": " << r.sink.motions.size() << " motions");
  }
}

TEST_CASE("corpus: a printer's program needs the user's word for its E and M104",
          "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  const std::string text =
      read_bytes(*shared_path("corpus/1_five_axis/zhangty019/DataSet/Gcode") / "model_1_Gcode.txt");
  nc::InterpreterSettings settings = mill_settings();
  settings.axes = 0x37;
  const Run refused = run(text, settings);
  CHECK_FALSE(refused.ok);
  CHECK(refused.errors() == std::vector<std::string>{"PR101", "PR101", "PR101"});  // M104, M109, E
  CHECK(refused.diagnostics.front().where.line == 2);
  CHECK(refused.diagnostics.front().text.find("M104") != std::string::npos);
  settings.process.unmapped = UnmappedWords::comment;
  const Run read = run(text, settings);
  INFO(read.all_text());
  REQUIRE(read.ok);
  CHECK(read.sink.motions.size() > 34'000);
  CHECK(read.sink.comments.front() == "unmapped: M104 S205 T1");
  WARN("model_1_Gcode.txt: " << read.sink.motions.size() << " motions, "
                             << read.sink.comments.size() << " comments");
}

TEST_CASE("corpus: every file in every dialect ends in a value or diagnostics with a place",
          "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  constexpr nc::InputDialect kDialects[] = {nc::InputDialect::linuxcnc, nc::InputDialect::fanuc,
                                            nc::InputDialect::haas, nc::InputDialect::siemens};
  std::map<int, int> read;
  for (const File& file : nc_files()) {
    if (file.text.size() > 1'000'000) continue;
    for (const nc::InputDialect dialect : kDialects) {
      INFO(file.path.string());
      const nc::ParsedProgram parsed = nc::parse(file.text, "t.nc", dialect);
      REQUIRE(nc::print(parsed.program) == file.text);
      CountingSink sink;
      const auto result = nc::interpret(parsed.program, lenient(), sink);
      REQUIRE(result.ok() != has_error(result.diagnostics()));
      REQUIRE(sink.finite);
      read[static_cast<int>(dialect)] += result.ok() && !has_error(parsed.diagnostics) ? 1 : 0;
      for (const Diagnostic& d : result.diagnostics()) {
        if (d.severity == Severity::error && d.code != "NC100") REQUIRE(d.where.column > 0);
      }
    }
  }
  WARN("read as linuxcnc " << read[0] << ", fanuc " << read[1] << ", haas " << read[2]
                           << ", siemens " << read[3] << " of " << nc_files().size());
}

TEST_CASE("corpus: what becomes of every file", "[formats][nc][corpus]") {
  if (corpus_missing()) return;
  std::map<std::string, int> first_error;
  int read = 0;
  for (const File& file : nc_files()) {
    const Run r = run(file.text, lenient());
    if (r.ok) {
      ++read;
    } else {
      ++first_error[r.errors().front()];
    }
  }
  std::string list;
  for (const auto& [code, count] : first_error) list += " " + code + ":" + std::to_string(count);
  WARN("read: " << read << " of " << nc_files().size() << "; first error of the others:" << list);
  CHECK(read >= 50);
}

}  // namespace smoothpost::test
