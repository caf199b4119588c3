#include <catch2/catch.hpp>
#include <cmath>

#include "tests/formats/nc/recording.h"

// Offsets as LinuxCNC 2.9 computes them; the numbers of the rotated cases were printed by rs274.
namespace smoothpost::test {
namespace {

const CanonicalMotion& last(const Run& run) { return run.sink.motions.back(); }
std::vector<std::string> one(const char* code) { return {code}; }

}  // namespace

TEST_CASE("offsets: work systems", "[formats][nc][offsets]") {
  nc::InterpreterSettings settings;
  settings.work_offsets[1].words = {10, 20, 30};
  settings.work_offsets[9].words = {1, 0, 0, radians_from_degrees(90)};
  const Run r = run_lines("G0 X1 Y1 Z1\nG59.3 X1 A0\nG54 X2\nG55 X3", settings);
  REQUIRE(r.ok);
  CHECK(r.sink.motions[0].end[0] == 11.0);
  CHECK(r.sink.motions[1].end[0] == 2.0);
  CHECK(r.sink.motions[1].end[3] == Approx(kPi / 2));
  CHECK(r.sink.motions[1].end[1] == 21.0);  // the machine stays where it is
  CHECK(r.sink.motions[3].end[0] == 3.0);
  CHECK(r.summary.work_systems == std::vector<int>{1, 9, 2});
  const auto offsets = r.sink.of("work_offset");
  REQUIRE(offsets.size() == 4);
  CHECK(offsets[0].point == Vec3(10, 20, 30));
  CHECK(offsets[0].integer == 1);
  CHECK(offsets[0].motions_before == 0);
  CHECK(offsets[1].integer == 9);
  CHECK(offsets[1].line == 2);
}

TEST_CASE("offsets: told before the first motion and on each change only",
          "[formats][nc][offsets]") {
  const Run r = run_lines("G55\nG54\nG0 X1\nG54 X2\nG52 X3\nG52 X4\nX1\nG92.1\nM2");
  const auto offsets = r.sink.of("work_offset");
  REQUIRE(offsets.size() == 2);
  CHECK(offsets[1].point == Vec3(4, 0, 0));
  CHECK(offsets[1].motions_before == 2);
}

TEST_CASE("offsets: G52 and G92 are one shift", "[formats][nc][offsets]") {
  // rs274: G52 X1 at X0, then G92 X5: offset -4.
  const Run r =
      run_lines("G0 X1\nG52 X1\nG0 X0\nG92 X5\nG0 X6\nG92.2\nG0 X6\nG92.3 X6\nG92.1\nG92.3 X6");
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  CHECK(m[1].end[0] == 1.0);
  CHECK(m[2].end[0] == 2.0);
  CHECK(m[3].end[0] == 6.0);
  CHECK(m[4].end[0] == 2.0);
  CHECK(m[5].end[0] == 6.0);
  CHECK(run_lines("G92").errors() == one("NC219"));
  CHECK(run_lines("G52").errors() == one("NC219"));
}

TEST_CASE("offsets: G92 on rotary words", "[formats][nc][offsets]") {
  const Run r = run_lines("G0 X1 A10\nG92 A0\nG0 A5");
  CHECK(degrees(last(r).end[3]) == Approx(15.0));
}

TEST_CASE("offsets: G92 where the program does not say the position", "[formats][nc][offsets]") {
  nc::InterpreterSettings settings;
  settings.home[0] = 100.0;
  const Run r = run_lines("G92 X0 Y0\nG0 X5", settings);
  CHECK(r.ok);
  CHECK(r.has("NC228"));
  CHECK(r.all_text().find("X Y") != std::string::npos);
  CHECK(last(r).end[0] == 105.0);
  CHECK_FALSE(run_lines("G0 X0\nG92 X5").has("NC228"));
}

TEST_CASE("offsets: G10 L2 and XY rotation", "[formats][nc][offsets]") {
  const Run r = run_lines("G10 L2 P1 X3 Y4 R90\nG0 X5 Y1\nX6");
  CHECK(r.sink.motions[0].end[0] == Approx(2.0));
  CHECK(r.sink.motions[0].end[1] == Approx(9.0));
  CHECK(last(r).end[1] == Approx(10.0));
  CHECK(r.sink.of("work_offset").at(0).number == Approx(kPi / 2));
  // A word that the rotation mixes with an unknown one is unknown.
  const Run half = run_lines("G10 L2 P1 R30\nG0 X5\nY1\nG0 X1 Y1");
  CHECK((half.sink.motions[0].unknown_end & 3) == 3);
  CHECK((half.sink.motions[2].unknown_end & 3) == 0);
  CHECK(run_lines("G10 L2 P10 X1").errors() == one("NC218"));
  CHECK(run_lines("G10 L2 X1").errors() == one("NC218"));
  CHECK(run_lines("G10 X1").errors() == one("NC218"));
  CHECK(run_lines("G10 L1 Z5").errors() == one("NC218"));
  CHECK(run_lines("G10 L1 P1 X5").errors() == one("NC218"));
  CHECK(run_lines("G10 L11 P0 Z5").errors() == one("NC218"));
  CHECK(run_lines("G10 L3 P1 Z5").errors() == one("NC218"));
  CHECK(run_lines("G10 L20 P1 X0 R30").errors() == one("NC218"));
  CHECK(run_lines("G10 L2 P1 I3").errors() == one("NC215"));
  CHECK(run_lines("G91 G10 L2 P1 X3\nG10 L2 P0 X1\nG90 G0 X1").sink.motions.back().end[0] == 2.0);
}

TEST_CASE("offsets: G10 L20, numbers of rs274", "[formats][nc][offsets]") {
  const Run r = run_lines(
      "G10 L2 P1 X3 Y4 R30\nG43.1 Z7\nG0 X5 Y1 Z9\nG52 X2 Y2 Z2\nG10 L20 P1 X0 Z1\nG0 X1\n"
      "G10 L20 P2 X0 Y0 Z0\nG55 G0 X0 Y0 Z0");
  REQUIRE(r.ok);
  const auto offsets = r.sink.of("work_offset");
  // rs274 prints the origin without the shift: 5.5981 5.5 6, then 5.6962 5.8660 7; the shift is 2
  // 2 2.
  const double c = std::cos(kPi / 6), s = 0.5;
  CHECK(offsets.at(1).point.isApprox(Vec3(5.5981 + 2 * c - 2 * s, 5.5 + 2 * s + 2 * c, 8), 1e-5));
  CHECK(offsets.at(2).point.isApprox(Vec3(7.6962, 7.8660, 9), 1e-5));
  // The last motion goes to the point where it already was.
  CHECK((Vec3(last(r).start[0], last(r).start[1], last(r).start[2]) -
         Vec3(last(r).end[0], last(r).end[1], last(r).end[2]))
            .norm() < 1e-9);
}

TEST_CASE("offsets: offsets in inches", "[formats][nc][offsets]") {
  const Run r = run_lines("G20 G10 L2 P1 X1\nG52 Y1\nG0 X1 Y1");
  CHECK(last(r).end[0] == Approx(50.8));
  CHECK(last(r).end[1] == Approx(50.8));
}

}  // namespace smoothpost::test
