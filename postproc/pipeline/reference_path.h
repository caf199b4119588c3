#pragma once

#include <optional>

#include "kernels/core/tool_path.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/definition/machine.h"

namespace smoothpost {

/// The input's motion as its own controller would make it: what an output is compared with.
/// Immutable; the tool path outlives it.
class ReferencePath {
 public:
  /// How the input's axis words become poses in the part.
  struct Frames {
    std::optional<MachineDefinition> input_machine;  ///< needed by rotary_linear and joint_linear
    Pose world_from_part = Pose::Identity();  ///< X_world,W: origin of the part in the words' frame
  };

  ReferencePath(const ToolPath& path, Frames frames);

  std::size_t segments() const { return path_.points.empty() ? 0 : path_.points.size() - 1; }
  const ToolPath& path() const { return path_; }

  /// Tip (mm) and tool axis in W at share s ∈ [0, 1] of `segment` (1 ≤ segment ≤ segments()).
  CutterLocation at(std::size_t segment, double s) const;

  /// Bounds of |d²/ds²| of tip and axis on a segment; hold everywhere on it.
  SecondDerivativeBound second_derivative_bound(std::size_t segment) const;

  /// Path length of the tip over a segment, mm; 0 when only the axis turns.
  double length(std::size_t segment) const;

  /// The pose of `words` read with the interpolation, compensation and tip offset of `like`.
  /// @pre like.interpolation is not great_circle
  CutterLocation location_of_words(const AxisWords& words, const PathPoint& like) const;

  /// The input's axis words on the way.   @pre as for at()
  AxisWords words_at(std::size_t segment, double s) const;

 private:
  JointVector joints_of(const AxisWords& words, double compensation) const;

  const ToolPath& path_;
  Frames frames_;
  std::optional<ScrewChain> chain_;  ///< of the input machine, tool length 0
  Pose part_from_world_;
};

}  // namespace smoothpost
