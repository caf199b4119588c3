#include "kernels/kinematics/arm_tracking.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/kinematics/track_candidates.h"

namespace smoothpost {
namespace {

constexpr double kTurn = 2.0 * kPi;
constexpr double kStartWeight = 0.01;
constexpr std::size_t kMostCandidates = 512;  // of one point

struct Candidate {
  JointVector q;
  int branch = 0;
  double cost = INFINITY;
  int from = -1;  ///< candidate of the point before
};

class Tracker {
 public:
  Tracker(const SixR& arm, const std::vector<ArmPoint>& points, const ArmTrackingSettings& settings)
      : arm_(arm), points_(points), settings_(settings) {}

  BranchTracking run() {
    JointVector near = settings_.start;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      layers_.push_back(candidates(i, near));
      if (layers_.back().empty()) return fail(i);
      if (i == 0)
        start();
      else if (!step(i))
        dead_end(i);
      near = best(layers_.back()).q;
    }
    if (!out_.rewinds.empty()) {
      out_.status = BranchTracking::Status::rewind_needed;
      out_.point = out_.rewinds.front().point;
      out_.joint = out_.rewinds.front().joint;
      out_.reason = out_.rewinds.front().reason;
      return std::move(out_);
    }
    take();
    return std::move(out_);
  }

 private:
  static const Candidate& best(const std::vector<Candidate>& layer) {
    return *std::min_element(
        layer.begin(), layer.end(),
        [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  }

  std::vector<Candidate> candidates(std::size_t i, const JointVector& near) const {
    const SixRSolutions solved = arm_.solve(points_[i].tool, near);
    std::vector<Candidate> layer;
    for (int b = 0; b < 8; ++b) {
      if (!solved.valid[static_cast<std::size_t>(b)]) continue;
      // Both wrist branches of a singular wrist are one and the same.
      if ((b & 4) != 0 && solved.wrist_singular[static_cast<std::size_t>(b & 3)]) continue;
      add_turns(solved.q[static_cast<std::size_t>(b)], b, layer);
    }
    return layer;
  }

  void add_turns(const JointVector& q, int branch, std::vector<Candidate>& layer) const {
    std::array<TurnRange, 6> turns;
    for (int j = 0; j < 6; ++j) {
      const ChainJoint& joint = arm_.chain().joints[static_cast<std::size_t>(j)];
      turns[static_cast<std::size_t>(j)] = turns_within(q[j], joint.lower, joint.upper);
      if (turns[static_cast<std::size_t>(j)].last < turns[static_cast<std::size_t>(j)].first)
        return;
    }
    std::array<int, 6> n{};
    for (std::size_t j = 0; j < 6; ++j) n[j] = turns[j].first;
    while (layer.size() < kMostCandidates) {
      Candidate c;
      c.q = q;
      c.branch = branch;
      for (int j = 0; j < 6; ++j) c.q[j] += kTurn * n[static_cast<std::size_t>(j)];
      layer.push_back(std::move(c));
      std::size_t j = 0;
      while (j < 6 && n[j] == turns[j].last) {
        n[j] = turns[j].first;
        ++j;
      }
      if (j == 6) return;
      ++n[j];
    }
  }

  void start() {
    for (Candidate& c : layers_.front())
      c.cost = kStartWeight * (c.q - settings_.start).lpNorm<1>();
  }

  bool step(std::size_t i) {
    const auto& before = layers_[i - 1];
    const double limit = points_[i].cut ? settings_.continuity + 1e-12 : INFINITY;
    bool any = false;
    for (Candidate& c : layers_[i]) {
      for (std::size_t k = 0; k < before.size(); ++k) {
        if (!(before[k].cost < c.cost)) continue;
        const JointVector change = c.q - before[k].q;
        if (change.lpNorm<Eigen::Infinity>() > limit) continue;
        const double cost = before[k].cost + change.lpNorm<1>();
        if (cost >= c.cost) continue;
        c.cost = cost;
        c.from = static_cast<int>(k);
        any = true;
      }
    }
    return any;
  }

  // The cut ends before point i; the search goes on as if the motion into it did not cut.
  void dead_end(std::size_t i) {
    const auto& before = layers_[i - 1];
    const Candidate& last = best(before);
    Rewind rewind{i, points_[i].line, 0, ""};
    explain(i, last, rewind);
    out_.rewinds.push_back(std::move(rewind));
    for (Candidate& c : layers_[i]) {
      c.cost = last.cost + (c.q - last.q).lpNorm<1>();
      c.from = static_cast<int>(&last - before.data());
    }
  }

  void explain(std::size_t i, const Candidate& last, Rewind& rewind) const {
    const SixRSolutions solved = arm_.solve(points_[i].tool, last.q);
    const auto b = static_cast<std::size_t>(last.branch);
    if (!solved.valid[b]) {
      rewind.reason = "the arm cannot reach on in the posture that the cut has";
      return;
    }
    for (int j = 0; j < 6; ++j) {
      const ChainJoint& joint = arm_.chain().joints[static_cast<std::size_t>(j)];
      const double value =
          solved.q[b][j] + kTurn * std::round((last.q[j] - solved.q[b][j]) / kTurn);
      if (value >= joint.lower - 1e-9 && value <= joint.upper + 1e-9 &&
          std::abs(value - last.q[j]) <= settings_.continuity)
        continue;
      rewind.joint = j;
      rewind.reason = std::abs(value - last.q[j]) > settings_.continuity
                          ? "joint " + std::to_string(j + 1) + " would turn by " +
                                describe_number(std::abs(value - last.q[j]) * kDegreesPerRadian) +
                                " degrees at once (the arm is near a singular posture)"
                          : describe_breach(arm_.chain(), {j, value}) +
                                ", and the cut leaves no motion to turn back on";
      return;
    }
  }

  BranchTracking fail(std::size_t i) {
    out_.point = i;
    const SixRSolutions solved = arm_.solve(points_[i].tool, settings_.start);
    const bool any =
        std::any_of(solved.valid.begin(), solved.valid.end(), [](bool v) { return v; });
    out_.status = any ? BranchTracking::Status::over_limit : BranchTracking::Status::unreachable;
    const Vec3 tip = points_[i].tool.translation();
    const std::string place = "the tip at (" + describe_number(tip.x()) + ", " +
                              describe_number(tip.y()) + ", " + describe_number(tip.z()) + ") mm";
    out_.reason = any ? nearest_breach(solved) : "the arm is too short or too long for " + place;
    return std::move(out_);
  }

  // Of the branches the one that breaks its limits by least.
  std::string nearest_breach(const SixRSolutions& solved) const {
    double least = INFINITY;
    LimitBreach found;
    for (std::size_t b = 0; b < 8; ++b) {
      if (!solved.valid[b]) continue;
      double worst = 0.0;
      LimitBreach breach;
      for (int j = 0; j < 6; ++j) {
        const ChainJoint& joint = arm_.chain().joints[static_cast<std::size_t>(j)];
        const double middle = 0.5 * (joint.lower + joint.upper);
        const double value = solved.q[b][j] + kTurn * std::round((middle - solved.q[b][j]) / kTurn);
        const double over = std::max(joint.lower - value, value - joint.upper);
        if (over <= worst) continue;
        worst = over;
        breach = {j, value};
      }
      if (worst >= least) continue;
      least = worst;
      found = breach;
    }
    return describe_breach(arm_.chain(), found);
  }

  void take() {
    const auto count = points_.size();
    out_.q.resize(count);
    out_.branch.resize(count);
    if (count == 0) return;
    const auto& last = layers_.back();
    int k = static_cast<int>(&best(last) - last.data());
    out_.cost = last[static_cast<std::size_t>(k)].cost;
    for (std::size_t i = count; i-- > 0;) {
      const Candidate& c = layers_[i][static_cast<std::size_t>(k)];
      out_.q[i] = c.q;
      out_.branch[i] = c.branch;
      k = c.from;
    }
  }

  const SixR& arm_;
  const std::vector<ArmPoint>& points_;
  const ArmTrackingSettings& settings_;
  std::vector<std::vector<Candidate>> layers_;
  BranchTracking out_;
};

}  // namespace

BranchTracking track_arm(const SixR& arm, const std::vector<ArmPoint>& points,
                         const ArmTrackingSettings& settings) {
  require(settings.start.size() == 6, "one start value per joint");
  return Tracker(arm, points, settings).run();
}

}  // namespace smoothpost
