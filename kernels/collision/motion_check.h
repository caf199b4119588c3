#pragma once

#include "kernels/collision/scene.h"

namespace smoothpost {

struct MotionSettings {
  /// mm: pieces of the motion in which no body moves further than this against its partner from
  /// the piece's middle are not divided again. So a motion whose margins, after the deviation, are
  /// above this (and the bounds' gap, PairMargin) everywhere is found free.
  double resolution = 0.05;
  /// How far each joint may be from the straight motion, at any place and independently of the
  /// others, mm or rad, ≥ 0; empty: not at all.
  JointVector deviation = {};
};

enum class MotionVerdict {
  free,       ///< proven: every joint vector of the motion (and around it, see deviation) is free
  hit,        ///< a joint vector on the straight motion is not free
  undecided,  ///< neither, at the resolution: counts as not free, and ends the search
};

struct MotionReport {
  MotionVerdict verdict = MotionVerdict::free;
  double t = 0.0;  ///< hit, undecided: the place on the motion that ended the search, 0 … 1
  std::size_t pair = Clearance::kNoPair;
  PairMargin at;  ///< of that pair there; nothing found: all its margins are above what was needed
  std::size_t queries = 0;  ///< pairs that were searched
  std::size_t skipped = 0;  ///< pairs that the cache proved for a whole piece of the motion
};

/// Whether a machine may move from `from` to `to`, all joints linearly and at once.
///
/// Method. A piece of the motion is tried at its middle: a pair whose margin m there is at least
/// travel/2 + Σ lever·deviation (Scene::movement_bound() of the piece) is proven for the piece.
/// Else the middle share of the piece that m does prove is cut out, and what is left on both sides
/// is tried in the same way, the earlier side first, until the resolution is reached.
///
/// Guarantees (tests): never free where dense sampling finds a margin below 0, with any deviation
/// inside of the box; free whenever the least margin is above resolution and gap; `hit` comes with
/// a margin below 0 at t; verdict, t and pair with a cache are those without, while the deviations
/// of rotary joints sum to less than 0.1 rad (a motion that the cache does not prove with
/// resolution and gap to spare is searched again without it).
/// The ends belong to the motion. Between them nothing is assumed but straight joints; controllers
/// that leave them need the deviation.
/// Cost: one search per pair and piece; pieces ≈ travel / margin.
/// @pre one finite value per joint; resolution > 0; deviation empty or one value ≥ 0 per joint
/// @throws ContractViolation if not.
MotionReport check_motion(const Scene& scene, const JointVector& from, const JointVector& to,
                          const MotionSettings& settings = {}, SceneCache* cache = nullptr);

}  // namespace smoothpost
