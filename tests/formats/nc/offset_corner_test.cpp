#include "formats/nc/offset_corner.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "kernels/core/units.h"

// Corners of curves beside a contour, by their definition.
namespace smoothpost::nc {
namespace {

Vec2 towards(double angle) { return {std::cos(angle), std::sin(angle)}; }

OffsetCurve line(double angle) {
  OffsetCurve out;
  out.direction = towards(angle);
  return out;
}

/// An arc through the origin with that direction there.
OffsetCurve arc(double angle, double radius, bool counter_clockwise, const ToolSide& tool) {
  OffsetCurve out = line(angle);
  out.is_arc = true;
  out.counter_clockwise = counter_clockwise;
  out.centre = (counter_clockwise ? radius : -radius) * left_of(out.direction);
  out.radius = radius + (is_tool_inside(out, tool) ? -tool.radius : tool.radius);
  return out;
}

/// How far a point is from the curve: the line's distance from the tool's line, or the arc's.
double off(const Vec2& point, const OffsetCurve& curve, const ToolSide& tool) {
  if (curve.is_arc) return std::abs((point - curve.centre).norm() - curve.radius);
  return std::abs((point - beside(curve, tool)).dot(left_of(curve.direction)));
}

}  // namespace

TEST_CASE("corner: the point beside a contour", "[formats][nc][radius]") {
  CHECK((beside(line(0.0), {2.0, true}) - Vec2(0, 2)).norm() < 1e-15);
  CHECK((beside(line(0.0), {2.0, false}) - Vec2(0, -2)).norm() < 1e-15);
  CHECK(is_tool_inside(arc(0.0, 5.0, true, {2.0, true}), {2.0, true}));
  CHECK(arc(0.0, 5.0, true, {2.0, true}).radius == 3.0);
  CHECK(arc(0.0, 5.0, false, {2.0, true}).radius == 7.0);
}

TEST_CASE("corner: outside, inside or none by the turn away from the tool",
          "[formats][nc][radius]") {
  constexpr double kEdge = 0.05;
  for (const bool left : {true, false}) {
    const ToolSide tool{1.0, left};
    const double away = left ? -1.0 : 1.0;
    const auto corner = [&](double turn) {
      return corner_between(line(0.7), line(0.7 + away * turn), tool);
    };
    CHECK(corner(0.0) == Corner::none);
    CHECK(corner(kEdge - 1e-6) == Corner::none);
    CHECK(corner(-kEdge + 1e-6) == Corner::none);
    CHECK(corner(kEdge + 1e-6) == Corner::outside);
    CHECK(corner(-kEdge - 1e-6) == Corner::inside);
    CHECK(corner(0.5 * kPi) == Corner::outside);
    CHECK(corner(-0.5 * kPi) == Corner::inside);
    CHECK(corner(kPi) == Corner::outside);
    CHECK(corner(kPi + kEdge - 1e-6) == Corner::outside);
    CHECK(corner(kPi + kEdge + 1e-6) == Corner::inside);

    // A turn on the spot at an arc that has the tool outside of it.
    const OffsetCurve back = line(0.7 + kPi);
    CHECK(corner_between(arc(0.7, 5.0, left, tool), back, tool) == Corner::outside);
    CHECK(corner_between(arc(0.7, 5.0, !left, tool), back, tool) == Corner::inside);
    CHECK(corner_between(line(0.7), arc(0.7 + kPi, 5.0, left, tool), tool) == Corner::outside);
    CHECK(corner_between(line(0.7), arc(0.7 + kPi, 5.0, !left, tool), tool) == Corner::inside);
  }
}

TEST_CASE("corner: curves of an inside corner meet on both of them", "[formats][nc][radius]") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  int met = 0, apart = 0, kinds[4] = {0, 0, 0, 0};
  for (int k = 0; k < 4000; ++k) {
    const ToolSide tool{0.2 + 2.0 * share(random), share(random) < 0.5};
    const auto element = [&](double angle) {
      if (share(random) < 0.5) return line(angle);
      return arc(angle, tool.radius + 0.1 + 8.0 * share(random), share(random) < 0.5, tool);
    };
    const double angle = 2.0 * kPi * share(random);
    const double turn = 0.1 + 2.9 * share(random);
    const OffsetCurve before = element(angle);
    const OffsetCurve next = element(angle + (tool.left ? turn : -turn));
    CHECK(corner_between(before, next, tool) == Corner::inside);
    const auto point = inside_corner(before, next, tool);
    if (!point) {
      ++apart;
      CHECK((before.is_arc || next.is_arc));
      continue;
    }
    ++met;
    ++kinds[(before.is_arc ? 2 : 0) + (next.is_arc ? 1 : 0)];
    CHECK(off(*point, before, tool) < 1e-9);
    CHECK(off(*point, next, tool) < 1e-9);
  }
  CHECK(met > 2000);
  CHECK(apart > 0);
  for (const int kind : kinds) CHECK(kind > 300);
}

TEST_CASE("corner: the turn between two points", "[formats][nc][radius]") {
  const Vec2 centre(1.0, 2.0);
  for (double angle = 0.25; angle < 6.2; angle += 0.25) {
    const Vec2 from = centre + 3.0 * towards(0.4);
    const Vec2 to = centre + 2.0 * towards(0.4 + angle);
    CHECK(turn_between(centre, from, to, true) == Approx(angle));
    CHECK(turn_between(centre, from, to, false) == Approx(2.0 * kPi - angle));
  }
  const Vec2 here = centre + towards(1.0);
  CHECK(turn_between(centre, here, here, true) == Approx(2.0 * kPi));
  CHECK(turn_between(centre, here, centre + towards(1.0 + 1e-7), true) > 6.0);
  CHECK(turn_between(centre, here, centre + towards(1.0 + 1e-5), true) ==
        Approx(1e-5).epsilon(1e-3));
}

}  // namespace smoothpost::nc
