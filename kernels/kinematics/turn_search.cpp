#include "kernels/kinematics/turn_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/core/units.h"

namespace smoothpost {
namespace {

constexpr double kTurn = 2.0 * kPi;
constexpr double kNever = std::numeric_limits<double>::infinity();
// Weight of the distance from where the path starts, against 1 for every later motion.
constexpr double kStartWeight = 0.01;
// Cost (rad) of having turned the first rotary one point too early in a pole run.
constexpr double kEarly = 1e-9;
// Cost (rad) of turning the first rotary on a cut into or out of a pole run that could turn
// elsewhere.
constexpr double kTurnAtRim = 0.01;
constexpr std::uint32_t kNoTable = std::numeric_limits<std::uint32_t>::max();

/// Whole turns of both rotaries, as an inclusive window.
struct Window {
  std::array<int, 2> low{0, 0};
  std::array<int, 2> high{-1, -1};

  bool empty() const { return low[0] > high[0] || low[1] > high[1]; }
  int width(int rotary) const { return high[rotary] - low[rotary] + 1; }
  std::size_t size() const {
    return empty() ? 0 : static_cast<std::size_t>(width(0)) * static_cast<std::size_t>(width(1));
  }
  std::size_t index(int n0, int n1) const {
    return static_cast<std::size_t>(n0 - low[0]) * static_cast<std::size_t>(width(1)) +
           static_cast<std::size_t>(n1 - low[1]);
  }
  void shift(const std::array<int, 2>& by) {
    for (int r = 0; r < 2; ++r) {
      low[r] += by[r];
      high[r] += by[r];
    }
  }
  bool operator==(const Window& other) const = default;
};

Window intersection(const Window& a, const Window& b) {
  Window out;
  for (int r = 0; r < 2; ++r) {
    out.low[r] = std::max(a.low[r], b.low[r]);
    out.high[r] = std::min(a.high[r], b.high[r]);
  }
  return out;
}

/// Least cost of being at one candidate, by turns. `live` is the part of `stored` that is within
/// limits.
struct Costs {
  Window stored;
  Window live;
  double offset = 0.0;
  std::vector<double> table;

  double at(int n0, int n1) const { return offset + table[stored.index(n0, n1)]; }
  bool dead() const { return live.empty(); }

  /// Narrows the live window; a window without any finite cost is dead.
  void clip(const Window& allowed) {
    const Window narrowed = intersection(live, allowed);
    if (narrowed == live) return;
    live = narrowed;
    for (int n0 = live.low[0]; n0 <= live.high[0]; ++n0)
      for (int n1 = live.low[1]; n1 <= live.high[1]; ++n1)
        if (at(n0, n1) < kNever) return;
    live = Window{};
  }
};

/// Where a state came from: candidate of the point before and its turns.
struct Choice {
  std::int32_t first_turn = 0;
  std::int16_t second_turn = 0;
  std::uint8_t candidate = 0;
};

/// How the states of one candidate came about: all from one candidate by a shift of turns, or by
/// table.
struct Origin {
  std::uint32_t table = kNoTable;
  std::int16_t shift_first = 0;
  std::int8_t shift_second = 0;
  std::uint8_t candidate = 0;
};

struct ChoiceTable {
  Window window;
  std::size_t begin = 0;
};

/// A cutting motion from one candidate to another: each rotary goes to its nearest turn.
struct CutStep {
  bool allowed = false;
  std::array<int, 2> shift{0, 0};
  double cost = 0.0;
};

class TurnSearch {
 public:
  TurnSearch(const TrackCandidates& candidates, const std::vector<TrackingPoint>& points,
             const TurnSearchSettings& settings)
      : candidates_(candidates), points_(points), settings_(settings) {}

  TurnSearchResult run() {
    origins_.resize(candidates_.candidates.size());
    begin_path();
    for (std::size_t i = 1; i < points_.size(); ++i) {
      next_.resize(layer(i).count);
      for (Costs& costs : next_) costs.live = Window{};
      if (points_[i].cut) cut_motion(i);
      if (points_[i].cut && all_dead(next_)) result_.dead_ends.push_back(dead_end(i));
      if (!points_[i].cut || all_dead(next_)) link_motion(i);
      std::swap(current_, next_);
    }
    if (result_.dead_ends.empty()) trace_back();
    return std::move(result_);
  }

 private:
  const TrackLayer& layer(std::size_t i) const { return candidates_.layers[i]; }
  const TrackCandidate& candidate(std::size_t i, std::size_t k) const {
    return candidates_.candidates[layer(i).begin + k];
  }
  static double angle(const TrackCandidate& c, int rotary) {
    return rotary == 0 ? c.first : c.second;
  }
  static bool all_dead(const std::vector<Costs>& costs) {
    return std::all_of(costs.begin(), costs.end(), [](const Costs& c) { return c.dead(); });
  }

  Window allowed_turns(const TrackCandidate& c) const {
    Window window;
    for (int r = 0; r < 2; ++r) {
      const TurnLimits& limits = settings_.rotary[r];
      const TurnRange turns = turns_within(angle(c, r), limits.lower, limits.upper);
      window.low[r] = turns.first;
      window.high[r] = turns.last;
    }
    return window;
  }

  void begin_path() {
    current_.resize(layer(0).count);
    for (std::size_t k = 0; k < current_.size(); ++k) {
      const TrackCandidate& c = candidate(0, k);
      Costs& costs = current_[k];
      if (!c.valid) continue;
      costs.stored = costs.live = allowed_turns(c);
      costs.table.resize(costs.stored.size());
      // Ahead of the first turn of a pole run: it has made that turn as a motion.
      const double weight = kStartWeight + (c.ahead ? 1.0 : 0.0);
      for (int n0 = costs.live.low[0]; n0 <= costs.live.high[0]; ++n0)
        for (int n1 = costs.live.low[1]; n1 <= costs.live.high[1]; ++n1)
          costs.table[costs.stored.index(n0, n1)] =
              weight * std::abs(c.first + kTurn * n0 - settings_.rotary[0].start) +
              kStartWeight * std::abs(c.second + kTurn * n1 - settings_.rotary[1].start);
    }
  }

  double standing_cost(std::size_t i, std::size_t k) const {
    return candidate(i, k).ahead ? kEarly : 0.0;
  }

  CutStep cut_step(std::size_t i, std::size_t p, std::size_t k) const {
    const TrackCandidate& a = candidate(i - 1, p);
    const TrackCandidate& b = candidate(i, k);
    CutStep step;
    if (!b.valid) return step;
    if (layer(i - 1).pole && layer(i).pole && a.track != b.track) return step;
    const bool rim = layer(i - 1).pole != layer(i).pole;
    const bool through = (layer(i).pole ? b : a).through;
    step.cost = standing_cost(i, k);
    for (int r = 0; r < 2; ++r) {
      const double change = angle(b, r) - angle(a, r);
      const double turns = std::round(change / kTurn);
      const double distance = std::abs(change - kTurn * turns);
      if (distance > settings_.step * (1.0 + 1e-12) + 1e-12) return step;
      step.shift[r] = -static_cast<int>(turns);
      step.cost += distance;
      if (r == 0 && rim && !through && distance > 1e-9) step.cost += kTurnAtRim;
    }
    step.allowed = true;
    return step;
  }

  void cut_motion(std::size_t i) {
    const std::size_t sources = current_.size();
    uses_.assign(sources, 0);
    steps_.assign(sources * next_.size(), CutStep{});
    for (std::size_t p = 0; p < sources; ++p) {
      if (current_[p].dead()) continue;
      for (std::size_t k = 0; k < next_.size(); ++k) {
        steps_[k * sources + p] = cut_step(i, p, k);
        if (steps_[k * sources + p].allowed) ++uses_[p];
      }
    }
    for (std::size_t k = 0; k < next_.size(); ++k) {
      sources_.clear();
      for (std::size_t p = 0; p < sources; ++p)
        if (steps_[k * sources + p].allowed) sources_.push_back({p, steps_[k * sources + p]});
      if (sources_.size() == 1) carry(i, k);
      if (sources_.size() > 1) merge(i, k);
    }
  }

  /// One source: its table goes along, moved when no other candidate needs it and nothing of it is
  /// cut off. So the states before a dead end are still there.
  void carry(std::size_t i, std::size_t k) {
    const auto& [p, step] = sources_[0];
    Costs& from = current_[p];
    const Window allowed = allowed_turns(candidate(i, k));
    Window live = from.live;
    live.shift(step.shift);
    Costs& to = next_[k];
    if (uses_[p] == 1 && intersection(live, allowed) == live)
      std::swap(to, from);
    else
      to = from;
    to.stored.shift(step.shift);
    to.live = live;
    to.offset += step.cost;
    to.clip(allowed);
    origins_[layer(i).begin + k] = {kNoTable, static_cast<std::int16_t>(step.shift[0]),
                                    static_cast<std::int8_t>(step.shift[1]),
                                    static_cast<std::uint8_t>(p)};
  }

  /// Several sources, as at a crossing of the pole: the least, turn by turn.
  void merge(std::size_t i, std::size_t k) {
    Costs& to = next_[k];
    Choice* choices = open_table(i, k, to);
    for (const auto& [p, step] : sources_) {
      const Costs& from = current_[p];
      Window window = from.live;
      window.shift(step.shift);
      window = intersection(window, to.stored);
      for (int n0 = window.low[0]; n0 <= window.high[0]; ++n0) {
        for (int n1 = window.low[1]; n1 <= window.high[1]; ++n1) {
          const int m0 = n0 - step.shift[0];
          const int m1 = n1 - step.shift[1];
          const double cost = from.at(m0, m1) + step.cost;
          const std::size_t index = to.stored.index(n0, n1);
          if (!(cost < to.table[index])) continue;
          to.table[index] = cost;
          choices[index] = {m0, static_cast<std::int16_t>(m1), static_cast<std::uint8_t>(p)};
        }
      }
    }
    revive(to);
  }

  /// Empty costs over the allowed turns of a candidate, with a table of choices.
  Choice* open_table(std::size_t i, std::size_t k, Costs& to) {
    to.stored = allowed_turns(candidate(i, k));
    to.live = Window{};
    to.offset = 0.0;
    to.table.assign(to.stored.size(), kNever);
    const std::size_t begin = choices_.size();
    choices_.resize(begin + to.stored.size());
    origins_[layer(i).begin + k].table = static_cast<std::uint32_t>(tables_.size());
    tables_.push_back({to.stored, begin});
    return choices_.data() + begin;
  }

  static void revive(Costs& to) {
    if (std::any_of(to.table.begin(), to.table.end(), [](double c) { return c < kNever; }))
      to.live = to.stored;
  }

  /// Any candidate and turn to any other.
  void link_motion(std::size_t i) {
    for (std::size_t k = 0; k < next_.size(); ++k) {
      Costs& to = next_[k];
      to.live = Window{};
      if (!candidate(i, k).valid) continue;
      Choice* choices = open_table(i, k, to);
      for (std::size_t p = 0; p < current_.size(); ++p) {
        const Costs& from = current_[p];
        for (int m1 = from.live.low[1]; !from.dead() && m1 <= from.live.high[1]; ++m1)
          for (int n1 = to.stored.low[1]; n1 <= to.stored.high[1]; ++n1)
            sweep({i, p, k, m1, n1}, from, to, choices);
      }
      const double standing = standing_cost(i, k);
      for (double& cost : to.table) cost += standing;
      revive(to);
    }
  }

  struct Sweep {
    std::size_t point;
    std::size_t from;
    std::size_t to;
    int from_second;
    int to_second;
  };

  /// to(n) ← min(to(n), min over m of from(m) + |Δq|) over the first rotary's turns, for one pair
  /// of the second's: upward for sources below the target, downward for those above.
  void sweep(const Sweep& s, const Costs& from, Costs& to, Choice* choices) const {
    const TrackCandidate& a = candidate(s.point - 1, s.from);
    const TrackCandidate& b = candidate(s.point, s.to);
    const double second =
        std::abs(b.second + kTurn * s.to_second - a.second - kTurn * s.from_second);
    for (const int direction : {1, -1}) {
      int m = direction > 0 ? from.live.low[0] : from.live.high[0];
      const int m_end = (direction > 0 ? from.live.high[0] : from.live.low[0]) + direction;
      int n = direction > 0 ? to.stored.low[0] : to.stored.high[0];
      const int n_end = (direction > 0 ? to.stored.high[0] : to.stored.low[0]) + direction;
      double best = kNever;
      Choice choice{0, static_cast<std::int16_t>(s.from_second), static_cast<std::uint8_t>(s.from)};
      for (; n != n_end; n += direction) {
        const double target = direction * (b.first + kTurn * n);
        for (; m != m_end && direction * (a.first + kTurn * m) <= target; m += direction) {
          const double reduced = from.at(m, s.from_second) - direction * (a.first + kTurn * m);
          if (!(reduced < best)) continue;
          best = reduced;
          choice.first_turn = m;
        }
        const double cost = best + target + second;
        const std::size_t index = to.stored.index(n, s.to_second);
        if (!(cost < to.table[index])) continue;
        to.table[index] = cost;
        choices[index] = choice;
      }
    }
  }

  struct State {
    std::size_t candidate = 0;
    std::array<int, 2> turns{0, 0};
    double cost = kNever;
  };

  State best_state(const std::vector<Costs>& all) const {
    State best;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const Costs& costs = all[k];
      if (costs.dead()) continue;
      for (int n0 = costs.live.low[0]; n0 <= costs.live.high[0]; ++n0)
        for (int n1 = costs.live.low[1]; n1 <= costs.live.high[1]; ++n1)
          if (costs.at(n0, n1) < best.cost) best = {k, {n0, n1}, costs.at(n0, n1)};
    }
    return best;
  }

  std::array<double, 2> values(std::size_t i, const State& state) const {
    const TrackCandidate& c = candidate(i, state.candidate);
    return {c.first + kTurn * state.turns[0], c.second + kTurn * state.turns[1]};
  }

  DeadEnd dead_end(std::size_t i) const {
    const State before = best_state(current_);
    return {i, before.candidate, values(i - 1, before)};
  }

  void trace_back() {
    result_.candidate.resize(points_.size());
    result_.rotary.resize(points_.size());
    State state = best_state(current_);
    result_.cost = state.cost;
    for (std::size_t i = points_.size(); i-- > 0;) {
      result_.candidate[i] = state.candidate;
      result_.rotary[i] = values(i, state);
      if (i == 0) break;
      const Origin& origin = origins_[layer(i).begin + state.candidate];
      if (origin.table == kNoTable) {
        state.candidate = origin.candidate;
        state.turns[0] -= origin.shift_first;
        state.turns[1] -= origin.shift_second;
      } else {
        const ChoiceTable& table = tables_[origin.table];
        const Choice& choice =
            choices_[table.begin + table.window.index(state.turns[0], state.turns[1])];
        state.candidate = choice.candidate;
        state.turns = {choice.first_turn, choice.second_turn};
      }
    }
  }

  struct Source {
    std::size_t candidate;
    CutStep step;
  };

  const TrackCandidates& candidates_;
  const std::vector<TrackingPoint>& points_;
  const TurnSearchSettings& settings_;
  TurnSearchResult result_;
  std::vector<Costs> current_;
  std::vector<Costs> next_;
  std::vector<int> uses_;       ///< how many candidates a source leads to
  std::vector<CutStep> steps_;  ///< from candidate p to candidate k, at k · sources + p
  std::vector<Source> sources_;
  std::vector<Origin> origins_;  ///< by candidate
  std::vector<ChoiceTable> tables_;
  std::vector<Choice> choices_;
};

}  // namespace

TurnSearchResult search_turns(const TrackCandidates& candidates,
                              const std::vector<TrackingPoint>& points,
                              const TurnSearchSettings& settings) {
  return TurnSearch(candidates, points, settings).run();
}

}  // namespace smoothpost
