#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "kernels/collision/scene.h"
#include "kernels/core/check.h"
#include "kernels/core/mesh.h"
#include "kernels/core/progress.h"
#include "kernels/geometry/triangle_tree.h"
#include "machines/definition/machine.h"
#include "machines/dialects/dialect.h"
#include "postproc/pipeline/controller_blending.h"

// What keeps its distance while a program runs: the machine's bodies, what is clamped on it and the
// part.
namespace smoothpost {

struct SceneInput {
  const MachineDefinition& machine;
  const ScrewChain& chain;                   ///< tool length 0, part placed
  const TriangleMesh* part = nullptr;        ///< in W; null: none is known
  std::shared_ptr<const TriangleTree> tree;  ///< of the part; null: built here
  double allowance = 0.0;  ///< mm, more than the pairs' own clearances (largest_allowance())
};

/// The machine's bodies with their checked_pairs(), and the part ("part", last body) where there is
/// one. Nothing when no pair has to be checked.
/// Failures: RG101, RG102 (a mesh without a tree), STL109 likewise.
/// @pre bodies that are meshes are loaded
Result<std::optional<Scene>> machine_scene(const SceneInput& input);

/// A place where a motion is not proven to be free.
struct ClearancePlace {
  std::size_t move = 0;
  double t = 0.0;  ///< share of the move
  std::size_t pair = 0;
  double distance = 0.0;      ///< mm, of the pair; 0: they meet
  Vec3 point = Vec3::Zero();  ///< mm, W, on the second of the pair
  bool undecided = false;
};

struct ClearanceReport {
  std::vector<ClearancePlace> places;  ///< the first kPlaces, in order
  std::size_t moves = 0;               ///< that are not proven free
  double least = 0.0;  ///< mm: least distance of a pair beyond its clearance at the ends of moves
  std::size_t least_pair = Clearance::kNoPair;
  std::size_t least_move = 0;
  std::size_t queries = 0, skipped = 0;
  static constexpr std::size_t kPlaces = 5;
};

/// Every motion of a program between joint positions that it has stated itself, by check_motion():
/// straight in the joints, rapids of a machine with links.rapid = "independent" anywhere in the box
/// between their ends.
/// Guarantee (tests): no motion with a hit on a ten times finer grid is called free; the same bits
/// on every run.   Cost: about 1 µs a pair and move where the bodies are far apart.
ClearanceReport check_clearance(const Scene& scene, const ReadBack& joints,
                                const MachineDefinition& machine, const Progress& progress);

/// How far bodies may be from where straight joint steps have them, mm: what the control rounds at
/// corners, tip and rotation at an arm's length of 1 m, and half the steps' own tolerance.
double largest_allowance(const std::vector<BlendAllowance>& rounding,
                         const MachineDefinition& machine, bool tool_moves);

/// Index of the standoff axis, or −1; its sign when it brings tip and wrist together, 0 without.
int standoff_joint(const MachineDefinition& machine);
int towards_wrist(const MachineDefinition& machine);

/// The check `clearance` of a report: value = distance of the tightest pair, limit = its clearance.
Check clearance_check(const ClearanceReport& report, const Scene& scene, const ReadBack& joints);

/// "nozzle and part meet", with the place, for each of the report's places.
std::vector<std::string> place_texts(const ClearanceReport& report, const Scene& scene);

}  // namespace smoothpost
