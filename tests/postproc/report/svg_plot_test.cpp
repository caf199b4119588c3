#include "postproc/report/svg_plot.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "tests/postproc/report/drawn.h"

using namespace smoothpost;
using test::contains;
using test::count_of;

namespace {

struct Point {
  double x = 0.0, y = 0.0;
};

/// The points of the first path.
std::vector<Point> drawn_points(const std::string& text) {
  std::vector<Point> out;
  const std::size_t begin = text.find("<path d=\"");
  REQUIRE(begin != std::string::npos);
  const std::size_t end = text.find('"', begin + 9);
  for (std::size_t at = begin + 9; at < end;) {
    std::size_t used = 0;
    Point p;
    p.x = std::stod(text.substr(at + 1, 24), &used);  // behind M or L
    at += 1 + used;
    p.y = std::stod(text.substr(at, 24), &used);
    at += used;
    out.push_back(p);
  }
  return out;
}

double lowest(const std::vector<Point>& points, double Point::*member) {
  double v = 1e9;
  for (const Point& p : points) v = std::min(v, p.*member);
  return v;
}

double highest(const std::vector<Point>& points, double Point::*member) {
  double v = -1e9;
  for (const Point& p : points) v = std::max(v, p.*member);
  return v;
}

}  // namespace

TEST_CASE("svg: a peak of one sample in a million is drawn at its height", "[postproc][report]") {
  Plot plot;
  PlotCurve c;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> noise(-1.0, 1.0);
  for (int i = 0; i < 1000000; ++i) {
    c.x.push_back(i);
    c.y.push_back(noise(random));
  }
  c.y[543210] = 100.0;
  c.y[123456] = -40.0;
  plot.curves.push_back(c);
  const std::string text = svg(plot);
  const std::vector<Point> points = drawn_points(text);
  CHECK(points.size() < 4U * 760U);
  // 6 % of room on either side of [-40, 100] in a frame from 30 to height - 36
  const double inner = plot.height - 66.0, span = 140.0 * 1.12;
  CHECK(lowest(points, &Point::y) == Approx(30.0 + inner * 8.4 / span).margin(0.06));
  CHECK(highest(points, &Point::y) == Approx(30.0 + inner * (span - 8.4) / span).margin(0.06));
  CHECK(text.size() < 60000);
  CHECK(svg(plot) == text);
}

TEST_CASE("svg: limits that are near are lines and those far away are words",
          "[postproc][report]") {
  Plot plot;
  plot.curves.push_back({"", Ink::after, {0.0, 1.0, 2.0}, {0.0, 10.0, -5.0}});
  plot.limits_of_size = true;
  plot.limits = {{12.0, "limit"}, {-12.0, "limit"}};
  CHECK(count_of(svg(plot), "stroke-dasharray=\"6 4\"") == 2);
  plot.limits = {{400.0, "limit"}, {-400.0, "limit"}};
  const std::string far = svg(plot);
  CHECK(count_of(far, "stroke-dasharray=\"6 4\"") == 0);
  CHECK(contains(far, "beyond: limit 400 (2.5 % of it in this picture)"));
}

TEST_CASE("svg: a gap lifts the pen and text is escaped", "[postproc][report]") {
  Plot plot;
  const double gap = std::numeric_limits<double>::quiet_NaN();
  plot.title = "<script>alert(1)</script>";
  plot.curves.push_back({"<i>", Ink::after, {0, 1, 2, 3, 4}, {0.0, 1.0, gap, 1.0, 0.0}});
  plot.marks.push_back({1.0, 1.0, "a & b"});
  const std::string text = svg(plot);
  const std::size_t at = text.find("<path d=\"");
  REQUIRE(at != std::string::npos);
  const std::string path = text.substr(at, text.find("\" fill", at) - at);
  CHECK(count_of(path, "M") == 2);
  CHECK_FALSE(contains(text, "<script"));
  CHECK_FALSE(contains(text, "<i>"));
  CHECK(contains(text, "&lt;script&gt;"));
  CHECK(contains(text, "a &amp; b"));
}

TEST_CASE("svg: nothing and one value and infinity still give a picture", "[postproc][report]") {
  for (const std::vector<double>& y :
       {std::vector<double>{}, std::vector<double>{3.0}, std::vector<double>{3.0, 3.0},
        std::vector<double>{INFINITY, 1.0}, std::vector<double>{NAN, NAN}}) {
    Plot plot;
    PlotCurve c;
    for (std::size_t i = 0; i < y.size(); ++i) c.x.push_back(static_cast<double>(i));
    c.y = y;
    plot.curves.push_back(c);
    const std::string text = svg(plot);
    CHECK(contains(text, "</svg>"));
    CHECK_FALSE(contains(text, "nan"));
    CHECK_FALSE(contains(text, "inf"));
  }
}

TEST_CASE("svg: equal scales draw a square as a square", "[postproc][report]") {
  Plot plot;
  plot.of_function = false;
  plot.equal_scales = true;
  plot.height = 420.0;
  plot.curves.push_back({"", Ink::after, {0, 50, 50, 0, 0}, {0, 0, 50, 50, 0}});
  const std::string text = svg(plot);
  const std::vector<Point> points = drawn_points(text);
  REQUIRE(points.size() == 5);
  const double wide = highest(points, &Point::x) - lowest(points, &Point::x);
  CHECK(wide == Approx(highest(points, &Point::y) - lowest(points, &Point::y)).margin(0.25));
  CHECK(wide > 200.0);
}

TEST_CASE("box_of: quartiles of an even row of sizes", "[postproc][report]") {
  std::vector<double> sizes;
  for (int i = 100; i >= 0; --i) sizes.push_back(i);
  sizes.push_back(NAN);
  const PlotBox box = box_of("b", Ink::after, sizes);
  CHECK(box.lower == 25.0);
  CHECK(box.median == 50.0);
  CHECK(box.upper == 75.0);
  CHECK(box.largest == 100.0);
  CHECK(box_of("none", Ink::after, {}).largest == 0.0);
}

TEST_CASE("svg_boxes: one decade is one step of the logarithmic axis", "[postproc][report]") {
  BoxGroup group{"B", {{"p", Ink::after, 10.0, 100.0, 1000.0, 1e4}}, 1e5};
  const std::string text = svg_boxes("t", "y", {group});
  // medians are the thick lines, the limit the dashed one: three decades apart
  const auto height = [&](const char* mark) {
    const std::size_t end = text.find(mark);
    REQUIRE(end != std::string::npos);
    const std::size_t at = text.rfind("y1=\"", end) + 4;
    return std::stod(text.substr(at));
  };
  const double median = height("stroke-width=\"2.5\""), limit = height("stroke-dasharray=\"6 4\"");
  const double inner = 380.0 - 66.0;
  // the axis goes from 10 to 1e6
  CHECK(median - limit == Approx(3.0 * inner / 5.0).margin(0.15));
}
