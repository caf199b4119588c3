#pragma once

#include "kernels/kinematics/six_r.h"
#include "postproc/pipeline/joint_plan.h"

namespace smoothpost {

/// Joint values of a six-axis arm along the path: plan_joints() for arms.
///
/// A cutter location leaves the rotation about the tool axis free. It is fixed by one angle ψ for
/// the whole path: R = M(a → n) · Rot(a, ψ) · M(h → a) · R_home, where n is the tool axis, h the
/// tool axis at home, a an axis of W that no n is opposite to, and M(x → y) the least rotation from
/// x to y. With settings.whole_rotation the rotation is the path's own and nothing is free.
/// By settings.spin_policy: fixed, ψ is one angle; tangent, ψ follows the way of the tip as a
/// smooth profile (the input tool frame's X along it, from ψ on); optimised, a profile around ψ
/// that keeps the arm away from limits and singular postures (kernels/optimise/spin.h), a constant
/// if that has no way. ψ is settings.spin, or the one of 24 that keeps the arm farthest from its
/// limits and from a singular wrist on a thinned path and has a way along the whole one. Samples
/// lie so close that the motion between them (straight joints, or tip linear and slerp with
/// settings.tool_moves) stays inside the tolerances. Failures and splits as plan_joints().
Result<JointPlan> plan_arm(const SmoothedPath& path, const SixR& arm,
                           const JointPlanSettings& settings, const Progress& progress);

}  // namespace smoothpost
