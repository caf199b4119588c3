#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <random>

#include "tests/formats/nc/recording.h"
#include "tests/formats/nc/rs274_oracle.h"

// Cutter radius compensation against LinuxCNC's interpreter, by random contours.
namespace smoothpost::test {
namespace {

/// A contour of lines and arcs under compensation, with the way onto it and off it.
class ContourMaker {
 public:
  explicit ContourMaker(unsigned seed) : random_(seed) {}

  std::string make() {
    xz_ = dice(3) == 0;
    unit_ = dice(4) == 0 ? 25.4 : 1.0;
    const double diameter = 0.2 + 3.0 * share();
    text_ =
        std::string(unit_ > 1.0 ? "G20" : "G21") + " G90 G94 F600 " + (xz_ ? "G18" : "G17") + "\n";
    text_ += "G0 X0 Y0 Z0\nS100 M3\n";
    if (!xz_ && dice(6) == 0) text_ += "G10 L2 P1 X3 Y4 R" + digits(360.0 * share()) + "\n";
    put("G0", step(6.0));
    const char* side = dice(2) ? "G41" : "G42";
    if (dice(5) == 0) {
      text_ += std::string(side) + " D1\n";
    } else {
      text_ += std::string(side) + ".1 D" + digits((dice(6) ? 1 : -1) * diameter / unit_) +
               (xz_ && dice(3) == 0 ? " L" + std::to_string(dice(10)) : "") + "\n";
    }
    if (dice(4) == 0) {
      text_ += "G91\n";
      incremental_ = true;
    }
    if (dice(5) == 0) {
      arc(true);
    } else {
      put("G1", step(4.0 + 6.0 * share()));
    }
    const int elements = 1 + dice(6);
    for (int i = 0; i < elements; ++i) element();
    text_ += dice(8) ? "G40\n" : "";
    if (dice(8)) put(dice(2) ? "G1" : "G0", step(5.0));
    if (dice(4) == 0) put_third(-1.0);
    return text_ + "M2\n";
  }

  /// What an element is after another one: a chosen turn in place of a random one.
  void element() {
    switch (dice(12)) {
      case 0:
        return put_third(2.0 * share());
      case 1:
        return put("G0", step(length()));
      case 2:
        text_ += dice(2) ? "(note)\n" : "G4 P0.5\n";
        return;
      case 3:
      case 4:
      case 5:
      case 6:
        return arc(false);
      default:
        return put("G1", step(length()));
    }
  }

 private:
  int dice(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  double share() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
  double length() { return dice(4) == 0 ? 0.3 + share() : 2.0 + 10.0 * share(); }

  std::string digits(double value) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.6f", value);
    return buffer;
  }

  /// The direction of the next element.
  double direction() {
    constexpr double kQuarter = 1.5707963267948966;
    switch (dice(8)) {
      case 0:
        return heading_;  // tangent
      case 1:
        return heading_ + (share() - 0.5) * 0.2;
      case 2:
        return heading_ + 2.0 * kQuarter + (share() - 0.5) * 0.2;  // about turn
      case 3:
        return heading_ + (dice(4) - 1) * kQuarter;
      default:
        return heading_ + 4.0 * kQuarter * share();
    }
  }

  std::array<double, 2> step(double size) {
    heading_ = direction();
    return {size * std::cos(heading_), size * std::sin(heading_)};
  }

  std::string words(double first, double second) {
    return (xz_ ? " Z" : " X") + digits(first) + (xz_ ? " X" : " Y") + digits(second);
  }

  std::string place(const std::array<double, 2>& by) {
    first_ += by[0] / unit_;
    second_ += by[1] / unit_;
    if (incremental_) return words(by[0] / unit_, by[1] / unit_);
    return words(first_, second_);
  }

  void put(const std::string& code, const std::array<double, 2>& by) {
    std::string line = code + place(by);
    if (code == "G1" && dice(10) == 0) line = "G93 " + line + " F" + digits(20.0 + 30.0 * share());
    if (dice(12) == 0) line += (xz_ ? " Y" : " Z") + digits(share());
    text_ += line + "\n" + (line[1] == '9' ? "G94 F500\n" : "");
  }

  void put_third(double value) {
    text_ += std::string("G1") + (xz_ ? " Y" : " Z") + digits(value) + "\n";
  }

  void arc(bool entry) {
    heading_ = direction();
    const double radius = dice(4) == 0 ? 0.2 + 2.0 * share() : 2.0 + 8.0 * share();
    const double sense = dice(2) ? 1.0 : -1.0;
    const double turn = entry           ? 0.6 + 2.0 * share()
                        : dice(10) == 0 ? 6.283185307179586
                                        : 0.1 + 5.8 * share();
    const double to_centre = heading_ + sense * 1.5707963267948966;
    const double i = radius * std::cos(to_centre), j = radius * std::sin(to_centre);
    const double spoke = to_centre + 3.141592653589793 + sense * turn;
    const std::string code = sense > 0.0 ? "G3" : "G2";
    std::string line = code + place({i + radius * std::cos(spoke), j + radius * std::sin(spoke)});
    if (turn < 6.0 && std::abs(turn - 3.1416) > 0.1 && dice(8) == 0) {
      line += " R" + digits((turn < 3.1416 ? radius : -radius) / unit_);
    } else {
      line += (xz_ ? " K" : " I") + digits(i / unit_) + (xz_ ? " I" : " J") + digits(j / unit_);
    }
    if (dice(8) == 0) line += (xz_ ? " Y" : " Z") + digits(share());
    if (dice(10) == 0) line += " P" + std::to_string(1 + dice(3));
    if (dice(10) == 0) line = "G93 " + line + " F" + digits(20.0 + 30.0 * share());
    text_ += line + "\n" + (line[1] == '9' ? "G94 F500\n" : "");
    heading_ += sense * turn;
  }

  std::mt19937 random_;
  std::string text_;
  bool xz_ = false;
  bool incremental_ = false;
  double unit_ = 1.0;
  double heading_ = 0.3;
  double first_ = 0.0;
  double second_ = 0.0;
};

struct Tally {
  std::size_t same = 0, both_refuse = 0, stricter = 0, motions = 0, arcs = 0, times = 0;
  std::map<std::string, std::size_t> reasons;  ///< of rs274
};

/// Settings in which tool 1 has the diameter of the oracle's table.
std::string with_tool(const std::string& text) { return "G20\nG10 L1 P1 R0.05\nG21\n" + text; }

Tally compare_contours(unsigned first, unsigned count) {
  Tally tally;
  for (unsigned seed = first; seed < first + count; ++seed) {
    const std::string text = ContourMaker(seed).make();
    const OracleRun oracle = run_oracle(text);
    const Run ours = run(with_tool(text), oracle_settings());
    INFO("seed " << seed << "\n" << text);
    INFO("rs274: " << oracle.message);
    INFO("ours: " << ours.all_text());
    // LinuxCNC does not look at the way back before an outside corner to an arc, nor at the side
    // that an arc onto the contour is run from, and moves its centre by a lathe tool's nose.
    const std::string refusal = ours.all_text();
    if (!ours.ok && oracle.accepted &&
        (refusal.find("corner at the end of this") != std::string::npos ||
         refusal.find("no arc of this sense") != std::string::npos ||
         refusal.find("first motion of a lathe tool") != std::string::npos)) {
      ++tally.stricter;
      continue;
    }
    REQUIRE(ours.ok == oracle.accepted);
    if (!ours.ok) {
      ++tally.both_refuse;
      const std::size_t from = oracle.message.find(" | ") + 3;  // behind "executing"
      ++tally.reasons[oracle.message.substr(from, oracle.message.find(" | ", from) - from)];
      continue;
    }
    const Comparison result = compare(ours.sink.motions, oracle);
    INFO(result.problem);
    REQUIRE(result.problem.empty());
    ++tally.same;
    tally.motions += result.motions;
    tally.arcs += result.arcs;
    tally.times += result.times;
  }
  return tally;
}

void tell(const Tally& tally) {
  std::string reasons;
  for (const auto& [reason, count] : tally.reasons)
    reasons += "\n  " + std::to_string(count) + ": " + reason;
  WARN("contours under compensation: " << tally.same << " the same in " << tally.motions
                                       << " motions, " << tally.arcs << " arcs, " << tally.times
                                       << " durations; refused by us only " << tally.stricter
                                       << ", by both " << tally.both_refuse << reasons);
}

}  // namespace

TEST_CASE("radius against rs274: random contours", "[formats][nc][radius][oracle]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  const Tally tally = compare_contours(1, 400);
  tell(tally);
  CHECK(tally.same >= 220);
  CHECK(tally.arcs >= 400);
  CHECK(tally.stricter <= 40);
}

TEST_CASE("radius against rs274: many random contours", "[formats][nc][radius][oracle][slow]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  const Tally tally = compare_contours(1001, 2000);
  tell(tally);
  CHECK(tally.same >= 1000);
  CHECK(tally.stricter <= 200);
}

}  // namespace smoothpost::test
