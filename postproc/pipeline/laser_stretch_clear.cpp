#include "postproc/pipeline/laser_stretch.h"

// How a stretch is kept clear of what is beside it: what laser_loop.h has to know of it.
namespace smoothpost {

ClearanceTask StretchPlanner::clearance_task() const {
  ClearanceTask task{.scene = in_.laser.scene, .machine = machine_, .pair = in_.laser.pair};
  for (const std::size_t i : cutter_stations()) {
    LaserStation s;
    s.u = grid_.u[i];
    s.tip = grid_.location[i].tip;
    s.window = window(grid_, i);
    s.programmed = grid_.programmed[i];
    s.standoff = base_[first_sample_].q[head_.standoff];
    s.line = path_.line(grid_.s[i]);
    task.stations.push_back(std::move(s));
  }
  task.stations.front().fixed = !in_.range.starts_cut;
  task.stations.back().fixed = !in_.range.ends_cut;
  task.held = base_[first_sample_].q;
  const StandoffOptions o = standoff_options(1.0);
  task.standoff_low = standoff_is_held() ? task.held[head_.standoff] : o.lower;
  task.standoff_high = standoff_is_held() ? task.held[head_.standoff] : o.upper;
  task.tool_length = tool_length();
  return task;
}

LoopPlanner StretchPlanner::loop_planner() {
  LoopPlanner p;
  p.solve = [this](const ClearanceConditions& conditions) -> std::optional<Diagnostic> {
    conditions_ = conditions;
    if (conditions.start) near_ = conditions.start;
    if (auto problem = solve_at_best_feed()) return problem;
    return keeps_to_input(joint_path(standoff_)) ? std::optional<Diagnostic>{} : not_smooth();
  };
  p.path = [this] { return joint_path(standoff_); };
  p.path_of = [this](const WristCurves& curves) {
    LaserJointPath path = joint_path(curves.standoff);
    path.rotary = curves.rotary;
    return path;
  };
  p.samples = [this](const LaserJointPath& path) {
    LaserSamples samples = sampled(path);
    return LoopPlanner::Samples{std::move(samples.samples), std::move(samples.u)};
  };
  p.keeps = [this](const LaserJointPath& path) { return keeps_to_input(path); };
  return p;
}

std::optional<Diagnostic> StretchPlanner::stay_clear(PlannedLaserStretch& out) {
  const bool graph = machine_.recipe.orientation == "graph";
  if (graph || in_.laser.scene != nullptr) {
    const ClearanceTask task = clearance_task();
    const LaserJointPath before = joint_path(standoff_);
    const double feed = feed_;
    const LaserStretch report = report_;
    const LoopPlanner planner = loop_planner();
    LoopOutcome outcome = graph ? plan_by_graph(task, planner, in_.laser.file_name)
                                : keep_clear(task, planner, in_.laser.file_name);
    if (graph && outcome.problem) return outcome.problem;
    out.not_clear = std::move(outcome.problem);
    if (out.not_clear) {  // as it was
      report_ = report;
      report_.clear = std::move(outcome.report);
      feed_ = feed;
      out.path = before;
      return {};
    }
    report_.clear = std::move(outcome.report);
    if (outcome.graph) {
      report_.slowed_by.clear();
      report_.slowed_lines.clear();
      std::erase_if(report_.qp, [](const QpReport& qp) { return qp.name != "smooth"; });
      out.path = std::move(*outcome.graph);
      return {};
    }
  }
  out.path = joint_path(standoff_);
  return {};
}

}  // namespace smoothpost
