#include "kernels/smooth/corner_path.h"

#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/spline/acr_spline.h"
#include "tests/kernels/smooth/paths.h"
#include "tests/support/support.h"

namespace smoothpost {
namespace {

using test::Jumps;
using test::PathText;
using test::Random;

CornerSettings settings_of(BlendKind kind, double tip = 0.1, double rotation = 0.02) {
  CornerSettings settings;
  settings.kind = kind;
  settings.tip_tolerance = tip;
  settings.rotation_tolerance = rotation;
  return settings;
}

constexpr std::array<BlendKind, 2> kKinds = {BlendKind::acr, BlendKind::ramp};

/// Tolerances and continuity of one path.
void check_path(const PathText& text, const CornerSettings& settings) {
  const CornerPath path = text.blended(settings);
  const auto d = test::deviation(text, path, 64);
  CHECK(d.tip <= settings.tip_tolerance * (1 + 1e-9));
  CHECK(d.rotation <= settings.rotation_tolerance * (1 + 1e-9));
  Jumps jumps;
  test::measure_jumps(path, settings.closed, jumps);
  for (std::size_t k = 0; k < 4; ++k) {
    INFO("order " << k);
    CHECK(jumps.tip[k] < 1e-8);
    CHECK(jumps.rotation[k] < 1e-8);
    CHECK(jumps.tip_arc[k] < 1e-8);
    CHECK(jumps.rotation_arc[k] < 1e-8);
  }
  CHECK(jumps.slowest > 0.0);
}

Vec3 vec3(const nlohmann::json& v) {
  return Vec3(v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>());
}

nlohmann::json golden() {
  const auto path = test::shared_path("reference/paper_a.json");
  if (path) return nlohmann::json::parse(std::ifstream(*path));
  WARN("no shared reference files: skipped");
  return nullptr;
}

/// The paper's path; rotations Rz(alpha) Ry(beta) Rx(gamma).
PathText paper_path(const nlohmann::json& file) {
  PathText text;
  const auto rotation = [&](std::size_t i) {
    const Vec3 e = vec3(file.at("points").at("Psi").at(i));
    return Eigen::Quaterniond(rotation_from_rpy(e.z(), e.y(), e.x()));
  };
  text.nodes[0] = {vec3(file.at("points").at("P").at(0)), rotation(0)};
  for (std::size_t i = 1; i < 5; ++i) {
    const PathNode& last = text.nodes.back();
    text.line(vec3(file.at("points").at("P").at(i)) - last.tip,
              rotation_log((last.rotation.inverse() * rotation(i)).toRotationMatrix()));
  }
  return text;
}

/// Length of the smoothed tip from the start of a leg to x.
double arc_length(const CornerPath& path, std::size_t leg, double x) {
  constexpr std::array<double, 5> kNodes = {-0.906179845938664, -0.538469310105683, 0.0,
                                            0.538469310105683, 0.906179845938664};
  constexpr std::array<double, 5> kWeights = {0.236926885056189, 0.478628670499366,
                                              0.568888888888889, 0.478628670499366,
                                              0.236926885056189};
  const auto breaks = path.breaks(leg);
  double sum = 0.0;
  for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
    const double to = std::min(breaks[k + 1], x);
    const double half = 0.5 * (to - breaks[k]) / 16.0;
    if (half <= 0.0) break;
    for (int part = 0; part < 16; ++part)
      for (std::size_t i = 0; i < 5; ++i) {
        const double at = breaks[k] + half * (2.0 * part + 1.0 + kNodes[i]);
        sum += half * kWeights[i] * path.derivatives(leg, at).tip[1].norm();
      }
  }
  return sum;
}

}  // namespace

TEST_CASE("corner_path: straight corner", "[kernels][smooth]") {
  for (const BlendKind kind : kKinds) {
    PathText text;
    text.line(Vec3(3, 4, 0), Vec3(0.1, 0, 0)).line(Vec3(6, 8, 0), Vec3(0, 0.3, 0));
    const CornerPath path = text.blended(settings_of(kind));
    CHECK(path.corners()[1].half_width == 0.0);
    CHECK(path.corners()[1].rotation_half_width > 0.0);
    CHECK_FALSE(path.corners()[1].stop);
    CHECK(test::deviation(text, path, 50).tip < 1e-13);
    check_path(text, settings_of(kind));
  }
}

TEST_CASE("corner_path: reversal is an exact stop", "[kernels][smooth]") {
  for (const BlendKind kind : kKinds)
    for (const double off : {0.0, 0.01, radians_from_degrees(4.9)}) {
      PathText text;
      text.line(Vec3(10, 0, 0), Vec3(0.1, 0, 0))
          .line(-7.0 * Vec3(std::cos(off), std::sin(off), 0), Vec3(0, 0.3, 0));
      const CornerPath path = text.blended(settings_of(kind));
      CHECK(path.corners()[1].stop);
      CHECK(path.corners()[1].half_width == 0.0);
      CHECK(path.corners()[1].rotation_half_width == 0.0);
      const auto d = test::deviation(text, path, 50);
      CHECK(d.tip < 1e-13);
      CHECK(d.rotation < 1e-14);
    }
  PathText text;
  const double turn = radians_from_degrees(174.9);
  text.line(Vec3(10, 0, 0)).line(7.0 * Vec3(std::cos(turn), std::sin(turn), 0));
  CHECK_FALSE(text.blended(settings_of(BlendKind::acr)).corners()[1].stop);
  check_path(text, settings_of(BlendKind::acr));
}

TEST_CASE("corner_path: exact node", "[kernels][smooth]") {
  PathText text;
  text.line(Vec3(5, 0, 0), Vec3(0.1, 0, 0)).line(Vec3(0, 5, 0)).line(Vec3(0, 0, 5));
  text.nodes[1].exact = true;
  for (const BlendKind kind : kKinds) {
    const CornerPath path = text.blended(settings_of(kind));
    CHECK(path.corners()[1].half_width == 0.0);
    CHECK(path.corners()[1].rotation_half_width == 0.0);
    CHECK_FALSE(path.corners()[1].stop);
    CHECK(path.corners()[2].half_width > 0.0);
    check_path(text, settings_of(kind));
  }
}

TEST_CASE("corner_path: rotation without motion", "[kernels][smooth]") {
  PathText text;
  text.line(Vec3(10, 0, 0), Vec3(0.1, 0, 0))
      .line(Vec3::Zero(), Vec3(0, 0.4, 0))
      .line(Vec3(0, 10, 0), Vec3(0, 0, 0.2));
  for (const BlendKind kind : kKinds) {
    const auto settings = settings_of(kind);
    const CornerPath path = text.blended(settings);
    CHECK_FALSE(path.tip_moves(1));
    CHECK(path.length(1) == Approx(0.1 / 0.02 * 0.4));  // ρ times the angle
    CHECK(path.corners()[1].half_width > 0.0);
    CHECK(path.corners()[1].rotation_half_width > 0.0);
    check_path(text, settings);
  }
}

TEST_CASE("corner_path: motion without rotation", "[kernels][smooth]") {
  PathText text;
  text.line(Vec3(10, 0, 0)).line(Vec3(0, 10, 0)).line(Vec3(0, 0, 10));
  for (const BlendKind kind : kKinds) {
    const CornerPath path = text.blended(settings_of(kind));
    for (const Corner& corner : path.corners()) CHECK(corner.rotation_half_width == 0.0);
    for (std::size_t leg = 0; leg < 3; ++leg)
      CHECK((path.at(leg, 0.3 * path.length(leg)).linear() - Mat3::Identity()).norm() < 1e-15);
    check_path(text, settings_of(kind));
  }
}

TEST_CASE("corner_path: axis-aligned legs", "[kernels][smooth]") {
  std::vector<Vec3> steps;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-5.0, 5.0}) steps.push_back(sign * Vec3::Unit(axis));
  for (const BlendKind kind : kKinds)
    for (const Vec3& a : steps)
      for (const Vec3& b : steps) {
        if (std::abs(a.dot(b)) > 1.0) continue;
        PathText text;
        text.line(a, 0.02 * b).line(b, 0.04 * a);
        auto settings = settings_of(kind);
        settings.paper_shape = true;
        const CornerPath path = text.blended(settings);
        const double h = path.corners()[1].half_width;
        CHECK(h == Approx(0.1 / (path.corners()[1].blend.at_zero() * std::sqrt(2.0))));
        check_path(text, settings);
      }
}

TEST_CASE("corner_path: first and last leg", "[kernels][smooth]") {
  PathText text;
  text.line(Vec3(4, 0, 0), Vec3(0.1, 0, 0)).line(Vec3(0, 4, 0), Vec3(0, 0.2, 0));
  for (const BlendKind kind : kKinds) {
    const CornerPath path = text.blended(settings_of(kind));
    CHECK(path.corners().front().half_width == 0.0);
    CHECK(path.corners().back().half_width == 0.0);
    CHECK((path.at(0, 0.0).matrix() - text.pose(0, 0.0).matrix()).norm() < 1e-15);
    CHECK((path.at(1, 4.0).matrix() - text.pose(1, 1.0).matrix()).norm() < 1e-14);
  }
  // One leg alone is itself.
  PathText one;
  one.line(Vec3(1, 2, 3), Vec3(0.4, 0, 0));
  const auto d = test::deviation(one, one.blended(settings_of(BlendKind::acr)), 20);
  CHECK(d.tip < 1e-15);
  CHECK(d.rotation < 1e-15);
}

TEST_CASE("corner_path: closed contour", "[kernels][smooth]") {
  PathText text;
  const Vec3 turn(0.05, -0.02, 0.0);
  text.line(Vec3(8, 0, 0), turn).line(Vec3(0, 5, 0), -turn).line(Vec3(-8, 0, 0), turn);
  text.line(Vec3(0, -5, 0), -turn);
  for (const BlendKind kind : kKinds) {
    auto settings = settings_of(kind);
    settings.closed = true;
    const CornerPath path = text.blended(settings);
    CHECK(path.corners()[0].half_width > 0.0);
    CHECK(path.corners()[0].rotation_half_width > 0.0);
    CHECK(path.corners()[0].half_width == path.corners()[4].half_width);
    CHECK((path.at(0, 0.0).translation() - path.at(3, 5.0).translation()).norm() < 1e-14);
    CHECK(path.at(0, 0.0).translation().norm() > 0.09);
    check_path(text, settings);
  }
  // One full circle closes in itself.
  PathText circle;
  circle.arc(Vec3(5, 0, 0), Vec3::UnitZ(), 2.0 * kPi, 0.0);
  auto settings = settings_of(BlendKind::acr);
  settings.closed = true;
  check_path(circle, settings);
}

TEST_CASE("corner_path: legs with more than half a turn of rotation", "[kernels][smooth]") {
  for (const BlendKind kind : kKinds)
    for (const double turns : {0.5, 0.75, 1.0, 3.3, 20.0}) {
      PathText text;
      text.line(Vec3(10, 0, 0), 2.0 * kPi * turns * Vec3::UnitX())
          .line(Vec3(0, 10, 0), Vec3(0, 1, 0))
          .line(Vec3(0, 0, 10), 2.0 * kPi * turns * Vec3(0, 0.6, 0.8));
      check_path(text, settings_of(kind));
      const CornerPath path = text.blended(settings_of(kind));
      // It turns all the way: the rate on the first leg.
      const auto d = path.derivatives(0, 1.0);
      CHECK(2.0 * d.rotation[1].norm() == Approx(2.0 * kPi * turns / 10.0));
    }
}

TEST_CASE("corner_path: arcs and helices join lines and arcs", "[kernels][smooth]") {
  for (const BlendKind kind : kKinds) {
    PathText tangent;
    tangent.line(Vec3(10, 0, 0), Vec3(0.1, 0, 0))
        .arc(Vec3(0, 5, 0), Vec3::UnitZ(), kPi / 2, 0.0, Vec3(0, 0.2, 0))
        .line(Vec3(0, 10, 0))
        .arc(Vec3(5, 0, 0), -Vec3::UnitZ(), kPi, 0.0, Vec3(0, 0, 0.3))
        .arc(Vec3(2, 0, 0), Vec3::UnitZ(), kPi, 0.0);
    const CornerPath path = tangent.blended(settings_of(kind));
    for (std::size_t i = 1; i < 5; ++i) CHECK(path.corners()[i].half_width > 0.0);
    check_path(tangent, settings_of(kind));
    PathText sharp;
    sharp.line(Vec3(10, 0, 0))
        .arc(Vec3(5, 0, 0), Vec3::UnitZ(), 4.0, 3.0, Vec3(0.2, 0, 0))
        .arc(Vec3(0, 0, 7), Vec3(1, 1, 0), -2.0, -4.0)
        .line(Vec3(1, 1, 0))
        .arc(Vec3(-0.5, 0.5, 0), Vec3::UnitZ(), -1.0, 0.0, Vec3(0, 0.4, 0));
    check_path(sharp, settings_of(kind));
  }
}

TEST_CASE("corner_path: tolerance about the tool axis alone", "[kernels][smooth]") {
  for (const BlendKind kind : kKinds) {
    auto settings = settings_of(kind);
    settings.tool_axis = Vec3::UnitZ();
    // Spin alone may be blended as far as the legs go.
    PathText spin;
    spin.line(Vec3(10, 0, 0), Vec3(0, 0, 1)).line(Vec3(0, 10, 0), Vec3(0, 0, -1));
    const CornerPath path = spin.blended(settings);
    CHECK(path.corners()[1].rotation_half_width * path.rotation_blend().reach() == Approx(10.0));
    CHECK(test::deviation(spin, path, 100).axis < 1e-14);
    // Spin together with a tilt that does not change: to first order the axis would not move.
    PathText both;
    both.line(Vec3(10, 0, 0), Vec3(1.5, 0, 2)).line(Vec3(0, 10, 0), Vec3(1.5, 0, -2));
    const auto d = test::deviation(both, both.blended(settings), 1000);
    CHECK(d.axis <= settings.rotation_tolerance * (1 + 1e-9));
    CHECK(d.axis > 0.2 * settings.rotation_tolerance);
  }
}

TEST_CASE("corner_path: neighbours share a leg so that their third derivatives are alike",
          "[kernels][smooth]") {
  const double shallow = radians_from_degrees(20.0);
  PathText text;
  text.line(Vec3(10, 0, 0))
      .line(Vec3(0, 2, 0))
      .line(10.0 * Vec3(std::sin(shallow), std::cos(shallow), 0));
  const CornerPath path = text.blended(settings_of(BlendKind::ramp, 1.0));
  const auto k = [](double turn) { return std::sin(turn / 2) / std::pow(std::cos(turn / 2), 2); };
  const double a = path.corners()[1].half_width;
  const double b = path.corners()[2].half_width;
  CHECK(a + b == Approx(2.0));
  CHECK(a / b == Approx(std::sqrt(k(kPi / 2) / k(shallow))));
  // |r'''| ~ k/h² of both corners.
  CHECK(k(kPi / 2) / (a * a) == Approx(k(shallow) / (b * b)));
}

TEST_CASE("corner_path: derivatives equal central differences", "[kernels][smooth]") {
  Random random(77);
  for (int n = 0; n < 40; ++n) {
    PathText text;
    text.line(random.between(2, 9) * random.unit(), random.between(0, 2) * random.unit())
        .arc(3.0 * Vec3::UnitX(), Vec3::UnitZ(), random.between(-5, 5), 1.0, random.unit())
        .line(random.between(2, 9) * random.unit(), random.between(0, 2) * random.unit());
    const CornerPath path =
        text.blended(settings_of(kKinds[static_cast<std::size_t>(n % 2)], 0.3, 0.1));
    for (std::size_t leg = 0; leg < 3; ++leg) {
      const double length = path.length(leg);
      const double step = 1e-4;
      for (int i = 0; i < 20; ++i) {
        const double x = random.between(step, length - step);
        const auto low = path.derivatives(leg, x - step);
        const auto here = path.derivatives(leg, x);
        const auto high = path.derivatives(leg, x + step);
        if (low.rotation[0].dot(here.rotation[0]) < 0.5) continue;  // signs of the quaternion
        if (high.rotation[0].dot(here.rotation[0]) < 0.5) continue;
        for (std::size_t k = 0; k < 3; ++k) {
          const double scale = 2e-3 * std::pow(30.0, static_cast<double>(k));
          REQUIRE(((high.tip[k] - low.tip[k]) / (2 * step) - here.tip[k + 1]).norm() < scale);
          REQUIRE(
              ((high.rotation[k] - low.rotation[k]) / (2 * step) - here.rotation[k + 1]).norm() <
              scale);
        }
        const Pose pose = path.at(leg, x);
        REQUIRE((pose.translation() - here.tip[0]).norm() < 1e-13);
        const Eigen::Vector4d q = here.rotation[0];
        REQUIRE(
            (pose.linear() - Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix()).norm() <
            1e-13);
        REQUIRE((path.original(leg, x).matrix() - text.pose(leg, x / length).matrix()).norm() <
                1e-13);
      }
    }
  }
}

TEST_CASE("corner_path: bend_bound is never below dense second derivatives", "[kernels][smooth]") {
  Random random(78);
  double closest = 0.0;
  for (int n = 0; n < 200; ++n) {
    PathText text;
    text.line(random.scale(0.1, 20) * random.unit(), random.between(0, 2) * random.unit())
        .arc(random.scale(0.5, 30) * Vec3::UnitX(), Vec3::UnitZ(), random.between(-6, 6), 1.0,
             random.unit())
        .line(random.scale(0.1, 20) * random.unit(), random.between(0, 2) * random.unit());
    const CornerPath path = text.blended(
        settings_of(kKinds[static_cast<std::size_t>(n % 2)], random.scale(1e-2, 1), 0.1));
    const Vec3 axis = random.unit();
    for (std::size_t leg = 0; leg < 3; ++leg) {
      const auto b = path.breaks(leg);
      for (std::size_t k = 0; k + 1 < b.size(); ++k) {
        const auto bound = path.bend_bound(leg, b[k], b[k + 1]);
        const double step = (b[k + 1] - b[k]) / 200.0;
        double axis_bend = 0.0;
        double tip_bend = 0.0;
        for (int i = 1; i < 200; ++i) {
          const double x = b[k] + step * i;
          tip_bend = std::max(tip_bend, path.derivatives(leg, x).tip[2].norm());
          const Vec3 second = path.at(leg, x - step).linear() * axis -
                              2.0 * path.at(leg, x).linear() * axis +
                              path.at(leg, x + step).linear() * axis;
          axis_bend = std::max(axis_bend, (second.norm() - 1e-15) / (step * step));
        }
        REQUIRE(tip_bend <= bound.tip * (1 + 1e-12) + 1e-12);
        REQUIRE(axis_bend <= bound.axis * (1 + 1e-9) + 1e-9);
        if (bound.tip > 0.0) closest = std::max(closest, tip_bend / bound.tip);
      }
    }
  }
  CHECK(closest > 0.5);
}

TEST_CASE("corner_path: the paper's curve when g is acr", "[kernels][smooth][paper]") {
  const auto file = golden();
  if (file.is_null()) return;
  const PathText text = paper_path(file);
  CornerSettings settings = settings_of(BlendKind::acr, 0.8, 0.01);
  const CornerPath path = text.blended(settings);
  for (std::size_t i = 1; i <= 3; ++i) {
    // Golden control points of position corner i: the curve passes Q3, Q5 and Q7 at σ = ∓h, 0.
    const auto& q = file.at("paper_path").at(i - 1).at("Q");
    const double h = path.corners()[i].half_width;
    CHECK((path.at(i, 0.0).translation() - vec3(q.at(5))).norm() < 1e-9);
    const double u3 = kAcrCornerWeights[7] - kAcrCornerWeights[3];
    CHECK((path.at(i - 1, path.length(i - 1) + u3 * h).translation() - vec3(q.at(3))).norm() <
          1e-9);
    CHECK((path.at(i, -u3 * h).translation() - vec3(q.at(7))).norm() < 1e-9);
    const double u4 = kAcrCornerWeights[6] - kAcrCornerWeights[4];
    CHECK((path.at(i, -u4 * h).translation() - vec3(q.at(6))).norm() < 1e-9);
  }
}

TEST_CASE("corner_path: golden robust path with ramp and the tool axis",
          "[kernels][smooth][paper]") {
  const auto file = golden();
  if (file.is_null()) return;
  const auto& robust = file.at("robust_paper_path");
  CornerSettings settings = settings_of(BlendKind::ramp, 0.8, 0.01);
  settings.tool_axis = Vec3::UnitZ();
  const CornerPath path = paper_path(file).blended(settings);
  // The golden samples are at arc lengths of the smoothed tip: s(σ) by Gauss' rule.
  double total = 0.0;
  for (std::size_t leg = 0; leg < path.legs(); ++leg)
    total += arc_length(path, leg, path.length(leg));
  CHECK(total == Approx(robust.at("arc_length").get<double>()).epsilon(1e-10));
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(path.corners()[i].half_width ==
          Approx(robust.at("dp").at(i).get<double>()).margin(1e-10));
    CHECK(path.corners()[i].rotation_half_width ==
          Approx(robust.at("do").at(i).get<double>()).margin(1e-10));
    if (i > 0 && i < 4)
      CHECK(path.corners()[i].blend.c1() ==
            Approx(robust.at("c1").at(i - 1).get<double>()).epsilon(1e-10));
  }
  int compared = 0;
  for (const auto& sample : robust.at("samples")) {
    double s = std::min(sample.at("s").get<double>(), total);
    std::size_t leg = 0;
    while (leg + 1 < path.legs() && s > arc_length(path, leg, path.length(leg))) {
      s -= arc_length(path, leg, path.length(leg));
      ++leg;
    }
    double x = std::min(s, path.length(leg));
    for (int i = 0; i < 30; ++i)
      x = std::clamp(x + (s - arc_length(path, leg, x)) / path.derivatives(leg, x).tip[1].norm(),
                     0.0, path.length(leg));
    const Pose pose = path.at(leg, x);
    CHECK((pose.translation() - vec3(sample.at("p"))).norm() < 2e-9);
    const auto& q = sample.at("quat_xyzw");
    const Eigen::Quaterniond expected(q.at(3).get<double>(), q.at(0).get<double>(),
                                      q.at(1).get<double>(), q.at(2).get<double>());
    CHECK(Eigen::Quaterniond(pose.linear()).angularDistance(expected) < 2e-9);
    ++compared;
  }
  CHECK(compared == 41);
}

TEST_CASE("corner_path: golden random corners", "[kernels][smooth][paper]") {
  const auto file = golden();
  if (file.is_null()) return;
  int compared = 0;
  for (const auto& corner : file.at("random_corners")) {
    const Vec3 before = vec3(corner.at("Pm"));
    const Vec3 here = vec3(corner.at("Pc"));
    PathText text;
    text.nodes[0].tip = before;
    text.line(here - before).line(vec3(corner.at("Pp")) - here);
    const auto& ramp = corner.at("ramp");
    CornerSettings settings = settings_of(BlendKind::ramp, corner.at("eps").get<double>());
    settings.stop_angle = kPi;
    const CornerPath path = text.blended(settings);
    const Corner& made = path.corners()[1];
    CHECK(made.turn == Approx(corner.at("theta_rad").get<double>()).epsilon(1e-10));
    // The coordinates carry six decimals, the golden corner was made from more of them.
    CHECK(made.blend.c1() == Approx(ramp.at("c1").get<double>()).epsilon(1e-6));
    const double h = ramp.at("d").get<double>();
    const Vec3 in = (here - before).normalized();
    const Vec3 out = (vec3(corner.at("Pp")) - here).normalized();
    const std::array<std::pair<double, const char*>, 3> places = {
        {{-0.5, "r_at_u_m0_5"}, {0.0, "r_at_u_0"}, {0.3, "r_at_u_0_3"}}};
    for (const auto& [u, name] : places)
      CHECK((here + h * u * in + h * made.blend.at(u).value * (out - in) - vec3(ramp.at(name)))
                .norm() < 2e-6);
    // The golden corner takes no more than half of a leg; here the ends leave all of it.
    if (ramp.at("vertex_dist").get<double>() < 0.999 * settings.tip_tolerance) continue;
    CHECK(made.half_width == Approx(h).epsilon(1e-6));
    CHECK((path.at(1, 0.3 * h).translation() - vec3(ramp.at("r_at_u_0_3"))).norm() < 2e-6);
    ++compared;
  }
  CHECK(compared == 4);
}

TEST_CASE("corner_path: preconditions", "[kernels][smooth]") {
  PathText good;
  good.line(Vec3(4, 0, 0), Vec3(0.1, 0, 0)).line(Vec3(0, 4, 0), Vec3(0, 0.2, 0));
  const auto settings = settings_of(BlendKind::acr);
  CHECK_NOTHROW(good.blended(settings));
  const auto refuses = [&](const PathText& text, const CornerSettings& s) {
    CHECK_THROWS_AS(text.blended(s), ContractViolation);
  };
  PathText bad = good;
  bad.legs.pop_back();
  refuses(bad, settings);
  refuses(PathText{}, settings);
  bad = good;
  bad.legs[1].turn = Vec3(0, 0.3, 0);  // does not lead to the node
  refuses(bad, settings);
  bad = good;
  bad.line(Vec3::Zero(), Vec3::Zero());  // nothing moves
  refuses(bad, settings);
  bad = good;
  bad.arc(Vec3(1, 0, 0), Vec3::UnitZ(), 1.0, 0.0);
  bad.nodes.back().tip += Vec3(1e-5, 0, 0);
  refuses(bad, settings);
  auto wrong = settings;
  wrong.tip_tolerance = 0.0;
  refuses(good, wrong);
  wrong = settings;
  wrong.rotation_tolerance = -1.0;
  refuses(good, wrong);
  wrong = settings;
  wrong.closed = true;  // it is not
  refuses(good, wrong);
}

}  // namespace smoothpost
