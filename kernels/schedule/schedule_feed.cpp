#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "kernels/core/contract.h"
#include "kernels/schedule/feed_law.h"
#include "kernels/schedule/feed_profile.h"
#include "kernels/schedule/feed_survey.h"
#include "kernels/schedule/stretch_solver.h"

namespace smoothpost {
namespace {

constexpr double kInside = 1e-4;      // share by which limits are lowered where nothing is dilated
constexpr double kSlope = 0.003;      // by which they sink along a window
constexpr int kMovingPoints = 13;     // an element, where nothing is dilated
constexpr int kTightenings = 6;       // from rest to rest
constexpr int kMovingGrids = 3;       // each of half the elements' size, from a moving start
constexpr double kWindowShare = 8.0;  // look-aheads of a window, at the speed of the survey

void check(const FeedPath& path, const FeedSettings& settings) {
  require(path.breaks.size() >= 2 && path.breaks.size() == path.feed.size() + 1,
          "FeedPath: two breaks or more, a feed for each piece");
  require(path.rate.empty() || path.rate.size() == path.feed.size(),
          "FeedPath: no rates or one for each piece");
  for (std::size_t i = 0; i + 1 < path.breaks.size(); ++i)
    require(path.breaks[i] < path.breaks[i + 1], "FeedPath: breaks ascend");
  require(path.jet != nullptr, "FeedPath: a jet");
  require(settings.element_time > 0.0 && settings.least_elements > 0 && settings.margin >= 0.0 &&
              settings.look_ahead > 0.0,
          "FeedSettings: positive");
}

FeedLoad larger(const FeedLoad& a, const FeedLoad& b) {
  return {std::max(a.velocity, b.velocity), std::max(a.acceleration, b.acceleration),
          std::max(a.jerk, b.jerk)};
}

/// One schedule on its way: the windows done, and the one that is planned ahead.
class Schedule {
 public:
  Schedule(const FeedPath& path, const FeedLimits& limits, const FeedSettings& settings)
      : path_(path), limits_(limits), settings_(settings), lanes_(FeedLanes::from(limits)) {}

  FeedResult run(const FeedEnd& start, const FeedEnd& end, const Progress& progress) {
    survey_ = survey(path_, limits_, settings_.smooth_share);
    result_.status = survey_.status;
    result_.witness = survey_.witness;
    if (survey_.status != FeedStatus::solved) return result_;
    state_ = start;
    end_ = end;
    at_ = path_.breaks.front();
    windowed_ = needs_windows();
    // Iterations ask on all threads; only the caller's hears progress.
    going_ = [this, &progress, caller = std::this_thread::get_id()] {
      if (!cancelled_ && std::this_thread::get_id() == caller &&
          !progress("feed schedule", share_done()))
        cancelled_ = true;
      return !cancelled_;
    };
    bool going = progress("feed schedule", 0.0) && plan_first();
    while (going && plan_ && plan_->stretch.to < path_.breaks.back())
      going = !cancelled_ && progress("feed schedule", share_done()) && advance();
    going = going && !cancelled_;
    if (cancelled_ || (!going && result_.status == FeedStatus::solved))
      result_.status = FeedStatus::cancelled;
    if (!going || !plan_) return refused();
    commit(plan_->law.grid.elements.size());
    result_.profile = FeedProfile(std::make_shared<const FeedLaw>(std::move(whole_)));
    progress("feed schedule", 1.0);
    return std::move(result_);
  }

 private:
  struct Plan {
    FeedStretch stretch;
    StretchLaw law;
  };

  bool needs_windows() const {
    const double elements =
        std::max(survey_.slow.back() / settings_.element_time, 1.0 * path_.pieces());
    return 5.0 * elements > static_cast<double>(settings_.window_points);
  }

  double share_done() const {
    return (at_ - path_.breaks.front()) / (path_.breaks.back() - path_.breaks.front());
  }

  FeedResult refused() {
    FeedResult none;
    none.status = result_.status;
    none.witness = result_.witness;
    none.iterations = result_.iterations;
    none.windows = result_.windows;
    return none;
  }

  /// The end of a window that starts at s.
  double window_end(double s) const {
    if (!windowed_) return path_.breaks.back();
    const double size = kWindowShare * settings_.look_ahead;
    const double now = survey_.time(path_, s);
    if (survey_.slow.back() - now < 1.5 * size) return path_.breaks.back();
    return std::min(path_.breaks.back(), survey_.place(path_, now + size));
  }

  StretchSettings stretch_settings(bool moving, bool last) const {
    StretchSettings result;
    result.element_time = settings_.element_time;
    result.least_elements = settings_.least_elements;
    result.tightenings = settings_.tighten ? (moving ? 2 : kTightenings) : 0;
    if (moving) {
      result.points = kMovingPoints;
      result.lower = kInside;
    }
    if (!last) {
      result.points = kMovingPoints;
      result.lower = kInside;
      result.slope = kSlope;
    }
    return result;
  }

  /// The law from a state to the end of a window, at rest there unless the path ends; nothing when
  /// none was found that keeps the limits.
  std::optional<Plan> window(double s, const FeedEnd& state) {
    Plan plan;
    plan.stretch = {&path_, lanes_, s, window_end(s), {}};
    FeedStretch& stretch = plan.stretch;
    stretch.going = &going_;
    const bool last = stretch.to >= path_.breaks.back();
    const FeedEnd goal = last ? end_ : FeedEnd{};
    stretch.map = RestMap(stretch.to - s, grading(path_, limits_, survey_, {s, stretch.to}),
                          {state.rest, goal.rest});
    ++result_.windows;
    const bool moving = !state.rest || !goal.rest;
    StretchSettings settings = stretch_settings(moving, last);
    if (!moving) {
      plan.law = solve_resting(stretch, settings);
      result_.raw = larger(result_.raw, plan.law.load());
      const double c = plan.law.dilation() * (1.0 + settings_.margin);
      result_.dilation = std::max(result_.dilation, c);
      dilate(plan.law, c);
      result_.iterations += plan.law.iterations;
      return plan;
    }
    // A state of a law that uses its limits up may have a way on that the first grid is too coarse
    // for.
    for (int grid = 0; grid < kMovingGrids; ++grid) {
      plan.law =
          solve_moving(stretch, {moving_end(stretch, state), moving_end(stretch, goal)}, settings);
      result_.iterations += plan.law.iterations;
      if (plan.law.converged && plan.law.load().largest() <= 1.0) {
        result_.raw = larger(result_.raw, plan.law.load());
        return plan;
      }
      settings.element_time *= 0.5;
    }
    return std::nullopt;
  }

  /// The first window. From a given speed there is nothing to fall back on.
  bool plan_first() {
    plan_ = window(at_, state_);
    if (!plan_) {
      result_.status = FeedStatus::cannot_keep_speed;
      result_.witness.s = state_.rest ? path_.breaks.back() : at_;
      result_.witness.value = state_.rest ? end_.speed : state_.speed;
    }
    return plan_.has_value();
  }

  /// Takes a part of the plan and plans on from there: from a look-ahead before its end, where no
  /// plan is found later, at last from its stop.
  bool advance() {
    const StretchLaw& law = plan_->law;
    std::vector<double> left(law.grid.elements.size() + 1, 0.0);  // time to the plan's end
    for (std::size_t e = law.grid.elements.size(); e-- > 0;) {
      const FeedElement& element = law.grid.elements[e];
      const double size = element.end - element.begin;
      const double b = cubic_values(law.grid, law.controls, e, 0.5 * size)[0];
      left[e] = left[e + 1] + size / std::sqrt(b);
    }
    for (double part : {1.0, 0.7, 0.5, 0.35}) {
      std::size_t e = law.grid.elements.size();
      while (e > 1 && left[e - 1] < part * settings_.look_ahead) --e;
      if (--e < 1) continue;
      const FeedEnd state = state_at(e);
      auto next = window(place_at(e), state);
      if (!next) continue;
      return go_on(e, std::move(next));
    }
    const std::size_t all = law.grid.elements.size();
    return go_on(all, window(plan_->stretch.to, FeedEnd{}));
  }

  bool go_on(std::size_t elements, std::optional<Plan> next) {
    if (!next) {  // a given speed at the end of the path
      result_.status = FeedStatus::cannot_keep_speed;
      result_.witness.s = path_.breaks.back();
      result_.witness.value = end_.speed;
      return false;
    }
    commit(elements);
    plan_ = std::move(next);
    at_ = plan_->stretch.from;
    return true;
  }

  double place_at(std::size_t e) const {
    const FeedElement& element = plan_->law.grid.elements[e];
    return plan_->stretch.from + plan_->stretch.map.at(element.begin, element.zone)[0];
  }

  FeedEnd state_at(std::size_t e) const {
    const FeedElement& element = plan_->law.grid.elements[e];
    const auto phi = plan_->stretch.map.at(element.begin, element.zone);
    const auto b = cubic_values(plan_->law.grid, plan_->law.controls, e, 0.0);
    return {false, phi[1] * std::sqrt(b[0]), phi[2] * b[0] + 0.5 * phi[1] * b[1]};
  }

  void commit(std::size_t elements) {
    const StretchLaw& law = plan_->law;
    if (law.constant) result_.status = FeedStatus::constant_map;
    LawPart part = law_part(plan_->stretch, law.grid, law.controls, elements);
    if (!whole_.parts.empty()) shift_times(part, whole_.parts.back().end_time());
    whole_.parts.push_back(std::move(part));
    for (std::size_t e = 0; e < elements; ++e) result_.load = larger(result_.load, law.loads[e]);
    result_.elements += static_cast<int>(elements);
    const auto bindings = FeedCheck(plan_->stretch, law.grid).bindings(law.controls, elements);
    result_.bindings.insert(result_.bindings.end(), bindings.begin(), bindings.end());
  }

  const FeedPath& path_;
  const FeedLimits& limits_;
  const FeedSettings& settings_;
  FeedLanes lanes_;
  FeedSurvey survey_;
  FeedEnd state_, end_;
  double at_ = 0.0;  ///< the start of the plan
  bool windowed_ = false;
  std::function<bool()> going_;
  std::atomic<bool> cancelled_ = false;
  std::optional<Plan> plan_;
  FeedLaw whole_;
  FeedResult result_;
};

}  // namespace

FeedResult schedule_feed(const FeedPath& path, const FeedLimits& limits, const FeedEnd& start,
                         const FeedEnd& end, const FeedSettings& settings,
                         const Progress& progress) {
  check(path, settings);
  for (const FeedEnd& given : {start, end})
    require(given.rest || (given.speed > 0.0 && std::isfinite(given.acceleration)),
            "FeedEnd: a speed above 0 unless at rest");
  return Schedule(path, limits, settings).run(start, end, progress);
}

}  // namespace smoothpost
