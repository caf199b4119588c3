#include <catch2/catch.hpp>
#include <cstdio>
#include <random>

#include "formats/cl/arc.h"
#include "formats/cl/nx_circles.h"
#include "tests/formats/cl/recording.h"

namespace smoothpost::test {
namespace {

std::string number(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.9f", value);
  return buffer;
}

std::string triple(const Vec3& v) {
  return number(v.x()) + "," + number(v.y()) + "," + number(v.z());
}

/// An arc of known sweep: start, end and points between come from the rotation itself.
struct KnownArc {
  Vec3 centre;
  Vec3 normal;
  double radius = 0.0;
  double sweep = 0.0;  ///< rad, right-hand about normal
  double rise = 0.0;
  Vec3 spoke;

  Vec3 at(double s) const {
    return centre + rotation_about(normal, s * sweep) * (radius * spoke) + s * rise * normal;
  }
  Vec3 tangent() const { return (sweep > 0 ? 1.0 : -1.0) * normal.cross(spoke); }
};

KnownArc random_arc(std::mt19937& random, bool upright) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  KnownArc arc;
  arc.centre = 50.0 * Vec3(unit(random), unit(random), unit(random));
  arc.normal = upright ? Vec3::UnitZ() : Vec3(unit(random), unit(random), unit(random) + 1e-3);
  arc.normal.normalize();
  arc.radius = 5.0 + 20.0 * std::abs(unit(random));
  arc.sweep = (0.05 + 6.1 * std::abs(unit(random))) * (unit(random) < 0.0 ? -1.0 : 1.0);
  const Vec3 any(unit(random), unit(random), unit(random));
  arc.spoke = (any - arc.normal * arc.normal.dot(any)).normalized();
  return arc;
}

void check_arc(const ClRun& r, const KnownArc& arc) {
  INFO(r.all_text());
  REQUIRE(r.ok);
  const CanonicalMotion& m = r.sink.motions.back();
  REQUIRE(m.is_arc);
  CHECK(m.kind == MotionKind::feed);
  CHECK(std::abs(m.arc.normal.norm() - 1.0) < 1e-12);
  double worst = 0.0;
  for (int i = 0; i <= 20; ++i)
    worst = std::max(worst, (arc_at(m, i / 20.0) - arc.at(i / 20.0)).norm());
  CHECK(worst < 1e-6);
  const double length = std::hypot(arc.radius * arc.sweep, arc.rise);
  CHECK(m.duration == Approx(length / 10.0).epsilon(1e-6));
}

}  // namespace

TEST_CASE("arcs: CIRCLE and GOTO of Creo and CAMWorks go round by the right hand",
          "[formats][cl]") {
  std::mt19937 random(11);
  for (int i = 0; i < 300; ++i) {
    KnownArc arc = random_arc(random, i % 3 == 0);
    if (i % 4 == 0) arc.rise = 7.0;
    const Vec3 axis = arc.sweep > 0 ? arc.normal : Vec3(-arc.normal);
    const std::string radius = i % 2 == 0 ? "," + number(arc.radius) : "";
    check_arc(read_lines("GOTO/" + triple(arc.at(0)) + "\nCIRCLE/" + triple(arc.centre) + "," +
                         triple(axis) + radius + "\nGOTO/" + triple(arc.at(1))),
              arc);
  }
}

TEST_CASE("arcs: further points of Creo stand in lines of values", "[formats][cl]") {
  std::mt19937 random(12);
  for (int i = 0; i < 200; ++i) {
    const KnownArc arc = random_arc(random, false);
    const Vec3 axis = arc.sweep > 0 ? arc.normal : Vec3(-arc.normal);
    std::string text = "GOTO/" + triple(arc.at(0)) + "\nCIRCLE / " + triple(arc.centre) + ", $\n" +
                       triple(axis) + "," + number(arc.radius) + "\nGOTO / " + triple(arc.at(0.1));
    const int points = 1 + static_cast<int>(random() % 5);
    for (int k = 1; k <= points; ++k) text += "\n" + triple(arc.at(0.1 + 0.9 * k / points));
    const ClRun r = read_lines(text);
    check_arc(r, arc);
    CHECK(r.sink.motions.size() == 3);
  }
}

TEST_CASE("arcs: INDIRV and TLON of CATIA", "[formats][cl]") {
  std::mt19937 random(13);
  for (int i = 0; i < 300; ++i) {
    const bool upright = i % 2 == 0;
    const KnownArc arc = random_arc(random, upright);
    const std::string axis = upright ? "" : "," + triple(arc.normal);
    const char* const intersection = i % 3 == 0 ? "2,INTOF," : "";
    check_arc(read_lines("GOTO/" + triple(arc.at(0)) + "\nAUTOPS\nINDIRV/" + triple(arc.tangent()) +
                         "\nTLON,GOFWD/ (CIRCLE/" + triple(arc.centre) + axis + ",$\n" +
                         number(arc.radius) + "),ON," + intersection + "$\n(LINE/" +
                         triple(arc.centre) + ",$\n" + triple(arc.at(1)) + ")"),
              arc);
  }
}

TEST_CASE("arcs: a circle of CATIA without axis lies normal to the tool axis when it is not level",
          "[formats][cl]") {
  KnownArc arc;
  arc.centre = {10, 20, 30};
  arc.normal = Vec3(0.6, 0, 0.8);
  arc.spoke = Vec3::UnitY();
  arc.radius = 5;
  arc.sweep = 2.0;
  check_arc(read_lines("GOTO/" + triple(arc.at(0)) + ",0.6,0,0.8\nINDIRV/" + triple(arc.tangent()) +
                       "\nTLON,GOFWD/(CIRCLE/" + triple(arc.centre) + ",5),ON,(LINE/" +
                       triple(arc.centre) + "," + triple(arc.at(1)) + ")"),
            arc);
}

TEST_CASE("arcs: CIRCLE of NX by option", "[formats][cl]") {
  std::mt19937 random(14);
  for (int i = 0; i < 200; ++i) {
    const KnownArc arc = random_arc(random, false);
    cl::ReaderSettings settings;
    const bool clockwise = i % 2 == 0;
    settings.nx_circles =
        clockwise ? cl::NxCircleSense::clockwise : cl::NxCircleSense::counter_clockwise;
    // Clockwise about the axis is the left hand's sense.
    const Vec3 axis = (arc.sweep > 0) == clockwise ? Vec3(-arc.normal) : arc.normal;
    check_arc(read_lines("GOTO/" + triple(arc.at(0)) + "\nCIRCLE/" + triple(arc.centre) + "," +
                             triple(axis) + "," + number(arc.radius) + ",0.06,0.5,10.0,0.0\nGOTO/" +
                             triple(arc.at(1)),
                         settings),
              arc);
  }
}

TEST_CASE("arcs: the sense of NX circles comes from the tangents", "[formats][cl]") {
  const auto program = [](const char* axis) {
    // From (-10, 0) along X, round a quarter about (0, 10), and on along Y.
    return "GOTO/-10,0,0\nGOTO/0,0,0\nCIRCLE/0,10,0,0,0," + std::string(axis) +
           ",10,0.06,0.5,8,0\nGOTO/10,10,0\nGOTO/10,30,0";
  };
  const ClRun left = read_lines(program("-1"));
  REQUIRE(left.ok);
  CHECK(left.sink.motions[3].arc.sweep * left.sink.motions[3].arc.normal.z() == Approx(0.5 * kPi));
  CHECK(left.codes(Severity::note) == std::vector<std::string>{"CL167"});
  CHECK(left.summary.assumes.size() == 1);
  const ClRun right = read_lines(program("1"));
  REQUIRE(right.ok);
  CHECK(right.sink.motions[3].arc.sweep * right.sink.motions[3].arc.normal.z() ==
        Approx(0.5 * kPi));
  const cl::TangentVotes votes = cl::count_tangents(program("1"));
  CHECK(votes.right_hand == 2);
  CHECK(votes.left_hand == 0);
}

TEST_CASE("arcs: NX circles without tangents are clockwise and contradicting ones are refused",
          "[formats][cl]") {
  // Straight in along the spoke: no tangent says anything.
  const ClRun r =
      read_lines("GOTO/20,0,0\nGOTO/10,0,0\nCIRCLE/0,0,0,0,0,1,10,0.06,0.5,8,0\nGOTO/0,-10,0");
  REQUIRE(r.ok);
  CHECK(r.sink.motions[3].arc.sweep == Approx(-0.5 * kPi));
  CHECK(r.has("CL167"));
  const ClRun both = read_lines(
      "GOTO/-10,0,0\nGOTO/0,0,0\nCIRCLE/0,10,0,0,0,1,10,0.06,0.5,8,0\nGOTO/10,10,0\n"
      "GOTO/10,0,0\nGOTO/0,0,0\nGOTO/10,0,0\nCIRCLE/10,10,0,0,0,-1,10,0.06,0.5,8,0\nGOTO/20,10,0");
  CHECK_FALSE(both.ok);
  CHECK(both.errors().front() == "CL122");
  CHECK(both.diagnostics.front().where.line == 6);
}

TEST_CASE("arcs: a full circle and its neighbours", "[formats][cl]") {
  const auto sweep_to = [](const std::string& end) {
    const ClRun r = read_lines("GOTO/10,0,0\nCIRCLE/0,0,0,0,0,1\nGOTO/" + end);
    REQUIRE(r.ok);
    return r.sink.motions.back().arc.sweep;
  };
  CHECK(sweep_to("10,0,0") == Approx(2.0 * kPi).epsilon(1e-12));
  CHECK(sweep_to("10,0,5") == Approx(2.0 * kPi).epsilon(1e-12));
  CHECK(sweep_to("10,0.001,0") == Approx(1e-4).epsilon(1e-3));
  CHECK(sweep_to("10,-0.001,0") == Approx(2.0 * kPi - 1e-4).epsilon(1e-6));
}

TEST_CASE("arcs: the tool axis turns on the way", "[formats][cl]") {
  const ClRun r = read_lines("GOTO/10,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1\nGOTO/0,10,0,0,0.6,0.8");
  REQUIRE(r.ok);
  const CanonicalMotion& m = r.sink.motions.back();
  CHECK((m.start_axis - Vec3::UnitZ()).norm() < 1e-12);
  CHECK((m.end_axis - Vec3(0, 0.6, 0.8)).norm() < 1e-12);
}

TEST_CASE("arcs: radii may differ by a hundredth or a thousandth", "[formats][cl]") {
  const auto reads = [](const std::string& start, const std::string& end) {
    return read_lines("GOTO/" + start + "\nCIRCLE/0,0,0,0,0,1\nGOTO/" + end).ok;
  };
  CHECK(reads("1,0,0", "0,1.009,0"));
  CHECK_FALSE(reads("1,0,0", "0,1.011,0"));
  CHECK(reads("500,0,0", "0,500.49,0"));
  CHECK_FALSE(reads("500,0,0", "0,500.6,0"));
  CHECK_FALSE(reads("5000,0,0", "0,5001.1,0"));
  // A written radius counts too.
  CHECK_FALSE(read_lines("GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1,1.02\nGOTO/0,1,0").ok);
}

TEST_CASE("arcs: turn_between is the angle of the rotation", "[formats][cl]") {
  std::mt19937 random(15);
  for (int i = 0; i < 1000; ++i) {
    const KnownArc arc = random_arc(random, false);
    const cl::Circle circle{arc.centre, arc.normal, arc.sweep > 0, arc.radius};
    CHECK(cl::turn_between(circle, arc.at(0), arc.at(1)) ==
          Approx(std::abs(arc.sweep)).epsilon(1e-9));
    CHECK(cl::radius_at(circle, arc.at(0.3)) == Approx(arc.radius));
    CHECK((cl::tangent_at(circle, arc.at(0)) - arc.tangent()).norm() < 1e-9);
  }
}

}  // namespace smoothpost::test
