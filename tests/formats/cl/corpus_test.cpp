#include <catch2/catch.hpp>
#include <filesystem>
#include <map>
#include <random>
#include <sstream>

#include "tests/formats/cl/recording.h"
#include "tests/support/quiet_sink.h"
#include "tests/support/support.h"

// Real files that nobody of this project wrote, and the samples of the notes on dialects.
namespace smoothpost::test {
namespace {

struct File {
  std::filesystem::path path;
  std::string text;
};

const std::vector<File>& cl_files() {
  static const std::vector<File> files = [] {
    std::vector<File> out;
    for (const auto& path :
         corpus_files("2_apt_cl", {".apt", ".cl", ".cls", ".aptsource", ".as", ".ncl", ".clf"}))
      out.push_back({path, read_bytes(path)});
    for (const char* sample : {"cam6.cls", "catia.aptsource", "creo.ncl"}) {
      const auto path = shared_path(std::string("dialects/samples/") + sample);
      if (path) out.push_back({*path, read_bytes(*path)});
    }
    return out;
  }();
  return files;
}

bool corpus_missing() {
  if (!cl_files().empty()) return false;
  WARN("no corpus beside the checkout: skipped");
  return true;
}

/// What a user says on the command line for files that leave it open.
cl::ReaderSettings with_options() {
  cl::ReaderSettings settings;
  settings.unit = kMillimetresPerInch;
  settings.feed = 10.0;
  settings.process.unmapped = UnmappedWords::comment;
  return settings;
}

std::string name_of(const File& file) { return file.path.filename().string(); }

const File& file_named(const std::string& name) {
  for (const File& file : cl_files())
    if (name_of(file) == name) return file;
  throw std::runtime_error("not in the corpus: " + name);
}

/// The first word of a refused statement, from the message's backticks.
std::string construct_of(const Diagnostic& d) {
  const std::size_t tick = d.text.find('`');
  if (d.code != "PR101" || tick == std::string::npos) return d.code;
  return d.code + " " + d.text.substr(tick + 1, d.text.find_first_of("/,`", tick + 1) - tick - 1);
}

/// GOTO lines of a text by the letters of the line alone, and those of them behind CYCLE and a
/// type.
struct GotoLines {
  std::size_t all = 0;
  std::size_t holes = 0;
};

GotoLines count_goto(const std::string& text) {
  GotoLines count;
  std::istringstream in(text);
  std::string line;
  bool cycle = false;
  while (std::getline(in, line)) {
    if (line.rfind("CYCLE/", 0) == 0)
      cycle = line.rfind("CYCLE/OFF", 0) != 0 && line.rfind("CYCLE/INIT", 0) != 0;
    if (line.rfind("GOTO", 0) != 0) continue;
    ++count.all;
    if (cycle) ++count.holes;
  }
  return count;
}

}  // namespace

TEST_CASE("corpus: what becomes of every CL file", "[formats][cl][corpus]") {
  if (corpus_missing()) return;
  for (const bool options : {false, true}) {
    std::map<std::string, int> reasons;
    int read = 0;
    for (const File& file : cl_files()) {
      const ClRun r = read_cl(file.text, options ? with_options() : cl::ReaderSettings{});
      INFO(file.path.string() << "\n" << r.all_text());
      if (r.ok) {
        ++read;
        CHECK_FALSE(has_error(r.diagnostics));
        continue;
      }
      const auto error =
          std::find_if(r.diagnostics.begin(), r.diagnostics.end(),
                       [](const Diagnostic& d) { return d.severity == Severity::error; });
      REQUIRE(error != r.diagnostics.end());
      CHECK(error->where.line > 0);
      CHECK(error->where.column > 0);
      ++reasons[construct_of(*error)];
    }
    std::string table;
    for (const auto& [reason, count] : reasons)
      table += "\n  " + std::to_string(count) + "  " + reason;
    WARN((options ? "with --input-unit, --input-feed and process.unmapped = \"comment\": "
                  : "without options: ")
         << read << " of " << cl_files().size()
         << " files read; first reason of the others:" << table);
    // Two stay refused when the user says what is open: the binary file, and RotateThin.apt, whose
    // cycle is never switched off and stands through a tool change and a rapid.
    if (options) {
      CHECK(read == static_cast<int>(cl_files().size()) - 2);
      CHECK(reasons["CL106"] == 1);
      CHECK(reasons["CL131"] == 1);
    }
  }
}

TEST_CASE("corpus: every GOTO is one motion and every hole its cycle", "[formats][cl][corpus]") {
  if (corpus_missing()) return;
  std::size_t motions = 0;
  std::size_t arcs = 0;
  for (const File& file : cl_files()) {
    if (file.path.extension() != ".apt" && file.path.extension() != ".as") continue;
    if (name_of(file) == "RotateThin.apt") continue;
    INFO(file.path.string());
    const ClRun r = read_cl(file.text, with_options());
    REQUIRE(r.ok);
    const GotoLines lines = count_goto(file.text);
    std::map<std::uint32_t, std::size_t> by_line;
    std::size_t arcs_here = 0;
    for (const CanonicalMotion& m : r.sink.motions) {
      ++by_line[m.line];
      arcs_here += m.is_arc ? 1 : 0;
    }
    CHECK(by_line.size() == lines.all);
    std::size_t several = 0;
    for (const auto& [line, count] : by_line) several += count > 1 ? 1 : 0;
    CHECK(several == lines.holes);
    std::size_t circles = 0;
    for (std::size_t at = file.text.find("CIRCLE/"); at != std::string::npos;
         at = file.text.find("CIRCLE/", at + 1))
      ++circles;
    CHECK(arcs_here == circles);
    motions += r.sink.motions.size();
    arcs += arcs_here;
  }
  WARN(motions << " motions, " << arcs << " of them arcs");
  CHECK(arcs > 2700);
}

TEST_CASE("corpus: pmill_test1_4.as has 3716 tool axes and 2244 below the horizon",
          "[formats][cl][corpus]") {
  if (corpus_missing()) return;
  const ClRun r = read_cl(file_named("pmill_test1_4.as").text, with_options());
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions.size() == 3716);
  std::size_t below = 0;
  double tilt = 0.0, turned = 0.0;
  // With --work-offset G54=x,y,z,-87.810872771,-10.508722643,0 they fit a cap about the vertical.
  const Mat3 turn = rotation_from_rpy(radians_from_degrees(-87.810872771),
                                      radians_from_degrees(-10.508722643), 0.0);
  for (const CanonicalMotion& m : r.sink.motions) {
    below += m.end_axis.z() < 0.0 ? 1 : 0;
    tilt = std::max(tilt, angle_between(m.end_axis, Vec3::UnitZ()));
    turned = std::max(turned, angle_between(turn * m.end_axis, Vec3::UnitZ()));
  }
  CHECK(below == 2244);
  CHECK(degrees_from_radians(tilt) == Approx(175.0).margin(1.0));
  CHECK(degrees_from_radians(turned) == Approx(87.848).margin(0.002));
  CHECK((end_of(r.sink.motions[0]) - 25.4 * Vec3(-3.4701, -4.5099, -2.0664)).norm() < 1e-9);
}

TEST_CASE("corpus: boss.apt is what an independent post made of it", "[formats][cl][corpus]") {
  if (corpus_missing()) return;
  // The post's first setup: lines L and C with modal X Y Z, three decimals, CC before each C.
  const auto path = shared_path("corpus/2_apt_cl/aamorim1913/tests/parts-tools/boss/11.h");
  REQUIRE(path);
  struct Move {
    Vec3 end = Vec3::Zero();
    bool arc = false;
    bool clockwise = false;
    Vec3 centre = Vec3::Zero();
  };
  std::vector<Move> moves;
  std::istringstream in(read_bytes(*path));
  std::string line;
  Move state;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string number;
    std::string kind;
    std::string word;
    words >> number >> kind;
    if ((kind != "L" && kind != "C" && kind != "CC") || line.find("M91") != std::string::npos)
      continue;
    bool moved = false;
    while (words >> word) {
      const std::size_t axis = std::string("XYZ").find(word[0]);
      if (word == "DR-" || word == "DR+") state.clockwise = word == "DR-";
      if (axis == std::string::npos || word.size() < 2) continue;
      (kind == "CC" ? state.centre : state.end)[static_cast<Eigen::Index>(axis)] =
          std::stod(word.substr(1));
      moved = true;
    }
    state.arc = kind == "C";
    // A full circle is a C that changes no coordinate.
    if (kind == "C" || (moved && kind == "L")) moves.push_back(state);
  }
  const ClRun r = read_cl(file_named("boss.apt").text, with_options());
  REQUIRE(r.ok);
  std::size_t i = 0;
  double worst = 0.0;
  double worst_centre = 0.0;
  std::size_t arcs = 0;
  Vec3 last = Vec3::Constant(1e9);
  for (const CanonicalMotion& m : r.sink.motions) {
    if (i == moves.size()) break;
    const Vec3 end = end_of(m);
    // The post leaves out motions that change nothing in its three decimals.
    if ((end - last).cwiseAbs().maxCoeff() < 0.001 && !m.is_arc) continue;
    last = end;
    const Move& move = moves[i++];
    INFO("line " << m.line << ", move " << i);
    REQUIRE(move.arc == m.is_arc);
    worst = std::max(worst, (end - move.end).cwiseAbs().maxCoeff());
    if (!m.is_arc) continue;
    ++arcs;
    CHECK((m.arc.sweep * m.arc.normal.z() < 0.0) == move.clockwise);
    worst_centre = std::max(worst_centre, (m.arc.centre - move.centre).head<2>().norm());
  }
  WARN("boss.apt, first setup: " << i << " of " << moves.size() << " moves, " << arcs
                                 << " arcs; largest difference " << worst << " mm, of centres "
                                 << worst_centre << " mm");
  CHECK(i == moves.size());
  CHECK(i > 4000);
  CHECK(arcs > 500);
  CHECK(worst < 0.00051);
  CHECK(worst_centre < 0.00072);
}

TEST_CASE("corpus: the three samples of arcs describe the same path", "[formats][cl][corpus]") {
  if (corpus_missing()) return;
  // Each goes to (10, 0, 1) and round a quarter about (10, 10, 1) to (20, 10, 1).
  for (const char* name : {"cam6.cls", "catia.aptsource", "creo.ncl"}) {
    cl::ReaderSettings settings = with_options();
    if (std::string(name) == "cam6.cls") settings.unit = 1.0;
    if (std::string(name) == "creo.ncl") settings.unit = 25.4;  // the file says MM
    const ClRun r = read_cl(file_named(name).text, settings);
    INFO(name << "\n" << r.all_text());
    REQUIRE(r.ok);
    const CanonicalMotion& arc = r.sink.motions.back();
    REQUIRE(arc.is_arc);
    CHECK((start_of(arc) - Vec3(10, 0, 1)).norm() < 1e-9);
    CHECK((end_of(arc) - Vec3(20, 10, 1)).norm() < 1e-9);
    CHECK(arc.arc.sweep * arc.arc.normal.z() == Approx(0.5 * kPi).epsilon(1e-6));
    CHECK(arc.duration == Approx(10.0 * 0.5 * kPi / 100.0).epsilon(1e-6));
  }
}

namespace {

struct Outcome {
  std::size_t read = 0;
  std::size_t refused = 0;
};

struct FiniteSink final : QuietSink {
  bool good = true;
  void motion(const CanonicalMotion& m) override {
    for (const double v : m.end) good = good && std::isfinite(v);
    good = good && std::isfinite(m.duration) && m.duration >= 0.0 && std::isfinite(m.arc.sweep) &&
           m.arc.centre.allFinite() && std::abs(m.end_axis.norm() - 1.0) < 1e-9 &&
           std::abs(m.arc.normal.norm() - 1.0) < 1e-9;
  }
  void dwell(double seconds, std::uint32_t) override { good = good && seconds >= 0.0; }
};

void require_outcome(const std::string& text, Outcome& outcome) {
  static const cl::ReaderSettings kSettings = with_options();
  FiniteSink sink;
  const auto result = cl::read(text, "t.apt", kSettings, sink);
  bool placed = true;
  for (const Diagnostic& d : result.diagnostics())
    if (d.severity == Severity::error) placed = placed && d.where.line > 0;
  if (result.ok() == has_error(result.diagnostics()) || !sink.good || !placed) {
    INFO(text.substr(0, 3000));
    REQUIRE(result.ok() != has_error(result.diagnostics()));
    REQUIRE(sink.good);
    REQUIRE(placed);
  }
  ++(result.ok() ? outcome.read : outcome.refused);
}

}  // namespace

TEST_CASE("corpus: random prefixes of every file", "[formats][cl][corpus]") {
  if (corpus_missing()) return;
  std::mt19937 random(21);
  Outcome outcome;
  for (const File& file : cl_files()) {
    const std::size_t most = std::min<std::size_t>(file.text.size(), 20'000);
    for (int i = 0; i < 200; ++i)
      require_outcome(file.text.substr(0, random() % (most + 1)), outcome);
  }
  WARN("prefixes: " << outcome.read << " read, " << outcome.refused << " refused");
  CHECK(outcome.read > 100);
}

TEST_CASE("corpus: ten thousand byte mutations", "[formats][cl][corpus]") {
  if (corpus_missing()) return;
  std::mt19937 random(22);
  static const std::string kSigns = "GOTOCIRLEFDAU/0123456789.+-,$()* \t\n\r";
  Outcome outcome;
  for (int i = 0; i < 10'000; ++i) {
    const File& file = cl_files()[random() % cl_files().size()];
    const std::size_t most = std::min<std::size_t>(file.text.size(), 4'000);
    std::string text = file.text.substr(0, most);
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
      }
    }
    require_outcome(text, outcome);
  }
  WARN("mutations: " << outcome.read << " read, " << outcome.refused << " refused");
  CHECK(outcome.read > 1000);
  CHECK(outcome.refused > 1000);
}

TEST_CASE("corpus: statements of the language in random order", "[formats][cl]") {
  std::mt19937 random(23);
  static const char* const kLines[] = {"UNITS/MM",
                                       "UNITS/INCHES",
                                       "GOTO/1,2,3",
                                       "GOTO/5,0,0,0,0.6,0.8",
                                       "GOTO/0,5,0",
                                       "RAPID",
                                       "FROM/1,1,1",
                                       "GODLTA/0,0,-2",
                                       "GODLTA/3",
                                       "FEDRAT/100,MMPM",
                                       "FEDRAT/IPR,0.01",
                                       "SPINDL/500,RPM,CLW",
                                       "SPINDL/OFF",
                                       "CIRCLE/0,0,0,0,0,1",
                                       "CIRCLE/0,0,0,0,0,-1,5",
                                       "CIRCLE/0,0,0,0,0,1,5,0.1,0.5,8,0",
                                       "INDIRV/0,1,0",
                                       "TLON,GOFWD/(CIRCLE/0,0,0,5),ON,(LINE/0,0,0,0,5,0)",
                                       "5,0,0",
                                       "0,5,0",
                                       "CYCLE/DRILL,FEDTO,5,MMPM,100,RAPTO,2",
                                       "CYCLE/DEEP,FEDTO,5,STEP,1,RAPTO,2,RTRCTO,AUTO",
                                       "CYCLE/OFF",
                                       "CYCLE/ON",
                                       "MULTAX/ON",
                                       "MULTAX/OFF",
                                       "TLAXIS/1,0,0",
                                       "MSYS/1,2,3,0,1,0,0,0,1",
                                       "CSYS/1,0,0,0,0,1,0,0,0,0,1,0",
                                       "TRNTYP/WORLD,0,0,0",
                                       "$$*CATIA0",
                                       "$$ 0 0 1 5",
                                       "$$ 1 0 0 5",
                                       "$$ 0 1 0 5",
                                       "LOADTL/3",
                                       "TOOLNO/3,MILL",
                                       "COOLNT/ON",
                                       "DELAY/1",
                                       "STOP",
                                       "INSERT/X",
                                       "CUTCOM/LEFT",
                                       "END-OF-PATH",
                                       "PPRINT T"};
  Outcome outcome;
  for (int i = 0; i < 20'000; ++i) {
    std::string text = random() % 4 == 0 ? "" : "UNITS/MM\nFEDRAT/100,MMPM\nGOTO/5,0,0\n";
    const int lines = 1 + static_cast<int>(random() % 8);
    for (int k = 0; k < lines; ++k)
      text += std::string(kLines[random() % std::size(kLines)]) + "\n";
    require_outcome(text, outcome);
  }
  WARN("random programs: " << outcome.read << " read, " << outcome.refused << " refused");
  CHECK(outcome.read > 2000);
  CHECK(outcome.refused > 2000);
}

}  // namespace smoothpost::test
