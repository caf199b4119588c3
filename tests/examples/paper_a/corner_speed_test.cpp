#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "examples/paper_a/paper_paths.h"
#include "kernels/schedule/constant_feed.h"
#include "kernels/schedule/feed_profile.h"
#include "kernels/spline/gauss_rule.h"

// The paper's test path at the paper's limits, 30 mm/s, 3000 mm/s² and 30000 mm/s³. The paper has
// them along the tangent alone, where they say nothing of corners; here they hold in all
// directions.
namespace smoothpost::paper_a {
namespace {

constexpr double kFeed = 30.0, kAcceleration = 3000.0, kJerk = 30000.0;
constexpr double kNone = std::numeric_limits<double>::infinity();

/// Derivatives of the tip by its arc length.
struct TipDerivatives {
  Vec3 first, second, third;
};

TipDerivatives by_arc_length(const Vec3& r1, const Vec3& r2, const Vec3& r3) {
  const double s1 = r1.norm(), s2 = r1.dot(r2) / s1;
  const double s3 = (r2.squaredNorm() + r1.dot(r3) - s2 * s2) / s1;
  TipDerivatives d;
  d.first = r1 / s1;
  d.second = (r2 - s2 * d.first) / (s1 * s1);
  d.third = (r3 - s3 * d.first - 3.0 * s1 * s2 * d.second) / (s1 * s1 * s1);
  return d;
}

/// The tip of a path over some regular parameter, in pieces.
struct TipPath {
  std::vector<double> breaks;
  /// r, r', r'', r''' by the parameter.
  std::function<std::array<Vec3, 4>(std::size_t, double)> at;

  TipDerivatives arc(std::size_t piece, double s) const {
    const auto r = at(piece, s);
    return by_arc_length(r[1], r[2], r[3]);
  }
};

/// The septic pieces of the paper over the arc length.
TipPath by_pieces(const std::vector<Piece>& pieces) {
  struct Table {
    std::vector<Piece> pieces;
    std::vector<std::vector<double>> length;  ///< [piece][cell]: arc length at the cell's start
  };
  constexpr int kCells = 32;
  const auto speed = [](const Piece& piece, double t) {
    Vec3 r1;
    for (int k = 0; k < 3; ++k) r1[k] = evaluate(piece.col(k), t).d1;
    return r1.norm();
  };
  const auto between = [speed](const Piece& piece, double from, double to) {
    const GaussRule& rule = gauss_rule(8);
    double sum = 0.0;
    for (int g = 0; g < rule.points; ++g)
      sum += rule.weights[g] * speed(piece, from + (to - from) * rule.nodes[g]);
    return sum * (to - from);
  };
  auto table = std::make_shared<Table>();
  table->pieces = pieces;
  TipPath path;
  path.breaks = {0.0};
  for (const Piece& piece : pieces) {
    std::vector<double> length{0.0};
    for (int i = 0; i < kCells; ++i)
      length.push_back(length.back() + between(piece, 1.0 * i / kCells, (i + 1.0) / kCells));
    path.breaks.push_back(path.breaks.back() + length.back());
    table->length.push_back(length);
  }
  path.at = [table, speed, between, breaks = path.breaks](std::size_t i, double s) {
    const std::vector<double>& length = table->length[i];
    const double target = std::clamp(s - breaks[i], 0.0, length.back());
    const auto next = std::upper_bound(length.begin() + 1, length.end() - 1, target);
    const auto cell = static_cast<int>(next - length.begin()) - 1;
    const double from = static_cast<double>(cell) / kCells;
    const Piece& piece = table->pieces[i];
    double t = from;
    for (int n = 0; n < 6; ++n)
      t += (target - length[static_cast<std::size_t>(cell)] - between(piece, from, t)) /
           speed(piece, t);
    const ArcDerivatives d = paper_a::by_arc_length(piece, std::clamp(t, 0.0, 1.0));
    return std::array<Vec3, 4>{d[0].head<3>(), d[1].head<3>(), d[2].head<3>(), d[3].head<3>()};
  };
  return path;
}

/// A CornerPath over its own parameter.
TipPath by_parameter(const CornerPath& corners) {
  auto path = std::make_shared<CornerPath>(corners);
  struct Place {
    std::size_t leg;
    double start;  ///< of the leg, in the parameter of the whole path
  };
  std::vector<Place> places;
  TipPath tip;
  tip.breaks = {0.0};
  double start = 0.0;
  for (std::size_t leg = 0; leg < path->legs(); ++leg) {
    const auto breaks = path->breaks(leg);
    for (std::size_t k = 1; k < breaks.size(); ++k) {
      places.push_back({leg, start});
      tip.breaks.push_back(start + breaks[k]);
    }
    start += path->length(leg);
  }
  tip.at = [path, places, breaks = tip.breaks](std::size_t i, double s) {
    // From inside the piece: at a place where two formulas meet, CornerPath takes one of them.
    const double inside = 1e-13 * breaks.back();
    const double x = std::clamp(s, breaks[i] + inside, breaks[i + 1] - inside) - places[i].start;
    return path->derivatives(places[i].leg, x).tip;
  };
  return tip;
}

/// Where the third derivative by arc length is largest near a corner of the path.
struct Peak {
  std::size_t piece = 0;
  double s = 0.0, size = 0.0;
  Vec3 direction = Vec3::UnitX();
};

/// The peak over the whole path, refined.
Peak sharpest(const TipPath& path) {
  Peak peak;
  const auto look = [&](std::size_t piece, double s) {
    const Vec3 third = path.arc(piece, s).third;
    if (third.norm() > peak.size) peak = {piece, s, third.norm(), third.normalized()};
  };
  for (std::size_t piece = 0; piece + 1 < path.breaks.size(); ++piece)
    for (int i = 0; i <= 400; ++i)
      look(piece, path.breaks[piece] + (path.breaks[piece + 1] - path.breaks[piece]) * i / 400.0);
  double step = (path.breaks[peak.piece + 1] - path.breaks[peak.piece]) / 400.0;
  for (int n = 0; n < 30; ++n, step *= 0.5) {
    const Peak centre = peak;
    for (const double s : {centre.s - step, centre.s + step})
      if (s >= path.breaks[centre.piece] && s <= path.breaks[centre.piece + 1])
        look(centre.piece, s);
  }
  return peak;
}

/// The tip as three joints along an orthonormal frame whose first axis is `first`.
FeedPath feed_path(const TipPath& tip, const Vec3& first) {
  Mat3 frame;
  frame.row(0) = first;
  frame.row(1) = first.unitOrthogonal();
  frame.row(2) = first.cross(first.unitOrthogonal());
  FeedPath path;
  path.breaks = tip.breaks;
  path.feed.assign(tip.breaks.size() - 1, kFeed);
  path.jet = [tip, frame](std::size_t piece, double s) {
    const auto r = tip.at(piece, s);
    PathJet jet;
    jet.first = frame * r[1];
    jet.second = frame * r[2];
    jet.third = frame * r[3];
    jet.tip_first = r[1].norm();
    jet.tip_second = r[1].dot(r[2]) / jet.tip_first;
    jet.tip_third =
        (r[2].squaredNorm() + r[1].dot(r[3]) - jet.tip_second * jet.tip_second) / jet.tip_first;
    return jet;
  };
  return path;
}

FeedLimits limits() {
  FeedLimits result;
  result.velocity = JointVector::Constant(3, kNone);
  result.acceleration = JointVector::Constant(3, kAcceleration);
  result.jerk = JointVector::Constant(3, kJerk);
  result.tip_acceleration = kAcceleration;
  result.tip_jerk = kJerk;
  return result;
}

struct Method {
  const char* name;
  TipPath path;
  double speed;   ///< mm/s, of the findings
  double digits;  ///< half a unit of its last digit
};

std::vector<Method> methods() {
  const Tolerances t{0.8, 0.01};
  return {{"printed ACR", by_pieces(paper_path(t, SignOfM2::of_the_tables, Links::decoupled)), 4.16,
           0.005},
          {"equations of the paper", by_pieces(paper_path(t, SignOfM2::printed, Links::decoupled)),
           2.63, 0.005},
          {"half", by_parameter(common_parameter(t, BlendKind::acr)), 5.91, 0.005},
          {"ramp", by_parameter(common_parameter(t, BlendKind::ramp)), 10.10, 0.005}};
}

}  // namespace

TEST_CASE("corner_speed: the constant speed that the sharpest corner allows",
          "[examples][paper][schedule]") {
  for (const Method& method : methods()) {
    INFO(method.name);
    const Peak peak = sharpest(method.path);
    // In that frame the first joint's third derivative is |r'''| there, and no joint's is larger
    // anywhere.
    FeedPath path = feed_path(method.path, peak.direction);
    const ConstantFeed constant = largest_constant_feed(path, limits(), 2001);
    CHECK(std::abs(constant.feed - method.speed) <= method.digits);
    CHECK(constant.feed == Approx(std::cbrt(kJerk / peak.size)).epsilon(1e-4));
    CHECK(constant.blocking.kind == FeedOverload::Kind::jerk);
    CHECK(constant.blocking.joint == 0);
    CHECK(constant.blocking.piece == peak.piece);
  }
}

TEST_CASE("corner_speed: the schedule passes the sharpest corner at no less",
          "[examples][paper][schedule]") {
  std::vector<double> times;
  for (const Method& method : methods()) {
    INFO(method.name);
    const Peak peak = sharpest(method.path);
    const FeedPath path = feed_path(method.path, peak.direction);
    const FeedResult result = schedule_feed(path, limits(), {}, {}, {}, {});
    REQUIRE(result.status == FeedStatus::solved);
    CHECK(result.load.largest() <= 1.0);
    const double allowed = largest_constant_feed(path, limits(), 401).feed;
    const FeedState at = result.profile.at(result.profile.time(peak.s));
    const double speed = at.first * path.jet(peak.piece, peak.s).tip_first;
    CAPTURE(allowed, speed, at.second, result.profile.duration(), result.dilation);
    CHECK(speed >= allowed);
    CHECK(speed <= kFeed);
    // Beside the peak it may be slower for a moment: over 2 mm it is not.
    double way = 0.0;
    const double from = result.profile.time(peak.s - 1.0), to = result.profile.time(peak.s + 1.0);
    constexpr int kSteps = 4000;
    std::size_t piece = 0;
    for (int i = 0; i < kSteps; ++i) {
      const FeedState now = result.profile.at(from + (to - from) * (i + 0.5) / kSteps);
      while (now.s > path.breaks[piece + 1]) ++piece;
      way += now.first * path.jet(piece, now.s).tip_first * (to - from) / kSteps;
    }
    CAPTURE(way, way / (to - from));
    CHECK(way / (to - from) > allowed);
    times.push_back(result.profile.duration());
  }
  CHECK(times[0] < times[1]);
  CHECK(times[2] < times[0]);
  CHECK(times[3] < times[2]);
}

}  // namespace smoothpost::paper_a
