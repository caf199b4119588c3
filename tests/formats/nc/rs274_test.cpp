#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <random>

#include "tests/formats/nc/recording.h"
#include "tests/formats/nc/rs274_oracle.h"
#include "tests/support/support.h"

namespace smoothpost::test {
namespace {

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

namespace {

/// Every tool of the oracle's table has the diameter 0.1 inch.
nc::InterpreterSettings with_diameters() {
  nc::InterpreterSettings settings = oracle_settings();
  for (const auto& [tool, length] : settings.tool_lengths)
    settings.tool_diameters[tool] = 0.1 * kMillimetresPerInch;
  return settings;
}

nc::InterpreterSettings with_tools_of_no_length() {
  nc::InterpreterSettings settings = with_diameters();
  for (auto& [tool, length] : settings.tool_lengths) length = 0.0;
  return settings;
}

struct Against {
  std::size_t accepted_there = 0, both = 0, fine = 0;
  std::size_t motions = 0, arcs = 0, times = 0;
  double worst_fine = 0.0;
  std::string only_they, only_we;
};

void look_at(const std::filesystem::path& path, Against& sum) {
  const std::string text = read_bytes(path);
  if (text.size() > 3'000'000) return;
  const OracleRun oracle = run_oracle(text);
  const Run ours = run(text, with_diameters());
  const std::string name = path.parent_path().filename().string() + "/" + path.filename().string();
  sum.accepted_there += oracle.accepted ? 1 : 0;
  if (ours.ok && !oracle.accepted) sum.only_we += "\n  " + name + ": " + oracle.message;
  if (!ours.ok && oracle.accepted) sum.only_they += "\n  " + name + ": " + ours.errors().front();
  if (!ours.ok || !oracle.accepted) return;
  INFO(path.string());
  const Comparison result = compare(ours.sink.motions, oracle);
  INFO(result.problem);
  CHECK(result.problem.empty());
  ++sum.both;
  sum.motions += result.motions;
  sum.arcs += result.arcs;
  sum.times += result.times;
  // The module has no diameters; and beside arcs whose words are rounded two radii differ.
  if (ours.has("NC265")) return;
  const std::optional<OracleRun> fine = run_fine_oracle();
  if (!fine || !fine->accepted) return;
  const Comparison exact = compare(run(text, with_tools_of_no_length()).sink.motions, *fine);
  INFO("nine decimals: " << exact.problem);
  CHECK(exact.problem.empty());
  sum.worst_fine = std::max(sum.worst_fine, exact.worst);
  ++sum.fine;
}

}  // namespace

TEST_CASE("interpreter against rs274: the corpus' programs", "[formats][nc][oracle]") {
  if (!oracle_present() || !shared_path("corpus")) {
    WARN("rs274 or the corpus is not here: skipped");
    return;
  }
  Against sum, suite;  // the interpreter's own tests are judged by conformance_test, too
  for (const char* folder : {"1_five_axis", "3_three_axis", "7_linuxcnc_interp"})
    for (const auto& path : corpus_files(folder, {".ngc", ".nc", ".tap", ".gcode", ".eia", ".txt"}))
      look_at(path, folder[0] == '7' ? suite : sum);
  for (const Against* part : {&sum, &suite}) {
    WARN("accepted by rs274: " << part->accepted_there << " corpus files; by both, compared: "
                               << part->both << ", " << part->motions << " motions, " << part->arcs
                               << " arcs, " << part->times << " durations; " << part->fine
                               << " of them with nine decimals, the worst off by "
                               << part->worst_fine);
    WARN("accepted by rs274 only:" << part->only_they);
    WARN("accepted by us only:" << part->only_we);
    CHECK(part->worst_fine <= 2e-6);
  }
  CHECK(sum.both >= 30);
  CHECK(sum.motions > 1000);
  CHECK(static_cast<double>(sum.both) >= 0.98 * static_cast<double>(sum.accepted_there));
}

}  // namespace smoothpost::test
