#include "postproc/pipeline/laser_clearance.h"

#include <algorithm>
#include <cmath>

#include "kernels/collision/motion_check.h"
#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kFarCap = 100.0;     // mm: farther distances are not told apart
constexpr double kDigits = 1e-3;      // mm, of a linear joint
constexpr double kDigitsTurn = 1e-5;  // rad
constexpr double kNoFreedom = 2e-3;   // rad: of a window with one row
constexpr int kStandoffPlaces = 25;
constexpr int kHalvings = 12;
constexpr double kStandoffShare = 0.5;  // of turning, that moving along the tool costs
constexpr double kLeastTurn = 1e-6;     // rad
constexpr double kLeastArm = 1.0;       // mm: of a contact that turning moves
constexpr double kArm = 100.0;          // mm a rad

std::string number(double value, int digits = 1) {
  std::string text;
  append_decimal(text, value, digits);
  return text;
}

/// The turn of a rotary's value nearest to `near`, inside of its range if one is.
double wound(const AxisDefinition& axis, double value, double near) {
  double best = value, least = INFINITY;
  for (int k = -4; k <= 4; ++k) {
    const double turn = value + 2.0 * kPi * (k + std::round((near - value) / (2.0 * kPi)));
    if (turn < axis.joint.lower || turn > axis.joint.upper) continue;
    if (std::abs(turn - near) < least) {
      least = std::abs(turn - near);
      best = turn;
    }
  }
  return best;
}

JointVector wound(const ClearanceTask& task, JointVector q, const WristState& near) {
  const int joints[] = {task.pair.first_rotary(), task.pair.second_rotary()};
  for (std::size_t c = 0; c < 2; ++c)
    q[joints[c]] =
        wound(task.machine.axes[static_cast<std::size_t>(joints[c])], q[joints[c]], near.rotary[c]);
  return q;
}

WristNode node_of(const WristState& w) {
  WristNode n;
  n.rotary = w.rotary;
  n.standoff = w.standoff;
  return n;
}

/// The joints for an axis, on the branch that is nearer.
std::optional<JointVector> joints_at(const ClearanceTask& task, std::size_t station,
                                     const Vec3& axis, const WristState& near) {
  JointVector held = task.held;
  held[task.pair.first_rotary()] = near.rotary[0];
  if (const int joint = standoff_joint(task.machine); joint >= 0) held[joint] = near.standoff;
  const Vec3 holder = task.stations[station].tip + task.tool_length * axis;
  const auto found = task.pair.solve({holder, axis}, held);
  const WristWeights weights = wrist_weights(task, station);
  std::optional<JointVector> best;
  double least = INFINITY;
  for (std::size_t b = 0; b < 2; ++b) {
    if (!found.valid[b]) continue;
    const JointVector q = wound(task, found.q[b], near);
    const double d = wrist_distance(node_of(wrist_of(task, q)), node_of(near), weights);
    if (d >= least) continue;
    least = d;
    best = q;
  }
  return best;
}

bool in_ranges(const ClearanceTask& task, const JointVector& q) {
  for (int i = 0; i < task.machine.size(); ++i) {
    const ChainJoint& joint = task.machine.axes[static_cast<std::size_t>(i)].joint;
    if (q[i] < joint.lower || q[i] > joint.upper) return false;
  }
  return true;
}

/// The nearest standoff that is free with the axis as it is.
std::optional<JointVector> by_standoff(const ClearanceTask& task, std::size_t station,
                                       const WristState& now, double margin) {
  if (task.standoff_high <= task.standoff_low) return std::nullopt;
  std::vector<double> places;
  for (int k = 0; k < kStandoffPlaces; ++k)
    places.push_back(task.standoff_low +
                     (task.standoff_high - task.standoff_low) * k / (kStandoffPlaces - 1));
  std::stable_sort(places.begin(), places.end(), [&](double a, double b) {
    return std::abs(a - now.standoff) < std::abs(b - now.standoff);
  });
  const Vec3 axis = tool_axis_of(task, now);
  for (const double place : places) {
    const auto q = joints_at(task, station, axis, {now.rotary, place});
    if (q && in_ranges(task, *q) && is_free(task, *q, margin)) return q;
  }
  return std::nullopt;
}

std::string bodies_of(const Scene& scene, std::size_t pair) {
  const ScenePair& p = scene.pairs()[pair];
  return scene.bodies()[p.first].name + " and " + scene.bodies()[p.second].name;
}

int rows(double low, double high, int count) { return high - low < kNoFreedom ? 1 : count; }

}  // namespace

DomainProblem domain_problem(const ClearanceTask& task, const GridSize& size, double margin) {
  DomainProblem p;
  p.pair = &task.pair;
  p.scene = task.scene;
  p.standoff = standoff_joint(task.machine);
  p.held = task.held;
  p.lower.resize(task.machine.size());
  p.upper.resize(task.machine.size());
  for (int i = 0; i < task.machine.size(); ++i) {
    p.lower[i] = task.machine.axes[static_cast<std::size_t>(i)].joint.lower;
    p.upper[i] = task.machine.axes[static_cast<std::size_t>(i)].joint.upper;
  }
  double lead = 0.0, tilt = 0.0;
  for (const LaserStation& s : task.stations) {
    lead = std::max(lead, s.window.lead_high - s.window.lead_low);
    tilt = std::max(tilt, s.window.tilt_high - s.window.tilt_low);
  }
  p.leads = rows(0.0, lead, size.leads);
  p.tilts = rows(0.0, tilt, size.tilts);
  p.standoffs.clear();
  const int count = task.standoff_high > task.standoff_low ? size.standoffs : 1;
  for (int k = 0; k < count; ++k)
    p.standoffs.push_back(count == 1
                              ? task.standoff_low
                              : task.standoff_low +
                                    (task.standoff_high - task.standoff_low) * k / (count - 1));
  p.tool_length = task.tool_length;
  p.margin = margin;
  p.gap = [&task](const DomainPlace& place, const Vec3& axis) {
    return angle_between(axis, place.normal) <= task.stations[place.label].window.widest;
  };
  return p;
}

DomainPlace domain_place(const ClearanceTask& task, std::size_t station) {
  const LaserStation& s = task.stations[station];
  DomainPlace p;
  p.tip = s.tip;
  p.normal = s.window.normal;
  p.tangent = s.window.tangent;
  p.binormal = s.window.binormal;
  p.lead_low = s.window.lead_low;
  p.lead_high = s.window.lead_high;
  p.tilt_low = s.window.tilt_low;
  p.tilt_high = s.window.tilt_high;
  p.label = station;
  return p;
}

WristState wrist_of(const ClearanceTask& task, const JointVector& q) {
  const int joint = standoff_joint(task.machine);
  return {{q[task.pair.first_rotary()], q[task.pair.second_rotary()]}, joint < 0 ? 0.0 : q[joint]};
}

WristWeights wrist_weights(const ClearanceTask& task, std::size_t station) {
  WristWeights w;
  w.arm = kArm;
  if (const auto pole = task.pair.nearest_pole(task.stations[station].window.normal, task.held))
    w.pole = pole->second;
  return w;
}

Vec3 tool_axis_of(const ClearanceTask& task, const WristState& wrist) {
  JointVector q = task.held;
  q[task.pair.first_rotary()] = wrist.rotary[0];
  q[task.pair.second_rotary()] = wrist.rotary[1];
  return forward_location(task.pair.chain(), q).axis;
}

std::optional<JointVector> joints_of(const ClearanceTask& task, std::size_t station,
                                     const WristState& wrist) {
  JointVector q = task.held;
  q[task.pair.first_rotary()] = wrist.rotary[0];
  q[task.pair.second_rotary()] = wrist.rotary[1];
  if (const int joint = standoff_joint(task.machine); joint >= 0) q[joint] = wrist.standoff;
  return task.pair.with_linears(
      task.stations[station].tip + task.tool_length * tool_axis_of(task, wrist), q);
}

bool is_free(const ClearanceTask& task, const JointVector& q, double margin) {
  if (task.scene == nullptr) return true;
  const ScenePoses poses = task.scene->poses(q);
  for (std::size_t pair = 0; pair < task.scene->pairs().size(); ++pair)
    if (task.scene->decide(pair, poses, margin).lower < margin) return false;
  return true;
}

PathCheck check_path(const ClearanceTask& task, const std::vector<JointSample>& samples,
                     const std::vector<double>& u) {
  PathCheck out;
  out.least = kFarCap;
  SceneCache cache;
  MotionSettings settings;
  settings.deviation.resize(task.machine.size());
  for (int i = 0; i < task.machine.size(); ++i)
    settings.deviation[i] =
        task.machine.axes[static_cast<std::size_t>(i)].joint.kind == JointKind::linear
            ? kDigits
            : kDigitsTurn;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Clearance here = task.scene->clearance(samples[i].q, out.least, &cache);
    if (here.pair != Clearance::kNoPair && here.margin < out.least) {
      out.least = here.margin;
      out.least_pair = here.pair;
      out.least_u = u[i];
    }
    if (i == 0) continue;
    const JointVector& from = samples[i - 1].q;
    const MotionReport report = check_motion(*task.scene, from, samples[i].q, settings, &cache);
    if (report.verdict == MotionVerdict::free) continue;
    out.hits.push_back({u[i - 1] + report.t * (u[i] - u[i - 1]), report.pair,
                        (1.0 - report.t) * from + report.t * samples[i].q});
  }
  out.queries = cache.queries();
  return out;
}

std::optional<FreeWrist> nearest_free(const ClearanceTask& task, std::size_t station,
                                      const WristState& now, const FeasibleDomain& domain,
                                      double margin) {
  const WristWeights weights = wrist_weights(task, station);
  std::optional<FreeWrist> best;
  double least = INFINITY;
  if (const auto q = by_standoff(task, station, now, margin)) {
    best = FreeWrist{tool_axis_of(task, now), wrist_of(task, *q), margin};
    best->wrist.rotary = now.rotary;
    least = kStandoffShare * std::abs(best->wrist.standoff - now.standoff);
  }
  const DomainProblem problem =
      domain_problem(task, {domain.leads, domain.tilts, domain.standoffs}, margin);
  const DomainPlace place = domain_place(task, station);
  for (std::size_t n = 0; n < domain.cells.size(); ++n) {
    if (domain.cells[n].verdict != CellVerdict::free) continue;
    const DomainIndex at = domain.index(n);
    const auto q = domain_joints(problem, place, at);
    if (!q) continue;
    const WristState wrist = wrist_of(task, wound(task, *q, now));
    const double d = wrist_distance(node_of(now), node_of(wrist), weights);
    if (d >= least) continue;
    least = d;
    best = FreeWrist{place.axis(lead_at(problem, place, at.lead), tilt_at(problem, place, at.tilt)),
                     wrist, margin};
  }
  return best;
}

ClearanceCut cut_towards(const ClearanceTask& task, std::size_t station, const WristState& now,
                         const FreeWrist& target, double margin) {
  const Vec3 axis_now = tool_axis_of(task, now);
  const auto at = [&](double t) {
    WristState near = now;
    near.standoff += t * (target.wrist.standoff - now.standoff);
    for (std::size_t c = 0; c < 2; ++c)
      near.rotary[c] += t * (target.wrist.rotary[c] - now.rotary[c]);
    return joints_at(task, station, great_circle(axis_now, target.axis, t), near);
  };
  double low = 0.0, high = 1.0;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    const auto q = at(middle);
    (q && is_free(task, *q, margin) ? high : low) = middle;
  }
  const Vec3 axis = great_circle(axis_now, target.axis, high);
  ClearanceCut cut;
  const double moved = target.wrist.standoff - now.standoff;
  if (std::abs(moved) > kLeastTurn)
    (moved > 0.0 ? cut.lower : cut.upper) = now.standoff + high * moved;
  if (angle_between(axis_now, target.axis) <= kLeastTurn) return cut;

  Vec3 grows = target.axis - axis_now;
  grows -= grows.dot(axis) * axis;
  const Vec3 direction = grows.normalized();
  grows = direction;
  if (const auto q = at(high)) {
    const ScenePoses poses = task.scene->poses(*q);
    PairMargin tight;
    std::size_t pair = Clearance::kNoPair;
    double want = margin + 5.0;
    for (std::size_t p = 0; p < task.scene->pairs().size(); ++p) {
      const PairMargin m = task.scene->margin(p, poses, want);
      if (!m.found) continue;
      tight = m;
      pair = p;
      want = m.upper;
    }
    if (pair != Clearance::kNoPair && tight.distance > 1e-3) {
      const auto& bodies = task.scene->bodies();
      const bool first = bodies[task.scene->pairs()[pair].first].joint >
                         bodies[task.scene->pairs()[pair].second].joint;
      const Vec3 n = first ? tight.normal : Vec3(-tight.normal);
      const Vec3 x = (first ? tight.on_first : tight.on_second) - task.stations[station].tip;
      const double d = x.dot(axis);
      Vec3 a = d * n - n.dot(axis) * (x - d * axis);
      a -= a.dot(axis) * axis;
      if (a.norm() > kLeastArm && a.normalized().dot(direction) > 0.2) {
        grows = a.normalized();
        cut.contact = n;
        cut.arm = a.norm();
      }
    }
  }
  cut.axis = AxisCut{grows, grows.dot(axis)};
  return cut;
}

std::string why_blocked(const ClearanceTask& task, std::size_t station) {
  constexpr double kWidest = 60.0 * kRadiansPerDegree;
  constexpr double kLonger = 200.0;  // mm
  const DomainPlace place = domain_place(task, station);
  const DomainProblem problem = domain_problem(task, {}, 0.0);
  const FeasibleDomain domain = feasible_domain(problem, place);
  // What most cells meet.
  std::vector<std::size_t> meets(task.scene->pairs().size(), 0);
  std::size_t gap = 0, range = 0;
  for (const DomainCell& c : domain.cells) {
    if (c.verdict == CellVerdict::collision) ++meets[static_cast<std::size_t>(c.culprit)];
    gap += c.verdict == CellVerdict::gap;
    range += c.verdict == CellVerdict::out_of_range;
  }
  const auto most = std::max_element(meets.begin(), meets.end());
  std::string text =
      "no lead, tilt and standoff inside of the tolerances keeps the clearances here";
  if (most != meets.end() && *most > 0)
    text += ": " + bodies_of(*task.scene, static_cast<std::size_t>(most - meets.begin())) +
            " come too near to each other in " + std::to_string(*most) + " of " +
            std::to_string(domain.cells.size()) + " positions that were tried";
  if (gap > 0) text += ", " + std::to_string(gap) + " tilt the nozzle below tool.min_gap_mm";
  if (range > 0) text += ", " + std::to_string(range) + " are out of the range of a joint";

  // The least freedom more that gives one.
  const double lead = std::max(std::abs(place.lead_low), std::abs(place.lead_high));
  const double tilt = std::max(std::abs(place.tilt_low), std::abs(place.tilt_high));
  const auto least = [&](bool leads, bool tilts, double& value) {
    DomainPlace wide = place;
    DomainProblem p = problem;
    if (leads) wide.lead_low = -kWidest, wide.lead_high = kWidest, p.leads = 25;
    if (tilts) wide.tilt_low = -kWidest, wide.tilt_high = kWidest, p.tilts = 25;
    const FeasibleDomain more = feasible_domain(p, wide);
    value = INFINITY;
    for (std::size_t n = 0; n < more.cells.size(); ++n) {
      if (more.cells[n].verdict != CellVerdict::free) continue;
      const DomainIndex at = more.index(n);
      const double l = std::abs(lead_at(p, wide, at.lead)), t = std::abs(tilt_at(p, wide, at.tilt));
      value = std::min(value, leads && tilts ? std::max(l, t) : leads ? l : t);
    }
    return std::isfinite(value);
  };
  const auto degrees = [](double angle) {
    return number(std::ceil(10.0 * degrees_from_radians(angle) + 1.0) / 10.0) + " deg";
  };
  double by_lead = 0.0, by_tilt = 0.0, by_both = 0.0;
  const bool lead_frees = least(true, false, by_lead), tilt_frees = least(false, true, by_tilt);
  if (lead_frees && (!tilt_frees || by_lead - lead <= by_tilt - tilt))
    return text + ". tolerance.lead_deg of " + degrees(by_lead) + " would free it";
  if (tilt_frees) return text + ". tolerance.tilt_deg of " + degrees(by_tilt) + " would free it";
  if (task.standoff_high > task.standoff_low) {
    DomainProblem longer = problem;
    longer.standoffs.clear();
    for (double s = -kLonger; s <= kLonger; s += 10.0)
      longer.standoffs.push_back(0.5 * (task.standoff_low + task.standoff_high) + s);
    const FeasibleDomain more = feasible_domain(longer, place);
    double nearest = INFINITY;
    for (std::size_t n = 0; n < more.cells.size(); ++n)
      if (more.cells[n].verdict == CellVerdict::free) {
        const double s = longer.standoffs[static_cast<std::size_t>(more.index(n).standoff)];
        if (std::abs(s) < std::abs(nearest)) nearest = s;
      }
    if (std::isfinite(nearest))
      return text + ". A standoff axis that reaches " + number(nearest) + " mm would free it";
  }
  if (least(true, true, by_both))
    return text + ". tolerance.lead_deg and tilt_deg of " + degrees(by_both) + " would free it";
  return text +
         ". No freedom of the beam that was tried frees it: move what is in the way, or cut it "
         "with "
         "another head";
}

std::array<double, 2> lead_tilt_of(const LaserStation& station, const Vec3& axis) {
  const OrientationWindow& w = station.window;
  return {std::atan2(axis.dot(w.tangent), axis.dot(w.normal)),
          std::atan2(axis.dot(w.binormal), axis.dot(w.normal))};
}

DomainMap domain_map(const ClearanceTask& task, std::size_t station) {
  const DomainPlace place = domain_place(task, station);
  const DomainProblem problem = domain_problem(task, {}, 0.0);
  const FeasibleDomain domain = feasible_domain(problem, place);
  DomainMap map;
  map.line = task.stations[station].line;
  map.standoffs = problem.standoffs;
  map.programmed = lead_tilt_of(task.stations[station],
                                tool_axis_of(task, {task.stations[station].programmed, 0.0}));
  for (int i = 0; i < domain.leads; ++i) map.leads.push_back(lead_at(problem, place, i));
  for (int j = 0; j < domain.tilts; ++j) map.tilts.push_back(tilt_at(problem, place, j));
  constexpr char kLetters[] = {'.', 'x', 'r', 'g', '#'};
  for (int k = 0; k < domain.standoffs; ++k) {
    map.cells.emplace_back();
    for (int i = 0; i < domain.leads; ++i) {
      map.cells.back().emplace_back();
      for (int j = 0; j < domain.tilts; ++j) {
        const CellVerdict a = domain[{0, i, j, k}].verdict, b = domain[{1, i, j, k}].verdict;
        const CellVerdict shown = b == CellVerdict::free || a == CellVerdict::unreachable ? b : a;
        map.cells.back().back() += kLetters[static_cast<std::size_t>(shown)];
      }
    }
  }
  return map;
}

}  // namespace smoothpost
