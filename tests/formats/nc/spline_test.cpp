#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "formats/nc/spline_curve.h"
#include "tests/formats/nc/recording.h"

namespace smoothpost::test {
namespace {

using Codes = std::vector<std::string>;

/// A rational Bézier curve from Bernstein polynomials.
Vec3 bezier(const nc::ControlNet& net, double t) {
  const auto degree = static_cast<double>(net.size() - 1);
  Vec3 sum = Vec3::Zero();
  double weight = 0.0, choose = 1.0;
  for (std::size_t i = 0; i < net.size(); ++i) {
    const auto k = static_cast<double>(i);
    const double b = net[i].weight * choose * std::pow(t, k) * std::pow(1.0 - t, degree - k);
    sum += b * net[i].point;
    weight += b;
    choose *= (degree - k) / (k + 1.0);
  }
  return sum / weight;
}

/// A B-spline basis function by the recursion that defines it.
double basis(const std::vector<double>& knots, std::size_t i, std::size_t order, double u) {
  if (order == 1) return knots[i] <= u && u < knots[i + 1] ? 1.0 : 0.0;
  const double low = knots[i + order - 1] - knots[i];
  const double high = knots[i + order] - knots[i + 1];
  double value = 0.0;
  if (low > 0.0) value += (u - knots[i]) / low * basis(knots, i, order - 1, u);
  if (high > 0.0) value += (knots[i + order] - u) / high * basis(knots, i + 1, order - 1, u);
  return value;
}

double distance_to_chord(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 d = b - a;
  const double along =
      d.squaredNorm() > 0.0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
  return (p - a - along * d).norm();
}

nc::ControlNet random_net(std::mt19937& random, std::size_t size) {
  std::uniform_real_distribution<double> place(-50.0, 50.0), weight(0.2, 5.0);
  nc::ControlNet net;
  for (std::size_t i = 0; i < size; ++i) {
    net.push_back({Vec3(place(random), place(random), 0.0), weight(random)});
  }
  return net;
}

double largest_distance(const nc::ControlNet& net, const std::vector<Vec3>& ends) {
  double worst = 0.0;
  for (int i = 0; i <= 2000; ++i) {
    const Vec3 p = bezier(net, i / 2000.0);
    double nearest = 1e9;
    Vec3 last = net.front().point;
    for (const Vec3& end : ends) {
      nearest = std::min(nearest, distance_to_chord(p, last, end));
      last = end;
    }
    worst = std::max(worst, nearest);
  }
  return worst;
}

}  // namespace

TEST_CASE("splines: no piece is farther from the curve than the tolerance",
          "[formats][nc][splines]") {
  std::mt19937 random(7);
  for (const double tolerance : {1.0, 0.05}) {
    for (int i = 0; i < 20; ++i) {
      const nc::ControlNet net = random_net(random, 3 + random() % 3);
      const std::vector<Vec3> ends = nc::follow_bezier(net, tolerance, 100'000);
      REQUIRE_FALSE(ends.empty());
      CHECK(ends.back() == net.back().point);
      CHECK(largest_distance(net, ends) <= tolerance);
    }
  }
  CHECK(nc::follow_bezier(random_net(random, 4), 1e-9, 50).empty());
  // A straight line is one piece.
  CHECK(nc::follow_bezier({{Vec3(0, 0, 0)}, {Vec3(1, 0, 0)}, {Vec3(2, 0, 0)}}, 1e-9, 9).size() ==
        1);
}

TEST_CASE("splines: the spans of a NURBS are the NURBS", "[formats][nc][splines]") {
  std::mt19937 random(8);
  for (std::size_t order = 2; order <= 5; ++order) {
    const nc::ControlNet net = random_net(random, order + 4);
    const auto spans = nc::bezier_spans(net, order);
    REQUIRE(spans.size() == 5);
    std::vector<double> knots(order, 0.0);
    for (double k = 1.0; k < 5.0; k += 1.0) knots.push_back(k);
    knots.insert(knots.end(), order, 5.0);
    for (int i = 0; i < 100; ++i) {
      const double u = i * 0.05;
      Vec3 sum = Vec3::Zero();
      double weight = 0.0;
      for (std::size_t k = 0; k < net.size(); ++k) {
        const double b = net[k].weight * basis(knots, k, order, u);
        sum += b * net[k].point;
        weight += b;
      }
      const auto span = static_cast<std::size_t>(u);
      CHECK((bezier(spans[span], u - static_cast<double>(span)) - sum / weight).norm() < 1e-9);
    }
  }
}

TEST_CASE("splines: G5 and G5.1 in a program", "[formats][nc][splines]") {
  const Run r = run_lines("G0 X1 Y2 Z3 F60\nG5 I0 J3 P0 Q3 X11 Y2\nP-1 Q2 X20 Y2\nG5.1 X24 I1 J2");
  INFO(r.all_text());
  REQUIRE(r.ok);
  // The first is symmetric: half way up at 3/4 of 3 mm.
  double highest = 0.0, length = 0.0, time = 0.0;
  for (const auto& m : r.sink.motions) {
    if (m.line != 2) continue;
    highest = std::max(highest, m.end[1]);
    length += std::hypot(m.end[0] - m.start[0], m.end[1] - m.start[1]);
    time += m.duration;
    CHECK(m.end[2] == 3.0);
    CHECK(m.kind == MotionKind::feed);
  }
  CHECK(highest == Approx(2.0 + 2.25).margin(1e-3));
  CHECK(time == Approx(length));  // 60 mm/min
  // Without I J the second goes on with the mirrored control point of the first.
  const nc::ControlNet second = {
      {Vec3(11, 2, 3)}, {Vec3(11, -1, 3)}, {Vec3(19, 4, 3)}, {Vec3(20, 2, 3)}};
  const nc::ControlNet third = {{Vec3(20, 2, 3)}, {Vec3(21, 4, 3)}, {Vec3(24, 2, 3)}};
  std::vector<Vec3> ends, last;
  for (const auto& m : r.sink.motions) {
    if (m.line == 3) ends.emplace_back(m.end[0], m.end[1], m.end[2]);
    if (m.line == 4) last.emplace_back(m.end[0], m.end[1], m.end[2]);
  }
  CHECK(largest_distance(third, last) <= nc::kSplineTolerance);
  CHECK(ends.back() == Vec3(20, 2, 3));
  CHECK(largest_distance(second, ends) <= nc::kSplineTolerance);
}

TEST_CASE("splines: NURBS in a program", "[formats][nc][splines]") {
  // A quarter of a circle of radius 10 as a rational quadratic.
  const Run r =
      run_lines("G0 X10 Y0 F100\nG5.2 P1 L3\nX10 Y10 P0.70710678118654752\nX0 Y10 P1\nG5.3");
  INFO(r.all_text());
  REQUIRE(r.ok);
  REQUIRE(r.sink.motions.size() > 10);
  for (std::size_t i = 1; i < r.sink.motions.size(); ++i) {
    const auto& m = r.sink.motions[i];
    CHECK(std::hypot(m.end[0], m.end[1]) == Approx(10.0).epsilon(1e-12));
  }
  CHECK(r.sink.motions.back().end[0] == 0.0);
  CHECK(run_lines("G0 X0 Y1 F9\nG5.2 X0 Y1 P1 L3\nX2 Y2 P1\nX2 Y0 P1\nX0 Y0 P2\nG5.3").ok);
}

TEST_CASE("splines: what is refused", "[formats][nc][splines]") {
  struct Row {
    const char* lines;
    const char* code;
  };
  const Row rows[] = {{"G5 P0 Q-3 X1 Y1", "NC262"},
                      {"G5 I0 J3 P0 X1 Y1", "NC262"},
                      {"G5 I0 P0 Q1 X1 Y1", "NC262"},
                      {"G5 I0 J3 P0 Q1 X1 Z1", "NC262"},
                      {"G18 G5 I0 J3 P0 Q1 X1", "NC262"},
                      {"G5.1 X4 I1", "NC262"},
                      {"G5.1 X4 I0 J0", "NC262"},
                      {"G5 I0 J3 P0 Q1 X1 R5", "NC215"},
                      {"G5.2 P1 L3\nX1 Y1\nG5.3", "NC262"},
                      {"G5.2 P1 L3\nX1 Y1\nX2 Y2\nG0 X1", "NC262"},
                      {"G5.2 P1 L3\nX1 Y1\nX2 Y2", "NC262"},
                      {"G5.2 P1 L3\nX1 Y1\nG28 X1\nX2 Y2\nG5.3", "NC262"},
                      {"G5.2 P0 L3\nX1 Y1\nX2 Y2\nG5.3", "NC262"},
                      {"G5.2 P1 L3.5\nX1 Y1\nX2 Y2\nG5.3", "NC262"},
                      {"G5.2 P1 L3\nX1\nX2 Y2\nG5.3", "NC262"},
                      {"G91 G5.2 P1 L3\nX1 Y1\nX2 Y2\nG5.3", "NC262"},
                      {"F0\nG5 I0 J3 P0 Q-3 X1 Y1", "NC213"},
                      {"G5.3 X1", "NC210"}};
  for (const Row& row : rows) {
    const Run r = run_lines("G0 X0 Y0 F60\n" + std::string(row.lines));
    INFO(row.lines << "\n" << r.all_text());
    REQUIRE_FALSE(r.ok);
    CHECK(r.has(row.code));
  }
  CHECK(run_lines("F60\nG5 I0 J3 P0 Q-3 X1 Y1").has("NC262"));  // the start is not known
}

}  // namespace smoothpost::test
