#include "postproc/pipeline/laser_stretch.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/core/units.h"
#include "kernels/kinematics/inverse.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/orientation_check.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kDense = 0.25;       // of the stations' distance: nearer segment ends are passed
constexpr int kLeastPieces = 6;       // of a stretch that is worth splines of its own
constexpr double kBackOff = 1.003;    // of the least time: at it the programmes have one point
constexpr double kSame = 1e-4;        // of a feed
constexpr double kSlower = 1.01;      // when rotaries and standoff do not agree on a feed
constexpr double kMuchSlower = 1.05;  // when a programme does not say how much
constexpr int kMostFeeds = 16;
constexpr double kLeastKept = 0.05;  // share of a tolerance that is left after its margin
// Of the orientation's freedom, for the turn of the tangent between stations.
constexpr double kTurnMargin = 0.1 * kRadiansPerDegree;
constexpr int kMeasures = 8;  // places a piece where peaks are looked for

double nan_free(double numerator, double limit) { return limit > 0.0 ? numerator / limit : 0.0; }

std::string text_of(double value) {
  std::string text = std::to_string(value);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

const char* level_name(int level) {
  constexpr const char* kNames[] = {"position", "velocity", "acceleration", "jerk"};
  return kNames[level];
}

RateLimits limits_by_parameter(const AxisDefinition& axis, double share, double rate) {
  return {axis.velocity * share / rate, axis.acceleration * share / (rate * rate),
          axis.jerk * share / (rate * rate * rate)};
}

/// By how much a motion has to slow down so that this derivative keeps its limit.
double time_of(double value, const RateLimits& l, int order) {
  switch (order) {
    case 1:
      return nan_free(value, l.velocity);
    case 2:
      return std::sqrt(nan_free(value, l.acceleration));
    default:
      return std::cbrt(nan_free(value, l.jerk));
  }
}

}  // namespace

StretchPlanner::StretchPlanner(StretchInput input, const std::vector<JointSample>& base)
    : in_(input),
      machine_(input.laser.machine),
      base_(base),
      path_(input.laser.reference, input.range),
      head_(input.head) {
  const auto before = [](const JointSample& s, std::uint32_t segment) {
    return s.segment < segment;
  };
  const auto first = std::lower_bound(base.begin(), base.end(), in_.range.first, before);
  const auto end = std::lower_bound(base.begin(), base.end(), in_.range.last + 1, before);
  first_sample_ = static_cast<std::size_t>(first - base.begin());
  end_sample_ = static_cast<std::size_t>(end - base.begin());
  // The start of the stretch is the sample before; where the stretch starts its cut it is ours too.
  if (first_sample_ > 0) --first_sample_;
  head_.tip -= tool_length() * head_.tool_axis;
  settings_.hybrid = machine_.recipe.solver == "hybrid";
  settings_.solver.solver = machine_.recipe.solver == "banded" ? QpSolver::banded : QpSolver::ipopt;
}

bool StretchPlanner::worth_it() const {
  return path_.length() >= kLeastPieces * path_.spacing() && end_sample_ > first_sample_ + 1 &&
         path_.feed() > 0.0 && std::isfinite(path_.feed());
}

Result<PlannedLaserStretch> StretchPlanner::run() {
  using Failure = Result<PlannedLaserStretch>;
  if (!fit_any()) return Failure::failure(not_smooth());
  if (auto problem = solve_any()) return Failure::failure(*problem);
  PlannedLaserStretch out;
  if (auto problem = stay_clear(out)) return Failure::failure(*problem);
  if (may_alternate(out)) alternate(out);
  sample(out);
  report_.first = in_.range.first;
  report_.last = in_.range.last;
  report_.length = path_.length();
  report_.feed = feed_;
  report_.programmed_feed = path_.feed();
  report_.control_points = out.path.rotary.knots.controls();
  report_.normal_from_part = in_.frames.from_part();
  out.report = std::move(report_);
  return Failure(std::move(out));
}

std::optional<Diagnostic> StretchPlanner::solve_at_best_feed() {
  report_.slowed_by.clear();
  report_.slowed_lines.clear();
  if (auto problem = find_feed()) return problem;
  return settle();
}

// By the programmes; with "graph" only what they would be given.
std::optional<Diagnostic> StretchPlanner::solve_any() {
  const bool graph = machine_.recipe.orientation == "graph";
  for (int round = 0;; ++round) {
    if (graph) {
      feed_ = path_.feed();
      rotary_ = {grid_.knots, Eigen::MatrixXd::Zero(2, grid_.knots.controls())};
      standoff_ = held_standoff();
      report_.qp.clear();
      for (const QpSolution& s : tip_.solutions) tell("smooth", s);
    } else if (auto problem = solve_at_best_feed()) {
      return problem;
    }
    if (keeps_to_input(joint_path(standoff_), graph)) return {};
    // Something of the input lies between the stations: once more with closer ones.
    if (round > 0 || !fit(0.25 * path_.spacing(), 4, true)) return not_smooth();
  }
}

Diagnostic StretchPlanner::not_smooth() const {
  const auto& t = machine_.tolerance;
  return diagnostic(
      "KN153",
      "tip and tool axis cannot be smoothed here inside " +
          text_of(t.tip * (t.budget.merge + t.budget.smoothing)) + " mm and " +
          text_of(degrees_from_radians(t.axis * (t.budget.merge + t.budget.smoothing))) +
          " deg (the merge and smoothing shares of the tolerances) with " +
          std::to_string(grid_.knots.controls()) +
          " control points: round the corner in the CAM, or give it more tolerance",
      in_.laser.file_name, static_cast<int>(path_.line(length_at(tip_.place))));
}

// At every point of the input and in the middles between the stations.
bool StretchPlanner::keeps_to_input(const LaserJointPath& ours, bool tip_alone) const {
  const auto& t = machine_.tolerance;
  // What sample_path() leaves.
  const double share = 1.0 - 0.85 * t.budget.chord - t.budget.rounding;
  const bool kept = !orientation_is_free(machine_) && !tip_alone;
  std::vector<double> places;
  for (std::uint32_t k = in_.range.first; k <= in_.range.last; ++k)
    places.push_back(path_.end_of(k));
  for (std::size_t i = 1; i < grid_.s.size(); ++i)
    places.push_back(0.5 * (grid_.s[i - 1] + grid_.s[i]));
  return std::all_of(places.begin(), places.end(), [&](double s) {
    const PathPlace at = path_.place(s);
    const CutterLocation input = in_.laser.reference.at(at.segment, at.s);
    const CutterLocation tool = ours.tool(std::min(ours.last(), ours.parameter_at(s)));
    return (input.tip - tool.tip).norm() <= share * t.tip &&
           (!kept || (input.axis - tool.axis).norm() <= share * t.axis);
  });
}

// ---- stations

StretchPlanner::Grid StretchPlanner::grid(double spacing, int every) const {
  Grid g;
  const double pieces = std::ceil(path_.length() / (spacing * every) - 1e-6);
  const int spans = std::max(kLeastPieces, static_cast<int>(pieces));
  g.knots = clamped_knots(5, spans);
  // The ends of the input's segments, as far as they are not too dense, and places between.
  double from = 0.0;
  g.s.push_back(0.0);
  for (std::uint32_t k = in_.range.first; k <= in_.range.last; ++k) {
    const double to = path_.end_of(k);
    if (to - from < kDense * spacing && k < in_.range.last) continue;
    const int parts = std::max(1, static_cast<int>(std::ceil((to - from) / spacing - 1e-6)));
    for (int j = 1; j <= parts; ++j)
      g.s.push_back(j == parts ? to : from + (to - from) * j / parts);
    from = to;
  }
  for (const double s : g.s) {
    g.u.push_back(std::min<double>(spans, s / path_.length() * spans));
    const PathPlace at = path_.place(s);
    g.location.push_back(in_.laser.reference.at(at.segment, at.s));
  }
  return g;
}

// As few control points as the tip's tolerance allows.
bool StretchPlanner::fit_any() {
  const double spacing = path_.spacing();
  // Two stations a cutter location: between two of them the input is straight, a spline is not.
  for (int k = machine_.recipe.knot_every; k >= 1; k /= 2)
    if (fit(0.5 * spacing, 2 * k)) return true;
  return fit(0.25 * spacing, 2) || fit(0.125 * spacing, 2) || fit(0.0625 * spacing, 2, true);
}

bool StretchPlanner::fit(double spacing, int every, bool explain) {
  grid_ = grid(spacing, every);
  near_.reset();
  here_.reset();
  TipFitProblem p;
  p.knots = grid_.knots;
  p.u = grid_.u;
  for (const CutterLocation& location : grid_.location) p.points.push_back(location.tip);
  const auto& t = machine_.tolerance;
  p.tolerance = 0.95 * t.tip * (t.budget.merge + t.budget.smoothing);
  // Its certificate says enough: no limit of a joint hangs on this programme.
  p.hybrid = false;
  p.solver = settings_.solver;
  if (settings_.hybrid) p.solver.solver = QpSolver::banded;
  p.explain = explain;
  tip_ = fit_tip(p);
  if (tip_.failed >= 0) return false;
  seed_rotaries(grid_);
  return true;
}

// Of the programmed axis, on the branch and turn of the base plan at the start. On a pole the first
// rotary is where it was, and at the end where the base plan, and so what comes next, has it.
void StretchPlanner::seed_rotaries(Grid& g) const {
  const ScrewChain& chain = in_.laser.pair.chain();
  const std::optional<Inverse> inverse = Inverse::from(chain);
  JointVector near = base_[first_sample_].q;
  for (const CutterLocation& location : g.location) {
    Pose tip = Pose::Identity();
    if (&location == &g.location.back()) near = base_[end_sample_ - 1].q;
    tip.translation() = location.tip;
    tip.linear() =
        Eigen::Quaterniond::FromTwoVectors(chain.tool_axis, location.axis).toRotationMatrix();
    near = inverse->nearest(holder_pose(chain, tip, tool_length()), near).value_or(near);
    g.programmed.push_back(
        {near[in_.laser.pair.first_rotary()], near[in_.laser.pair.second_rotary()]});
  }
}

// The normals of a part in triangles step from facet to facet: how far, to the stations around.
double StretchPlanner::normal_step(const Grid& g, std::size_t i, const Vec3& normal) const {
  if (!in_.frames.from_part()) return 0.0;
  double step = 0.0;
  for (const std::size_t k : {i - std::min<std::size_t>(i, 1), std::min(i + 1, g.s.size() - 1)})
    step = std::max(step, angle_between(in_.frames.at(path_.place(g.s[k])).normal, normal));
  return step;
}

OrientationWindow StretchPlanner::window(const Grid& g, std::size_t i) const {
  const auto& t = machine_.tolerance;
  OrientationWindow w;
  w.u = g.u[i];
  double lead = t.axis * (t.budget.merge + t.budget.smoothing) / std::sqrt(2.0), tilt = lead;
  if (orientation_is_free(machine_)) {
    const CuttingFrame frame = in_.frames.at(path_.place(g.s[i]));
    w.normal = frame.normal;
    w.tangent = frame.tangent;
    w.binormal = frame.binormal;
    // What rounding, chords and the turn of T between samples take of the freedom.
    const double margin = kTurnMargin + t.axis;
    double free_tilt = std::max(t.tilt, t.axis);
    if (t.exit_edge && machine_.workpiece.thickness > 0.0)
      free_tilt = std::min(free_tilt, std::atan(*t.exit_edge / machine_.workpiece.thickness));
    lead = std::max(kLeastKept * t.axis, std::max(t.lead, t.axis) - margin);
    tilt = std::max(kLeastKept * t.axis, free_tilt - margin);
    w.lead_low = frame.programmed.lead - lead;
    w.lead_high = frame.programmed.lead + lead;
    w.tilt_low = frame.programmed.tilt - tilt;
    w.tilt_high = frame.programmed.tilt + tilt;
    if (machine_.tool.gap > 0.0 && machine_.tool.land_radius > 0.0)
      w.widest =
          largest_beam_angle(machine_.tool.gap, machine_.tool.land_radius, machine_.tool.min_gap) -
          margin - normal_step(g, i, frame.normal);
    return w;
  }
  w.normal = g.location[i].axis;
  w.tangent = w.normal.unitOrthogonal();
  w.binormal = w.normal.cross(w.tangent);
  w.lead_low = w.tilt_low = -lead;
  w.lead_high = w.tilt_high = lead;
  return w;
}

// ---- programmes

RotaryProblem StretchPlanner::rotary_problem() const {
  RotaryProblem p;
  p.chain = &in_.laser.pair.chain();
  p.joints = {in_.laser.pair.first_rotary(), in_.laser.pair.second_rotary()};
  p.held = base_[first_sample_].q;
  p.knots = grid_.knots;
  for (std::size_t c = 0; c < 2; ++c) {
    const AxisDefinition& axis = machine_.axes[static_cast<std::size_t>(p.joints[c])];
    p.lower[c] = axis.joint.lower;
    p.upper[c] = axis.joint.upper;
    p.limits[c] =
        limits_by_parameter(axis, machine_.tolerance.limit_share, law_ ? 1.0 : rate_of(feed_));
  }
  p.law = law_;
  p.rest_at_ends = !law_;  // the law has the rest
  const std::string& mode = machine_.recipe.orientation;
  p.monotone = mode == "monotone";
  if (mode == "via" || mode == "monotone") {
    p.via = vias();
  } else {
    const std::vector<std::size_t> stations = cutter_stations();
    for (std::size_t k = 0; k < stations.size(); ++k) {
      const std::size_t i = stations[k];
      p.windows.push_back(conditions_.windows.empty() ? window(grid_, i) : conditions_.windows[k]);
      if (near_) {
        const Eigen::VectorXd q = near_->at(grid_.u[i]);
        p.seed.push_back({q[0], q[1]});
      } else {
        p.seed.push_back(grid_.programmed[i]);
      }
    }
    add_end_vias(p.via);
  }
  return p;
}

// Stations as far apart as the cutter locations.
std::vector<std::size_t> StretchPlanner::cutter_stations() const {
  std::vector<std::size_t> list;
  double last = -INFINITY;
  for (std::size_t i = 0; i < grid_.u.size(); ++i) {
    if (grid_.s[i] - last < 0.9 * path_.spacing() && i + 1 < grid_.u.size()) continue;
    last = grid_.s[i];
    list.push_back(i);
  }
  return list;
}

void StretchPlanner::add_end_vias(std::vector<RotaryVia>& via) const {
  if (!in_.range.starts_cut) via.push_back({grid_.u.front(), grid_.programmed.front()});
  if (!in_.range.ends_cut) via.push_back({grid_.u.back(), grid_.programmed.back()});
}

std::vector<RotaryVia> StretchPlanner::vias() const {
  std::vector<RotaryVia> list;
  for (const std::size_t i : via_stations()) list.push_back({grid_.u[i], grid_.programmed[i]});
  add_loop_vias(list);
  return list;
}

// Those of the clearance loop take the place of nearer ones, but for the ends'.
void StretchPlanner::add_loop_vias(std::vector<RotaryVia>& via) const {
  const double near = grid_.knots.degree + 1.0;
  for (const RotaryVia& v : conditions_.via) {
    if (v.u - grid_.u.front() < near || grid_.u.back() - v.u < near) continue;
    std::erase_if(via, [&](const RotaryVia& old) {
      return std::abs(old.u - v.u) < near && old.u > grid_.u.front() && old.u < grid_.u.back();
    });
    via.push_back(v);
  }
  std::sort(via.begin(), via.end(),
            [](const RotaryVia& a, const RotaryVia& b) { return a.u < b.u; });
}

// As the recipe says (mm along the cut), or where the programmed axis leaves great circles between
// via points by more than the freedom it has.
std::vector<std::size_t> StretchPlanner::via_stations() const {
  std::vector<std::size_t> list{0, grid_.s.size() - 1};
  if (!machine_.recipe.via.empty()) {
    double before = 0.0;
    for (std::uint32_t k = in_.frames.first(); k < in_.range.first; ++k)
      before += in_.laser.reference.length(k);
    for (const double mm : machine_.recipe.via) {
      const double s = mm - before;
      if (s <= 0.0 || s >= path_.length()) continue;
      const auto at = std::lower_bound(grid_.s.begin(), grid_.s.end(), s - 1e-9);
      list.push_back(static_cast<std::size_t>(at - grid_.s.begin()));
    }
  } else {
    const auto& t = machine_.tolerance;
    const double allowed = std::max(t.axis, 0.2 * std::min(t.lead, t.tilt));
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, grid_.s.size() - 1}};
    while (!open.empty()) {
      const auto [a, b] = open.back();
      open.pop_back();
      double worst = allowed;
      std::size_t at = 0;
      for (std::size_t i = a + 1; i < b; ++i) {
        const double share = (grid_.s[i] - grid_.s[a]) / (grid_.s[b] - grid_.s[a]);
        const double off =
            angle_between(great_circle(grid_.location[a].axis, grid_.location[b].axis, share),
                          grid_.location[i].axis);
        if (off > worst) {
          worst = off;
          at = i;
        }
      }
      if (at == 0) continue;
      list.push_back(at);
      open.push_back({a, at});
      open.push_back({at, b});
    }
  }
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  // Two via points on the pieces of one control point are nearly dependent: the later one stays
  // out.
  std::vector<std::size_t> kept;
  for (const std::size_t i : list)
    if (kept.empty() || grid_.u[i] - grid_.u[kept.back()] >= grid_.knots.degree + 1.0)
      kept.push_back(i);
  kept.back() = grid_.s.size() - 1;
  return kept;
}

bool StretchPlanner::standoff_is_held() const {
  return machine_.standoff.axis.empty() || machine_.standoff.following == Following::exclusive;
}

SplineCurve StretchPlanner::held_standoff() const {
  SplineCurve q6{grid_.knots, Eigen::MatrixXd(1, grid_.knots.controls())};
  q6.controls.setConstant(base_[first_sample_].q[head_.standoff]);
  return q6;
}

StandoffOptions StretchPlanner::standoff_options(double rate) const {
  StandoffOptions o;
  o.law = law_;
  o.rest_at_ends = !law_;
  if (law_) rate = 1.0;
  const double share = machine_.tolerance.limit_share;
  const AxisDefinition& axis = machine_.axes[static_cast<std::size_t>(head_.standoff)];
  const double reserve =
      machine_.standoff.following == Following::none ? 0.0 : machine_.standoff.reserve;
  o.lower = axis.joint.lower + reserve;
  o.upper = axis.joint.upper - reserve;
  o.standoff = limits_by_parameter(axis, share, rate);
  for (std::size_t i = 0; i < 3; ++i)
    o.linear[i] =
        limits_by_parameter(machine_.axes[static_cast<std::size_t>(head_.linear[i])], share, rate);
  o.solver = settings_.solver;
  o.hybrid = settings_.hybrid;
  o.start = o.end = std::clamp(base_[first_sample_].q[head_.standoff], o.lower, o.upper);
  const bool joins = !in_.range.starts_cut || !in_.range.ends_cut;
  // With conditions an end that joins nothing may have to move.
  o.fixed_start = joins && (!in_.range.starts_cut || conditions_.windows.empty());
  o.fixed_end = joins && (!in_.range.ends_cut || conditions_.windows.empty());
  o.bounds = conditions_.bounds;
  return o;
}

// With the standoff held the linear axes are given.
StretchPlanner::SlowJoint StretchPlanner::slow_joint() const {
  const StandoffOptions o = standoff_options(rate_of(feed_));
  if (!standoff_is_held()) {
    const StandoffTimeFactor time = least_standoff_time(head_, tip_.curve, rotary_, o);
    return {time.found, time.factor, time.joint, time.derivative, time.place};
  }
  const LaserJointPath path = joint_path(held_standoff());
  SlowJoint slow;
  slow.found = true;
  for (int k = 0; k <= kMeasures * grid_.knots.spans(); ++k) {
    const double u = static_cast<double>(k) / kMeasures;
    const JointJet jet = path.jet(u);
    for (std::size_t i = 0; i < 3; ++i)
      for (int order = 1; order <= 3; ++order) {
        const double t = time_of(std::abs(jet(head_.linear[i], order)), o.linear[i], order);
        if (t > slow.factor) slow = {true, t, head_.linear[i], order, u};
      }
  }
  return slow;
}

// ---- feed

std::optional<Diagnostic> StretchPlanner::find_feed() {
  feed_ = path_.feed();
  RotaryTime time = least_rotary_time(rotary_problem(), 1.0, settings_);
  if (time.status == RotaryStatus::cone_empty) return no_orientation(time.why);
  if (time.status != RotaryStatus::optimal) return broke("rotary", time.why.solution);
  near_ = std::move(time.q);
  if (time.factor > 1.0 + kSame) {
    const int joint = rotary_problem().joints[static_cast<std::size_t>(time.why.channel)];
    if (machine_.recipe.orientation == "monotone")
      note_slow("the rotaries' limits while none of them turns back", 0.0);
    else
      note_slow(
          machine_.axes[static_cast<std::size_t>(joint)].name + " " + level_name(time.why.level),
          time.why.place);
    if (machine_.recipe.schedule == "programmed") return too_fast(time.factor);
    feed_ /= time.factor;
  }
  here_ = std::move(time.result);
  return {};
}

// Rotaries and standoff at one feed; slower until both have a solution.
std::optional<Diagnostic> StretchPlanner::settle() {
  const bool may_slow = machine_.recipe.schedule != "programmed";
  RotarySettings banded = settings_;
  banded.hybrid = false;
  if (settings_.hybrid) banded.solver.solver = QpSolver::banded;
  for (int round = 0; round < kMostFeeds; ++round) {
    if (!here_) here_ = optimise_rotaries(rotary_problem(), banded);
    RotaryResult here = *std::exchange(here_, std::nullopt);
    if (here.status == RotaryStatus::cone_empty) return no_orientation(here.why);
    if (here.status != RotaryStatus::optimal) {
      if (!may_slow) return broke("rotary", here.solution);
      feed_ /= kSlower;
      continue;
    }
    near_ = rotary_ = here.q;
    const SlowJoint slow = slow_joint();
    if (!slow.found) {
      // No answer from the elastic form: the programme itself at this feed, or slower.
      const StandoffResult standoff =
          optimise_standoff(head_, tip_.curve, rotary_, standoff_options(rate_of(feed_)));
      if (standoff.solution.status == QpStatus::optimal) return finish(std::move(here));
      if (round + 1 == kMostFeeds || !may_slow) return broke("standoff", standoff.solution);
      feed_ /= kMuchSlower;
      continue;
    }
    if (slow.factor <= 1.0 + kSame) {
      const std::optional<Diagnostic> problem = finish(std::move(here));
      if (!problem || !may_slow || round + 1 == kMostFeeds) return problem;
      feed_ /= kBackOff;  // there is next to no room at this feed
      continue;
    }
    note_slow(machine_.axes[static_cast<std::size_t>(slow.joint)].name + " " +
                  level_name(slow.derivative),
              slow.place);
    if (!may_slow) return too_fast(slow.factor);
    feed_ /= slow.factor * kBackOff;
  }
  return broke("rotary", {});
}

std::optional<Diagnostic> StretchPlanner::finish(RotaryResult rotaries) {
  if (settings_.hybrid)
    rotaries = polish_rotaries(rotary_problem(), std::move(rotaries), settings_);
  if (rotaries.status != RotaryStatus::optimal) return broke("rotary", rotaries.solution);
  rotary_ = rotaries.q;
  report_.passes = rotaries.passes;
  report_.via_points = static_cast<int>(rotary_problem().via.size());
  report_.qp.clear();
  for (const QpSolution& s : tip_.solutions) tell("smooth", s);
  tell("rotary", rotaries.solution);
  return solve_standoff(rate_of(feed_));
}

std::optional<Diagnostic> StretchPlanner::solve_standoff(double rate) {
  if (standoff_is_held()) {
    standoff_ = held_standoff();
    return {};
  }
  const StandoffResult r = optimise_standoff(head_, tip_.curve, rotary_, standoff_options(rate));
  if (r.solution.status != QpStatus::optimal) return broke("standoff", r.solution);
  standoff_ = r.q6;
  tell("standoff", r.solution);
  return {};
}

void StretchPlanner::tell(const char* name, const QpSolution& s) {
  report_.qp.push_back({name, to_string(s.solver), to_string(s.status), s.objective, s.iterations,
                        s.windows, s.certificate.kkt(), s.certificate.violation});
}

void StretchPlanner::note_slow(const std::string& why, double u) {
  report_.slowed_by = why;
  report_.slowed_lines = {path_.line(length_at(u))};
}

// ---- samples

LaserJointPath StretchPlanner::joint_path(SplineCurve standoff) const {
  return {head_, tip_.curve, rotary_, std::move(standoff), base_[first_sample_].q, path_.length()};
}

LaserSamples StretchPlanner::sampled(const LaserJointPath& path) const {
  std::vector<double> stops;
  for (const PathEvent& e : in_.laser.reference.path().events)
    if (e.point >= in_.range.first && e.point < in_.range.last)
      stops.push_back(path.parameter_at(path_.end_of(static_cast<std::uint32_t>(e.point))));
  stops.push_back(path.last());
  return sample_path({path, path_, in_.laser.pair, machine_, tool_length(), base_[first_sample_],
                      std::move(stops)},
                     rate_of(feed_));
}

void StretchPlanner::sample(PlannedLaserStretch& out) {
  LaserSamples samples = sampled(out.path);
  if (samples.rate < rate_of(feed_)) {
    feed_ *= samples.rate / rate_of(feed_);
    note_slow("blocks of cycle.min_block_ms that keep tolerance.budget.chord", 0.0);
  }
  out.samples = std::move(samples.samples);
  out.u = std::move(samples.u);
}

// ---- messages

Diagnostic StretchPlanner::no_orientation(const QpFeasibility& why) const {
  const std::string limit = why.name == "bound"       ? std::string("the range of a rotary")
                            : why.name == "clearance" ? std::string("clearance")
                                                      : std::string(why.name) + " tolerance";
  return diagnostic(
      "KN151",
      "no smooth motion of the rotary axes keeps the tool axis inside its tolerance here, at any feed "
      "(" +
          limit + "; short of " + text_of(degrees_from_radians(why.shortfall)) +
          " deg): more --lead and --tilt, a larger gap to tool.min_gap_mm, or smaller "
          "recipe.knot_every",
      in_.laser.file_name, static_cast<int>(path_.line(length_at(why.place))));
}

Diagnostic StretchPlanner::too_fast(double factor) const {
  return diagnostic(
      "KN152",
      "the programmed feed of " + text_of(path_.feed() * kSecondsPerMinute) + " mm/min is " +
          text_of(factor) + " times too fast for " + report_.slowed_by + ": at most " +
          text_of(path_.feed() / factor * kSecondsPerMinute) +
          " mm/min keep the limits; recipe.schedule = \"constant\" takes that feed",
      in_.laser.file_name,
      report_.slowed_lines.empty() ? 0 : static_cast<int>(report_.slowed_lines.front()));
}

Diagnostic StretchPlanner::broke(const char* what, const QpSolution& s) const {
  return diagnostic("KN154",
                    "the " + std::string(what) + " programme of the cut's stretch of " +
                        text_of(path_.length()) + " mm from here has no certified optimum (" +
                        to_string(s.status) + " after " + std::to_string(s.iterations) +
                        " iterations, residual " + std::to_string(s.certificate.kkt()) +
                        "): other tolerances or recipe.knot_every may help",
                    in_.laser.file_name,
                    static_cast<int>(in_.laser.reference.path().points[in_.range.first].line));
}

}  // namespace smoothpost
