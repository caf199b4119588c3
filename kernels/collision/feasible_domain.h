#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "kernels/collision/scene.h"
#include "kernels/kinematics/rotary_pair.h"

// Which leads, tilts, standoffs and branches a machine may take at a cutter location.
namespace smoothpost {

/// A cutter location whose tool axis may be chosen:
///   O(lead, tilt) ∝ N + tan(lead)·T + tan(tilt)·B,
/// so that lead = atan2(O·T, O·N) and tilt = atan2(O·B, O·N).
struct DomainPlace {
  Vec3 tip = Vec3::Zero();                                                         ///< mm, W
  Vec3 normal = Vec3::UnitZ(), tangent = Vec3::UnitX(), binormal = Vec3::UnitY();  ///< N, T, B
  double lead_low = 0.0, lead_high = 0.0;  ///< rad, inside (−π/2, π/2)
  double tilt_low = 0.0, tilt_high = 0.0;
  std::size_t label = 0;  ///< the caller's

  Vec3 axis(double lead, double tilt) const;  ///< O, unit
};

/// What is asked at every cutter location.
struct DomainProblem {
  const RotaryPair* pair = nullptr;    ///< of the machine's chain
  const Scene* scene = nullptr;        ///< of the same chain; nullptr: nothing can collide
  int standoff = -1;                   ///< the redundant joint along the tool; −1: none
  JointVector held;                    ///< of the joints that nobody chooses
  JointVector lower, upper;            ///< ranges of all joints; rotaries may be wound into theirs
  std::vector<double> standoffs{0.0};  ///< mm, ascending; one that is not looked at without a joint
  int leads = 13, tilts = 9;           ///< equally spaced over the ranges; 1: their middle
  double tool_length = 0.0;            ///< mm, that the chain does not have
  double margin = 0.0;                 ///< mm, more than the pairs' own clearances
  /// Whether the gap under the nozzle allows this axis (unit, W); empty: any. Called from several
  /// threads.
  std::function<bool(const DomainPlace&, const Vec3& axis)> gap;
};

enum class CellVerdict : std::uint8_t {
  free,
  unreachable,   ///< no solution of the branch
  out_of_range,  ///< of a joint
  gap,
  collision
};

struct DomainCell {
  CellVerdict verdict = CellVerdict::unreachable;
  /// collision: the scene's pair; out_of_range: the joint; else −1.
  std::int32_t culprit = -1;
  /// free: every pair's margin beyond problem.margin is proven to be at least this, mm; said only
  /// as far as it was needed. Else 0.
  double spare = 0.0;
};

/// A place in the grid.
struct DomainIndex {
  int branch = 0, lead = 0, tilt = 0, standoff = 0;
};

/// The grid of one cutter location: 2 branches × leads × tilts × standoffs.
struct FeasibleDomain {
  int leads = 0, tilts = 0, standoffs = 0;
  std::vector<DomainCell> cells;
  std::size_t queries = 0;  ///< searches of a pair in the scene
  std::size_t skipped = 0;  ///< cells and pairs that bounds have decided

  std::size_t flat(const DomainIndex& at) const {
    return static_cast<std::size_t>(((at.branch * leads + at.lead) * tilts + at.tilt) * standoffs +
                                    at.standoff);
  }
  DomainIndex index(std::size_t flat) const;
  const DomainCell& operator[](const DomainIndex& at) const { return cells[flat(at)]; }
  std::size_t free_cells() const;
};

/// Lead and tilt of a grid's row and column, rad.
double lead_at(const DomainProblem& problem, const DomainPlace& place, int i);
double tilt_at(const DomainProblem& problem, const DomainPlace& place, int j);

/// The joints of a cell, its rotaries in (−π, π]; nothing where the branch has no solution.
std::optional<JointVector> domain_joints(const DomainProblem& problem, const DomainPlace& place,
                                         const DomainIndex& at);

/// The admissible cells of one cutter location.
///
/// A cell is free when its branch has a solution there, every joint is in its range (rotaries after
/// some number of turns), the gap allows its axis and every pair of the scene keeps its clearance
/// and `margin`. Else its verdict is the first of these that fails, of pairs the first in the
/// scene's order.
///
/// Method, pair by pair and branch by branch. A block of undecided cells is asked at the cell c
/// next to its middle. With m ≤ margin ≤ m' proven there and w the way that the bodies of the pair
/// move against each other from c to another cell (Scene::movement), that cell is free if m − w ≥
/// margin and not free if m' + w < margin; what is left goes on in eighths of the block. So a head
/// far from everything needs one query a pair, and a pair that the standoff does not move (nozzle
/// and part) one a lead and tilt.
///
/// Guarantees (tests): the verdicts of asking every cell on its own, but for cells whose margin is
/// within Scene::tolerance() of the limit, which may count as not free; never free otherwise.
/// Units: mm, rad, W.   Cost: 819 cells of nozzle and casing beside walls 2-8 ms; allocates.
/// @pre counts ≥ 1, margin ≥ 0, one value per joint, standoffs not empty, a pair   @throws
/// ContractViolation
///   if not.
/// Implements the feasible domain of [Ding2025] §2.4. Differences from the paper:
/// docs/equations.md.
FeasibleDomain feasible_domain(const DomainProblem& problem, const DomainPlace& place);

/// The same at many cutter locations, on `threads` threads (0: as many as the machine has).
/// Guarantee (test): the same bits on any number of threads.
std::vector<FeasibleDomain> feasible_domains(const DomainProblem& problem,
                                             const std::vector<DomainPlace>& places,
                                             int threads = 0);

}  // namespace smoothpost
