#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/formats/nc/recording.h"
#include "tests/formats/nc/rs274_oracle.h"
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
    } else if (is("STRAIGHT_TRAVERSE") || is("STRAIGHT_FEED")) {
      OracleMotion motion;
      motion.rapid = is("TRAVERSE");
      std::copy_n(values.begin(), 6, program_.begin());
      push(motion);
    } else if (is("ARC_FEED")) {
      arc(values);
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

}  // namespace

bool oracle_present() { return std::system("command -v rs274 >/dev/null 2>&1") == 0; }

double oracle_tool_length(int n) { return kMillimetresPerInch * (1.0 + 0.01 * n); }

OracleRun run_oracle(const std::string& text) {
  static const OwnFolder folder;
  std::ofstream(folder.path() / "p.ngc", std::ios::binary) << text;
  std::ofstream(folder.path() / "v.var", std::ios::binary);
  // rs274 maps its tool table from a file in HOME: two runs at once must not share it.
  const std::string command =
      "cd '" + folder.path().string() +
      "' && HOME=\"$PWD\" rs274 -g -t tool.tbl -v v.var p.ngc >out.txt 2>err.txt </dev/null";
  OracleRun run;
  run.accepted = std::system(command.c_str()) == 0;
  CanonicalReader reader(run);
  std::ifstream out(folder.path() / "out.txt");
  for (std::string line; std::getline(out, line);) reader.line(line);
  std::ifstream err(folder.path() / "err.txt");
  for (std::string line; std::getline(err, line);) run.message += line + " | ";
  return run;
}

namespace {

nc::InterpreterSettings oracle_settings() {
  nc::InterpreterSettings settings;
  settings.process = mill_table();
  settings.process.unmapped = UnmappedWords::comment;
  settings.axes = 0x3f;
  for (int n = 1; n <= 99; ++n) settings.tool_lengths[n] = oracle_tool_length(n);
  return settings;
}

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

struct Comparison {
  std::string problem;
  std::size_t motions = 0;
  std::size_t arcs = 0;
  std::size_t times = 0;
  double worst = 0.0;
};

/// Sweep of our arc against sense and turns that rs274 printed.
bool same_turns(const CanonicalMotion& ours, const OracleMotion& theirs) {
  const double circles = std::abs(ours.arc.sweep) / (2.0 * kPi);
  const int turns = static_cast<int>(std::ceil(circles - 1e-9));
  const double sign = ours.arc.sweep > 0.0 ? 1.0 : -1.0;
  return turns * sign == theirs.turns;
}

Comparison compare(const std::vector<CanonicalMotion>& ours, const OracleRun& oracle) {
  Comparison out;
  // Four printed decimals: half a unit of the last one, in the unit of the program; turned and
  // shifted positions are sums of up to three such numbers.
  const double digit = (oracle.inch ? kMillimetresPerInch : 1.0) * 1e-4;
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
            distance(end_of(mine), theirs_all[k].end) > tolerance)) {
      ++k;
    }
    if (k == theirs_all.size()) {
      out.problem = "line " + std::to_string(mine.line) + ": no such motion in rs274";
      return out;
    }
    const OracleMotion& theirs = theirs_all[k++];
    const auto where = "line " + std::to_string(mine.line) + ": ";
    const double off = distance(end_of(mine), theirs.end);
    out.worst = std::max(out.worst, off);
    ++out.motions;
    if (off > tolerance) out.problem = where + "end differs by " + std::to_string(off);
    if ((mine.kind == MotionKind::rapid) != theirs.rapid) out.problem = where + "kind";
    if (mine.is_arc != theirs.arc) {
      out.problem = where + "arc or not";
    } else if (mine.is_arc) {
      ++out.arcs;
      Vec3 apart = mine.arc.centre - theirs.centre;
      apart -= apart.dot(mine.arc.normal) * mine.arc.normal;
      if (apart.norm() > 2.0 * tolerance) out.problem = where + "centre";
      if (!same_turns(mine, theirs)) out.problem = where + "sweep";
    } else if (!theirs.rapid) {
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

/// Random programs in the scope of this version; every line is valid by construction.
class ProgramMaker {
 public:
  explicit ProgramMaker(unsigned seed) : random_(seed) {}

  std::string make() {
    text_ = "G21 G90 G17 G94 F" + number(100, 900) + "\nG0 X0 Y0 Z0 A0 B0 C0\n";
    for (int i = 0; i < 45; ++i) line();
    return text_ + "M2\n";
  }

 private:
  int dice(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  double value(double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random_);
  }
  static std::string fixed(double v) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.3f", v);
    return buffer;
  }
  std::string number(double lo, double hi) { return fixed(value(lo, hi)); }
  std::string word(const char* letters, int chance) {
    std::string out;
    for (const char* c = letters; *c; ++c) {
      if (dice(100) < chance) out += std::string(" ") + *c + number(-80, 80);
    }
    return out;
  }
  std::string some_axes() {
    std::string out = word("XYZABC", 35);
    return out.empty() ? " X" + number(-80, 80) : out;
  }
  /// F on every line of inverse time.
  std::string feed() {
    return inverse_ ? " F" + number(0.5, 20) : dice(4) ? "" : " F" + number(50, 2000);
  }
  void put(const std::string& line) { text_ += line + "\n"; }

  void line() {
    switch (dice(20)) {
      case 0:
        // rs274 2.9 leaves an active tool length as a number when the unit changes.
        put("G49");
        return put(dice(2) ? "G20" : "G21");
      case 1:
        return plane();
      case 2:
        incremental_ = dice(2) == 0;
        return put(incremental_ ? "G91" : "G90");
      case 3:
        return put("G92" + some_axes());
      case 4:
        return put("G52" + some_axes());
      case 5:
        return put(dice(3) == 0 ? "G92.1" : dice(2) ? "G92.2" : "G92.3");
      case 6:
        return work_offset();
      case 7:
        return put("G10 L20 P" + std::to_string(dice(4)) + some_axes());
      case 8:
        return put("G" + std::to_string(54 + dice(3)));
      case 9:
        return incremental_ ? put("G4 P0.5") : put("G53 G0" + some_axes());
      case 10:
        inverse_ = dice(2) == 0;
        return put(inverse_ ? "G93" : "G94 F" + number(50, 2000));
      case 11:
        return put(dice(3) == 0 ? std::string("G49")
                   : dice(2)    ? "G43.1 Z" + number(-50, 90)
                                : "G43 H" + std::to_string(1 + dice(5)));
      case 12:
        return incremental_ ? put("G28" + word("XYZ", 50)) : put("G30" + some_axes());
      case 13:
      case 14:
      case 15:
      case 16:
        return arc();
      default:
        return put((dice(3) ? "G1" + feed() : std::string("G0")) + some_axes());
    }
  }

  /// LinuxCNC 2.9 turns its present position without the G92 shift when G10 L2 changes the
  /// rotation, so that words which are not programmed next would move; no shift is active here
  /// (docs/formats_nc.md).
  void work_offset() {
    const bool turned = dice(3) == 0;
    if (turned) put("G92.1");
    put("G10 L2 P" + std::to_string(dice(4)) + word("XYZABC", 30) +
        (turned ? " R" + number(-90, 90) : ""));
  }

  void plane() {
    plane_ = dice(3);
    put("G1" + std::to_string(7 + plane_));
  }

  /// Incremental, so that the geometry is known without the position.
  void arc() {
    static constexpr const char* kAxes[] = {"XYZ", "ZXY", "YZX"};
    static constexpr const char* kCentres[] = {"IJ", "KI", "JK"};
    const std::string axes = kAxes[plane_];
    const std::string centres = kCentres[plane_];
    std::string out = std::string(dice(2) ? "G91 G2" : "G91 G3") + feed();
    const double i = value(-40, 40);
    const double j = value(5, 40);
    if (dice(4) == 0) {  // full circles
      out += std::string(" ") + centres[0] + fixed(i) + " " + centres[1] + fixed(j);
      if (dice(2)) out += " P" + std::to_string(1 + dice(3));
    } else {
      const double turn = value(0.3, 6.0);
      const double x = i - i * std::cos(turn) + j * std::sin(turn);
      const double y = j - i * std::sin(turn) - j * std::cos(turn);
      out += std::string(" ") + axes[0] + fixed(x) + " " + axes[1] + fixed(y);
      if (dice(2)) {
        out += std::string(" ") + centres[0] + fixed(i) + " " + centres[1] + fixed(j);
      } else {
        const double radius = std::hypot(x, y) * value(0.51, 3.0);
        out += " R" + fixed(dice(2) ? radius : -radius);
      }
    }
    if (dice(3) == 0) out += std::string(" ") + axes[2] + number(-20, 20);
    if (dice(4) == 0) out += " A" + number(-90, 90);
    put(out);
    incremental_ = true;
  }

  std::mt19937 random_;
  std::string text_;
  int plane_ = 0;
  bool incremental_ = false;
  bool inverse_ = false;
};

}  // namespace

TEST_CASE("interpreter against rs274: 200 random programs", "[formats][nc][oracle]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  std::size_t motions = 0, arcs = 0, times = 0, accepted = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const std::string text = ProgramMaker(seed).make();
    const OracleRun oracle = run_oracle(text);
    const Run ours = run(text, oracle_settings());
    INFO("seed " << seed << "\n" << text);
    INFO("rs274: " << oracle.message);
    INFO("ours: " << ours.all_text());
    REQUIRE(ours.ok == oracle.accepted);
    if (!oracle.accepted) continue;
    ++accepted;
    const Comparison result = compare(ours.sink.motions, oracle);
    INFO(result.problem);
    REQUIRE(result.problem.empty());
    motions += result.motions;
    arcs += result.arcs;
    times += result.times;
  }
  WARN("compared with rs274: " << accepted << " of 200 random programs, " << motions << " motions, "
                               << arcs << " arcs, " << times << " durations");
  CHECK(accepted >= 150);
  CHECK(arcs >= 1000);
}

/// Random programs of parameters and expressions; some end in a fault of value, on purpose.
class ExpressionMaker {
 public:
  explicit ExpressionMaker(unsigned seed) : random_(seed) {}

  std::string make() {
    std::string text = "G21 G90 G17 G94 F500\nG0 X0 Y0 Z0 A0 B0 C0\n";
    for (int i = 1; i <= 6; ++i) {
      text += "#" + std::to_string(i) + "=" + number() + " #<n" + std::to_string(i) +
              "> = " + number() + " #<_g" + std::to_string(i) + ">=[" + number() + "]\n";
    }
    for (int i = 0; i < 25;) {
      const std::string next = line();
      if (next.size() > 240) continue;  // "Command too long"
      text += next + "\n";
      ++i;
    }
    return text + "M2\n";
  }

 private:
  int dice(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  std::string pick(std::initializer_list<const char*> list) {
    return *(list.begin() + dice(static_cast<int>(list.size())));
  }
  std::string number() {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, dice(2) ? "%.0f" : "%.3f", dice(4001) / 100.0 - 20.0);
    return buffer;
  }
  std::string parameter() {
    switch (dice(6)) {
      case 0:
        return "#<N " + std::to_string(1 + dice(6)) + ">";
      case 1:
        return "#<_G" + std::to_string(1 + dice(6)) + ">";
      case 2:
        return "#[" + std::to_string(dice(3)) + "+" + std::to_string(1 + dice(3)) + "]";
      case 3:
        return "#" + std::to_string(5420 + dice(6));
      case 4:
        return pick(
            {"#<_x>", "#<_metric>", "#<_incremental>", "#5220", "#5400", "#<_motion_mode>"});
      default:
        return "#" + std::to_string(1 + dice(6));
    }
  }
  std::string function(int depth) {
    const std::string name = pick({"ABS", "sin", "COS", "Tan", "FIX", "fup", "round", "sqrt", "LN",
                                   "exp", "a s i n", "acos", "ATAN", "EXISTS"});
    if (name == "EXISTS") return name + "[" + parameter() + "]";
    if (name == "exp") return "exp[[" + value(depth) + "] MOD 5]";
    if (name == "a s i n" || name == "acos") return name + "[[" + value(depth) + "]/1000]";
    if ((name == "sqrt" || name == "LN") && dice(20) != 0) {
      return name + "[ABS[" + value(depth) + "]+0.5]";
    }
    std::string out = name + "[" + value(depth) + "]";
    if (name == "ATAN") out += "/[" + value(depth) + "]";
    return out;
  }
  std::string value(int depth) {
    if (depth <= 0) return dice(2) ? number() : parameter();
    switch (dice(8)) {
      case 0:
        return number();
      case 1:
        return parameter();
      case 2:
        return function(depth - 1);
      case 3:
        return "-[" + value(depth - 1) + "]";
      case 4:
        return "[" + value(depth - 1) + " * 0.01]**2";
      default:
        return "[" + value(depth - 1) + operation() + value(depth - 1) + operation() +
               value(depth - 1) + "]";
    }
  }
  std::string operation() {
    if (dice(60) == 0) return "/";  // sometimes by zero
    return pick({" + ", "-", " * ", "*", " MOD ", " EQ ", " ne ", " GT ", "GE", " LT ", " le ",
                 " AND ", "or", " XOR "});
  }
  /// A word whose value stays in a range in which four decimals tell.
  std::string word(char letter) {
    return std::string(" ") + letter + "[[" + value(3) + "] MOD 360 - 100]";
  }
  std::string line() {
    switch (dice(8)) {
      case 0:
        return "#" + std::to_string(1 + dice(6)) + "=[" + value(3) + " MOD 50]";
      case 1:
        return "#<n" + std::to_string(1 + dice(6)) + "> = [" + value(2) + " MOD 20]";
      case 2:
        return "#3=[#3+1] #4=#3 G1" + word('X') + " #4=[#4*0.5]";
      case 3:
        return pick({"G91", "G90", "G#7", "G[90+1]", "M[4+5]", "G92 X#1", "G92.1"});
      default:
        return (dice(2) ? "G1" : "G0") + word('X') + (dice(2) ? word('Y') : "") +
               (dice(3) ? "" : word('A')) + (dice(3) ? "" : " Z#" + std::to_string(1 + dice(6)));
    }
  }

  std::mt19937 random_;
};

TEST_CASE("expression: against rs274 in 60 random programs", "[formats][nc][oracle]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  std::size_t motions = 0, accepted = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const std::string text = ExpressionMaker(seed).make();
    const OracleRun oracle = run_oracle(text);
    const Run ours = run(text, oracle_settings());
    INFO("seed " << seed << "\n" << text);
    INFO("rs274: " << oracle.message);
    INFO("ours: " << ours.all_text());
    REQUIRE(ours.ok == oracle.accepted);
    if (!oracle.accepted) continue;
    ++accepted;
    const Comparison result = compare(ours.sink.motions, oracle);
    INFO(result.problem);
    REQUIRE(result.problem.empty());
    motions += result.motions;
  }
  WARN("expressions compared with rs274: " << accepted << " of 60 programs, " << motions
                                           << " motions");
  CHECK(accepted >= 20);
}

TEST_CASE("expression: single lines are refused exactly when rs274 refuses them",
          "[formats][nc][oracle]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  for (const char* line : {"X[1/0]",
                           "X[7 MOD 0]",
                           "X[SQRT[-1]]",
                           "X[LN[0]]",
                           "X[ACOS[1.1]]",
                           "X[ASIN[-1.1]]",
                           "X[[-8]**[1/3]]",
                           "X[[-8]**3]",
                           "X#0",
                           "X#5602",
                           "X#5601",
                           "X#1.5",
                           "X#1.00001",
                           "X#<a>",
                           "X[EXISTS[#<a>]]",
                           "X[EXISTS[#5]]",
                           "X[EXISTS[5]]",
                           "X[EXISTS[#6000]]",
                           "X[2+]",
                           "X[]",
                           "X[1 2]",
                           "X[1",
                           "X1]",
                           "X[ATAN[1]]",
                           "X[ATAN[1]/2]",
                           "X[ATAN[1]/[2]]",
                           "XFOO[1]",
                           "X[0x]",
                           "X[1.0.1]",
                           "#1 5",
                           "#1=",
                           "#5420=1",
                           "#5428=1",
                           "#5400=1",
                           "#<_x>=1",
                           "#<a>=1",
                           "#<>=1",
                           "#<a=1",
                           "##1=2",
                           "#[1]=2",
                           "G[0.5]",
                           "G[1.0004] F1 X1",
                           "G[90.00001]",
                           "M[5.00001]",
                           "M[5.01]",
                           "T[1.00001]",
                           "T[1.1]",
                           "N[5]",
                           "F[1/3]",
                           "G4 P[-1]",
                           "G4 P[0.1]",
                           "X[3 - -2]",
                           "X[1 + +2]",
                           "X-[2]",
                           "X+[2]",
                           "X-#1",
                           "Xsin[30]",
                           "X s i n [ 3 0 ]",
                           "X[2**3**2]",
                           "X[1 AND 0 OR 1 XOR 1]",
                           "X[3 GT 2 GT 1]",
                           "X[FIX[-2.5]]",
                           "X[(a)2]",
                           "X[#5 EQ 0]",
                           "X1 #1=2 X2",
                           "#1=2 #1=3",
                           "X##1",
                           "#1=1 X##1",
                           "S[-1]",
                           "X[EXP[1000]]",
                           "X[1e3]",
                           "X[.5.]",
                           "X[1,2]"}) {
    const std::string text = std::string("G0 X0 Y0 Z0 A0 B0 C0 F100\n") + line + "\nM2\n";
    const bool ours = run(text, oracle_settings()).ok;
    const OracleRun oracle = run_oracle(text);
    INFO(line << ": rs274 says " << oracle.message);
    CHECK(ours == oracle.accepted);
  }
}

TEST_CASE("interpreter against rs274: corpus programs that both accept", "[formats][nc][oracle]") {
  if (!oracle_present() || !shared_path("corpus")) {
    WARN("rs274 or the corpus is not here: skipped");
    return;
  }
  std::size_t both = 0, motions = 0, arcs = 0, times = 0;
  std::string only_they, only_we;
  for (const char* folder : {"1_five_axis", "3_three_axis", "7_linuxcnc_interp"}) {
    for (const auto& path :
         corpus_files(folder, {".ngc", ".nc", ".tap", ".gcode", ".eia", ".txt"})) {
      const std::string text = read_bytes(path);
      if (text.size() > 3'000'000) continue;
      const OracleRun oracle = run_oracle(text);
      const Run ours = run(text, oracle_settings());
      const std::string name =
          path.parent_path().filename().string() + "/" + path.filename().string();
      if (ours.ok && !oracle.accepted) only_we += "\n  " + name + ": " + oracle.message;
      if (!ours.ok && oracle.accepted) only_they += "\n  " + name + ": " + ours.errors().front();
      if (!ours.ok || !oracle.accepted) continue;
      INFO(path.string());
      const Comparison result = compare(ours.sink.motions, oracle);
      INFO(result.problem);
      CHECK(result.problem.empty());
      ++both;
      motions += result.motions;
      arcs += result.arcs;
      times += result.times;
    }
  }
  WARN("accepted by both and compared: " << both << " corpus files, " << motions << " motions, "
                                         << arcs << " arcs, " << times << " durations");
  WARN("accepted by rs274 only:" << only_they);
  WARN("accepted by us only:" << only_we);
  CHECK(both >= 30);
  CHECK(motions > 1000);
}

}  // namespace smoothpost::test
