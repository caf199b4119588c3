#include "kernels/kinematics/branch_tracking.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "tests/kernels/kinematics/reference_machines.h"

namespace smoothpost {
namespace {

using test::Random;
using Status = BranchTracking::Status;

Vec3 axis_at(double tilt, double azimuth) {
  return {std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth), std::cos(tilt)};
}

TrackingPoint point(const Vec3& tip, const Vec3& axis, bool cut, std::uint32_t line) {
  TrackingPoint out;
  out.location.tip = tip;
  out.location.axis = axis;
  out.cut = cut;
  out.line = line;
  return out;
}

BranchTrackingSettings settings_for(const ScrewChain& chain) {
  BranchTrackingSettings settings;
  settings.held = JointVector::Zero(chain.size());
  return settings;
}

/// A laser whose part lies in the middle of the linear ranges.
ScrewChain laser() {
  ScrewChain chain = test::laser(100.0);
  chain.workpiece_home.translation() = Vec3(800, 700, 1000);
  return chain;
}

/// What every result promises: FK, limits, continuity on cuts, one entry per point.
void check_choice(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                  const BranchTrackingSettings& settings, const BranchTracking& result) {
  REQUIRE(result.status == Status::ok);
  REQUIRE(result.q.size() == points.size());
  REQUIRE(result.branch.size() == points.size());
  const ScrewChain& chain = pair.chain();
  double worst_tip = 0.0;
  double worst_axis = 0.0;
  bool limits = true;
  bool continuous = true;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CutterLocation back = forward_location(chain, result.q[i]);
    worst_tip = std::max(worst_tip, (back.tip - points[i].location.tip).norm());
    worst_axis = std::max(worst_axis, angle_between(back.axis, points[i].location.axis));
    for (int j = 0; j < chain.size(); ++j) {
      limits = limits && result.q[i][j] >= chain.joints[j].lower - 1e-8 &&
               result.q[i][j] <= chain.joints[j].upper + 1e-8;
      if (i == 0 || !points[i].cut || chain.joints[j].kind == JointKind::linear) continue;
      continuous =
          continuous && std::abs(result.q[i][j] - result.q[i - 1][j]) <= settings.continuity + 1e-9;
    }
  }
  CHECK(worst_tip < 1e-9);
  CHECK(worst_axis <= std::max(1e-9, settings.pole_cap) * (1.0 + 1e-9));
  CHECK(limits);
  CHECK(continuous);
}

double spread(const BranchTracking& result, int joint) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const JointVector& q : result.q) {
    low = std::min(low, q[joint]);
    high = std::max(high, q[joint]);
  }
  return high - low;
}

/// All branches and turns of a point that are within the limits, from the definition.
std::vector<JointVector> all_candidates(const RotaryPair& pair, const TrackingPoint& point,
                                        const JointVector& held) {
  std::vector<JointVector> out;
  const ScrewChain& chain = pair.chain();
  const RotaryPairSolutions solutions = pair.solve(point.location, held);
  for (int b = 0; b < 2; ++b) {
    if (!solutions.valid[b]) continue;
    for (int m = -4; m <= 4; ++m)
      for (int n = -4; n <= 4; ++n) {
        JointVector q = solutions.q[b];
        q[pair.first_rotary()] += 2.0 * kPi * m;
        q[pair.second_rotary()] += 2.0 * kPi * n;
        bool inside = true;
        for (int j = 0; j < chain.size(); ++j)
          inside = inside && q[j] >= chain.joints[j].lower - 1e-9 &&
                   q[j] <= chain.joints[j].upper + 1e-9;
        if (inside) out.push_back(q);
      }
  }
  return out;
}

struct Exhaustive {
  double cost = std::numeric_limits<double>::infinity();
  std::size_t reached = 0;  ///< points that some sequence from the start reaches
};

/// Depth-first over every sequence of candidates.
Exhaustive exhaustive(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                      const BranchTrackingSettings& settings) {
  std::vector<std::vector<JointVector>> layers;
  for (const TrackingPoint& p : points) layers.push_back(all_candidates(pair, p, settings.held));
  const int r1 = pair.first_rotary();
  const int r2 = pair.second_rotary();
  Exhaustive best;
  const std::function<void(std::size_t, const JointVector&, double)> visit =
      [&](std::size_t i, const JointVector& q, double cost) {
        best.reached = std::max(best.reached, i + 1);
        if (i + 1 == points.size()) {
          best.cost = std::min(best.cost, cost);
          return;
        }
        for (const JointVector& next : layers[i + 1]) {
          const double d1 = std::abs(next[r1] - q[r1]);
          const double d2 = std::abs(next[r2] - q[r2]);
          if (points[i + 1].cut && (d1 > settings.continuity || d2 > settings.continuity)) continue;
          visit(i + 1, next, cost + d1 + d2);
        }
      };
  for (const JointVector& q : layers[0])
    visit(0, q, 0.01 * (std::abs(q[r1] - settings.held[r1]) + std::abs(q[r2] - settings.held[r2])));
  return best;
}

TEST_CASE("branch_tracking: cost of an exhaustive search over all branches and turns",
          "[kernels][kinematics]") {
  Random random(31);
  int solved = 0;
  int rewinds = 0;
  for (int n = 0; n < 1500; ++n) {
    ScrewChain chain = n % 3 == 0   ? laser()
                       : n % 3 == 1 ? test::table_table_ac()
                                    : test::table_table_b45c();
    const auto all = RotaryPair::from(chain);
    ChainJoint& first = chain.joints[all->first_rotary()];
    first.lower = -random.between(2.0, 9.0);
    first.upper = random.between(2.0, 9.0);
    if (random.below(2) == 0) {
      ChainJoint& second = chain.joints[all->second_rotary()];
      second.lower = -random.between(0.3, 5.0);
      second.upper = random.between(0.3, 5.0);
    }
    const auto pair = RotaryPair::from(chain);
    BranchTrackingSettings settings = settings_for(chain);
    settings.held[pair->first_rotary()] = random.between(first.lower, first.upper);
    std::vector<TrackingPoint> points;
    double tilt = random.between(0.1, 1.2);
    double azimuth = random.between(-kPi, kPi);
    const double turn = random.between(-0.8, 0.8);
    const int count = 2 + random.below(5);
    for (int i = 0; i < count; ++i) {
      points.push_back(
          point(100.0 * random.unit(), axis_at(tilt, azimuth), random.below(4) != 0, i + 1));
      tilt += random.between(-0.3, 0.3);
      if (std::abs(tilt) < 0.02) tilt = 0.02;
      azimuth += turn + random.between(-0.2, 0.2);
    }
    bool every = true;
    for (const TrackingPoint& p : points)
      every = every && !all_candidates(*pair, p, settings.held).empty();
    const BranchTracking result = track_branches(*pair, points, settings);
    CAPTURE(n, count, result.reason);
    if (!every) {
      REQUIRE((result.status == Status::over_limit || result.status == Status::unreachable));
      continue;
    }
    const Exhaustive expected = exhaustive(*pair, points, settings);
    if (expected.reached < points.size()) {
      REQUIRE(result.status == Status::rewind_needed);
      REQUIRE(result.rewinds.front().point == expected.reached);
      REQUIRE(result.rewinds.front().line == points[expected.reached].line);
      REQUIRE_FALSE(result.rewinds.front().reason.empty());
      ++rewinds;
      continue;
    }
    check_choice(*pair, points, settings, result);
    REQUIRE(std::abs(result.cost - expected.cost) < 1e-9);
    double cost = 0.0;
    for (const int r : {pair->first_rotary(), pair->second_rotary()}) {
      cost += 0.01 * std::abs(result.q[0][r] - settings.held[r]);
      for (std::size_t i = 1; i < points.size(); ++i)
        cost += std::abs(result.q[i][r] - result.q[i - 1][r]);
    }
    REQUIRE(std::abs(result.cost - cost) < 1e-9);
    ++solved;
  }
  CHECK(solved > 500);
  CHECK(rewinds > 50);
}

/// Tilted by 30 degrees, the azimuth from 0 to `turns` turns in steps of 5 degrees, line = index
/// + 1.
std::vector<TrackingPoint> spiral(double turns) {
  std::vector<TrackingPoint> points;
  const int count = static_cast<int>(std::lround(turns * 72.0));
  for (int i = 0; i <= count; ++i) {
    const double azimuth = i * kPi / 36.0;
    points.push_back(point(Vec3(50 * std::cos(azimuth), 50 * std::sin(azimuth), 0),
                           axis_at(kPi / 6.0, azimuth), i > 0, static_cast<std::uint32_t>(i + 1)));
  }
  return points;
}

TEST_CASE("branch_tracking: a spiral winds as far as the range lets it", "[kernels][kinematics]") {
  ScrewChain chain = laser();  // C ± one turn
  const BranchTrackingSettings settings = settings_for(chain);
  const auto pair = RotaryPair::from(chain);

  // Two turns fit only when the path starts at −360 degrees, though the machine stands at 0.
  const BranchTracking fits = track_branches(*pair, spiral(2.0), settings);
  check_choice(*pair, spiral(2.0), settings, fits);
  CHECK(fits.q.front()[3] == Approx(-2.0 * kPi));
  CHECK(fits.q.back()[3] == Approx(2.0 * kPi));

  const std::vector<TrackingPoint> three = spiral(3.0);
  const BranchTracking fails = track_branches(*pair, three, settings);
  REQUIRE(fails.status == Status::rewind_needed);
  REQUIRE(fails.rewinds.size() == 1);
  CHECK(fails.rewinds[0].point == 145);  // the first beyond two turns
  CHECK(fails.rewinds[0].line == 146);
  CHECK(fails.rewinds[0].joint == 3);
  CHECK(fails.point == 145);
  CHECK(fails.rewinds[0].reason.find("365.000 degrees") != std::string::npos);
  CHECK(fails.rewinds[0].reason.find("upper limit is 360.000 degrees") != std::string::npos);
  CHECK(fails.q.empty());

  // Every place where a rewind is needed.
  const BranchTracking more = track_branches(*pair, spiral(6.0), settings);
  REQUIRE(more.rewinds.size() == 2);
  CHECK(more.rewinds[1].point == 289);  // 725 degrees stand at −355, so 1440 at 360

  // A link before the limit, or a larger range, and it fits.
  std::vector<TrackingPoint> linked = three;
  linked[100].cut = false;
  check_choice(*pair, linked, settings, track_branches(*pair, linked, settings));
  chain.joints[3].lower = -2.9 * kPi;
  chain.joints[3].upper = 3.0 * kPi;
  CHECK(track_branches(*RotaryPair::from(chain), three, settings).status == Status::rewind_needed);
  // Three turns fit between ±540 degrees on the branch with B < 0, which is half a turn off.
  chain.joints[3].lower = -3.0 * kPi;
  const BranchTracking other = track_branches(*RotaryPair::from(chain), three, settings);
  check_choice(*RotaryPair::from(chain), three, settings, other);
  CHECK(other.branch.front() == 1);
}

TEST_CASE("branch_tracking: the first point is near held when nothing else decides",
          "[kernels][kinematics]") {
  const ScrewChain chain = laser();
  const auto pair = RotaryPair::from(chain);
  BranchTrackingSettings settings = settings_for(chain);
  for (const double held : {-5.0, 0.2, 5.0}) {
    settings.held[3] = held;
    const BranchTracking result = track_branches(*pair, spiral(0.1), settings);
    check_choice(*pair, spiral(0.1), settings, result);
    CHECK(std::abs(result.q[0][3] - held) < 2.0);
  }
}

/// Tool axes on the great circle at distance `offset` from the pole, from `tilt` on one side to the
/// other.
std::vector<TrackingPoint> great_circle_at(double offset, double tilt, int count) {
  const Vec3 across(-std::sin(0.4), std::cos(0.4), 0.0);
  const Vec3 along(std::cos(0.4), std::sin(0.4), 0.0);
  const Vec3 top = std::cos(offset) * Vec3::UnitZ() + std::sin(offset) * across;
  std::vector<TrackingPoint> points;
  for (int i = 0; i < count; ++i) {
    const double s = -tilt + 2.0 * tilt * i / (count - 1);
    Vec3 axis = std::cos(s) * top + std::sin(s) * along;
    if (offset == 0.0 && std::abs(s) < 1e-15) axis = Vec3::UnitZ();
    points.push_back(point(Vec3(10.0 * s, 5.0, 0.0), axis.normalized(), i > 0,
                           static_cast<std::uint32_t>(i + 1)));
  }
  return points;
}

TEST_CASE("branch_tracking: the pole is crossed exactly by a sign flip of the second rotary",
          "[kernels][kinematics]") {
  for (const ScrewChain& chain : {laser(), test::table_table_ac()}) {
    const auto pair = RotaryPair::from(chain);
    const BranchTrackingSettings settings = settings_for(chain);
    for (const int count : {101, 100, 3}) {  // with the pole itself, without it, and coarsely
      const std::vector<TrackingPoint> points = great_circle_at(0.0, 0.4, count);
      const BranchTracking result = track_branches(*pair, points, settings);
      CAPTURE(count);
      check_choice(*pair, points, settings, result);
      CHECK(spread(result, pair->first_rotary()) < 1e-12);
      const int second = pair->second_rotary();
      CHECK(result.q.front()[second] * result.q.back()[second] < 0.0);
      CHECK(std::abs(std::abs(result.q.front()[second]) - 0.4) < 1e-12);
      CHECK(result.branch.front() != result.branch.back());
    }
  }
}

TEST_CASE("branch_tracking: past the pole inside the cap there is no swing",
          "[kernels][kinematics]") {
  for (const ScrewChain& chain : {laser(), test::table_table_ac()}) {
    const auto pair = RotaryPair::from(chain);
    BranchTrackingSettings settings = settings_for(chain);
    settings.pole_cap = 1e-3;
    for (const int count : {101, 100, 4001}) {
      const std::vector<TrackingPoint> points = great_circle_at(1e-6, 0.4, count);
      const BranchTracking result = track_branches(*pair, points, settings);
      CAPTURE(count);
      check_choice(*pair, points, settings, result);
      // The azimuth at the cap's edge is off by 1e-6 / 1e-3 on either side.
      CHECK(spread(result, pair->first_rotary()) <= 2.1e-3);
    }
  }
}

TEST_CASE("branch_tracking: past the pole outside the cap the swing is followed",
          "[kernels][kinematics]") {
  for (const ScrewChain& chain : {laser(), test::table_table_ac()}) {
    const auto pair = RotaryPair::from(chain);
    BranchTrackingSettings settings = settings_for(chain);
    settings.pole_cap = 1e-4;
    const double offset = 2.0 * kPi / 180.0;
    const std::vector<TrackingPoint> points = great_circle_at(offset, 0.4, 2001);
    const BranchTracking result = track_branches(*pair, points, settings);
    check_choice(*pair, points, settings, result);
    const double swing = spread(result, pair->first_rotary());
    CHECK(swing > 2.9);
    CHECK(swing < kPi);
    for (std::size_t i = 0; i < points.size(); ++i)
      REQUIRE((forward_location(chain, result.q[i]).axis - points[i].location.axis).norm() < 1e-12);
  }
}

/// `count` points upright on a line, from `begin` on.
void add_upright(std::vector<TrackingPoint>& points, int count, const std::vector<int>& links) {
  for (int i = 0; i < count; ++i) {
    const auto line = static_cast<std::uint32_t>(points.size() + 1);
    const bool link = std::find(links.begin(), links.end(), i) != links.end();
    points.push_back(
        point(Vec3(60.0 - i, 2.0 * i, 3.0), Vec3::UnitZ(), !points.empty() && !link, line));
  }
}

TEST_CASE("branch_tracking: a three-axis program keeps the first rotary", "[kernels][kinematics]") {
  for (const ScrewChain& chain : {laser(), test::table_table_ac()}) {
    const auto pair = RotaryPair::from(chain);
    BranchTrackingSettings settings = settings_for(chain);
    settings.held[pair->first_rotary()] = 0.9;
    std::vector<TrackingPoint> points;
    add_upright(points, 50, {0, 20, 30});
    const BranchTracking result = track_branches(*pair, points, settings);
    check_choice(*pair, points, settings, result);
    for (const JointVector& q : result.q) {
      REQUIRE(q[pair->first_rotary()] == Approx(0.9).epsilon(1e-15));
      REQUIRE(q[pair->second_rotary()] == 0.0);
    }
  }
}

TEST_CASE("branch_tracking: upright, then tilted: the turn is on the last link of the run",
          "[kernels][kinematics]") {
  for (const ScrewChain& chain : {laser(), test::table_table_ac()}) {
    const auto pair = RotaryPair::from(chain);
    const int first = pair->first_rotary();
    BranchTrackingSettings settings = settings_for(chain);
    settings.held[first] = 0.3;
    std::vector<TrackingPoint> points;
    add_upright(points, 40, {0, 12, 25});
    for (int i = 1; i <= 20; ++i)
      points.push_back(point(Vec3(0, 80.0 + i, 3.0), axis_at(0.02 * i, 1.9), true,
                             static_cast<std::uint32_t>(points.size() + 1)));
    const BranchTracking result = track_branches(*pair, points, settings);
    check_choice(*pair, points, settings, result);
    for (std::size_t i = 0; i < 25; ++i) REQUIRE(result.q[i][first] == Approx(0.3).epsilon(1e-15));
    for (std::size_t i = 26; i < points.size(); ++i)
      REQUIRE(std::abs(result.q[i][first] - result.q[25][first]) < 1e-12);
    CHECK(std::abs(result.q[25][first] - 0.3) > 0.1);
  }
}

TEST_CASE("branch_tracking: a tilted start is held through the upright run until a link",
          "[kernels][kinematics]") {
  const ScrewChain chain = test::table_table_ac();
  const auto pair = RotaryPair::from(chain);
  const int first = pair->first_rotary();
  const BranchTrackingSettings settings = settings_for(chain);
  std::vector<TrackingPoint> points{point(Vec3(60, 0, 0), axis_at(0.2, 0.5), false, 1)};
  add_upright(points, 30, {10, 18});
  points.push_back(point(Vec3(30, 60, 3), axis_at(0.2, 1.4), true, 32));
  const BranchTracking result = track_branches(*pair, points, settings);
  check_choice(*pair, points, settings, result);
  const double before = result.q.front()[first];
  const double after = result.q.back()[first];
  CHECK(std::abs(before - after) > 0.5);
  for (std::size_t i = 1; i < 19; ++i) REQUIRE(std::abs(result.q[i][first] - before) < 1e-12);
  for (std::size_t i = 19; i < 31; ++i) REQUIRE(std::abs(result.q[i][first] - after) < 1e-12);
}

TEST_CASE("branch_tracking: without a link the first rotary goes linearly through the run",
          "[kernels][kinematics]") {
  const ScrewChain chain = test::table_table_ac();
  const auto pair = RotaryPair::from(chain);
  const int first = pair->first_rotary();
  const BranchTrackingSettings settings = settings_for(chain);
  std::vector<TrackingPoint> points{point(Vec3(60, 0, 0), axis_at(0.2, 0.5), false, 1)};
  add_upright(points, 9, {});
  points.push_back(point(Vec3(30, 60, 3), axis_at(0.2, 1.5), true, 11));
  const BranchTracking result = track_branches(*pair, points, settings);
  check_choice(*pair, points, settings, result);
  // Nine points at the pole have eight motions between them.
  const double step = (result.q.back()[first] - result.q.front()[first]) / 8.0;
  CHECK(std::abs(std::abs(step) - 0.125) < 1e-12);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double expected = i == 1 || i == 10 ? 0.0 : step;
    CHECK(std::abs(result.q[i][first] - result.q[i - 1][first] - expected) < 1e-12);
  }

  // One point at the pole has none: the motions into and out of it turn.
  std::vector<TrackingPoint> touch{point(Vec3(60, 0, 0), axis_at(0.2, 0.5), false, 1)};
  add_upright(touch, 1, {});
  touch.push_back(point(Vec3(30, 60, 3), axis_at(0.2, 1.5), true, 3));
  const BranchTracking touched = track_branches(*pair, touch, settings);
  check_choice(*pair, touch, settings, touched);
  CHECK(std::abs(std::abs(touched.q[1][first] - touched.q[0][first]) - 0.5) < 1e-12);
  CHECK(std::abs(std::abs(touched.q[2][first] - touched.q[1][first]) - 0.5) < 1e-12);

  // A single point is too short for a large turn when the second branch is out of reach.
  ScrewChain one_sided = chain;
  one_sided.joints[3].upper = 0.01;
  const auto narrow = RotaryPair::from(one_sided);
  std::vector<TrackingPoint> corner{point(Vec3(60, 0, 0), axis_at(0.2, 0.0), false, 1)};
  add_upright(corner, 1, {});
  corner.push_back(point(Vec3(30, 60, 3), axis_at(0.2, 2.9), true, 3));
  const BranchTracking refused = track_branches(*narrow, corner, settings);
  REQUIRE(refused.status == Status::rewind_needed);
  CHECK(refused.rewinds[0].line == 3);
  CHECK(refused.rewinds[0].joint == narrow->first_rotary());
  CAPTURE(refused.reason);
  CHECK(refused.reason.find("166.158 degrees") != std::string::npos);
  corner.back().cut = false;
  check_choice(*narrow, corner, settings, track_branches(*narrow, corner, settings));
}

TEST_CASE("branch_tracking: unreachable axes and limits are told apart", "[kernels][kinematics]") {
  ScrewChain chain = test::table_table_b45c();
  const auto pair = RotaryPair::from(chain);
  std::vector<TrackingPoint> points = spiral(0.2);
  points[7].location.axis = axis_at(1.8, 0.3);
  const BranchTracking unreachable = track_branches(*pair, points, settings_for(chain));
  CHECK(unreachable.status == Status::unreachable);
  CHECK(unreachable.point == 7);
  CHECK_FALSE(unreachable.reason.empty());

  points = spiral(0.2);
  points[9].location.tip.x() = 900.0;
  const BranchTracking linear = track_branches(*pair, points, settings_for(chain));
  CHECK(linear.status == Status::over_limit);
  CHECK(linear.point == 9);
  CHECK(linear.joint <= 2);
  CHECK(linear.reason.find("limit is") != std::string::npos);
  CHECK(linear.reason.find("400.000 mm") != std::string::npos);

  chain = test::table_table_ac();  // A −120 .. 34 degrees
  chain.joints[3].lower = -0.5;
  chain.joints[3].upper = 0.5;
  const auto narrow = RotaryPair::from(chain);
  const BranchTracking tilt = track_branches(*narrow, spiral(0.2), settings_for(chain));
  CHECK(tilt.status == Status::over_limit);
  CHECK(tilt.point == 0);
  CHECK(tilt.joint == 3);
  CHECK(tilt.reason.find("30.000 degrees") != std::string::npos);
  CHECK(tilt.reason.find("28.648 degrees") != std::string::npos);

  chain = laser();
  BranchTrackingSettings settings = settings_for(chain);
  settings.held[5] = 30.0;
  const BranchTracking held = track_branches(*RotaryPair::from(chain), spiral(0.2), settings);
  CHECK(held.status == Status::over_limit);
  CHECK(held.joint == 5);
}

/// Number of points that some allowed sequence reaches, from sets of candidates.
std::size_t reached_by_sets(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                            const BranchTrackingSettings& settings) {
  std::vector<JointVector> alive = all_candidates(pair, points[0], settings.held);
  for (std::size_t i = 1; i < points.size(); ++i) {
    std::vector<JointVector> next;
    for (const JointVector& q : all_candidates(pair, points[i], settings.held)) {
      const bool from_any = std::any_of(alive.begin(), alive.end(), [&](const JointVector& p) {
        return !points[i].cut ||
               (std::abs(q[pair.first_rotary()] - p[pair.first_rotary()]) <= settings.continuity &&
                std::abs(q[pair.second_rotary()] - p[pair.second_rotary()]) <= settings.continuity);
      });
      if (from_any) next.push_back(q);
    }
    if (next.empty()) return i;
    alive = next;
  }
  return points.size();
}

TEST_CASE("branch_tracking: a linear limit on the branch of a cut is a rewind",
          "[kernels][kinematics]") {
  Random random(32);
  int by_linear = 0;
  int solved = 0;
  for (int n = 0; n < 600; ++n) {
    ScrewChain chain = test::table_table_ac();
    chain.joints[3].lower = -2.1;
    chain.joints[3].upper = 2.1;
    for (int j = 0; j < 3; ++j) {
      chain.joints[j].lower = -random.between(20.0, 120.0);
      chain.joints[j].upper = random.between(20.0, 120.0);
    }
    const auto pair = RotaryPair::from(chain);
    const BranchTrackingSettings settings = settings_for(chain);
    std::vector<TrackingPoint> points;
    const double start = random.between(-kPi, kPi);
    const double rate = random.between(-0.08, 0.08);
    const Vec3 tip = 60.0 * random.unit();
    const Vec3 end = 60.0 * random.unit();
    for (int i = 0; i < 40; ++i)
      points.push_back(point(tip + (end - tip) * (i / 39.0), axis_at(0.5, start + rate * i), i > 0,
                             static_cast<std::uint32_t>(i + 1)));
    bool every = true;
    for (const TrackingPoint& p : points)
      every = every && !all_candidates(*pair, p, settings.held).empty();
    const BranchTracking result = track_branches(*pair, points, settings);
    CAPTURE(n, result.reason);
    if (!every) {
      REQUIRE(result.status == Status::over_limit);
      continue;
    }
    const std::size_t reached = reached_by_sets(*pair, points, settings);
    if (reached == points.size()) {
      check_choice(*pair, points, settings, result);
      ++solved;
      continue;
    }
    REQUIRE(result.status == Status::rewind_needed);
    REQUIRE(result.rewinds[0].point == reached);
    if (result.rewinds[0].joint > 2) continue;
    CHECK(result.reason.find(" mm") != std::string::npos);
    CHECK(result.reason.find("limit is") != std::string::npos);
    ++by_linear;
  }
  CHECK(by_linear > 5);
  CHECK(solved > 50);
}

TEST_CASE("branch_tracking: many turns with little memory", "[kernels][kinematics]") {
  ScrewChain chain = laser();
  chain.joints[3].lower = -200.0 * kPi;
  chain.joints[3].upper = 200.0 * kPi;
  const auto pair = RotaryPair::from(chain);
  BranchTrackingSettings small = settings_for(chain);
  small.turn_memory = 1;
  const BranchTrackingSettings large = settings_for(chain);

  std::vector<TrackingPoint> points = spiral(3.0);
  for (std::size_t i = 7; i < points.size(); i += 7) points[i].cut = false;
  const BranchTracking a = track_branches(*pair, points, small);
  const BranchTracking b = track_branches(*pair, points, large);
  check_choice(*pair, points, small, a);
  CHECK(std::abs(a.cost - b.cost) < 1e-9);

  // Forty turns in one cut need more turns than the smallest window has.
  const std::vector<TrackingPoint> winding = spiral(40.0);
  const BranchTracking wound = track_branches(*pair, winding, small);
  check_choice(*pair, winding, small, wound);
  CHECK(spread(wound, 3) == Approx(80.0 * kPi));

  // Further than the range, whatever the window.
  chain.joints[3].lower = -20.0 * kPi;
  chain.joints[3].upper = 20.0 * kPi;
  const auto finite = RotaryPair::from(chain);
  const BranchTracking over = track_branches(*finite, winding, small);
  REQUIRE(over.status == Status::rewind_needed);
  CHECK(over.rewinds[0].point == 20 * 72 + 1);
}

TEST_CASE("branch_tracking: the same choice every time", "[kernels][kinematics]") {
  const ScrewChain chain = laser();
  const auto pair = RotaryPair::from(chain);
  const std::vector<TrackingPoint> points = great_circle_at(0.03, 0.5, 501);
  const BranchTracking a = track_branches(*pair, points, settings_for(chain));
  const BranchTracking b = track_branches(*pair, points, settings_for(chain));
  REQUIRE(a.status == Status::ok);
  CHECK(a.branch == b.branch);
  for (std::size_t i = 0; i < points.size(); ++i) REQUIRE(a.q[i] == b.q[i]);
}

TEST_CASE("branch_tracking: preconditions and the empty path", "[kernels][kinematics]") {
  const ScrewChain chain = laser();
  const auto pair = RotaryPair::from(chain);
  BranchTrackingSettings settings = settings_for(chain);
  CHECK(track_branches(*pair, {}, settings).status == Status::ok);
  settings.held = JointVector::Zero(2);
  CHECK_THROWS_AS(track_branches(*pair, spiral(0.1), settings), ContractViolation);
  settings = settings_for(chain);
  settings.continuity = 0.0;
  CHECK_THROWS_AS(track_branches(*pair, spiral(0.1), settings), ContractViolation);
  settings = settings_for(chain);
  settings.pole_cap = 0.6;
  CHECK_THROWS_AS(track_branches(*pair, spiral(0.1), settings), ContractViolation);
}

}  // namespace
}  // namespace smoothpost
