#include <catch2/catch.hpp>

#include "tests/formats/cl/recording.h"

namespace smoothpost::test {
namespace {

using Lines = std::vector<std::string>;

// The same frame in the three notations: X is Y of the part, Y is Z, Z is X; origin (10, 20, 30).
const char* const kMsys = "MSYS/10,20,30,0,1,0,0,0,1\n";
const char* const kCsys = "$$-> CSYS / 0,0,1,10, $\n 1,0,0,20, $\n 0,1,0,30\n";
const char* const kCatia =
    "$$*CATIA0\n$$ AXIS.1\n$$   0.0  0.0  1.0  10.0\n$$ 1.0 0.0 0.0 20.0\n$$ 0.0 1.0 0.0 30.0\n";

const char* const kMotion = "GOTO/1,2,3,0,0,1\nCIRCLE/1,0,3,0,0,1\nGOTO/-1,0,3\n";

ClRun read_with(const std::string& frame, cl::FrameRule rule, const std::string& unit = "MM") {
  cl::ReaderSettings settings;
  settings.frames = rule;
  return read_cl("UNITS/" + unit + "\nFEDRAT/600,MMPM\n" + frame + kMotion + "FINI\n", settings);
}

Vec3 in_part(const Vec3& p) { return Vec3(p.z() + 10, p.x() + 20, p.y() + 30); }

}  // namespace

TEST_CASE("frames: one frame is reported and coordinates are as written", "[formats][cl]") {
  for (const char* frame : {kMsys, kCsys, kCatia}) {
    INFO(frame);
    const ClRun r = read_with(frame, cl::FrameRule::one);
    INFO(r.all_text());
    REQUIRE(r.ok);
    CHECK(r.codes(Severity::note) == Lines{"CL166"});
    CHECK((end_of(r.sink.motions[0]) - Vec3(1, 2, 3)).norm() < 1e-12);
  }
  const ClRun identity = read_with("MSYS/0,0,0,1,0,0,0,1,0\n", cl::FrameRule::one);
  REQUIRE(identity.ok);
  CHECK(identity.diagnostics.empty());
}

TEST_CASE("frames: applied moves points axes and circles", "[formats][cl]") {
  for (const char* frame : {kMsys, kCsys, kCatia}) {
    INFO(frame);
    const ClRun r = read_with(frame, cl::FrameRule::applied);
    INFO(r.all_text());
    REQUIRE(r.ok);
    CHECK((end_of(r.sink.motions[0]) - in_part({1, 2, 3})).norm() < 1e-12);
    CHECK((r.sink.motions[0].end_axis - Vec3::UnitX()).norm() < 1e-12);
    const CanonicalMotion& arc = r.sink.motions[1];
    CHECK((end_of(arc) - in_part({-1, 0, 3})).norm() < 1e-12);
    CHECK((arc.arc.centre - in_part({1, 0, 3})).norm() < 1e-12);
    CHECK((arc.arc.normal - Vec3::UnitX()).norm() < 1e-12);
    CHECK(arc.arc.sweep == Approx(0.5 * kPi));
    CHECK(r.summary.assumes.size() == 1);
  }
}

TEST_CASE("frames: origins are in the unit of the text, also before UNITS", "[formats][cl]") {
  cl::ReaderSettings settings;
  settings.frames = cl::FrameRule::applied;
  const ClRun r = read_cl(std::string(kCatia) + "UNITS/INCHES\nGOTO/1,2,3\nFINI\n", settings);
  REQUIRE(r.ok);
  CHECK((end_of(r.sink.motions[0]) - 25.4 * in_part({1, 2, 3})).norm() < 1e-9);
}

TEST_CASE("frames: a second frame is refused unless the user says what it is", "[formats][cl]") {
  const std::string two = std::string(kMsys) + "GOTO/0,0,0\nMSYS/0,0,0,1,0,0,0,1,0\n";
  const ClRun refused = read_with(two, cl::FrameRule::one);
  CHECK_FALSE(refused.ok);
  CHECK(refused.errors() == Lines{"CL141"});
  CHECK(refused.diagnostics.back().where.line == 5);
  const ClRun reported = read_with(two, cl::FrameRule::reported);
  REQUIRE(reported.ok);
  CHECK((end_of(reported.sink.motions[1]) - Vec3(1, 2, 3)).norm() < 1e-12);
  const ClRun applied = read_with(two, cl::FrameRule::applied);
  REQUIRE(applied.ok);
  CHECK((end_of(applied.sink.motions[0]) - Vec3(10, 20, 30)).norm() < 1e-12);
  CHECK((end_of(applied.sink.motions[1]) - Vec3(1, 2, 3)).norm() < 1e-12);
  CHECK(read_with(std::string(kMsys) + kMsys, cl::FrameRule::one).ok);
}

TEST_CASE("frames: TRNTYP/WORLD keeps coordinates out of CSYS", "[formats][cl]") {
  const std::string frame =
      "TRNTYP/WORLD,0,0,0\nCSYS/0,0,1.,10.,1.,0,0,0,0,1.,0,0\nTRNTYP/WORLD,0,0,0\n"
      "CSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0\n";
  for (const auto rule : {cl::FrameRule::one, cl::FrameRule::applied}) {
    const ClRun r = read_with(frame, rule);
    INFO(r.all_text());
    REQUIRE(r.ok);
    CHECK((end_of(r.sink.motions[0]) - Vec3(1, 2, 3)).norm() < 1e-12);
    CHECK(r.codes(Severity::note) == Lines{"CL166"});
  }
  CHECK(read_with("TRNTYP/LOCAL,0,0,0\n", cl::FrameRule::one).errors() == Lines{"CL142"});
  CHECK(read_with("TRNTYP/WORLD,0,0,90\n", cl::FrameRule::one).errors() == Lines{"CL142"});
}

TEST_CASE("frames: matrices that are no frames are refused", "[formats][cl]") {
  CHECK(read_with("MSYS/0,0,0,1,0,0,1,0,0\n", cl::FrameRule::one).errors() == Lines{"CL140"});
  CHECK(read_with("MSYS/0,0,0,2,0,0,0,1,0\n", cl::FrameRule::one).errors() == Lines{"CL140"});
  // Left-handed.
  CHECK(read_with("CSYS/1,0,0,0,0,1,0,0,0,0,-1,0\n", cl::FrameRule::one).errors() ==
        Lines{"CL140"});
  CHECK(read_with("MSYS/0,0,0\n", cl::FrameRule::one).errors() == Lines{"CL110"});
  // Printed digits are close enough.
  CHECK(read_with("CSYS/-0.000025,-1.,0,0,1.,-0.000025,0,0,0,0,1.,0\n", cl::FrameRule::one).ok);
}

TEST_CASE("frames: other comments behind CATIA0 are comments", "[formats][cl]") {
  const ClRun r =
      read_with("$$*CATIA0\n$$ A\n$$ B\n$$ C\n$$ D\n$$ 0 0 1 0\n$$ 1 0 0 0\n$$ 0 1 0 0\n$$ 1 2 3\n",
                cl::FrameRule::applied);
  REQUIRE(r.ok);
  CHECK((end_of(r.sink.motions[0]) - Vec3(1, 2, 3)).norm() < 1e-12);
}

}  // namespace smoothpost::test
