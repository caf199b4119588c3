#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "kernels/core/contract.h"
#include "kernels/optimise/redundancy.h"

namespace smoothpost {

namespace {

constexpr double kSlack = 1e-9;  // of limits, mm or rad
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kNone = -1;

/// What keeps a node from being used.
struct Breach {
  int joint = -1;  // −1: out of reach
  double excess = kNever;
};

class GlobalSearch {
 public:
  GlobalSearch(const RedundantPath& path, const std::vector<double>& stations,
               const GlobalSettings& settings)
      : path_(path), stations_(stations), settings_(settings) {
    require(stations.size() >= 2 && std::is_sorted(stations.begin(), stations.end()),
            "stations ascend");
    const Eigen::Index n = settings.near.size();
    require(n > 0 && settings.weight.size() == n && settings.lower.size() == n &&
                settings.upper.size() == n,
            "one weight, limit and start a joint");
    require(settings.grid > 0.0 && settings.free_upper >= settings.free_lower &&
                settings.most_steps >= 1,
            "a range and a grid of the free joint");
    // The grid passes through the start, and with it through the end of a change.
    anchor_ = settings.start.value_or(settings.free_lower);
    grid_ = settings.grid;
    if (settings.change && std::abs(*settings.change) > 0.5 * grid_)
      grid_ = std::abs(*settings.change) / std::round(std::abs(*settings.change) / grid_);
    const double below = (anchor_ - settings.free_lower) / grid_;
    const double above = (settings.free_upper - anchor_) / grid_;
    require(below >= -kSlack && above >= -kSlack, "the start is inside the range");
    start_ = static_cast<int>(std::floor(below + kSlack));
    columns_ = start_ + static_cast<int>(std::floor(above + kSlack)) + 1;
    require(static_cast<double>(columns_) * static_cast<double>(stations.size()) < 5e7,
            "too many nodes: a coarser grid or fewer stations");
    steps_ = settings.change ? static_cast<int>(std::lround(*settings.change / grid_)) : 0;
  }

  GlobalResolution run() {
    make_nodes();
    GlobalResolution out;
    for (std::size_t i = 0; i < stations_.size(); ++i)
      if (!has_node(i)) return out_of_limits(i);
    for (int round = 1;; ++round) {
      out = choose();
      out.rounds = round;
      if (out.status != GlobalResolution::Status::ok) {
        if (round > 1) out.status = GlobalResolution::Status::blocked;
        return out;
      }
      if (!settings_.clear || all_clear(out)) return out;
      if (round >= settings_.most_rounds) {
        out.status = GlobalResolution::Status::blocked;
        return out;
      }
    }
  }

 private:
  std::size_t node(std::size_t station, int column) const {
    return station * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }
  double free_of(int column) const { return anchor_ + (column - start_) * grid_; }

  void make_nodes() {
    q_.resize(stations_.size() * static_cast<std::size_t>(columns_));
    open_.assign(q_.size(), false);
    nearest_.assign(stations_.size(), Breach{});
    for (std::size_t i = 0; i < stations_.size(); ++i)
      for (int c = 0; c < columns_; ++c) {
        const auto q = path_.joints(stations_[i], free_of(c), settings_.near);
        if (!q) continue;
        const Breach breach = breach_of(*q);
        if (breach.excess > kSlack) {
          if (breach.excess < nearest_[i].excess) nearest_[i] = breach;
          continue;
        }
        q_[node(i, c)] = *q;
        open_[node(i, c)] = true;
      }
  }

  Breach breach_of(const JointVector& q) const {
    Breach worst{-1, -kNever};
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const double excess = std::max(settings_.lower[j] - q[j], q[j] - settings_.upper[j]);
      if (excess > worst.excess) worst = {static_cast<int>(j), excess};
    }
    return worst;
  }

  bool has_node(std::size_t station) const {
    for (int c = 0; c < columns_; ++c)
      if (open_[node(station, c)]) return true;
    return false;
  }

  GlobalResolution out_of_limits(std::size_t station) const {
    GlobalResolution out;
    out.status = GlobalResolution::Status::out_of_limits;
    out.failed = stations_[station];
    out.joint = nearest_[station].joint;
    out.excess = nearest_[station].excess;
    return out;
  }

  double step_cost(const JointVector& a, const JointVector& b, double h) const {
    double sum = 0.0;
    for (Eigen::Index j = 0; j < a.size(); ++j)
      sum += settings_.weight[j] * (b[j] - a[j]) * (b[j] - a[j]);
    return sum / h;
  }

  /// The best way from the columns of `starts` to those of `ends`; kNone: any.
  GlobalResolution way(int starts, int ends) {
    const auto n = static_cast<std::size_t>(columns_);
    std::vector<double> cost(n, kNever), next(n);
    std::vector<std::int16_t> from(stations_.size() * n, 0);
    for (int c = 0; c < columns_; ++c)
      if (open_[node(0, c)] && (starts == kNone || c == starts))
        cost[static_cast<std::size_t>(c)] = 0.0;
    GlobalResolution out;
    out.failed = stations_.front();
    if (*std::min_element(cost.begin(), cost.end()) == kNever) return out;
    for (std::size_t i = 1; i < stations_.size(); ++i) {
      const double h = std::max(stations_[i] - stations_[i - 1], 1e-9);
      std::fill(next.begin(), next.end(), kNever);
      bool any = false;
      for (int c = 0; c < columns_; ++c) {
        if (!open_[node(i, c)]) continue;
        const JointVector& here = q_[node(i, c)];
        for (int d = -settings_.most_steps; d <= settings_.most_steps; ++d) {
          const int b = c + d;
          if (b < 0 || b >= columns_ || cost[static_cast<std::size_t>(b)] == kNever) continue;
          const double sum =
              cost[static_cast<std::size_t>(b)] + step_cost(q_[node(i - 1, b)], here, h);
          if (sum >= next[static_cast<std::size_t>(c)]) continue;
          next[static_cast<std::size_t>(c)] = sum;
          from[node(i, c)] = static_cast<std::int16_t>(d);
          any = true;
        }
      }
      std::swap(cost, next);
      if (!any) {
        out.failed = stations_[i];
        return out;
      }
    }
    int best = ends;
    if (best == kNone)
      best = static_cast<int>(std::min_element(cost.begin(), cost.end()) - cost.begin());
    out.failed = stations_.back();
    if (cost[static_cast<std::size_t>(best)] == kNever) return out;
    out.status = GlobalResolution::Status::ok;
    out.cost = cost[static_cast<std::size_t>(best)];
    out.free.resize(stations_.size());
    out.q.resize(stations_.size());
    columns_of_.resize(stations_.size());
    for (std::size_t i = stations_.size(); i-- > 0;) {
      out.free[i] = free_of(best);
      out.q[i] = q_[node(i, best)];
      columns_of_[i] = best;
      best += from[node(i, best)];
    }
    return out;
  }

  GlobalResolution choose() {
    if (settings_.start) {
      const int end = start_ + steps_;
      if (settings_.change && (end < 0 || end >= columns_)) {
        GlobalResolution out;
        out.failed = stations_.back();
        return out;
      }
      return way(start_, settings_.change ? end : kNone);
    }
    GlobalResolution free = way(kNone, kNone);
    if (!settings_.change || free.status != GlobalResolution::Status::ok) return free;
    const int first = columns_of_.front();
    const int last = columns_of_.back();
    GlobalResolution best;
    best.failed = stations_.back();
    std::vector<int> columns;
    const auto attempt = [&](int start) {
      const int end = start + steps_;
      if (start < 0 || start >= columns_ || end < 0 || end >= columns_) return;
      GlobalResolution closed = way(start, end);
      if (closed.status != GlobalResolution::Status::ok) return;
      if (best.status == GlobalResolution::Status::ok && closed.cost >= best.cost) return;
      best = std::move(closed);
      columns = columns_of_;
    };
    attempt(first);
    if (last - steps_ != first) attempt(last - steps_);
    for (int c = 0; best.status != GlobalResolution::Status::ok && c < columns_; ++c) attempt(c);
    columns_of_ = columns;
    return best;
  }

  // Closes the chosen nodes that are not clear.
  bool all_clear(GlobalResolution& out) {
    bool clear = true;
    for (std::size_t i = 0; i < stations_.size(); ++i) {
      if (settings_.clear(stations_[i], out.q[i])) continue;
      if (clear) out.failed = stations_[i];
      clear = false;
      open_[node(i, columns_of_[i])] = false;
    }
    return clear;
  }

  const RedundantPath& path_;
  const std::vector<double>& stations_;
  const GlobalSettings& settings_;
  double anchor_ = 0.0, grid_ = 1.0;
  int start_ = 0;  // column of the anchor
  int columns_ = 0;
  int steps_ = 0;  // of the grid, from start to end
  std::vector<JointVector> q_;
  std::vector<bool> open_;
  std::vector<Breach> nearest_;
  std::vector<int> columns_of_;  // of the last way
};

}  // namespace

GlobalResolution resolve_globally(const RedundantPath& path, const std::vector<double>& stations,
                                  const GlobalSettings& settings) {
  return GlobalSearch(path, stations, settings).run();
}

}  // namespace smoothpost
