#include <catch2/catch.hpp>
#include <cstdio>
#include <ctime>

#include "tests/formats/cl/recording.h"
#include "tests/support/quiet_sink.h"

namespace smoothpost::test {
namespace {

constexpr AxisMask kAll = 0x3f;

void check_near(const Vec3& a, const Vec3& b) {
  INFO(a.transpose() << " and " << b.transpose());
  CHECK((a - b).norm() < 1e-9);
}

}  // namespace

TEST_CASE("motion: the first position is reached by a rapid from nowhere", "[formats][cl]") {
  const ClRun r = read_cl("UNITS/MM\nGOTO/1,2,3\nFINI\n");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.diagnostics.empty());
  REQUIRE(r.sink.motions.size() == 1);
  const CanonicalMotion& m = r.sink.motions.front();
  CHECK(m.kind == MotionKind::rapid);
  CHECK(m.unknown_start == kAll);
  CHECK(m.unknown_end == 0);
  CHECK(m.tcp);
  CHECK(m.axis_vector);
  CHECK(m.duration == 0.0);
  CHECK(m.line == 2);
  CHECK(m.column == 1);
  check_near(end_of(m), {1, 2, 3});
  check_near(m.end_axis, Vec3::UnitZ());
  CHECK(r.sink.ends == 1);
  CHECK(r.summary.ended);
}

TEST_CASE("motion: GOTO goes on a line at the feed", "[formats][cl]") {
  const ClRun r = read_cl("UNITS/MM\nFROM/1,2,3\nFEDRAT/300,MMPM\nGOTO/4,6,3,0,0.6,0.8\nFINI\n");
  INFO(r.all_text());
  REQUIRE(r.ok);
  REQUIRE(r.sink.motions.size() == 2);
  const CanonicalMotion& m = r.sink.motions[1];
  CHECK(m.kind == MotionKind::feed);
  CHECK_FALSE(m.is_arc);
  CHECK(m.unknown_start == 0);
  CHECK(m.programmed == 7);
  check_near(start_of(m), {1, 2, 3});
  check_near(end_of(m), {4, 6, 3});
  check_near(m.start_axis, Vec3::UnitZ());
  check_near(m.end_axis, {0, 0.6, 0.8});
  CHECK(m.duration == Approx(5.0 / (300.0 / 60.0)).epsilon(1e-12));
}

TEST_CASE("motion: RAPID holds for one motion", "[formats][cl]") {
  const ClRun r = read_lines("RAPID\nGOTO/1,0,0\nGOTO/2,0,0\nRAPID/\nRAPID/\nGODLTA/1,0,0");
  REQUIRE(r.ok);
  CHECK(r.sink.calls == std::vector<std::string>{"rapid 3", "rapid 5", "line 6", "rapid 9"});
  CHECK(r.sink.motions[1].duration == 0.0);
}

TEST_CASE("motion: FEDRAT between RAPID and its motion makes a feed and a warning",
          "[formats][cl]") {
  const ClRun r = read_lines("RAPID\nFEDRAT/60\nGOTO/1,0,0");
  REQUIRE(r.ok);
  CHECK(r.has("CL164"));
  CHECK(r.sink.motions[1].kind == MotionKind::feed);
  CHECK(r.sink.motions[1].duration == Approx(1.0));
}

TEST_CASE("motion: GODLTA by components along the tool axis and with a new axis", "[formats][cl]") {
  const ClRun r = read_lines("GOTO/10,0,0,0.6,0,0.8\nGODLTA/1,2,3\nGODLTA/5\nGODLTA/0,0,-1,0,0,1");
  INFO(r.all_text());
  REQUIRE(r.ok);
  REQUIRE(r.sink.motions.size() == 5);
  check_near(end_of(r.sink.motions[2]), {11, 2, 3});
  check_near(r.sink.motions[2].end_axis, {0.6, 0, 0.8});
  check_near(end_of(r.sink.motions[3]), {14, 2, 7});
  check_near(end_of(r.sink.motions[4]), {14, 2, 6});
  check_near(r.sink.motions[4].end_axis, Vec3::UnitZ());
}

TEST_CASE("motion: the tool axis stays until another is given", "[formats][cl]") {
  const ClRun r = read_lines(
      "MULTAX/ON\nGOTO/1,0,0,1,0,0\nGOTO/2,0,0\nTLAXIS/0,2,0\nGOTO/3,0,0\nMULTAX/OFF\nGOTO/4,0,0\n"
      "MULTAX\nGOTO/5,0,0,0,0,1");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const std::vector<Vec3> axes = {Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitX(),
                                  Vec3::UnitY(), Vec3::UnitY(), Vec3::UnitZ()};
  REQUIRE(r.sink.motions.size() == axes.size());
  for (std::size_t i = 0; i < axes.size(); ++i) check_near(r.sink.motions[i].end_axis, axes[i]);
}

TEST_CASE("motion: an axis of another length is normalised and told once", "[formats][cl]") {
  const ClRun r = read_lines("GOTO/1,0,0,0,0,2\nGOTO/2,0,0,0,3,0");
  REQUIRE(r.ok);
  check_near(r.sink.motions[2].end_axis, Vec3::UnitY());
  CHECK(r.codes(Severity::warning) == std::vector<std::string>{"CL165"});
}

TEST_CASE("motion: units", "[formats][cl]") {
  const struct {
    const char* statement;
    double millimetres;
  } kUnits[] = {{"UNITS/MM", 1},      {"UNIT/MM", 1},     {"UNITS / INCHES", 25.4},
                {"UNITS/INCH", 25.4}, {"UNITS/IN", 25.4}, {"units/cm", 10}};
  for (const auto& unit : kUnits) {
    INFO(unit.statement);
    const ClRun r = read_cl(std::string(unit.statement) + "\nGOTO/1,2,3\nFINI\n");
    REQUIRE(r.ok);
    check_near(end_of(r.sink.motions[0]), unit.millimetres * Vec3(1, 2, 3));
  }
}

TEST_CASE("motion: without UNITS the unit is refused or that of the setting", "[formats][cl]") {
  const std::string text = "GOTO/1,2,3\nGOTO/4,5,6\nFINI\n";
  const ClRun refused = read_cl(text);
  CHECK_FALSE(refused.ok);
  CHECK(refused.errors() == std::vector<std::string>{"CL111"});
  CHECK(refused.diagnostics.front().where.line == 1);
  cl::ReaderSettings settings;
  settings.unit = 25.4;
  settings.feed = 10.0;
  const ClRun r = read_cl(text, settings);
  REQUIRE(r.ok);
  check_near(end_of(r.sink.motions[1]), 25.4 * Vec3(4, 5, 6));
  CHECK(r.sink.motions[1].duration == Approx(25.4 * std::sqrt(27.0) / 10.0));
  // What the text says holds before the setting.
  const ClRun other = read_cl("UNITS/MM\n" + text, settings);
  REQUIRE(other.ok);
  check_near(end_of(other.sink.motions[1]), {4, 5, 6});
}

TEST_CASE("motion: feeds in every unit", "[formats][cl]") {
  // 10 mm at the feed of the second column in mm/s; the spindle turns 600 times a minute.
  const struct {
    const char* statement;
    double speed;
  } kFeeds[] = {{"FEDRAT/120", 2},         {"FEDRAT/120,MMPM", 2},   {"FEDRAT/MMPM,120", 2},
                {"FEDRAT/120.,PERMIN", 2}, {"FEDRAT/6,IPM", 2.54},   {"FEDRAT/IPM,6", 2.54},
                {"FEDRAT/0.2,MMPR", 2},    {"FEDRAT/PERREV,0.2", 2}, {"FEDRAT/0.01,IPR", 2.54}};
  for (const auto& feed : kFeeds) {
    INFO(feed.statement);
    const ClRun r =
        read_lines("SPINDL/600,RPM,CLW\n" + std::string(feed.statement) + "\nGOTO/0,0,10");
    INFO(r.all_text());
    REQUIRE(r.ok);
    CHECK(r.sink.motions[1].duration == Approx(10.0 / feed.speed).epsilon(1e-12));
  }
  // Without a unit of its own a feed has that of lengths.
  const ClRun inch = read_cl("UNITS/INCHES\nFROM/0,0,0\nFEDRAT/60\nGOTO/3,0,0\nFINI\n");
  REQUIRE(inch.ok);
  CHECK(inch.sink.motions[1].duration == Approx(3.0));
}

TEST_CASE("motion: a motion of the axis alone has no duration", "[formats][cl]") {
  const ClRun r = read_lines("GOTO/0,0,0,1,0,0");
  REQUIRE(r.ok);
  REQUIRE(r.sink.motions.size() == 2);
  CHECK(r.sink.motions[1].kind == MotionKind::feed);
  CHECK(r.sink.motions[1].duration == 0.0);
}

TEST_CASE("motion: FROM after a motion", "[formats][cl]") {
  const ClRun same = read_lines("GOTO/1,0,0\nFROM/1,0,0");
  REQUIRE(same.ok);
  CHECK(same.diagnostics.empty());
  CHECK(same.sink.motions.size() == 2);
  const ClRun other = read_lines("GOTO/1,0,0\nFROM/5,0,0\nGOTO/6,0,0");
  REQUIRE(other.ok);
  CHECK(other.has("CL161"));
  REQUIRE(other.sink.motions.size() == 4);
  CHECK(other.sink.motions[2].kind == MotionKind::rapid);
  check_near(start_of(other.sink.motions[3]), {5, 0, 0});
}

TEST_CASE("motion: the end of the text", "[formats][cl]") {
  CHECK(read_cl("UNITS/MM\nGOTO/1,2,3\n").has("CL162"));
  CHECK_FALSE(read_cl("UNITS/MM\nGOTO/1,2,3\nEND-OF-PATH\n").has("CL162"));
  CHECK_FALSE(read_cl("UNITS/MM\nGOTO/1,2,3\nEND\n").has("CL162"));
  const ClRun both = read_cl("UNITS/MM\nGOTO/1,2,3\nEND\n$$ c\nFINI\nGOTO/nonsense\n");
  CHECK(both.ok);
  CHECK(both.diagnostics.empty());
  CHECK(both.sink.ends == 1);
  const ClRun after = read_cl("UNITS/MM\nGOTO/1,2,3\nEND\nGOTO/4,5,6\nGOTO/7,8,9\n");
  CHECK(after.ok);
  CHECK(after.sink.motions.size() == 1);
  CHECK(after.codes(Severity::note) == std::vector<std::string>{"CL163"});
  CHECK(after.diagnostics.front().where.line == 4);
}

TEST_CASE("motion: after an error reading goes on and motions after it are judged",
          "[formats][cl]") {
  const ClRun r = read_lines("GOTO/1,2\nGOTO/5,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/0,6,0\nGOTO/7,7,X");
  CHECK_FALSE(r.ok);
  CHECK(r.errors() == std::vector<std::string>{"CL110", "CL121", "CL110"});
  CHECK(r.diagnostics[1].where.line == 7);
  // An arc that starts where a refused motion ended is not judged.
  const ClRun lost = read_lines("GOTO/1,2\nCIRCLE/0,0,0,0,0,1\nGOTO/0,6,0");
  CHECK(lost.errors() == std::vector<std::string>{"CL110"});
}

namespace {

struct CountingSink final : QuietSink {
  std::size_t motions = 0;
  void motion(const CanonicalMotion&) override { ++motions; }
};

double seconds_of(std::size_t lines) {
  std::string text = "UNITS/MM\nFEDRAT/600,MMPM\n";
  char line[120];
  for (std::size_t i = 0; i < lines; ++i) {
    std::snprintf(line, sizeof line, "GOTO/%.6f,%.6f,%.6f,0.0,0.6000000,0.8000000\n",
                  0.001 * static_cast<double>(i), 12.345678, -0.5);
    text += line;
  }
  CountingSink sink;
  const std::clock_t begin = std::clock();
  const auto result = cl::read(text, "t.apt", {}, sink);
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  REQUIRE(result.ok());
  REQUIRE(sink.motions == lines);
  WARN(lines << " lines: " << static_cast<double>(text.size()) / seconds / 1e6 << " MB/s");
  return seconds;
}

}  // namespace

TEST_CASE("motion: a million lines in linear time", "[formats][cl][.slow]") {
  seconds_of(100'000);
  const double quarter = seconds_of(250'000);
  const double whole = seconds_of(1'000'000);
  CHECK(whole < 8.0 * quarter);
}

}  // namespace smoothpost::test
