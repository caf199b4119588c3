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
  /// by at most the tolerances asked for; nothing when no move is a tool move.
  std::optional<ReadBack> steps;
  const ReadBack& joints() const { return steps ? *steps : read; }
};

struct FollowSettings {
  ToolTurn turn = ToolTurn::none;
  double tip_tolerance = 1e-4;   ///< mm, between joint steps and the tool's own way
  double axis_tolerance = 1e-6;  ///< rad
  /// mm, of the tool in use during move i.
  std::function<double(std::size_t)> tool_length;
};

/// Finds the joint motion of tool moves as a controller does: from the joints where the move
/// starts, always to the nearest solution. `inverse` is of the machine with tool length 0 and the
/// part placed. Failures, each with the line of `read`: KN120 a tool move before every joint has a
/// position; KN121 a pose out of reach on the way; KN122 the joints would have to jump (a singular
/// posture). Guarantees (tests): steps within the tolerances at their middles; joint moves pass
/// unchanged. Cost: linear in the steps.
Result<ControllerMotion> follow_controller(ReadBack read, const Inverse& inverse,
                                           const FollowSettings& settings);

}  // namespace smoothpost
