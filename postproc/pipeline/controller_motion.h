#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "kernels/core/result.h"
#include "kernels/kinematics/inverse.h"
#include "machines/dialects/dialect.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

/// A program as its controller moves the joints.
struct ControllerMotion {
  /// The program with the joints at the end of every move filled in.
  ReadBack read;
  /// The same with every tool move replaced by straight joint steps that leave the tool's own way
  /// by at most the tolerances asked for, and every bent move or arc by straight steps that say how
  /// far the joints may be from them; nothing when no move is one of these.
  std::optional<ReadBack> steps;
  const ReadBack& joints() const { return steps ? *steps : read; }
};

struct FollowSettings {
  ToolTurn turn = ToolTurn::none;
  /// mm, between joint steps and the tool's own way; on bent moves and arcs of a linear joint
  double tip_tolerance = 1e-4;
  double axis_tolerance = 1e-6;  ///< rad; on bent moves of a rotary joint
  /// mm, of the tool in use during move i.
  std::function<double(std::size_t)> tool_length;
};

/// Finds the joint motion of tool moves as a controller does: from the joints where the move
/// starts, always to the nearest solution. `inverse` is of the machine with tool length 0 and the
/// part placed. Failures, each with the line of `read`: KN120 a tool move before every joint has a
/// position; KN121 a pose out of reach on the way; KN122 the joints would have to jump (a singular
/// posture).
///
/// A bent move or an arc of K steps has |q_j(τ) − step| ≤ sup|q_j''| / (8K²) =
/// ReadBackMove::deviation, with the supremum proven (bend_bounds) and K such that this is the
/// tolerance at most (K ≤ 4096: else it is what it is). The two joints of an arc have its
/// arc_spread() on top. An arc has to begin where its two joints are known.
/// Guarantees (tests): steps of tool moves within the tolerances at their middles; dense samples of
/// bent moves within the deviation; straight joint moves pass unchanged.
/// Cost: linear in the steps.
Result<ControllerMotion> follow_controller(ReadBack read, const Inverse& inverse,
                                           const FollowSettings& settings);

/// The same for a program without tool moves, of any chain.
/// @pre no move is a tool move   @throws ContractViolation if one is.
ControllerMotion follow_joints(ReadBack read, const ScrewChain& chain,
                               const FollowSettings& settings);

/// How far the tip may be from where the straight steps of bent moves have it, mm, and by what the
/// tool axis may be turned, rad: the largest Σ lever·deviation and Σ deviation of rotaries over all
/// steps (movement_bound of a ball of `longest_tool` about the holder's reference point).
struct StepAllowance {
  double tip = 0.0, axis = 0.0;
};
StepAllowance step_allowance(const ReadBack& steps, const ScrewChain& chain, double longest_tool);

}  // namespace smoothpost
