#include "kernels/schedule/feed_check.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace smoothpost {
namespace {

constexpr int kPlaces = 44;  // of an element: 40 evenly, and two more in the first and in
                             // the last interval
constexpr double kInterpolated = 1e-6;  // apart, as shares of the limits
constexpr double kBinding = 0.99;
constexpr double kNearPeak = 0.9;  // loads from which peaks between places are looked for

/// Shares of the limits at one place; those of acceleration and jerk with their signs.
struct PlaceLoad {
  using Lanes = std::array<double, kMaxFeedLanes>;
  Lanes velocity{}, acceleration{}, jerk{};
  double feed = 0.0, turn = 0.0;
};

PlaceLoad place_load(const FeedLanes& lanes, const FeedRow& row, const std::array<double, 4>& b) {
  PlaceLoad load;
  const double root = std::sqrt(b[0]);
  const int width = lanes.width;
  const double* q = row.q.data();
  for (int l = 0; l < width; ++l) {
    const double a = q[width + l] * b[0] + 0.5 * q[l] * b[1];
    const double j = q[2 * width + l] * b[0] + 1.5 * q[width + l] * b[1] + 0.5 * q[l] * b[2];
    load.velocity[l] = std::abs(q[l]) * root * lanes.velocity[l];
    load.acceleration[l] = a * lanes.acceleration[l];
    load.jerk[l] = j * root * lanes.jerk[l];
  }
  load.feed = std::abs(row.tip) * root / row.feed;
  load.turn = std::abs(row.turn) * root * lanes.turn_rate;
  return load;
}

double most(const PlaceLoad::Lanes& values) {
  double largest = 0.0;
  for (double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

void take(FeedLoad& worst, const PlaceLoad& load) {
  worst.velocity = std::max({worst.velocity, most(load.velocity), load.feed, load.turn});
  worst.acceleration = std::max(worst.acceleration, most(load.acceleration));
  worst.jerk = std::max(worst.jerk, most(load.jerk));
}

/// Where place i is, as a share of the element.
double place_share(int i) {
  constexpr int kEven = kPlaces - 4;
  constexpr double kStep = 1.0 / (kEven - 1.0);
  if (i < 3) return 0.25 * i * kStep;
  if (i >= kPlaces - 3) return 1.0 - 0.25 * (kPlaces - 1 - i) * kStep;
  return (i - 2) * kStep;
}

/// Peaks between places: the top of the parabola through three neighbours, the middle one largest.
/// `ratio`: the second distance over the first.
double largest_top(const PlaceLoad::Lanes& before, const PlaceLoad::Lanes& at,
                   const PlaceLoad::Lanes& after, double ratio) {
  double largest = 0.0;
  for (int l = 0; l < kMaxFeedLanes; ++l) {
    const double sign = at[l] < 0.0 ? -1.0 : 1.0;
    const double p = sign * before[l], c = sign * at[l], n = sign * after[l];
    if (c < kNearPeak || c < p || c < n) continue;
    const double left = c - p, right = (n - c) / ratio;  // slopes; the first distance is 1
    const double bend = (left - right) / (1.0 + ratio),
                 slope = (left * ratio + right) / (1.0 + ratio);
    if (bend > 0.0) largest = std::max(largest, c + slope * slope / (4.0 * bend));
  }
  return largest;
}

void take_peaks(FeedLoad& worst, const std::array<PlaceLoad, 3>& last, int newest, double ratio) {
  const PlaceLoad& before = last[(newest + 1) % 3];
  const PlaceLoad& at = last[(newest + 2) % 3];
  const PlaceLoad& after = last[newest];
  worst.velocity =
      std::max(worst.velocity, largest_top(before.velocity, at.velocity, after.velocity, ratio));
  worst.acceleration =
      std::max(worst.acceleration,
               largest_top(before.acceleration, at.acceleration, after.acceleration, ratio));
  worst.jerk = std::max(worst.jerk, largest_top(before.jerk, at.jerk, after.jerk, ratio));
}

double apart(const PlaceLoad& a, const PlaceLoad& b) {
  double worst = std::max(std::abs(a.feed - b.feed), std::abs(a.turn - b.turn));
  for (int l = 0; l < kMaxFeedLanes; ++l)
    worst = std::max({worst, std::abs(a.velocity[l] - b.velocity[l]),
                      std::abs(a.acceleration[l] - b.acceleration[l]),
                      std::abs(a.jerk[l] - b.jerk[l])});
  return worst;
}

/// Goes over the places of an element.
class ElementPlaces {
 public:
  ElementPlaces(const FeedStretch& stretch, const FeedGrid& grid,
                const std::vector<double>& controls)
      : stretch_(stretch), grid_(grid), controls_(controls) {
    std::vector<double> shares;
    for (int i = 0; i < kPlaces; ++i) shares.push_back(place_share(i));
    inside_ = interpolation_weights(grid.rule.nodes, shares);
    const auto probes = probe_shares(grid.rule);
    at_probes_ = interpolation_weights(grid.rule.nodes, {probes.begin(), probes.end()});
  }

  /// Largest loads at the places and at peaks between places.
  FeedLoad largest(std::size_t e) const {
    FeedLoad worst;
    std::array<PlaceLoad, 3> last;
    int seen = 0;
    each(e, [&](double, const PlaceLoad& load) {
      take(worst, load);
      last[seen % 3] = load;
      if (++seen < 3) return;
      const double at = place_share(seen - 2);
      take_peaks(worst, last, (seen - 1) % 3,
                 (place_share(seen - 1) - at) / (at - place_share(seen - 3)));
    });
    return worst;
  }

  /// visit(w, load) at every place.
  template <class Visit>
  void each(std::size_t e, const Visit& visit) const {
    const FeedElement& element = grid_.elements[e];
    const bool plain = verified(e);
    for (int i = 0; i < kPlaces; ++i) {
      const double w = grid_.place(element, place_share(i));
      visit(w, load(e, w, plain ? interpolated(e, inside_, i) : feed_row(stretch_, element, w)));
    }
  }

 private:
  bool verified(std::size_t e) const {
    if (grid_.probes.empty()) return false;
    const auto shares = probe_shares(grid_.rule);
    bool good = true;
    for (int p = 0; p < 2; ++p) {
      const double w = grid_.place(grid_.elements[e], shares[p]);
      const PlaceLoad own = load(e, w, grid_.probes[2 * e + p]);
      good = good && apart(own, load(e, w, interpolated(e, at_probes_, p))) <= kInterpolated;
    }
    return good;
  }

  PlaceLoad load(std::size_t e, double w, const FeedRow& row) const {
    const auto b = cubic_values(grid_, controls_, e, w - grid_.elements[e].begin);
    PlaceLoad load = place_load(stretch_.lanes, row, b);
    const FeedElement& element = grid_.elements[e];
    const auto& rate = stretch_.path->rate;
    if (!rate.empty())
      load.feed = std::max(load.feed, std::abs(stretch_.map.at(w, element.zone)[1]) *
                                          std::sqrt(b[0]) / rate[element.piece]);
    return load;
  }

  FeedRow interpolated(std::size_t e, const std::vector<double>& weights, int place) const {
    const std::size_t nodes = grid_.rule.nodes.size(), size = 3 * grid_.width;
    FeedRow row;
    row.feed = stretch_.path->feed[grid_.elements[e].piece];
    for (std::size_t j = 0; j < nodes; ++j) {
      const double weight = weights[place * nodes + j];
      const std::size_t point = e * nodes + j;
      const double* q = &grid_.rows[size * point];
      for (std::size_t k = 0; k < size; ++k) row.q[k] += weight * q[k];
      row.tip += weight * grid_.tip[point];
      row.turn += weight * grid_.turn[point];
    }
    return row;
  }

  const FeedStretch& stretch_;
  const FeedGrid& grid_;
  const std::vector<double>& controls_;
  std::vector<double> inside_, at_probes_;
};

/// Joins neighbouring places with the same limit.
class BindingCollector {
 public:
  BindingCollector(int joints, double least) : joints_(joints), least_(least) {}

  void place(double s, const PlaceLoad& load) {
    for (int l = 0; l <= joints_; ++l) {
      const int joint = l == joints_ ? -1 : l;
      if (joint >= 0) see(3 * l, load.velocity[l], s, {FeedWitness::Kind::velocity, joint, s, s});
      see(3 * l + 1, std::abs(load.acceleration[l]), s,
          {FeedWitness::Kind::acceleration, joint, s, s});
      see(3 * l + 2, std::abs(load.jerk[l]), s, {FeedWitness::Kind::jerk, joint, s, s});
    }
    see(3 * joints_, load.feed, s, {FeedWitness::Kind::feed, -1, s, s});
    see(3 * joints_ + 3, load.turn, s, {FeedWitness::Kind::turn_rate, -1, s, s});
  }

  std::vector<FeedBinding> end() {
    for (const Open& open : open_)
      if (open.active) found_.push_back(open.binding);
    std::stable_sort(found_.begin(), found_.end(),
                     [](const FeedBinding& a, const FeedBinding& b) { return a.from < b.from; });
    return found_;
  }

 private:
  struct Open {
    bool active = false;
    FeedBinding binding;
  };

  void see(int slot, double load, double s, const FeedBinding& fresh) {
    Open& open = open_[slot];
    const bool now = load >= least_;
    if (now && open.active) open.binding.to = s;
    if (now && !open.active) open.binding = fresh;
    if (!now && open.active) found_.push_back(open.binding);
    open.active = now;
  }

  int joints_;
  double least_;
  std::array<Open, 3 * kMaxFeedLanes + 1> open_{};
  std::vector<FeedBinding> found_;
};

}  // namespace

std::vector<FeedLoad> element_loads(const FeedStretch& stretch, const FeedGrid& grid,
                                    const std::vector<double>& controls) {
  const ElementPlaces places(stretch, grid, controls);
  std::vector<FeedLoad> loads(grid.elements.size());
  for (std::size_t e = 0; e < loads.size(); ++e) loads[e] = places.largest(e);
  return loads;
}

void renew_loads(const FeedStretch& stretch, const FeedGrid& grid,
                 const std::vector<double>& controls, const std::vector<bool>& changed,
                 std::vector<FeedLoad>& loads) {
  const ElementPlaces places(stretch, grid, controls);
  for (std::size_t e = 0; e < loads.size(); ++e)
    if (changed[e]) loads[e] = places.largest(e);
}

std::vector<FeedBinding> feed_bindings(const FeedStretch& stretch, const FeedGrid& grid,
                                       const std::vector<double>& controls, std::size_t elements) {
  const ElementPlaces places(stretch, grid, controls);
  BindingCollector collector(stretch.lanes.joints, kBinding);
  for (std::size_t e = 0; e < elements; ++e)
    places.each(e, [&](double w, const PlaceLoad& load) {
      collector.place(stretch.from + stretch.map.at(w, grid.elements[e].zone)[0], load);
    });
  return collector.end();
}

FeedLoad largest_load(const std::vector<FeedLoad>& loads) {
  FeedLoad worst;
  for (const FeedLoad& load : loads) {
    worst.velocity = std::max(worst.velocity, load.velocity);
    worst.acceleration = std::max(worst.acceleration, load.acceleration);
    worst.jerk = std::max(worst.jerk, load.jerk);
  }
  return worst;
}

}  // namespace smoothpost
