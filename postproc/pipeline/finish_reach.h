#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "kernels/collision/scene.h"
#include "kernels/kinematics/rotary_pair.h"
#include "machines/definition/machine.h"
#include "postproc/pipeline/finish_path.h"

// Where a finishing machine can be at all, whatever its redundant joint does.
namespace smoothpost {

struct FinishReachInput {
  const MachineDefinition& machine;
  Pose placement = Pose::Identity();         ///< of the part in the machine's workpiece frame
  const TriangleMesh* stock = nullptr;       ///< in W; null: none is known
  std::shared_ptr<const TriangleTree> tree;  ///< of the stock; null: built here
  bool collisions = true;                    ///< bodies and stock must not meet
};

/// Joints for single locations. For one thread.
class FinishReach {
 public:
  /// Nothing: the chain has no closed form with exactly one redundant joint, or no scene can be
  /// made. The machine outlives it.
  static std::optional<FinishReach> make(const FinishReachInput& input);

  /// A position of the redundant joint, on a grid of 4° (4 mm), at which every joint is inside its
  /// range and the scene is free; with the holder `tool_length` behind the tip. A tool that stands
  /// along a rotary's axis reaches nothing.
  /// Cost: 1 µs and a query of the scene where the last answer's position does it, else as many as
  /// the grid has.
  std::optional<JointVector> joints(const CutterLocation& at, double tool_length) const;
  bool reaches(const CutterLocation& at, double tool_length) const {
    return joints(at, tool_length).has_value();
  }

 private:
  FinishReach() = default;
  const MachineDefinition* machine_ = nullptr;
  std::shared_ptr<const RotaryPair> pair_;
  std::shared_ptr<const Scene> scene_;
  int free_joint_ = -1;
  std::vector<double> grid_;
  mutable std::size_t last_ = 0;
  mutable std::shared_ptr<SceneCache> cache_;
};

/// Where to put a part so that the machine reaches as much of a path as it can: the middle of the
/// stock's box over the zero of the machine's workpiece frame, and the least height of the part's
/// foot, in steps of 5 mm up to 200, of those that reach the most points, also with the links'
/// clearance behind them.
struct FinishPlace {
  Vec3 position = Vec3::Zero();  ///< mm, of the part's zero
  std::size_t reached = 0, points = 0;
};
/// Up to 300 points of the path are looked at, spread evenly. Nothing: see FinishReach::make.
/// Cost: 41 heights × points × a query, at most.
std::optional<FinishPlace> find_finish_place(const FinishPath& path,
                                             const MachineDefinition& machine, bool collisions);

/// The path without some of its cuts (indices, ascending): points, lines, events and layers anew;
/// their lengths count as out of reach.
/// @pre at least one cut stays
FinishPath without_cuts(FinishPath path, const std::vector<std::size_t>& cuts);

}  // namespace smoothpost
