#include "postproc/pipeline/smoothed_path.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <sstream>

#include "kernels/core/units.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

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

SmoothingSettings settings_of(BlendKind kind, double tip = 0.02, double axis = 0.002) {
  SmoothingSettings s;
  s.kind = kind;
  s.merge_tip = 0.25 * tip;
  s.merge_axis = 0.25 * axis;
  s.corner_tip = tip;
  s.corner_axis = axis;
  return s;
}

/// Place on the input as one number: 2.25 is a quarter of segment 3.
double number(const PathPlace& p) { return p.segment == 0 ? 0.0 : p.segment - 1 + p.s; }

CutterLocation original(const ReferencePath& reference, const PathPlace& p) {
  return p.segment == 0 ? reference.path().points[0].location : reference.at(p.segment, p.s);
}

Mat3 original_rotation(const ReferencePath& reference, const PathPlace& p) {
  return (p.segment == 0 ? reference.path().points[0].rotation
                         : reference.rotation_at(p.segment, p.s))
      .toRotationMatrix();
}

/// Shares of a leg: evenly, the breaks, and a little beside them.
std::vector<double> shares(const SmoothedPath& smoothed, std::size_t leg, int count) {
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

Worst deviation(const SmoothedPath& smoothed, int count) {
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
void check_order(const SmoothedPath& smoothed) {
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
std::set<std::size_t> exact_points(const ToolPath& path, const std::vector<Cut>& cuts) {
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
std::size_t leg_ending_at(const SmoothedPath& smoothed, std::size_t point) {
  for (std::size_t leg = 1; leg <= smoothed.legs(); ++leg)
    if (std::abs(number(smoothed.place(leg, 1.0)) - static_cast<double>(point)) < 1e-12) return leg;
  return 0;
}

/// @return points looked at
std::size_t check_exact(const SmoothedPath& smoothed, const std::set<std::size_t>& points) {
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
void check_links(const SmoothedPath& smoothed, const std::vector<Cut>& cuts) {
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
std::size_t check_bound(const SmoothedPath& smoothed) {
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

std::string fixed6(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6f", v);
  return text;
}

enum class Words { none, tip, joints };

/// A random program of lines, arcs and helices, with events, dwells, feeds and two cuts.
std::string random_program(unsigned seed, Words words) {
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
std::string random_rows(unsigned seed, bool whole) {
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

std::vector<Sample> random_inputs(unsigned seed) {
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

void for_random_paths(
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

std::vector<Cut> cuts_of(ToolPath& path) { return find_cuts(path, {}); }

}  // namespace

TEST_CASE("smoothed_path: without settings it is the reference", "[postproc][pipeline][smooth]") {
  for_random_paths(
      1, 3, [](const Sample&, const std::vector<Cut>&, const ReferencePath& reference) {
        const SmoothedPath smoothed(reference);
        REQUIRE(smoothed.legs() == reference.segments());
        CHECK(smoothed.merged_points() == 0);
        CHECK(smoothed.corners().empty());
        check_order(smoothed);
        for (std::size_t k = 1; k <= smoothed.legs(); ++k) {
          CHECK(&smoothed.point(k) == &reference.path().points[k]);
          for (int i = 0; i <= 6; ++i) {
            const double s = i / 6.0;
            CHECK(smoothed.place(k, s).segment == k);
            CHECK(smoothed.place(k, s).s == s);
            CHECK(smoothed.at(k, s).tip == reference.at(k, s).tip);
            CHECK(smoothed.at(k, s).axis == reference.at(k, s).axis);
            if (smoothed.full_pose())
              CHECK((smoothed.rotation_at(k, s) - reference.rotation_at(k, s).toRotationMatrix())
                        .norm() < 1e-12);
          }
        }
        check_bound(smoothed);
      });
}

TEST_CASE("smoothed_path: tip and axis stay within the tolerances at equal parameter",
          "[postproc][pipeline][smooth]") {
  std::size_t samples = 0;
  unsigned round = 0;
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for (const double tip : {0.005, 0.1}) {
      SmoothingSettings settings = settings_of(kind, tip, 0.05 * tip);
      for_random_paths(
          10 + 3 * round++, 3,
          [&](const Sample& sample, const std::vector<Cut>& cuts, const ReferencePath& reference) {
            settings.whole_rotation = sample.whole;
            settings.paper_shape = tip > 0.05;
            const SmoothedPath smoothed(reference, cuts, settings);
            const Worst worst = deviation(smoothed, 40);
            samples += worst.samples;
            CHECK(worst.tip <= settings.merge_tip + settings.corner_tip + 1e-9);
            CHECK(worst.axis <= settings.merge_axis + settings.corner_axis + 1e-9);
            if (sample.whole)
              CHECK(worst.rotation <= settings.merge_axis + settings.corner_axis + 1e-9);
            CHECK(worst.tip > 0.2 * settings.corner_tip);
            check_order(smoothed);
            check_links(smoothed, cuts);
          });
    }
  CHECK(samples > 100000);
}

TEST_CASE("smoothed_path: comes through points with events and dwells and the ends of cuts",
          "[postproc][pipeline][smooth]") {
  std::size_t events = 0, points = 0;
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for_random_paths(
        40, 4,
        [&](const Sample& sample, const std::vector<Cut>& cuts, const ReferencePath& reference) {
          SmoothingSettings settings = settings_of(kind, 0.2, 0.02);
          settings.whole_rotation = sample.whole;
          const SmoothedPath smoothed(reference, cuts, settings);
          points += check_exact(smoothed, exact_points(reference.path(), cuts));
          events += reference.path().events.size();
        });
  CHECK(points > 200);
  CHECK(events > 50);
}

TEST_CASE("smoothed_path: the bound of the second derivative is never below second differences",
          "[postproc][pipeline][smooth]") {
  std::size_t pieces = 0;
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for_random_paths(
        60, 3,
        [&](const Sample& sample, const std::vector<Cut>& cuts, const ReferencePath& reference) {
          SmoothingSettings settings = settings_of(kind, 0.1, 0.01);
          settings.whole_rotation = sample.whole;
          settings.paper_shape = kind == BlendKind::acr && sample.whole;
          pieces += check_bound(SmoothedPath(reference, cuts, settings));
        });
  CHECK(pieces > 500);
}

TEST_CASE("smoothed_path: smooth over the parameter but at exact points and stops",
          "[postproc][pipeline][smooth]") {
  std::size_t nodes = 0;
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for_random_paths(
        80, 3,
        [&](const Sample& sample, const std::vector<Cut>& cuts, const ReferencePath& reference) {
          SmoothingSettings settings = settings_of(kind, 0.1, 0.01);
          settings.whole_rotation = sample.whole;
          const SmoothedPath smoothed(reference, cuts, settings);
          const std::set<std::size_t> exact = exact_points(reference.path(), cuts);
          std::set<std::uint32_t> stops;
          for (const SmoothedCorner& corner : smoothed.corners())
            if (corner.stop) stops.insert(corner.input_line);
          for (std::size_t leg = 1; leg < smoothed.legs(); ++leg) {
            const double place = number(smoothed.place(leg, 1.0));
            const bool is_point = place == std::round(place);
            if (is_point && exact.count(static_cast<std::size_t>(place)) > 0) continue;
            if (stops.count(smoothed.point(leg).line) > 0) continue;
            const double before_length = smoothed.length(leg),
                         after_length = smoothed.length(leg + 1);
            if (before_length == 0.0 || after_length == 0.0) continue;  // not smoothed
            const auto breaks_before = smoothed.breaks(leg),
                       breaks_after = smoothed.breaks(leg + 1);
            const double h =
                0.01 * std::min((1.0 - breaks_before[breaks_before.size() - 2]) * before_length,
                                breaks_after[1] * after_length);
            if (h < 1e-5) continue;  // differences are lost in rounding
            const auto at = [&](int i) {
              return i < 0 ? smoothed.at(leg, 1.0 + i * h / before_length)
                           : smoothed.at(leg + 1, i * h / after_length);
            };
            INFO("leg " << leg << " line " << smoothed.point(leg).line);
            const auto jump = [&](const auto& of) {
              const Vec3 before = (3.0 * of(0) - 4.0 * of(-1) + of(-2)) / (2.0 * h);
              const Vec3 after = (-3.0 * of(0) + 4.0 * of(1) - of(2)) / (2.0 * h);
              return (before - after).norm();
            };
            CHECK(jump([&](int i) { return at(i).tip; }) < 5e-3);
            CHECK(jump([&](int i) { return at(i).axis; }) < 5e-3);
            ++nodes;
          }
        });
  CHECK(nodes > 200);
}

TEST_CASE("smoothed_path: corners tell what an independent measurement finds",
          "[postproc][pipeline][smooth]") {
  Random dice(7);
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for (int round = 0; round < 10; ++round) {
      PathMaker maker(Vec3(0, 0, 0));
      Vec3 p(0, 0, 0), axis = Vec3::UnitZ();
      for (int i = 0; i < 4; ++i) {
        p += Vec3(dice.between(20, 40), dice.between(-30, 30), dice.between(-30, 30));
        axis = (axis + 0.5 * dice.unit()).normalized();
        maker.axis(axis).feed(p, 1.0);
      }
      ToolPath path = maker.take();
      for (std::size_t k = 1; k < path.points.size(); ++k)  // 20 mm/s
        path.points[k].duration =
            (path.points[k].location.tip - path.points[k - 1].location.tip).norm() / 20.0;
      const auto cuts = cuts_of(path);
      const ReferencePath reference(path, {});
      const SmoothingSettings settings = settings_of(kind, 0.05, 0.004);
      const SmoothedPath smoothed(reference, cuts, settings);
      CHECK(smoothed.merged_points() == 0);
      REQUIRE(smoothed.legs() == 4);
      const auto corners = smoothed.corners();
      REQUIRE(corners.size() == 3);
      for (std::size_t k = 1; k <= 3; ++k) {
        const SmoothedCorner& corner = corners[k - 1];
        INFO("round " << round << " corner " << k);
        CHECK(corner.input_line == path.points[k].line);
        const Vec3 t0 =
            (path.points[k].location.tip - path.points[k - 1].location.tip).normalized();
        const Vec3 t1 =
            (path.points[k + 1].location.tip - path.points[k].location.tip).normalized();
        const double turn = angle_between(t0, t1);
        CHECK(corner.turn == Approx(turn));
        CHECK_FALSE(corner.stop);
        CHECK(corner.method == (kind == BlendKind::acr ? "acr" : "ramp"));
        CHECK(corner.half_width > 0.0);
        CHECK(corner.rotation_half_width > 0.0);
        // On the legs' middle halves there is no other corner: legs are long.
        double tip = 0.0, angle = 0.0;
        const int n = 4000;
        for (int i = 0; i <= n; ++i) {
          const double s = static_cast<double>(i) / n;
          const std::size_t leg = s <= 0.5 ? k : k + 1;
          const double share = s <= 0.5 ? 0.5 + s : s - 0.5;
          const auto a = smoothed.at(leg, share);
          const auto b = original(reference, smoothed.place(leg, share));
          tip = std::max(tip, (a.tip - b.tip).norm());
          angle = std::max(angle, angle_between(a.axis, b.axis));
        }
        CHECK(corner.tip_deviation == Approx(tip).epsilon(0.01));
        CHECK(corner.axis_deviation == Approx(angle).epsilon(0.03).margin(1e-9));
        CHECK(corner.tip_deviation <= settings.corner_tip + 1e-9);
        CHECK(corner.tip_deviation > 0.9 * settings.corner_tip);
        CHECK(corner.axis_deviation <= settings.corner_axis + 1e-9);
        CHECK(corner.rotation_deviation == 0.0);
        CHECK(corner.speed == Approx(20.0 * std::cos(0.5 * turn)).epsilon(1e-3));
        // g(0) of acr is 1/4.
        if (kind == BlendKind::acr)
          CHECK(corner.half_width * 0.25 * 2.0 * std::sin(0.5 * turn) ==
                Approx(settings.corner_tip));
      }
    }
}

TEST_CASE("smoothed_path: corners of whole rotations tell the whole angle",
          "[postproc][pipeline][smooth]") {
  Random dice(8);
  for (int round = 0; round < 20; ++round) {
    PathMaker maker(Vec3(0, 0, 0));
    maker.feed({30, 0, 0}, 2.0).feed({30 + dice.between(5, 20), 30, 5}, 2.0);
    ToolPath path = maker.take();
    path.full_pose = true;
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    for (PathPoint& p : path.points) {
      p.rotation = q;
      p.location.axis = q * Vec3::UnitZ();
      p.interpolation = PathInterpolation::slerp;
      q = q * Eigen::Quaterniond(rotation_exp(dice.between(0.1, 0.8) * dice.unit()));
    }
    const auto cuts = cuts_of(path);
    const ReferencePath reference(path, {});
    SmoothingSettings settings = settings_of(BlendKind::acr, 0.05, 0.004);
    settings.whole_rotation = true;
    const SmoothedPath smoothed(reference, cuts, settings);
    const auto corners = smoothed.corners();
    REQUIRE(corners.size() == 1);
    const Worst worst = deviation(smoothed, 2000);
    CHECK(corners[0].rotation_deviation == Approx(worst.rotation).epsilon(0.01));
    CHECK(corners[0].axis_deviation == Approx(worst.axis).epsilon(0.03).margin(1e-9));
    CHECK(corners[0].rotation_deviation <= settings.corner_axis + 1e-9);
    CHECK(corners[0].rotation_deviation > 0.9 * settings.corner_axis);
  }
}

TEST_CASE("smoothed_path: arcs stay arcs", "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for (const double rise : {0.0, 4.0}) {
      PathMaker maker(Vec3(0, 0, 0));
      maker.feed({20, 0, 0}).arc({20, 15, 0}, 2.5, rise);
      maker.feed({60, 60, 0}).feed({80, 0, 0}).arc({80, -10, 0}, 2.0 * kPi, rise).feed({120, 5, 0});
      ToolPath path = maker.take();
      const auto cuts = cuts_of(path);
      const ReferencePath reference(path, {});
      const SmoothedPath smoothed(reference, cuts, settings_of(kind));
      std::size_t legs = 0;
      REQUIRE(smoothed.legs() >= 6);
      for (std::size_t leg = 1; leg <= smoothed.legs(); ++leg) {
        const std::uint32_t segment = smoothed.place(leg, 1.0).segment;
        if (segment != 2 && segment != 5) continue;
        const auto breaks = smoothed.breaks(leg);
        double from = 0.0, to = 0.0;
        for (std::size_t i = 1; i < breaks.size(); ++i)
          if (breaks[i] - breaks[i - 1] > to - from) from = breaks[i - 1], to = breaks[i];
        INFO("leg " << leg << " from " << from << " to " << to);
        CHECK(to - from > 0.8);
        ++legs;
        const ArcGeometry& arc = path.arcs[segment == 2 ? 0 : 1];
        for (int i = 0; i <= 100; ++i) {
          const double s = from + i / 100.0 * (to - from);
          Vec3 spoke = smoothed.at(leg, s).tip - arc.centre;
          spoke.z() = 0.0;
          CHECK(spoke.norm() == Approx(segment == 2 ? 15.0 : 10.0).margin(1e-9));
          CHECK((smoothed.at(leg, s).tip - original(reference, smoothed.place(leg, s)).tip).norm() <
                1e-9);
        }
      }
      CHECK(legs >= 2);
    }
}

TEST_CASE("smoothed_path: dense points are merged and counted and corners are not",
          "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    PathMaker maker(Vec3(0, 0, 0));
    const auto walk = [&](const Vec3& to) {  // 40 steps
      static Vec3 at;
      if (to == Vec3(100, 0, 0)) at.setZero();
      for (int i = 1; i <= 40; ++i) maker.feed(at + i / 40.0 * (to - at), 0.1);
      at = to;
    };
    walk({100, 0, 0});
    const std::size_t first = maker.last();
    walk({100, 100, 0});
    const std::size_t second = maker.last();
    walk({0, 100, 20});
    ToolPath path = maker.take();
    for (std::size_t k = 1; k < path.points.size(); ++k)
      path.points[k].duration =
          (path.points[k].location.tip - path.points[k - 1].location.tip).norm() / 25.0;
    const auto cuts = cuts_of(path);
    const ReferencePath reference(path, {});
    const SmoothingSettings settings = settings_of(kind);
    const SmoothedPath smoothed(reference, cuts, settings);
    CHECK(smoothed.legs() <= 6);  // 48 points a leg at most
    CHECK(smoothed.merged_points() == path.points.size() - 1 - smoothed.legs());
    CHECK(leg_ending_at(smoothed, first) > 0);
    CHECK(leg_ending_at(smoothed, second) > 0);
    std::set<std::uint32_t> lines;
    for (const auto& c : smoothed.corners()) lines.insert(c.input_line);
    CHECK(lines == std::set<std::uint32_t>{path.points[first].line, path.points[second].line});
    const Worst worst = deviation(smoothed, 400);
    CHECK(worst.tip <= settings.merge_tip + settings.corner_tip + 1e-9);
    check_order(smoothed);
  }
}

TEST_CASE("smoothed_path: changes of feed and points with events are never merged",
          "[postproc][pipeline][smooth]") {
  PathMaker maker(Vec3(0, 0, 0));
  std::set<std::size_t> kept, exact;
  for (int i = 1; i <= 60; ++i) {
    maker.feed({static_cast<double>(i), 0, 0}, i > 20 && i <= 33 ? 0.05 : 0.1);
    if (i == 20 || i == 33) kept.insert(maker.last());
    if (i == 41) maker.event("coolant_on"), exact.insert(maker.last());
    if (i == 47) maker.dwell(0.5), exact.insert(maker.last());
  }
  ToolPath path = maker.take();
  for (std::size_t k = 55; k < path.points.size(); ++k) path.points[k].tool_length = 12.0;
  exact.insert(54);
  const auto cuts = cuts_of(path);
  const ReferencePath reference(path, {});
  const SmoothedPath smoothed(reference, cuts, settings_of(BlendKind::acr));
  for (const std::size_t k : kept) CHECK(leg_ending_at(smoothed, k) > 0);
  CHECK(check_exact(smoothed, exact) == 3);
  CHECK(smoothed.merged_points() > 40);
  check_order(smoothed);
}

TEST_CASE("smoothed_path: corners with events and dwells and tool lengths stay sharp",
          "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    PathMaker maker(Vec3(0, 0, 0));
    maker.event("beam_on").feed({20, 0, 0}).axis({0.3, 0, 1}).feed({20, 20, 0}).event("power");
    const std::size_t power = maker.last();
    maker.axis({0, 0.3, 1}).feed({40, 20, 0}).dwell(0.3);
    const std::size_t dwell = maker.last();
    maker.axis({0, 0, 1}).feed({40, 40, 5});
    const std::size_t plain = maker.last();
    maker.feed({60, 40, 0}).event("beam_off").feed({61, 42, 0}).event("beam_on");
    const std::size_t off = maker.last() - 1;
    maker.feed({80, 60, 0}).event("beam_off").rapid({80, 60, 50});
    ToolPath path = maker.take();
    LinkChoice choice;
    choice.micro_joint = 5.0;  // the beam goes off and on inside of one cut
    const auto cuts = find_cuts(path, choice);
    REQUIRE(cuts.size() == 1);
    const ReferencePath reference(path, {});
    const SmoothedPath smoothed(reference, cuts, settings_of(kind, 0.1, 0.01));
    const std::set<std::size_t> exact = {power, dwell, off, off + 1};
    check_exact(smoothed, exact);
    for (const std::size_t k : exact) {  // not only the point: its surroundings are the input's
      const std::size_t leg = leg_ending_at(smoothed, k);
      for (int i = 0; i <= 20; ++i) {
        const double s = 1.0 - 0.005 * i;
        CHECK((smoothed.at(leg, s).tip - original(reference, smoothed.place(leg, s)).tip).norm() <
              1e-9);
        CHECK((smoothed.at(leg + 1, 1.0 - s).tip -
               original(reference, smoothed.place(leg + 1, 1.0 - s)).tip)
                  .norm() < 1e-9);
      }
    }
    const std::size_t leg = leg_ending_at(smoothed, plain);
    REQUIRE(leg > 0);
    CHECK((smoothed.at(leg, 1.0).tip - path.points[plain].location.tip).norm() > 0.05);
    std::set<std::uint32_t> blended;
    for (const auto& c : smoothed.corners())
      if (c.half_width > 0.0) blended.insert(c.input_line);
    CHECK(blended.count(path.points[plain].line) == 1);
    for (const std::size_t k : exact) CHECK(blended.count(path.points[k].line) == 0);
    check_order(smoothed);
  }
}

TEST_CASE("smoothed_path: repeated points and turns on the spot inside a cut",
          "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    PathMaker maker(Vec3(0, 0, 0));
    maker.feed({0, 0, 0}).feed({20, 0, 0}).feed({20, 0, 0}).feed({20, 20, 0});
    maker.feed({20, 20, 0}).dwell(1.0).feed({20, 20, 0}).feed({40, 20, 0});
    const std::size_t dwell = 5;
    maker.axis({0.2, 0.1, 1}).feed({40, 20, 0}, 0.0);  // turns only
    maker.feed({40, 50, 0}).feed({40, 50, 0}).feed({60, 50, 0}).axis({0, 0, 1});
    maker.feed({60, 50, 0}, 0.0).feed({80, 50, 0}).feed({80, 50, 0});
    ToolPath path = maker.take();
    const auto cuts = cuts_of(path);
    const ReferencePath reference(path, {});
    const SmoothingSettings settings = settings_of(kind);
    const SmoothedPath smoothed(reference, cuts, settings);
    check_order(smoothed);
    check_exact(smoothed, {dwell, path.points.size() - 1});
    const Worst worst = deviation(smoothed, 200);
    CHECK(worst.tip <= settings.merge_tip + settings.corner_tip + 1e-9);
    CHECK(worst.axis <= settings.merge_axis + settings.corner_axis + 1e-9);
    check_bound(smoothed);
    for (const auto& c : smoothed.corners()) {
      CHECK(std::isfinite(c.speed));
      CHECK(std::isfinite(c.tip_deviation));
    }
  }
}

TEST_CASE("smoothed_path: a turn on the spot behind a repeated point",
          "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp})
    for (const bool whole : {false, true}) {
      PathMaker maker(Vec3(0, 0, 0));
      maker.feed({40, 0, 0}).feed({40, 0, 0}).axis({0.2, 0, 1}).feed({40, 0, 0}, 0.0);
      maker.feed({40, 40, 0});
      ToolPath path = maker.take();
      path.full_pose = whole;
      for (PathPoint& p : path.points) {
        p.rotation = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), p.location.axis);
        if (whole) p.interpolation = PathInterpolation::slerp;
      }
      const auto cuts = cuts_of(path);
      const ReferencePath reference(path, {});
      SmoothingSettings settings = settings_of(kind);
      settings.whole_rotation = whole;
      const SmoothedPath smoothed(reference, cuts, settings);
      check_order(smoothed);
      const Worst worst = deviation(smoothed, 100);
      CHECK(worst.tip <= settings.merge_tip + settings.corner_tip + 1e-9);
      CHECK(worst.axis <= settings.merge_axis + settings.corner_axis + 1e-9);
      if (whole) CHECK(worst.rotation <= settings.merge_axis + settings.corner_axis + 1e-9);
    }
}

TEST_CASE("smoothed_path: corners are points of the input and each is told once",
          "[postproc][pipeline][smooth]") {
  for_random_paths(95, 2,
                   [](const Sample&, const std::vector<Cut>& cuts, const ReferencePath& reference) {
                     const SmoothedPath smoothed(reference, cuts, settings_of(BlendKind::acr));
                     std::set<std::uint32_t> lines;
                     std::size_t again = 0, straight = 0;
                     for (const auto& c : smoothed.corners()) {
                       again += lines.insert(c.input_line).second ? 0 : 1;
                       straight += c.turn < 1e-6 && c.rotation_half_width == 0.0 ? 1 : 0;
                     }
                     CHECK(again == 0);
                     CHECK(straight == 0);
                   });
}

TEST_CASE("smoothed_path: a reversal is a stop", "[postproc][pipeline][smooth]") {
  for (const BlendKind kind : {BlendKind::acr, BlendKind::ramp}) {
    PathMaker maker(Vec3(0, 0, 0));
    maker.feed({30, 0, 0}).feed({10, 0, 0}).feed({10, 20, 0});
    ToolPath path = maker.take();
    const auto cuts = cuts_of(path);
    const ReferencePath reference(path, {});
    const SmoothedPath smoothed(reference, cuts, settings_of(kind));
    check_order(smoothed);
    const auto corners = smoothed.corners();
    REQUIRE(corners.size() == 2);
    CHECK(corners[0].stop);
    CHECK(corners[0].input_line == path.points[1].line);
    CHECK(corners[0].turn == Approx(kPi));
    CHECK(corners[0].speed == 0.0);
    CHECK_FALSE(corners[1].stop);
    CHECK(check_exact(smoothed, {1}) == 1);
  }
}

TEST_CASE("smoothed_path: a path without cuts and a path of one point",
          "[postproc][pipeline][smooth]") {
  ToolPath point = PathMaker(Vec3(1, 2, 3)).take();
  const ReferencePath one(point, {});
  for (const SmoothedPath& s :
       {SmoothedPath(one), SmoothedPath(one, {}, settings_of(BlendKind::acr))}) {
    CHECK(s.legs() == 0);
    CHECK((s.at(0, 1.0).tip - Vec3(1, 2, 3)).norm() == 0.0);
    CHECK(number(s.place(0, 1.0)) == 0.0);
    CHECK(s.corners().empty());
  }
  ToolPath rapids = PathMaker(Vec3(0, 0, 0)).rapid({10, 0, 0}).rapid({10, 10, 0}).take();
  const ReferencePath reference(rapids, {});
  const SmoothedPath smoothed(reference, cuts_of(rapids), settings_of(BlendKind::acr));
  CHECK(smoothed.legs() == 2);
  CHECK(smoothed.corners().empty());
  check_order(smoothed);
}

TEST_CASE("reference_path: place_between shares the tip's length", "[postproc][pipeline][smooth]") {
  std::size_t count = 0;
  Random dice(9);
  for_random_paths(
      90, 2, [&](const Sample&, const std::vector<Cut>&, const ReferencePath& reference) {
        const auto total = static_cast<double>(reference.segments());
        const auto place_of = [](double x) {
          const double k = std::max(1.0, std::ceil(x));
          return PathPlace{static_cast<std::uint32_t>(k), x - (k - 1.0)};
        };
        // Tip length from the start of the path, by the shares of the segments.
        const auto length_at = [&](const PathPlace& p) {
          double sum = 0.0;
          for (std::size_t k = 1; k < p.segment; ++k) sum += reference.length(k);
          return sum + p.s * (p.segment == 0 ? 0.0 : reference.length(p.segment));
        };
        for (int n = 0; n < 20; ++n) {
          const double x = dice.between(0.0, total);
          const double y = dice.between(x, std::min(total, x + 6.0));
          const PathPlace from = place_of(x), to = place_of(y);
          const double a = length_at(from), b = length_at(to);
          // On a turn on the spot the tip's length says nothing.
          if (reference.length(from.segment) > 0.0)
            CHECK(number(place_between(reference, from, to, 0.0)) == Approx(x).margin(1e-9));
          if (reference.length(to.segment) > 0.0)
            CHECK(number(place_between(reference, from, to, 1.0)) == Approx(y).margin(1e-9));
          double last = x;
          for (int i = 1; i < 16; ++i) {
            const PathPlace p = place_between(reference, from, to, i / 16.0);
            CHECK(p.segment >= from.segment);
            CHECK(p.segment <= to.segment);
            CHECK(number(p) >= last - 1e-9);
            last = number(p);
            if (from.segment == to.segment)
              CHECK(number(p) == Approx(x + i / 16.0 * (y - x)).margin(1e-9));
            else if (b - a > 1e-6)
              CHECK(length_at(p) == Approx(a + i / 16.0 * (b - a)).margin(1e-6));
            ++count;
          }
        }
      });
  CHECK(count > 1000);
}
