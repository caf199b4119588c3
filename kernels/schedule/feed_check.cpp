#include "kernels/schedule/feed_check.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unordered_map>

#include "kernels/schedule/feed_places.h"

namespace smoothpost {
namespace {

constexpr int kPlaces = 44;  // of an element: 40 evenly, and two more in the first and in
                             // the last interval
constexpr double kInterpolated = 1e-6;  // apart, as shares of the limits
constexpr int kFinerNodes = 13;         // of an element whose rows five do not give
constexpr double kBinding = 0.99;

/// Where place i is, as a share of the element.
double place_share(int i) {
  constexpr int kEven = kPlaces - 4;
  constexpr double kStep = 1.0 / (kEven - 1.0);
  if (i < 3) return 0.25 * i * kStep;
  if (i >= kPlaces - 3) return 1.0 - 0.25 * (kPlaces - 1 - i) * kStep;
  return (i - 2) * kStep;
}

/// Shares of the limits at places of an element: of the lanes as rows_to_loads() leaves them, of
/// feed (or rate) and turn rate.
struct PlaceLoads {
  std::vector<double> shares;  // where, of the element
  std::vector<PlaceValues> at;
  std::vector<double> lanes, feed, turn;

  void clear() {
    lanes.clear();
    feed.clear();
    turn.clear();
  }
};

/// Rows at nodes of an element, with first derivatives of tip and turning.
struct NodeRows {
  int nodes = 0;
  const double *rows = nullptr, *tip = nullptr, *turn = nullptr;
};

/// Rows of an element on nodes of its own.
struct OwnRows {
  std::vector<double> rows, tip, turn;
};

double farthest(const std::vector<double>& a, const std::vector<double>& b) {
  double apart = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) apart = std::max(apart, std::abs(a[k] - b[k]));
  return apart;
}

}  // namespace

/// Evaluates the places of elements, one after the other.
class FeedCheck::Places {
 public:
  Places(const FeedStretch& stretch, const FeedGrid& grid)
      : stretch_(stretch), grid_(grid), finer_rule_(lobatto_rule(kFinerNodes)) {
    for (int i = 0; i < kPlaces; ++i) places_.shares.push_back(place_share(i));
    const auto probes = probe_shares(grid.rule);
    own_.shares = near_.shares = {probes.begin(), probes.end()};
    inside_ = interpolation_weights(grid.rule.nodes, places_.shares);
    at_probes_ = interpolation_weights(grid.rule.nodes, own_.shares);
    finer_inside_ = interpolation_weights(finer_rule_.nodes, places_.shares);
    finer_at_probes_ = interpolation_weights(finer_rule_.nodes, own_.shares);
  }

  void set_law(const std::vector<double>& controls) { controls_ = &controls; }

  /// Largest loads at the places and at peaks between places.
  FeedLoad largest(std::size_t e) {
    const PlaceLoads& loads = at(e);
    FeedLoad worst = largest_loads(grid_.width, loads.shares, loads.lanes.data());
    for (int i = 0; i < kPlaces; ++i)
      worst.velocity = std::max({worst.velocity, loads.feed[i], loads.turn[i]});
    return worst;
  }

  /// The loads of an element, until the next call.
  const PlaceLoads& at(std::size_t e) {
    fill(e);
    to_loads(e, places_);
    return places_;
  }

 private:
  std::size_t row_size() const { return 3 * static_cast<std::size_t>(grid_.width); }

  /// Rows at the places, from as few evaluations as they need.
  void fill(std::size_t e) {
    const std::size_t nodes = grid_.rule.nodes.size(), first = e * nodes;
    if (grid_.probes.empty()) return evaluate(e, places_);
    const NodeRows given{static_cast<int>(nodes), &grid_.rows[row_size() * first],
                         &grid_.tip[first], &grid_.turn[first]};
    if (verified(e, given, at_probes_)) return interpolate(given, inside_, places_);
    if (nodes >= kFinerNodes) return evaluate(e, places_);
    const OwnRows& own = finer_of(e);
    const NodeRows finer{kFinerNodes, own.rows.data(), own.tip.data(), own.turn.data()};
    if (verified(e, finer, finer_at_probes_)) return interpolate(finer, finer_inside_, places_);
    evaluate(e, places_);
  }

  const OwnRows& finer_of(std::size_t e) {
    const auto [at, fresh] = finer_.try_emplace(e);
    OwnRows& own = at->second;
    if (!fresh) return own;
    for (double node : finer_rule_.nodes) {
      const FeedElement& element = grid_.elements[e];
      take(feed_row(stretch_, element, grid_.place(element, node)), own.rows, own.tip, own.turn);
    }
    return own;
  }

  bool verified(std::size_t e, const NodeRows& from, const std::vector<double>& weights) {
    own_.clear();
    for (std::size_t p = 0; p < own_.shares.size(); ++p)
      take(grid_.probes[own_.shares.size() * e + p], own_.lanes, own_.feed, own_.turn);
    interpolate(from, weights, near_);
    to_loads(e, own_);
    to_loads(e, near_);
    return farthest(own_.lanes, near_.lanes) <= kInterpolated &&
           farthest(own_.feed, near_.feed) <= kInterpolated &&
           farthest(own_.turn, near_.turn) <= kInterpolated;
  }

  void take(const FeedRow& row, std::vector<double>& rows, std::vector<double>& tip,
            std::vector<double>& turn) const {
    rows.insert(rows.end(), row.q.begin(), row.q.begin() + static_cast<std::ptrdiff_t>(row_size()));
    tip.push_back(row.tip);
    turn.push_back(row.turn);
  }

  void evaluate(std::size_t e, PlaceLoads& out) const {
    const FeedElement& element = grid_.elements[e];
    out.clear();
    for (double share : out.shares)
      take(feed_row(stretch_, element, grid_.place(element, share)), out.lanes, out.feed, out.turn);
  }

  void interpolate(const NodeRows& from, const std::vector<double>& weights,
                   PlaceLoads& out) const {
    const std::size_t count = out.shares.size(), nodes = static_cast<std::size_t>(from.nodes);
    out.lanes.resize(count * row_size());
    interpolate_rows({grid_.width, from.nodes, static_cast<int>(count), weights.data()}, from.rows,
                     out.lanes.data());
    out.feed.assign(count, 0.0);
    out.turn.assign(count, 0.0);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j < nodes; ++j) {
        out.feed[i] += weights[i * nodes + j] * from.tip[j];
        out.turn[i] += weights[i * nodes + j] * from.turn[j];
      }
  }

  /// What evaluate() or interpolate() left (rows, and first derivatives of tip and turning) becomes
  /// loads.
  void to_loads(std::size_t e, PlaceLoads& out) const {
    const FeedElement& element = grid_.elements[e];
    const std::array<double, 4> c = cubic_of(grid_, *controls_, e);
    const auto& rate = stretch_.path->rate;
    const double feed = stretch_.path->feed[element.piece];
    out.at.clear();
    for (std::size_t i = 0; i < out.shares.size(); ++i) {
      const double w = grid_.place(element, out.shares[i]), d = w - element.begin;
      const double b = c[0] + d * (c[1] + d * (c[2] + d * c[3])), root = std::sqrt(b);
      out.at.push_back(
          {b, c[1] + d * (2.0 * c[2] + d * 3.0 * c[3]), 2.0 * c[2] + 6.0 * d * c[3], root});
      out.feed[i] = std::abs(out.feed[i]) * root / feed;
      out.turn[i] = std::abs(out.turn[i]) * root * stretch_.lanes.turn_rate;
      if (!rate.empty())
        out.feed[i] = std::max(out.feed[i], std::abs(stretch_.map.at(w, element.zone)[1]) * root /
                                                rate[element.piece]);
    }
    rows_to_loads(stretch_.lanes, out.at, out.lanes.data());
  }

  const FeedStretch& stretch_;
  const FeedGrid& grid_;
  const std::vector<double>* controls_ = nullptr;
  LobattoRule finer_rule_;
  std::vector<double> inside_, at_probes_, finer_inside_, finer_at_probes_;
  std::unordered_map<std::size_t, OwnRows> finer_;
  PlaceLoads places_, own_, near_;
};

namespace {

/// Joins neighbouring places with the same limit.
class BindingCollector {
 public:
  BindingCollector(const FeedStretch& stretch, const FeedGrid& grid)
      : stretch_(stretch), grid_(grid) {}

  void element(std::size_t e, const PlaceLoads& loads) {
    const int joints = stretch_.lanes.joints, width = grid_.width;
    const std::size_t step = 3 * static_cast<std::size_t>(width);
    const double* lanes = loads.lanes.data();
    for (int l = 0; l <= joints; ++l) {
      const int joint = l == joints ? -1 : l;
      if (joint >= 0) see(e, {3 * l, joint, FeedWitness::Kind::velocity}, lanes + l, step);
      see(e, {3 * l + 1, joint, FeedWitness::Kind::acceleration}, lanes + width + l, step);
      see(e, {3 * l + 2, joint, FeedWitness::Kind::jerk}, lanes + 2 * width + l, step);
    }
    see(e, {3 * joints, -1, FeedWitness::Kind::feed}, loads.feed.data(), 1);
    see(e, {3 * joints + 3, -1, FeedWitness::Kind::turn_rate}, loads.turn.data(), 1);
  }

  std::vector<FeedBinding> end() {
    for (const Open& open : open_)
      if (open.active) found_.push_back(open.binding);
    const auto key = [](const FeedBinding& b) { return std::tuple(b.from, b.to, b.kind, b.joint); };
    std::sort(found_.begin(), found_.end(),
              [&key](const FeedBinding& a, const FeedBinding& b) { return key(a) < key(b); });
    return std::move(found_);
  }

 private:
  struct Open {
    bool active = false;
    FeedBinding binding;
  };
  struct Limit {
    int slot = 0, joint = -1;
    FeedWitness::Kind kind = FeedWitness::Kind::none;
  };

  double s_at(std::size_t e, int place) const {
    const FeedElement& element = grid_.elements[e];
    const double w = grid_.place(element, place_share(place));
    return stretch_.from + stretch_.map.at(w, element.zone)[0];
  }

  /// One limit's loads at the places of an element, `step` numbers apart.
  void see(std::size_t e, const Limit& limit, const double* loads, std::size_t step) {
    Open& open = open_[limit.slot];
    int last = -1;  // where a binding that goes on was met last
    for (int i = 0; i < kPlaces; ++i) {
      const bool now = std::abs(loads[step * static_cast<std::size_t>(i)]) >= kBinding;
      if (now && !open.active) {
        const double s = s_at(e, i);
        open.binding = {limit.kind, limit.joint, s, s};
      }
      if (!now && open.active) {
        if (last >= 0) open.binding.to = s_at(e, last);
        found_.push_back(open.binding);
      }
      open.active = now;
      last = now ? i : -1;
    }
    if (last >= 0) open.binding.to = s_at(e, last);
  }

  const FeedStretch& stretch_;
  const FeedGrid& grid_;
  std::array<Open, 3 * kMaxFeedLanes + 1> open_{};
  std::vector<FeedBinding> found_;
};

}  // namespace

FeedCheck::FeedCheck(const FeedStretch& stretch, const FeedGrid& grid)
    : stretch_(stretch), grid_(grid), places_(std::make_unique<Places>(stretch, grid)) {}

FeedCheck::~FeedCheck() = default;

std::vector<FeedLoad> FeedCheck::loads(const std::vector<double>& controls) {
  std::vector<FeedLoad> loads(grid_.elements.size());
  renew(controls, std::vector<bool>(loads.size(), true), loads);
  return loads;
}

void FeedCheck::renew(const std::vector<double>& controls, const std::vector<bool>& changed,
                      std::vector<FeedLoad>& loads) {
  places_->set_law(controls);
  for (std::size_t e = 0; e < loads.size(); ++e)
    if (changed[e]) loads[e] = places_->largest(e);
}

std::vector<FeedBinding> FeedCheck::bindings(const std::vector<double>& controls,
                                             std::size_t elements) {
  places_->set_law(controls);
  BindingCollector collector(stretch_, grid_);
  for (std::size_t e = 0; e < elements; ++e) collector.element(e, places_->at(e));
  return collector.end();
}

std::vector<FeedLoad> element_loads(const FeedStretch& stretch, const FeedGrid& grid,
                                    const std::vector<double>& controls) {
  return FeedCheck(stretch, grid).loads(controls);
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
