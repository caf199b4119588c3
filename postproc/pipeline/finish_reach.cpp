#include "postproc/pipeline/finish_reach.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "kernels/optimise/redundancy.h"
#include "postproc/pipeline/clearance_check.h"

namespace smoothpost {

namespace {

constexpr double kGrid = 4.0;  // deg or mm
constexpr double kStep = 5.0;  // mm, of the part's height
constexpr int kHeights = 41;
constexpr std::size_t kMostPoints = 300;

}  // namespace

std::optional<FinishReach> FinishReach::make(const FinishReachInput& input) {
  const MachineDefinition& machine = input.machine;
  ScrewChain chain = chain_of(machine);
  chain.workpiece_home = chain.workpiece_home * input.placement;
  FinishReach out;
  out.machine_ = &machine;
  out.free_joint_ = redundant_joint(chain);
  auto pair = RotaryPair::from(chain);
  if (out.free_joint_ < 0 || !pair) return {};
  out.pair_ = std::make_shared<RotaryPair>(std::move(*pair));
  const AxisDefinition& axis = machine.axes[static_cast<std::size_t>(out.free_joint_)];
  const bool rotary = axis.joint.kind == JointKind::rotary;
  const double grid = rotary ? radians_from_degrees(kGrid) : kGrid;
  // A turn of a rotary says all.
  const double lower = axis.joint.cyclic ? -kPi : std::max(axis.joint.lower, rotary ? -kPi : -1e6);
  const double upper = axis.joint.cyclic ? kPi : std::min(axis.joint.upper, rotary ? kPi : 1e6);
  for (double free = lower; free <= upper; free += grid) out.grid_.push_back(free);
  if (!input.collisions) return out;
  auto scene = machine_scene(
      {machine, chain, input.stock, input.tree, largest_allowance({}, machine, false)});
  if (!scene.ok()) return {};
  if (scene.value()) {
    out.scene_ = std::make_shared<Scene>(std::move(*scene.value()));
    out.cache_ = std::make_shared<SceneCache>();
  }
  return out;
}

std::optional<JointVector> FinishReach::joints(const CutterLocation& at, double tool_length) const {
  const CutterLocation holder{at.tip + tool_length * at.axis, at.axis};
  const JointVector home = home_of(*machine_);
  const auto try_at = [&](std::size_t k) -> std::optional<JointVector> {
    JointVector held = home;
    held[free_joint_] = grid_[k];
    const RotaryPairSolutions found = pair_->solve(holder, held);
    for (std::size_t b = 0; b < 2; ++b) {
      if (!found.valid[b]) continue;
      JointVector q = found.q[b];
      bool inside = true;
      for (Eigen::Index j = 0; inside && j < q.size(); ++j) {
        const auto& joint = machine_->axes[static_cast<std::size_t>(j)].joint;
        if (joint.kind == JointKind::rotary)
          q[j] += 2.0 * kPi * std::round((home[j] - q[j]) / (2.0 * kPi));
        inside = j == free_joint_ || joint.cyclic || (q[j] >= joint.lower && q[j] <= joint.upper);
      }
      if (inside && (!scene_ || scene_->free(q, cache_.get()))) return q;
    }
    return {};
  };
  // From the last answer outwards to both sides.
  const std::size_t n = grid_.size();
  for (std::size_t step = 0; step <= n; ++step) {
    const std::size_t away = (step + 1) / 2;
    const std::size_t k = step % 2 == 0 ? (last_ + away) % n : (last_ + n - away % n) % n;
    if (auto q = try_at(k)) {
      last_ = k;
      return q;
    }
  }
  return {};
}

std::optional<FinishPlace> find_finish_place(const FinishPath& path,
                                             const MachineDefinition& machine, bool collisions) {
  const auto& points = path.path.points;
  if (points.empty()) return {};
  const std::size_t stride = points.size() / kMostPoints + 1;
  Vec3 low = Vec3::Constant(INFINITY), high = -low;
  for (const Vec3& v : path.stock.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  auto built = build_triangle_tree(path.stock);
  if (!built.ok()) return {};
  const auto tree = std::make_shared<const TriangleTree>(std::move(built.value()));
  std::optional<FinishPlace> best;
  for (int k = 0; k < kHeights; ++k) {
    FinishPlace place;
    place.position = Vec3(-0.5 * (low.x() + high.x()), -0.5 * (low.y() + high.y()),
                          kStep * k - std::floor(low.z()));
    Pose placement = Pose::Identity();
    placement.translation() = place.position;
    const auto reach = FinishReach::make({machine, placement, &path.stock, tree, collisions});
    if (!reach) return {};
    for (std::size_t i = 0; i < points.size(); i += stride) {
      ++place.points;
      // There, and with the clearance that a link draws back by.
      CutterLocation away = points[i].location;
      away.tip += machine.links.clearance * away.axis;
      place.reached += reach->reaches(points[i].location, points[i].tool_length) &&
                       reach->reaches(away, points[i].tool_length);
    }
    if (!best || place.reached > best->reached) best = place;
    if (best->reached == best->points) break;
  }
  return best;
}

FinishPath without_cuts(FinishPath path, const std::vector<std::size_t>& cuts) {
  require(cuts.size() < path.cuts.size(), "a cut stays");
  if (cuts.empty()) return path;
  std::vector<FinishCut> kept;
  std::vector<PathPoint> points;
  for (std::size_t i = 0; i < path.cuts.size(); ++i) {
    FinishCut& cut = path.cuts[i];
    if (std::binary_search(cuts.begin(), cuts.end(), i)) {
      FinishLayer& layer = path.layers[cut.layer];
      --layer.cuts;
      layer.left_out.reach += cut.length();
      continue;
    }
    const auto from = path.path.points.begin() + static_cast<std::ptrdiff_t>(cut.first_point);
    cut.first_point = points.size();
    points.insert(points.end(), from, from + static_cast<std::ptrdiff_t>(cut.s.size()));
    kept.push_back(std::move(cut));
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].line = static_cast<std::uint32_t>(i + 1);
  path.cuts = std::move(kept);
  path.path.points = std::move(points);
  PathEvent& off = path.path.events.back();
  off.point = path.path.points.size() - 1;
  off.line = off.event.line = path.path.points.back().line;
  return path;
}

}  // namespace smoothpost
