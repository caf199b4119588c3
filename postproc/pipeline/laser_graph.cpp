#include "postproc/pipeline/laser_graph.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "kernels/spline/polygon_curve.h"
#include "postproc/pipeline/clearance_check.h"

namespace smoothpost {

namespace {

constexpr GridSize kGraphGrid{9, 9, 5};
constexpr std::size_t kChunk = 32;      // stations whose domains are in memory at once
constexpr double kStandoffShare = 0.1;  // of it, what a standoff off the programmed one counts
constexpr int kPoleAngles = 24;
constexpr double kAtPole = 1e-6;    // rad
constexpr double kLeastWay = 1e-3;  // mm

}  // namespace

WristGraph::WristGraph(const ClearanceTask& task, std::vector<double> spacing,
                       WristGraphOptions options)
    : task_(task), spacing_(std::move(spacing)), options_(std::move(options)) {
  for (double& s : spacing_) s = std::max(s, kLeastWay);
}

void WristGraph::add_turns(std::size_t station, const JointVector& q, bool at_pole) {
  const LaserStation& s = task_.stations[station];
  const WristState state = wrist_of(task_, q);
  const int joints[] = {task_.pair.first_rotary(), task_.pair.second_rotary()};
  std::vector<double> turns[2];
  for (std::size_t c = 0; c < 2; ++c) {
    const ChainJoint& joint = task_.machine.axes[static_cast<std::size_t>(joints[c])].joint;
    const bool any = at_pole && c == 0;
    const double step = any ? 2.0 * kPi / kPoleAngles : 2.0 * kPi;
    const double first = std::ceil((joint.lower - state.rotary[c]) / step - 1e-12);
    for (double k = first; state.rotary[c] + k * step <= joint.upper + 1e-12; ++k)
      turns[c].push_back(std::clamp(state.rotary[c] + k * step, joint.lower, joint.upper));
  }
  const Vec3 axis = tool_axis_of(task_, state);
  const Vec3 programmed = tool_axis_of(task_, {s.programmed, 0.0});
  WristNode n;
  n.standoff = state.standoff;
  n.cost = options_.node_share * (wrist_weights(task_, station).arm * (axis - programmed).norm() +
                                  kStandoffShare * std::abs(state.standoff - s.standoff));
  for (const double first : turns[0])
    for (const double second : turns[1]) {
      n.rotary = {first, second};
      layers_[station].push_back(n);
    }
}

void WristGraph::add_cells(std::size_t station, const FeasibleDomain& domain,
                           const DomainProblem& problem) {
  queries_ += domain.queries;
  const DomainPlace place = domain_place(task_, station);
  const double pole = wrist_weights(task_, station).pole;
  for (std::size_t k = 0; k < domain.cells.size(); ++k) {
    if (domain.cells[k].verdict != CellVerdict::free) continue;
    const DomainIndex at = domain.index(k);
    const auto q = domain_joints(problem, place, at);
    if (!q) continue;
    const bool at_pole = std::abs(std::sin((*q)[task_.pair.second_rotary()] - pole)) < kAtPole;
    if (at_pole && at.branch == 1) continue;  // both are the same there
    add_turns(station, *q, at_pole);
  }
}

// A margin below 0: whether it is free or not.
void WristGraph::add_programmed(std::size_t station, double margin) {
  const LaserStation& s = task_.stations[station];
  WristNode n;
  n.rotary = s.programmed;
  n.standoff = s.standoff;
  if (margin >= 0.0) {
    const auto q = joints_of(task_, station, {n.rotary, n.standoff});
    if (!q || !is_free(task_, *q, margin)) return;
  }
  layers_[station].push_back(n);
}

void WristGraph::build(double margin) {
  layers_.assign(task_.stations.size(), {});
  margin_ = margin;
  const DomainProblem problem = domain_problem(task_, kGraphGrid, margin);
  for (std::size_t first = 0; first < layers_.size(); first += kChunk) {
    const std::size_t end = std::min(first + kChunk, layers_.size());
    std::vector<DomainPlace> places;
    for (std::size_t i = first; i < end; ++i) places.push_back(domain_place(task_, i));
    const auto domains = feasible_domains(problem, places);
    for (std::size_t i = first; i < end; ++i) {
      if (!task_.stations[i].fixed) {
        add_cells(i, domains[i - first], problem);
        if (i < options_.keep.size() && options_.keep[i]) add_programmed(i, margin);
        continue;
      }
      add_programmed(i, -1.0);
    }
  }
}

WristWay WristGraph::way() {
  WristWay out;
  RouteSettings settings;
  settings.squared = 1.0;
  if (!task_.stations.empty()) settings.weights = wrist_weights(task_, 0);
  const auto search = [&] {
    const WristRoute route = best_route(layers_, settings, spacing_);
    out.blocked = route.blocked;
    out.empty = route.blocked < layers_.size() && layers_[route.blocked].empty();
    out.margin = margin_;
    for (std::size_t i = 0; i < route.node.size(); ++i) {
      const WristNode& n = layers_[i][route.node[i]];
      out.at.push_back({n.rotary, n.standoff});
    }
    return !out.at.empty();
  };
  bool found = margin_ >= 0.0 && search();
  if (margin_ < 0.0)
    for (const double margin : options_.margins) {
      build(margin);
      if ((found = search())) break;
    }
  out.queries = queries_;
  return out;
}

void WristGraph::forbid(const WristWay& way, const std::vector<std::size_t>& stations) {
  for (const std::size_t i : stations) {
    if (task_.stations[i].fixed) continue;
    std::erase_if(layers_[i], [&](const WristNode& n) {
      return n.rotary == way.at[i].rotary && n.standoff == way.at[i].standoff;
    });
  }
}

WristCurves curves_of(const ClearanceTask& task, const WristWay& way, double last, int pieces) {
  SplineKnots knots = clamped_knots(5, pieces);
  for (double& u : knots.values) u = u == pieces ? last : u * last / pieces;
  std::vector<double> u;
  Eigen::MatrixXd wrist(3, static_cast<Eigen::Index>(way.at.size()));
  for (std::size_t k = 0; k < way.at.size(); ++k) {
    u.push_back(task.stations[k].u);
    wrist.col(static_cast<Eigen::Index>(k)) << way.at[k].rotary[0], way.at[k].rotary[1],
        way.at[k].standoff;
  }
  const SplineCurve curve = polygon_curve(knots, u, wrist);
  WristCurves out{{knots, curve.controls.topRows(2)}, {knots, curve.controls.bottomRows(1)}};
  return out;
}

}  // namespace smoothpost
