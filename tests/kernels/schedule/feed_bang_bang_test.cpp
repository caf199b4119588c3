#include <catch2/catch.hpp>

#include "tests/kernels/schedule/feed_paths.h"

namespace smoothpost {
namespace {

/// Velocity and acceleration alone, by a dynamic programme over x = (ds/dt)² on a fine grid of s:
/// backwards the largest x from which the end can be reached at rest, forwards the largest x that
/// can be reached. On one step x changes by 2Δu with u = d²s/dt² constant.
class GridProgramme {
 public:
  GridProgramme(const FeedPath& path, const FeedLimits& limits, int steps)
      : limits_(limits), step_((path.breaks.back() - path.breaks.front()) / steps) {
    for (int i = 0; i <= steps; ++i) {
      jets_.push_back(path.jet(0, path.breaks.front() + step_ * i));
      double cap = std::pow(path.feed[0] / jets_[i].tip_first, 2);
      for (int k = 0; k < jets_[i].first.size(); ++k)
        cap = std::min(cap, std::pow(limits.velocity[k] / jets_[i].first[k], 2));
      cap_.push_back(cap);
    }
  }

  double time() const {
    const std::size_t n = cap_.size();
    std::vector<double> most(n, 0.0);
    for (std::size_t i = n - 1; i-- > 0;) {
      double low = 0.0, high = cap_[i];
      for (int k = 0; k < 60; ++k) {
        const double x = 0.5 * (low + high);
        const auto u = range(i, x);
        const bool reaches =
            u[0] <= u[1] && x + 2.0 * step_ * u[0] <= most[i + 1] && x + 2.0 * step_ * u[1] >= 0.0;
        (reaches ? low : high) = x;
      }
      most[i] = low;
    }
    double x = 0.0, time = 0.0;
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const double next = std::min(most[i + 1], x + 2.0 * step_ * range(i, x)[1]);
      time += 2.0 * step_ / (std::sqrt(x) + std::sqrt(next));
      x = next;
    }
    return time;
  }

 private:
  /// u that keeps every acceleration at x.
  std::array<double, 2> range(std::size_t i, double x) const {
    std::array<double, 2> u{-1e12, 1e12};
    const auto row = [&](double q1, double q2, double limit) {
      if (std::abs(q1) < 1e-12) return;
      const double a = (-limit - q2 * x) / q1, b = (limit - q2 * x) / q1;
      u = {std::max(u[0], std::min(a, b)), std::min(u[1], std::max(a, b))};
    };
    for (int k = 0; k < jets_[i].first.size(); ++k)
      row(jets_[i].first[k], jets_[i].second[k], limits_.acceleration[k]);
    row(jets_[i].tip_first, jets_[i].tip_second, limits_.tip_acceleration);
    return u;
  }

  const FeedLimits& limits_;
  double step_;
  std::vector<PathJet> jets_;
  std::vector<double> cap_;
};

}  // namespace

TEST_CASE("schedule_feed: within 0.2 per cent of a dynamic programme without jerk limits",
          "[kernels][schedule]") {
  const FeedPath path = test::path6();
  for (double share : {1.0, 0.05}) {
    FeedLimits limits = test::path6_limits();
    limits.acceleration *= share;
    limits.tip_acceleration *= share;
    limits.jerk.setConstant(test::kNone);
    limits.tip_jerk = test::kNone;
    FeedSettings settings;
    settings.element_time = 0.003;
    const FeedResult result = test::from_rest_to_rest(path, limits, settings);
    REQUIRE(result.status == FeedStatus::solved);
    CHECK(test::used_limits(path, limits, result.profile, 20011).largest() <= 1.0);
    const double best = GridProgramme(path, limits, 20000).time();
    CHECK(result.profile.duration() <= 1.002 * best);
    CHECK(result.profile.duration() >= 0.9995 * best);
  }
}

}  // namespace smoothpost
