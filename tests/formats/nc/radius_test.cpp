#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "formats/nc/number_text.h"
#include "tests/formats/nc/recording.h"

// Cutter radius compensation, judged by the distance of the tool's centre from the contour.
namespace smoothpost::test {
namespace {

using Codes = std::vector<std::string>;

constexpr int kLinesBefore = 3;

Run compensated(const std::string& lines) {
  return run("G21 G90 G17 G94 F600\nG10 L1 P3 R2\nG0 X0 Y0 Z5\n" + lines + "\nM2\n",
             mill_settings());
}

Vec3 point_of(const CanonicalMotion& m, double s) {
  const Vec3 start(m.start[0], m.start[1], m.start[2]);
  const Vec3 end(m.end[0], m.end[1], m.end[2]);
  if (!m.is_arc) return start + s * (end - start);
  const Vec3 spoke = start - m.arc.centre;
  return m.arc.centre + rotation_about(m.arc.normal, s * m.arc.sweep) * spoke;
}

/// The least distance of a point from the motions of a run in XY.
double distance_to(const std::vector<CanonicalMotion>& contour, const Vec3& point) {
  double least = 1e9;
  for (const CanonicalMotion& m : contour) {
    Vec3 last = point_of(m, 0.0);
    const int pieces = m.is_arc ? 400 : 1;
    for (int k = 1; k <= pieces; ++k) {
      const Vec3 next = point_of(m, static_cast<double>(k) / pieces);
      const Vec3 way = (next - last).cwiseProduct(Vec3(1, 1, 0));
      const Vec3 to = (point - last).cwiseProduct(Vec3(1, 1, 0));
      const double s =
          way.squaredNorm() > 0.0 ? std::clamp(to.dot(way) / way.squaredNorm(), 0.0, 1.0) : 0.0;
      least = std::min(least, (to - s * way).norm());
      last = next;
    }
  }
  return least;
}

}  // namespace

TEST_CASE("radius: the centre keeps the radius from the contour", "[formats][nc][radius]") {
  // Inside and outside corners of lines and arcs, clockwise and not.
  const std::string contour =
      "G1 X10 Y0\nX30\nY20\nG3 X20 Y30 I-10 J0\nG1 X16\nG2 X10 Y36 I0 J6\nG1 X-10\nX-4 Y20\nX-10 "
      "Y4\n";
  for (const char* on : {"G41.1 D4", "G42.1 D4", "G41 D3", "G42.1 D-4"}) {
    const Run plain = compensated(contour);
    const Run r = compensated(std::string(on) + "\n" + contour + "G40\nG0 X-40 Y0");
    INFO(on << "\n" << r.all_text());
    REQUIRE(r.ok);
    CHECK(r.has("NC265"));
    const auto& motions = r.sink.motions;
    double closest = 1e9;
    double farthest = 0.0;
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (i > 0) {
        const Vec3 jump = point_of(motions[i], 0.0) - point_of(motions[i - 1], 1.0);
        CHECK(jump.norm() < 1e-9);
      }
      if (i < 2 || i + 1 == motions.size()) continue;  // the ways on and off
      for (double s = 0.0; s <= 1.0; s += 0.125) {
        const double distance = distance_to(plain.sink.motions, point_of(motions[i], s));
        closest = std::min(closest, distance);
        farthest = std::max(farthest, distance);
      }
    }
    CHECK(closest > 2.0 - 1e-3);
    CHECK(farthest < 2.0 * std::sqrt(2.0) + 1e-3);
    CHECK(motions.back().end[0] == -40.0);
  }
}

TEST_CASE("radius: a square and its speeds", "[formats][nc][radius]") {
  const Run r = compensated("G42.1 D2\nG1 X10\nY10\nZ0\nX0\nG40\nG0 X0 Y20");
  INFO(r.all_text());
  REQUIRE(r.ok);
  std::vector<std::string> places;
  for (const CanonicalMotion& m : r.sink.motions)
    places.push_back((m.is_arc ? "a " : "") + nc::decimal_text(m.end[0], 3) + " " +
                     nc::decimal_text(m.end[1], 3) + " " + nc::decimal_text(m.end[2], 3));
  CHECK(places == std::vector<std::string>{"0 0 5", "10 -1 5", "a 11 0 5", "11 10 5", "11 10 0",
                                           "a 10 11 0", "0 11 0", "0 20 0"});
  CHECK(r.sink.motions[1].duration == Approx(std::hypot(10.0, 1.0) / 10.0));
  CHECK(r.sink.motions[2].duration == Approx(0.5 * kPi / 10.0));
  CHECK(r.sink.motions[3].duration == Approx(1.0));
  const Run inside = compensated("G41.1 D2\nG1 X10\nY10\nG40\nG0 X5 Y20");
  REQUIRE(inside.ok);
  CHECK(inside.sink.motions[1].end[0] == Approx(9.0));
  CHECK(inside.sink.motions[1].end[1] == Approx(1.0));
  CHECK(inside.sink.motions[2].duration == Approx(0.9));
}

TEST_CASE("radius: what the tool does not fit into is refused with its line",
          "[formats][nc][radius]") {
  struct Wrong {
    const char* lines;
    std::uint32_t line;  ///< of `lines`, from 1
    const char* code;
  };
  for (const Wrong& wrong :
       {Wrong{"G41.1 D40\nG1 X10", 2, "NC264"},
        Wrong{"G41.1 D4\nG1 Z1", 2, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nG3 X10 Y2 I0 J1", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nX10.5 Y1\nX0 Y1", 3, "NC264"},
        Wrong{"G19 G41.1 D4", 1, "NC264"},
        Wrong{"G41.1 D4\nG41.1 D4", 2, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nG55", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nG43 H1", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nG92 X1", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nG18", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nG20", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nM6 T3", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nM72", 3, "NC264"},
        Wrong{"G41.1 D4\nG53 G0 Z1", 2, "NC264"},
        Wrong{"G41.1", 1, "NC264"},
        Wrong{"G41.1 D4 L1", 1, "NC264"},
        Wrong{"G18 G41.1 D4 L10", 1, "NC264"},
        Wrong{"G41 D1.5", 1, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nG81 X5 Z1 R3", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nX20 A5", 3, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nX20\nG40\nG2 X30 I5", 5, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nX20\nG40\nG1 X20", 5, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nX20\nG40\nG81 X20 Z1 R3", 5, "NC264"},
        Wrong{"G41.1 D4\nG1 X10\nX20\nG40\nG5 X30 I5 P5 Q0 J0", 5, "NC264"},
        Wrong{"o1 sub\nM73\nG41.1 D4\nG1 X10\no1 endsub\no1 call\nG1 X20", 5, "NC264"},
        Wrong{"G18 G41.1 D4 L2\nG3 X5 Z10 K5", 2, "NC264"},
        Wrong{"G41 D7", 1, "PR102"},
        Wrong{"G41", 1, "PR102"},
        Wrong{"M428\nG41.1 D1", 2, "NC202"},
        Wrong{"G10 L2 P1 R20\nG18 G41.1 D1", 2, "NC202"}}) {
    const Run r = compensated(wrong.lines);
    INFO(wrong.lines << "\n" << r.all_text());
    REQUIRE_FALSE(r.ok);
    CHECK(r.errors().front() == wrong.code);
    const auto first = std::find_if(r.diagnostics.begin(), r.diagnostics.end(),
                                    [](auto& d) { return d.severity == Severity::error; });
    CHECK(first->where.line == static_cast<int>(wrong.line) + kLinesBefore);
  }
}

TEST_CASE("radius: a tool change behind G40 forgets where the contour ended",
          "[formats][nc][radius]") {
  const std::string cut = "G21 F100\nG0 X0 Y0 Z0\nG41.1 D4\nG1 X10\nY10\nG40\n";
  const auto last_end = [&](const std::string& lines) {
    const Run r = run_lines(cut + lines, mill_settings());
    REQUIRE(r.ok);
    return r.sink.motions.back().end;
  };
  // The centre is left of X10 Y10 by 2. Without a change Z alone goes back onto the contour's end.
  CHECK(last_end("G0 Z5")[0] == Approx(10.0));
  CHECK(last_end("T1 M6\nG0 Z5")[0] == Approx(8.0));
  CHECK(last_end("T1 M6\nG0 X50")[1] == Approx(10.0));
  CHECK(last_end("G91\nT1 M6\nG0 X1")[0] == Approx(9.0));
}

TEST_CASE("radius: where the diameter is from", "[formats][nc][radius]") {
  CHECK(compensated("G41 D0\nG1 X10").sink.motions.back().end[1] == 0.0);
  CHECK(compensated("T3 M6\nG41\nG1 X10").sink.motions.back().end[1] == Approx(2.0));
  CHECK(compensated("G42 D3\nG1 X10").sink.motions.back().end[1] == Approx(-2.0));
  CHECK(compensated("G10 L1 P7 R3\nG41 D7\nG1 X10").sink.motions.back().end[1] == Approx(3.0));
  nc::InterpreterSettings known = mill_settings();
  known.tool_diameters = {{2, 5.0}};
  const Run by_setting = run("G21 G90 F600\nG0 X0 Y0 Z5\nG41 D2\nG1 X10\nM2\n", known);
  REQUIRE(by_setting.ok);
  CHECK(by_setting.sink.motions.back().end[1] == Approx(2.5));
  CHECK(compensated("G41.1 D-4\nG1 X10").sink.motions.back().end[1] == Approx(-2.0));
  CHECK(compensated("G20 G41.1 D0.1\nG1 X1").sink.motions.back().end[1] == Approx(1.27));
}

TEST_CASE("radius: the words of a lathe tool move a point of its nose", "[formats][nc][radius]") {
  // Along -X at Z0 the centre lies at Z2; point 2 of the nose is at smaller X and Z.
  const Run r = compensated("G18\nG41.1 D4 L2\nG1 X-10");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions.back().end[0] == Approx(-12.0));
  CHECK(r.sink.motions.back().end[2] == Approx(5.0));
}

TEST_CASE("radius: calls keep their place between motions", "[formats][nc][radius]") {
  const Run r = compensated("G41.1 D2\nG1 X10\n(MSG, one)\nX20\nG4 P1\nX30\nG40\nG0 X40");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions.size() == 5);
  REQUIRE(r.sink.of("dwell").size() == 1);
  CHECK(r.sink.of("dwell").front().motions_before == 3);
  REQUIRE(r.sink.of("event").size() == 1);
  CHECK(r.sink.of("event").front().motions_before == 2);
}

TEST_CASE("radius: behind G40 the programmed place counts", "[formats][nc][radius]") {
  const Run r = compensated("G41.1 D4\nG1 X10\nX20\nG40\nG91 G1 Z1\nX5");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& motions = r.sink.motions;
  REQUIRE(motions.size() == 5);
  CHECK(motions[3].start[1] == Approx(2.0));
  CHECK(motions[3].end[1] == Approx(0.0).margin(1e-12));
  CHECK(motions[3].duration == Approx(std::hypot(2.0, 1.0) / 10.0));
  CHECK(motions[4].end[0] == Approx(25.0));
}

TEST_CASE("radius: a position under compensation has no number", "[formats][nc][radius]") {
  for (const char* name : {"#5420", "#<_x>", "#<_abs_y>"}) {
    INFO(name);
    CHECK_FALSE(compensated(std::string("G41.1 D4\nG1 X10\nX[") + name + "+5]").ok);
    CHECK(compensated(std::string("G41.1 D4\nG1 X10\nX20\nG40\nG0 X[") + name + "+5]").ok);
  }
  const Run r = compensated("(PRINT,#<_ccomp>)\nG42.1 D4\n(PRINT,#<_ccomp>)");
  CHECK(r.sink.comments == Codes{"PRINT,400.000000", "PRINT,420.000000"});
}

TEST_CASE("radius: other dialects and machine programs refuse it", "[formats][nc][radius]") {
  for (const nc::InputDialect dialect :
       {nc::InputDialect::fanuc, nc::InputDialect::haas, nc::InputDialect::siemens}) {
    const Run r = run("G41 D1\nM30\n", mill_settings(), dialect);
    INFO(r.all_text());
    REQUIRE_FALSE(r.ok);
    CHECK(r.errors().front() == "NC202");
  }
  nc::InterpreterSettings plain;
  plain.plain_blocks = true;
  CHECK(run("G21\nG41.1 D4\nM2\n", plain).errors() == Codes{"NC202"});
}

}  // namespace smoothpost::test
