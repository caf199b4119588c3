#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kernels/collision/chain_motion.h"
#include "kernels/collision/collision_shape.h"
#include "kernels/core/joints.h"
#include "kernels/kinematics/screw_chain.h"

// Which bodies of a machine, and of what is clamped on it, come how near to each other at a joint
// vector. Motions between joint vectors: motion_check.h.
namespace smoothpost {

/// A body and what carries it.
struct SceneBody {
  static constexpr int kBase = -1;       ///< stands on the machine's base
  static constexpr int kWorkpiece = -2;  ///< fixed to the part, given in W: the part, its fixtures

  std::string name;
  int joint = kBase;     ///< index of the joint whose link carries it, kBase or kWorkpiece
  CollisionShape shape;  ///< mm; in M with every joint at 0, for kWorkpiece in W
};

/// Points of the second body that are nearer than `radius` to `centre`, which is fixed to the first
/// body and given in its coordinates, need not keep the pair's clearance.
///
/// With it the *margin* of the pair is
///   min over the points x of the second body of  max(dist(x, first) − clearance, radius − |x −
///   centre|),
/// instead of dist(second, first) − clearance. It is negative exactly when some point outside of
/// the ball is nearer than the clearance, and like a distance it changes by no more than the bodies
/// move against each other: so what is said of motions holds for it as well.
/// What it does not prove: anything about points inside of the ball. With the ball about the tip of
/// a laser's nozzle that is the sheet under the nozzle and whatever else is that near to the tip
/// (the gap check looks at the land); the nozzle may even touch or cut it there. And a body that is
/// partly inside of a solid, with all of the solid's surface that it cuts in the ball, is only seen
/// if its farthest extreme point from the ball is inside; no motion from outside leads there.
struct ExemptSphere {
  Vec3 centre = Vec3::Zero();  ///< mm
  double radius = 0.0;         ///< mm, > 0
};

/// Two bodies that have to keep a distance: places in the scene's list.
struct ScenePair {
  std::size_t first = 0;
  std::size_t second = 0;
  double clearance = 0.0;                             ///< mm, ≥ 0
  std::optional<ExemptSphere> exempt = std::nullopt;  ///< the second body is a mesh
};

/// Below this distance bodies count as touching, and a pair that touches is never free, mm.
inline constexpr double kTouching = 1e-6;

/// How near the bodies of a pair are. Points and normal in W.
struct PairMargin {
  /// mm: the margin, distance − clearance (see ExemptSphere), is proven to be at least this.
  double lower = 0.0;
  /// Margin of the witness: the margin is at most this. upper − lower ≤ 2e-6 mm, with an exempt
  /// sphere ≤ max(2e-3 mm, 5 % of it). Where no margin below the asked one was found, both are
  /// that.
  double upper = 0.0;
  bool found = false;            ///< there is a witness
  double distance = 0.0;         ///< |on_first − on_second|; 0 when the bodies overlap
  Vec3 on_first = Vec3::Zero();  ///< mm; a common point when the bodies overlap
  Vec3 on_second = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< unit, from second to first
  /// Triangle of the mesh that on_second (else on_first) lies on; of a body inside of a solid the
  /// triangle nearest to it; kNoTriangle without a mesh.
  std::uint32_t triangle = kNoTriangle;
  static constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();
};

/// The least margin of all pairs.
struct Clearance {
  static constexpr std::size_t kNoPair = std::numeric_limits<std::size_t>::max();
  /// mm; −clearance or less when bodies of the pair overlap, without a promise of depth; `cap` when
  /// no pair is below it.
  double margin = 0.0;
  std::size_t pair = kNoPair;  ///< the first of those with the least margin
  PairMargin at;               ///< of that pair
};

class Scene;
class MotionSearch;

/// Where the links of a scene are at one joint vector. Cheap to copy: some hundred numbers.
class ScenePoses {
 public:
  const JointVector& joints() const { return q_; }

 private:
  friend class Scene;
  JointVector q_;
  LinkPoses links_;
  Pose workpiece_ = Pose::Identity();  // X_MW
};

/// What one caller knows of the pairs of a scene from earlier queries, so that queries along a path
/// are amortised: a pair that had the margin m needs no new query until its bodies can have moved
/// by m against each other. For one thread; belongs to the scene of its first use. It changes the
/// time that queries take, and no answer.
class SceneCache {
 public:
  /// Pairs that were searched, and pairs that needed no search, since construction.
  std::size_t queries() const { return queries_; }
  std::size_t skipped() const { return skipped_; }

 private:
  friend class Scene;
  friend class MotionSearch;
  struct Known {
    bool known = false;
    Pose second_first = Pose::Identity();
    double lower = 0.0;
    std::optional<std::uint32_t> triangle;
    int skips = 0;     // since the last search
    int searches = 0;  // by free()
  };
  std::shared_ptr<const void> scene_;
  std::vector<Known> pairs_;
  std::size_t queries_ = 0;
  std::size_t skipped_ = 0;
};

/// Bodies on the links of a machine, with the pairs that have to keep apart.
///
/// Body on joint i: moves with joint i and the joints before it on its side. Shapes are exact:
/// round bodies are round (ConvexShape), meshes are their triangles (MeshShape). Of a margin a
/// lower bound is proven by separating planes; every yes below rests on lower bounds alone.
///
/// A convex body is full: what lies inside of it collides. So is a solid mesh (see MeshShape).
///
/// Guarantees (tests): margins are those of the definition, against every triangle by another
/// method; witness points lie on the bodies, `distance` apart; answers with and without a cache are
/// the same; the same bits on any number of threads.
/// Units: mm, rad; witness in W.   Copies share their data. Queries are const and may run from
/// several threads, each with a cache of its own.
class Scene {
 public:
  /// @pre joints in range, pairs of different bodies in range, clearance ≥ 0 and finite, exempt
  ///   spheres with a radius > 0 whose second body is a mesh
  /// @throws ContractViolation if not.
  Scene(ScrewChain chain, std::vector<SceneBody> bodies, std::vector<ScenePair> pairs);

  const ScrewChain& chain() const;
  const std::vector<SceneBody>& bodies() const;
  const std::vector<ScenePair>& pairs() const;

  /// True when every pair keeps its clearance: proven margin ≥ 0 (and distance ≥ kTouching).
  /// A margin from 0 to the bounds' gap (PairMargin) may count as not free, never the other way.
  /// Cost: 1 µs and 0.1 µs for a pair that is skipped, 1-20 µs for one that is not.
  /// @pre q.size() == chain().size(), finite   @throws ContractViolation if not.
  bool free(const JointVector& q, SceneCache* cache = nullptr) const;

  /// The least margin, as far as it is below `cap`, with its place.
  /// Cost: as free(), 2-50 µs for a pair that is below the cap.
  Clearance clearance(const JointVector& q, double cap = std::numeric_limits<double>::infinity(),
                      SceneCache* cache = nullptr) const;

  /// For callers that ask several pairs, or the same pair at several places.
  ScenePoses poses(const JointVector& q) const;
  /// The margin of one pair, as far as it is below `want`. With a cache it is remembered, not
  /// looked up: see known_margin().   @pre pair < pairs().size(), poses of this scene
  PairMargin margin(std::size_t pair, const ScenePoses& poses, double want,
                    SceneCache* cache = nullptr) const;
  /// Whether a pair's margin is at least `need` ≥ 0, in less time than margin(): true when `lower`
  /// says so. A margin below 0 is told by some `upper` below 0, not the least one, and some `lower`
  /// below 0 that proves nothing; of one above 0 at least half is proven, or `need`, up to
  /// tolerance().
  PairMargin decide(std::size_t pair, const ScenePoses& poses, double need) const;
  /// What the cache proves of the margin at `poses` without a search; −∞ when it knows nothing.
  double known_margin(std::size_t pair, const ScenePoses& poses, const SceneCache& cache) const;
  /// The margin of a pair changes by at most this from `from` to `to`, mm (displacement()).
  double movement(std::size_t pair, const ScenePoses& from, const ScenePoses& to) const;
  /// How a pair's bodies move while the joints go linearly from `from` to `to`: its margin at any
  /// place of the motion is at least the one at the middle − travel/2, and after a change of the
  /// joints by e from there at least that − Σ lever·|e|.
  MovementBound movement_bound(std::size_t pair, const JointVector& from,
                               const JointVector& to) const;
  /// What decisions on a pair's margin may leave open: 2e-6 mm, 2e-3 mm with an exempt sphere.
  double tolerance(std::size_t pair) const;

 private:
  friend class MotionSearch;
  struct Data;
  void prepare(SceneCache* cache) const;
  struct Wish {
    double want = 0.0;
    bool decide = false;  ///< as MarginQuery
    double need = 0.0;
  };
  PairMargin search(std::size_t pair, const ScenePoses& poses, const Wish& wish,
                    SceneCache* cache) const;
  std::shared_ptr<const Data> data_;
};

}  // namespace smoothpost
