#include "examples/paper_a/joint_jerk.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace smoothpost::paper_a {

namespace {

Pose placed(const Pose& pose, const Placement& placement) {
  Pose p = pose;
  p.translation() += placement.over - placement.middle;
  p.linear() = pose.linear() * rotation_about(Vec3::UnitZ(), placement.spin);
  return p;
}

void unwrap(const JointVector& near, JointVector& q) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  for (Eigen::Index i = 0; i < q.size(); ++i) q[i] += kTurn * std::round((near[i] - q[i]) / kTurn);
}

}  // namespace

double peak_joint_jerk(const SixR& arm, std::span<const Pose> poses, double dt,
                       const Placement& placement) {
  JointVector middle(arm.chain().size());
  for (int i = 0; i < arm.chain().size(); ++i)
    middle[i] = 0.5 * (arm.chain().joints[static_cast<std::size_t>(i)].lower +
                       arm.chain().joints[static_cast<std::size_t>(i)].upper);
  std::vector<JointVector> q;
  for (const Pose& pose : poses) {
    const JointVector& near = q.empty() ? middle : q.back();
    const SixRSolutions found = arm.solve(placed(pose, placement), near);
    double best = 1e300;
    JointVector chosen;
    for (std::size_t b = 0; b < 8; ++b) {
      if (!found.valid[b]) continue;
      JointVector candidate = found.q[b];
      unwrap(near, candidate);
      const double distance = (candidate - near).norm();
      if (distance >= best) continue;
      best = distance;
      chosen = candidate;
    }
    if (best > 1e299) return -1.0;
    q.push_back(chosen);
  }
  double most = 0.0;
  for (std::size_t k = 3; k < q.size(); ++k)
    most = std::max(most,
                    (q[k] - 3.0 * q[k - 1] + 3.0 * q[k - 2] - q[k - 3]).lpNorm<Eigen::Infinity>() /
                        (dt * dt * dt));
  return most;
}

}  // namespace smoothpost::paper_a
