#pragma once

#include <optional>

#include "kernels/core/tool_path.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/definition/machine.h"

namespace smoothpost {

/// A place on the input: share s of a segment.
struct PathPlace {
  std::uint32_t segment = 0;
  double s = 1.0;
};

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

  /// The whole rotation of the tool frame there, its Z along the axis.   @pre path().full_pose
  Eigen::Quaterniond rotation_at(std::size_t segment, double s) const;

  /// Bounds of |d²/ds²| of tip and axis on a segment; hold everywhere on it.
  SecondDerivativeBound second_derivative_bound(std::size_t segment) const;

  /// Path length of the tip over a segment, mm; 0 when only the axis turns.
  double length(std::size_t segment) const;

  /// Programmed feed of the tip on a segment, mm/s; 0: none, or the tip does not move.
  double feed(std::size_t segment) const;

  /// A direction of the words' frame, in W.
  Vec3 part_direction(const Vec3& direction) const { return part_from_world_.linear() * direction; }

  /// The pose of `words` read with the interpolation, compensation and tip offset of `like`.
  /// @pre like.interpolation goes by words
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

/// The place at share t ∈ [0, 1] of the way from one place of a path to a later one, by tip length;
/// inside one segment by its own share. What pairs a block that takes the place of several segments
/// with them.   Cost: linear in the segments between.
PathPlace place_between(const ReferencePath& reference, const PathPlace& from, const PathPlace& to,
                        double t);

}  // namespace smoothpost
