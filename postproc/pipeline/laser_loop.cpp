#include "postproc/pipeline/laser_loop.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "kernels/core/units.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/conversion_parts.h"

namespace smoothpost {

namespace {

constexpr double kStep = 0.5;    // mm: margin for every time that a station has offended
constexpr double kLeast = 0.05;  // mm: margin where more is not to be had, as under a nozzle
constexpr int kMostCuts = 4;     // times that a station is answered by a cut
constexpr int kMostBoxes = 3;    // times that its box is narrowed
constexpr int kMostPasses = 30;
constexpr std::size_t kNeighbours = 5;
constexpr std::size_t kAround = 12;  // stations on either side of a detour
constexpr std::size_t kApart = 2;  // stations nearer to one that is answered wait for the next pass
constexpr std::size_t kMostMaps = 3;
constexpr int kMostWays = 6;
constexpr int kFinest = 8;              // pieces a station, of the graph's curves
constexpr double kLeastBox = 0.01;      // rad, half of it
constexpr double kStandoffBox = 10.0;   // mm, half of it
constexpr double kOutside = 1e-6;       // rad, of windows between stations
constexpr double kNeighbourMore = 0.3;  // by which a neighbour's cut may be harder

/// A station that is kept near the graph's way.
struct Box {
  int narrowed = 0;
};

/// A condition at a station.
struct Kept {
  std::optional<AxisCut> axis = {};
  double lower = -INFINITY, upper = INFINITY;  ///< of the standoff
  bool own = false;                            ///< not one of a neighbour's
};

class Loop {
 public:
  Loop(const ClearanceTask& task, const LoopPlanner& planner, const std::string& file_name)
      : task_(task),
        planner_(planner),
        file_name_(file_name),
        kept_(task.stations.size()),
        offences_(task.stations.size(), 0),
        boxes_(task.stations.size()) {}

  LoopOutcome run() {
    const bool by_via =
        task_.machine.recipe.orientation == "via" || task_.machine.recipe.orientation == "monotone";
    for (int pass = 0; pass < kMostPasses; ++pass) {
      const PathCheck check = checked(planner_.path());
      if (check.hits.empty()) {
        out_.report.gave_up.clear();
        const bool boxed =
            std::any_of(boxes_.begin(), boxes_.end(), [](const auto& b) { return b.has_value(); });
        out_.report.method = boxed                  ? "boxes"
                             : !via_.empty()        ? "via"
                             : out_.report.cuts > 0 ? "cuts"
                                                    : "none";
        return done(check, planner_.path());
      }
      if (pass == 0) draw_maps(check);
      out_.report.gave_up = "passes or boxes are used up";
      if (!answer(check, by_via)) break;
      if (!solved()) break;
    }
    if (!out_.problem) take_graph();
    return std::move(out_);
  }

  LoopOutcome graph() {
    take_graph();
    return std::move(out_);
  }

 private:
  /// With all conditions. Where that has no solution the programmes start from the graph's way:
  /// near the pole of the first rotary they do not find to another side of it. Then without the
  /// conditions of neighbours, then with a box at every station that has offended.
  bool solved() {
    auto problem = planner_.solve(conditions());
    if (problem && has_way()) {
      start_ = curves_of(task_, way_, task_.stations.back().u,
                         std::max(6, static_cast<int>(task_.stations.size()) /
                                         task_.machine.recipe.knot_every))
                   .rotary;
      problem = planner_.solve(conditions());
      if (problem && !own_alone_) {
        own_alone_ = true;
        problem = planner_.solve(conditions());
      }
      if (problem) {
        for (std::size_t i = 0; i < offences_.size(); ++i)
          if (offences_[i] > 0 && !boxes_[i] && !box(i)) return false;
        problem = planner_.solve(conditions());
      }
    }
    start_.reset();
    if (problem) out_.report.gave_up = problem->text;
    return !problem;
  }

  PathCheck checked(const LaserJointPath& path) {
    ++out_.report.passes;
    if (task_.scene == nullptr) return {};
    const auto [samples, u] = planner_.samples(path);
    PathCheck check = check_path(task_, samples, u);
    out_.report.queries += check.queries;
    return check;
  }

  LoopOutcome done(const PathCheck& check, const LaserJointPath& path) {
    out_.report.clear = true;
    out_.report.tightest = check.least;
    if (task_.scene != nullptr && check.least_pair != Clearance::kNoPair) {
      const ScenePair& pair = task_.scene->pairs()[check.least_pair];
      out_.report.bodies = task_.scene->bodies()[pair.first].name + " and " +
                           task_.scene->bodies()[pair.second].name;
      out_.report.line = task_.stations[station_at(check.least_u)].line;
    }
    for (std::size_t k = 0; k < mapped_.size(); ++k) {
      const LaserStation& s = task_.stations[mapped_[k]];
      const Eigen::VectorXd q = path.rotary.at(std::min(s.u, path.last()));
      out_.report.maps[k].chosen = lead_tilt_of(s, tool_axis_of(task_, {{q[0], q[1]}, 0.0}));
    }
    return std::move(out_);
  }

  std::size_t station_at(double u) const {
    const auto above =
        std::lower_bound(task_.stations.begin(), task_.stations.end(), u,
                         [](const LaserStation& s, double value) { return s.u < value; });
    if (above == task_.stations.begin()) return 0;
    if (above == task_.stations.end()) return task_.stations.size() - 1;
    const auto i = static_cast<std::size_t>(above - task_.stations.begin());
    return above->u - u <= u - task_.stations[i - 1].u ? i : i - 1;
  }

  void draw_maps(const PathCheck& check) {
    const std::size_t step = std::max<std::size_t>(1, check.hits.size() / kMostMaps);
    for (std::size_t k = 0; k < check.hits.size() && mapped_.size() < kMostMaps; k += step) {
      const std::size_t i = station_at(check.hits[k].u);
      if (!mapped_.empty() && mapped_.back() >= i) continue;
      mapped_.push_back(i);
      out_.report.maps.push_back(domain_map(task_, i));
    }
  }

  /// Draws conditions for what is not free; false: no condition can help any more.
  bool answer(const PathCheck& check, bool by_via) {
    std::map<std::size_t, WristState> asked;  // station -> where the path is
    bool free_to_move = false;
    for (const PathHit& hit : check.hits) {
      const std::size_t i = station_at(hit.u);
      if (task_.stations[i].fixed) continue;
      free_to_move = true;
      const auto near = asked.lower_bound(i - std::min(i, kApart));
      if (near != asked.end() && near->first <= i + kApart) continue;
      asked.emplace(i, wrist_of(task_, hit.q));
    }
    if (!free_to_move) return false;
    // Ways of one margin at a time.
    std::map<int, std::vector<std::size_t>> by_offence;
    for (const auto& [i, now] : asked) {
      ++offences_[i];
      if (offences_[i] <= kMostCuts)
        by_offence[offences_[i]].push_back(i);
      else if (!box(i))
        return false;
    }
    for (const auto& [times, stations] : by_offence) {
      const double margin = times * kStep;
      const std::map<std::size_t, FreeWrist> detour = detours(stations, asked, margin);
      for (std::size_t k = 0; k < stations.size(); ++k) {
        const std::size_t i = stations[k];
        const WristState now = asked.at(i);
        const auto way = detour.find(i);
        const auto target =
            way != detour.end() ? std::optional<FreeWrist>(way->second) : nearest(i, now, margin);
        if (!target) {
          offences_[i] = kMostCuts;  // the graph's cells keep less
          if (!box(i)) return false;
        } else if (by_via) {
          add_via(i, *target);
        } else {
          add_cut(i, cut_towards(task_, i, now, *target, target->margin));
        }
      }
    }
    return true;
  }

  std::optional<FreeWrist> nearest(std::size_t i, const WristState& now, double margin) {
    std::optional<FreeWrist> found;
    for (const double keeps : {margin, kLeast}) {
      const FeasibleDomain domain =
          feasible_domain(domain_problem(task_, {}, keeps), domain_place(task_, i));
      out_.report.queries += domain.queries;
      if ((found = nearest_free(task_, i, now, domain, keeps))) break;
    }
    return found;
  }

  /// Where the cheapest ways around the places that are not free lead: neighbouring stations go to
  /// the same side of what is in the way.
  std::map<std::size_t, FreeWrist> detours(const std::vector<std::size_t>& stations,
                                           const std::map<std::size_t, WristState>& asked,
                                           double margin) {
    std::map<std::size_t, FreeWrist> out;
    const LaserJointPath path = planner_.path();
    for (std::size_t k = 0; k < stations.size();) {
      std::size_t end = k + 1;
      while (end < stations.size() && stations[end] - stations[end - 1] <= kAround) ++end;
      const std::size_t first = stations[k] - std::min(stations[k], kAround);
      const std::size_t last = std::min(stations[end - 1] + kAround, task_.stations.size() - 1);
      ClearanceTask part = task_;
      part.stations.clear();
      WristGraphOptions options{1.0, {margin, kLeast}, {}};
      std::vector<double> spacing;
      for (std::size_t i = first; i <= last; ++i) {
        LaserStation s = task_.stations[i];
        const double u = std::min(s.u, path.last());
        const Eigen::VectorXd q = path.rotary.at(u);
        s.programmed = {q[0], q[1]};
        s.standoff = path.standoff.at(u)[0];
        part.stations.push_back(s);
        options.keep.push_back(asked.count(i) == 0);
        spacing.push_back(i == first ? 1.0 : (s.tip - task_.stations[i - 1].tip).norm());
      }
      const WristWay way = WristGraph(part, std::move(spacing), std::move(options)).way();
      out_.report.queries += way.queries;
      for (; k < end; ++k)
        if (!way.at.empty()) {
          const WristState& there = way.at[stations[k] - first];
          out[stations[k]] = {tool_axis_of(task_, there), there, way.margin};
        }
    }
    return out;
  }

  void add_cut(std::size_t i, const ClearanceCut& cut) {
    const std::size_t end = std::min(i + kNeighbours + 1, task_.stations.size());
    for (std::size_t k = i - std::min(i, kNeighbours); k < end; ++k) {
      if (task_.stations[k].fixed) continue;
      Kept kept;
      kept.own = k == i;
      if (cut.lower) kept.lower = *cut.lower;
      if (cut.upper) kept.upper = *cut.upper;
      if (cut.lower || cut.upper) kept_[k].push_back(kept);
      if (!cut.axis) continue;
      AxisCut here = *cut.axis;
      if (cut.arm > 0.0) {
        const double nearer =
            -cut.contact.dot(task_.stations[k].tip - task_.stations[i].tip) / cut.arm;
        here.least = std::clamp(here.least + nearer, -1.0, here.least + kNeighbourMore);
      }
      if (k != i && !possible(task_.stations[k].window, here)) continue;
      kept = {};
      kept.own = k == i;
      kept.axis = here;
      kept_[k].push_back(kept);
    }
    ++out_.report.cuts;
  }

  /// Some axis of the window is inside of the cut.
  static bool possible(const OrientationWindow& w, const AxisCut& cut) {
    for (const double lead : {w.lead_low, w.lead_high})
      for (const double tilt : {w.tilt_low, w.tilt_high}) {
        const Vec3 axis =
            (w.normal + std::tan(lead) * w.tangent + std::tan(tilt) * w.binormal).normalized();
        if (cut.normal.dot(axis) > cut.least + 1e-4) return true;
      }
    return false;
  }

  void add_via(std::size_t i, const FreeWrist& target) {
    constexpr double kSpans = 10.0;  // 2k: nearer ones are nearly dependent
    const double u = task_.stations[i].u;
    std::erase_if(via_, [u](const RotaryVia& v) { return std::abs(v.u - u) < kSpans; });
    via_.push_back({u, target.wrist.rotary});
    std::sort(via_.begin(), via_.end(),
              [](const RotaryVia& a, const RotaryVia& b) { return a.u < b.u; });
    ++out_.report.cuts;
  }

  /// The graph's way, once it is needed.
  bool has_way() {
    if (!graph_) {
      std::vector<double> spacing(task_.stations.size(), 1.0);
      for (std::size_t i = 1; i < spacing.size(); ++i)
        spacing[i] = (task_.stations[i].tip - task_.stations[i - 1].tip).norm();
      graph_.emplace(task_, std::move(spacing));
      way_ = graph_->way();
      out_.report.queries += way_.queries;
    }
    if (way_.at.empty()) tell_blocked();
    return !way_.at.empty();
  }

  bool box(std::size_t i) {
    if (!has_way()) return false;
    const std::size_t end = std::min(i + kNeighbours + 1, task_.stations.size());
    for (std::size_t k = i - std::min(i, kNeighbours); k < end; ++k) {
      if (task_.stations[k].fixed) continue;
      if (!boxes_[k]) {
        boxes_[k] = Box{};
        ++out_.report.boxes;
      } else if (k == i) {
        ++boxes_[k]->narrowed;
      }
      kept_[k].clear();
    }
    return boxes_[i]->narrowed <= kMostBoxes;
  }

  ClearanceConditions conditions() const {
    ClearanceConditions out;
    out.via = via_;
    out.start = start_;
    for (std::size_t i = 0; i < task_.stations.size(); ++i) {
      const LaserStation& s = task_.stations[i];
      out.windows.push_back(s.window);
      StandoffBound bound;
      bound.u = s.u;
      if (boxes_[i]) {
        narrow(out.windows.back(), i);
        const double half = kStandoffBox * std::pow(0.5, boxes_[i]->narrowed);
        bound.lower = way_.at[i].standoff - half;
        bound.upper = way_.at[i].standoff + half;
      } else {
        for (const Kept& kept : kept_[i]) {
          if (own_alone_ && !kept.own) continue;
          if (kept.axis) out.windows.back().cuts.push_back(*kept.axis);
          bound.lower = std::max(bound.lower, kept.lower);
          bound.upper = std::min(bound.upper, kept.upper);
        }
        if (bound.lower > bound.upper)  // contradicting ones: in their middle
          bound.lower = bound.upper = 0.5 * (bound.lower + bound.upper);
      }
      if (task_.standoff_high > task_.standoff_low &&
          (std::isfinite(bound.lower) || std::isfinite(bound.upper)) && !s.fixed)
        out.bounds.push_back(bound);
    }
    return out;
  }

  void narrow(OrientationWindow& w, std::size_t i) const {
    const Vec3 axis = tool_axis_of(task_, way_.at[i]);
    const double share = std::pow(0.5, boxes_[i]->narrowed);
    const auto limit = [&](double middle, double& low, double& high) {
      const double half = std::max(kLeastBox, 0.125 * (high - low)) * share;
      low = std::max(low, std::min(middle, high) - half);
      high = std::min(high, std::max(middle, low) + half);
    };
    const auto at = lead_tilt_of(task_.stations[i], axis);
    limit(at[0], w.lead_low, w.lead_high);
    limit(at[1], w.tilt_low, w.tilt_high);
  }

  /// The curves of the graph's way, and of others, until one is free.
  void take_graph() {
    for (int way = 0; way < kMostWays; ++way) {
      if (!has_way()) return;
      std::vector<std::size_t> near;
      const int stations = static_cast<int>(task_.stations.size());
      const double last = task_.stations.back().u;
      for (int every = 2 * task_.machine.recipe.knot_every; every > -kFinest;) {
        const int pieces = every > 0 ? stations / every : stations * -every;
        every = every > 1 ? every / 2 : every == 1 ? -2 : every * 2;
        if (pieces < 6) continue;
        LaserJointPath path = planner_.path_of(curves_of(task_, way_, last, pieces));
        if (!inside(path) || !planner_.keeps(path)) continue;
        const PathCheck check = checked(path);
        if (check.hits.empty()) {
          out_.report.method = "graph";
          LoopOutcome outcome = done(check, path);
          outcome.graph = std::move(path);
          out_ = std::move(outcome);
          return;
        }
        near.clear();
        for (const PathHit& hit : check.hits) {
          const std::size_t i = station_at(hit.u);
          near.push_back(i);
          near.push_back(hit.u > task_.stations[i].u ? std::min(i + 1, task_.stations.size() - 1)
                                                     : i - std::min<std::size_t>(i, 1));
        }
      }
      if (near.empty()) break;
      std::sort(near.begin(), near.end());
      near.erase(std::unique(near.begin(), near.end()), near.end());
      graph_->forbid(way_, near);
      forbidden_ = true;
      way_ = graph_->way();
    }
    if (out_.problem) return;
    out_.problem = diagnostic(
        "KN159",
        "the admissible orientations of neighbouring cutter locations here have no motion between "
        "them that keeps the clearances: more tolerance.lead_deg or tilt_deg, or a slower turn in "
        "the CAM, may open one",
        file_name_, static_cast<int>(task_.stations.front().line));
  }

  bool inside(const LaserJointPath& path) const {
    for (std::size_t i = 0; i < task_.stations.size(); ++i) {
      const LaserStation& s = task_.stations[i];
      if (s.fixed) continue;
      const Eigen::VectorXd q = path.rotary.at(std::min(s.u, path.last()));
      if (s.window.outside(tool_axis_of(task_, {{q[0], q[1]}, 0.0})) > kOutside) return false;
    }
    return true;
  }

  void tell_blocked() {
    const std::size_t i = std::min(way_.blocked, task_.stations.size() - 1);
    out_.problem = diagnostic(
        "KN159",
        task_.stations[i].fixed
            ? "the stretches of the cut that join here keep the programmed orientation there, and "
              "nothing leads there clear of what is beside it: round the corner in the CAM, or "
              "free "
              "the orientation"
        : way_.empty && !forbidden_ && task_.scene != nullptr
            ? why_blocked(task_, i)
            : "no motion leads to the orientations that are admissible here: more "
              "tolerance.lead_deg or tilt_deg may open one",
        file_name_, static_cast<int>(task_.stations[i].line));
  }

  const ClearanceTask& task_;
  const LoopPlanner& planner_;
  const std::string& file_name_;
  LoopOutcome out_;
  std::vector<std::vector<Kept>> kept_;  // by station
  bool own_alone_ = false;
  std::optional<SplineCurve> start_;
  std::vector<int> offences_;
  std::vector<std::optional<Box>> boxes_;
  std::vector<RotaryVia> via_;
  std::vector<std::size_t> mapped_;  // stations of the report's maps
  std::optional<WristGraph> graph_;
  bool forbidden_ = false;  // cells were taken out of it
  WristWay way_;
};

}  // namespace

LoopOutcome keep_clear(const ClearanceTask& task, const LoopPlanner& planner,
                       const std::string& file_name) {
  return Loop(task, planner, file_name).run();
}

LoopOutcome plan_by_graph(const ClearanceTask& task, const LoopPlanner& planner,
                          const std::string& file_name) {
  return Loop(task, planner, file_name).graph();
}

}  // namespace smoothpost
