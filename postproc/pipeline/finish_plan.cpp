#include "postproc/pipeline/finish_plan.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "kernels/core/units.h"
#include "postproc/pipeline/finish_joints.h"

namespace smoothpost {

namespace {

constexpr double kStation = 3.0;                          // mm, at most between stations
constexpr double kStationTurn = 4.0 * kRadiansPerDegree;  // of the axis, likewise
constexpr double kGrid = 3.0 * kRadiansPerDegree;         // of a free rotary
constexpr double kLinearGrid = 2.0;                       // mm, of a free linear joint
constexpr int kMostSteps = 10;
constexpr double kReserve = 1.0;  // mm, of linear ranges, for what is between stations
constexpr double kRotaryReserve = kReserve * kRadiansPerDegree;
constexpr double kReserveShare = 0.01;  // of the range, at most
constexpr double kRoom = 0.6;    // rad or, times 100, mm: besides the turn, of the free joint
constexpr double kBlock = 0.25;  // mm, least usual length of a block
constexpr double kUsed = 0.8;    // of the chord share: it is looked at in quarters alone
constexpr int kFreePieces = 2;   // of the contour's spline to one of the free joint's
constexpr int kPasses = 6;
constexpr double kVelocityShare = 1e-3;  // of the objective, against long ways

std::string number(double value) {
  std::string text = std::to_string(std::round(1e3 * value) / 1e3);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

class Planner {
 public:
  Planner(const FinishPlanInput& input, const Progress& progress)
      : in_(input),
        progress_(progress),
        limits_(limits_of(input.machine)),
        near_(home_of(input.machine)),
        free_joint_(redundant_joint(input.pair.chain())) {}

  Result<FinishPlan> run() {
    if (free_joint_ < 0)
      return Result<FinishPlan>::failure(
          error("KN172",
                "machine " + in_.machine.name +
                    " cannot finish: exactly one axis has to be redundant = true, such as the "
                    "bed's rotary, beside two rotary and three linear ones",
                0));
    range_ = free_range();
    weight_.resize(near_.size());
    jerk_weight_.resize(near_.size());
    const double feed = feed_of();
    for (Eigen::Index j = 0; j < near_.size(); ++j) {
      weight_[j] = 1.0 / (limits_.velocity[j] * limits_.velocity[j]);
      const double jerk = limits_.jerk[j] / (feed * feed * feed);
      jerk_weight_[j] = 1.0 / (jerk * jerk);
    }
    for (std::size_t i = 0; i < in_.path.cuts.size(); ++i) {
      if (is_omitted(in_.path.cuts[i])) continue;
      if (!add_cut(i)) return Result<FinishPlan>::failure(std::move(diagnostics_));
      if (!progress_("redundancy",
                     static_cast<double>(i + 1) / static_cast<double>(in_.path.cuts.size())))
        return Result<FinishPlan>::failure(error("US190", "cancelled", 0));
    }
    return Result<FinishPlan>(std::move(out_), std::move(diagnostics_));
  }

 private:
  Diagnostic error(const char* code, std::string text, std::uint32_t line) const {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    d.where = {in_.file_name, static_cast<int>(line), 0};
    return d;
  }

  double feed_of() const {
    const auto& points = in_.path.path.points;
    for (std::size_t i = 1; i < points.size(); ++i)
      if (points[i].duration > 0.0)
        return (points[i].location.tip - points[i - 1].location.tip).norm() / points[i].duration;
    return 1.0;
  }

  bool is_omitted(const FinishCut& cut) const {
    for (const Cut& c : in_.cuts)
      if (c.first <= cut.first_point + 1 && cut.first_point + 1 <= c.last) return c.omitted;
    return true;
  }

  // Places of the path where the free joint is chosen.
  static std::vector<double> stations_of(const FinishCut& cut) {
    std::vector<double> stations{0.0};
    Vec3 axis = cut.location(0.0).axis.col(0);
    for (std::size_t i = 1; i < cut.s.size(); ++i) {
      const Vec3 next = cut.location(cut.s[i]).axis.col(0);
      const bool last = i + 1 == cut.s.size();
      if (!last && cut.s[i] - stations.back() < kStation &&
          angle_between(axis, next) < kStationTurn)
        continue;
      stations.push_back(cut.s[i]);
      axis = next;
    }
    return stations;
  }

  bool rotary() const {
    return in_.machine.axes[static_cast<std::size_t>(free_joint_)].joint.kind == JointKind::rotary;
  }

  /// The range that the free joint may have: cyclic joints wind without end.
  std::pair<double, double> free_range() const {
    if (in_.machine.axes[static_cast<std::size_t>(free_joint_)].joint.cyclic) return {-1e6, 1e6};
    return {limits_.lower[free_joint_], limits_.upper[free_joint_]};
  }

  // Takes a share of the reserve off both ends of every range.
  void draw_in(JointVector& lower, JointVector& upper, double share) const {
    for (Eigen::Index j = 0; j < lower.size(); ++j) {
      const bool turns =
          in_.machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
      const double reserve = share * std::min(turns ? kRotaryReserve : kReserve,
                                              kReserveShare * (upper[j] - lower[j]));
      lower[j] += reserve;
      upper[j] -= reserve;
    }
  }

  GlobalSettings global_settings() const {
    GlobalSettings settings;
    settings.weight = weight_;
    settings.lower = limits_.lower;
    settings.upper = limits_.upper;
    settings.lower[free_joint_] = range_.first;
    settings.upper[free_joint_] = range_.second;
    draw_in(settings.lower, settings.upper, 1.0);
    settings.near = near_;
    settings.grid = rotary() ? kGrid : kLinearGrid;
    settings.most_steps = kMostSteps;
    return settings;
  }

  // What the free joint turns by on a closed contour: with a free rotary about the part the axis'
  // own turn, seen from the machine; else nothing.
  std::optional<double> change_of(const FinishCut& cut) const {
    if (!cut.closed) return {};
    return 2.0 * kPi * std::round(turn_of(cut) / (2.0 * kPi));
  }

  // About what a free rotary under the part turns by, so that the tool's side stays the same.
  double turn_of(const FinishCut& cut) const { return rotary() ? sign() * cut.turning : 0.0; }
  // Of the free rotary's direction as the part sees it.
  double sign() const {
    const Vec3 up = jacobian(in_.pair.chain(), near_).col(free_joint_).head<3>();
    return up.z() > 0.0 ? 1.0 : -1.0;
  }

  // How a free rotary under the part turns along the stations so that the tool's side stays the
  // same; over a closed contour by whole turns.
  std::vector<double> expected_at(const FinishCut& cut, const std::vector<double>& stations,
                                  std::optional<double> change) const {
    std::vector<double> turn(1, 0.0);
    if (!rotary()) return std::vector<double>(stations.size(), 0.0);
    Vec3 before = cut.location(0.0).axis.col(0);
    for (std::size_t i = 1; i < stations.size(); ++i) {
      const Vec3 now = cut.location(stations[i]).axis.col(0);
      turn.push_back(turn.back() +
                     sign() * std::atan2(before.x() * now.y() - before.y() * now.x(),
                                         before.x() * now.x() + before.y() * now.y()));
      before = now;
    }
    if (change && std::abs(turn.back()) > 1.0)
      for (double& t : turn) t *= *change / turn.back();
    return turn;
  }

  /// Chooses from the end of the cut before, else from anywhere; closed, else free. On a grid that
  /// turns with the contour, so that one turn of it is enough however often the contour goes round.
  GlobalResolution choose(const RedundantPath& path, const FinishCut& cut, bool& turned) const {
    const std::vector<double> stations = stations_of(cut);
    const std::optional<double> change = change_of(cut);
    const std::vector<double> expected = expected_at(cut, stations, change);
    const auto at = [&](double s) {
      const auto i = std::lower_bound(stations.begin(), stations.end(), s) - stations.begin();
      return expected[static_cast<std::size_t>(i)];
    };
    RedundantPath turning = path;
    bool roomy = true;  // the links at both ends have their clearance along the tool axis
    turning.joints = [&](double s, double free, const JointVector& near) {
      auto q = path.joints(s, free + at(s), near);
      const bool end = s == stations.front() || s == stations.back();
      if (q && end && roomy && !has_room(*q)) q.reset();
      return q;
    };
    GlobalResolution last;
    const auto attempt = [&](std::optional<double> start, bool closed) {
      GlobalSettings settings = global_settings();
      settings.start = start;
      if (closed) settings.change = *change - expected.back();
      const double room = rotary() ? kPi + kRoom : 0.5 * (range_.second - range_.first);
      const double middle = start.value_or(rotary() ? 0.0 : 0.5 * (range_.first + range_.second));
      settings.free_lower = middle - room;
      settings.free_upper = middle + room;
      if (in_.scene) settings.clear = [this](double, const JointVector& q) { return free(q); };
      last = resolve_globally(turning, stations, settings);
      if (last.status == GlobalResolution::Status::blocked) {
        settings.clear = nullptr;
        last = resolve_globally(turning, stations, settings);
      }
      for (std::size_t i = 0; i < last.free.size(); ++i) last.free[i] += expected[i];
      return last.status == GlobalResolution::Status::ok;
    };
    for (const bool wanted : {true, false}) {
      roomy = wanted;
      turned = false;
      if (end_ && attempt(end_, change.has_value())) return last;
      turned = end_.has_value();
      if (attempt({}, change.has_value())) return last;
    }
    if (change) attempt({}, false);
    return last;
  }

  // Whether the tool can draw back by the links' clearance.
  bool has_room(const JointVector& q) const {
    const CutterLocation at = forward_location(in_.pair.chain(), q);
    const auto back = in_.pair.with_linears(at.tip + in_.machine.links.clearance * at.axis, q);
    if (!back) return false;
    for (Eigen::Index j = 0; j < back->size(); ++j)
      if (j != free_joint_ && ((*back)[j] < limits_.lower[j] || (*back)[j] > limits_.upper[j]))
        return false;
    return true;
  }

  bool free(const JointVector& q) const { return in_.scene->free(q, &cache_); }

  FreeProfile profile_of(const GlobalResolution& found, const std::vector<double>& stations) const {
    FreeProfile out{stations, found.free, {}};
    for (std::size_t i = 0; i < stations.size(); ++i) {
      const std::size_t a = i > 0 ? i - 1 : 0;
      const std::size_t b = std::min(i + 1, stations.size() - 1);
      out.rate.push_back((out.free[b] - out.free[a]) / (stations[b] - stations[a]));
    }
    return out;
  }

  bool keeps_limits(const RedundantPath& path, const FreeProfile& free) const {
    const GlobalSettings settings = global_settings();
    for (std::size_t i = 0; i < free.s.size(); ++i) {
      const auto q = path.joints(free.s[i], free.free[i], near_);
      if (!q || (settings.lower - *q).maxCoeff() > 0.0 || (*q - settings.upper).maxCoeff() > 0.0)
        return false;
    }
    return true;
  }

  SmoothFreeSettings smooth_settings(const FinishCut& cut, double feed) const {
    const GlobalSettings global = global_settings();
    SmoothFreeSettings s;
    s.velocity_weight = weight_;
    s.jerk_weight = jerk_weight_;
    s.velocity_share = kVelocityShare;
    s.lower = global.lower;
    s.upper = global.upper;
    draw_in(s.lower, s.upper, -0.5);  // half of it back
    std::tie(s.free_lower, s.free_upper) = range_;
    const double share = in_.machine.tolerance.limit_share;
    for (Eigen::Index j = 0; j < near_.size(); ++j)
      s.limits.push_back({share * limits_.velocity[j] / feed,
                          share * limits_.acceleration[j] / (feed * feed),
                          share * limits_.jerk[j] / (feed * feed * feed)});
    s.spacing = 1e9;  // knots are the breaks
    s.least_spacing = 0.5 * cut.scale;
    s.most_passes = kPasses;
    return s;
  }

  bool refuse(const GlobalResolution& found, const FinishCut& cut) {
    const auto at = std::lower_bound(cut.s.begin(), cut.s.end(), found.failed - 1e-9);
    const std::size_t i =
        std::min<std::size_t>(static_cast<std::size_t>(at - cut.s.begin()), cut.s.size() - 1);
    const PathPoint& p = in_.path.path.points[cut.first_point + i];
    const Vec3& tip = p.location.tip;
    const std::string place =
        " at point " + std::to_string(p.line) + " of the path (layer " +
        std::to_string(cut.layer + 1) + ", " + number(tip.x()) + ", " + number(tip.y()) + ", " +
        number(tip.z()) + " mm in the part, tool axis " + number(p.location.axis.x()) + ", " +
        number(p.location.axis.y()) + ", " + number(p.location.axis.z()) + ")";
    const std::string free = in_.machine.axes[static_cast<std::size_t>(free_joint_)].name;
    if (found.status == GlobalResolution::Status::out_of_limits) {
      const bool reach = found.joint >= 0;
      const std::string joint =
          reach ? in_.machine.axes[static_cast<std::size_t>(found.joint)].name : std::string();
      const bool turns =
          reach &&
          in_.machine.axes[static_cast<std::size_t>(found.joint)].joint.kind == JointKind::rotary;
      diagnostics_.push_back(error(
          "KN170",
          "no position of " + free + " lets the machine reach the part" + place +
              (reach ? ": nearest is one where " + joint + " is " +
                           number(turns ? degrees_from_radians(found.excess) : found.excess) +
                           (turns ? " deg" : " mm") + " beyond its range"
                     : "") +
              ". Place the part otherwise (--work-offset) or leave that height out (--from, --to)",
          p.line));
    } else {
      diagnostics_.push_back(error(
          "KN171",
          "no way of " + free + " along the contour keeps every axis inside its range" + place,
          p.line));
    }
    return false;
  }

  bool add_cut(std::size_t index) {
    const FinishCut& cut = in_.path.cuts[index];
    const double tool_length = in_.path.path.points[cut.first_point].tool_length;
    struct Last {
      double s = -1.0;
      LocationJet at;
    };
    // One place is asked for many times with other values of the free joint.
    const auto last = std::make_shared<Last>();
    std::vector<double> breaks;
    for (int i = 0; i < cut.pieces; i += kFreePieces)
      if (cut.pieces - i >= kFreePieces || i == 0) breaks.push_back(cut.scale * i);
    breaks.push_back(cut.length());
    const RedundantPath path = redundant_path(
        in_.pair,
        [&cut, tool_length, last](double s) {
          if (s != last->s) {
            last->at = holder_on_cut(cut, tool_length, s);
            last->s = s;
          }
          return last->at;
        },
        breaks);
    FinishResolution told;
    told.cut = index;
    told.first_line = in_.path.path.points[cut.first_point].line;
    const GlobalResolution found = choose(path, cut, told.wound_back);
    if (found.status != GlobalResolution::Status::ok) return refuse(found, cut);
    FreeProfile seed = profile_of(found, stations_of(cut));
    told.seed = "grid";
    MinimumNormSettings local;
    local.weight = weight_;
    local.near = near_;
    local.start = found.free.front();
    local.change = found.free.back() - found.free.front();
    local.step = kFreePieces * cut.scale;
    const MinimumNorm norm = minimum_norm(path, local);
    if (norm.ok && keeps_limits(path, norm.free)) {
      seed = norm.free;
      told.seed = "minimum norm";
    }
    SmoothFree smooth = smooth_free(path, seed, near_, smooth_settings(cut, feed_of()));
    if (!smooth.ok) {
      diagnostics_.push_back(error("KN171",
                                   "the free joint of cut " + std::to_string(index + 1) +
                                       " could not be made a smooth function of the path",
                                   told.first_line));
      return false;
    }
    told.start = found.free.front();
    told.end = found.free.back();
    told.jerk_before = smooth.before.jerk;
    told.jerk_after = smooth.after.jerk;
    told.passes = smooth.passes;
    end_ = told.end;
    out_.resolutions.push_back(told);
    add_samples(cut, tool_length,
                std::make_shared<FinishJoints>(cut, in_.pair, tool_length, smooth, near_));
    return true;
  }

  bool chord_holds(const FinishJoints& joints, double tool_length, double from, double to,
                   const JointVector& a, const JointVector& b) const {
    const auto& t = in_.machine.tolerance;
    for (const double share : {0.25, 0.5, 0.75}) {
      const CutterLocation want = joints.tool(from + share * (to - from));
      const JointVector q = a + share * (b - a);
      const CutterLocation at = forward_location(in_.pair.chain(), q);
      if ((at.tip - tool_length * at.axis - want.tip).norm() > kUsed * t.tip * t.budget.chord ||
          (at.axis - want.axis).norm() > kUsed * t.axis * t.budget.chord)
        return false;
    }
    return true;
  }

  JointSample sample_at(const FinishCut& cut, double s, const JointVector& q) const {
    const auto next = std::lower_bound(cut.s.begin() + 1, cut.s.end() - 1, s);
    const auto i = static_cast<std::size_t>(next - cut.s.begin());
    JointSample sample;
    sample.segment = static_cast<std::uint32_t>(cut.first_point + i);
    sample.s = std::clamp((s - cut.s[i - 1]) / (cut.s[i] - cut.s[i - 1]), 0.0, 1.0);
    sample.leg = sample.segment;
    sample.leg_share = sample.s;
    sample.q = q;
    return sample;
  }

  void add_samples(const FinishCut& cut, double tool_length,
                   const std::shared_ptr<const FinishJoints>& joints) {
    PlannedStretch stretch;
    stretch.path = joints;
    stretch.first_sample = out_.joints.samples.size();
    const double usual = std::max(kBlock, in_.machine.dialect.block_time * feed_of());
    double s = 0.0;
    JointVector from = joints->joints(0.0);
    JointSample start;  // the end of the link: the cut's first point
    start.segment = static_cast<std::uint32_t>(cut.first_point);
    start.leg = start.segment;
    start.q = from;
    out_.joints.samples.push_back(start);
    stretch.s.push_back(0.0);
    while (s < cut.length()) {
      const double rest = cut.length() - s;
      double step = rest / std::ceil(rest / usual - 1e-9);
      JointVector to = joints->joints(s + step);
      while (step > 1e-3 && !chord_holds(*joints, tool_length, s, s + step, from, to)) {
        step *= 0.5;
        to = joints->joints(s + step);
      }
      s = rest - step < 1e-9 ? cut.length() : s + step;
      if (s == cut.length()) to = joints->joints(s);
      out_.joints.samples.push_back(sample_at(cut, s, to));
      stretch.s.push_back(s);
      from = to;
    }
    out_.paths.push_back(std::move(stretch));
  }

  const FinishPlanInput& in_;
  const Progress& progress_;
  JointLimits limits_;
  JointVector near_;
  int free_joint_;
  JointVector weight_, jerk_weight_;
  std::pair<double, double> range_;  ///< of the free joint
  std::optional<double> end_;
  mutable SceneCache cache_;
  Diagnostics diagnostics_;
  FinishPlan out_;
};

}  // namespace

Result<FinishPlan> plan_finish(const FinishPlanInput& input, const Progress& progress) {
  return Planner(input, progress).run();
}

Diagnostics finish_notes(const FinishPlan& plan, const MachineDefinition& machine,
                         const std::string& file_name) {
  if (plan.resolutions.empty()) return {};
  std::size_t back = 0, grid = 0;
  double before = 0.0, after = 0.0, lower = INFINITY, upper = -INFINITY;
  for (const FinishResolution& r : plan.resolutions) {
    back += r.wound_back;
    grid += r.seed == "grid";
    before += r.jerk_before;
    after += r.jerk_after;
    lower = std::min({lower, r.start, r.end});
    upper = std::max({upper, r.start, r.end});
  }
  std::string name;
  bool rotary = false;
  for (const AxisDefinition& axis : machine.axes)
    if (axis.joint.redundant) {
      name = axis.name;
      rotary = axis.joint.kind == JointKind::rotary;
    }
  const auto value = [rotary](double v) { return number(rotary ? degrees_from_radians(v) : v); };
  Diagnostic d;
  d.severity = Severity::note;
  d.code = "KN173";
  d.text = name + " is free and goes from cut to cut between " + value(lower) + " and " +
           value(upper) + (rotary ? " deg" : " mm") + "; " + std::to_string(back) + " of " +
           std::to_string(plan.resolutions.size()) + " links turn it in between; " +
           std::to_string(grid) +
           " cuts leave a limit with minimum norm and follow the grid; integral of the squared "
           "joint jerk " +
           (before > 0.0 ? number(100.0 * after / before) : "100") + " % of before smoothing";
  d.where.file = file_name;
  return {d};
}

}  // namespace smoothpost
