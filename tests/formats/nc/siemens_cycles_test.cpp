#include "formats/nc/siemens_cycles.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "formats/nc/number_text.h"
#include "tests/formats/nc/recording.h"

// Drilling cycles and hole patterns of Sinumerik programs.
namespace smoothpost::test {
namespace {

using Codes = std::vector<std::string>;
using Texts = std::vector<std::string>;

Run siemens(const std::string& lines) {
  return run("G17 G0 X0 Y0 Z50 F600 S500 M3\n" + lines + "\nM30\n", mill_settings(),
             nc::InputDialect::siemens);
}

/// What the lines do behind the start: motions as kind, X, Z; dwells; events.
Texts acts(const std::string& lines) {
  const Run r = siemens(lines);
  INFO(lines << "\n" << r.all_text());
  REQUIRE(r.ok);
  Texts out;
  std::size_t call = 0;
  const auto calls_up_to = [&](std::size_t motions) {
    for (; call < r.sink.calls.size() && r.sink.calls[call].motions_before <= motions; ++call) {
      const Call& c = r.sink.calls[call];
      if (c.kind == "dwell") out.push_back("dwell " + nc::decimal_text(c.number, 3));
      if (c.kind == "event") out.push_back(c.text);
    }
  };
  for (std::size_t i = 0; i < r.sink.motions.size(); ++i) {
    calls_up_to(i);
    if (i == 0) {
      out.clear();
      continue;
    }
    const CanonicalMotion& m = r.sink.motions[i];
    out.push_back((m.kind == MotionKind::feed ? "f" : "r") + nc::decimal_text(m.end[0], 3) + " " +
                  nc::decimal_text(m.end[2], 3));
  }
  calls_up_to(r.sink.motions.size());
  return out;
}

Codes errors(const std::string& lines) { return siemens(lines).errors(); }

}  // namespace

TEST_CASE("siemens: the steps of the drilling cycles", "[formats][nc][siemens]") {
  CHECK(acts("CYCLE81(20,1,2,-5)") == Texts{"r0 3", "f0 -5", "r0 20"});
  CHECK(acts("DEF REAL V_[2,2]=SET(1,2,3,-5)\nCYCLE81(10*V_[0,1],V_[0,0],2,V_[1,1])") ==
        Texts{"r0 3", "f0 -5", "r0 20"});
  CHECK(acts("CYCLE82(20,1,2,,6,0.5)") == Texts{"r0 3", "f0 -5", "dwell 0.5", "r0 20"});
  // Chip breaking: lifts by 1 mm, or VRT, with the feed.
  CHECK(acts("CYCLE83(20,0,2,-25,,-10,,0,0.1,,1,0)") ==
        Texts{"r0 2", "f0 -10", "dwell 0.1", "f0 -9", "f0 -20", "dwell 0.1", "f0 -19", "f0 -25",
              "dwell 0.1", "r0 20"});
  CHECK(acts("CYCLE83(20,0,2,-15,,,10,0,,,1,0,,,2.5)") ==
        Texts{"r0 2", "f0 -10", "f0 -7.5", "f0 -15", "r0 20"});
  // Removal of chips: out to RFP + SDIS, dwell DTS, back to above the last depth.
  CHECK(acts("CYCLE83(20,0,2,-25,,-10,,0,0.1,0.2,1,1)") ==
        Texts{"r0 2", "f0 -10", "dwell 0.1", "r0 2", "dwell 0.2", "r0 -9.4", "f0 -20", "dwell 0.1",
              "r0 2", "dwell 0.2", "r0 -19.4", "f0 -25", "dwell 0.1", "r0 20"});
  CHECK(acts("CYCLE83(20,0,2,-50,,-40,,0,,,1,1)")[3] == "r0 -39");  // 50 mm / 50
  CHECK(acts("CYCLE83(20,0,2,-50,,-40,,0,,,1,1,,,,,5)")[3] == "r0 -35");
  CHECK(acts("CYCLE83(20,0,2,-12,,-10,,0,,,1,1,,,,,30)")[3] ==
        "f0 -12");  // not above the clearance
  CHECK(acts("CYCLE83(20,0,2,-12,,-12,,0,0.1,,1,0,,,,0.7)") ==
        Texts{"r0 2", "f0 -12", "dwell 0.7", "r0 20"});
  CHECK(acts("CYCLE85(20,0,2,-5,,0.3,100,200)") ==
        Texts{"r0 2", "f0 -5", "dwell 0.3", "f0 2", "r0 20"});
  CHECK(acts("CYCLE87(20,0,2,-5,,3)") == Texts{"r0 2", "f0 -5", "spindle_off", "stop", "r0 20"});
  CHECK(acts("CYCLE88(20,0,2,-5,,0.3,4)") == Texts{"r0 2", "spindle_on_reverse rpm=500", "f0 -5",
                                                   "dwell 0.3", "spindle_off", "stop", "r0 20"});
  CHECK(acts("CYCLE89(20,0,2,-5,,0.3)") == Texts{"r0 2", "f0 -5", "dwell 0.3", "f0 2", "r0 20"});
  // Without encoder the tap follows by a compensating holder.
  CHECK(acts("CYCLE840(20,0,2,-5,,,4,3,1)") == Texts{"r0 2", "f0 -5", "spindle_on_reverse rpm=500",
                                                     "f0 2", "spindle_on rpm=500", "r0 20"});
}

TEST_CASE("siemens: feeds of the drilling cycles", "[formats][nc][siemens]") {
  const auto duration = [](const std::string& cycle, std::size_t motion) {
    const Run r = siemens(cycle);
    INFO(r.all_text());
    REQUIRE(r.ok);
    return r.sink.motions.at(motion).duration;
  };
  // F is 600 mm/min.
  CHECK(duration("CYCLE81(20,0,2,-8)", 2) == Approx(1.0));
  CHECK(duration("CYCLE85(20,0,2,-8,,,100,200)", 2) == Approx(10.0 / 100.0 * 60.0));
  CHECK(duration("CYCLE85(20,0,2,-8,,,100,200)", 3) == Approx(10.0 / 200.0 * 60.0));
  CHECK(duration("CYCLE83(20,0,2,-18,,-8,,0,,,0.5,0)", 2) == Approx(2.0));  // FRF: the first only
  CHECK(duration("CYCLE83(20,0,2,-18,,-8,,0,,,0.5,0)", 4) == Approx(0.9));
  CHECK(duration("CYCLE85(20,0,2,-8,,,100,200)\nG1 X10", 5) == Approx(1.0));
}

TEST_CASE("siemens: CYCLE86 orients the spindle at the depth", "[formats][nc][siemens]") {
  CHECK(errors("CYCLE86(20,0,2,-5,,,3,0,0,0,0)") == Codes{"PR101"});  // no row with M19
  nc::InterpreterSettings settings = mill_settings();
  EventWords words;
  words.event = "spindle_orient";
  words.text = "M19";
  settings.process.events.push_back(words);
  const Run r = run("G0 X0 Y0 Z50 F600 S500\nCYCLE86(20,0,2,-5,,,3,0,0,0,0)\nM30\n", settings,
                    nc::InputDialect::siemens);
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.event_texts() == Texts{"spindle_on rpm=500", "spindle_orient"});
  CHECK(r.sink.motions.size() == 5);
  CHECK(errors("CYCLE86(20,0,2,-5,,,3,1,0,0,0)") == Codes{"NC260"});
}

TEST_CASE("siemens: strokes of CYCLE83", "[formats][nc][siemens]") {
  using Depths = std::vector<double>;
  CHECK(nc::peck_depths(25, 10, 0, 0) == Depths{10, 20, 25});
  CHECK(nc::peck_depths(10, 10, 0, 0) == Depths{10});
  // 50, 30, then 20 each; what is left at most two of them is halved.
  CHECK(nc::peck_depths(150, 50, 20, 0) == Depths{50, 80, 100, 120, 135, 150});
  CHECK(nc::peck_depths(100, 10, 20, 0) == Depths{10, 30, 50, 70, 85, 100});
  CHECK(nc::peck_depths(30, 16, -0.5, 4) == Depths{16, 24, 28, 30});
  CHECK(nc::peck_depths(1e9, 1e-3, 0, 0).empty());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> length(0.5, 100.0);
  for (int i = 0; i < 500; ++i) {
    const double total = length(random) + 1.0;
    const double first = std::min(total, length(random));
    const double less = length(random) * 0.2;
    const auto depths = nc::peck_depths(total, first, less, 0.0);
    REQUIRE_FALSE(depths.empty());
    CHECK(depths.front() == first);
    CHECK(depths.back() == total);
    for (std::size_t k = 1; k < depths.size(); ++k) {
      const double stroke = depths[k] - depths[k - 1];
      CHECK(stroke > 0.0);
      CHECK(stroke <= std::max(less, first - less) + 1e-9);
      // The last of the first kind may be shorter; the others are above half of DAM.
      if (k + 1 < depths.size()) CHECK(stroke > 0.5 * less - 1e-9);
    }
  }
}

TEST_CASE("siemens: rows and circles of holes", "[formats][nc][siemens]") {
  const auto places = [](const std::string& lines) {
    const Run r = siemens(lines);
    INFO(lines << "\n" << r.all_text());
    REQUIRE(r.ok);
    std::vector<Vec3> out;
    for (const CanonicalMotion& m : r.sink.motions)
      if (m.kind == MotionKind::feed) out.emplace_back(m.end[0], m.end[1], m.end[2]);
    return out;
  };
  const auto row = places("X-100 Y0\nMCALL CYCLE81(20,0,2,-5)\nHOLES1(10,20,30,5,8,4)\nMCALL\nX0");
  REQUIRE(row.size() == 4);
  for (int k = 0; k < 4; ++k) {
    const double reach = 5.0 + 8.0 * k;
    CHECK((row[static_cast<std::size_t>(k)] -
           Vec3(10 + reach * std::cos(kPi / 6), 20 + reach * std::sin(kPi / 6), -5))
              .norm() < 1e-9);
  }
  // From the nearer end.
  const auto back = places("X200 Y200\nMCALL CYCLE81(20,0,2,-5)\nHOLES1(10,20,30,5,8,4)");
  for (std::size_t k = 0; k < 4; ++k) CHECK((back[k] - row[3 - k]).norm() < 1e-9);
  const auto circle = places("MCALL CYCLE81(20,0,2,-5)\nHOLES2(10,20,15,90,0,3)");
  REQUIRE(circle.size() == 3);
  for (int k = 0; k < 3; ++k) {
    const double angle = kPi / 2 + k * 2 * kPi / 3;
    CHECK((circle[static_cast<std::size_t>(k)] -
           Vec3(10 + 15 * std::cos(angle), 20 + 15 * std::sin(angle), -5))
              .norm() < 1e-9);
  }
  CHECK(places("MCALL CYCLE81(20,0,2,-5)\nHOLES2(0,0,10,0,10,2)")[1].y() ==
        Approx(10 * std::sin(kPi / 18)));
  // Without a cycle only the places are gone to.
  CHECK(acts("HOLES1(5,0,0,0,10,3)") == Texts{"r5 50", "r15 50", "r25 50"});
  // Positions in a subprogram.
  const Run r =
      run("G0 X0 Y0 Z50 F600\nMCALL CYCLE81(20,0,2,-5)\nL5\nMCALL\nM30\n%_N_L5_SPF\n"
          "X10\nX20\nM17\n",
          mill_settings(), nc::InputDialect::siemens);
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions.size() == 9);
}

TEST_CASE("siemens: cycles that are refused", "[formats][nc][siemens]") {
  const char* const wrong[] = {"CYCLE84(20,0,2,-5,,,3,8,,0,500,500)",  // rigid tapping
                               "CYCLE840(20,0,2,-5,,,0,3,0,8)",        // with encoder
                               "CYCLE840(20,0,2,-5,,,4,3,1,8)",        // with pitch
                               "CYCLE840(20,0,2,-5,,,3,3,1)",
                               "CYCLE83(20,0,2,-25,,,,0)",         // no first depth
                               "CYCLE83(20,0,2,-25,,-30,,0)",      // below the depth
                               "CYCLE83(20,0,2,-25,,-10,12,0)",    // two first depths
                               "CYCLE83(20,0,2,-25,,-10,,-0.5)",   // no MDEP
                               "CYCLE83(20,0,2,-25,,-10,,0,-1)",   // turns of the spindle
                               "CYCLE83(20,0,2,-25,,-10,,0,,,2)",  // FRF
                               "CYCLE83(20,0,2,-25,,-10,,0,,,1,2)",
                               "CYCLE83(20,0,2,-25,,-10,,0,,,1,0,1)",
                               "CYCLE83(20,0,2,-25,,-10,,0,,,1,0,,,,,,1)",
                               "CYCLE85(20,0,2,-5)",
                               "CYCLE87(20,0,2,-5)",
                               "CYCLE88(20,0,2,-5,,,7)",
                               "CYCLE89(20,0,2,5)",
                               "CYCLE89(1,0,2,-5)",
                               "HOLES1(0,0,0,0,1,1.5)",
                               "HOLES2(0,0,0,0,1,3)",
                               "HOLES1(0,0,0,-1,1,3)",
                               "CYCLE81(20,0,2,-5 6)"};
  for (const char* line : wrong) {
    INFO(line);
    CHECK(errors(line) == Codes{"NC260"});
  }
  CHECK(errors("MCALL HOLES1(0,0,0,0,1,3)") == Codes{"NC140", "NC200"});
  CHECK(errors("CYCLE801(0,0,0,0,1,3)") == Codes{"NC140", "NC200"});
  CHECK(errors("M4\nCYCLE840(20,0,2,-5,,,4,3,1)") == Codes{"NC261"});
  CHECK(errors("CYCLE83(20,0,2,-2000,,-0.001,,0)") == Codes{"NC260"});
  CHECK(errors("FOR R1=1 TO 1000\nCYCLE83(20,0,2,-900,,-0.1,,0)\nENDFOR") == Codes{"NC252"});
}

}  // namespace smoothpost::test
