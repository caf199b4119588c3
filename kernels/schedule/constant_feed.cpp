#include "kernels/schedule/constant_feed.h"

#include <cmath>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

constexpr double kNoWay = 1e-9;  // of tip_first

// Shares of the limits at one place and tip speed, the largest of each kind with its joint.
struct Loads {
  double velocity = 0.0, acceleration = 0.0, jerk = 0.0;
  int velocity_joint = -1, acceleration_joint = -1, jerk_joint = -1;
};

void raise(double share, int joint, double& most, int& which) {
  if (!(share > most)) return;
  most = share;
  which = joint;
}

// At unit speed of the tip; multiply by F, F², F³.
Loads loads_at(const PathJet& jet, const FeedLimits& limits) {
  Loads out;
  const double l1 = jet.tip_first, l2 = jet.tip_second, l3 = jet.tip_third;
  if (l1 <= kNoWay) return out;
  for (int k = 0; k < static_cast<int>(jet.first.size()); ++k) {
    const double q1 = jet.first[k] / l1;
    const double q2 = (jet.second[k] - q1 * l2) / (l1 * l1);
    const double q3 = (jet.third[k] - 3.0 * q2 * l1 * l2 - q1 * l3) / (l1 * l1 * l1);
    raise(std::abs(q1) / limits.velocity[k], k, out.velocity, out.velocity_joint);
    raise(std::abs(q2) / limits.acceleration[k], k, out.acceleration, out.acceleration_joint);
    raise(std::abs(q3) / limits.jerk[k], k, out.jerk, out.jerk_joint);
  }
  return out;
}

double place_of(const FeedPath& path, std::size_t piece, int k, int places) {
  const double a = path.breaks[piece], b = path.breaks[piece + 1];
  return a + (b - a) * k / (places - 1);
}

}  // namespace

ConstantFeed largest_constant_feed(const FeedPath& path, const FeedLimits& limits, int places) {
  require(places >= 2, "largest_constant_feed: places >= 2");
  ConstantFeed out;
  out.feed = std::numeric_limits<double>::infinity();
  const auto see = [&out](double feed, FeedOverload::Kind kind, int joint, std::size_t piece,
                          double s) {
    if (!(feed < out.feed)) return;
    out.feed = feed;
    out.blocking = {kind, joint, s, piece, 1.0};
  };
  for (std::size_t piece = 0; piece < path.pieces(); ++piece)
    for (int k = 0; k < places; ++k) {
      const double s = place_of(path, piece, k, places);
      const Loads load = loads_at(path.jet(piece, s), limits);
      if (load.velocity > 0.0)
        see(1.0 / load.velocity, FeedOverload::Kind::velocity, load.velocity_joint, piece, s);
      if (load.acceleration > 0.0)
        see(1.0 / std::sqrt(load.acceleration), FeedOverload::Kind::acceleration,
            load.acceleration_joint, piece, s);
      if (load.jerk > 0.0)
        see(1.0 / std::cbrt(load.jerk), FeedOverload::Kind::jerk, load.jerk_joint, piece, s);
    }
  return out;
}

std::vector<FeedOverload> overloads(const FeedPath& path, const FeedLimits& limits, int places) {
  require(places >= 2, "overloads: places >= 2");
  std::vector<FeedOverload> out(path.pieces());
  for (std::size_t piece = 0; piece < path.pieces(); ++piece) {
    const double feed = path.feed[piece];
    if (!std::isfinite(feed)) continue;
    double worst = 1.0;  // of the feed: what it has to be divided by
    for (int k = 0; k < places; ++k) {
      const double s = place_of(path, piece, k, places);
      const Loads load = loads_at(path.jet(piece, s), limits);
      const auto see = [&](double share, double root, FeedOverload::Kind kind, int joint) {
        if (!(root > worst)) return;
        worst = root;
        out[piece] = {kind, joint, s, piece, share};
      };
      const double v = load.velocity * feed;
      const double a = load.acceleration * feed * feed;
      const double j = load.jerk * feed * feed * feed;
      see(v, v, FeedOverload::Kind::velocity, load.velocity_joint);
      see(a, std::sqrt(a), FeedOverload::Kind::acceleration, load.acceleration_joint);
      see(j, std::cbrt(j), FeedOverload::Kind::jerk, load.jerk_joint);
    }
  }
  return out;
}

}  // namespace smoothpost
