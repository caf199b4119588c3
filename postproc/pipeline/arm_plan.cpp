#include "postproc/pipeline/arm_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "kernels/core/units.h"
#include "kernels/kinematics/arm_tracking.h"
#include "kernels/kinematics/inverse.h"
#include "kernels/optimise/spin.h"
#include "postproc/pipeline/plan_messages.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kAxisStep = 2.0 * kRadiansPerDegree;      // between tracked points
constexpr double kTipStep = 25.0;                          // mm
constexpr double kLongestTurn = 45.0 * kRadiansPerDegree;  // of a joint on one tool move
constexpr int kMaxSplits = 30;
constexpr int kCloser = 16;  // parts of a motion that is looked at more closely
constexpr int kCloserLooks = 2;
constexpr int kSpins = 24;
constexpr std::size_t kThinned = 160;   // points on which spins are compared
constexpr double kNearSingular = 0.05;  // of ArmReach::posture: about 3 deg of a wrist or an elbow
constexpr double kTangentSpan = 50.0;   // mm of path for one number of a tangent profile
constexpr double kOpposite = 20.0 * kRadiansPerDegree;

/// The least rotation that takes unit vector a to unit vector b.
Mat3 least_rotation(const Vec3& a, const Vec3& b) {
  return Eigen::Quaterniond::FromTwoVectors(a, b).toRotationMatrix();
}

/// The same for a turning b: c·1 + [a × b] + (a × b)(a × b)ᵀ/(1 + c), c = a·b.
MatrixJet least_rotation_jet(const Vec3& a, const VectorJet& b) {
  Jet c{}, shifted{};
  for (std::size_t r = 0; r < 4; ++r) {
    c[r] = a.dot(b.col(static_cast<Eigen::Index>(r)));
    shifted[r] = c[r] + (r == 0 ? 1.0 : 0.0);
  }
  const VectorJet v = cross_matrix(a) * b;
  const VectorJet scaled = product(reciprocal(shifted), v);
  MatrixJet out;
  for (std::size_t r = 0; r < 4; ++r) {
    const auto i = static_cast<Eigen::Index>(r);
    out[r] = c[r] * Mat3::Identity() + cross_matrix(v.col(i));
    for (std::size_t s = 0; s <= r; ++s)
      out[r] += kLeibniz[r][s] * scaled.col(static_cast<Eigen::Index>(s)) *
                v.col(static_cast<Eigen::Index>(r - s)).transpose();
  }
  return out;
}

class ArmPlanner {
 public:
  ArmPlanner(const SmoothedPath& path, const SixR& arm, const JointPlanSettings& settings,
             const Progress& progress)
      : path_(path),
        arm_(arm),
        inverse_(*Inverse::from(arm.chain())),
        settings_(settings),
        progress_(progress) {}

  /// With the first spin, best first, that has a way without a split; as the best one ends if none.
  Result<JointPlan> run() {
    collect();
    measure_legs();
    choose_reference_axis();
    from_input_ = input_tool_rotation(arm_.chain().tool_axis, settings_.spin);
    const std::vector<double> spins = settings_.spin || settings_.whole_rotation
                                          ? std::vector<double>{settings_.spin.value_or(0.0)}
                                          : spins_by_score();
    if (!settings_.whole_rotation && settings_.spin_policy == "tangent") follow_tangent();
    if (!settings_.whole_rotation && settings_.spin_policy == "optimised") {
      Result<JointPlan> plan = plan_optimised(spins.front());
      if (cancelled_ || (plan.ok() && plan.value().splits.empty())) return plan;
      profile_.reset();  // it knows no turns: the constants are tried as they are
    }
    std::optional<Result<JointPlan>> first;
    for (const double spin : spins) {
      Result<JointPlan> plan = plan_with(spin);
      if (cancelled_ || (plan.ok() && plan.value().splits.empty())) return plan;
      if (!first || (plan.ok() && !first->ok())) first = std::move(plan);
    }
    return std::move(*first);
  }

  std::optional<JointVector> joints_on_leg(std::size_t leg, double share,
                                           const JointVector& near) const {
    return inverse_.nearest(holder(leg, share, spin_), near);
  }

  std::optional<JointJet> jet_on_leg(std::size_t leg, double share, const PoseJet& tool,
                                     const JointJet& near) const {
    const auto q = inverse_.nearest(holder(leg, share, spin_), near.col(0));
    if (!q) return {};
    JointJet known = JointJet::Zero(q->size(), 4);
    known.col(0) = *q;
    FreeJoints free{};
    free.fill(true);
    return joint_jet(arm_.chain(), known, free, holder_jet(leg, share, tool));
  }

 private:
  /// holder() with derivatives by the share of a leg.
  PoseJet holder_jet(std::size_t leg, double share, const PoseJet& pose) const {
    PoseJet out;
    if (settings_.whole_rotation) {
      for (std::size_t r = 0; r < 4; ++r)
        out.rotation[r] = pose.rotation[r] * from_input_.transpose();
    } else {
      VectorJet axis;
      for (std::size_t r = 0; r < 4; ++r)
        axis.col(static_cast<Eigen::Index>(r)) = pose.rotation[r].col(2);
      out.rotation = product(least_rotation_jet(reference_axis_, axis), spin_jet(leg, share));
    }
    out.tip = pose.tip;
    for (std::size_t r = 0; r < 4; ++r)
      out.tip.col(static_cast<Eigen::Index>(r)) +=
          path_.point(leg).tool_length * (out.rotation[r] * arm_.chain().tool_axis);
    return out;
  }

  // The rotation about the reference axis, in front of home_.
  MatrixJet spin_jet(std::size_t leg, double share) const {
    if (!profile_) return constant_matrix_jet(rotation_about(reference_axis_, spin_) * home_);
    Jet angle = profile_->jet(length_at(leg, share));
    const double way = leg_start_[leg + 1] - leg_start_[leg];
    angle = {spin_ + angle[0], way * angle[1], way * way * angle[2], way * way * way * angle[3]};
    const SineCosine turn = sine_cosine(angle);
    MatrixJet out;
    for (int c = 0; c < 3; ++c) {
      const VectorJet column = turned(reference_axis_, turn, constant_jet(Vec3(home_.col(c))));
      for (std::size_t r = 0; r < 4; ++r) out[r].col(c) = column.col(static_cast<Eigen::Index>(r));
    }
    return out;
  }

  Result<JointPlan> plan_optimised(double spin) {
    std::vector<SpinPoint> points;
    for (const JointSample& t : thinned()) {
      SpinPoint point;
      point.tool = holder(t.segment, t.s, spin);
      point.length = length_at(t.segment, t.s);
      point.cut = !points.empty() && !replanned(t.segment);
      points.push_back(point);
    }
    const SpinResult found = optimise_spin(arm_, points, 0.0);
    profile_ = found.profile;
    Result<JointPlan> plan = plan_with(spin);
    if (plan.ok())
      plan.value().spin_gain =
          SpinGain{found.before.margin, found.after.margin, found.before.jerk, found.after.jerk};
    return plan;
  }

  // The input tool frame's X along the way of the tip, as a smooth profile.
  void follow_tangent() {
    const Vec3 x_of_tool = input_tool_rotation(arm_.chain().tool_axis, {}) * Vec3::UnitX();
    std::vector<double> lengths, angles;
    for (std::size_t i = 1; i < tracked_.size(); ++i) {
      const JointSample& t = tracked_[i];
      if (replanned(t.segment)) continue;
      const CutterLocation here = location(t.segment, t.s);
      const Vec3 way = here.tip - location(t.segment, std::max(0.0, t.s - 1e-3)).tip;
      const Vec3 tangent = way - here.axis * here.axis.dot(way);
      if (tangent.norm() < 1e-9) continue;
      const Vec3 x = holder(t.segment, t.s, 0.0).linear() * x_of_tool;
      double angle = std::atan2(tangent.dot(here.axis.cross(x)), tangent.dot(x));
      if (!angles.empty()) angle += 2.0 * kPi * std::round((angles.back() - angle) / (2.0 * kPi));
      lengths.push_back(length_at(t.segment, t.s));
      angles.push_back(angle);
    }
    if (lengths.empty()) return;
    const double wanted = std::min(200.0, lengths.back() / kTangentSpan);
    profile_ = spin_near(lengths, angles, std::max(6, static_cast<int>(wanted)));
  }

  double length_at(std::size_t leg, double s) const {
    return leg_start_[leg] + s * (leg_start_[leg + 1] - leg_start_[leg]);
  }

  void measure_legs() {
    leg_start_ = {0.0};
    for (std::size_t leg = 0; leg <= path_.legs(); ++leg)
      leg_start_.push_back(leg_start_.back() + (replanned(leg) ? 0.0 : path_.length(leg)));
  }

  std::vector<JointSample> thinned() const {
    std::vector<JointSample> some;
    const std::size_t step = tracked_.size() / kThinned + 1;
    for (std::size_t i = 0; i < tracked_.size(); i += step) some.push_back(tracked_[i]);
    some.push_back(tracked_.back());
    return some;
  }

  // The nearest place of each stretch that passes a singular posture.
  std::vector<SingularPlace> singular_places() const {
    const ArmReach reach(arm_);
    std::vector<SingularPlace> places;
    std::array<bool, 3> inside{};
    std::array<std::size_t, 3> last{};
    for (const JointSample& sample : samples_) {
      const ArmReach::Posture p = reach.posture(sample.q);
      const std::array<std::pair<const char*, double>, 3> kinds = {
          {{"wrist", p.wrist}, {"elbow", p.elbow}, {"shoulder", p.shoulder}}};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& [kind, value] = kinds[k];
        if (value >= kNearSingular) {
          inside[k] = false;
          continue;
        }
        if (!inside[k]) {
          inside[k] = true;
          last[k] = places.size();
          places.push_back({line_at(sample.segment), kind, value});
        } else if (value < places[last[k]].measure) {
          places[last[k]] = {line_at(sample.segment), kind, value};
        }
      }
    }
    return places;
  }

  Result<JointPlan> plan_with(double spin) {
    spin_ = spin;
    samples_.clear();
    BranchTracking tracking = track(tracked_, spin_);
    for (int k = 0; k < kCloserLooks && look_closer(tracking); ++k)
      tracking = track(tracked_, spin_);
    JointPlan plan;
    if (tracking.status == BranchTracking::Status::rewind_needed && settings_.may_split) {
      for (const auto& rewind : tracking.rewinds)
        plan.splits.push_back(
            path_.place(tracked_[rewind.point - 1].segment, tracked_[rewind.point - 1].s));
      return Result<JointPlan>(std::move(plan));
    }
    if (tracking.status != BranchTracking::Status::ok)
      return Result<JointPlan>::failure(
          tracking_failure(tracking, line_of(tracking.point), settings_));
    return samples_of(tracking);
  }

  /// Puts points between those that the joints found no way between: beside a singular wrist they
  /// turn far on a short way, and that is no jump. Nothing to do: false.
  bool look_closer(const BranchTracking& tracking) {
    if (tracking.status != BranchTracking::Status::rewind_needed) return false;
    for (auto rewind = tracking.rewinds.rbegin(); rewind != tracking.rewinds.rend(); ++rewind) {
      const JointSample to = tracked_[rewind->point];
      const JointSample& before = tracked_[rewind->point - 1];
      const double from = before.segment == to.segment ? before.s : 0.0;
      std::vector<JointSample> between;
      for (int k = 1; k < kCloser; ++k) {
        JointSample sample;
        sample.segment = to.segment;
        sample.s = from + (to.s - from) * k / kCloser;
        sample.guide = true;
        between.push_back(std::move(sample));
      }
      tracked_.insert(tracked_.begin() + static_cast<std::ptrdiff_t>(rewind->point),
                      between.begin(), between.end());
    }
    return true;
  }

  Result<JointPlan> samples_of(const BranchTracking& tracking) {
    for (std::size_t i = 0; i < tracked_.size(); ++i) {
      JointSample to = tracked_[i];
      to.q = tracking.q[i];
      to.branch = tracking.branch[i];
      if (i > 0 && !replanned(to.segment)) {
        JointSample from = samples_.back();
        if (from.segment != to.segment) {
          from.segment = to.segment;
          from.s = 0.0;
        }
        if (!refine(from, to, 0))
          return Result<JointPlan>::failure(too_steep(line_at(to.segment), settings_));
      }
      samples_.push_back(std::move(to));
      if (i % 4096 == 0 &&
          !progress_("kinematics", static_cast<double>(i) / static_cast<double>(tracked_.size()))) {
        cancelled_ = true;
        return Result<JointPlan>::failure(plan_cancelled());
      }
    }
    JointPlan plan;
    plan.singular = singular_places();
    drop_guides(samples_, [this](const JointSample& a, const JointSample& b) {
      return (a.q - b.q).cwiseAbs().maxCoeff() < kLongestTurn && follows(a, b);
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

  bool replanned(std::size_t segment) const {
    return segment > 0 && path_.point(segment).replanned;
  }
  std::uint32_t line_at(std::size_t segment) const { return path_.point(segment).line; }
  std::uint32_t line_of(std::size_t tracked) const { return line_at(tracked_[tracked].segment); }

  CutterLocation location(std::size_t segment, double s) const { return path_.at(segment, s); }

  void add(std::size_t segment, double s) {
    JointSample sample;
    sample.segment = static_cast<std::uint32_t>(segment);
    sample.s = s;
    tracked_.push_back(std::move(sample));
  }

  void collect() {
    if (path_.legs() == 0 || !replanned(1)) add(0, 1.0);
    for (std::size_t k = 1; k <= path_.legs(); ++k) {
      if (!replanned(k)) {
        const std::vector<double> breaks = path_.breaks(k);
        for (std::size_t b = 1; b < breaks.size(); ++b) {
          subdivide(k, breaks[b - 1], breaks[b], 0);
          tracked_.back().guide = b + 1 < breaks.size();
        }
      } else if (k < path_.legs() && !replanned(k + 1))
        add(k, 1.0);
    }
  }

  void subdivide(std::size_t segment, double from, double to, int depth) {
    const CutterLocation a = location(segment, from);
    const CutterLocation b = location(segment, to);
    const auto bend = path_.second_derivative_bound(segment, from, to);
    const double span = to - from;
    const bool turns = std::sqrt(bend.axis) * span > kAxisStep;
    const bool bends = span * span * bend.tip / 8.0 > kTipStep;
    if (depth < kMaxSplits && (turns || bends || (a.tip - b.tip).norm() > kTipStep)) {
      const double mid = 0.5 * (from + to);
      subdivide(segment, from, mid, depth + 1);
      tracked_.back().guide = true;
      subdivide(segment, mid, to, depth + 1);
      return;
    }
    add(segment, to);
  }

  // The axis of W that the path's tool axes stay farthest from the opposite of; +Z when it will do.
  void choose_reference_axis() {
    const std::array<Vec3, 6> axes = {Vec3::UnitZ(),  Vec3::UnitX(),  Vec3::UnitY(),
                                      -Vec3::UnitX(), -Vec3::UnitY(), -Vec3::UnitZ()};
    double best = -1.0;
    for (const Vec3& axis : axes) {
      double least = kPi;
      for (const auto& t : tracked_)
        least = std::min(least, angle_between(location(t.segment, t.s).axis, -axis));
      if (least <= best) continue;
      best = least;
      reference_axis_ = axis;
      if (least > kOpposite) break;
    }
    const Mat3 home = forward(arm_.chain(), settings_.held).linear();
    home_ = least_rotation(home * arm_.chain().tool_axis, reference_axis_) * home;
  }

  Pose holder(std::size_t segment, double s, double spin) const {
    const CutterLocation at = location(segment, s);
    Pose pose = Pose::Identity();
    if (settings_.whole_rotation)
      pose.linear() = path_.rotation_at(segment, s) * from_input_.transpose();
    else
      pose.linear() =
          least_rotation(reference_axis_, at.axis) *
          rotation_about(reference_axis_,
                         spin + (profile_ ? profile_->at(length_at(segment, s)) : 0.0)) *
          home_;
    pose.translation() = at.tip;
    return holder_pose(arm_.chain(), pose, path_.point(segment).tool_length);
  }

  BranchTracking track(const std::vector<JointSample>& samples, double spin) const {
    std::vector<ArmPoint> points(samples.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i].tool = holder(samples[i].segment, samples[i].s, spin);
      points[i].line = line_at(samples[i].segment);
      points[i].cut = i > 0 && !replanned(samples[i].segment);
    }
    ArmTrackingSettings s;
    s.start = settings_.held;
    return track_arm(arm_, points, s);
  }

  // Share of the range that is left at the tightest joint, and the sine of the wrist's angle.
  double margin(const JointVector& q) const {
    double least = 1.0;
    for (int j = 0; j < 6; ++j) {
      const ChainJoint& joint = arm_.chain().joints[static_cast<std::size_t>(j)];
      const double half = 0.5 * (joint.upper - joint.lower);
      least = std::min(least, 1.0 - std::abs(q[j] - 0.5 * (joint.upper + joint.lower)) / half);
    }
    const Mat3 wrist = jacobian(arm_.chain(), q).block<3, 3>(0, 3);
    return std::min(least, std::abs(wrist.determinant()));
  }

  std::vector<double> spins_by_score() const {
    // Neighbours on the thinned path are far apart: only reach, limits and posture count there.
    const std::vector<JointSample> some = thinned();
    std::vector<std::pair<double, double>> scored;  // score, spin
    for (int k = 0; k < kSpins; ++k) {
      const double spin = 2.0 * kPi / kSpins * ((k % 2 == 1) ? -(k + 1) / 2 : k / 2);
      scored.emplace_back(score_of(some, spin), spin);
    }
    std::stable_sort(scored.begin(), scored.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<double> spins;
    for (const auto& entry : scored) spins.push_back(entry.second);
    return spins;
  }

  // Of the branch that serves the whole thinned path best; unreachable points count −1 each.
  double score_of(const std::vector<JointSample>& some, double spin) const {
    std::array<double, 8> score;
    score.fill(1.0);
    for (const auto& t : some) {
      const SixRSolutions solved = arm_.solve(holder(t.segment, t.s, spin), settings_.held);
      for (std::size_t b = 0; b < 8; ++b) {
        double here = -1.0;
        if (solved.valid[b]) {
          JointVector q = solved.q[b];
          for (int j = 0; j < 6; ++j) {
            const ChainJoint& joint = arm_.chain().joints[static_cast<std::size_t>(j)];
            const double middle = 0.5 * (joint.upper + joint.lower);
            q[j] += 2.0 * kPi * std::round((middle - q[j]) / (2.0 * kPi));
          }
          here = margin(q);
        }
        if (here < 0.0)
          score[b] = std::min(score[b], 0.0) - 1.0;
        else
          score[b] = std::min(score[b], here);
      }
    }
    return *std::max_element(score.begin(), score.end());
  }

  bool refine(const JointSample& from, const JointSample& to, int depth) {
    if (follows(from, to)) return true;
    if (depth >= kMaxSplits) return false;
    JointSample mid;
    mid.segment = to.segment;
    mid.s = 0.5 * (from.s + to.s);
    const auto q = inverse_.nearest(holder(mid.segment, mid.s, spin_), 0.5 * (from.q + to.q));
    if (!q) return false;
    mid.q = *q;
    mid.branch = to.branch;
    if (!refine(from, mid, depth + 1)) return false;
    samples_.push_back(mid);
    return refine(mid, to, depth + 1);
  }

  bool follows(const JointSample& from, const JointSample& to) const {
    const ScrewChain& chain = arm_.chain();
    const double length = path_.point(to.segment).tool_length;
    const Pose a = tip_pose(chain, from.q, length);
    const Pose b = tip_pose(chain, to.q, length);
    const double allowance = settings_.tool_moves ? turn_allowance(a, b, ToolTurn::slerp) : 0.0;
    for (const double t : {0.25, 0.5, 0.75}) {
      const CutterLocation wanted = path_.at(to.segment, from.s + t * (to.s - from.s));
      const Pose pose = settings_.tool_moves
                            ? tool_motion(a, b, t, ToolTurn::slerp, chain.tool_axis)
                            : tip_pose(chain, from.q + t * (to.q - from.q), length);
      if ((pose.translation() - wanted.tip).norm() > 0.8 * settings_.tip_tolerance) return false;
      if ((pose.linear() * chain.tool_axis - wanted.axis).norm() + allowance >
          0.8 * settings_.axis_tolerance)
        return false;
      if (!settings_.whole_rotation) continue;
      const Mat3 rotation = path_.rotation_at(to.segment, from.s + t * (to.s - from.s));
      const double angle = rotation_log(rotation.transpose() * pose.linear() * from_input_).norm();
      if (angle + allowance > 0.8 * settings_.axis_tolerance) return false;
    }
    return true;
  }

  const SmoothedPath& path_;
  const SixR& arm_;
  const Inverse inverse_;
  const JointPlanSettings settings_;
  const Progress& progress_;
  Vec3 reference_axis_ = Vec3::UnitZ();
  Mat3 from_input_ = Mat3::Identity();
  Mat3 home_ = Mat3::Identity();  ///< rotation with the tool along the reference axis, ψ = 0
  double spin_ = 0.0;
  std::optional<SpinProfile> profile_;  ///< added to spin_
  std::vector<double> leg_start_;       ///< mm along the path, without links
  bool cancelled_ = false;
  std::vector<JointSample> tracked_;
  std::vector<JointSample> samples_;
};

}  // namespace

Result<JointPlan> plan_arm(const SmoothedPath& path, const SixR& arm,
                           const JointPlanSettings& settings, const Progress& progress) {
  const auto planner = std::make_shared<ArmPlanner>(path, arm, settings, progress);
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
