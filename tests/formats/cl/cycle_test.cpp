#include <catch2/catch.hpp>

#include "tests/formats/cl/recording.h"

namespace smoothpost::test {
namespace {

/// Heights over the hole's mouth that a hole's motions end at, with what they are.
std::vector<std::string> heights(const ClRun& r, std::size_t first, const Vec3& mouth,
                                 const Vec3& axis) {
  std::vector<std::string> out;
  for (std::size_t i = first; i < r.sink.motions.size(); ++i) {
    const CanonicalMotion& m = r.sink.motions[i];
    const Vec3 offset = end_of(m) - mouth;
    const double height = axis.dot(offset);
    if ((offset - height * axis).norm() > 1e-9) break;
    char text[40];
    std::snprintf(text, sizeof text, "%s %.3f", m.kind == MotionKind::rapid ? "rapid" : "feed",
                  height);
    out.emplace_back(text);
  }
  return out;
}

using Lines = std::vector<std::string>;

}  // namespace

TEST_CASE("cycle: DRILL goes down to the depth and back to the retract height", "[formats][cl]") {
  const ClRun r = read_lines(
      "RAPID\nGOTO/1,2,25\nCYCLE/DRILL,FEDTO,10.,MMPM,240,RAPTO,3.,RTRCTO,25.,DWELL,0.5\n"
      "GOTO/1,2,0\nGOTO/5,2,0\nCYCLE/OFF\nGOTO/6,2,0");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const Lines expected = {"rapid 25.000", "rapid 3.000", "feed -10.000", "rapid 25.000"};
  CHECK(heights(r, 2, {1, 2, 0}, Vec3::UnitZ()) == expected);
  CHECK(heights(r, 6, {5, 2, 0}, Vec3::UnitZ()) == expected);
  CHECK(r.sink.motions[4].duration == Approx(13.0 / 4.0));
  CHECK(r.sink.motions[4].line == 7);
  CHECK(r.sink.dwells == std::vector<double>{0.5, 0.5});
  CHECK(r.sink.calls[5] == "dwell 7");
  REQUIRE(r.sink.motions.size() == 11);
  CHECK(r.sink.motions[10].kind == MotionKind::feed);
}

TEST_CASE("cycle: without RTRCTO it goes back to the clearance and without feed at FEDRAT",
          "[formats][cl]") {
  const ClRun r = read_lines("GOTO/0,0,5\nCYCLE/DRILL,DEPTH,4,CLEAR,2\nGOTO/0,0,0");
  REQUIRE(r.ok);
  CHECK(heights(r, 2, {0, 0, 0}, Vec3::UnitZ()) ==
        Lines{"rapid 2.000", "feed -4.000", "rapid 2.000"});
  CHECK(r.sink.motions[3].duration == Approx(0.6));
  CHECK(r.sink.dwells.empty());
}

TEST_CASE("cycle: depth and heights go along the tool axis", "[formats][cl]") {
  const Vec3 axis(0.6, 0, 0.8);
  const ClRun r =
      read_lines("GOTO/0,0,50,0.6,0,0.8\nCYCLE/DRILL,FEDTO,-7,RAPTO,1,RTRCTO,9\nGOTO/3,4,5");
  REQUIRE(r.ok);
  CHECK(heights(r, 2, {3, 4, 5}, axis) ==
        Lines{"rapid 9.000", "rapid 1.000", "feed -7.000", "rapid 9.000"});
  CHECK((r.sink.motions.back().end_axis - axis).norm() < 1e-12);
}

TEST_CASE("cycle: DEEP comes out after each stroke and BRKCHP only a little", "[formats][cl]") {
  const ClRun deep = read_lines(
      "GOTO/0,0,9\nCYCLE/DEEP2,FEDTO,10.,1STPECK,5.,SUBPECK,2.,MMPM,60,RAPTO,3.,RTRCTO,9.\n"
      "GOTO/0,0,0");
  INFO(deep.all_text());
  REQUIRE(deep.ok);
  CHECK(heights(deep, 2, {0, 0, 0}, Vec3::UnitZ()) ==
        Lines{"rapid 9.000", "rapid 3.000", "feed -5.000", "rapid 3.000", "rapid -4.746",
              "feed -7.000", "rapid 3.000", "rapid -6.746", "feed -9.000", "rapid 3.000",
              "rapid -8.746", "feed -10.000", "rapid 9.000"});
  const ClRun chips = read_lines("GOTO/0,0,9\nCYCLE/BRKCHP,DEPTH,6,STEP,2,CLEAR,1\nGOTO/0,0,0");
  REQUIRE(chips.ok);
  CHECK(heights(chips, 2, {0, 0, 0}, Vec3::UnitZ()) ==
        Lines{"rapid 1.000", "feed -2.000", "rapid -1.746", "feed -4.000", "rapid -3.746",
              "feed -6.000", "rapid 1.000"});
}

TEST_CASE("cycle: the form of NX with DEEP behind DRILL and RTRCTO AUTO", "[formats][cl]") {
  const ClRun r = read_lines(
      "RAPID\nGOTO/0,0,80\nCYCLE/DRILL,DEEP,STEP,20.0,CLEAR,3.0,FEDTO,-32.0,RTRCTO,AUTO,MMPM,250\n"
      "GOTO/0,0,10");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(heights(r, 2, {0, 0, 10}, Vec3::UnitZ()) ==
        Lines{"rapid 70.000", "rapid 3.000", "feed -20.000", "rapid 3.000", "rapid -19.746",
              "feed -32.000", "rapid 70.000"});
}

TEST_CASE("cycle: INIT OFF and ON", "[formats][cl]") {
  const ClRun r = read_lines(
      "CYCLE/INIT\nCYCLE/DRILL,FEDTO,1,RAPTO,1\nGOTO/1,0,0\nCYCLE/OFF\nGOTO/5,5,5\nCYCLE/ON\n"
      "GOTO/2,0,0\nCYCLE/NOMORE\nGOTO/3,0,0");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions.size() == 1 + 3 + 1 + 3 + 1);
}

TEST_CASE("cycle: lengths and feeds in inches", "[formats][cl]") {
  const ClRun r = read_cl(
      "UNITS/INCHES\nFROM/0,0,1\nCYCLE/DRILL,FEDTO,0.5,IPM,6,RAPTO,0.1\nGOTO/0,0,0\nFINI\n");
  REQUIRE(r.ok);
  CHECK(r.sink.motions[2].duration == Approx(25.4 * 0.6 / 2.54));
  CHECK(end_of(r.sink.motions[2]).z() == Approx(-12.7));
}

TEST_CASE("cycle: what is not read is refused by its name", "[formats][cl]") {
  const struct {
    const char* statement;
    const char* code;
    int column;
    const char* text;
  } kCases[] = {
      {"CYCLE/TAP,FEDTO,10,MMPR,1.5,RAPTO,3", "CL130", 7, "TAP"},
      {"CYCLE/BORE,FEDTO,10,RAPTO,3", "CL130", 7, "BORE"},
      {"CYCLE/DRILL,FEDTO,10,ORIENT,3,RAPTO,2", "CL130", 22, "ORIENT"},
      {"CYCLE/DRILL,10,300,MMPM,2", "CL131", 13, "by their place"},
      {"CYCLE/DRILL,RAPTO,2", "CL131", 7, "FEDTO"},
      {"CYCLE/DRILL,FEDTO,3", "CL131", 7, "RAPTO"},
      {"CYCLE/DRILL,FEDTO,3,RAPTO,5,RTRCTO,4", "CL131", 7, "RTRCTO"},
      {"CYCLE/DEEP,FEDTO,3,RAPTO,5", "CL131", 7, "STEP"},
      {"CYCLE/DEEP,FEDTO,3,RAPTO,5,STEP,0.001", "CL131", 28, "1000 strokes"},
      {"CYCLE/DRILL,FEDTO,3,RAPTO,5,STEP,1", "CL131", 7, "DEEP"},
      {"CYCLE/DRILL,FEDTO,RAPTO,5", "CL131", 13, "number"},
      {"CYCLE/DRILL,FEDTO,3,MMPM,0,RAPTO,5", "CL131", 21, "feed"},
      {"CYCLE/ON", "CL131", 7, "without a cycle"},
      {"CYCLE", "CL131", 1, "type"},
  };
  for (const auto& c : kCases) {
    INFO(c.statement);
    const ClRun r = read_lines(std::string(c.statement) + "\nGOTO/1,0,0\nCYCLE/OFF");
    INFO(r.all_text());
    CHECK_FALSE(r.ok);
    REQUIRE(r.errors() == Lines{c.code});
    CHECK(r.diagnostics.front().where.line == 4);
    CHECK(r.diagnostics.front().where.column == c.column);
    CHECK(r.diagnostics.front().text.find(c.text) != std::string::npos);
  }
}

}  // namespace smoothpost::test
