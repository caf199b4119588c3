#include <catch2/catch.hpp>
#include <cstdio>
#include <random>

#include "tests/formats/nc/recording.h"
#include "tests/formats/nc/rs274_oracle.h"

// Random programs of cycles and of program flow against LinuxCNC's own interpreter.
namespace smoothpost::test {
namespace {

std::string fixed(double v) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.3f", v);
  return buffer;
}

class Maker {
 public:
  explicit Maker(unsigned seed) : random_(seed) {}

 protected:
  int dice(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  double value(double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random_);
  }
  std::string number(double lo, double hi) { return fixed(value(lo, hi)); }
  void put(const std::string& line) { text_ += line + "\n"; }

  std::mt19937 random_;
  std::string text_;
};

/// Holes of all cycles in all planes; a few lines break a rule.
class CycleMaker : public Maker {
 public:
  using Maker::Maker;

  std::string make() {
    put("G21 G90 G17 G94 F" + number(100, 900));
    put("S500 M3");
    put("G0 X0 Y0 Z0 A0 B0 C0");
    for (int i = 0; i < 25; ++i) line();
    return text_ + "M2\n";
  }

 private:
  static constexpr const char* kAxes[] = {"XYZ", "ZXY", "YZX"};

  void line() {
    switch (dice(14)) {
      case 0:
        plane_ = dice(3);
        incremental_ = false;
        put("G90 G1" + std::to_string(7 + plane_));
        return start();
      case 1:
        return put(dice(2) ? "G98" : "G99");
      case 2:
        put("G80");
        return put("G10 L2 P1 X" + number(-9, 9) + (dice(2) ? " R" + number(-90, 90) : ""));
      case 3:
        return put("G92.1 F" + number(100, 900));
      case 4:
        return start();
      case 5:
        return put(dice(2) ? "M3" : "M4");
      default:
        return series();
    }
  }

  void start() {
    incremental_ = false;
    put("G90 G0 X" + number(-20, 20) + " Y" + number(-20, 20) + " Z" + number(-20, 20));
  }

  void series() {
    static constexpr int kCycles[] = {73, 74, 81, 82, 83, 84, 85, 86, 89};
    const int cycle = kCycles[dice(9)];
    const bool incremental = dice(3) == 0;
    if (incremental != incremental_) put("G80");  // else refused
    incremental_ = incremental;
    const char depth = kAxes[plane_][2];
    // The height over the hole is above its bottom but for a few.
    const double r = value(-5, 10);
    const double deep = value(0.5, 20) * (dice(20) == 0 ? -1 : 1);
    std::string line = std::string(incremental_ ? "G91" : "G90") + " G" + std::to_string(cycle);
    line += words() + " R" + fixed(r) + " " + depth + fixed(incremental_ ? -deep : r - deep);
    if (cycle == 73 || cycle == 83) line += " Q" + number(0.7, 6);
    if (cycle == 82 || cycle == 86 || cycle == 89) line += " P0.25";
    if (dice(3) == 0) line += " L" + std::to_string(1 + dice(3));
    put(line);
    for (int i = dice(4); i > 0; --i) put(further(r, depth));
    if (dice(2)) put("G80");
    if (dice(2)) start();
  }

  std::string further(double r, char depth) {
    std::string line = words();
    if (dice(5) == 0) line += std::string(" ") + depth + fixed(incremental_ ? -1.5 : r - 1.5);
    if (dice(6) == 0) line += " L2";
    return line;
  }

  std::string words() {
    std::string out = std::string(" ") + kAxes[plane_][0] + number(-30, 30);
    if (dice(2)) out += std::string(" ") + kAxes[plane_][1] + number(-30, 30);
    return out;
  }

  int plane_ = 0;
  bool incremental_ = false;
};

/// Loops, branches and subroutines within each other; labels are used once. rs274 2.9 ends a do
/// loop after its first pass when a while loop before it was left by break (docs/formats_nc.md): a
/// program has do loops or breaks out of while loops. rs274 2.9 also runs a repeat twice as often
/// behind a do loop that was gone on with by continue (proved below): do loops have breaks only.
class FlowMaker : public Maker {
 public:
  using Maker::Maker;

  std::string make() {
    put("G21 G90 G17 G94 F500");
    put("G0 X0 Y0 Z0 A0 B0 C0");
    for (int s = 1; s <= 3; ++s) subroutine(s);
    for (int i = 1; i <= 9; ++i) put("#" + std::to_string(i) + "=" + std::to_string(dice(5)));
    subs_ = 3;
    body(3, 6);
    return text_ + "M2\n";
  }

 private:
  std::string parameter() { return "#" + std::to_string(1 + dice(9)); }
  std::string label() { return "o" + std::to_string(100 + label_++); }
  std::string condition() {
    static constexpr const char* kTests[] = {"LT", "GT", "EQ", "NE", "GE", "LE"};
    return "[" + parameter() + " " + kTests[dice(6)] + " " + std::to_string(dice(6)) + "]";
  }

  void subroutine(int s) {
    const std::string name = "o<sub" + std::to_string(s) + ">";
    put(name + " sub");
    subs_ = s - 1;
    in_sub_ = name;
    body(2, 3);
    put(name + " endsub" + (dice(2) ? " [" + parameter() + "+1]" : ""));
    in_sub_.clear();
  }

  void body(int depth, int lines) {
    for (int i = 0; i < lines; ++i) line(depth);
  }

  void line(int depth) {
    switch (depth > 0 ? dice(10) : dice(5)) {
      case 0:
        return put(parameter() + "=[" + parameter() + "+" + std::to_string(dice(3)) + "]");
      case 1:
        if (subs_ > 0) {
          put("o<sub" + std::to_string(1 + dice(subs_)) + "> call [" + parameter() + "] [2]");
          return put("#9=#<_value>");
        }
        return put("G0 Y#2");
      case 2:
        if (!in_sub_.empty() && repeats_ == 0 && dice(3) == 0) {
          const std::string name = label();
          put(name + " if " + condition());
          put(in_sub_ + " return [" + parameter() + "]");
          return put(name + " endif");
        }
        return put("G1 X[" + parameter() + "*2] Z#3");
      case 3:
      case 4:
        return put("G91 G0 X" + std::to_string(1 + dice(4)) + "\nG90");
      case 5:
      case 6:
        return branch(depth);
      case 7: {
        const std::string name = label();
        put(name + " repeat [" + std::to_string(dice(4)) + "]");
        ++repeats_;
        body(depth - 1, 2);
        --repeats_;
        return put(name + " endrepeat");
      }
      default:
        return loop(depth);
    }
  }

  void branch(int depth) {
    const std::string name = label();
    put(name + " if " + condition());
    body(depth - 1, 2);
    if (dice(2)) {
      put(name + " elseif " + condition());
      body(depth - 1, 1);
    }
    if (dice(2)) {
      put(name + " else");
      body(depth - 1, 1);
    }
    put(name + " endif");
  }

  /// The counter of a loop is a name of its own, so that the loop ends.
  void loop(int depth) {
    const std::string name = label();
    const std::string counter = "#<c" + std::to_string(label_) + ">";
    const bool at_end = do_loops_ && dice(2) == 0;
    const std::string test = " while [" + counter + " LT " + std::to_string(1 + dice(3)) + "]";
    put(counter + "=0");
    put(name + (at_end ? " do" : test));
    put(counter + "=[" + counter + "+1]");
    if (dice(3) == 0) {
      const std::string inner = label();
      put(inner + " if " + condition());
      const bool leaves = dice(2) != 0 && !do_loops_;
      put(name + (at_end || leaves ? " break" : " continue"));
      put(inner + " endif");
    }
    body(depth - 1, 2);
    put(name + (at_end ? test : " endwhile"));
  }

  int label_ = 0;
  int subs_ = 0;
  int repeats_ = 0;
  bool do_loops_ = dice(2) == 0;
  std::string in_sub_;
};

struct Totals {
  std::size_t accepted = 0, refused = 0, motions = 0;
};

template <typename AnyMaker>
Totals compare_programs(unsigned count) {
  Totals totals;
  for (unsigned seed = 1; seed <= count; ++seed) {
    const std::string text = AnyMaker(seed).make();
    const OracleRun oracle = run_oracle(text);
    const Run ours = run(text, oracle_settings());
    INFO("seed " << seed << "\n" << text);
    INFO("rs274: " << oracle.message);
    INFO("ours: " << ours.all_text());
    // rs274 runs on without end when a loop of it is never left.
    if (!oracle.accepted && oracle.message == "executing | ") continue;
    // Our refusals of what rs274 does wrong, or what nothing states: taps outside of G17, counts of
    // loops that were left, cycles that go on in another distance mode.
    const std::string told = ours.all_text();
    if (told.find("goes on in another distance mode") != std::string::npos) continue;
    if (told.find("moves along wrong axes") != std::string::npos) continue;
    if (told.find("goes on with the old count") != std::string::npos) continue;
    REQUIRE(ours.ok == oracle.accepted);
    if (!ours.ok) {
      ++totals.refused;
      continue;
    }
    const Comparison result = compare(ours.sink.motions, oracle);
    INFO(result.problem);
    REQUIRE(result.problem.empty());
    ++totals.accepted;
    totals.motions += result.motions;
  }
  return totals;
}

}  // namespace

TEST_CASE("cycles against rs274: 13 random programs", "[formats][nc][oracle]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  const Totals totals = compare_programs<CycleMaker>(13);
  WARN("cycles: " << totals.accepted << " programs with " << totals.motions
                  << " motions are the same, " << totals.refused << " refused by both");
  CHECK(totals.accepted + totals.refused >= 5);
}

TEST_CASE("flow against rs274: 21 random programs", "[formats][nc][oracle]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  const Totals totals = compare_programs<FlowMaker>(21);
  WARN("flow: " << totals.accepted << " programs with " << totals.motions
                << " motions are the same, " << totals.refused << " refused by both");
  CHECK(totals.accepted >= 20);
}

TEST_CASE("flow against rs274: what continue in a do loop does to the next repeat",
          "[formats][nc][oracle]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  // The manual gives each repeat 3 rounds. rs274 2.9 makes 6 behind `continue` in a do loop, 3
  // behind one in a while loop.
  const std::string rounds = "G91\no3 repeat [3]\nG0 Y1\no3 endrepeat\nM2\n";
  const std::string leave = "o2 if [1]\no1 continue\no2 endif\nG0 X50\n";
  const std::string behind_do = "G21 G90\no1 do\n" + leave + "o1 while [0]\n" + rounds;
  const std::string behind_while =
      "G21 G90\no1 while [#1 EQ 0]\n#1=1\n" + leave + "o1 endwhile\n" + rounds;
  CHECK(run_oracle(behind_while).motions.size() == 3);
  CHECK(run(behind_while, oracle_settings()).sink.motions.size() == 3);
  CHECK(run(behind_do, oracle_settings()).sink.motions.size() == 3);
  const std::size_t theirs = run_oracle(behind_do).motions.size();
  WARN("rs274 makes " << theirs << " rounds of repeat [3] behind a do loop with continue");
  CHECK((theirs == 6 || theirs == 3));  // 3: a later version has mended it
}

TEST_CASE("cycles and flow against rs274: 150 random programs each",
          "[formats][nc][oracle][slow]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  const Totals cycles = compare_programs<CycleMaker>(150);
  const Totals flow = compare_programs<FlowMaker>(150);
  WARN("cycles: " << cycles.accepted << " the same, " << cycles.refused
                  << " refused by both; flow: " << flow.accepted << " the same, " << flow.refused
                  << " refused by both");
  CHECK(cycles.accepted >= 20);
  CHECK(flow.accepted >= 100);
}

}  // namespace smoothpost::test
