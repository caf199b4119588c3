#include "formats/csv/cutter_locations.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/process.h"
#include "kernels/core/units.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

ToolPath read(const std::string& text) {
  const auto result = read_cutter_locations(text, "p.csv");
  for (const auto& d : result.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(result.ok());
  return result.value();
}

/// All diagnostics of a file that is refused.
Diagnostics refused(const std::string& text) {
  const auto result = read_cutter_locations(text, "p.csv");
  REQUIRE_FALSE(result.ok());
  for (const auto& d : result.diagnostics()) CHECK(d.where.file == "p.csv");
  return result.diagnostics();
}

void check_refusal(const std::string& text, const std::string& code, int line, int column) {
  const auto diagnostics = refused(text);
  INFO(to_string(diagnostics[0]));
  CHECK(diagnostics.size() == 1);
  CHECK(diagnostics[0].code == code);
  CHECK(diagnostics[0].where.line == line);
  CHECK(diagnostics[0].where.column == column);
}

const std::string kHead = "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min,beam\n";

}  // namespace

TEST_CASE("csv: tips, axes, durations, lines", "[formats][csv]") {
  const auto path = read(
      "# made by hand\n"
      "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n"
      "0,0,0,0,0,1,600\n"
      "\n"
      "3,4,0,0,0,1,600   # five millimetres\n"
      "3,4,0,1,0,0,600\n"
      "3,4,12,1,0,0,\n"
      "+3,4.0,2e0,0.6,0,0.8,300\n");
  REQUIRE(path.points.size() == 5);
  CHECK(path.events.empty());
  CHECK(path.points[0].line == 3);
  CHECK(path.points[0].duration == 0.0);
  CHECK(path.points[1].line == 5);
  CHECK(path.points[1].location.tip == Vec3(3, 4, 0));
  CHECK(path.points[1].kind == MotionKind::feed);
  CHECK(path.points[1].duration == Approx(0.5));  // 5 mm at 10 mm/s
  CHECK(path.points[2].kind == MotionKind::feed);
  CHECK(path.points[2].duration == 0.0);  // it only turns
  CHECK(path.points[2].location.axis == Vec3(1, 0, 0));
  CHECK(path.points[3].kind == MotionKind::rapid);
  CHECK(path.points[3].duration == 0.0);
  CHECK(path.points[4].location.tip == Vec3(3, 4, 2));
  CHECK(path.points[4].location.axis.isApprox(Vec3(0.6, 0, 0.8)));
  CHECK(path.points[4].duration == Approx(2.0));  // 10 mm at 5 mm/s
  for (const auto& p : path.points) {
    CHECK(p.interpolation == PathInterpolation::great_circle);
    CHECK_FALSE(p.beam);
    CHECK_FALSE(p.is_arc);
  }
}

TEST_CASE("csv: columns in any order, CRLF, byte order mark, line column", "[formats][csv]") {
  const auto path = read(
      "\xef\xbb\xbf line , k,j,i,feed_mm_per_min,z_mm,y_mm, x_mm\r\n"
      "70,1,0,0,60,3,2,1\r\n\t71 ,0,1,0,60,3,2,11\r\n");
  REQUIRE(path.points.size() == 2);
  CHECK(path.points[0].location.tip == Vec3(1, 2, 3));
  CHECK(path.points[0].location.axis == Vec3(0, 0, 1));
  CHECK(path.points[1].location.axis == Vec3(0, 1, 0));
  CHECK(path.points[1].duration == Approx(10.0));
  CHECK(path.points[0].line == 70);
  CHECK(path.points[1].line == 71);
}

TEST_CASE("csv: three ways to write the same axis", "[formats][csv]") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> angle(-170.0, 170.0);
  std::string euler = "x_mm,y_mm,z_mm,rz_deg,ry_deg,rx_deg,feed_mm_per_min\n";
  std::string quaternion = "x_mm,y_mm,z_mm,qw,qx,qy,qz,feed_mm_per_min\n";
  std::string vector = "x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n";
  const auto row = [](std::initializer_list<double> values) {
    std::string out = "1,2,3";
    char buffer[40];
    for (const double v : values) {
      std::snprintf(buffer, sizeof buffer, ",%.17g", v);
      out += buffer;
    }
    return out + ",100\n";
  };
  for (int i = 0; i < 200; ++i) {
    const double z = angle(random), y = angle(random), x = angle(random);
    const auto turn = [](double degrees, const Vec3& about) {
      return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * kPi / 180.0, about));
    };
    // R = Rz Ry Rx by its definition.
    const Eigen::Quaterniond q =
        turn(z, Vec3::UnitZ()) * turn(y, Vec3::UnitY()) * turn(x, Vec3::UnitX());
    const Vec3 axis = q * Vec3::UnitZ();
    euler += row({z, y, x});
    quaternion += row({-q.w(), -q.x(), -q.y(), -q.z()});
    vector += row({axis.x(), axis.y(), axis.z()});
  }
  const auto a = read(euler);
  const auto b = read(quaternion);
  const auto c = read(vector);
  REQUIRE(c.points.size() == 200);
  for (std::size_t i = 0; i < 200; ++i) {
    CHECK((a.points[i].location.axis - c.points[i].location.axis).norm() < 1e-12);
    CHECK((b.points[i].location.axis - c.points[i].location.axis).norm() < 1e-12);
    CHECK(std::abs(a.points[i].location.axis.norm() - 1.0) < 1e-12);
  }
}

TEST_CASE("csv: an axis of another length is normalised with a warning", "[formats][csv]") {
  const auto result = read_cutter_locations(
      kHead + "0,0,0,0,0,1,60,0\n0,0,1,0,0,5,60,0\n0,0,2,0,3,4,60,0\n", "p.csv");
  REQUIRE(result.ok());
  CHECK(result.value().points[2].location.axis.isApprox(Vec3(0, 0.6, 0.8)));
  REQUIRE(result.diagnostics().size() == 1);
  CHECK(result.diagnostics()[0].code == "CSV115");
  CHECK(result.diagnostics()[0].severity == Severity::warning);
  CHECK(result.diagnostics()[0].where.line == 3);
  CHECK(result.diagnostics()[0].text.find("2 rows") != std::string::npos);
}

TEST_CASE("csv: the beam column makes events where the state changes", "[formats][csv]") {
  // Segments: 0-1 on, 1-2 on, 2-3 off, 3-4 rapid off, 4-5 on.
  const auto path = read(kHead +
                         "0,0,0,0,0,1,60,0\n1,0,0,0,0,1,60,1\n2,0,0,0,0,1,60,1\n3,0,0,0,0,1,60,0\n"
                         "4,0,0,0,0,1,0,0\n5,0,0,0,0,1,60,1\n");
  const std::vector<bool> beam = {false, true, true, false, false, true};
  for (std::size_t i = 0; i < beam.size(); ++i) CHECK(path.points[i].beam == beam[i]);
  CHECK(path.points[3].kind == MotionKind::feed);
  CHECK(path.points[4].kind == MotionKind::rapid);
  struct Expected {
    std::size_t point;
    const char* name;
    std::uint32_t line;
  };
  const std::vector<Expected> expected = {{0, event_name::kBeamOn, 2},
                                          {2, event_name::kBeamOff, 4},
                                          {4, event_name::kBeamOn, 6},
                                          {5, event_name::kBeamOff, 7}};
  REQUIRE(path.events.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(path.events[i].kind == PathEvent::Kind::process);
    CHECK(path.events[i].point == expected[i].point);
    CHECK(path.events[i].event.name == expected[i].name);
    CHECK(path.events[i].line == expected[i].line);
  }
  // The first row's feed and beam have no segment.
  const auto first = read(kHead + "0,0,0,0,0,1,0,1\n1,0,0,0,0,1,60,0\n");
  CHECK(first.events.empty());
  CHECK_FALSE(first.points[0].beam);
}

TEST_CASE("csv: headers that cannot be read are located", "[formats][csv]") {
  check_refusal("", "CSV101", 0, 0);
  check_refusal("# nothing\n\n", "CSV101", 0, 0);
  check_refusal("x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min, speed\n0,0,0,0,0,1,2,3\n", "CSV102", 1, 39);
  check_refusal("# c\nx_mm,y_mm,z_mm,i,x_mm,j,k,feed_mm_per_min\n", "CSV103", 2, 18);
  check_refusal("x_mm,z_mm,i,j,k,feed_mm_per_min\n", "CSV104", 1, 0);
  check_refusal("x_mm,y_mm,z_mm,i,k,feed_mm_per_min\n", "CSV104", 1, 0);
  check_refusal("x_mm,y_mm,z_mm,feed_mm_per_min\n", "CSV104", 1, 0);
  check_refusal("x_mm,y_mm,z_mm,i,j,k,rz_deg,ry_deg,rx_deg,feed_mm_per_min\n", "CSV104", 1, 0);
  check_refusal("x_mm,y_mm,z_mm,i,j,k,beam\n0,0,0,0,0,1,0\n", "CSV109", 1, 0);
  check_refusal(kHead, "CSV114", 1, 0);
  const auto semicolons = refused("x_mm;y_mm;z_mm;i;j;k\n");
  CHECK(semicolons[0].text.find("commas") != std::string::npos);
  // Each missing column by its name.
  const auto missing = refused("x_mm,i\n");
  CHECK(missing.size() == 5);
  CHECK(missing[0].text.find("y_mm") != std::string::npos);
  const auto feed = refused("x_mm,y_mm,z_mm,i,j,k\n");
  CHECK(feed[0].text.find("feed_mm_per_min") != std::string::npos);
}

TEST_CASE("csv: rows that cannot be read are located", "[formats][csv]") {
  const std::string good = "0,0,0,0,0,1,60,0\n";
  check_refusal(kHead + good + "1,2,3,0,0,1,60\n", "CSV105", 3, 13);
  check_refusal(kHead + good + "1,2,3,0,0,1,60,0,9\n", "CSV105", 3, 18);
  check_refusal(kHead + good + "1, two,3,0,0,1,60,0\n", "CSV106", 3, 4);
  check_refusal(kHead + good + "1,,3,0,0,1,60,0\n", "CSV106", 3, 3);
  check_refusal(kHead + good + "1,2x,3,0,0,1,60,0\n", "CSV106", 3, 3);
  check_refusal(kHead + good + "1,1e38,3,0,0,1,60,0\n", "CSV107", 3, 3);
  check_refusal(kHead + good + "nan,1,3,0,0,1,60,0\n", "CSV107", 3, 1);
  check_refusal(kHead + good + "1,1,1e999,0,0,1,60,0\n", "CSV107", 3, 5);
  check_refusal(kHead + good + "1,2,3,0,0,0,60,0\n", "CSV108", 3, 7);
  check_refusal("x_mm,y_mm,z_mm,qw,qx,qy,qz,feed_mm_per_min\n1,2,3,0,0,0,0,60\n", "CSV108", 2, 7);
  check_refusal(kHead + good + "1,2,3,0,0,1,-60,0\n", "CSV110", 3, 13);
  check_refusal(kHead + good + "1,2,3,0,0,1,60,on\n", "CSV111", 3, 16);
  check_refusal(kHead + good + "1,2,3,0,0,1,0,1\n", "CSV112", 3, 13);
  check_refusal("line,x_mm,y_mm,z_mm,i,j,k,feed_mm_per_min\n-4,1,2,3,0,0,1,60\n", "CSV113", 2, 1);
}

TEST_CASE("csv: errors are collected, not more than 100", "[formats][csv]") {
  std::string text = kHead;
  for (int i = 0; i < 3; ++i) text += "a,b,0,0,0,1,60,0\n";
  CHECK(refused(text).size() == 6);
  for (int i = 0; i < 500; ++i) text += "a,b,0,0,0,1,60,0\n";
  const auto many = refused(text);
  REQUIRE(many.size() == 101);
  CHECK(many.back().code == "CSV116");
  CHECK(many.back().severity == Severity::note);
}

TEST_CASE("csv: every prefix and 10,000 mutations end in a value or diagnostics",
          "[formats][csv]") {
  const std::vector<std::string> files = {
      kHead + "# c\r\n0,0,0,0,0,1,60,0\r\n1,0,0.5,0,0.6,0.8,60,1\r\n2,-1e-3,0,1,0,0,,0\r\n",
      "line,x_mm,y_mm,z_mm,qw,qx,qy,qz,feed_mm_per_min\n7,1,2,3,1,0,0,0,60\n8,1,2,4,0.5,0.5,0.5,0."
      "5,90\n",
      "x_mm,y_mm,z_mm,rz_deg,ry_deg,rx_deg,feed_mm_per_min,beam\n1,2,3,10,20,30,600,1\n1,5,3,0,0,1,"
      "6,1\n"};
  std::mt19937 random(23);
  int values = 0;
  int refusals = 0;
  const auto run = [&](const std::string& text) {
    const auto result = read_cutter_locations(text, "p.csv");
    if (!result.ok()) {
      REQUIRE(has_error(result.diagnostics()));
      ++refusals;
      return;
    }
    ++values;
    for (const auto& p : result.value().points) {
      REQUIRE(p.location.tip.allFinite());
      REQUIRE(std::abs(p.location.axis.norm() - 1.0) < 1e-9);
      REQUIRE((std::isfinite(p.duration) && p.duration >= 0.0));
    }
    for (const auto& e : result.value().events) REQUIRE(e.point < result.value().points.size());
  };
  for (const auto& file : files)
    for (std::size_t n = 0; n <= file.size(); ++n) run(file.substr(0, n));
  for (int i = 0; i < 10000; ++i) {
    std::string text = files[static_cast<std::size_t>(i) % files.size()];
    for (int k = 0; k <= i % 3; ++k) {
      const std::size_t at = random() % text.size();
      if (random() % 4 == 0)
        text.erase(at, 1);
      else
        text[at] = random() % 2 ? "0123456789.,-+e#\n\r \t"[random() % 20]
                                : static_cast<char>(random() % 256);
    }
    run(text);
  }
  CHECK(values > 300);
  CHECK(refusals > 1000);
}

TEST_CASE("csv: the cases of paper B", "[formats][csv][paper]") {
  const auto path = test::shared_path("reference/case2.csv");
  if (!path) {
    WARN("no reference material beside the checkout: nothing to test here");
    return;
  }
  const auto two = read(test::read_bytes(*path));
  REQUIRE(two.points.size() == 628);
  CHECK(two.points[0].location.tip == Vec3(800, 700, 1000));
  double length = 0.0;
  double time = 0.0;
  for (std::size_t i = 1; i < two.points.size(); ++i) {
    length += (two.points[i].location.tip - two.points[i - 1].location.tip).norm();
    time += two.points[i].duration;
    CHECK(two.points[i].beam);
  }
  CHECK(length == Approx(627.5).margin(1.0));
  CHECK(time == Approx(length / 250.0));  // 15 m/min
  REQUIRE(two.events.size() == 2);
  CHECK(two.events[0].point == 0);
  CHECK(two.events[1].point == 627);
  const auto one = read(test::read_bytes(*test::shared_path("reference/case1.csv")));
  CHECK(one.points.size() == 361);
}
