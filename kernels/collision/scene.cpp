#include "kernels/collision/scene.h"

#include <algorithm>
#include <cmath>

#include "kernels/collision/mesh_search.h"
#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

const ChainJoint& joint_at(const ScrewChain& chain, int joint) {
  return chain.joints[static_cast<std::size_t>(joint)];
}

/// The joint whose motion moves the body, −1 for none.
int carrying_joint(const ScrewChain& chain, const SceneBody& body) {
  if (body.joint != SceneBody::kWorkpiece) return body.joint;
  for (int i = chain.size() - 1; i >= 0; --i)
    if (joint_at(chain, i).side == ChainSide::workpiece) return i;
  return -1;
}

void require_bodies(const ScrewChain& chain, const std::vector<SceneBody>& bodies) {
  for (const SceneBody& body : bodies)
    require(body.joint == SceneBody::kBase || body.joint == SceneBody::kWorkpiece ||
                (body.joint >= 0 && body.joint < chain.size()),
            "a body is carried by a joint, the base or the workpiece");
}

double extent(const std::vector<Ball>& balls) {
  Vec3 middle = Vec3::Zero();
  for (const Ball& ball : balls) middle += ball.centre / static_cast<double>(balls.size());
  double out = 0.0;
  for (const Ball& ball : balls) out = std::max(out, (ball.centre - middle).norm() + ball.radius);
  return out;
}

/// What is known of a witness in the frame of one of the bodies.
struct LocalMargin {
  double lower = 0.0;
  double upper = 0.0;
  bool found = false;
  double distance = 0.0;
  Vec3 on_first = Vec3::Zero();
  Vec3 on_second = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
  std::uint32_t triangle = PairMargin::kNoTriangle;
  bool in_second = true;  ///< whose frame it is
};

LocalMargin from_mesh(const MarginBounds& bounds, bool mesh_is_second) {
  LocalMargin out{bounds.lower,   bounds.upper,   bounds.found,  bounds.distance,
                  bounds.on_body, bounds.on_mesh, bounds.normal, bounds.triangle};
  if (!bounds.found) out.triangle = PairMargin::kNoTriangle;
  if (mesh_is_second) return out;
  std::swap(out.on_first, out.on_second);
  out.normal = -out.normal;
  out.in_second = false;
  return out;
}

/// Of two convex bodies, in the second one's frame.
LocalMargin convex_margin(const ConvexShape& first, const ConvexShape& second,
                          const Pose& second_first, double clearance, double want) {
  const Pose pose = second.core_frame().inverse() * second_first * first.core_frame();
  const double sweeps = first.sweep() + second.sweep();
  const double offset = sweeps + clearance;
  const Vec3 middles = pose.translation();
  const Vec3 start = middles.squaredNorm() > 0.0 ? middles : Vec3(Vec3::UnitZ());
  constexpr double kRoundOff = 1e-9;
  const auto found =
      convex_distance(PosedSet<ConvexShape>{first, pose}, second, start, want + offset + kRoundOff);
  LocalMargin out;
  out.lower = out.upper = want;
  if (found.lower - offset - kRoundOff >= want || found.upper - offset >= want) {
    out.lower = std::min(want, found.lower - offset - kRoundOff);
    return out;
  }
  out.found = true;
  out.lower = found.lower - offset - kRoundOff;
  out.upper = found.upper - offset;
  out.distance = std::max(found.upper - sweeps, 0.0);
  Vec3 normal = found.normal;
  if (found.upper > 0.0) normal = (found.on_a - found.on_b) / found.upper;
  if (found.overlap) normal = start.normalized();
  // Sweeps that overlap share the point that divides the distance of the cores as they do.
  const double share = sweeps > 0.0 ? second.sweep() / sweeps : 0.0;
  const double up = std::min(second.sweep(), share * found.upper);
  const Vec3 on_second = found.on_b + up * normal;
  const Pose& frame = second.core_frame();
  out.on_second = frame * on_second;
  out.on_first = frame * Vec3(on_second + out.distance * normal);
  out.normal = frame.linear() * normal;
  return out;
}

/// A point of one body that lies inside of the solid mesh of the other, with the mesh's surface.
struct Enclosed {
  Vec3 point = Vec3::Zero();  ///< in the mesh's frame
  Vec3 normal = Vec3::UnitZ();
  std::uint32_t triangle = 0;
};

std::optional<Enclosed> enclosed(const MeshShape& mesh, const std::vector<Vec3>& points,
                                 const Pose& pose, std::uint32_t hint) {
  for (const Vec3& p : points) {
    const Vec3 point = pose * p;
    if (!inside(*mesh.tree, point, hint)) continue;
    const ClosestPoint closest = mesh.tree->closest(point, hint);
    const Vec3 out = mesh.tree->signed_volume() < 0.0 ? Vec3(-closest.normal) : closest.normal;
    return Enclosed{point, out, closest.triangle};
  }
  return std::nullopt;
}

/// What has to be asked of insides: points of a body whose partner is a solid mesh.
struct PairSeeds {
  std::vector<Vec3> of_first;
  std::vector<Vec3> of_second;
};

/// Points of a body one of which is inside of a solid if the body is, while surfaces are apart.
std::vector<Vec3> seeds_of(const CollisionShape& shape) {
  if (const ConvexShape* convex = shape.convex()) return {convex->core_frame().translation()};
  return shape.mesh()->seeds;
}

/// Where surfaces may cross in the exempt ball: points outside of it, of a convex body the farthest
/// from it among those that stick out most.
std::vector<Vec3> seeds_outside(const CollisionShape& shape, const ExemptSphere& ball) {
  std::vector<Vec3> points = seeds_of(shape);
  const auto from_ball = [&](const Vec3& p) { return (p - ball.centre).norm(); };
  if (const ConvexShape* convex = shape.convex())
    for (const double sign : {-1.0, 1.0})
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3 p = convex->core_frame() * convex->support(sign * Vec3::Unit(axis));
        if (from_ball(p) > from_ball(points[0])) points[0] = p;
      }
  points.erase(std::remove_if(points.begin(), points.end(),
                              [&](const Vec3& p) { return from_ball(p) < ball.radius; }),
               points.end());
  return points;
}

}  // namespace

struct Scene::Data {
  struct Pair {
    bool first_moves = true;   // the body whose displacement against the other one is bounded
    std::vector<Ball> balls;   // of it, in its coordinates
    std::vector<Ball> placed;  // of it, in M with every joint at 0
    ChainPath path;
    PairSeeds seeds;
    double clearance = 0.0;
  };
  ScrewChain chain;
  std::vector<SceneBody> bodies;
  std::vector<ScenePair> pairs;
  std::vector<Pair> prepared;

  Pair prepare(const ScenePair& pair) const;
  static const Pose& pose_of(const SceneBody& body, const LinkPoses& links, const Pose& workpiece) {
    return body.joint == SceneBody::kWorkpiece ? workpiece
                                               : links[static_cast<std::size_t>(body.joint + 1)];
  }
};

Scene::Data::Pair Scene::Data::prepare(const ScenePair& pair) const {
  const SceneBody& first = bodies[pair.first];
  const SceneBody& second = bodies[pair.second];
  Pair out;
  out.clearance = std::max(pair.clearance, kTouching);
  out.first_moves = extent(first.shape.balls()) <= extent(second.shape.balls());
  const SceneBody& mover = out.first_moves ? first : second;
  const SceneBody& other = out.first_moves ? second : first;
  out.balls = mover.shape.balls();
  // The exempt ball moves with the first body; seen from there, points of the second one move.
  if (pair.exempt && out.first_moves) out.balls.push_back({pair.exempt->centre, 0.0});
  out.placed = out.balls;
  if (mover.joint == SceneBody::kWorkpiece)
    for (Ball& ball : out.placed) ball.centre = chain.workpiece_home * ball.centre;
  out.path = path_between(chain, carrying_joint(chain, mover), carrying_joint(chain, other));
  const MeshShape* of_first = first.shape.mesh();
  const MeshShape* of_second = second.shape.mesh();
  if (of_second && of_second->tree->solid())
    out.seeds.of_first =
        pair.exempt ? seeds_outside(first.shape, *pair.exempt) : seeds_of(first.shape);
  if (of_first && of_first->tree->solid() && !pair.exempt)
    out.seeds.of_second = seeds_of(second.shape);
  return out;
}

Scene::Scene(ScrewChain chain, std::vector<SceneBody> bodies, std::vector<ScenePair> pairs) {
  auto data = std::make_shared<Data>();
  data->chain = std::move(chain);
  data->bodies = std::move(bodies);
  data->pairs = std::move(pairs);
  require(data->chain.size() <= kMaxJoints, "a chain of at most kMaxJoints");
  require_bodies(data->chain, data->bodies);
  for (const ScenePair& pair : data->pairs) {
    require(pair.first < data->bodies.size() && pair.second < data->bodies.size() &&
                pair.first != pair.second,
            "a pair is of two different bodies");
    require(pair.clearance >= 0.0 && std::isfinite(pair.clearance), "a clearance of at least 0");
    if (pair.exempt) {
      require(pair.exempt->radius > 0.0 && std::isfinite(pair.exempt->radius) &&
                  pair.exempt->centre.allFinite(),
              "an exempt sphere has a centre and a radius");
      require(data->bodies[pair.second].shape.mesh() != nullptr,
              "an exempt sphere is for a mesh as second body");
    }
    data->prepared.push_back(data->prepare(pair));
  }
  data_ = std::move(data);
}

const ScrewChain& Scene::chain() const { return data_->chain; }
const std::vector<SceneBody>& Scene::bodies() const { return data_->bodies; }
const std::vector<ScenePair>& Scene::pairs() const { return data_->pairs; }

ScenePoses Scene::poses(const JointVector& q) const {
  require(q.size() == chain().size() && q.allFinite(), "one finite value per joint");
  ScenePoses out;
  out.q_ = q;
  out.links_ = link_poses(chain(), q);
  out.workpiece_ = chain().workpiece_home;
  for (int i = chain().size() - 1; i >= 0; --i)
    if (joint_at(chain(), i).side == ChainSide::workpiece) {
      out.workpiece_ = out.links_[static_cast<std::size_t>(i) + 1] * chain().workpiece_home;
      break;
    }
  return out;
}

double Scene::tolerance(std::size_t pair) const {
  require(pair < pairs().size(), "a pair of the scene");
  return pairs()[pair].exempt ? kExemptTolerance : 2.0 * kMarginTolerance;
}

void Scene::prepare(SceneCache* cache) const {
  if (cache == nullptr) return;
  if (!cache->scene_) {
    cache->scene_ = data_;
    cache->pairs_.resize(pairs().size());
  }
  require(cache->scene_ == data_, "a cache belongs to one scene");
}

namespace {

/// How much more than needed is worth knowing of a margin, when bodies have moved by `moved` since
/// it was known last.
double look_ahead(double moved) { return std::clamp(4.0 * moved, 2.0, 100.0); }

/// X_second_first or its inverse: how the moving body of a pair stands to the other one.
Pose relative(const Pose& first, const Pose& second, bool first_moves) {
  return first_moves ? second.inverse() * first : first.inverse() * second;
}

}  // namespace

double Scene::movement(std::size_t pair, const ScenePoses& from, const ScenePoses& to) const {
  require(pair < pairs().size(), "a pair of the scene");
  const Data::Pair& p = data_->prepared[pair];
  const SceneBody& first = bodies()[pairs()[pair].first];
  const SceneBody& second = bodies()[pairs()[pair].second];
  const auto at = [&](const ScenePoses& poses) {
    return relative(Data::pose_of(first, poses.links_, poses.workpiece_),
                    Data::pose_of(second, poses.links_, poses.workpiece_), p.first_moves);
  };
  return displacement(p.balls, at(from), at(to));
}

MovementBound Scene::movement_bound(std::size_t pair, const JointVector& from,
                                    const JointVector& to) const {
  require(pair < pairs().size(), "a pair of the scene");
  const Data::Pair& p = data_->prepared[pair];
  return smoothpost::movement_bound(chain(), p.path, p.placed, from, to);
}

double Scene::known_margin(std::size_t pair, const ScenePoses& poses,
                           const SceneCache& cache) const {
  require(pair < pairs().size(), "a pair of the scene");
  if (cache.scene_ != data_ || !cache.pairs_[pair].known)
    return -std::numeric_limits<double>::infinity();
  const Data::Pair& p = data_->prepared[pair];
  const SceneBody& first = bodies()[pairs()[pair].first];
  const SceneBody& second = bodies()[pairs()[pair].second];
  const Pose now = relative(Data::pose_of(first, poses.links_, poses.workpiece_),
                            Data::pose_of(second, poses.links_, poses.workpiece_), p.first_moves);
  const SceneCache::Known& known = cache.pairs_[pair];
  return known.lower - displacement(p.balls, known.second_first, now);
}

namespace {

/// Of what the bodies are made of: triangles, and convex bodies with their insides.
LocalMargin surface_margin(const CollisionShape& first, const CollisionShape& second,
                           const Pose& second_first, const MarginQuery& query) {
  const MeshShape* first_mesh = first.mesh();
  const MeshShape* second_mesh = second.mesh();
  if (second_mesh != nullptr && first_mesh != nullptr)
    return from_mesh(mesh_margin(*second_mesh->tree, *first_mesh->tree, second_first, query), true);
  if (second_mesh != nullptr)
    return from_mesh(mesh_margin(*second_mesh->tree, *first.convex(), second_first, query), true);
  if (first_mesh != nullptr)
    return from_mesh(
        mesh_margin(*first_mesh->tree, *second.convex(), second_first.inverse(), query), false);
  return convex_margin(*first.convex(), *second.convex(), second_first, query.clearance,
                       query.want);
}

/// The margin of a pair one of which is inside of the other one's solid mesh, if it is.
std::optional<LocalMargin> enclosed_margin(const CollisionShape& first,
                                           const CollisionShape& second, const Pose& second_first,
                                           const PairSeeds& seeds, const MarginQuery& query) {
  const std::uint32_t hint = query.hint.value_or(0);
  const double clearance = query.clearance;
  bool in_second = true;
  std::optional<Enclosed> in;
  if (!seeds.of_first.empty()) in = enclosed(*second.mesh(), seeds.of_first, second_first, hint);
  if (!in && !seeds.of_second.empty()) {
    in_second = false;
    in = enclosed(*first.mesh(), seeds.of_second, second_first.inverse(), 0);
  }
  if (!in) return std::nullopt;
  return LocalMargin{.lower = -clearance,
                     .upper = -clearance,
                     .found = true,
                     .distance = 0.0,
                     .on_first = in->point,
                     .on_second = in->point,
                     .normal = in_second ? in->normal : Vec3(-in->normal),
                     .triangle = in->triangle,
                     .in_second = in_second};
}

}  // namespace

PairMargin Scene::search(std::size_t pair, const ScenePoses& poses, const Wish& wish,
                         SceneCache* cache) const {
  prepare(cache);
  const ScenePair& asked = pairs()[pair];
  const Data::Pair& p = data_->prepared[pair];
  const SceneBody& first = bodies()[asked.first];
  const SceneBody& second = bodies()[asked.second];
  const Pose& at_first = Data::pose_of(first, poses.links_, poses.workpiece_);
  const Pose& at_second = Data::pose_of(second, poses.links_, poses.workpiece_);
  const Pose second_first = at_second.inverse() * at_first;

  MarginQuery query{
      .clearance = p.clearance, .want = wish.want, .decide = wish.decide, .need = wish.need};
  if (asked.exempt)
    query.exempt = ExemptBall{second_first * asked.exempt->centre, asked.exempt->radius};
  if (cache != nullptr) query.hint = cache->pairs_[pair].triangle;
  LocalMargin local = surface_margin(first.shape, second.shape, second_first, query);
  // Surfaces apart: one body may still be inside of the other.
  if (!(local.found && local.distance <= 0.0) && -p.clearance < wish.want)
    if (auto in = enclosed_margin(first.shape, second.shape, second_first, p.seeds, query))
      local = *in;

  PairMargin out;
  out.lower = local.lower;
  out.upper = local.upper;
  out.found = local.found;
  out.triangle = local.triangle;
  if (local.found) {
    const Pose to_w = poses.workpiece_.inverse() * (local.in_second ? at_second : at_first);
    out.distance = local.distance;
    out.on_first = to_w * local.on_first;
    out.on_second = to_w * local.on_second;
    out.normal = to_w.linear() * local.normal;
  }
  if (cache != nullptr) {
    ++cache->queries_;
    SceneCache::Known& known = cache->pairs_[pair];
    known.known = out.lower > 0.0;
    known.lower = out.lower;
    known.second_first = p.first_moves ? second_first : second_first.inverse();
    if (out.triangle != PairMargin::kNoTriangle) known.triangle = out.triangle;
  }
  return out;
}

PairMargin Scene::margin(std::size_t pair, const ScenePoses& poses, double want,
                         SceneCache* cache) const {
  require(pair < pairs().size(), "a pair of the scene");
  require(!std::isnan(want), "a bound that is a number");
  return search(pair, poses, {.want = want}, cache);
}

PairMargin Scene::decide(std::size_t pair, const ScenePoses& poses, double need) const {
  require(pair < pairs().size(), "a pair of the scene");
  require(need >= 0.0, "a need of at least 0");
  return search(pair, poses, {.want = need + tolerance(pair), .decide = true, .need = need},
                nullptr);
}

bool Scene::free(const JointVector& q, SceneCache* cache) const {
  prepare(cache);
  const ScenePoses at = poses(q);
  for (std::size_t pair = 0; pair < pairs().size(); ++pair) {
    const double gap = tolerance(pair);
    if (cache != nullptr) {
      const double known = known_margin(pair, at, *cache);
      SceneCache::Known& last = cache->pairs_[pair];
      if (known >= gap) {
        ++cache->skipped_;
        ++last.skips;
        continue;
      }
      // Knowing more than is needed costs time; it is tried again now and then where it saved none.
      const bool worth = last.skips >= 2 || last.searches % 8 == 0;
      const double ahead = worth ? look_ahead(last.known ? last.lower - known : 0.0) : 0.0;
      ++last.searches;
      last.skips = 0;
      const PairMargin found =
          search(pair, at, {.want = gap + ahead, .decide = true, .need = gap}, cache);
      if (found.lower >= gap) continue;
      if (found.found && found.upper < 0.0) return false;
      // Nearer to the limit than the gap: as without a cache.
    }
    if (search(pair, at, {.want = gap, .decide = true}, nullptr).lower < 0.0) return false;
  }
  return true;
}

Clearance Scene::clearance(const JointVector& q, double cap, SceneCache* cache) const {
  require(!std::isnan(cap), "a cap that is a number");
  prepare(cache);
  const ScenePoses at = poses(q);
  Clearance out;
  out.margin = cap;
  for (std::size_t pair = 0; pair < pairs().size(); ++pair) {
    if (cache != nullptr && known_margin(pair, at, *cache) >= out.margin) {
      ++cache->skipped_;
      continue;
    }
    const PairMargin found = search(pair, at, {.want = out.margin}, cache);
    if (!found.found) continue;
    out.margin = found.upper;
    out.pair = pair;
    out.at = found;
  }
  return out;
}

}  // namespace smoothpost
