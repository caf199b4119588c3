#include "tests/formats/nc/rs274_oracle.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "kernels/core/units.h"
#include "tests/formats/nc/recording.h"
#include "tests/support/support.h"

namespace smoothpost::test {
namespace {

namespace fs = std::filesystem;

/// The arguments of a printed call, as numbers; anything else is left out.
std::vector<double> arguments(const std::string& line) {
  std::vector<double> out;
  const std::size_t open = line.find('(');
  if (open == std::string::npos) return out;
  std::string list = line.substr(open + 1);
  for (char& c : list) {
    if (c == ',' || c == ')') c = ' ';
  }
  std::istringstream in(list);
  double value = 0.0;
  while (in >> value) out.push_back(value);
  return out;
}

/// Follows the printed offsets and units and collects the motions.
class CanonicalReader {
 public:
  explicit CanonicalReader(OracleRun& run) : run_(run) {}

  void line(const std::string& text) {
    const auto values = arguments(text);
    const auto is = [&](const char* name) { return text.find(name) != std::string::npos; };
    if (is("USE_LENGTH_UNITS")) {
      unit_ = is("INCHES") ? kMillimetresPerInch : 1.0;
      run_.inch = run_.inch || unit_ != 1.0;
    } else if (is("SET_G5X_OFFSET")) {
      take(g5x_, values, 1);
    } else if (is("SET_G92_OFFSET")) {
      take(g92_, values, 0);
    } else if (is("SET_XY_ROTATION")) {
      rotation_ = radians_from_degrees(values.at(0));
      run_.rotated = run_.rotated || rotation_ != 0.0;
    } else if (is("USE_TOOL_LENGTH_OFFSET")) {
      tool_z_ = values.at(2) * unit_;
    } else if (is("SELECT_PLANE")) {
      plane_ = is("_XZ") ? 1 : is("_YZ") ? 2 : 0;
    } else if (is("SET_FEED_RATE")) {
      feed_ = values.at(0) * unit_;
    } else if (is("RIGID_TAP")) {
      const std::array<double, 6> start = program_;
      OracleMotion motion;
      std::copy_n(values.begin(), 3, program_.begin());
      push(motion);
      program_ = start;  // the tap comes back by itself
      push(motion);
    } else if (is("STRAIGHT_TRAVERSE") || is("STRAIGHT_FEED") || is("STRAIGHT_PROBE")) {
      OracleMotion motion;
      motion.rapid = is("TRAVERSE");
      std::copy_n(values.begin(), 6, program_.begin());
      push(motion);
    } else if (is("TURN_PROBE_OFF")) {
      slack_ = 0.254;
    } else if (is("ARC_FEED")) {
      arc(values);
    } else if (is("MESSAGE(\"")) {
      const std::size_t begin = text.find('"') + 1;
      run_.messages.push_back(text.substr(begin, text.rfind('"') - begin));
    } else if (text.find("N....") == std::string::npos && text != "executing" && !text.empty()) {
      run_.messages.push_back(text);
    }
  }

 private:
  void take(std::array<double, 6>& to, const std::vector<double>& values, std::size_t from) {
    for (std::size_t i = 0; i < 6; ++i) to[i] = values.at(from + i) * (i < 3 ? unit_ : 1.0);
  }

  Vec3 world(const Vec3& program) const {
    const Vec3 shifted = program + Vec3(g92_[0], g92_[1], g92_[2]);
    return Eigen::AngleAxisd(rotation_, Vec3::UnitZ()) * shifted + Vec3(g5x_[0], g5x_[1], g5x_[2]);
  }

  void arc(const std::vector<double>& v) {
    static constexpr std::array<std::array<int, 3>, 3> kAxes = {{{0, 1, 2}, {2, 0, 1}, {1, 2, 0}}};
    const auto axes = kAxes[static_cast<std::size_t>(plane_)];
    OracleMotion motion;
    motion.arc = true;
    motion.turns = static_cast<int>(v.at(4));
    program_[static_cast<std::size_t>(axes[0])] = v.at(0);
    program_[static_cast<std::size_t>(axes[1])] = v.at(1);
    program_[static_cast<std::size_t>(axes[2])] = v.at(5);
    for (std::size_t i = 0; i < 3; ++i) program_[3 + i] = v.at(6 + i);
    Vec3 centre;
    centre[axes[0]] = v.at(2) * unit_;
    centre[axes[1]] = v.at(3) * unit_;
    centre[axes[2]] = v.at(5) * unit_;
    motion.centre = world(centre);
    push(motion);
  }

  void push(OracleMotion motion) {
    const Vec3 end = world(Vec3(program_[0], program_[1], program_[2]) * unit_);
    for (int i = 0; i < 3; ++i) motion.end[static_cast<std::size_t>(i)] = end[i];
    for (std::size_t i = 3; i < 6; ++i) motion.end[i] = program_[i] + g92_[i] + g5x_[i];
    motion.feed_mm_per_min = feed_;
    motion.tool_z = tool_z_;
    motion.slack = slack_;
    run_.motions.push_back(motion);
  }

  OracleRun& run_;
  std::array<double, 6> g5x_{};
  std::array<double, 6> g92_{};
  std::array<double, 6> program_{};
  double rotation_ = 0.0;
  double unit_ = 1.0;
  double feed_ = 0.0;
  double tool_z_ = 0.0;
  double slack_ = 0.0;
  int plane_ = 0;
};

/// A folder of this process, removed at the end.
class OwnFolder {
 public:
  OwnFolder()
      : path_(fs::temp_directory_path() / ("smoothpost_rs274_" + std::to_string(getpid()))) {
    fs::create_directories(path_);
    std::ofstream table(path_ / "tool.tbl");
    for (int n = 1; n <= 99; ++n) {
      char row[80];
      std::snprintf(row, sizeof row, "T%d P%d Z%.6f D0.1\n", n, n,
                    oracle_tool_length(n) / kMillimetresPerInch);
      table << row;
    }
  }
  ~OwnFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

const fs::path& own_folder() {
  static const OwnFolder folder;
  return folder.path();
}

/// What a command in the own folder prints; its exit status. rs274 maps its tool table from a file
/// in HOME: two runs at once must not share it.
OracleRun run_in_folder(const std::string& command, int& status) {
  const fs::path& folder = own_folder();
  const int ended = std::system(("cd '" + folder.string() + "' && HOME=\"$PWD\" timeout 20 " +
                                 command + " >out.txt 2>err.txt </dev/null")
                                    .c_str());
  status = WIFEXITED(ended) ? WEXITSTATUS(ended) : -1;
  OracleRun run;
  run.accepted = status == 0;
  std::ifstream out(folder / "out.txt");
  read_canonical(out, run);
  std::ifstream err(folder / "err.txt");
  for (std::string line; std::getline(err, line);) run.message += line + " | ";
  return run;
}

}  // namespace

nc::InterpreterSettings oracle_settings() {
  nc::InterpreterSettings settings;
  settings.process = mill_table();
  settings.process.unmapped = UnmappedWords::comment;
  settings.axes = 0x3f;
  for (int n = 1; n <= 99; ++n) settings.tool_lengths[n] = oracle_tool_length(n);
  return settings;
}

bool oracle_present() { return std::system("command -v rs274 >/dev/null 2>&1") == 0; }

double oracle_tool_length(int n) { return kMillimetresPerInch * (1.0 + 0.01 * n); }

void read_canonical(std::istream& text, OracleRun& run) {
  CanonicalReader reader(run);
  for (std::string line; std::getline(text, line);) reader.line(line);
}

OracleRun run_oracle(const std::string& text) {
  const fs::path& folder = own_folder();
  std::ofstream(folder / "p.ngc", std::ios::binary) << text;
  std::ofstream(folder / "v.var", std::ios::binary);
  int status = 0;
  return run_in_folder("rs274 -g -t tool.tbl -v v.var p.ngc", status);
}

std::optional<OracleRun> run_fine_oracle() {
  int status = 0;
  OracleRun run =
      run_in_folder("/usr/bin/python3 -B '" +
                        source_path("tests/formats/nc/canonical_ends.py").string() + "' p.ngc",
                    status);
  constexpr int kNoModule = 77, kNoProgram = 127;
  if (status == kNoModule || status == kNoProgram) return std::nullopt;
  run.digit = 2e-6;
  return run;
}

namespace {

std::array<double, 6> end_of(const CanonicalMotion& motion) {
  std::array<double, 6> end{};
  for (std::size_t i = 0; i < 6; ++i) end[i] = i < 3 ? motion.end[i] : degrees(motion.end[i]);
  return end;
}

double distance(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < 6; ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

/// Sweep of our arc against sense and turns that rs274 printed.
bool same_turns(const CanonicalMotion& ours, const OracleMotion& theirs) {
  const double circles = std::abs(ours.arc.sweep) / (2.0 * kPi);
  const int turns = static_cast<int>(std::ceil(circles - 1e-6));
  const double sign = ours.arc.sweep > 0.0 ? 1.0 : -1.0;
  return turns * sign == theirs.turns;
}

}  // namespace

Comparison compare(const std::vector<CanonicalMotion>& ours, const OracleRun& oracle) {
  Comparison out;
  // Half a unit of the last printed decimal, in the unit of the program; turned and shifted
  // positions are sums of up to three such numbers.
  const double digit = (oracle.inch ? kMillimetresPerInch : 1.0) * oracle.digit;
  const double tolerance = oracle.rotated || oracle.inch ? 3.0 * digit : 1.01 * digit;
  const auto& theirs_all = oracle.motions;
  const auto machine = [&](std::size_t k) {
    std::array<double, 6> end = theirs_all[k].end;
    end[2] += theirs_all[k].tool_z;
    return end;
  };
  const auto standstill = [&](std::size_t k) {
    const std::array<double, 6> before = k > 0 ? machine(k - 1) : std::array<double, 6>{};
    return !theirs_all[k].arc && distance(before, machine(k)) < 2.0 * tolerance;
  };
  // rs274 prints a motion to the same place for G0 or G1 without axis words, and G28 without words.
  std::size_t k = 0;
  for (const CanonicalMotion& mine : ours) {
    while (k < theirs_all.size() && standstill(k) &&
           ((mine.kind == MotionKind::rapid) != theirs_all[k].rapid ||
            distance(end_of(mine), theirs_all[k].end) > tolerance + theirs_all[k].slack)) {
      ++k;
    }
    if (k == theirs_all.size()) {
      out.problem = "line " + std::to_string(mine.line) + ": no such motion in rs274";
      return out;
    }
    const OracleMotion& theirs = theirs_all[k++];
    const auto where = "line " + std::to_string(mine.line) + ": ";
    const double off = distance(end_of(mine), theirs.end);
    if (theirs.slack == 0.0) out.worst = std::max(out.worst, off);
    ++out.motions;
    if (off > tolerance + theirs.slack)
      out.problem = where + "end differs by " + std::to_string(off);
    if ((mine.kind == MotionKind::rapid) != theirs.rapid) out.problem = where + "kind";
    if (mine.is_arc != theirs.arc) {
      out.problem = where + "arc or not";
    } else if (mine.is_arc) {
      ++out.arcs;
      Vec3 apart = mine.arc.centre - theirs.centre;
      apart -= apart.dot(mine.arc.normal) * mine.arc.normal;
      if (apart.norm() > 2.0 * tolerance + theirs.slack) out.problem = where + "centre";
      if (!same_turns(mine, theirs)) out.problem = where + "sweep";
    } else if (!theirs.rapid && theirs.slack == 0.0) {
      const Vec3 move(mine.end[0] - mine.start[0], mine.end[1] - mine.start[1],
                      mine.end[2] - mine.start[2]);
      if (move.norm() > 0.5 && theirs.feed_mm_per_min > 1.0) {
        ++out.times;
        const double expected = move.norm() / theirs.feed_mm_per_min * 60.0;
        if (std::abs(mine.duration / expected - 1.0) > 1e-3) out.problem = where + "duration";
      }
    }
    if (!out.problem.empty()) return out;
  }
  for (; k < theirs_all.size(); ++k) {
    if (!standstill(k)) out.problem = "rs274 has further motions";
  }
  return out;
}

TEST_CASE("oracle: printed calls become motions in world coordinates", "[formats][nc][oracle]") {
  std::istringstream text(
      "    1 N..... USE_LENGTH_UNITS(CANON_UNITS_INCHES)\n"
      "    2 N..... SET_G5X_OFFSET(1, 1.0000, 2.0000, 0.0000, 0.0000, 0.0000, 5.0000)\n"
      "    3 N..... SET_XY_ROTATION(90.0000)\n"
      "    4 N..... MESSAGE(\" X1\")\n"
      "plain\n"
      "    5 N..... SET_FEED_RATE(2.0000)\n"
      "    6 N..... STRAIGHT_FEED(3.0000, 0.0000, 1.0000, 0.0000, 0.0000, 7.0000)\n"
      "    7 N..... ARC_FEED(3.0000, 2.0000, 3.0000, 1.0000, -1, 1.0000, 0.0000, 0.0000, "
      "7.0000)\n");
  OracleRun run;
  read_canonical(text, run);
  REQUIRE(run.motions.size() == 2);
  CHECK(run.motions[0].end[0] == Approx(25.4));
  CHECK(run.motions[0].end[1] == Approx(25.4 * 5.0));
  CHECK(run.motions[0].end[5] == Approx(12.0));
  CHECK(run.motions[0].feed_mm_per_min == Approx(50.8));
  CHECK(run.motions[1].arc);
  CHECK(run.motions[1].turns == -1);
  CHECK(run.motions[1].centre.isApprox(Vec3(0.0, 5.0 * 25.4, 25.4), 1e-9));
  CHECK(run.messages == std::vector<std::string>{" X1", "plain"});
}

}  // namespace smoothpost::test
