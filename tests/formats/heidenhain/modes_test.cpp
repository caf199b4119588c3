#include <catch2/catch.hpp>
#include <random>

#include "tests/formats/heidenhain/recording.h"

// Tool-centre-point modes, vectors, tilted planes and datums.
namespace smoothpost::test {
namespace {

using Codes = std::vector<std::string>;
constexpr AxisMask kRotary = 0x38;

double degrees(double radians) { return degrees_from_radians(radians); }

}  // namespace

TEST_CASE("tcpm: positions of rotary axes", "[formats][heidenhain]") {
  const auto r = read_blocks(
      "L B+0 C+0 FMAX\nFUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\nL X+1 B+10 C+20\nL C+40\n"
      "FUNCTION RESET TCPM\nL X+5 FMAX");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 5);
  CHECK_FALSE(m[1].tcp);
  CHECK(m[2].tcp);
  CHECK_FALSE(m[2].axis_vector);
  CHECK(degrees(m[2].end[4]) == Approx(10.0));
  CHECK(degrees(m[3].end[5]) == Approx(40.0));
  CHECK(m[3].duration == Approx(20.0 / 10.0));  // F in degrees when nothing else moves
  CHECK_FALSE(m[4].tcp);
  // The rotary axes do not stand at 0: X Y Z are another point then.
  CHECK((m[4].unknown_end & 7) == 6);
  const auto vectors =
      read_blocks("L B+0 C+0 FMAX\nFUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR\nL X+1 B+10");
  REQUIRE(vectors.ok);
  const CanonicalMotion& last = vectors.sink.motions.back();
  CHECK(last.axis_vector);
  CHECK(last.end_axis.isZero());  // the machine's at B C
  CHECK((last.unknown_start & kRotary) == 0);
  CHECK((last.unknown_end & kRotary) == 0);
  CHECK(degrees(last.end[4]) == Approx(10.0));
}

TEST_CASE("m128: LN with vectors", "[formats][heidenhain]") {
  const auto r = read_blocks(
      "L A+0 B+0 C+0 FMAX M128\nLN X+1 Y+2 Z+3 NX+0 NY+0 NZ+1 TX+0 TY+0.6 TZ+0.8 FMAX\n"
      "LN X+2 TX+0 TY+6 TZ+8\nLN X+3\nL X+4 M129\nL X+5 Y+5 Z+5 FMAX");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 7);
  CHECK(m[2].axis_vector);
  CHECK((m[2].unknown_start & kRotary) == kRotary);
  CHECK((m[2].unknown_end & kRotary) == 0);
  for (std::size_t i : {2U, 3U, 4U, 5U}) {
    INFO(i);
    CHECK((m[i].end_axis - Vec3(0, 0.6, 0.8)).norm() < 1e-12);
    CHECK(m[i].axis_vector);
  }
  CHECK((m[3].unknown_start & (kRotary | 7)) == 0);
  CHECK_FALSE(m[6].axis_vector);
  CHECK_FALSE(m[6].tcp);
  REQUIRE(r.summary.assumes.size() == 1);
  CHECK(r.summary.assumes[0].find("great circles") != std::string::npos);
  CHECK(read_blocks("LN X+1 TX+0 TY+0 TZ+1").errors() == Codes{"NC413"});
  CHECK(read_blocks("L M128\nLN X+1 Y+1 Z+1 TX+0 TY+0").errors() == Codes{"NC413"});
  CHECK(read_blocks("L M128\nL X+1 TX+0 TY+0 TZ+1").errors() == Codes{"NC413"});
}

TEST_CASE("spatial angles: A first about the axes that stay", "[formats][heidenhain]") {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> angle(-170.0, 170.0);
  nc::InterpreterSettings settings;
  settings.any_axis_needs_machine = true;  // spatial angles are no positions of axes
  for (int i = 0; i < 50; ++i) {
    const Vec3 abc(std::round(angle(random)), std::round(angle(random)), std::round(angle(random)));
    const auto word = [](const char* name, double value) {
      return std::string(name) + (value < 0 ? "" : "+") + nc::decimal_text(value, 0) + " ";
    };
    const Vec3 axis =
        Eigen::AngleAxisd(radians_from_degrees(abc.z()), Vec3::UnitZ()) *
        (Eigen::AngleAxisd(radians_from_degrees(abc.y()), Vec3::UnitY()) *
         (Eigen::AngleAxisd(radians_from_degrees(abc.x()), Vec3::UnitX()) * Vec3(Vec3::UnitZ())));
    const auto spat =
        read_blocks("FUNCTION TCPM F TCP AXIS SPAT PATHCTRL VECTOR\nL X+1 Y+2 Z+3 " +
                        word("A", abc.x()) + word("B", abc.y()) + word("C", abc.z()) + "FMAX",
                    settings);
    INFO(abc.transpose() << "\n" << spat.all_text());
    REQUIRE(spat.ok);
    CHECK(spat.summary.assumes.empty());
    CHECK((spat.sink.motions.back().end_axis - axis).norm() < 1e-12);
    // The same by a tilted plane: its Z is the tool axis.
    const auto plane = read_blocks("PLANE SPATIAL " + word("SPA", abc.x()) + word("SPB", abc.y()) +
                                       word("SPC", abc.z()) +
                                       "TURN FMAX SEQ- TABLE ROT\nL X+0 Y+0 Z+7 FMAX\nL Z+2",
                                   settings);
    REQUIRE(plane.ok);
    const CanonicalMotion& m = plane.sink.motions.back();
    CHECK(m.axis_vector);
    CHECK(m.tcp);
    CHECK((m.end_axis - axis).norm() < 1e-12);
    CHECK((m.start_axis - axis).norm() < 1e-12);
    CHECK((end_of(m) - 2.0 * axis).norm() < 1e-9);
    CHECK((start_of(m) - 7.0 * axis).norm() < 1e-9);
  }
}

TEST_CASE("planes: arcs lie in them and RESET leaves them", "[formats][heidenhain]") {
  const auto r = read_blocks(
      "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+100\nPLANE SPATIAL SPA+0 SPB+90 SPC+0 MOVE DIST50 "
      "F2000\n"
      "L X+0 Y+0 Z+1 FMAX\nCC X+5 Y+0\nC DR+\nPLANE RESET TURN\nL X+0 Y+0 Z+9 FMAX");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 4);
  CHECK((end_of(m[1]) - Vec3(101, 0, 0)).norm() < 1e-9);  // Z of the plane is X of the part
  CHECK((m[2].arc.normal - Vec3::UnitX()).norm() < 1e-9);
  CHECK((m[2].arc.centre - Vec3(101, 0, -5)).norm() < 1e-9);
  CHECK_FALSE(m[3].tcp);
  CHECK((end_of(m[3]) - Vec3(100, 0, 9)).norm() < 1e-9);
  CHECK(read_blocks("PLANE RESET STAY\nL X+1").ok);
  CHECK(read_blocks("PLANE SPATIAL SPA+0 SPB+9 SPC+0 TURN\nPLANE RESET STAY\nL X+1").errors() ==
        Codes{"NC417"});
  CHECK(read_blocks("PLANE SPATIAL SPA+0 SPB+9 SPC+0 TURN\nL X+1 B+5 FMAX").errors() ==
        Codes{"NC417"});
  CHECK(read_blocks("PLANE SPATIAL SPA+0 SPB+9 SPC+0 STAY").errors() == Codes{"NC402"});
  CHECK(read_blocks("PLANE EULER EULPR+0 EULNU+9 EULROT+0 TURN").errors() == Codes{"NC402"});
}

TEST_CASE("datums: shift and rotation and preset", "[formats][heidenhain]") {
  nc::InterpreterSettings settings;
  settings.work_offsets[2].words = {1000.0, 0.0, 0.0};
  const auto r = read_blocks(
      "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nCYCL DEF 7.2  IY-5\nCYCL DEF 7.3 Z+0\n"
      "L X+1 Y+1 FMAX\nCYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+90\nL X+1 Y+0 FMAX\n"
      "CYCL DEF 247 DATUM SETTING ~\n  Q339=+2 ;DATUM NUMBER\nL X+1 Y+1 Z+1 FMAX",
      settings);
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.places() ==
        std::vector<std::string>{"r 0 0 10", "r 11 -4 10", "r 10 -4 10", "r 1001 1 1"});
  CHECK(std::count(r.sink.calls.begin(), r.sink.calls.end(), "work_offset") == 4);
  CHECK(
      read_blocks("CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+90\nCYCL DEF 7.0 X\nCYCL DEF 7.1 X+1")
          .errors() == Codes{"NC414"});
}

TEST_CASE("m126: rotary axes go the shorter way", "[formats][heidenhain]") {
  const auto r = read_blocks("L C+350 FMAX M126\nL C+10\nL C+200 M127\nL C+10");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  CHECK(degrees(m[1].end[5]) == Approx(350.0));
  CHECK(degrees(m[2].end[5]) == Approx(370.0));
  CHECK(degrees(m[3].end[5]) == Approx(200.0));
  CHECK(degrees(m[4].end[5]) == Approx(10.0));
}

}  // namespace smoothpost::test
