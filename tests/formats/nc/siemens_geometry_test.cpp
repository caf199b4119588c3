#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "formats/nc/number_text.h"
#include "tests/formats/nc/recording.h"
#include "tests/support/support.h"

// Arcs, polar positions, polynomials and frames of Sinumerik programs.
namespace smoothpost::test {
namespace {

using Codes = std::vector<std::string>;

Run siemens(const std::string& lines) {
  return run(lines + "\nM30\n", mill_settings(), nc::InputDialect::siemens);
}

CanonicalMotion last(const std::string& lines) {
  const Run r = siemens(lines);
  INFO(lines << "\n" << r.all_text());
  REQUIRE(r.ok);
  REQUIRE_FALSE(r.sink.motions.empty());
  return r.sink.motions.back();
}

Vec3 point(const AxisWords& words) { return {words[0], words[1], words[2]}; }
Vec3 end(const std::string& lines) { return point(last(lines).end); }
Codes errors(const std::string& lines) { return siemens(lines).errors(); }
std::string number(double value) { return nc::decimal_text(value, 9); }

/// The place at a share of an arc without climb.
Vec3 on_arc(const CanonicalMotion& m, double share) {
  return m.arc.centre +
         rotation_about(m.arc.normal, share * m.arc.sweep) * (point(m.start) - m.arc.centre);
}

}  // namespace

TEST_CASE("siemens: arcs by an opening angle", "[formats][nc][siemens]") {
  const auto a = last("G0 X10 Y0 Z0\nG3 I-10 J0 AR=90 F100");
  CHECK((point(a.end) - Vec3(0, 10, 0)).norm() < 1e-12);
  CHECK(degrees(a.arc.sweep) == Approx(90.0));
  const auto b = last("G0 X10 Y0 Z0\nG2 I=AC(0) J=AC(0) AR=270 F100");
  CHECK((point(b.end) - Vec3(0, 10, 0)).norm() < 1e-12);
  CHECK(degrees(b.arc.sweep) == Approx(-270.0));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-50.0, 50.0), angle(1.0, 359.0);
  for (int i = 0; i < 60; ++i) {
    const double opening = std::round(angle(random));
    const Vec3 from(std::round(place(random)), std::round(place(random)), 0.0);
    const Vec3 to(std::round(place(random)), std::round(place(random)), 0.0);
    if ((to - from).norm() < 1.0) continue;
    const bool clockwise = i % 2 == 0;
    const auto m = last("G0 X" + number(from.x()) + " Y" + number(from.y()) + " Z0\n" +
                        (clockwise ? "G2" : "G3") + " X" + number(to.x()) + " Y" + number(to.y()) +
                        " AR=" + number(opening) + " F100");
    CHECK(degrees(m.arc.sweep) == Approx(clockwise ? -opening : opening));
    CHECK((on_arc(m, 1.0) - to).norm() < 1e-6);
  }
  // A helix: the third axis goes along.
  CHECK(end("G0 X10 Y0 Z5\nG3 Z1 I-10 J0 AR=180 F100").isApprox(Vec3(-10, 0, 1)));
  for (const char* line : {"G3 AR=90 F5", "G3 X0 Y10 I-10 J0 AR=90 F5", "G3 X0 Y10 CR=10 AR=90 F5",
                           "G3 I-10 J0 AR=0 F5", "G3 I-10 J0 AR=360 F5"})
    CHECK(errors(std::string("G0 X10 Y0 Z0\n") + line) == Codes{"NC220"});
  CHECK(errors("G0 X10 Y0 Z0\nG1 X5 AR=90 F5") == Codes{"NC215"});
}

TEST_CASE("siemens: CT goes on by the tangent", "[formats][nc][siemens]") {
  const auto a = last("G0 X0 Y0 Z0\nG1 X10 F100\nCT X20 Y10");
  REQUIRE(a.is_arc);
  CHECK(degrees(a.arc.sweep) == Approx(90.0));
  CHECK((a.arc.centre - Vec3(10, 10, 0)).norm() < 1e-9);
  const auto b = last("G0 X0 Y0 Z0\nG1 X10 F100\nCT X10 Y-20");
  CHECK(degrees(b.arc.sweep) == Approx(-180.0));
  // Behind an arc, with blocks without motion between, and modal.
  const auto c = last("G0 X0 Y0 Z0\nG1 X10 F100\nCT X20 Y10\nG4 F1\nX10 Y20");
  CHECK(degrees(c.arc.sweep) == Approx(90.0));
  CHECK((c.arc.centre - Vec3(10, 10, 0)).norm() < 1e-9);
  const auto straight = last("G0 X0 Y0 Z0\nG1 X10 F600\nCT X20");
  CHECK_FALSE(straight.is_arc);
  CHECK(straight.duration == Approx(1.0));
  // The tangents agree at random, in a turned frame and another plane too.
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-50.0, 50.0);
  int arcs = 0;
  for (int i = 0; i < 40; ++i) {
    const auto x = [&] { return number(std::round(place(random))); };
    const std::string plane = i % 2 == 0 ? "G17\nROT Z30\n" : "G18\n";
    const char* second = i % 2 == 0 ? " Y" : " Z";
    const Run r = siemens(plane + "G0 X0 Y0 Z0\nG1 X" + x() + second + x() + " F100\nCT X" + x() +
                          second + x());
    if (!r.ok || !r.sink.motions.back().is_arc) continue;
    ++arcs;
    const CanonicalMotion& line = r.sink.motions[1];
    const CanonicalMotion& arc = r.sink.motions[2];
    const Vec3 along = (point(line.end) - point(line.start)).normalized();
    const Vec3 begins = (on_arc(arc, 1e-6) - on_arc(arc, 0.0)).normalized();
    CHECK((along - begins).norm() < 1e-4);
    CHECK((on_arc(arc, 1.0) - point(arc.end)).norm() < 1e-6);
  }
  CHECK(arcs > 30);
  CHECK(errors("G0 X0 Y0 Z0\nG0 X10\nCT X20 Y10 F5") == Codes{"NC220"});
  CHECK(errors("CT X20 Y10 F5") == Codes{"NC220"});
  CHECK(errors("G0 X0 Y0 Z0\nG1 X10 F5\nT1 D1\nCT X20 Y10") == Codes{"NC220"});  // another tip
  CHECK(errors("G0 X0 Y0 Z0\nG1 X10 F5\nCT X5") == Codes{"NC221"});
  CHECK(errors("G0 X0 Y0 Z0\nG1 Z10 F5\nCT X5 Y5") == Codes{"NC221"});
}

TEST_CASE("siemens: polar positions", "[formats][nc][siemens]") {
  CHECK(end("G0 Z5\nG1 AP=30 RP=20 F5")
            .head<2>()
            .isApprox(Eigen::Vector2d(20 * std::cos(kPi / 6), 10)));
  CHECK(end("G111 X10 Y20\nG0 AP=90 RP=5 Z1").isApprox(Vec3(10, 25, 1)));
  CHECK(end("G0 X3 Y4 Z0\nG110 X10\nG0 AP=0 RP=5").isApprox(Vec3(18, 4, 0)));
  CHECK(end("G111 X10 Y20\nG112 X1 Y1\nG0 Z0 AP=0 RP=5").isApprox(Vec3(16, 21, 0)));
  CHECK(end("G111 AP=90 RP=10\nG0 Z0 AP=0 RP=5").isApprox(Vec3(5, 10, 0)));
  // The radius stays, the angle may count on.
  CHECK(end("G0 Z0 AP=10 RP=5\nAP=IC(80)").isApprox(Vec3(0, 5, 0)));
  CHECK(end("G18\nG0 Y1 AP=90 RP=5").isApprox(Vec3(5, 1, 0)));  // Z is the first axis
  CHECK(end("TRANS X100\nG0 Y0 Z0 X0\nG111 X1\nG0 AP=0 RP=5").isApprox(Vec3(106, 0, 0)));
  // Arcs turn about the pole.
  const auto arc = last("G111 X10 Y0\nG0 AP=0 RP=5 Z0\nG3 AP=90 RP=5 F5");
  CHECK(degrees(arc.arc.sweep) == Approx(90.0));
  CHECK((arc.arc.centre - Vec3(10, 0, 0)).norm() < 1e-12);
  CHECK(errors("G111 X10 Y0\nG0 AP=0 RP=5 Z0\nG3 AP=90 RP=7 F5") == Codes{"NC221"});
  for (const char* lines :
       {"G0 AP=5", "G0 RP=5", "G91 G0 AP=5 RP=5", "G0 AP=IC(5) RP=5", "G0 X5 AP=5 RP=5",
        "G0 AP=5 RP=-5", "G111 X5\nROT Z5\nG0 AP=5 RP=5", "G111 X5\nG18\nG0 AP=5 RP=5", "G111 Z5",
        "G111 X5 AP=5 RP=5", "G110 X5", "G111 X=IC(5)", "G0 X0 Y0 Z0\nG3 AP=5 RP=5 I5 F5"})
    CHECK(errors(lines) == Codes{"NC245"});
}

TEST_CASE("siemens: tool axes by Euler and roll pitch yaw angles", "[formats][nc][siemens]") {
  std::mt19937 random(13);
  std::uniform_real_distribution<double> angle(-170.0, 170.0);
  for (int i = 0; i < 30; ++i) {
    const double a = std::round(angle(random)), b = std::round(angle(random)),
                 c = std::round(angle(random));
    const std::string words = "A2=" + number(a) + " B2=" + number(b) + " C2=" + number(c) + "\n";
    const double ra = a * kPi / 180, rb = b * kPi / 180, rc = c * kPi / 180;
    const auto euler = last("TRAORI\nORIEULER\nG0 X0 Y0 Z0 " + words);
    CHECK((euler.end_axis -
           Vec3(std::sin(ra) * std::sin(rb), -std::cos(ra) * std::sin(rb), std::cos(rb)))
              .norm() < 1e-12);
    const auto rpy = last("TRAORI\nORIRPY\nG0 X0 Y0 Z0 " + words);
    CHECK((rpy.end_axis - rotation_about(Vec3::UnitZ(), rc) *
                              (rotation_about(Vec3::UnitY(), rb) *
                               (rotation_about(Vec3::UnitX(), ra) * Vec3(Vec3::UnitZ()))))
              .norm() < 1e-12);
  }
  for (const char* lines :
       {"TRAORI\nG0 X0 A2=1 B2=2 C2=3", "TRAORI\nORIRPY\nG0 X0 A2=1 B2=2",
        "TRAORI\nORIEULER\nG0 X0 A2=1", "TRAORI\nORIEULER\nG0 X0 A2=1 B2=2 A3=1",
        "TRAORI\nORIEULER\nORIRPY2\nG0 X0 A2=1 B2=2 C2=3", "ORIEULER\nG0 X0 A2=1 B2=2",
        "TRAORI\nORIEULER\nORIMKS\nG0 X0 A2=1 B2=2"})
    CHECK(errors(lines) == Codes{"NC243"});
  for (const char* line : {"TRAORI\nG0 X0 A4=1", "TRAORI\nLEAD=5", "TRAORI\nG0 X0 B5=1"})
    CHECK(errors(line) == Codes{"NC140", "NC200"});
}

TEST_CASE("siemens: polynomials", "[formats][nc][siemens]") {
  // x = 10 u, y = 4·5 u² - ... on 0 <= p <= 2, z linear.
  const Run r =
      siemens("G0 X1 Y2 Z3\nPOLY PO[X]=(11,0.5) PO[Y]=(6,1,-0.5,0.25,0.125) Z5 PL=2 F600");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto at = [](double p) -> Vec3 {
    // a1 follows from the end: 11 = 1 + 2 a1 + 0.5·4; 6 = 2 + 2 a1 + 4 - 4 + 4 + 4.
    const double ax = (11.0 - 1.0 - 0.5 * 4.0) / 2.0;
    const double ay = (6.0 - 2.0 - 4.0 + 0.5 * 8.0 - 0.25 * 16.0 - 0.125 * 32.0) / 2.0;
    return {1 + ax * p + 0.5 * p * p,
            2 + ay * p + p * p - 0.5 * p * p * p + 0.25 * std::pow(p, 4) + 0.125 * std::pow(p, 5),
            3 + p};
  };
  const auto& m = r.sink.motions;
  REQUIRE(m.size() > 5);
  CHECK(point(m.back().end) == Vec3(11, 6, 5));
  double length = 0.0, duration = 0.0, farthest = 0.0;
  for (std::size_t i = 1; i < m.size(); ++i) {
    CHECK_FALSE(m[i].is_arc);
    length += (point(m[i].end) - point(m[i].start)).norm();
    duration += m[i].duration;
  }
  CHECK(duration == Approx(length / 10.0));
  for (int k = 0; k <= 400; ++k) {
    const Vec3 p = at(2.0 * k / 400.0);
    double nearest = 1e9;
    for (std::size_t i = 1; i < m.size(); ++i) {
      const Vec3 a = point(m[i].start), b = point(m[i].end);
      const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (p - a - t * (b - a)).norm());
    }
    farthest = std::max(farthest, nearest);
  }
  CHECK(farthest < 0.001);
  // Modal; words without PO go straight; PL is 1 when not written.
  const Run further = siemens("G0 X0 Y0 Z0\nPOLY F600\nX10\nX20 PO[Y]=(0,-40)\nG1 X30");
  REQUIRE(further.ok);
  CHECK(point(further.sink.motions[1].end) == Vec3(10, 0, 0));
  double highest = 0.0;
  for (const auto& motion : further.sink.motions) highest = std::max(highest, motion.end[1]);
  CHECK(highest == Approx(10.0).margin(0.01));
  // In a mirrored and turned frame the curve is turned too.
  const auto turned = siemens("ROT Z90\nG0 X0 Y0 Z0\nPOLY PO[X]=(10) PO[Y]=(0,-40) F600");
  REQUIRE(turned.ok);
  double least = 0.0;
  for (const auto& motion : turned.sink.motions) least = std::min(least, motion.end[0]);
  CHECK(least == Approx(-10.0).margin(0.01));
  for (const char* line : {"G1 PO[X]=(1,2) F5", "G91 POLY PO[X]=(1,2) F5", "POLY PO[A]=(1,2) F5",
                           "POLY X1 PO[X]=(1,2) F5", "POLY PO[X]=(1,2,3,4,5,6) F5",
                           "POLY PO[X]=(1,,2) F5", "POLY PO[X]=(1,2) PL=0 F5", "POLY A10 F5"})
    CHECK(errors(std::string("G0 X0 Y0 Z0\n") + line) == Codes{"NC262"});
  CHECK(errors("POLY PO[X]=(1,2) F5") == Codes{"NC262"});  // unknown start
  CHECK(errors("G0 X0 Y0 Z0\nPOLY PO[X]=(10,5) F5\nCT X20 Y5") == Codes{"NC220"});
  CHECK(errors("BSPLINE") == Codes{"NC140", "NC200"});
  CHECK(errors("CSPLINE X1") == Codes{"NC140", "NC200"});
}

TEST_CASE("siemens: mirror images and scales", "[formats][nc][siemens]") {
  CHECK(end("MIRROR X0\nG0 X1 Y2 Z3").isApprox(Vec3(-1, 2, 3)));
  CHECK(end("TRANS X10\nAMIRROR X0 Y0\nG0 X1 Y2 Z3").isApprox(Vec3(9, -2, 3)));
  CHECK(end("TRANS X10\nMIRROR X0\nG0 X1 Y2 Z3").isApprox(Vec3(-1, 2, 3)));
  CHECK(end("MIRROR X0\nMIRROR\nG0 X1 Y2 Z3").isApprox(Vec3(1, 2, 3)));
  CHECK(end("MIRROR X0\nATRANS X10\nG0 X1 Y2 Z3").isApprox(Vec3(-11, 2, 3)));
  CHECK(end("SCALE X2 Y2 Z0.5\nG0 X1 Y2 Z3").isApprox(Vec3(2, 4, 1.5)));
  CHECK(end("TRANS X10\nASCALE X2\nG0 X1 Y2 Z3\nX=IC(1)").isApprox(Vec3(14, 2, 3)));
  CHECK(end("ROT Z90\nASCALE X3\nG0 X1 Y0 Z0").isApprox(Vec3(0, 3, 0)));
  // A mirrored arc turns the other way round in space: its points are mirrored.
  const auto plain = last("G0 X10 Y0 Z0\nG3 X0 Y10 Z-2 I-10 J0 F600");
  const auto mirrored = last("MIRROR X0\nG0 X10 Y0 Z0\nG3 X0 Y10 Z-2 I-10 J0 F600");
  for (double s = 0.0; s <= 1.0; s += 0.1) {
    const Vec3 p = on_arc(plain, s);
    CHECK((on_arc(mirrored, s) - Vec3(-p.x(), p.y(), p.z())).norm() < 1e-9);
  }
  CHECK(mirrored.duration == Approx(plain.duration));
  const auto scaled = last("SCALE X2 Y2 Z3\nG0 X10 Y0 Z0\nG3 X0 Y10 Z-2 I-10 J0 F600");
  for (double s = 0.0; s <= 1.0; s += 0.1) {
    const Vec3 p = on_arc(plain, s);
    CHECK((on_arc(scaled, s).head<2>() - 2.0 * p.head<2>()).norm() < 1e-9);
  }
  CHECK(scaled.end[2] == Approx(-6.0));
  CHECK(scaled.duration == Approx(std::hypot(20.0 * kPi / 2.0, 6.0) / 10.0));
  const auto depth = last("MIRROR Z0\nG0 X10 Y0 Z0\nG3 X0 Y10 I-10 J0 F600");
  CHECK((on_arc(depth, 0.5) - on_arc(plain, 0.5)).norm() < 1e-9);
  const auto cip = last("MIRROR X0\nG0 X10 Y0 Z0\nCIP X-10 Y0 I1=0 J1=10 F600");
  CHECK((on_arc(cip, 0.5) - Vec3(0, 10, 0)).norm() < 1e-9);
  for (const char* lines :
       {"SCALE X2\nG0 X10 Y0 Z0\nG3 X0 Y10 I-10 J0 F5", "SCALE X0", "SCALE X-1", "MIRROR A0",
        "SCALE X2\nAROT Z30", "SCALE X2\nG0 X10 Y0 Z0\nCIP X-10 Y0 I1=0 J1=10 F5",
        "MIRROR X0\nTRAORI\nG0 X0 Y0 Z0 A3=1", "MIRROR X0\nTRAORI\nG0 X0 Y0 Z0 B5"})
    CHECK(errors(lines) == Codes{"NC245"});
  CHECK(errors("MIRROR X0 G0") == Codes{"NC211"});
}

TEST_CASE("siemens: shifts of single axes by G58 and G59", "[formats][nc][siemens]") {
  CHECK(end("TRANS X10 Y20 Z30\nATRANS X5\nG58 X100\nG0 X1 Y2 Z3").isApprox(Vec3(106, 22, 33)));
  CHECK(end("TRANS X10\nATRANS X5\nG59 X1 Y7\nG0 X1 Y2 Z3").isApprox(Vec3(12, 9, 3)));
  CHECK(end("G58 X10\nG59 X5\nG58 X20\nG59 X1\nG0 X0 Y0 Z0").isApprox(Vec3(21, 0, 0)));
  CHECK(end("G58 X10\nTRANS\nG0 X0 Y0 Z0").isApprox(Vec3(0, 0, 0)));
  CHECK(errors("ROT Z30\nG58 X10") == Codes{"NC245"});
  CHECK(errors("G59 X10\nTRANS X5") == Codes{"NC245"});
  CHECK(end("G59 X10\nTRANS\nTRANS X5\nG0 X0 Y0 Z0").isApprox(Vec3(5, 0, 0)));
}

TEST_CASE("siemens: settable offsets that the program writes", "[formats][nc][siemens]") {
  CHECK(end("$P_UIFR[1,X,TR]=10 $P_UIFR[1,Y,TR]=20+1\nG54\nG0 X1 Y2 Z3").isApprox(Vec3(11, 23, 3)));
  CHECK(end("$P_UIFR[2]=CTRANS(X,10,Y,20,Z,30)\nG55 G0 X1 Y2 Z3").isApprox(Vec3(11, 22, 33)));
  CHECK(end("$P_UIFR[1]=CTRANS(X,10):CROT(Z,90)\nG54 G0 X1 Y0 Z0").isApprox(Vec3(10, 1, 0)));
  CHECK(end("$P_UIFR[1,Z,RT]=90\nG54 G0 X1 Y0 Z0").isApprox(Vec3(0, 1, 0)));
  CHECK(end("G700\n$P_UIFR[1,X,TR]=1\nG54 G0 X1 Y0 Z0").isApprox(Vec3(50.8, 0, 0)));
  // In force with the next G54 only.
  CHECK(end("G54 G0 X0 Y0 Z0\n$P_UIFR[1,X,TR]=10\nX1").isApprox(Vec3(1, 0, 0)));
  CHECK(end("G54 G0 X0 Y0 Z0\n$P_UIFR[1,X,TR]=10\nG54\nX1").isApprox(Vec3(11, 0, 0)));
  nc::InterpreterSettings settings = mill_settings();
  settings.work_offsets[1].words = {1, 2, 3, 0, 0, 0, 0, 0, 0};
  const Run r =
      run("$P_UIFR[1,X,TR]=10\nG54\nG0 X0 Y0 Z0\nM30\n", settings, nc::InputDialect::siemens);
  REQUIRE(r.ok);
  CHECK(point(r.sink.motions.back().end) == Vec3(10, 2, 3));
  for (const char* line :
       {"$P_UIFR[0,X,TR]=1", "$P_UIFR[5,X,TR]=1", "$P_UIFR[1,X,RT]=5", "$P_UIFR[1,X,SC]=2",
        "$P_UIFR[1,X,FI]=1", "$P_UIFR[1]=CMIRROR(X)", "$P_UIFR[1]=CTRANS(X)", "$P_UIFR[1,X]=1",
        "G54 $P_UIFR[1,X,TR]=1", "G70\n$P_UIFR[1,X,TR]=1", "$P_UIFR[1]=CTRANS([X,1)",
        "$P_UIFR[1,X,TR,1]=1", "$P_UIFR[1]=CROT(Z,5):CTRANS(X,1)"}) {
    INFO(line);
    CHECK(errors(line) == Codes{"NC245"});
  }
  CHECK(errors("$P_PFRAME=CTRANS(X,1)") == Codes{"NC140", "NC200"});
  CHECK(errors("$P_UBFR[X,TR]=1") == Codes{"NC140", "NC200"});
}

TEST_CASE("siemens: the plane of CYCLE800", "[formats][nc][siemens]") {
  const std::string swivel = "CYCLE800(1,\"TC1\",0,57,10,20,30,30,40,50,1,2,3,-1,100,1)\n";
  const auto turn = [](const Vec3& axis, double angle) {
    return rotation_about(axis, angle * kPi / 180.0);
  };
  const auto in_plane = [&](const Vec3& v) -> Vec3 {
    return turn(Vec3::UnitX(), 30) * (turn(Vec3::UnitY(), 40) * (turn(Vec3::UnitZ(), 50) * v));
  };
  const Run r =
      siemens("G54 G0 X0 Y0 Z0\n" + swivel +
              "G0 X5 Y6 Z7\nD0\nG1 X0 Y0 Z0 F600\nG3 X10 Y10 J10\nMCALL "
              "CYCLE81(20,0,2,-5)\nG0 X1 Y1\nMCALL\nG0 SUPA Z500\nCYCLE800()\nG0 X0 Y0 Z0");
  INFO(r.all_text());
  REQUIRE(r.ok);
  const auto& m = r.sink.motions;
  REQUIRE(m.size() == 10);
  const auto place = [&](double x, double y, double z) -> Vec3 {
    return Vec3(10, 20, 30) + in_plane(Vec3(x + 1, y + 2, z + 3));
  };
  CHECK_FALSE(m[0].tcp);
  CHECK((m[1].unknown_start & 7) == 7);  // how the axes went to the plane is not known
  CHECK(m[1].unknown_end == 0x1c0);
  for (std::size_t i = 1; i <= 7; ++i) {
    INFO(i);
    CHECK(m[i].tcp);
    CHECK(m[i].axis_vector);
    CHECK((m[i].end_axis - in_plane(Vec3::UnitZ())).norm() < 1e-12);
    CHECK(m[i].start_axis == m[i].end_axis);
  }
  CHECK((point(m[1].end) - place(5, 6, 7)).norm() < 1e-12);
  CHECK((point(m[2].end) - place(0, 0, 0)).norm() < 1e-12);
  CHECK((m[3].arc.centre - place(0, 10, 0)).norm() < 1e-12);
  CHECK((m[3].arc.normal - in_plane(Vec3::UnitZ())).norm() < 1e-12);
  CHECK((point(m[6].end) - place(1, 1, -5)).norm() < 1e-12);
  CHECK((point(m[7].end) - place(1, 1, 20)).norm() < 1e-12);
  CHECK(m[8].machine_position);
  CHECK_FALSE(m[8].tcp);
  CHECK_FALSE(m[9].tcp);
  CHECK((m[9].unknown_start & 0x3f) == 0x3f);
  CHECK(point(m[9].end) == Vec3(0, 0, 0));
  CHECK(r.summary.uses_tcp);
  const auto mode = [](const char* values) {
    return "CYCLE800(1,\"TC1\"," + std::string(values) + ")\nG0 X0 Y0 Z0";
  };
  CHECK(errors(mode("0,57,0,0,0,30,0,0,0,0,0,-1")).empty());
  CHECK(errors(mode("10,57,,,,30,,,,,,1")).empty());
  for (const char* values : {"0,27,0,0,0,30,0,0,0,0,0,-1", "0,192,0,0,0,30,0,0,0,0,0,-1",
                             "1,57,0,0,0,30,0,0,0,0,0,-1", "0,57,0,0,0,30,0,0,0,0,0,0",
                             "0,57,0,0,0,30,0,0,0,0,0,-1,0,2", "0,57,0,0,0,_A,0,0,0,0,0,-1"}) {
    INFO(values);
    CHECK(errors(mode(values)) == Codes{"NC245"});
  }
  const std::string good = mode("0,57,0,0,0,30,0,0,0,0,0,-1");
  for (const std::string& lines :
       {"TRANS X5\n" + good, "G18\n" + good, "TRAORI\n" + good, good + "\nTRANS X5",
        good + "\nG58 X5", good + "\nG55", good + "\nTRAORI", good + "\nG0 B5"}) {
    INFO(lines);
    CHECK(errors(lines) == Codes{"NC245"});
  }
  CHECK(errors(good + "\nTRANS\nG54\nCYCLE800(0,\"0\")\nTRAORI").empty());
  CHECK(errors(good + "\nG0 A3=1") == Codes{"NC243"});
  // X Y and Z in blocks of their own, as posts write them: known with the last one.
  const Run apart = siemens(swivel + "G0 X5 Y6\nZ7\nG1 Y0 F5");
  REQUIRE(apart.ok);
  CHECK((apart.sink.motions[0].unknown_end & 7) == 7);
  CHECK((apart.sink.motions[1].unknown_start & 7) == 7);
  CHECK((apart.sink.motions[1].unknown_end & 7) == 0);
  CHECK((point(apart.sink.motions[1].end) - place(5, 6, 7)).norm() < 1e-9);
  CHECK((point(apart.sink.motions[2].end) - place(5, 0, 7)).norm() < 1e-9);
  // After another tool length the place in the plane is not known.
  CHECK((last(good + "\nT1 M6\nG0 X1").unknown_end & 7) == 7);
}

}  // namespace smoothpost::test
