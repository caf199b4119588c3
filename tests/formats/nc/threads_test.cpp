#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/formats/nc/recording.h"
#include "tests/formats/nc/rs274_oracle.h"

// Motions that follow the spindle: G33, G33.1, G76.
namespace smoothpost::test {
namespace {

using Codes = std::vector<std::string>;

Run turning(const std::string& lines) {
  return run("G21 G90 F500\nS120 M3\nG0 X10 Y0 Z5\n" + lines + "\nM2\n", mill_settings());
}

std::string number(std::mt19937& random, double from, double to) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.4f",
                std::uniform_real_distribution<double>(from, to)(random));
  return buffer;
}

int dice(std::mt19937& random, int n) {
  return std::uniform_int_distribution<int>(0, n - 1)(random);
}

/// A thread outside or inside, towards or away from the chuck, with tapers and a slide's angle.
std::string thread_program(unsigned seed) {
  std::mt19937 random(seed);
  std::string text = dice(random, 4) ? "G21" : "G20";
  text += dice(random, 2) ? " G18\n" : " G17\n";
  text += "S300 M" + std::to_string(3 + dice(random, 2)) + "\n";
  text += "G0 X" + number(random, -30, 30) + " Y1 Z" + number(random, -5, 5) + "\n";
  if (dice(random, 3) == 0) text += "G91\n";
  text += "G76 P" + number(random, 0.2, 3) + " Z" + number(random, -60, 60) + " I" +
          number(random, -4, 4) + " J" + number(random, 0.05, 1) + " K" + number(random, 0.5, 2);
  if (dice(random, 2)) text += " R" + number(random, 1, 3);
  if (dice(random, 2)) text += " Q" + number(random, -10, 40);
  if (dice(random, 2)) text += " H" + std::to_string(dice(random, 4));
  if (dice(random, 2)) text += " E" + number(random, 0, 2) + " L" + std::to_string(dice(random, 4));
  return text + "\nG90 G0 X50\nM2\n";
}

}  // namespace

TEST_CASE("threads: a straight motion that follows the spindle", "[formats][nc][threads]") {
  const Run r = turning("G33 Z-5 K2\nX12 Z-9 K0.5\nG0 Z5");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 4);
  CHECK(m[0].pitch == 0.0);
  CHECK(m[1].kind == MotionKind::feed);
  CHECK(m[1].pitch == 2.0);
  CHECK(m[1].duration == Approx(10.0 / (2.0 * 2.0)));
  CHECK(m[2].end[0] == 12.0);
  CHECK(m[2].pitch == 0.5);
  CHECK(m[3].pitch == 0.0);
  CHECK(turning("G20 G33 Z-1 K0.1").sink.motions[1].pitch == Approx(2.54));
}

TEST_CASE("threads: a rigid tap comes back by itself", "[formats][nc][threads]") {
  const Run r = turning("G33.1 Z-5 K1.5\nG91 G0 Z1");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 4);
  CHECK(m[1].end[2] == -5.0);
  CHECK(m[1].pitch == 1.5);
  CHECK(m[2].start[2] == -5.0);
  CHECK(m[2].end[2] == 5.0);
  CHECK(m[2].pitch == -1.5);
  CHECK(m[3].end[2] == 6.0);
}

TEST_CASE("threads: the passes of G76", "[formats][nc][threads]") {
  // Depths 1, 1·√2, 2 (the last), then one spring pass; I below 0 cuts from outside.
  const Run r = turning("G76 P1 Z-10 I-3 J1 K1.5 R2 H1");
  INFO(r.all_text());
  REQUIRE(r.ok);
  std::vector<double> cuts;
  for (const CanonicalMotion& m : r.sink.motions) {
    if (m.kind != MotionKind::feed) continue;
    CHECK(m.pitch == 1.0);
    CHECK(m.end[2] == -10.0);
    cuts.push_back(10.0 - 3.0 - m.end[0]);
  }
  REQUIRE(cuts.size() == 4);
  CHECK(cuts[0] == Approx(1.0));
  CHECK(cuts[1] == Approx(std::sqrt(2.0)));
  CHECK(cuts[2] == Approx(1.5));
  CHECK(cuts[3] == Approx(1.5));
  CHECK(r.sink.motions.back().end[0] == Approx(10.0));
}

TEST_CASE("threads: wrong words and states are refused", "[formats][nc][threads]") {
  for (const char* lines : {"G33 Z-5",
                            "G33 Z-5 K0",
                            "G33 Z-5 K-1",
                            "G33 K1",
                            "G33.1 Z-5 K1 A5",
                            "M5\nG33 Z-5 K1",
                            "S0\nG33 Z-5 K1",
                            "G93 G33 Z-5 K1",
                            "G41.1 D1\nG33 X30 K1",
                            "M428\nG33 Z-5 K1",
                            "G76 Z-5 I-3 J1 K2",
                            "G76 P1 Z-5 J1 K2",
                            "G76 P1 Z-5 I-3 K2",
                            "G76 P1 Z-5 I-3 J1 K1",
                            "G76 P1 Z-5 I-3 J1 K2 R0.5",
                            "G76 P1 Z-5 I-3 J1 K2 Q90",
                            "G76 P1 Z-5 I-3 J1 K2 L4 E1",
                            "G76 P1 Z-5 I-3 J1 K2 E-1 L1",
                            "G76 P1 Z-5 I-3 J1 K2 E5 L3",
                            "G76 P1 Z5 I-3 J1 K2",
                            "G76 P1 X5 Z-5 I-3 J1 K2",
                            "M5\nG76 P1 Z-5 I-3 J1 K2",
                            "G10 L2 P1 R10\nG76 P1 Z-5 I-3 J1 K2"}) {
    const Run r = turning(lines);
    INFO(lines << "\n" << r.all_text());
    CHECK(r.errors() == Codes{"NC266"});
  }
  CHECK(turning("G33.1 Z-5 K1 I2").errors() == Codes{"NC215"});
  CHECK(turning("G53 G33 Z-5 K1").errors() == Codes{"NC216"});
  CHECK(turning("G76 P1 Z-5 I-3 J0.000001 K2 R9").errors() == Codes{"NC252"});
  nc::InterpreterSettings plain = mill_settings();
  plain.plain_blocks = true;
  CHECK(run("G21\nS1 M3\nG33 Z1 K1\nM2\n", plain).errors() == Codes{"NC202"});
  CHECK(run("G21\nG33 Z1. F1.\nM30\n", mill_settings(), nc::InputDialect::fanuc).errors().front() ==
        "NC202");
}

TEST_CASE("threads: feeds by the turn", "[formats][nc][threads]") {
  const Run r = turning("G95 F0.5\nG1 X20\nS240\nG2 X30 I5\nG0 X0\nG94 F600\nG1 X10");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 5);
  CHECK(m[1].pitch == 0.5);
  CHECK(m[1].duration == Approx(10.0 / (0.5 * 2.0)));
  CHECK(m[2].pitch == 0.5);
  CHECK(m[2].duration == Approx(5.0 * kPi / (0.5 * 4.0)));
  CHECK(m[3].pitch == 0.0);
  CHECK(m[4].pitch == 0.0);
  CHECK(m[4].duration == Approx(1.0));
  CHECK(turning("G20 G95\nF0.01 G1 X1").sink.motions.back().pitch == Approx(0.254));
  const Run print = turning("G95 F0.5\n(PRINT,#<_feed> #<_units_per_rev> #<_units_per_minute>)");
  CHECK(print.sink.comments == Codes{"PRINT,0.500000 1.000000 0.000000"});
  for (const char* lines : {"G95\nG1 X20", "G95 F1\nG95\nG1 X20", "G95 F1\nG94\nG1 X20",
                            "M5\nG95 F1\nG1 X20", "S0\nG95 F1\nG1 X20"}) {
    INFO(lines);
    CHECK(turning(lines).errors() == Codes{"NC213"});
  }
  CHECK(turning("G95 F1\nG5 X30 I5 P5 Q0 J0").errors() == Codes{"NC262"});
}

TEST_CASE("threads: against rs274 in 150 random threads", "[formats][nc][threads][oracle]") {
  if (!oracle_present()) {
    WARN("rs274 is not installed: skipped");
    return;
  }
  std::size_t same = 0, motions = 0, stricter = 0;
  for (unsigned seed = 1; seed <= 150; ++seed) {
    const std::string text = thread_program(seed);
    const OracleRun oracle = run_oracle(text);
    const Run ours = run(text, oracle_settings());
    INFO("seed " << seed << "\n"
                 << text << "rs274: " << oracle.message << "\nours: " << ours.all_text());
    if (!oracle.accepted) {
      CHECK_FALSE(ours.ok);
      continue;
    }
    if (!ours.ok) {  // tapers longer than the thread, which LinuxCNC cuts to and fro
      CHECK(ours.errors() == Codes{"NC266"});
      ++stricter;
      continue;
    }
    const Comparison result = compare(ours.sink.motions, oracle);
    INFO(result.problem);
    CHECK(result.problem.empty());
    ++same;
    motions += result.motions;
  }
  WARN("threads compared with rs274: " << same << " the same in " << motions << " motions, "
                                       << stricter << " refused by us only");
  CHECK(same >= 80);
  CHECK(stricter <= 20);
}

}  // namespace smoothpost::test
