#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "kernels/core/units.h"
#include "postproc/pipeline/smoothed_path.h"
#include "tests/postproc/pipeline/paths.h"

// Random tool paths, and what every smoothed path has to keep.
namespace smoothpost::test {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }
  int below(int n) { return static_cast<int>(between(0.0, n)); }
  Vec3 unit() {
    while (true) {
      const Vec3 v(between(-1, 1), between(-1, 1), between(-1, 1));
      if (v.norm() > 0.1 && v.norm() < 1.0) return v.normalized();
    }
  }

 private:
  std::mt19937 engine_;
};

inline SmoothingSettings settings_of(BlendKind kind, double tip = 0.02, double axis = 0.002) {
  SmoothingSettings s;
  s.kind = kind;
  s.merge_tip = 0.25 * tip;
  s.merge_axis = 0.25 * axis;
  s.corner_tip = tip;
  s.corner_axis = axis;
  return s;
}

/// Place on the input as one number: 2.25 is a quarter of segment 3.
inline double number(const PathPlace& p) { return p.segment == 0 ? 0.0 : p.segment - 1 + p.s; }

inline CutterLocation original(const ReferencePath& reference, const PathPlace& p) {
  return p.segment == 0 ? reference.path().points[0].location : reference.at(p.segment, p.s);
}

inline Mat3 original_rotation(const ReferencePath& reference, const PathPlace& p) {
  return (p.segment == 0 ? reference.path().points[0].rotation
                         : reference.rotation_at(p.segment, p.s))
      .toRotationMatrix();
}

/// Shares of a leg: evenly, the breaks, and a little beside them.
inline std::vector<double> shares(const SmoothedPath& smoothed, std::size_t leg, int count) {
  std::vector<double> out;
  for (int i = 0; i <= count; ++i) out.push_back(static_cast<double>(i) / count);
  for (const double b : smoothed.breaks(leg))
    for (const double d : {-1e-6, 0.0, 1e-6}) out.push_back(std::clamp(b + d, 0.0, 1.0));
  std::sort(out.begin(), out.end());
  return out;
}

struct Worst {
  double tip = 0.0, axis = 0.0, rotation = 0.0;
  std::size_t samples = 0;
};

inline Worst deviation(const SmoothedPath& smoothed, int count) {
  Worst worst;
  const ReferencePath& reference = smoothed.reference();
  for (std::size_t leg = 1; leg <= smoothed.legs(); ++leg)
    for (const double s : shares(smoothed, leg, count)) {
      const PathPlace place = smoothed.place(leg, s);
      const CutterLocation got = smoothed.at(leg, s), wanted = original(reference, place);
      worst.tip = std::max(worst.tip, (got.tip - wanted.tip).norm());
      worst.axis = std::max(worst.axis, angle_between(got.axis, wanted.axis));
      ++worst.samples;
      if (!smoothed.full_pose()) continue;
      const Mat3 r = smoothed.rotation_at(leg, s);
      CHECK(angle_between(r * Vec3::UnitZ(), got.axis) < 1e-9);
      worst.rotation = std::max(
          worst.rotation, rotation_log(original_rotation(reference, place).transpose() * r).norm());
    }
  return worst;
}

/// The legs cover the input in its order without a gap, and the smoothed path has no jump.
inline void check_order(const SmoothedPath& smoothed) {
  const ReferencePath& reference = smoothed.reference();
  REQUIRE(smoothed.legs() >= 1);
  CHECK(number(smoothed.place(0, 1.0)) == 0.0);
  CHECK(smoothed.length(0) == 0.0);
  double last = 0.0;
  for (std::size_t leg = 1; leg <= smoothed.legs(); ++leg) {
    INFO("leg " << leg);
    const PathPlace start = smoothed.place(leg, 0.0), end = smoothed.place(leg - 1, 1.0);
    if (std::abs(number(start) - last) > 1e-12) {  // but for segments that do nothing
      CHECK((original(reference, start).tip - original(reference, end).tip).norm() < 1e-9);
      CHECK((original(reference, start).axis - original(reference, end).axis).norm() < 1e-9);
    }
    const CutterLocation before = smoothed.at(leg - 1, 1.0), after = smoothed.at(leg, 0.0);
    CHECK((before.tip - after.tip).norm() < 1e-9);
    CHECK((before.axis - after.axis).norm() < 1e-9);
    for (const double s : shares(smoothed, leg, 20)) {
      const double now = number(smoothed.place(leg, s));
      CHECK(now >= last - 1e-12);
      last = now;
    }
    // Its point is where it ends, or ends the segment that it is a part of.
    const auto index =
        static_cast<std::size_t>(&smoothed.point(leg) - reference.path().points.data());
    CHECK(index == static_cast<std::size_t>(std::ceil(last - 1e-9)));
    const auto breaks = smoothed.breaks(leg);
    REQUIRE(breaks.size() >= 2);
    CHECK(breaks.front() == 0.0);
    CHECK(breaks.back() == 1.0);
    CHECK(std::is_sorted(breaks.begin(), breaks.end()));
  }
  CHECK(last == static_cast<double>(reference.segments()));
}

/// Points that the smoothed path has to come through, from their definition.
inline std::set<std::size_t> exact_points(const ToolPath& path, const std::vector<Cut>& cuts) {
  std::set<std::size_t> out = {0, path.points.size() - 1};
  for (const Cut& c : cuts) {
    out.insert(c.first - 1);
    out.insert(c.last);
  }
  for (const PathEvent& e : path.events)
    if (e.kind != PathEvent::Kind::comment) out.insert(e.point);
  for (std::size_t k = 1; k + 1 < path.points.size(); ++k)
    if (path.points[k].tool != path.points[k + 1].tool ||
        path.points[k].tool_length != path.points[k + 1].tool_length)
      out.insert(k);
  return out;
}

/// The leg that ends at a point of the input, 0: none does.
inline std::size_t leg_ending_at(const SmoothedPath& smoothed, std::size_t point) {
  for (std::size_t leg = 1; leg <= smoothed.legs(); ++leg)
    if (std::abs(number(smoothed.place(leg, 1.0)) - static_cast<double>(point)) < 1e-12) return leg;
  return 0;
}

/// @return points looked at
inline std::size_t check_exact(const SmoothedPath& smoothed, const std::set<std::size_t>& points) {
  const ToolPath& path = smoothed.reference().path();
  std::size_t count = 0;
  for (const std::size_t k : points) {
    if (k == 0) continue;
    const std::size_t leg = leg_ending_at(smoothed, k);
    INFO("point " << k << ", line " << path.points[k].line);
    REQUIRE(leg > 0);
    CHECK((smoothed.at(leg, 1.0).tip - path.points[k].location.tip).norm() < 1e-9);
    CHECK((smoothed.at(leg, 1.0).axis - path.points[k].location.axis).norm() < 1e-9);
    ++count;
  }
  return count;
}

/// Segments outside of cuts are what they were.
inline void check_links(const SmoothedPath& smoothed, const std::vector<Cut>& cuts) {
  for (std::size_t leg = 1; leg <= smoothed.legs(); ++leg) {
    const PathPlace end = smoothed.place(leg, 1.0);
    const bool cut = std::any_of(cuts.begin(), cuts.end(), [&](const Cut& c) {
      return end.segment >= c.first && end.segment <= c.last;
    });
    if (cut) continue;
    for (int i = 0; i <= 8; ++i) {
      const PathPlace place = smoothed.place(leg, i / 8.0);
      CHECK(number(place) == Approx(end.segment - 1 + i / 8.0).margin(1e-12));
      const CutterLocation a = smoothed.at(leg, i / 8.0), b = original(smoothed.reference(), place);
      CHECK((a.tip - b.tip).norm() < 1e-12);
      CHECK((a.axis - b.axis).norm() < 1e-12);
    }
  }
}

/// Second differences inside every piece against the bound. @return pieces looked at
inline std::size_t check_bound(const SmoothedPath& smoothed) {
  std::size_t pieces = 0;
  for (std::size_t leg = 1; leg <= smoothed.legs(); ++leg) {
    const auto breaks = smoothed.breaks(leg);
    for (std::size_t i = 1; i < breaks.size(); ++i) {
      const double from = breaks[i - 1], to = breaks[i];
      if (to - from < 1e-5) continue;  // differences are lost in rounding
      const auto bound = smoothed.second_derivative_bound(leg, from, to);
      const int n = 40;
      const double h = (to - from) / n, noise = 2e-13 / (h * h);
      std::vector<CutterLocation> at;
      for (int k = 0; k <= n; ++k) at.push_back(smoothed.at(leg, from + k * h));
      double tip = 0.0, axis = 0.0;
      for (std::size_t k = 1; k + 1 < at.size(); ++k) {
        tip = std::max(tip, (at[k + 1].tip - 2.0 * at[k].tip + at[k - 1].tip).norm() / (h * h));
        axis =
            std::max(axis, (at[k + 1].axis - 2.0 * at[k].axis + at[k - 1].axis).norm() / (h * h));
      }
      INFO("leg " << leg << " from " << from << " to " << to);
      CHECK(tip <= bound.tip * (1.0 + 1e-6) + 100.0 * noise);
      CHECK(axis <= bound.axis * (1.0 + 1e-6) + noise);
      ++pieces;
    }
  }
  return pieces;
}

inline std::string fixed6(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6f", v);
  return text;
}

enum class Words { none, tip, joints };

/// A random program of lines, arcs and helices, with events, dwells, feeds and two cuts.
inline std::string random_program(unsigned seed, Words words) {
  Random dice(seed);
  std::ostringstream out;
  out << "%\n" << (words == Words::tip ? "M428\n" : "") << "G21 G17 G90 G94 G40\n";
  if (words != Words::none) out << "T1 M6\nG54\nS1000 M3\nG43 H1\n";
  Vec3 p(0, 0, 20);
  double a = 0.0, c = 0.0;
  const auto rotary = [&](double step) {
    if (words == Words::none || dice.below(3) == 0) return std::string();
    a = std::clamp(a + dice.between(-step, step), -60.0, 25.0);
    c += dice.between(-step, step);
    return " A" + fixed6(a) + " C" + fixed6(c);
  };
  const auto line = [&](const char* g, const Vec3& to, const std::string& more) {
    p = to;
    out << g << " X" << fixed6(p.x()) << " Y" << fixed6(p.y()) << " Z" << fixed6(p.z()) << more
        << "\n";
  };
  line("G0", p, words == Words::none ? "" : " A0 C0");
  out << "F" << dice.below(900) + 300 << "\n";
  for (int cut = 0; cut < 2; ++cut) {
    for (int n = 0; n < 9; ++n) {
      const std::string more = rotary(words == Words::joints ? 4.0 : 8.0);
      if (dice.below(3) > 0) {
        const double size = dice.below(3) == 0 ? 0.6 : 12.0;
        line("G1", p + size * Vec3(dice.between(-1, 1), dice.between(-1, 1), dice.between(-.3, .3)),
             more + (dice.below(4) == 0 ? " F700" : ""));
      } else {
        const Vec3 spoke(dice.between(2, 9), dice.between(-9, -2), 0);
        const double sweep = dice.between(0.4, 4.5) * (dice.below(2) == 0 ? 1 : -1);
        const Vec3 centre = p + spoke;
        Vec3 to = centre - rotation_about(Vec3::UnitZ(), sweep) * spoke;
        if (dice.below(2) == 0) to.z() += dice.between(-2, 2);
        line(sweep > 0 ? "G3" : "G2", to,
             " I" + fixed6(spoke.x()) + " J" + fixed6(spoke.y()) + more);
      }
      if (dice.below(7) == 0) out << "G4 P0.2\n";
      if (words != Words::none && dice.below(7) == 0) out << (dice.below(2) == 0 ? "M8\n" : "M9\n");
    }
    line("G0", p + Vec3(5, 5, 15), words == Words::none ? "" : " A-10 C5");
    a = -10.0, c = 5.0;
  }
  out << (words == Words::none ? "" : "M5\n") << "M30\n%\n";
  return out.str();
}

/// Rows of a random walk with a smooth part, as directions or as whole rotations.
inline std::string random_rows(unsigned seed, bool whole) {
  Random dice(seed);
  std::ostringstream out;
  out << "x_mm,y_mm,z_mm," << (whole ? "qw,qx,qy,qz" : "i,j,k") << ",feed_mm_per_min\n";
  Vec3 p(0, 0, 0);
  Eigen::Quaterniond q(rotation_exp(0.3 * dice.unit()));
  const auto row = [&](double feed) {
    out.precision(17);
    out << p.x() << "," << p.y() << "," << p.z();
    const Vec3 n = q * Vec3::UnitZ();
    if (whole)
      out << "," << q.w() << "," << q.x() << "," << q.y() << "," << q.z();
    else
      out << "," << n.x() << "," << n.y() << "," << n.z();
    out << "," << feed << "\n";
  };
  row(0);
  bool stands = false;
  for (int part = 0; part < 3; ++part) {
    for (int n = 0; n < 8; ++n) {  // corners
      // Once the tip stands it moves next: see "a turn on the spot behind a repeated point".
      const bool moves = dice.below(8) > 0 || stands;
      if (moves) p += dice.between(0.2, 15.0) * dice.unit();
      if (dice.below(5) > 0)
        q = q * Eigen::Quaterniond(rotation_exp(dice.between(0, 0.4) * dice.unit()));
      row(dice.below(4) == 0 ? 900 : 1200);
      stands = !moves || dice.below(8) == 0;
      if (stands && moves) row(1200);  // once more the same
    }
    const Vec3 d = dice.unit(), e = d.unitOrthogonal(), w = dice.unit();
    const Vec3 start = p;
    const Eigen::Quaterniond first = q;
    for (int n = 1; n <= 60; ++n) {  // dense, on a circle of 200 mm
      const double x = 0.1 * n;
      p = start + x * d + (200.0 - std::sqrt(200.0 * 200.0 - x * x)) * e;
      q = first * Eigen::Quaterniond(rotation_exp(0.0005 * n * w));
      row(1200);
    }
    p += Vec3(0, 0, 30);
    row(0);
  }
  return out.str();
}

struct Sample {
  std::string name;
  InterpretedInput input;
  bool whole = false;
};

inline std::vector<Sample> random_inputs(unsigned seed) {
  std::vector<Sample> out;
  {
    InputSettings plain;
    plain.file_name = "part.ngc";
    auto read = interpret_nc(random_program(seed, Words::none), plain);
    for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
    REQUIRE(read.ok());
    out.push_back({"lines and arcs", std::move(read.value()), false});
  }
  out.push_back(
      {"rotary linear", read_program(random_program(seed, Words::tip), "table_table_ac"), false});
  out.push_back(
      {"joint linear", read_program(random_program(seed, Words::joints), "table_table_ac"), false});
  for (const bool whole : {false, true}) {
    InputSettings rows;
    rows.file_name = "part.csv";
    auto read = interpret_csv(random_rows(seed, whole), rows);
    for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
    REQUIRE(read.ok());
    if (whole) out.push_back({"whole rotations", read.value(), true});
    out.push_back(
        {whole ? "axes of whole rotations" : "great circles", std::move(read.value()), false});
  }
  return out;
}

inline void for_random_paths(
    unsigned first, unsigned count,
    const std::function<void(const Sample&, const std::vector<Cut>&, const ReferencePath&)>& body) {
  for (unsigned seed = first; seed < first + count; ++seed)
    for (Sample& sample : random_inputs(seed)) {
      const auto cuts = find_cuts(sample.input.path, {});
      INFO(sample.name << ", seed " << seed);
      REQUIRE(cuts.size() >= 2);
      const ReferencePath reference(sample.input.path, sample.input.frames);
      body(sample, cuts, reference);
    }
}

inline std::vector<Cut> cuts_of(ToolPath& path) { return find_cuts(path, {}); }

}  // namespace smoothpost::test
