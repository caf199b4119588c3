// Makes the two cases of paper B in our own geometry, from formulas: case1.csv and case2.csv
// (cutter locations) and the same as NC programs with I J K vectors.
//
//   example_generate_paper_b FOLDER
//
// Case 2: 627.5 mm straight in the developed sheet, over a convex and a concave cylindrical bend
// of 77 degrees each, crossed 25 degrees off square on 36 mm of path (arcs of helices).
// Case 1: 1200 mm on an arc of radius 2500 mm; the normal sways by 0.6 degrees about 6.

#include <filesystem>
#include <fstream>
#include <iostream>
#include <vector>

#include "examples/nc_text.h"
#include "kernels/core/pose.h"
#include "kernels/core/tool_path.h"
#include "kernels/core/units.h"

namespace smoothpost::examples {

namespace {

Vec3 direction(double azimuth_deg, double from_vertical_deg) {
  const double a = radians_from_degrees(azimuth_deg);
  const double b = radians_from_degrees(from_vertical_deg);
  return {std::cos(a) * std::sin(b), std::sin(a) * std::sin(b), std::cos(b)};
}

/// A place of the path on the sheet: T along it, N away from the sheet.
struct Place {
  Vec3 point, tangent, normal;
};

/// `s` further on a flat.
Place flat(const Place& from, double s) {
  return {from.point + s * from.tangent, from.tangent, from.normal};
}

/// Of a bend: the whole turn about B turned by `oblique` towards T, on `length` of path.
struct Bend {
  double turn, oblique, length;  // rad, rad, mm
};

/// `s` further on a cylinder: an arc of a helix.
Place bent(const Place& from, const Bend& bend, double s) {
  const Vec3 b = from.normal.cross(from.tangent);
  const Vec3 axis = std::cos(bend.oblique) * b + std::sin(bend.oblique) * from.tangent;
  const double rate = bend.turn / bend.length;
  const Vec3 along = from.tangent.dot(axis) * axis;
  const Vec3 across = from.tangent - along;
  const Mat3 turned = rotation_about(axis.normalized(), rate * s);
  return {
      from.point + along * s +
          (std::sin(rate * s) * across + (1.0 - std::cos(rate * s)) * axis.cross(across)) / rate,
      turned * from.tangent, turned * from.normal};
}

Place case2_at(double s) {
  const Bend convex{radians_from_degrees(77.0), radians_from_degrees(25.0), 36.0};
  const Bend concave{radians_from_degrees(-77.0), radians_from_degrees(-25.0), 36.0};
  Place at{Vec3(700.0, 700.0, 1000.0), Vec3::Zero(), direction(-70.0, 16.0)};
  const Vec3 ahead = direction(55.0, 90.0);
  at.tangent = (ahead - ahead.dot(at.normal) * at.normal).normalized();
  if (s <= 200.0) return flat(at, s);
  at = flat(at, 200.0);
  if (s <= 236.0) return bent(at, convex, s - 200.0);
  at = bent(at, convex, 36.0);
  if (s <= 391.0) return flat(at, s - 236.0);
  at = flat(at, 155.0);
  if (s <= 427.0) return bent(at, concave, s - 391.0);
  return flat(bent(at, concave, 36.0), s - 427.0);
}

Place case1_at(double s) {
  constexpr double kRadius = 2500.0;
  const Vec3 first = direction(75.0, 94.0);
  const Vec3 second = direction(-15.0, 90.0);
  const double angle = s / kRadius;
  const Vec3 tangent = std::cos(angle) * first + std::sin(angle) * second;
  const Vec3 sway = direction(25.0 + 14.0 * std::cos(2.0 * kPi * s / 800.0),
                              6.0 + 0.6 * std::sin(2.0 * kPi * s / 900.0));
  return {Vec3(300.0, 150.0, 700.0) +
              kRadius * (std::sin(angle) * first + (1.0 - std::cos(angle)) * second),
          tangent, (sway - sway.dot(tangent) * tangent).normalized()};
}

struct Output {
  std::filesystem::path folder;
  std::string name, title;
  double feed_mm_per_min;
};

void write(const Output& out, const std::vector<Place>& path) {
  std::ofstream csv(out.folder / (out.name + ".csv"), std::ios::binary);
  csv << "# " << out.title << "\n# nozzle tip; tool axis = surface normal, from tip to holder\n"
      << "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min,beam\n";
  NcText nc;
  nc.comment(out.title);
  nc.line("G21 G90 G17 G94");
  nc.line("G43.5 H1 (TOOL CENTRE POINT, AXIS BY I J K)");
  for (const Place& p : path) {
    for (int c = 0; c < 3; ++c) csv << fixed(p.point[c], 6) << ',';
    for (int c = 0; c < 3; ++c) csv << fixed(p.normal[c], 9) << ',';
    csv << fixed(out.feed_mm_per_min, 0) << ",1\n";
    nc.forget();  // a component that is not written is 0
    nc.block(&p == path.data() ? "G0" : "G1", {{'X', p.point.x(), 4},
                                               {'Y', p.point.y(), 4},
                                               {'Z', p.point.z(), 4},
                                               {'I', p.normal.x(), 7},
                                               {'J', p.normal.y(), 7},
                                               {'K', p.normal.z(), 7},
                                               {'F', out.feed_mm_per_min, 0}});
  }
  nc.line("G49");
  nc.line("M30");
  nc.write((out.folder / (out.name + ".ngc")).string());
  csv.close();
  if (!csv) throw std::runtime_error("cannot write " + out.name);
}

}  // namespace

}  // namespace smoothpost::examples

int main(int argc, char** argv) {
  using namespace smoothpost::examples;
  if (argc != 2) {
    std::cerr << "usage: example_generate_paper_b FOLDER\n";
    return 2;
  }
  try {
    std::filesystem::create_directories(argv[1]);
    std::vector<Place> path;
    for (int i = 0; i <= 360; ++i) path.push_back(case1_at(1200.0 * i / 360.0));
    write({argv[1], "case1", "CASE 1: 1200 MM, SMALL CHANGES OF THE NORMAL", 20000.0}, path);
    path.clear();
    for (int i = 0; i <= 627; ++i) path.push_back(case2_at(627.5 * i / 627.0));
    write({argv[1], "case2", "CASE 2: 627.5 MM, TWO BENDS OF 77 DEG, 25 DEG OFF SQUARE", 15000.0},
          path);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
