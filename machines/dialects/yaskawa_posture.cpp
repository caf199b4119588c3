#include "machines/dialects/yaskawa_posture.h"

#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/tool_frame.h"

namespace smoothpost::yaskawa_jbi {

namespace {

constexpr double kCertain = 0.01 * kRadiansPerDegree;
constexpr std::array<std::size_t, 3> kTurning = {3, 5, 0};  // R, T, S

bool is_turned(double angle) { return angle <= -kPi || angle > kPi; }

}  // namespace

Postures::Postures(const MachineDefinition& machine)
    : axes_(rapid::robot_axes(machine)),
      arm_(rapid::arm_form(machine, axes_)),
      flange_to_tip_(tool_frame(machine, 0.0)) {}

std::optional<Posture> Postures::of(const JointVector& joints) const {
  JointVector q(6);
  for (int i = 0; i < 6; ++i) q[i] = joints[axes_.arm[static_cast<std::size_t>(i)]];
  if (std::abs(q[4]) < kCertain) return std::nullopt;
  Posture out;
  for (std::size_t k = 0; k < 3; ++k) {
    const double angle = q[static_cast<int>(kTurning[k])];
    if (std::abs(std::abs(angle) - kPi) < kCertain || std::abs(angle) > 2.0 * kPi - kCertain)
      return std::nullopt;
    out.turned[k] = is_turned(angle);
  }
  const auto branch = static_cast<unsigned>(arm_->branch_of(q));
  out.rear = (branch & 1U) != 0;
  out.lower = (branch & 2U) != 0;
  out.no_flip = q[4] < 0.0;
  return out;
}

std::optional<std::array<double, 6>> Postures::joints(const Pose& flange,
                                                      const Posture& posture) const {
  const Pose tip = arm_->chain().workpiece_home.inverse() * flange * flange_to_tip_;
  const SixRSolutions solutions = arm_->solve(tip);
  if (solutions.shoulder_singular || solutions.elbow_singular) return std::nullopt;
  std::optional<std::array<double, 6>> found;
  for (unsigned branch = 0; branch < 8; ++branch) {
    if (!solutions.valid[branch]) continue;
    const JointVector& q = solutions.q[branch];
    const unsigned of = static_cast<unsigned>(arm_->branch_of(q));
    if (((of & 1U) != 0) != posture.rear || ((of & 2U) != 0) != posture.lower ||
        (q[4] < 0.0) != posture.no_flip || solutions.wrist_singular[branch & 3U])
      continue;
    if (found) return std::nullopt;
    found.emplace();
    for (int i = 0; i < 6; ++i) (*found)[static_cast<std::size_t>(i)] = q[i];
  }
  if (!found) return std::nullopt;
  for (std::size_t k = 0; k < 3; ++k) {
    double& angle = (*found)[kTurning[k]];
    if (posture.turned[k]) angle += angle > 0.0 ? -2.0 * kPi : 2.0 * kPi;
  }
  return found;
}

}  // namespace smoothpost::yaskawa_jbi
