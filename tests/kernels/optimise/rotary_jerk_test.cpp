#include "kernels/optimise/rotary_jerk.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <sstream>

#include "kernels/core/units.h"
#include "tests/kernels/kinematics/reference_machines.h"

using namespace smoothpost;

namespace {

constexpr double kDegree = kRadiansPerDegree;

/// Points with the programmed tool axis as the surface's normal.
struct Path {
  std::vector<Vec3> points, normals;
  std::vector<double> length;  ///< from the start, mm

  void add(const Vec3& point, const Vec3& normal) {
    length.push_back(points.empty() ? 0.0 : length.back() + (point - points.back()).norm());
    points.push_back(point);
    normals.push_back(normal.normalized());
  }
  int size() const { return static_cast<int>(points.size()); }
};

std::optional<Path> shared_case(const std::string& name) {
  const auto file = test::shared_path("reference/" + name);
  if (!file) return std::nullopt;
  Path path;
  for (const auto& r : test::number_table(*file))
    path.add(Vec3(r[0], r[1], r[2]), Vec3(r[3], r[4], r[5]));
  return path;
}

/// 300 mm along x; the normal turns by `turn` within 40 mm about a slanting axis and back again.
Path turning_path(double turn) {
  Path path;
  const Vec3 axis = Vec3(0.35, 1.0, 0.1).normalized();
  const Vec3 first = Eigen::AngleAxisd(0.5, Vec3::UnitY()) * Vec3::UnitZ();
  const auto ramp = [](double t) {
    t = std::clamp(t, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
  };
  for (int i = 0; i <= 300; ++i) {
    const double angle = turn * (ramp((i - 90.0) / 40.0) - ramp((i - 180.0) / 40.0));
    path.add(Vec3(i, 0.0, 0.0), Eigen::AngleAxisd(angle, axis) * first);
  }
  return path;
}

struct Case {
  ScrewChain chain = test::laser();
  Path path;
  RotaryProblem problem;
  double lead = 0.0, tilt = 0.0;

  Case(Path p, int spans, double lead_tolerance, double tilt_tolerance)
      : path(std::move(p)), lead(lead_tolerance), tilt(tilt_tolerance) {
    problem.held = JointVector::Zero(6);
    problem.joints = {3, 4};
    problem.knots = clamped_knots(5, spans);
    problem.lower = {-2.0 * kPi, -kPi / 2.0};
    problem.upper = {2.0 * kPi, kPi / 2.0};
    double before = 0.0;
    for (int i = 0; i < path.size(); ++i) {
      const std::size_t at = static_cast<std::size_t>(i);
      const Vec3& n = path.normals[at];
      OrientationWindow w;
      w.u = std::min<double>(spans, path.length[at] / path.length.back() * spans);
      w.normal = n;
      const Vec3 along = path.points[static_cast<std::size_t>(std::min(i + 1, path.size() - 1))] -
                         path.points[static_cast<std::size_t>(std::max(i - 1, 0))];
      w.tangent = (along - along.dot(n) * n).normalized();
      w.binormal = w.normal.cross(w.tangent);
      w.lead_low = -lead;
      w.lead_high = lead;
      w.tilt_low = -tilt;
      w.tilt_high = tilt;
      problem.windows.push_back(w);
      double q4 = std::atan2(n.y(), n.x());
      if (i > 0) q4 += 2.0 * kPi * std::round((before - q4) / (2.0 * kPi));
      before = q4;
      problem.seed.push_back({q4, std::atan2(std::hypot(n.x(), n.y()), n.z())});
    }
  }
  Case(const Case&) = delete;
  Case& operator=(const Case&) = delete;

  /// Table 2 of paper B for both rotaries at that feed, m/min.
  const RotaryProblem& at_feed(double feed) {
    const double r = rate(feed);
    problem.limits.fill({10.0 / r, 80.0 / (r * r), 200.0 / (r * r * r)});
    problem.chain = &chain;
    return problem;
  }
  const RotaryProblem& without_limits() {
    problem.limits.fill({});
    problem.chain = &chain;
    return problem;
  }
  /// Rotaries to start from.
  void start_from(const SplineCurve& q) {
    for (std::size_t i = 0; i < problem.windows.size(); ++i)
      problem.seed[i] = {q.at(problem.windows[i].u)[0], q.at(problem.windows[i].u)[1]};
  }
  /// Pieces per second.
  double rate(double feed) const {
    return feed * 1000.0 / 60.0 / path.length.back() * problem.knots.spans();
  }
  /// The programmed rotaries as via points at those lengths; no windows.
  void pass_through(const std::vector<double>& lengths) {
    for (const double s : lengths) {
      const auto near =
          std::min_element(path.length.begin(), path.length.end(),
                           [s](double a, double b) { return std::abs(a - s) < std::abs(b - s); });
      const std::size_t i = static_cast<std::size_t>(near - path.length.begin());
      problem.via.push_back({problem.windows[i].u, problem.seed[i]});
    }
    problem.windows.clear();
    problem.seed.clear();
  }

  Vec3 axis(const SplineCurve& q, double u) const {
    JointVector joints = problem.held;
    const Eigen::VectorXd value = q.at(u);
    joints[3] = value[0];
    joints[4] = value[1];
    return forward_location(chain, joints).axis;
  }
};

/// Largest angles between the tool axis and the path's frame, deg, at the points and between them.
struct Angles {
  double lead = 0.0, tilt = 0.0, apart = 0.0;
};

Angles angles(const Case& c, const SplineCurve& q, int between = 8) {
  Angles worst;
  const auto tangent = [&](int i) {
    return (c.path.points[static_cast<std::size_t>(std::min(i + 1, c.path.size() - 1))] -
            c.path.points[static_cast<std::size_t>(std::max(i - 1, 0))])
        .normalized();
  };
  for (int i = 0; i + 1 < c.path.size(); ++i)
    for (int k = 0; k <= between; ++k) {
      const std::size_t at = static_cast<std::size_t>(i);
      const double t = static_cast<double>(k) / between;
      const double s = (1.0 - t) * c.path.length[at] + t * c.path.length[at + 1];
      const Vec3 n = ((1.0 - t) * c.path.normals[at] + t * c.path.normals[at + 1]).normalized();
      Vec3 along = (1.0 - t) * tangent(i) + t * tangent(i + 1);
      along = (along - along.dot(n) * n).normalized();
      const Vec3 o = c.axis(q, std::min(s / c.path.length.back(), 1.0) * c.problem.knots.last());
      worst.lead = std::max(worst.lead, std::abs(std::atan2(o.dot(along), o.dot(n))) / kDegree);
      worst.tilt =
          std::max(worst.tilt, std::abs(std::atan2(o.dot(n.cross(along)), o.dot(n))) / kDegree);
      worst.apart = std::max(worst.apart, std::atan2(n.cross(o).norm(), n.dot(o)) / kDegree);
    }
  return worst;
}

/// Largest ratio of a derivative to its limit on a dense grid.
double largest_ratio(const SplineCurve& q, const std::array<RateLimits, 2>& limits) {
  double worst = 0.0;
  const int n = 20 * q.knots.spans();
  for (int i = 0; i <= n; ++i)
    for (int c = 0; c < 2; ++c) {
      const double u = q.knots.last() * i / n;
      const RateLimits& l = limits[static_cast<std::size_t>(c)];
      worst =
          std::max({worst, std::abs(q.at(u, 1)[c]) / l.velocity,
                    std::abs(q.at(u, 2)[c]) / l.acceleration, std::abs(q.at(u, 3)[c]) / l.jerk});
    }
  return worst;
}

double peak(const SplineCurve& q, int component, int order) {
  double worst = 0.0;
  const int n = 20 * q.knots.spans();
  for (int i = 0; i <= n; ++i)
    worst = std::max(worst, std::abs(q.at(q.knots.last() * i / n, order)[component]));
  return worst;
}

RotarySettings settings(bool hybrid = false) {
  RotarySettings s;
  s.hybrid = hybrid && ipopt_available();
  return s;
}

RotaryProblem slower(RotaryProblem problem, double t) {
  for (RateLimits& l : problem.limits) l = slowed(l, t);
  return problem;
}

std::string told(const RotaryResult& r) {
  std::ostringstream out;
  out << "status " << static_cast<int>(r.status) << " passes " << r.passes << " outside "
      << r.outside << " solver " << to_string(r.solution.status) << " kkt "
      << r.solution.certificate.kkt() << " why " << r.why.name << " level " << r.why.level
      << " channel " << r.why.channel << " at " << r.why.place << " short " << r.why.shortfall
      << " " << r.solution.message;
  return out.str();
}

void check_windows(const Case& c, const SplineCurve& q) {
  double worst = -1.0;
  for (const OrientationWindow& w : c.problem.windows)
    worst = std::max(worst, w.outside(c.axis(q, w.u)));
  CHECK(worst <= 1e-8);
}

}  // namespace

TEST_CASE("rotary_jerk: how far outside a window", "[kernels][optimise]") {
  OrientationWindow w;
  w.lead_low = -0.2;
  w.lead_high = 0.3;
  w.tilt_low = -0.1;
  w.tilt_high = 0.4;
  const auto axis = [](double lead, double tilt) {
    return Vec3(std::tan(lead), std::tan(tilt), 1.0).normalized();
  };
  CHECK(w.outside(axis(0.0, 0.0)) == Approx(-std::sin(0.1)));
  CHECK(std::abs(w.outside(axis(0.3, 0.0))) < 1e-12);
  CHECK(std::abs(w.outside(axis(0.0, -0.1))) < 1e-12);
  CHECK(w.outside(axis(0.35, 0.0)) == Approx(std::sin(0.05)));
  CHECK(w.outside(axis(-0.25, 0.0)) == Approx(std::sin(0.05)));
  CHECK(w.outside(axis(0.0, 0.5)) == Approx(std::sin(0.1)));
  w.widest = 0.2;
  CHECK(std::abs(w.outside(axis(0.2, 0.0))) < 1e-12);
  CHECK(w.outside(axis(0.25, 0.0)) == Approx(std::sin(0.05)).epsilon(0.03));
  CHECK(w.outside(axis(0.19, 0.0)) < 0.0);
}

TEST_CASE("rotary_jerk: Case 2 in the cone", "[kernels][optimise][paper]") {
  auto path = shared_case("case2.csv");
  if (!path) {
    WARN("no ../shared, not tested");
    return;
  }
  Case c(*path, 157, 15.0 * kDegree, 10.0 * kDegree);
  const RotaryTime time = least_rotary_time(c.at_feed(15.0), 1.0, settings());
  INFO("factor " << time.factor << " feed " << 15.0 / time.factor << " passes " << time.passes);
  REQUIRE(time.status == RotaryStatus::optimal);
  CHECK(15.0 / time.factor >= 11.3);
  CHECK(15.0 / time.factor <= 12.5);
  CHECK(largest_ratio(time.q, slower(c.problem, time.factor).limits) <= 1.0 + 1e-6);

  Case at(*path, 157, 15.0 * kDegree, 10.0 * kDegree);
  at.at_feed(15.0 / (1.01 * time.factor));
  const RotaryResult r = optimise_rotaries(at.problem, settings(true));
  INFO(told(r));
  REQUIRE(r.status == RotaryStatus::optimal);
  CHECK(r.solution.certificate.kkt() <= 1e-6);
  CHECK(r.outside <= 1e-8);
  check_windows(at, r.q);
  CHECK(largest_ratio(r.q, at.problem.limits) <= 1.0 + 1e-7);
  const Angles dense = angles(at, r.q);
  CHECK(dense.lead <= 15.02);
  CHECK(dense.tilt <= 10.02);
  for (const double end : {0.0, 157.0})
    for (const int order : {1, 2}) CHECK(r.q.at(end, order).norm() < 1e-8);

  at.at_feed(15.0 / (0.98 * time.factor));
  const RotaryResult fast = optimise_rotaries(at.problem, settings());
  INFO(told(fast));
  CHECK(fast.status == RotaryStatus::too_fast);
}

TEST_CASE("rotary_jerk: Case 2 without limits", "[kernels][optimise][paper]") {
  auto path = shared_case("case2.csv");
  const auto file = test::shared_path("reference/case2_via_mm.txt");
  if (!path || !file) {
    WARN("no ../shared, not tested");
    return;
  }
  std::vector<double> via;
  for (const auto& row : test::number_table(*file)) via.push_back(row[0]);
  REQUIRE(via.size() == 10);

  Case cone(*path, 157, 15.0 * kDegree, 10.0 * kDegree);
  const RotaryResult in_cone = optimise_rotaries(cone.without_limits(), settings());
  INFO(told(in_cone));
  REQUIRE(in_cone.status == RotaryStatus::optimal);
  CHECK(angles(cone, in_cone.q).apart <= 17.9);
  const double r3 = std::pow(cone.rate(15.0), 3);
  CHECK(peak(in_cone.q, 0, 3) * r3 == Approx(757.0).epsilon(0.03));
  CHECK(peak(in_cone.q, 1, 3) * r3 == Approx(686.0).epsilon(0.03));

  Case through(*path, 157, 15.0 * kDegree, 10.0 * kDegree);
  through.pass_through(via);
  const RotaryResult free = optimise_rotaries(through.without_limits(), settings());
  INFO(told(free));
  REQUIRE(free.status == RotaryStatus::optimal);
  const double apart = angles(through, free.q).apart;
  CHECK(apart > 40.0);
  CHECK(apart < 43.0);
  for (const RotaryVia& v : through.problem.via)
    for (int k = 0; k < 2; ++k)
      CHECK(std::abs(free.q.at(v.u)[k] - v.q[static_cast<std::size_t>(k)]) < 1e-9);

  const RotaryTime time = least_rotary_time(through.at_feed(15.0), 1.0, settings());
  INFO("factor " << time.factor << " feed " << 15.0 / time.factor);
  REQUIRE(time.status == RotaryStatus::optimal);
  CHECK(15.0 / time.factor >= 9.8);
  CHECK(15.0 / time.factor <= 10.3);
  const RotaryResult fast = optimise_rotaries(through.at_feed(15.0), settings());
  INFO(told(fast));
  CHECK(fast.status == RotaryStatus::too_fast);
  CHECK(fast.why.name == "bound");
  CHECK(fast.why.level == 3);
}

TEST_CASE("rotary_jerk: Case 1 through its via points", "[kernels][optimise][paper]") {
  auto path = shared_case("case1.csv");
  if (!path) {
    WARN("no ../shared, not tested");
    return;
  }
  Case c(*path, 90, 5.0 * kDegree, 5.0 * kDegree);
  std::vector<double> via;
  for (int k = 0; k < 6; ++k) via.push_back(path->length.back() * k / 5.0);
  c.pass_through(via);
  const RotaryTime time = least_rotary_time(c.at_feed(20.0), 1.0, settings());
  REQUIRE(time.status == RotaryStatus::optimal);
  CHECK(time.factor <= 1.0001);
  const RotaryResult r = optimise_rotaries(c.problem, settings(true));
  INFO(told(r));
  REQUIRE(r.status == RotaryStatus::optimal);
  CHECK(angles(c, r.q).apart <= 0.6);
  CHECK(peak(r.q, 0, 3) * std::pow(c.rate(20.0), 3) <= 20.0);
  CHECK(largest_ratio(r.q, c.problem.limits) <= 1.0 + 1e-8);
}

TEST_CASE("rotary_jerk: a turning path at its least time", "[kernels][optimise]") {
  for (const double turn : {0.8, 1.0}) {
    Case c(turning_path(turn), 75, 15.0 * kDegree, 10.0 * kDegree);
    const RotaryTime time = least_rotary_time(c.at_feed(40.0), 1.0, settings());
    INFO(turn << " factor " << time.factor << " passes " << time.passes);
    REQUIRE(time.status == RotaryStatus::optimal);
    REQUIRE(time.factor > 1.001);
    CHECK(time.why.name == "bound");
    CHECK(time.why.level >= 1);
    c.start_from(time.q);
    const RotaryProblem at = slower(c.problem, 1.01 * time.factor);
    const RotaryResult r = optimise_rotaries(at, settings(true));
    INFO(told(r));
    REQUIRE(r.status == RotaryStatus::optimal);
    CHECK(r.solution.certificate.kkt() <= 1e-6);
    check_windows(c, r.q);
    CHECK(largest_ratio(r.q, at.limits) <= 1.0 + 1e-7);
    const Angles dense = angles(c, r.q);
    CHECK(dense.lead <= 15.02);
    CHECK(dense.tilt <= 10.02);
    const RotaryResult fast = optimise_rotaries(slower(c.problem, 0.98 * time.factor), settings());
    INFO(told(fast));
    CHECK(fast.status == RotaryStatus::too_fast);
    CHECK(fast.why.name == "bound");
    CHECK(fast.why.level >= 1);
    CHECK(fast.why.place > 0.0);
    CHECK(fast.why.place < 75.0);
  }
}

TEST_CASE("rotary_jerk: a turning path with time to spare", "[kernels][optimise]") {
  Case c(turning_path(1.0), 75, 15.0 * kDegree, 10.0 * kDegree);
  const RotaryTime time = least_rotary_time(c.at_feed(5.0), 1.0, settings());
  INFO("passes " << time.passes << " status " << static_cast<int>(time.status));
  REQUIRE(time.status == RotaryStatus::optimal);
  CHECK(time.factor <= 1.0001);
  check_windows(c, time.q);
  CHECK(largest_ratio(time.q, c.problem.limits) <= 1.0 + 1e-6);
}

TEST_CASE("rotary_jerk: objective and via points of a turning path", "[kernels][optimise]") {
  Case cone(turning_path(1.0), 75, 15.0 * kDegree, 10.0 * kDegree);
  const RotaryResult in_cone = optimise_rotaries(cone.without_limits(), settings());
  INFO(told(in_cone));
  REQUIRE(in_cone.status == RotaryStatus::optimal);
  double integral = 0.0;
  const int n = 75 * 200;
  for (int i = 0; i < n; ++i) integral += in_cone.q.at((i + 0.5) / 200.0, 3).squaredNorm() / 200.0;
  CHECK(in_cone.solution.objective == Approx(integral).epsilon(1e-4));

  Case through(turning_path(1.0), 75, 15.0 * kDegree, 10.0 * kDegree);
  through.pass_through({0.0, 90.0, 130.0, 180.0, 220.0, 300.0});
  const RotaryResult free = optimise_rotaries(through.without_limits(), settings());
  INFO(told(free));
  REQUIRE(free.status == RotaryStatus::optimal);
  CHECK(angles(cone, in_cone.q).apart <= 17.9);
  CHECK(angles(through, free.q).apart > 17.9);
  for (const RotaryVia& v : through.problem.via)
    for (int k = 0; k < 2; ++k)
      CHECK(std::abs(free.q.at(v.u)[k] - v.q[static_cast<std::size_t>(k)]) < 1e-9);
}

TEST_CASE("rotary_jerk: Ipopt has the last word and changes nothing", "[kernels][optimise]") {
  if (!ipopt_available()) return;
  Case c(turning_path(0.8), 75, 15.0 * kDegree, 10.0 * kDegree);
  const RotaryResult alone = optimise_rotaries(c.at_feed(6.0), settings());
  const RotaryResult both = optimise_rotaries(c.at_feed(6.0), settings(true));
  INFO(told(alone) << "\n" << told(both));
  REQUIRE(alone.status == RotaryStatus::optimal);
  REQUIRE(both.status == RotaryStatus::optimal);
  CHECK(both.solution.solver == QpSolver::ipopt);
  CHECK(both.solution.objective == Approx(alone.solution.objective).epsilon(1e-6));
}

TEST_CASE("rotary_jerk: the widest cone binds where it is narrower", "[kernels][optimise]") {
  Case c(turning_path(1.0), 75, 15.0 * kDegree, 10.0 * kDegree);
  const RotaryResult wide = optimise_rotaries(c.without_limits(), settings());
  REQUIRE(wide.status == RotaryStatus::optimal);
  CHECK(angles(c, wide.q, 1).apart > 13.0);
  for (OrientationWindow& w : c.problem.windows) w.widest = 12.0 * kDegree;
  const RotaryResult narrow = optimise_rotaries(c.without_limits(), settings());
  INFO(told(narrow));
  REQUIRE(narrow.status == RotaryStatus::optimal);
  check_windows(c, narrow.q);
  CHECK(angles(c, narrow.q, 1).apart == Approx(12.0).margin(0.01));
  CHECK(narrow.solution.objective > wide.solution.objective);
  for (OrientationWindow& w : c.problem.windows) w.widest = 18.5 * kDegree;  // corner: 17.7 deg
  const RotaryResult same = optimise_rotaries(c.without_limits(), settings());
  REQUIRE(same.status == RotaryStatus::optimal);
  CHECK(same.solution.objective == Approx(wide.solution.objective).epsilon(1e-6));
}

TEST_CASE("rotary_jerk: cuts of the tool axis hold at their windows", "[kernels][optimise]") {
  Case c(turning_path(0.8), 75, 15.0 * kDegree, 10.0 * kDegree);
  const RotaryResult before = optimise_rotaries(c.without_limits(), settings());
  REQUIRE(before.status == RotaryStatus::optimal);
  const auto axis_of = [&](const SplineCurve& q, double u) {
    JointVector joints = c.problem.held;
    joints[3] = q.at(u)[0];
    joints[4] = q.at(u)[1];
    return forward_location(c.chain, joints).axis;
  };
  // At eleven windows the axis has to lean half the way back to the normal.
  constexpr std::size_t kFirst = 120, kLast = 130;
  double most = 0.0;
  for (std::size_t i = kFirst; i <= kLast; ++i) {
    OrientationWindow& w = c.problem.windows[i];
    const Vec3 axis = axis_of(before.q, w.u);
    const Vec3 side = (w.normal - w.normal.dot(axis) * axis).normalized();
    w.cuts.push_back({side, 0.5 * side.dot(w.normal)});
    most = std::max(most, w.outside(axis));
  }
  REQUIRE(most > 0.01);
  c.start_from(before.q);
  const RotaryResult after = optimise_rotaries(c.without_limits(), settings());
  INFO(told(after));
  REQUIRE(after.status == RotaryStatus::optimal);
  check_windows(c, after.q);
  for (std::size_t i = kFirst; i <= kLast; ++i) {
    const OrientationWindow& w = c.problem.windows[i];
    CHECK(w.cuts.front().normal.dot(axis_of(after.q, w.u)) >= w.cuts.front().least - 1e-9);
  }
  CHECK(after.solution.objective > before.solution.objective);
  // One that leaves no axis is named.
  c.problem.windows[125].cuts.push_back({-c.problem.windows[125].normal, 0.5});
  const RotaryResult none = optimise_rotaries(c.at_feed(1.0), settings());
  CHECK(none.status == RotaryStatus::cone_empty);
}

TEST_CASE("rotary_jerk: windows that contradict each other", "[kernels][optimise]") {
  Case c(turning_path(0.3), 75, 15.0 * kDegree, 10.0 * kDegree);
  // at one place two windows that have no axis in common
  OrientationWindow other = c.problem.windows[150];
  const Eigen::AngleAxisd turn(40.0 * kDegree, other.binormal);
  other.normal = turn * other.normal;
  other.tangent = turn * other.tangent;
  c.problem.windows.insert(c.problem.windows.begin() + 151, other);
  c.problem.seed.insert(c.problem.seed.begin() + 151, c.problem.seed[150]);
  const RotaryResult r = optimise_rotaries(c.at_feed(1.0), settings());
  INFO(told(r));
  CHECK(r.status == RotaryStatus::cone_empty);
  CHECK(r.why.name == "lead");
  CHECK(r.why.place == Approx(other.u));
  CHECK(r.why.shortfall > 0.01);
  const RotaryTime time = least_rotary_time(c.problem, 1.0, settings());
  CHECK(time.status == RotaryStatus::cone_empty);
  CHECK(time.why.name == "lead");
  CHECK(time.why.place == Approx(other.u));
}

TEST_CASE("rotary_jerk: monotone between via points", "[kernels][optimise]") {
  Case c(turning_path(1.0), 75, 15.0 * kDegree, 10.0 * kDegree);
  c.pass_through({0.0, 60.0, 90.0, 130.0, 180.0, 220.0, 250.0, 300.0});
  const RotaryResult free = optimise_rotaries(c.at_feed(0.5), settings());
  REQUIRE(free.status == RotaryStatus::optimal);
  c.problem.monotone = true;
  const RotaryResult r = optimise_rotaries(c.at_feed(0.5), settings());
  INFO(told(r));
  REQUIRE(r.status == RotaryStatus::optimal);
  CHECK(r.solution.objective > free.solution.objective);
  const auto back = [&](const SplineCurve& q) {
    double worst = 0.0;
    for (std::size_t k = 1; k < c.problem.via.size(); ++k) {
      const RotaryVia &from = c.problem.via[k - 1], &to = c.problem.via[k];
      for (int i = 0; i < 2; ++i) {
        const double step = to.q[static_cast<std::size_t>(i)] - from.q[static_cast<std::size_t>(i)];
        for (int n = 0; n <= 200; ++n) {
          const double rate = q.at(from.u + (to.u - from.u) * n / 200.0, 1)[i];
          if (step >= 0.0) worst = std::max(worst, -rate);
          if (step <= 0.0) worst = std::max(worst, rate);
        }
      }
    }
    return worst;
  };
  CHECK(back(free.q) > 1e-3);
  CHECK(back(r.q) < 1e-8);
}

TEST_CASE("rotary_jerk: a second run gives equal bytes", "[kernels][optimise]") {
  Case c(turning_path(0.8), 75, 15.0 * kDegree, 10.0 * kDegree);
  const RotaryResult a = optimise_rotaries(c.at_feed(6.0), settings());
  const RotaryResult b = optimise_rotaries(c.at_feed(6.0), settings());
  REQUIRE(a.status == RotaryStatus::optimal);
  CHECK(a.passes == b.passes);
  CHECK(std::memcmp(a.q.controls.data(), b.q.controls.data(),
                    sizeof(double) * static_cast<std::size_t>(a.q.controls.size())) == 0);
  CHECK(least_rotary_time(c.at_feed(15.0), 1.0, settings()).factor ==
        least_rotary_time(c.at_feed(15.0), 1.0, settings()).factor);
}

TEST_CASE("rotary_jerk: limits of a slower piece", "[kernels][optimise]") {
  const RateLimits l = slowed({2.0, 3.0, 5.0}, 2.0);
  CHECK(l.velocity == 4.0);
  CHECK(l.acceleration == 12.0);
  CHECK(l.jerk == 40.0);
}
