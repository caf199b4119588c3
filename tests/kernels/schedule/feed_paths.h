#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "kernels/schedule/feed_profile.h"
#include "kernels/spline/bspline_basis.h"

// Paths and an independent measure of what a time law asks of them.
namespace smoothpost::test {

inline constexpr double kNone = std::numeric_limits<double>::infinity();

inline JointVector joints(std::initializer_list<double> values) {
  JointVector result(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), result.data());
  return result;
}

/// Limits of `count` joints, all without a limit.
inline FeedLimits no_limits(int count) {
  FeedLimits limits;
  limits.velocity = limits.acceleration = limits.jerk = JointVector::Constant(count, kNone);
  return limits;
}

/// A line along one joint, which is the tip's line too.
inline FeedPath line(double length, double feed) {
  FeedPath path;
  path.breaks = {0.0, length};
  path.feed = {feed};
  path.jet = [](std::size_t, double) {
    PathJet jet{joints({1.0}), joints({0.0}), joints({0.0})};
    jet.tip_first = 1.0;
    return jet;
  };
  return path;
}

/// Least time of a rest-to-rest line under velocity, acceleration and jerk: seven phases.
struct LineLimits {
  double v, a, j;
};

inline double seven_phases(double length, const LineLimits& l) {
  const auto ramp = [&](double v) {
    return v <= l.a * l.a / l.j ? 2.0 * std::sqrt(v / l.j) : v / l.a + l.a / l.j;
  };
  if (l.v * ramp(l.v) <= length) return length / l.v + ramp(l.v);
  const double jerky = std::pow(0.5 * length * std::sqrt(l.j), 2.0 / 3.0);
  const double ratio = l.a / l.j;
  const double peak = jerky <= l.a * ratio
                          ? jerky
                          : 0.5 * l.a * (-ratio + std::sqrt(ratio * ratio + 4.0 * length / l.a));
  return 2.0 * ramp(peak);
}

/// The analytic path of the reference, six joints over its arc length of 400 mm; metres there.
inline FeedPath path6() {
  FeedPath path;
  path.breaks = {0.0, 400.0};
  path.feed = {250.0};
  path.jet = [](std::size_t, double s) {
    // amplitude (mm or rad), wave number (1/mm), phase
    static constexpr std::array<std::array<double, 3>, 6> kWaves = {
        {{50.0, 0.020, 0.0},
         {0, 0, 0},
         {20.0, 0.035, 0.0},
         {0.6, 0.012, 0.0},
         {0.4, 0.017, 1.5707963267948966},
         {10.0, 0.025, 0.0}}};
    PathJet jet{JointVector(6), JointVector(6), JointVector(6)};
    for (int k = 0; k < 6; ++k) {
      const auto [a, w, phase] = kWaves[k];
      jet.first[k] = a * w * std::cos(w * s + phase);
      jet.second[k] = -a * w * w * std::sin(w * s + phase);
      jet.third[k] = -a * w * w * w * std::cos(w * s + phase);
    }
    jet.first[1] = 1.0;
    jet.tip_first = 1.0;
    return jet;
  };
  return path;
}

inline FeedLimits path6_limits() {
  return {joints({2e3, 2e3, 2e3, 10, 10, 2e3}),
          joints({12e3, 12e3, 12e3, 80, 80, 40e3}),
          joints({120e3, 120e3, 120e3, 200, 200, 400e3}),
          8e3,
          80e3,
          kNone};
}

/// Shares of the limits that a law uses, from the definition, at `count` times.
struct Used {
  double velocity = 0.0, acceleration = 0.0, jerk = 0.0, tip_acceleration = 0.0, tip_jerk = 0.0;
  double largest() const {
    return std::max({velocity, acceleration, jerk, tip_acceleration, tip_jerk});
  }
};

/// q(t) by the chain rule at one state.
inline void use(Used& used, const PathJet& jet, const FeedState& at, const FeedLimits& limits) {
  const double v = at.first, a = at.second, j = at.third;
  const auto grow = [](double& most, double value, double limit) {
    most = std::max(most, std::abs(value) / limit);
  };
  const auto second = [&](double q1, double q2) { return q1 * a + q2 * v * v; };
  const auto third = [&](double q1, double q2, double q3) {
    return q1 * j + 3.0 * q2 * v * a + q3 * v * v * v;
  };
  for (int k = 0; k < jet.first.size(); ++k) {
    grow(used.velocity, jet.first[k] * v, limits.velocity[k]);
    grow(used.acceleration, second(jet.first[k], jet.second[k]), limits.acceleration[k]);
    grow(used.jerk, third(jet.first[k], jet.second[k], jet.third[k]), limits.jerk[k]);
  }
  grow(used.velocity, jet.turn_first * v, limits.turn_rate);
  if (jet.tip_first < 1e-2) return;  // there the limits of the tip are those of s
  grow(used.tip_acceleration, second(jet.tip_first, jet.tip_second), limits.tip_acceleration);
  grow(used.tip_jerk, third(jet.tip_first, jet.tip_second, jet.tip_third), limits.tip_jerk);
}

inline Used used_limits(const FeedPath& path, const FeedLimits& limits, const FeedProfile& profile,
                        int count) {
  Used used;
  std::size_t piece = 0;
  for (int i = 0; i <= count; ++i) {
    const FeedState at = profile.at(profile.duration() * i / count);
    while (piece + 1 < path.pieces() && at.s > path.breaks[piece + 1]) ++piece;
    const PathJet jet = path.jet(piece, at.s);
    use(used, jet, at, limits);
    used.velocity = std::max(used.velocity, jet.tip_first * at.first / path.feed[piece]);
  }
  return used;
}

class FeedRandom {
 public:
  explicit FeedRandom(unsigned seed) : engine_(seed) {}
  double between(double a, double b) {
    return a + (b - a) * (static_cast<double>(engine_() >> 11) * 0x1.0p-53);
  }

 private:
  std::mt19937_64 engine_;
};

/// A path with limits.
struct LimitedPath {
  FeedPath path;
  FeedLimits limits;
  double length() const { return path.breaks.back(); }
};

/// The jet of a quartic spline of three linear and three rotary joints; the tip is the linear ones.
inline PathJet spline_jet(const SplineCurve& curve, double middle, double s) {
  const double d = s - middle;  // from the middle of the piece: never outside the piece
  const Eigen::VectorXd d1 = curve.at(middle, 1), d2 = curve.at(middle, 2),
                        d3 = curve.at(middle, 3), d4 = curve.at(middle, 4);
  PathJet jet;
  jet.first = d1 + d * (d2 + d / 2.0 * (d3 + d / 3.0 * d4));
  jet.second = d2 + d * (d3 + d / 2.0 * d4);
  jet.third = d3 + d * d4;
  const Eigen::Vector3d c1 = jet.first.head<3>(), c2 = jet.second.head<3>(),
                        c3 = jet.third.head<3>();
  jet.tip_first = c1.norm();
  if (jet.tip_first > 0.0) {
    jet.tip_second = c1.dot(c2) / jet.tip_first;
    jet.tip_third =
        (c2.squaredNorm() + c1.dot(c3) - jet.tip_second * jet.tip_second) / jet.tip_first;
  }
  jet.turn_first = jet.first.tail<3>().norm();
  return jet;
}

inline FeedLimits random_limits(FeedRandom& random) {
  FeedLimits limits = no_limits(6);
  for (int k = 0; k < 6; ++k) {
    const bool rotary = k > 2;
    limits.velocity[k] = rotary ? random.between(2.0, 10.0) : random.between(200.0, 2000.0);
    limits.acceleration[k] = rotary ? random.between(20.0, 80.0) : random.between(2e3, 12e3);
    limits.jerk[k] = rotary ? random.between(200.0, 2000.0) : random.between(3e4, 4e5);
  }
  limits.tip_acceleration = random.between(2e3, 8e3);
  limits.tip_jerk = random.between(3e4, 1.5e5);
  limits.turn_rate = random.between(2.0, 10.0);
  return limits;
}

/// A random C3 path of that length: straight, curved and rotation-only stretches.
inline LimitedPath random_path(unsigned seed, double length) {
  FeedRandom random(seed);
  const int spans = 6 + static_cast<int>(random.between(0.0, 20.0) + length / 60.0);
  auto curve = std::make_shared<SplineCurve>();
  curve->knots = clamped_knots(4, spans);
  for (double& u : curve->knots.values) u *= length / spans;
  curve->controls.resize(6, spans + 4);
  Eigen::VectorXd at = Eigen::VectorXd::Zero(6), along = at, turn = at;
  const auto wander = [&](Eigen::VectorXd& v, int first, double by) {
    for (int k = first; k < first + 3; ++k) v[k] += by * random.between(-1.0, 1.0);
  };
  wander(along, 0, 1.0);
  along /= along.norm();
  const double step = length / spans;
  double kind = 0.0;
  for (int i = 0, left = 0; i < spans + 4; ++i, --left) {
    if (left == 0) {
      kind = random.between(0.0, 1.0);
      left = 2 + static_cast<int>(random.between(0.0, 5.0));
    }
    if (kind < 0.2) {  // straight, no turning
      turn.setZero();
      at += along * step;
    } else if (kind < 0.4) {  // turning in place
      turn.setZero();
      wander(turn, 3, 1.0);
      at += turn * step / 75.0;
    } else {
      wander(along, 0, 0.5);
      along /= along.norm();
      turn *= 0.7;
      wander(turn, 3, 0.5);
      at += along * step + turn * step / 150.0;
    }
    curve->controls.col(i) = at;
  }
  LimitedPath result;
  result.path.breaks.assign(curve->knots.values.begin() + 4, curve->knots.values.end() - 4);
  result.path.feed.assign(spans, random.between(20.0, 400.0));
  result.path.jet = [curve, breaks = result.path.breaks](std::size_t piece, double s) {
    return spline_jet(*curve, 0.5 * (breaks[piece] + breaks[piece + 1]), s);
  };
  result.limits = random_limits(random);
  return result;
}

/// Of random length, 10 mm to 2 m.
inline LimitedPath random_path(unsigned seed) {
  FeedRandom random(seed + 100000u);
  return random_path(seed, std::exp(random.between(std::log(10.0), std::log(2000.0))));
}

/// Rest to rest with everything by default.
inline FeedResult from_rest_to_rest(const FeedPath& path, const FeedLimits& limits,
                                    const FeedSettings& settings = {}) {
  return schedule_feed(path, limits, {}, {}, settings, {});
}

}  // namespace smoothpost::test
