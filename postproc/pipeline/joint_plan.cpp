#include "postproc/pipeline/joint_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "kernels/core/units.h"
#include "kernels/kinematics/branch_tracking.h"
#include "postproc/pipeline/plan_messages.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kAxisStep = 2.0 * kRadiansPerDegree;  // between tracked points
constexpr double kRotaryStep =
    30.0 * kRadiansPerDegree;  // of the first rotary, outside the pole cap
constexpr double kTurnCap =
    1.5;  // of the cap: where the first rotary may turn with the axis on the pole
constexpr int kMaxSplits = 40;
constexpr double kOnPole = 1e-8;                         // rad
constexpr double kRadialTurn = 5.0 * kRadiansPerDegree;  // of a radial leg, about the pole
constexpr double kNearPole = 0.01;  // of a radial leg: where it is looked at for the pole
constexpr int kRimRounds = 40, kRimSteps = 16;  // to find the rim of the cap, and the way to it

double nearest_turn(double angle, double reference) {
  return angle + 2.0 * kPi * std::round((reference - angle) / (2.0 * kPi));
}

class Planner {
 public:
  Planner(const SmoothedPath& path, const RotaryPair& pair, const JointPlanSettings& settings,
          const Progress& progress)
      : path_(path), pair_(pair), settings_(settings), progress_(progress) {
    // The pole is the first rotary's own direction, seen from the part; it does not move with the
    // path.
    pole_ = jacobian(pair.chain(), settings.held).col(pair.first_rotary()).head<3>().normalized();
    cap_ = 0.4 * settings.axis_tolerance;
    radial_.assign(path.legs() + 1, false);
    for (std::size_t leg = 1; leg <= path.legs(); ++leg)
      if (!replanned(leg)) radial_[leg] = is_radial(leg);
  }

  Result<JointPlan> run() {
    collect_tracked();
    const BranchTracking tracking = track();
    if (tracking.status == BranchTracking::Status::rewind_needed && settings_.may_split)
      return Result<JointPlan>(splits(tracking));
    if (tracking.status != BranchTracking::Status::ok)
      return Result<JointPlan>::failure(tracking_failure(
          tracking, path_.point(tracked_[tracking.point].segment).line, settings_));
    for (std::size_t i = 0; i < tracked_.size(); ++i) {
      JointSample to = tracked_[i];
      to.q = tracking.q[i];
      to.branch = tracking.branch[i];
      turn_with_path(tracking, i, to);
      if (i > 0 && !replanned(to.segment)) {
        const JointSample from = at_start_of(samples_.back(), to.segment);
        if (!refine(from, to, 0))
          return Result<JointPlan>::failure(too_steep(path_.point(to.segment).line, settings_));
      }
      samples_.push_back(std::move(to));
      if (i % 4096 == 0 &&
          !progress_("kinematics", static_cast<double>(i) / static_cast<double>(tracked_.size())))
        return Result<JointPlan>::failure(plan_cancelled());
    }
    JointPlan plan;
    drop_guides(samples_, [this](const JointSample& a, const JointSample& b) {
      return settings_.tool_moves ? tool_takes_joints(a, b) && follows_by_tool(a, b)
                                  : follows(a, b);
    });
    for (JointSample& sample : samples_) {
      sample.leg = sample.segment;
      sample.leg_share = sample.s;
      const PathPlace on_input = path_.place(sample.segment, sample.s);
      sample.segment = on_input.segment;
      sample.s = on_input.s;
    }
    plan.samples = std::move(samples_);
    return Result<JointPlan>(std::move(plan));
  }

  std::optional<JointVector> joints_on_leg(std::size_t leg, double share,
                                           const JointVector& near) const {
    JointSample there;
    there.segment = static_cast<std::uint32_t>(leg);
    there.s = share;
    if (!place(there, near, 1.0)) return {};
    return there.q;
  }

  std::optional<JointJet> jet_on_leg(std::size_t leg, double share, const PoseJet& tool,
                                     const JointJet& near) const {
    JointSample there;
    there.segment = static_cast<std::uint32_t>(leg);
    there.s = share;
    if (!place(there, near.col(0), 1.0)) return {};
    JointJet q = JointJet::Zero(near.rows(), 4);
    q.col(0) = there.q;
    FreeJoints free{};
    for (std::size_t j = 0; j < pair_.chain().joints.size(); ++j)
      free[j] = !pair_.chain().joints[j].redundant;
    LocationJet target{tool.tip, VectorJet::Zero()};
    for (std::size_t r = 0; r < 4; ++r)
      target.axis.col(static_cast<Eigen::Index>(r)) = tool.rotation[r].col(2);
    if (on_pole(leg, target.axis.col(0))) {
      target.axis = constant_jet(target.axis.col(0).dot(pole_) > 0.0 ? pole_ : Vec3(-pole_));
      const int first = pair_.first_rotary();
      free[static_cast<std::size_t>(first)] = false;
      q(first, 1) = near(first, 1);
    }
    target.tip += path_.point(leg).tool_length * target.axis;
    return joint_jet(pair_.chain(), q, free, target);
  }

 private:
  bool replanned(std::size_t segment) const {
    return segment > 0 && path_.point(segment).replanned;
  }

  static JointSample at_start_of(JointSample sample, std::uint32_t segment) {
    if (sample.segment != segment) {
      sample.segment = segment;
      sample.s = 0.0;
    }
    return sample;
  }

  // A leg that leaves the cap straight from its end inside it, or goes there: its joints are smooth
  // up to that end as they are, so the cap is no help.
  bool is_radial(std::size_t leg) const {
    const Vec3 first = path_.at(leg, 0.0).axis, last = path_.at(leg, 1.0).axis;
    if (in_cap(first) == in_cap(last)) return false;
    const double end = in_cap(first) ? 0.0 : 1.0;
    const Vec3& inside = in_cap(first) ? first : last;
    if (in_cap(inside, kOnPole / cap_)) return true;
    const Vec3 rim = path_.at(leg, rim_between(leg, end, 1.0 - end)).axis;
    const auto sideways = [this](const Vec3& axis) {
      return (axis - pole_ * pole_.dot(axis)).normalized();
    };
    return angle_between(sideways(inside), sideways(rim)) < kRadialTurn;
  }

  // A share of the leg outside the cap where it leaves it, from one inside to one outside.
  double rim_between(std::size_t leg, double inside, double outside) const {
    for (int k = 0; k < kRimRounds; ++k) {
      const double middle = 0.5 * (inside + outside);
      (in_cap(path_.at(leg, middle).axis) ? inside : outside) = middle;
    }
    return outside;
  }

  // Whether the pose at that place of the path is put onto the pole.
  bool on_pole(std::size_t segment, const Vec3& axis, double cap_share = 1.0) const {
    return in_cap(axis, radial_[segment] ? kOnPole / cap_ : cap_share);
  }

  // The pose asked of the chain: of the holder, with an axis inside the cap put onto the pole.
  CutterLocation target(std::size_t segment, double s, double cap_share = 1.0) const {
    CutterLocation location = path_.at(segment, s);
    const double tool_length = path_.point(segment).tool_length;
    if (on_pole(segment, location.axis, cap_share))
      location.axis = location.axis.dot(pole_) > 0.0 ? pole_ : Vec3(-pole_);
    return holder_location(location, tool_length);
  }

  bool in_cap(const Vec3& axis, double cap_share = 1.0) const {
    return std::min(angle_between(axis, pole_), angle_between(axis, -pole_)) <= cap_share * cap_;
  }

  void collect_tracked() {
    if (path_.legs() == 0 || !replanned(1)) add_tracked(0, 1.0, target(0, 1.0));
    for (std::size_t k = 1; k <= path_.legs(); ++k) {
      if (!replanned(k)) {
        const std::vector<double> breaks = path_.breaks(k);
        for (std::size_t b = 1; b < breaks.size(); ++b) {
          subdivide(k, {breaks[b - 1], target(k, breaks[b - 1])}, {breaks[b], target(k, breaks[b])},
                    0);
          tracked_.back().guide = b + 1 < breaks.size();
        }
      } else if (k < path_.legs() && !replanned(k + 1)) {
        add_tracked(k, 1.0, target(k, 1.0));
      }
    }
  }

  struct Node {
    double s;
    CutterLocation location;
  };

  void subdivide(std::size_t segment, const Node& from, const Node& to, int depth) {
    // A full turn of a rotary has equal ends: the input's own turn decides, not only what the ends
    // show.
    const double mid_s = 0.5 * (from.s + to.s);
    const bool may_turn = total_turn(segment, from.s, to.s) * (to.s - from.s) > kRotaryStep;
    if (depth < kMaxSplits && (may_turn || too_far(from.location, to.location))) {
      const Node mid{mid_s, target(segment, mid_s)};
      subdivide(segment, from, mid, depth + 1);
      tracked_.back().guide = true;
      subdivide(segment, mid, to, depth + 1);
      return;
    }
    add_tracked(segment, to.s, to.location);
  }

  // A bound of the angle that the tool axis sweeps on a segment: the bound of |axis''| is its
  // square.
  double total_turn(std::size_t segment, double from, double to) const {
    return std::sqrt(path_.second_derivative_bound(segment, from, to).axis);
  }

  bool too_far(const CutterLocation& a, const CutterLocation& b) const {
    const double step = angle_between(a.axis, b.axis);
    if (step > kAxisStep) return true;
    if (step < 0.25 * cap_ || in_cap(a.axis) || in_cap(b.axis)) return false;
    // Outside the cap the first rotary turns with the azimuth about the pole.
    const Vec3 pa = a.axis - pole_ * pole_.dot(a.axis);
    const Vec3 pb = b.axis - pole_ * pole_.dot(b.axis);
    return angle_between(pa.normalized(), pb.normalized()) > kRotaryStep;
  }

  void add_tracked(std::size_t segment, double s, CutterLocation location) {
    JointSample sample;
    sample.segment = static_cast<std::uint32_t>(segment);
    sample.s = s;
    tracked_.push_back(std::move(sample));
    locations_.push_back(std::move(location));
  }

  BranchTracking track() const {
    std::vector<TrackingPoint> points(tracked_.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PathPoint& p = path_.point(tracked_[i].segment);
      points[i].location = locations_[i];
      points[i].line = p.line;
      // With the axis on the pole the first rotary is free; where it has to turn, it turns on a
      // rapid.
      const bool may_turn = i > 0 && p.kind == MotionKind::rapid &&
                            in_cap(locations_[i - 1].axis) && in_cap(locations_[i].axis);
      points[i].cut = !p.replanned && !may_turn;
    }
    BranchTrackingSettings s;
    s.held = settings_.held;
    s.pole_cap = cap_ * 1e-3;  // axes inside the cap stand on the pole already
    return track_branches(pair_, points, s);
  }

  // On the pole the first rotary is free, and tracking leaves it where a neighbour has it. Where
  // the path leaves the pole on one side alone, it belongs where the joints of that side come from:
  // as they go on to the pole from outside its cap.
  void turn_with_path(const BranchTracking& tracking, std::size_t i, JointSample& at_pole) {
    const JointSample& pole = tracked_[i];
    if (!on_pole(pole.segment, path_.at(pole.segment, pole.s).axis)) return;
    const auto leaves = [this](const JointSample& to) {
      return !in_cap(path_.at(to.segment, to.s).axis);
    };
    const bool before = i > 0 && !replanned(pole.segment) && leaves(tracked_[i - 1]);
    const bool behind =
        i + 1 < tracked_.size() && !replanned(tracked_[i + 1].segment) && leaves(tracked_[i + 1]);
    if (before == behind) return;
    const std::size_t neighbour = before ? i - 1 : i + 1;
    const std::size_t segment = before ? pole.segment : tracked_[neighbour].segment;
    const auto share = [&](const JointSample& s) { return s.segment == segment ? s.s : 0.0; };
    const double end = share(pole), from = share(tracked_[neighbour]);
    const double outside =
        radial_[segment] ? end + kNearPole * (from - end) : rim_between(segment, end, from);
    // By three places of equal distances that end at the pole.
    const double step = std::min(std::abs(outside - end), 0.25 * std::abs(from - end));
    if (!(std::abs(outside - end) <= 2.0 * step)) return;
    const double sign = from > end ? 1.0 : -1.0;
    const int first = pair_.first_rotary();
    JointVector q = tracking.q[neighbour];
    std::array<double, 3> turn{};
    const auto go_to = [&](double place_share) {
      JointSample there;
      there.segment = static_cast<std::uint32_t>(segment);
      there.s = place_share;
      if (!place(there, q, 1.0)) return false;
      q = there.q;
      return true;
    };
    const double far = outside + 2.0 * sign * step;
    for (int k = 1; k <= kRimSteps; ++k)
      if (!go_to(from + (far - from) * k / kRimSteps)) return;
    for (std::size_t k = 3; k-- > 0;) {
      if (!go_to(outside + sign * step * static_cast<double>(k))) return;
      turn[k] = q[first];
    }
    const double t = -std::abs(outside - end) / step;  // of the pole, with the rim at 0
    JointVector wanted = at_pole.q;
    wanted[first] = turn[0] + t * (turn[1] - turn[0]) +
                    0.5 * t * (t - 1.0) * (turn[2] - 2.0 * turn[1] + turn[0]);
    JointSample turned = at_pole;
    if (place(turned, wanted, 1.0)) at_pole = std::move(turned);
  }

  // Splits [from, to] until straight joint motion follows the reference; appends the samples
  // between.
  bool refine(const JointSample& from, JointSample& to, int depth) {
    if (settings_.tool_moves) {
      const bool joints_go = tool_takes_joints(from, to);
      if (joints_go && follows_by_tool(from, to)) return true;
      if (!joints_go && follows(from, to)) return to.by_joints = true;
    } else if (follows(from, to)) {
      return true;
    }
    if (depth >= kMaxSplits) return false;
    JointSample mid;
    mid.segment = to.segment;
    mid.s = 0.5 * (from.s + to.s);
    const JointVector mean = 0.5 * (from.q + to.q);
    if (!place(mid, mean, 1.0)) return false;
    // At the rim of the cap the first rotary is on one side of the step whatever the share s is:
    // there the axis goes onto the pole for the turn, still inside the tolerance.
    const int first = pair_.first_rotary();
    const double step = std::abs(to.q[first] - from.q[first]);
    if (step > 1e-9 && std::abs(mid.q[first] - mean[first]) > 0.35 * step &&
        in_cap(path_.at(to.segment, from.s).axis, kTurnCap) &&
        in_cap(path_.at(to.segment, to.s).axis, kTurnCap)) {
      if (!place(mid, mean, kTurnCap)) return false;
    }
    if (!refine(from, mid, depth + 1)) return false;
    samples_.push_back(mid);
    return refine(mid, to, depth + 1);
  }

  // Sets mid.q and mid.branch to the solution nearest to `mean`.
  bool place(JointSample& mid, const JointVector& mean, double cap_share) const {
    const RotaryPairSolutions solutions = pair_.solve(target(mid.segment, mid.s, cap_share), mean);
    double best = INFINITY;
    for (int b = 0; b < 2; ++b) {
      if (!solutions.valid[static_cast<std::size_t>(b)]) continue;
      JointVector q = solutions.q[static_cast<std::size_t>(b)];
      double distance = 0.0;
      for (const int j : {pair_.first_rotary(), pair_.second_rotary()}) {
        q[j] = nearest_turn(q[j], mean[j]);
        distance += std::abs(q[j] - mean[j]);
      }
      if (distance >= best) continue;
      best = distance;
      mid.q = q;
      mid.branch = b;
    }
    return best < INFINITY;
  }

  bool follows(const JointSample& from, const JointSample& to) const {
    const double tool_length = path_.point(to.segment).tool_length;
    for (const double t : {0.25, 0.5, 0.75}) {
      const CutterLocation wanted = path_.at(to.segment, from.s + t * (to.s - from.s));
      const JointVector q = from.q + t * (to.q - from.q);
      const CutterLocation holder = forward_location(pair_.chain(), q);
      const Vec3 tip = holder.tip - tool_length * holder.axis;
      if ((tip - wanted.tip).norm() > 0.8 * settings_.tip_tolerance) return false;
      if ((holder.axis - wanted.axis).norm() > 0.8 * settings_.axis_tolerance) return false;
    }
    return true;
  }

  // Whether the joints come from the one end to the other without a jump when the tool leads them.
  bool tool_takes_joints(const JointSample& from, const JointSample& to) const {
    constexpr int kSteps = 8;
    constexpr double kUneven = 2.5;  // times the mean step
    constexpr double kAtOnce = 0.02 * kRadiansPerDegree;
    double whole = 0.0;
    for (const int j : {pair_.first_rotary(), pair_.second_rotary()})
      whole = std::max(whole, std::abs(to.q[j] - from.q[j]));
    const double largest = std::max(kUneven * whole / kSteps, kAtOnce);
    const double tool_length = path_.point(to.segment).tool_length;
    const CutterLocation a = tip_at(from.q, tool_length);
    const CutterLocation b = tip_at(to.q, tool_length);
    JointVector q = from.q;
    for (int k = 1; k <= kSteps; ++k) {
      const double t = static_cast<double>(k) / kSteps;
      const CutterLocation at{a.tip + t * (b.tip - a.tip), great_circle(a.axis, b.axis, t)};
      const RotaryPairSolutions solutions = pair_.solve(holder_location(at, tool_length), q);
      double best = INFINITY;
      JointVector next = q;
      for (std::size_t branch = 0; branch < 2; ++branch) {
        if (!solutions.valid[branch]) continue;
        JointVector candidate = solutions.q[branch];
        double step = 0.0;
        for (const int j : {pair_.first_rotary(), pair_.second_rotary()}) {
          candidate[j] = nearest_turn(candidate[j], q[j]);
          step = std::max(step, std::abs(candidate[j] - q[j]));
        }
        if (step >= best) continue;
        best = step;
        next = candidate;
      }
      if (best > largest) return false;
      q = next;
    }
    return (q - to.q).lpNorm<Eigen::Infinity>() < 1e-6;
  }

  // The controller keeps the tip straight and takes the axis along the great circle.
  bool follows_by_tool(const JointSample& from, const JointSample& to) const {
    const double tool_length = path_.point(to.segment).tool_length;
    const CutterLocation a = tip_at(from.q, tool_length);
    const CutterLocation b = tip_at(to.q, tool_length);
    for (const double t : {0.25, 0.5, 0.75}) {
      const CutterLocation wanted = path_.at(to.segment, from.s + t * (to.s - from.s));
      const Vec3 tip = a.tip + t * (b.tip - a.tip);
      if ((tip - wanted.tip).norm() > 0.8 * settings_.tip_tolerance) return false;
      if ((great_circle(a.axis, b.axis, t) - wanted.axis).norm() > 0.8 * settings_.axis_tolerance)
        return false;
    }
    return true;
  }

  CutterLocation tip_at(const JointVector& q, double tool_length) const {
    const CutterLocation holder = forward_location(pair_.chain(), q);
    return {holder.tip - tool_length * holder.axis, holder.axis};
  }

  // The last place that can be reached before each dead end.
  JointPlan splits(const BranchTracking& tracking) const {
    JointPlan plan;
    for (const auto& rewind : tracking.rewinds) {
      const JointSample& before = tracked_[rewind.point - 1];
      plan.splits.push_back(path_.place(before.segment, before.s));
    }
    return plan;
  }

  const SmoothedPath& path_;
  std::vector<bool> radial_;  ///< one a leg
  const RotaryPair& pair_;
  const JointPlanSettings settings_;
  const Progress& progress_;
  Vec3 pole_;
  double cap_ = 0.0;
  std::vector<JointSample> tracked_;
  std::vector<CutterLocation> locations_;
  std::vector<JointSample> samples_;
};

}  // namespace

CutterLocation holder_location(const CutterLocation& tip, double tool_length) {
  return {tip.tip + tool_length * tip.axis, tip.axis};
}

Result<JointPlan> plan_joints(const SmoothedPath& path, const RotaryPair& pair,
                              const JointPlanSettings& settings, const Progress& progress) {
  const auto planner = std::make_shared<Planner>(path, pair, settings, progress);
  Result<JointPlan> plan = planner->run();
  if (plan.ok()) {
    plan.value().joints_on_leg = [planner](std::size_t leg, double share, const JointVector& near) {
      return planner->joints_on_leg(leg, share, near);
    };
    plan.value().jet_on_leg = [planner](std::size_t leg, double share, const PoseJet& tool,
                                        const JointJet& near) {
      return planner->jet_on_leg(leg, share, tool, near);
    };
  }
  return plan;
}

}  // namespace smoothpost
