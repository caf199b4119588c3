#pragma once

#include <vector>

#include "kernels/core/progress.h"
#include "kernels/optimise/placement_margins.h"

namespace smoothpost {

/// Where a part may be put: X = T(p) · Rot(v, φ) · R_start · T(−pivot), with the pivot of the part
/// at p in [lower, upper] and the part turned by φ in [−turn, turn] about v from where it starts.
struct PlacementSearch {
  Pose start = Pose::Identity();  ///< X_W0W, W0 the workpiece frame of the chain
  Vec3 pivot = Vec3::Zero();      ///< mm in W
  Vec3 lower = Vec3::Zero();      ///< mm in W0; a coordinate with lower = upper is fixed there
  Vec3 upper = Vec3::Zero();
  Vec3 vertical = Vec3::UnitZ();         ///< v, unit, in W0
  double turn = 3.14159265358979323846;  ///< rad; 0: the part is not turned
  int global_evaluations = 2000;
  int local_evaluations = 300;  ///< of each candidate
  int candidates = 5;           ///< places to go on from
};

struct PlacementCandidate {
  Pose placement = Pose::Identity();  ///< X_W0W
  PlacementMargins margins;
};

struct PlacementResult {
  PlacementMargins before;               ///< at the start
  std::vector<PlacementCandidate> best;  ///< the best first; at least one
  int evaluations = 0;
  bool cancelled = false;
};

/// Looks for the place of the part that leaves its path the most room: maximises the score of
/// `measure` (the least margin, then the mean of all) over p and φ.
///
/// First a global search, DIRECT in its locally biased form over the unit box of p and φ; then,
/// from the best places that lie apart by a tenth of the box, a local one, Subplex, twice with
/// smaller steps. Both are NLopt's and use no random numbers.
///
/// Guarantees (tests): no candidate is outside of the box; when the start lies in it, the least
/// margin of the first is not below the start's; candidates are sorted by least margin, then by
/// score; with linear axes alone the path ends in the middle of every range; the same input gives
/// the same bytes; exceptions of `measure` come through.
/// It is a search: that no better place exists is not proved.
///
/// Units: mm, rad.   Cost: global + candidates · local evaluations of measure.at(); one thread; no
/// state outside of the call.
/// @pre lower ≤ upper, turn ≥ 0, |vertical| = 1, counts ≥ 1   @throws ContractViolation if not.
PlacementResult place_path(const PlacementMeasure& measure, const PlacementSearch& search,
                           const Progress& progress);

/// A box (in W0) that holds every place of the tip: of an arm the cube about its reach (ArmReach),
/// of a rotary pair the tips with the free linears at their ends and the other joints at `held`.
struct ReachBox {
  Vec3 lower = Vec3::Zero();
  Vec3 upper = Vec3::Zero();
};
/// @pre held.size() == number of joints   @throws ContractViolation if not.
ReachBox reach_box(const Inverse& inverse, const JointVector& held);

}  // namespace smoothpost
