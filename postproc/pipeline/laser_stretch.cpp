#include "postproc/pipeline/laser_stretch.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "postproc/pipeline/conversion_parts.h"
#include "postproc/pipeline/orientation_check.h"

namespace smoothpost {

namespace {

constexpr double kDense = 0.25;       // of the stations' distance: nearer segment ends are passed
constexpr int kLeastPieces = 6;       // of a stretch that is worth splines of its own
constexpr double kBackOff = 1.003;    // of the least time: at it the programmes have one point
constexpr double kSlower = 1.01;      // when rotaries and standoff do not agree on a feed
constexpr double kMuchSlower = 1.05;  // when a programme does not say how much
constexpr int kMostFeeds = 16;
constexpr double kLeastKept = 0.05;  // share of a tolerance that is left after its margin
// Of the orientation's freedom, for the turn of the tangent between stations.
constexpr double kTurnMargin = 0.1 * kRadiansPerDegree;
constexpr int kMeasures = 8;  // places a piece where peaks are looked for

double nearest_turn(double angle, double reference) {
  return angle + 2.0 * kPi * std::round((reference - angle) / (2.0 * kPi));
}

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

Jet jet_of(const SplineCurve& curve, int component, double u) {
  Jet jet{};
  for (int order = 0; order < 4; ++order)
    jet[static_cast<std::size_t>(order)] = curve.at(u, order)[component];
  return jet;
}

VectorJet tip_jet(const SplineCurve& curve, double u) {
  VectorJet jet;
  for (int order = 0; order < 4; ++order) jet.col(order) = curve.at(u, order);
  return jet;
}

/// Derivatives of a_i + b_i·q6 by u, orders 0 … 3.
Jet linear_jet(const LinearsByStandoff& l, int i, const Jet& q6) {
  constexpr double kBinomial[4][4] = {{1, 0, 0, 0}, {1, 1, 0, 0}, {1, 2, 1, 0}, {1, 3, 3, 1}};
  Jet jet{};
  for (int n = 0; n < 4; ++n) {
    double value = l.a(i, n);
    for (int r = 0; r <= n; ++r)
      value += kBinomial[n][r] * l.b(i, n - r) * q6[static_cast<std::size_t>(r)];
    jet[static_cast<std::size_t>(n)] = value;
  }
  return jet;
}

RateLimits limits_by_parameter(const AxisDefinition& axis, double share, double rate) {
  return {axis.velocity * share / rate, axis.acceleration * share / (rate * rate),
          axis.jerk * share / (rate * rate * rate)};
}

/// By how much a motion with these derivatives has to slow down to keep its limits.
double time_of(const Jet& jet, const RateLimits& l) {
  return std::max({nan_free(std::abs(jet[1]), l.velocity),
                   std::sqrt(nan_free(std::abs(jet[2]), l.acceleration)),
                   std::cbrt(nan_free(std::abs(jet[3]), l.jerk))});
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
  const double length = in_.laser.reference.path().points[in_.range.first].tool_length;
  head_.tip -= length * head_.tool_axis;
  settings_.hybrid = machine_.recipe.solver == "hybrid";
  settings_.solver.solver = machine_.recipe.solver == "banded" ? QpSolver::banded : QpSolver::ipopt;
}

bool StretchPlanner::worth_it() const {
  return path_.length() >= kLeastPieces * path_.spacing() && end_sample_ > first_sample_ + 1 &&
         path_.feed() > 0.0 && std::isfinite(path_.feed());
}

Result<PlannedStretch> StretchPlanner::run() {
  using Failure = Result<PlannedStretch>;
  const double spacing = path_.spacing();
  const int every = machine_.recipe.knot_every;
  bool fits = false;
  // Two stations a cutter location: between two of them the input is straight, a spline is not.
  for (int k = every; !fits && k >= 1; k = k > 1 ? k / 2 : 0) fits = fit(0.5 * spacing, 2 * k);
  for (double share = 0.25; !fits && share > 0.05; share *= 0.5) fits = fit(spacing * share, 2);
  if (!fits) return Failure::failure(not_smooth());
  for (int round = 0;; ++round) {
    if (auto problem = find_feed()) return Failure::failure(*problem);
    if (auto problem = settle()) return Failure::failure(*problem);
    if (keeps_to_input()) break;
    // Something of the input lies between the stations: once more with closer ones.
    if (round > 0 || !fit(0.25 * spacing, 4)) return Failure::failure(not_smooth());
  }
  PlannedStretch out;
  sample(out);
  report_.first = in_.range.first;
  report_.last = in_.range.last;
  report_.length = path_.length();
  report_.feed = feed_;
  report_.programmed_feed = path_.feed();
  report_.control_points = grid_.knots.controls();
  report_.normal_from_part = in_.frames.from_part();
  out.report = report_;
  measure(out);
  return Failure(std::move(out));
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
bool StretchPlanner::keeps_to_input() const {
  const auto& t = machine_.tolerance;
  // What chord_holds() leaves.
  const double share = 1.0 - 0.85 * t.budget.chord - t.budget.rounding;
  const bool kept = !orientation_is_free(machine_);
  std::vector<double> places;
  for (std::uint32_t k = in_.range.first; k <= in_.range.last; ++k)
    places.push_back(path_.end_of(k));
  for (std::size_t i = 1; i < grid_.s.size(); ++i)
    places.push_back(0.5 * (grid_.s[i - 1] + grid_.s[i]));
  return std::all_of(places.begin(), places.end(), [&](double s) {
    const PathPlace at = path_.place(s);
    const CutterLocation input = in_.laser.reference.at(at.segment, at.s);
    const CutterLocation ours =
        wanted(std::min(grid_.knots.last(), s / path_.length() * grid_.knots.spans()));
    return (input.tip - ours.tip).norm() <= share * t.tip &&
           (!kept || (input.axis - ours.axis).norm() <= share * t.axis);
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

bool StretchPlanner::fit(double spacing, int every) {
  grid_ = grid(spacing, every);
  near_.reset();
  TipFitProblem p;
  p.knots = grid_.knots;
  p.u = grid_.u;
  for (const CutterLocation& location : grid_.location) p.points.push_back(location.tip);
  const auto& t = machine_.tolerance;
  p.tolerance = 0.95 * t.tip * (t.budget.merge + t.budget.smoothing);
  p.hybrid = settings_.hybrid;
  p.solver = settings_.solver;
  tip_ = fit_tip(p);
  if (tip_.failed >= 0) return false;
  seed_rotaries(grid_);
  return true;
}

// Of the programmed axis, on the branch and turn of the base plan at the start.
void StretchPlanner::seed_rotaries(Grid& g) const {
  const int first = in_.laser.pair.first_rotary(), second = in_.laser.pair.second_rotary();
  JointVector near = base_[first_sample_].q;
  const double length = in_.laser.reference.path().points[in_.range.first].tool_length;
  for (const CutterLocation& location : g.location) {
    const RotaryPairSolutions solutions =
        in_.laser.pair.solve(holder_location(location, length), near);
    double best = INFINITY;
    JointVector next = near;
    for (std::size_t b = 0; b < 2; ++b) {
      if (!solutions.valid[b]) continue;
      JointVector q = solutions.q[b];
      double distance = 0.0;
      for (const int j : {first, second}) {
        q[j] = nearest_turn(q[j], near[j]);
        distance += std::abs(q[j] - near[j]);
      }
      if (distance >= best) continue;
      best = distance;
      next = q;
    }
    near = next;
    g.programmed.push_back({near[first], near[second]});
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
    p.limits[c] = limits_by_parameter(axis, machine_.tolerance.limit_share, rate_of(feed_));
  }
  const std::string& mode = machine_.recipe.orientation;
  p.monotone = mode == "monotone";
  if (mode == "via" || mode == "monotone") {
    p.via = vias();
  } else {
    // As far apart as the cutter locations.
    double last = -INFINITY;
    for (std::size_t i = 0; i < grid_.u.size(); ++i) {
      if (grid_.s[i] - last < 0.9 * path_.spacing() && i + 1 < grid_.u.size()) continue;
      last = grid_.s[i];
      p.windows.push_back(window(grid_, i));
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

void StretchPlanner::add_end_vias(std::vector<RotaryVia>& via) const {
  if (!in_.range.starts_cut) via.push_back({grid_.u.front(), grid_.programmed.front()});
  if (!in_.range.ends_cut) via.push_back({grid_.u.back(), grid_.programmed.back()});
}

std::vector<RotaryVia> StretchPlanner::vias() const {
  std::vector<RotaryVia> list;
  for (const std::size_t i : via_stations()) list.push_back({grid_.u[i], grid_.programmed[i]});
  return list;
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
    if (kept.empty() || grid_.u[i] - grid_.u[kept.back()] >= 2.0 * grid_.knots.degree) kept.push_back(i);
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
  if (settings_.hybrid) o.solver.solver = QpSolver::banded;
  o.start = o.end = std::clamp(base_[first_sample_].q[head_.standoff], o.lower, o.upper);
  o.fixed_ends = !in_.range.starts_cut || !in_.range.ends_cut;
  return o;
}

// With the standoff held the linear axes are given.
double StretchPlanner::held_time(double rate) const {
  const StandoffOptions o = standoff_options(rate);
  const SplineCurve q6 = held_standoff();
  double t = 0.0;
  for (int k = 0; k <= kMeasures * grid_.knots.spans(); ++k) {
    const double u = static_cast<double>(k) / kMeasures;
    const LinearsByStandoff l = linears_by_standoff(head_, tip_jet(tip_.curve, u),
                                                    jet_of(rotary_, 0, u), jet_of(rotary_, 1, u));
    for (int i = 0; i < 3; ++i)
      t = std::max(
          t, time_of(linear_jet(l, i, jet_of(q6, 0, u)), o.linear[static_cast<std::size_t>(i)]));
  }
  return t;
}

// ---- feed

std::optional<Diagnostic> StretchPlanner::find_feed() {
  feed_ = path_.feed();
  const RotaryTime time = least_rotary_time(rotary_problem(), 1.0, settings_);
  if (time.status == RotaryStatus::cone_empty) return no_orientation(time.why);
  if (time.status != RotaryStatus::optimal) return broke("rotary", time.why.solution);
  near_ = time.q;
  if (time.factor > 1.0 + 1e-4) {
    const int joint = rotary_problem().joints[static_cast<std::size_t>(time.why.channel)];
    note_slow(
        machine_.axes[static_cast<std::size_t>(joint)].name + " " + level_name(time.why.level),
        time.why.place);
    if (machine_.recipe.schedule == "programmed") return too_fast(time.factor);
    feed_ /= time.factor * kBackOff;
  }
  return {};
}

// Rotaries and standoff at one feed; slower until both have a solution.
std::optional<Diagnostic> StretchPlanner::settle() {
  for (int round = 0; round < kMostFeeds; ++round) {
    RotarySettings banded = settings_;
    banded.hybrid = false;
    if (settings_.hybrid) banded.solver.solver = QpSolver::banded;
    const RotaryResult rough = optimise_rotaries(rotary_problem(), banded);
    if (rough.status == RotaryStatus::cone_empty) return no_orientation(rough.why);
    if (rough.status != RotaryStatus::optimal) {
      if (machine_.recipe.schedule == "programmed") return broke("rotary", rough.solution);
      feed_ /= kSlower;
      continue;
    }
    near_ = rotary_ = rough.q;
    double factor = 0.0;
    int joint = -1, derivative = 0;
    double place = 0.0;
    if (standoff_is_held()) {
      factor = held_time(rate_of(feed_));
      joint = factor > 1.0 ? head_.linear[0] : -1;
      derivative = 3;
    } else {
      const StandoffTimeFactor time =
          least_standoff_time(head_, tip_.curve, rotary_, standoff_options(rate_of(feed_)));
      if (!time.found) {
        // No answer from the elastic form: the programme itself at this feed, or slower.
        const StandoffResult here =
            optimise_standoff(head_, tip_.curve, rotary_, standoff_options(rate_of(feed_)));
        if (here.solution.status != QpStatus::optimal) {
          if (round + 1 == kMostFeeds || machine_.recipe.schedule == "programmed")
            return broke("standoff", here.solution);
          feed_ /= kMuchSlower;
          continue;
        }
      }
      factor = time.factor;
      joint = time.joint;
      derivative = time.derivative;
      place = time.place;
    }
    if (factor > 1.0 + 1e-4) {
      if (joint >= 0)
        note_slow(
            machine_.axes[static_cast<std::size_t>(joint)].name + " " + level_name(derivative),
            place);
      if (machine_.recipe.schedule == "programmed") return too_fast(factor);
      feed_ /= factor * kBackOff;
      continue;
    }
    const RotaryResult last = settings_.hybrid || settings_.solver.solver == QpSolver::ipopt
                                  ? optimise_rotaries(rotary_problem(), settings_)
                                  : rough;
    if (last.status != RotaryStatus::optimal) return broke("rotary", last.solution);
    rotary_ = last.q;
    report_.passes = last.passes;
    report_.via_points = static_cast<int>(rotary_problem().via.size());
    report_.qp.clear();
    for (const QpSolution& s : tip_.solutions) tell("smooth", s);
    tell("rotary", last.solution);
    return solve_standoff(rate_of(feed_));
  }
  return broke("rotary", {});
}

std::optional<Diagnostic> StretchPlanner::solve_standoff(double rate) {
  if (standoff_is_held()) {
    standoff_ = held_standoff();
    return {};
  }
  StandoffOptions o = standoff_options(rate);
  StandoffResult r = optimise_standoff(head_, tip_.curve, rotary_, o);
  if (r.solution.status == QpStatus::optimal && settings_.hybrid) {
    o.solver = settings_.solver;
    o.solver.solver = QpSolver::ipopt;
    r = optimise_standoff(head_, tip_.curve, rotary_, o);
  }
  if (r.solution.status != QpStatus::optimal) return broke("standoff", r.solution);
  standoff_ = r.q6;
  tell("standoff", r.solution);
  return {};
}

void StretchPlanner::tell(const char* name, const QpSolution& s) {
  report_.qp.push_back({name, to_string(s.solver), to_string(s.status), s.objective, s.iterations,
                        s.certificate.kkt(), s.certificate.violation});
}

void StretchPlanner::note_slow(const std::string& why, double u) {
  report_.slowed_by = why;
  report_.slowed_lines = {path_.line(length_at(u))};
}

// ---- samples

JointVector StretchPlanner::joints(double u) const {
  JointVector q = base_[first_sample_].q;
  const Eigen::VectorXd r = rotary_.at(u);
  q[in_.laser.pair.first_rotary()] = r[0];
  q[in_.laser.pair.second_rotary()] = r[1];
  q[head_.standoff] = standoff_.at(u)[0];
  const LinearsByStandoff l = linears_by_standoff(head_, tip_jet(tip_.curve, u),
                                                  jet_of(rotary_, 0, u), jet_of(rotary_, 1, u));
  for (int i = 0; i < 3; ++i)
    q[head_.linear[static_cast<std::size_t>(i)]] = l.a(i, 0) + l.b(i, 0) * q[head_.standoff];
  return q;
}

CutterLocation StretchPlanner::wanted(double u) const {
  const Eigen::VectorXd r = rotary_.at(u);
  return {Vec3(tip_.curve.at(u)),
          Vec3(axis_jet(head_, {r[0], 0.0, 0.0, 0.0}, {r[1], 0.0, 0.0, 0.0}).col(0))};
}

bool StretchPlanner::chord_holds(double from, double to, const JointVector& a,
                                 const JointVector& b) const {
  const double length = in_.laser.reference.path().points[in_.range.first].tool_length;
  const auto& t = machine_.tolerance;
  for (const double share : {0.25, 0.5, 0.75}) {
    const CutterLocation want = wanted(from + share * (to - from));
    const JointVector q = a + share * (b - a);
    const CutterLocation holder = forward_location(in_.laser.pair.chain(), q);
    if ((holder.tip - length * holder.axis - want.tip).norm() > 0.8 * t.tip * t.budget.chord)
      return false;
    if ((holder.axis - want.axis).norm() > 0.8 * t.axis * t.budget.chord) return false;
  }
  return true;
}

// Blocks of block_time, shorter where a straight joint motion leaves the plan; all of them slower
// when one would be shorter than the controller takes.
void StretchPlanner::sample(PlannedStretch& out) {
  const double last = grid_.knots.last();
  const double usual = machine_.dialect.block_time * rate_of(feed_);
  std::vector<double> stops;  // parameters that have to be ends of blocks
  for (const PathEvent& e : in_.laser.reference.path().events)
    if (e.point >= in_.range.first && e.point < in_.range.last)
      stops.push_back(path_.end_of(static_cast<std::uint32_t>(e.point)) / path_.length() * last);
  stops.push_back(last);
  const auto add = [&](double u, const JointVector& q, double step) {
    JointSample s;
    const PathPlace at = path_.place(std::min(path_.length(), length_at(u)));
    s.segment = at.segment;
    s.s = at.s;
    s.branch = base_[first_sample_].branch;
    s.q = q;
    s.time = step;  // in pieces until the feed is known
    out.samples.push_back(std::move(s));
  };
  double u = 0.0, shortest = INFINITY;
  JointVector from = joints(0.0);
  JointSample start = base_[first_sample_];
  start.q = from;
  out.samples.push_back(start);
  for (const double stop : stops) {
    while (u < stop - 1e-9) {
      const double rest = stop - u;
      double step = rest / std::ceil(rest / usual - 1e-9);
      JointVector to = joints(u + step);
      while (step > 1e-4 && !chord_holds(u, u + step, from, to)) {
        step *= 0.5;
        to = joints(u + step);
      }
      if (rest - step < 1e-9) step = rest;
      shortest = std::min(shortest, step);
      u = rest - step < 1e-9 ? stop : u + step;
      add(u, to, step);
      from = to;
    }
  }
  const double allowed = shortest / machine_.cycle.min_block;
  double rate = rate_of(feed_);
  if (rate > allowed && shortest < usual * (1.0 - 1e-6)) {
    feed_ *= allowed / rate;
    rate = allowed;
    note_slow("blocks of cycle.min_block_ms that keep tolerance.budget.chord", 0.0);
  }
  for (std::size_t i = 1; i < out.samples.size(); ++i) out.samples[i].time /= rate;
}

// ---- what was found

void StretchPlanner::measure(PlannedStretch& out) const {
  const double rate = rate_of(feed_);
  const double du = 1.0 / kMeasures;
  std::vector<JointPeaks> peaks(static_cast<std::size_t>(machine_.size()));
  const int steps = kMeasures * grid_.knots.spans();
  for (int k = 0; k <= steps; ++k) {
    const double u = std::min(grid_.knots.last(), k * du);
    const std::uint32_t line = path_.line(std::min(path_.length(), length_at(u)));
    const LinearsByStandoff l = linears_by_standoff(head_, tip_jet(tip_.curve, u),
                                                    jet_of(rotary_, 0, u), jet_of(rotary_, 1, u));
    const auto see = [&](int joint, const Jet& jet) {
      JointPeaks& p = peaks[static_cast<std::size_t>(joint)];
      const double v = std::abs(jet[1]) * rate, a = std::abs(jet[2]) * rate * rate,
                   j = std::abs(jet[3]) * rate * rate * rate;
      if (v > p.velocity) p.velocity = v, p.velocity_line = line;
      if (a > p.acceleration) p.acceleration = a, p.acceleration_line = line;
      if (j > p.jerk) p.jerk = j, p.jerk_line = line;
      p.jerk_square_integral += (k == 0 || k == steps ? 0.5 : 1.0) * j * j * du / rate;
    };
    const Jet q6 = jet_of(standoff_, 0, u);
    see(in_.laser.pair.first_rotary(), jet_of(rotary_, 0, u));
    see(in_.laser.pair.second_rotary(), jet_of(rotary_, 1, u));
    see(head_.standoff, q6);
    for (int i = 0; i < 3; ++i)
      see(head_.linear[static_cast<std::size_t>(i)], linear_jet(l, i, q6));
  }
  out.report.peaks = std::move(peaks);
}

// ---- messages

Diagnostic StretchPlanner::no_orientation(const QpFeasibility& why) const {
  const std::string limit = why.name == "bound" ? std::string("the range of a rotary")
                                                : std::string(why.name) + " tolerance";
  return diagnostic(
      "KN151",
      "no motion of the rotary axes keeps the tool axis inside its tolerance here, at any feed (" +
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
