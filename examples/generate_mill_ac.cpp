// Makes the example "mill_ac": a milling program for a table-table machine with A and C (machine
// table_table_ac) in tool-centre-point mode: facing with three axes, a groove of arcs, a saddle
// finished with A and C moving together, and a pocket on a plane tilted by 60 degrees (3+2).
//
//   example_generate_mill_ac FOLDER

#include <filesystem>
#include <iostream>
#include <vector>

#include "examples/nc_text.h"
#include "kernels/core/pose.h"
#include "kernels/core/units.h"

namespace smoothpost::examples {

namespace {

constexpr double kSafe = 60.0;     // mm, height of positioning moves
constexpr double kTopFace = 20.0;  // mm, height of the faced top
constexpr int kLength = 4;         // decimals
constexpr int kAngle = 4;

/// Table angles, rad, that bring `axis` of the part upright: axis = (sin A sin C, sin A cos C, cos
/// A), A < 0.
struct TableAngles {
  double a, c;
};

/// C is the turn nearest to `last_c`.
TableAngles table_angles(const Vec3& axis, double last_c) {
  const double a = -std::atan2(std::hypot(axis.x(), axis.y()), axis.z());
  double c = std::atan2(-axis.x(), -axis.y());
  c += 2.0 * kPi * std::round((last_c - c) / (2.0 * kPi));
  return {a, c};
}

/// z = 12 + (x² − y²) / 220, a saddle below the top.
Vec3 saddle_point(double x, double y) { return {x, y, 12.0 + (x * x - y * y) / 220.0}; }
Vec3 saddle_normal(double x, double y) { return Vec3(-x / 110.0, y / 110.0, 1.0).normalized(); }

class MillWriter {
 public:
  void write(const std::string& path) {
    open();
    face();
    groove();
    saddle();
    pocket();
    close();
    text_.write(path);
  }

 private:
  void open() {
    text_.comment("SADDLE BLOCK, TABLE-TABLE MACHINE A C");
    text_.comment("ZERO AT THE CROSSING OF THE ROTARY AXES, BLOCK 90 X 70 X 20");
    text_.comment("T1 BALL MILL D6, PROGRAMMED POINT IS THE TIP");
    text_.line("G21 G90 G17 G94 G40 G49 G80");
    text_.line("G54");
    text_.line("T1 M6");
    text_.line("G43 H1");
    text_.line("M428 (TOOL CENTRE POINT ON)");
    text_.line("S2000 M3");
    text_.line("M8");
  }

  void close() {
    rapid({0, 0, kSafe}, {0.0, 0.0});
    text_.line("M9");
    text_.line("M5");
    text_.line("M429 (TOOL CENTRE POINT OFF)");
    text_.line("G49");
    text_.line("M30");
  }

  void face() {
    text_.comment("FACING, 3 AXES");
    rapid({-50, -32, kSafe}, {0.0, 0.0});
    rapid({-50, -32, kTopFace + 2.0}, {0.0, 0.0});
    feed({-50, -32, kTopFace}, 300.0);
    for (int pass = 0; pass <= 8; ++pass) {
      const double y = -32.0 + 8.0 * pass;
      const double side = pass % 2 ? -1.0 : 1.0;
      if (pass > 0) feed({-50.0 * side, y, kTopFace}, 600.0);
      feed({50.0 * side, y, kTopFace}, 900.0);
    }
    feed({50, 32, kTopFace + 2.0}, 900.0);
    rapid({50, 32, kSafe}, {0.0, 0.0});
  }

  /// A ring: half a turn of helix down, half a turn by its centre, two quarters back by their
  /// radius.
  void groove() {
    text_.comment("RING GROOVE R25, ARCS AT A0");
    rapid({25, 0, kSafe}, {0.0, 0.0});
    rapid({25, 0, kTopFace + 1.0}, {0.0, 0.0});
    feed({25, 0, kTopFace}, 200.0);
    text_.line("G3 X-25.0000 Y0.0000 Z19.0000 I-25.0000 J0.0000 F400");
    text_.line("X25.0000 I25.0000");
    text_.line("G2 X0.0000 Y-25.0000 R25.0000");
    text_.line("X-25.0000 Y0.0000 R25.0000");
    text_.forget();
    feed({-25, 0, kTopFace + 1.0}, 400.0);
    rapid({-25, 0, kSafe}, {0.0, 0.0});
  }

  /// Passes along x; the tool leans 20 degrees towards −y from the saddle's normal, so that A stays
  /// below −10.
  void saddle() {
    text_.comment("SADDLE FINISHING, A AND C TOGETHER");
    const Mat3 lean = rotation_about(Vec3::UnitX(), radians_from_degrees(20.0));
    constexpr int kPasses = 7;
    constexpr int kSteps = 18;
    for (int pass = 0; pass < kPasses; ++pass) {
      const double y = -18.0 + 6.0 * pass;
      for (int i = 0; i <= kSteps; ++i) {
        const double share = static_cast<double>(pass % 2 ? kSteps - i : i) / kSteps;
        const double x = -27.0 + 54.0 * share;
        const Vec3 axis = lean * saddle_normal(x, y);
        const TableAngles angles = table_angles(axis, last_.c);
        const Vec3 point = saddle_point(x, y);
        if (pass == 0 && i == 0) {
          rapid({x, y, kSafe}, angles);
          rapid(point + 5.0 * axis, angles);
        }
        feed(point, angles, i == 0 ? 300.0 : 720.0);
        if (pass == kPasses - 1 && i == kSteps) {
          rapid(point + 30.0 * axis, angles);
          rapid({x, y, kSafe}, angles);
        }
      }
    }
  }

  /// A pocket 24 x 16, 3 deep, in the plane through (−30, 0, 10) that looks to −x, 60 degrees down.
  void pocket() {
    text_.comment("POCKET ON THE CHAMFER, 3+2 AT A-60 C90");
    const TableAngles angles{radians_from_degrees(-60.0), radians_from_degrees(90.0)};
    const Vec3 axis(std::sin(angles.a) * std::sin(angles.c),
                    std::sin(angles.a) * std::cos(angles.c), std::cos(angles.a));
    const Vec3 across = Vec3::UnitY();
    const Vec3 up = axis.cross(across);
    const auto at = [&](double u, double v, double depth) {
      return Vec3(Vec3(-30, 0, 10) + u * across + v * up - depth * axis);
    };
    rapid({-30, 0, kSafe}, angles);
    rapid(at(0, 0, -5.0), angles);
    for (const double depth : {1.5, 3.0}) {
      feed(at(0, 0, depth), angles, 150.0);
      for (const double share : {0.4, 0.7, 1.0}) {
        const double u = 9.0 * share;
        const double v = 5.0 * share;
        for (const auto& [su, sv] :
             {std::pair{1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}, {-1.0, -1.0}, {1.0, -1.0}})
          feed(at(su * u, sv * v, depth), angles, 500.0);
      }
      feed(at(0, 0, depth), angles, 800.0);
    }
    rapid(at(0, 0, -40.0), angles);
    rapid({-30, 0, kSafe}, angles);
  }

  void rapid(const Vec3& tip, const TableAngles& angles) { move("G0", tip, angles); }
  void feed(const Vec3& tip, double speed) { feed(tip, {0.0, 0.0}, speed); }
  void feed(const Vec3& tip, const TableAngles& angles, double speed) {
    last_ = angles;
    text_.block("G1", {{'X', tip.x(), kLength},
                       {'Y', tip.y(), kLength},
                       {'Z', tip.z(), kLength},
                       {'A', degrees_from_radians(angles.a), kAngle},
                       {'C', degrees_from_radians(angles.c), kAngle},
                       {'F', speed, 0}});
  }
  void move(const std::string& head, const Vec3& tip, const TableAngles& angles) {
    last_ = angles;
    text_.block(head, {{'X', tip.x(), kLength},
                       {'Y', tip.y(), kLength},
                       {'Z', tip.z(), kLength},
                       {'A', degrees_from_radians(angles.a), kAngle},
                       {'C', degrees_from_radians(angles.c), kAngle}});
  }

  NcText text_;
  TableAngles last_{0.0, 0.0};
};

}  // namespace

}  // namespace smoothpost::examples

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: example_generate_mill_ac FOLDER\n";
    return 2;
  }
  try {
    std::filesystem::create_directories(argv[1]);
    smoothpost::examples::MillWriter().write(std::string(argv[1]) + "/mill_ac.ngc");
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
