#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "kernels/kinematics/rotary_pair.h"

namespace smoothpost {

/// A location to be reached, and how.
struct TrackingPoint {
  CutterLocation location;
  bool cut = false;        ///< the motion that ends here cuts: rotaries must be continuous on it
  std::uint32_t line = 0;  ///< input line, for messages
};

struct BranchTrackingSettings {
  JointVector held;       ///< values of the held joints; also where the first point starts from
  double pole_cap = 0.0;  ///< rad: inside this angle to the pole the first rotary is free
  double continuity =
      0.8726646;  ///< rad: largest rotary step on a cutting motion between neighbours
  std::size_t turn_memory = 1u << 24;  ///< bound of (links × candidates × turns) that are kept
};

/// A place where no continuous choice exists inside a cut.
struct Rewind {
  std::size_t point = 0;
  std::uint32_t line = 0;
  int joint = 0;
  std::string reason;  ///< which axis, its value and its limit, for a person
};

struct BranchTracking {
  enum class Status { ok, unreachable, rewind_needed, over_limit } status = Status::ok;
  std::vector<JointVector> q;   ///< one per point when status is ok
  std::vector<int> branch;      ///< branch index per point
  double cost = 0.0;            ///< of the choice, rad
  std::size_t point = 0;        ///< where it failed
  int joint = -1;               ///< which joint failed there, or −1
  std::string reason;           ///< what failed there: joint, value, limit
  std::vector<Rewind> rewinds;  ///< when a rewind is needed
};

/// One global choice of branch and winding along a path, by dynamic programming under axis limits.
///
/// Definition. A choice gives each point a branch of RotaryPair::solve() and whole turns of both
/// rotaries. It is allowed when every joint is within its limits (1e-9 of slack) at every point
/// and, on a motion that cuts, each rotary goes to its nearest turn by at most `continuity`; a
/// motion that does not cut may go to any branch and turn. A branch can therefore change inside a
/// cut only where both branches coincide within `continuity`: at or through the pole. The result
/// has the least, in rad and summed over the two rotaries,
///   0.01 |q − held| at the first point + Σ over motions of |Δq|.
///
/// Poles. Neighbouring points whose axis is within max(pole_cap, 1e-9) of a reachable pole form a
/// run. Inside it the tool axis is taken to be the pole exactly, the second rotary has its value
/// there, and the first is free; linears are computed with the choice. The first rotary
///  - is held through the run and, if it has to turn, turns on a motion of the run that does not
///    cut, the last one that serves; a run at the start of the path holds settings.held;
///  - goes linearly by motion from its value before to its value behind if all motions into, in and
///    out of the run cut (the motions into and out of it take part only where the others are too
///    few), so it is constant when they agree, as in an exact crossing of the pole (sign flip of
///    the second rotary);
///  - keeps its value at the end of the path.
///
/// Guarantees (tests): cost of an exhaustive search on small paths; limits; continuity on cuts;
/// exact crossing without a turn; no swing inside the cap; a rewind is reported where the last
/// possible choice ends; little turn_memory costs nothing when few turns are needed.
///
/// Status:
///  - ok;
///  - unreachable: an axis beyond both branches;
///  - over_limit: a point where every candidate breaks a position limit;
///  - rewind_needed: no continuous choice inside a cut. Every such place is listed; after one, the
///    search goes on as if the motion into it did not cut.
/// In texts joints count from 1. Limits hold for cyclic joints too.
///
/// Units: mm, rad, W.
///
/// Cost: linear in the points: one closed form a point and O(1) on cuts, since all turns share
/// their cost along a cut; O(turns) on a motion that does not cut. When links × turns would exceed
/// turn_memory, only the turns nearest to held are considered; they are widened fourfold for as
/// long as there is no choice, so a choice that exists is found. Deterministic, one thread.
///
/// @pre settings.held.size() == number of joints; unit axes; 0 < continuity; 0 ≤ pole_cap < 0.5
/// @throws ContractViolation if not.
///
/// Implements the idea of [Ding2025] Eq. (55)-(56), a graph over the inverse solutions.
/// Differences from the paper: its edge cost mixes rad and m and its graph spans a few via points;
/// here the cost is in rad and every point is a stage of an exact dynamic programme. Its Eq. (3)
/// leaves q4 undefined at the pole.
BranchTracking track_branches(const RotaryPair& pair, const std::vector<TrackingPoint>& points,
                              const BranchTrackingSettings& settings);

}  // namespace smoothpost
