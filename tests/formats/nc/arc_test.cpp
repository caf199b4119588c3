#include "formats/nc/arc.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/formats/nc/recording.h"

namespace smoothpost::test {
namespace {

const CanonicalMotion& last(const Run& run) { return run.sink.motions.back(); }

Vec3 xyz(const AxisWords& words) { return {words[0], words[1], words[2]}; }

/// Where the arc's definition takes its start: turned about the centre, moved along the normal.
Vec3 carried(const CanonicalMotion& m) {
  const Vec3 from = xyz(m.start) - m.arc.centre;
  const Vec3 turned = Eigen::AngleAxisd(m.arc.sweep, m.arc.normal) * from;
  const double climb = m.arc.normal.dot(xyz(m.end) - xyz(m.start));
  return m.arc.centre + turned + climb * m.arc.normal;
}

std::vector<std::string> one(const char* code) { return {code}; }

}  // namespace

TEST_CASE("arc: start turned by the sweep is the end, in all planes and forms",
          "[formats][nc][arc]") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-50.0, 50.0);
  const char* planes[] = {"G17", "G18", "G19"};
  const char* axes[] = {"XYZ", "ZXY", "YZX"};
  const char* centres[] = {"IJ", "KI", "JK"};
  std::size_t tested = 0;
  for (int i = 0; i < 3'000; ++i) {
    const auto p = static_cast<std::size_t>(random() % 3);
    const bool clockwise = random() % 2 == 0;
    const double ci = any(random), cj = any(random) + 60.0,
                 turn = 0.05 + 6.1 * (random() % 1000) / 1000.0;
    const double angle = clockwise ? -turn : turn;
    const double dx = ci - ci * std::cos(angle) + cj * std::sin(angle);
    const double dy = cj - ci * std::sin(angle) - cj * std::cos(angle);
    char text[400];
    const int form = static_cast<int>(random() % 3);
    const double x0 = any(random), y0 = any(random);
    std::snprintf(text, sizeof text, "%s G0 %c%.9f %c%.9f %c0\n", planes[p], axes[p][0], x0,
                  axes[p][1], y0, axes[p][2]);
    std::string program = text;
    const char* code = clockwise ? "G2" : "G3";
    if (form == 0) {
      std::snprintf(text, sizeof text, "%s %c%.9f %c%.9f %c%.9f %c%.9f %c4 F500", code, axes[p][0],
                    x0 + dx, axes[p][1], y0 + dy, centres[p][0], ci, centres[p][1], cj, axes[p][2]);
    } else if (form == 1) {
      std::snprintf(text, sizeof text, "G90.1 %s %c%.9f %c%.9f %c%.9f %c%.9f %c4 F500", code,
                    axes[p][0], x0 + dx, axes[p][1], y0 + dy, centres[p][0], x0 + ci, centres[p][1],
                    y0 + cj, axes[p][2]);
    } else {
      const double r = std::hypot(ci, cj) * (turn > kPi ? -1.0 : 1.0);
      std::snprintf(text, sizeof text, "%s %c%.9f %c%.9f R%.9f %c4 F500", code, axes[p][0], x0 + dx,
                    axes[p][1], y0 + dy, r, axes[p][2]);
    }
    program += text;
    const Run r = run_lines(program);
    INFO(program << "\n" << r.all_text());
    REQUIRE(r.ok);
    const CanonicalMotion& m = last(r);
    REQUIRE(m.is_arc);
    REQUIRE((carried(m) - xyz(m.end)).norm() < 1e-6);
    // Near half a circle and near a full one a radius determines the sweep badly.
    const double margin = form == 2 ? 2e-3 : 1e-8;
    REQUIRE(m.arc.sweep == Approx(angle).margin(margin));
    const double length = std::hypot(std::hypot(ci, cj) * turn, 4.0);
    REQUIRE(m.duration == Approx(length / 500.0 * 60.0).epsilon(1e-4));
    ++tested;
  }
  CHECK(tested == 3'000);
}

TEST_CASE("arc: sense is seen from the positive end of the third axis", "[formats][nc][arc]") {
  // rs274: G18 G2 X10 I2.5 from X5: ARC_FEED(Z, X, ..., -1).
  const Run zx = run_lines("F100 G0 X5 Y2 Z3\nG18 G2 X10 Z3 I2.5 K0");
  CHECK(last(zx).arc.normal.isApprox(Vec3::UnitY()));
  CHECK(last(zx).arc.sweep == Approx(-kPi));
  CHECK(last(zx).arc.centre.isApprox(Vec3(7.5, 2, 3)));
  const Run yz = run_lines("F100 G0 X5 Y2 Z3\nG19 G3 Y6 J2");
  CHECK(last(yz).arc.normal.isApprox(Vec3::UnitX()));
  CHECK(last(yz).arc.sweep == Approx(kPi));
  const Run xy = run_lines("F100 G0 X0 Y0\nG3 X10 Y10 J10");
  CHECK(last(xy).arc.sweep == Approx(kPi / 2));
}

TEST_CASE("arc: full circles, turns and helices", "[formats][nc][arc]") {
  CHECK(last(run_lines("F10 G0 X1 Y0\nG2 I2")).arc.sweep == Approx(-2 * kPi));
  CHECK(last(run_lines("F10 G0 X1 Y0\nG3 I2 P3")).arc.sweep == Approx(6 * kPi));
  const Run helix = run_lines("F10 G0 X1 Y0 Z0 A0\nG2 X1 I1 P3 Z3 A10");
  CHECK(last(helix).arc.sweep == Approx(-6 * kPi));
  CHECK(last(helix).end[2] == 3.0);
  CHECK(last(helix).end[3] == Approx(radians_from_degrees(10)));
  CHECK(last(helix).duration == Approx(std::hypot(6 * kPi, 3.0) / 10.0 * 60.0));
  CHECK(last(run_lines("F10 G0 X1 Y0\nG2 P2 X5 I2")).arc.sweep == Approx(-3 * kPi));
  CHECK(run_lines("F10 G0 X1\nG2 X5 P2 R10").ok);
  // A block of I J K alone goes on in the arc mode.
  CHECK(run_lines("F10 G0 X1\nG2 I2\nI3\nJ1").sink.motions.size() == 4);
  // Incremental words that add up to the start up to round-off are a full circle too.
  CHECK(last(run_lines("F10 G91 G0 X0.1\nX0.2\nG90 G3 X0.3 I5")).arc.sweep == Approx(2 * kPi));
}

TEST_CASE("arc: radius form", "[formats][nc][arc]") {
  const Run small = run_lines("F10 G0 X0 Y0\nG2 X10 R10");
  CHECK(last(small).arc.sweep == Approx(-kPi / 3));
  CHECK(last(small).arc.centre.y() == Approx(-std::sqrt(75.0)));
  const Run large = run_lines("F10 G0 X0 Y0\nG2 X10 R-10");
  CHECK(last(large).arc.sweep == Approx(-5 * kPi / 3));
  CHECK(last(large).arc.centre.y() == Approx(std::sqrt(75.0)));
  const Run left = run_lines("F10 G0 X0 Y0\nG3 X10 R10");
  CHECK(last(left).arc.centre.y() == Approx(std::sqrt(75.0)));
  // Half the chord may exceed R by 0.00127 mm.
  const Run repaired = run_lines("F10 G0 X0 Y0\nG2 X10 R4.999");
  CHECK(last(repaired).arc.centre.x() == Approx(5.0));
  CHECK(last(repaired).arc.sweep == Approx(-kPi));
  CHECK(run_lines("F10 G0 X0 Y0\nG2 X10 R4.9").errors() == one("NC221"));
  CHECK(run_lines("F1 G0 X0 Y0\nG3 X20.0025 R10").ok);
  CHECK(run_lines("F1 G0 X0 Y0\nG3 X20.0026 R10").errors() == one("NC221"));
  CHECK(run_lines("F10 G0 X1 Y0\nG2 X1 Y0 R2").errors() == one("NC221"));
  CHECK(run_lines("F10 G0 X1\nG2 R2").errors() == one("NC220"));
  CHECK(run_lines("F10 G0 X1\nG2 Z2 R2").errors() == one("NC220"));
}

TEST_CASE("arc: centre tolerance", "[formats][nc][arc]") {
  // rs274: r 5.01/4.99 accepted, 50.05/49.95 rejected.
  CHECK(run_lines("F10 G0 X0 Y0\nG2 X10 I5.01").ok);
  CHECK(run_lines("F10 G0 X0 Y0\nG2 X100 I50.05").errors() == one("NC221"));
  CHECK(run_lines("F1 G0 X0 Y0\nG3 X20.03 I10").errors() == one("NC221"));
  CHECK(run_lines("F1 G0 X0 Y0\nG3 X20.021 I10").ok);
  CHECK(run_lines("F1 G20 G0 X0 Y0\nG3 X20.003 I10").ok);  // 0.0028284 inch or 0.1 %
  CHECK(run_lines("F1 G0 X0 Y0\nG3 I0.0010").errors() == one("NC221"));
  CHECK(run_lines("F1 G0 X0 Y0\nG3 I0.0027").ok);
  CHECK(run_lines("F1 G0 X0 Y0\nG2 X1 I1").errors() == one("NC221"));
}

TEST_CASE("arc: words that do not fit", "[formats][nc][arc]") {
  CHECK(run_lines("F10 G0 X1\nG2 X5 I2 R1").errors() == one("NC220"));
  CHECK(run_lines("F10 G0 X1\nG2 X5").errors() == one("NC220"));
  CHECK(run_lines("F10 G0 X1\nG2").errors() == one("NC220"));
  CHECK(run_lines("F10 G0 X1\nG2 X5 I2 K1").errors() == one("NC220"));
  CHECK(run_lines("F10 G18 G0 X1\nG2 X2 J1").errors() == one("NC220"));
  CHECK(run_lines("F10 G90.1 G0 X1 Y0\nG2 X5 I3 J0\nG2 X1 I3").errors() == one("NC220"));
  CHECK(run_lines("F10 G0 X1\nG2 X1 P1.5 I3").errors() == one("NC222"));
  CHECK(run_lines("F10 G0 X1\nG2 X1 P0 I3").errors() == one("NC222"));
  CHECK(run_lines("G0 X1\nG2 I3").errors() == one("NC213"));
  CHECK(run_lines("I3").errors() == one("NC215"));
}

TEST_CASE("arc: turned and shifted with the work system", "[formats][nc][arc]") {
  const Run r =
      run_lines("G10 L2 P1 X10 Y5 Z1 R90\nG52 X1\nF100 G0 X0 Y0 Z0\nG3 X2 I1\nG18 G2 X4 I1");
  REQUIRE(r.ok);
  for (std::size_t i : {1u, 2u}) {
    const CanonicalMotion& m = r.sink.motions[i];
    CHECK((carried(m) - xyz(m.end)).norm() < 1e-9);
  }
  // World: R90 takes (1 + 1, 0) to (0, 2).
  CHECK(r.sink.motions[1].arc.centre.isApprox(Vec3(10, 7, 1), 1e-12));
  CHECK(r.sink.motions[2].arc.normal.isApprox(Vec3(-1, 0, 0), 1e-12));
}

TEST_CASE("arc: inch words", "[formats][nc][arc]") {
  const Run r = run_lines("G20\nF10 G0 X0 Y0\nG3 X2 I1");
  CHECK(last(r).arc.centre.x() == Approx(25.4));
  CHECK(last(r).duration == Approx(kPi / 10.0 * 60.0));
}

}  // namespace smoothpost::test
