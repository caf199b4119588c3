#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "kernels/core/result.h"
#include "postproc/pipeline/laser_clearance.h"
#include "postproc/pipeline/laser_graph.h"
#include "postproc/pipeline/laser_joint_path.h"

namespace smoothpost {

/// What a stretch's planner does for the loop.
struct LoopPlanner {
  /// Solves rotaries and standoff again; a reason when there is no solution.
  std::function<std::optional<Diagnostic>(const ClearanceConditions&)> solve;
  /// The path of the last solution.
  std::function<LaserJointPath()> path;
  /// The path of given splines in place of it.
  std::function<LaserJointPath(const WristCurves&)> path_of;
  /// What the blocks of a path will be.
  struct Samples {
    std::vector<JointSample> samples;
    std::vector<double> u;
  };
  std::function<Samples(const LaserJointPath&)> samples;
  /// Whether a path keeps to the input but for its clearances: tolerances of tip and tool axis.
  std::function<bool(const LaserJointPath&)> keeps;
};

/// How a stretch was kept clear, for the report.
struct ClearanceLoopReport {
  std::string method;      ///< "" (no bodies) | none (nothing to do) | cuts | boxes | via | graph
  int passes = 0;          ///< checks of the whole stretch
  int cuts = 0;            ///< half-spaces and bounds of the standoff that were drawn
  int boxes = 0;           ///< stations that were boxed around the graph's way
  bool clear = false;      ///< every motion is proven free
  std::string gave_up;     ///< why the graph had to take over; empty: it had not
  double tightest = 0.0;   ///< mm beyond the clearance, at the ends of motions; as far as below 100
  std::string bodies;      ///< "casing and part": of the tightest place; empty: none below 100 mm
  std::uint32_t line = 0;  ///< of the tightest place
  std::size_t queries = 0;      ///< pairs that were searched, for checks and domains
  std::vector<DomainMap> maps;  ///< of the first places that were not free, three at most
};

struct LoopOutcome {
  ClearanceLoopReport report;
  std::optional<LaserJointPath> graph;  ///< takes the place of the last solution
  std::optional<Diagnostic> problem;    ///< KN159: it is not free, and why
};

/// Keeps a stretch clear of everything in the scene.
///
/// Rotaries and standoff have been solved. Then, again and again: every motion between its samples
/// is checked (check_path). Around those that are not free the cheapest way from the path and back
/// to it is looked for through the domains (WristGraph; where there is none the nearest free wrist
/// coordinates), with a margin of 0.5 mm for every time that a station has offended, or what can be
/// had. The half-space of the tool axis or bound of the standoff that leads there (cut_towards) is
/// kept at the station and at five on both sides, on their own tips, and rotaries and standoff are
/// solved anew; when that has no solution, from the graph's way through the whole stretch, then
/// without the neighbours' conditions. A station that offends for the fifth time is boxed with its
/// neighbours: its window is narrowed to a cell around the graph's way, halved each time it offends
/// again. When all of that has no solution the stretch takes the graph's way itself (curves_of)
/// with more and more pieces until it is free, and another way where it is not. With orientation
/// "via", via points take the place of cuts. It ends: a station offends a limited number of times,
/// passes are limited to 30, and ways to 6.
///
/// What it says is free has been proven motion by motion; the certificate of the whole program is
/// made anew from its text (clearance_check.h).
/// KN159: a station has no admissible cell, or the cells have no way through; the planner's last
/// solution is then of no use.
/// Implements the loop of [Ding2025] §2.4-2.5. Differences from the paper: half-spaces in place of
/// via points, whose insertion makes jerk and deviation explode (docs/equations.md).
LoopOutcome keep_clear(const ClearanceTask& task, const LoopPlanner& planner,
                       const std::string& file_name);

/// The graph's way alone: what recipe.orientation = "graph" plans. With no scene it is the way of
/// least turning inside of the tolerances.
LoopOutcome plan_by_graph(const ClearanceTask& task, const LoopPlanner& planner,
                          const std::string& file_name);

}  // namespace smoothpost
