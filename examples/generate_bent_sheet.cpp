// Makes the example "bent_sheet": a sheet metal part with two bends on each side (bend lines 8 and
// 12 degrees off square) as STL, and the NC program that a CAM system would export to cut it on a
// 5+1-axis laser in tool-centre-point mode: a trimming contour over the bends, a round hole, a slot
// on the flank. Also the slot alone in inches.
//
//   example_generate_bent_sheet FOLDER

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <iostream>
#include <vector>

#include "examples/nc_text.h"
#include "kernels/core/pose.h"
#include "kernels/core/units.h"

namespace smoothpost::examples {

namespace {

constexpr double kTop = 60.0;          // mm, height of the top flat over the flanges
constexpr double kThickness = 1.5;     // mm
constexpr double kWidth = 200.0;       // mm in y, on the top flat
constexpr double kOuterRadius = 25.0;  // mm, convex bend, at the upper surface
constexpr double kInnerRadius = 20.0;  // mm, concave bend, at the upper surface
constexpr double kFlange = 35.0;       // mm
constexpr double kGap = 1.0;           // mm, nozzle tip over the surface
constexpr double kChord = 0.004;  // mm, largest distance of the programmed lines from the contour
constexpr double kClear = 110.0;  // mm, height of positioning moves

/// A place of the upper surface.
struct SurfacePoint {
  Vec3 point;
  Vec3 normal;
  double c = 0.0;  ///< rad: rotary words of the head for an axis along the normal
  double b = 0.0;
};

/// One side of the part: top flat, convex bend, flank, concave bend, flange.
struct Side {
  double line_x;   ///< where the bend line crosses y = kWidth / 2
  double azimuth;  ///< rad, horizontal direction outwards, square to the bend line
  double turn;     ///< rad, of both bends
  int sign;        ///< of the B word

  Vec3 outward() const { return {std::cos(azimuth), std::sin(azimuth), 0.0}; }
  Vec3 along() const { return {-std::sin(azimuth), std::cos(azimuth), 0.0}; }
  /// The C word that turns the head's B plane into this side's.
  double c() const { return sign < 0 ? azimuth - kPi : azimuth; }
  double outer_arc() const { return kOuterRadius * turn; }
  double inner_arc() const { return kInnerRadius * turn; }
  double flank() const {
    return (kTop - (kOuterRadius + kInnerRadius) * (1.0 - std::cos(turn))) / std::sin(turn);
  }
  double developed() const { return outer_arc() + flank() + inner_arc() + kFlange; }
  /// Point of the bend line at height y of the top flat.
  Vec3 on_line(double y) const {
    const Vec3 d = along();
    return Vec3(line_x, 0.5 * kWidth, kTop) + d * ((y - 0.5 * kWidth) / d.y());
  }
};

const Side kLeft{115.0, radians_from_degrees(172.0), radians_from_degrees(62.0), -1};
const Side kRight{225.0, radians_from_degrees(12.0), radians_from_degrees(74.0), 1};

/// Horizontal way, height and slope of a side's profile at the developed distance u from the bend
/// line.
struct Profile {
  double way, height, slope;
};

Profile profile_of(const Side& side, double u) {
  const double s = std::sin(side.turn);
  const double c = std::cos(side.turn);
  const double arc = std::min(u, side.outer_arc()) / kOuterRadius;
  Profile p{kOuterRadius * std::sin(arc), kTop - kOuterRadius * (1.0 - std::cos(arc)), arc};
  u -= side.outer_arc();
  if (u <= 0.0) return p;
  const double straight = std::min(u, side.flank());
  p = {p.way + c * straight, p.height - s * straight, side.turn};
  u -= side.flank();
  if (u <= 0.0) return p;
  const double left = side.turn - std::min(u, side.inner_arc()) / kInnerRadius;
  p.way += kInnerRadius * (s - std::sin(left));
  p.height -= kInnerRadius * (std::cos(left) - c);
  p.slope = left;
  u -= side.inner_arc();
  if (u > 0.0) p = {p.way + u, 0.0, 0.0};
  return p;
}

/// The point of a side at developed distance u outwards and, along its bend line, above `foot`.
SurfacePoint on_side(const Side& side, const Vec3& foot, double u) {
  const Profile p = profile_of(side, u);
  const Vec3 e = side.outward();
  SurfacePoint out;
  out.point = foot + e * p.way;
  out.point.z() = p.height;
  out.normal = std::sin(p.slope) * e + std::cos(p.slope) * Vec3::UnitZ();
  out.c = side.c();
  out.b = side.sign * p.slope;
  return out;
}

/// The surface over the developed sheet: (x, y) lies on the top flat, or is folded down beside it.
SurfacePoint surface(double x, double y) {
  const Vec3 flat(x, y, kTop);
  const auto beyond = [&](const Side& side) {
    return (flat - side.on_line(0.5 * kWidth)).dot(side.outward());
  };
  for (const Side& side : {kLeft, kRight}) {
    const double u = beyond(side);
    if (u > 0.0) return on_side(side, flat - u * side.outward(), u);
  }
  // Between the bend lines the axis is vertical: C goes over from one side's value to the other's.
  const double left = -beyond(kLeft);
  const double share = left / (left - beyond(kRight));
  return {flat, Vec3::UnitZ(), kLeft.c() + share * (kRight.c() - kLeft.c()), 0.0};
}

Vec3 tip_of(const SurfacePoint& s) { return s.point + kGap * s.normal; }

// ---- the part
// ----------------------------------------------------------------------------------------

using Soup = std::vector<Vec3>;

void add_quad(Soup& soup, const std::array<Vec3, 4>& q) {
  for (const int k : {0, 1, 2, 0, 2, 3}) soup.push_back(q[static_cast<std::size_t>(k)]);
}

/// Rows of surface points across the part, from the left flange's edge to the right one's; columns
/// along y.
std::vector<std::vector<SurfacePoint>> grid_of_part() {
  const auto stations = [](const Side& side) {
    std::vector<double> u{0.0};
    const auto bend = [&u](double length, int steps) {
      const double from = u.back();
      for (int i = 1; i <= steps; ++i) u.push_back(from + length * i / steps);
    };
    bend(side.outer_arc(), 20);  // chord height 25 (1 - cos 1.85 deg) = 0.013 mm at most
    bend(side.flank(), 1);
    bend(side.inner_arc(), 18);
    bend(kFlange, 1);
    return u;
  };
  constexpr int kColumns = 12;
  std::vector<std::vector<SurfacePoint>> rows;
  const auto add_row = [&rows](const Side& side, double u) {
    rows.emplace_back();
    for (int j = 0; j <= kColumns; ++j)
      rows.back().push_back(on_side(side, side.on_line(kWidth * j / kColumns), u));
  };
  auto left = stations(kLeft);
  std::reverse(left.begin(), left.end());
  for (const double u : left) add_row(kLeft, u);
  for (const double u : stations(kRight)) add_row(kRight, u);
  return rows;
}

/// A closed solid: upper side, lower side, rim.
Soup part() {
  const auto grid = grid_of_part();
  const auto top = [&](std::size_t i, std::size_t j) { return grid[i][j].point; };
  const auto low = [&](std::size_t i, std::size_t j) {
    return Vec3(grid[i][j].point - kThickness * grid[i][j].normal);
  };
  const std::size_t rows = grid.size() - 1;
  const std::size_t columns = grid[0].size() - 1;
  Soup soup;
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j) {
      add_quad(soup, {top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1)});
      add_quad(soup, {low(i, j), low(i, j + 1), low(i + 1, j + 1), low(i + 1, j)});
    }
  for (std::size_t i = 0; i < rows; ++i) {
    add_quad(soup, {low(i, 0), low(i + 1, 0), top(i + 1, 0), top(i, 0)});
    add_quad(soup, {low(i + 1, columns), low(i, columns), top(i, columns), top(i + 1, columns)});
  }
  for (std::size_t j = 0; j < columns; ++j) {
    add_quad(soup, {low(0, j + 1), low(0, j), top(0, j), top(0, j + 1)});
    add_quad(soup, {low(rows, j), low(rows, j + 1), top(rows, j + 1), top(rows, j)});
  }
  return soup;
}

void write_stl(const Soup& soup, const std::string& path) {
  std::string bytes = "smoothpost example bent_sheet, mm";
  bytes.resize(80, ' ');
  const auto append = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(static_cast<std::uint32_t>(soup.size() / 3));
  for (std::size_t i = 0; i < soup.size(); i += 3) {
    const Vec3 normal = (soup[i + 1] - soup[i]).cross(soup[i + 2] - soup[i]).normalized();
    for (const Vec3& v : {normal, soup[i], soup[i + 1], soup[i + 2]})
      for (int k = 0; k < 3; ++k) append(static_cast<float>(v[k]) + 0.0F);
    append(std::uint16_t{0});
  }
  std::ofstream out(path, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) throw std::runtime_error("cannot write " + path);
}

// ---- contours on the developed sheet
// -----------------------------------------------------------------

using Flat = Eigen::Vector2d;
/// A closed curve on the developed sheet, t from 0 to 1.
using Curve = std::function<Flat(double)>;

/// A rectangle with round corners about `centre`, turned by `angle`; starts in the middle of its
/// lower side.
struct RoundedRectangle {
  Flat centre;
  Flat half;
  double radius;
  double angle;

  Flat at(double t) const {
    const Flat inner = half - Flat::Constant(radius);
    const double corner = 0.5 * kPi * radius;
    double s = t * (4.0 * (inner.x() + inner.y()) + 4.0 * corner) - inner.x();
    Flat p(inner.x() * 0.0, -half.y());
    const std::array<double, 4> lengths = {inner.y(), inner.x(), inner.y(), inner.x()};
    if (s <= 0.0) return placed({s + inner.x(), -half.y()});
    for (std::size_t k = 0; k < 4; ++k) {
      const double heading = 0.5 * kPi * static_cast<double>(k);
      const Flat ahead(std::cos(heading), std::sin(heading));
      const Flat left(-ahead.y(), ahead.x());
      const double reach = k % 2 ? inner.y() : inner.x();
      const Flat pivot = reach * ahead + -lengths[k] * left;
      if (s <= corner) {
        const double a = s / radius;
        return placed(pivot + radius * (std::sin(a) * ahead - std::cos(a) * left));
      }
      s -= corner;
      const double straight = k == 3 ? inner.x() : 2.0 * lengths[k];
      p = pivot + radius * ahead + std::min(s, straight) * left;
      if (s <= straight) return placed(p);
      s -= straight;
    }
    return placed(p);
  }

 private:
  Flat placed(const Flat& p) const { return centre + Eigen::Rotation2Dd(angle) * p; }
};

/// Points of a curve so that the straight lines between their tips stay within kChord of it, at
/// most 8 mm and 2 degrees apart.
std::vector<SurfacePoint> sampled(const Curve& curve) {
  const auto at = [&](double t) {
    const Flat p = curve(t);
    return surface(p.x(), p.y());
  };
  const auto fine = [&](double t0, double t1) {
    const SurfacePoint a = at(t0);
    const SurfacePoint b = at(t1);
    const Vec3 chord = tip_of(b) - tip_of(a);
    if (chord.norm() > 8.0 || std::abs(b.b - a.b) > radians_from_degrees(2.0)) return false;
    for (int k = 1; k < 8; ++k) {
      const Vec3 off = tip_of(at(t0 + (t1 - t0) * k / 8.0)) - tip_of(a);
      if (off.cross(chord).norm() > kChord * chord.norm()) return false;
    }
    return true;
  };
  std::vector<SurfacePoint> out{at(0.0)};
  constexpr int kFinest = 1 << 14;
  for (int i = 0; i < kFinest;) {
    int step = kFinest / 16;
    while (step > 1 &&
           (i + step > kFinest || !fine(double(i) / kFinest, double(i + step) / kFinest)))
      step /= 2;
    i += step;
    out.push_back(at(double(i) / kFinest));
  }
  return out;
}

// ---- the program
// -------------------------------------------------------------------------------------

/// Writes cuts in one unit of length.
class CutWriter {
 public:
  explicit CutWriter(bool inch) : inch_(inch) {}

  NcText& text() { return text_; }

  void open(const std::string& title) {
    text_.comment(title);
    text_.comment("POSTED FOR 5+1-AXIS LASER, X Y Z TIP OF THE NOZZLE, C B HEAD");
    text_.comment("SHEET 1.5 MM, GAP 1 MM, ZERO AT THE CORNER OF THE PART");
    text_.line(inch_ ? "G20 G90 G17 G94" : "G21 G90 G17 G94");
    text_.line("G54");
    text_.line("M428 (TOOL CENTRE POINT ON)");
  }

  void close() {
    text_.line("M429 (TOOL CENTRE POINT OFF)");
    text_.line("M30");
  }

  /// Positions above the start, goes down along the tool axis, switches the beam on.
  void begin_cut(const std::string& name, const SurfacePoint& start) {
    text_.comment(name);
    SurfacePoint above = start;
    above.point.z() = kClear - kGap * start.normal.z();
    pose("G0", above);
    pose("G0", lifted(start, 10.0));
    text_.line("M64 P1 (GAS)");
    text_.line("M67 E0 Q80");
    feed_move(lifted(start, 0.0), 3000.0);
    text_.line("M62 P0 (BEAM ON)");
  }

  void cut(const std::vector<SurfacePoint>& points, double feed) {
    for (std::size_t i = 1; i < points.size(); ++i) feed_move(points[i], feed);
  }

  /// A half circle, counter-clockwise, on the top flat.
  void half_circle(const SurfacePoint& end, const Vec3& centre_offset, double feed) {
    const Vec3 tip = tip_of(end);
    text_.block("G3 X" + length(tip.x()) + " Y" + length(tip.y()) + " I" +
                    length(centre_offset.x()) + " J" + length(centre_offset.y()),
                {{'F', feed_value(feed), inch_ ? 2 : 0}});
    text_.forget();
  }

  void end_cut(const SurfacePoint& end) {
    text_.line("M63 P0 (BEAM OFF)");
    pose("G0", lifted(end, 30.0));
    text_.line("M65 P1");
    SurfacePoint above = lifted(end, 30.0);
    above.point.z() = kClear - kGap * end.normal.z();
    pose("G0", above);
  }

 private:
  static SurfacePoint lifted(const SurfacePoint& s, double by) {
    SurfacePoint out = s;
    out.point += by * s.normal;
    return out;
  }
  double scale() const { return inch_ ? 1.0 / kMillimetresPerInch : 1.0; }
  int decimals() const { return inch_ ? 5 : 4; }
  std::string length(double value) const { return fixed(value * scale(), decimals()); }
  double feed_value(double feed) const { return feed * scale(); }

  void pose(const std::string& head, const SurfacePoint& s) {
    const Vec3 tip = scale() * tip_of(s);
    text_.block(head, {{'X', tip.x(), decimals()},
                       {'Y', tip.y(), decimals()},
                       {'Z', tip.z(), decimals()},
                       {'C', degrees_from_radians(s.c), 4},
                       {'B', degrees_from_radians(s.b), 4}});
  }

  void feed_move(const SurfacePoint& s, double feed) {
    const Vec3 tip = scale() * tip_of(s);
    text_.block("G1", {{'X', tip.x(), decimals()},
                       {'Y', tip.y(), decimals()},
                       {'Z', tip.z(), decimals()},
                       {'C', degrees_from_radians(s.c), 4},
                       {'B', degrees_from_radians(s.b), 4},
                       {'F', feed_value(feed), inch_ ? 2 : 0}});
  }

  NcText text_;
  bool inch_;
};

std::vector<SurfacePoint> trimming_contour() {
  const RoundedRectangle outline{{142.0, 100.0}, {131.0, 46.0}, 18.0, radians_from_degrees(-6.0)};
  return sampled([outline](double t) { return outline.at(t); });
}

/// A slot in the middle of the left flank, along its bend line.
std::vector<SurfacePoint> slot() {
  const double u = kLeft.outer_arc() + 0.5 * kLeft.flank();
  const Vec3 centre = kLeft.on_line(105.0) + u * kLeft.outward();
  const Vec3 along = kLeft.along();
  const RoundedRectangle outline{
      {centre.x(), centre.y()}, {24.0, 7.0}, 6.999, std::atan2(along.y(), along.x())};
  return sampled([outline](double t) { return outline.at(t); });
}

void write_slot(CutWriter& writer, const std::string& name) {
  const auto points = slot();
  writer.begin_cut(name, points.front());
  writer.cut(points, 3600.0);
  writer.end_cut(points.back());
}

void write_hole(CutWriter& writer) {
  const double radius = 18.0;
  SurfacePoint start = surface(170.0 + radius, 100.0);
  SurfacePoint half = surface(170.0 - radius, 100.0);
  half.c = start.c;
  writer.begin_cut("HOLE D36 ON THE TOP", start);
  writer.half_circle(half, {-radius, 0, 0}, 4800.0);
  writer.half_circle(start, {radius, 0, 0}, 4800.0);
  writer.end_cut(start);
}

void generate(const std::string& folder) {
  std::filesystem::create_directories(folder);
  write_stl(part(), folder + "/bent_sheet.stl");
  CutWriter mm(false);
  mm.open("BENT SHEET, TRIM AND OPENINGS");
  write_hole(mm);
  write_slot(mm, "SLOT 48 X 14 ON THE LEFT FLANK");
  const auto contour = trimming_contour();
  mm.begin_cut("TRIMMING CONTOUR", contour.front());
  mm.cut(contour, 3000.0);
  mm.end_cut(contour.back());
  mm.close();
  mm.text().write(folder + "/bent_sheet.ngc");
  CutWriter inch(true);
  inch.open("BENT SHEET, SLOT ONLY, INCH");
  write_slot(inch, "SLOT ON THE LEFT FLANK");
  inch.close();
  inch.text().write(folder + "/bent_sheet_inch.ngc");
  double length = 0.0;
  for (std::size_t i = 1; i < contour.size(); ++i)
    length += (tip_of(contour[i]) - tip_of(contour[i - 1])).norm();
  std::cout << folder << ": trimming contour " << fixed(length, 1) << " mm in " << contour.size()
            << " points\n";
}

}  // namespace

}  // namespace smoothpost::examples

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: example_generate_bent_sheet FOLDER\n";
    return 2;
  }
  try {
    smoothpost::examples::generate(argv[1]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
