#include "postproc/pipeline/dense_runs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "postproc/pipeline/smoothed_path.h"

namespace smoothpost {

namespace {

constexpr double kNoMotion = 1e-9;              // mm
constexpr double kMostTurn = 0.1;               // rad, of one leg
constexpr double kMostRotationTolerance = 0.1;  // rad
constexpr double kMostEndBulge = 0.1;           // at the first and the last node
constexpr double kMostBulge = 0.3;              // of the tolerances
constexpr double kFitShare = 0.5;               // of the merge share: what legs do not need
constexpr std::size_t kFewest = 8;              // nodes of a curve
constexpr std::size_t kMost = 1000;
constexpr std::size_t kAround = 32;  // nodes on each side of a joint

/// Dense nodes first … last of a cut.
struct Row {
  std::size_t first = 0, last = 0;
};

/// Where a part of a row begins or ends.
struct Joint {
  SmoothingNode node;
  std::size_t index = 0;  ///< of the node of the cut that it is, or of the one right behind it
  bool between = false;   ///< it is the middle of a leg
  std::optional<PoseDerivatives> like;  ///< nothing: free
};

class DenseRunFinder {
 public:
  DenseRunFinder(const ReferencePath& reference, const std::vector<SmoothingNode>& nodes,
                 const SmoothingSettings& settings)
      : reference_(reference),
        nodes_(nodes),
        full_pose_(reference.path().full_pose),
        corner_(corner_settings(settings)) {
    fit_.tip_tolerance = (1.0 - kFitShare) * settings.merge_tip + settings.corner_tip;
    fit_.rotation_tolerance = std::min(
        kMostRotationTolerance, (1.0 - kFitShare) * settings.merge_axis + settings.corner_axis);
    fit_.whole_rotation = settings.whole_rotation;
  }

  std::vector<DenseRun> run() const {
    const std::vector<Row> rows = this->rows();
    std::vector<std::vector<DenseRun>> found(rows.size());
    tbb::parallel_for(std::size_t{0}, rows.size(),
                      [&](std::size_t i) { found[i] = solve(rows[i]); });
    std::vector<DenseRun> all;
    for (auto& runs : found)
      for (DenseRun& run : runs) all.push_back(std::move(run));
    return all;
  }

 private:
  bool is_line(std::size_t leg_end) const {
    const SmoothingNode& a = nodes_[leg_end - 1];
    const SmoothingNode& b = nodes_[leg_end];
    return b.arc < 0 && (b.location.tip - a.location.tip).norm() > kNoMotion &&
           b.length - a.length > kNoMotion &&
           angle_between(a.location.axis, b.location.axis) < kMostTurn &&
           (!full_pose_ || a.rotation.angularDistance(b.rotation) < kMostTurn);
  }

  bool is_dense(std::size_t i, double most = kMostBulge) const {
    if (!is_line(i) || !is_line(i + 1)) return false;
    const std::vector<DenseNode> three = dense_nodes({nodes_[i - 1], nodes_[i], nodes_[i + 1]});
    return dense_bulge(three[0], three[1], three[2], fit_) <= most;
  }

  /// With the rotation that is carried along.
  std::vector<DenseNode> dense_nodes(const std::vector<SmoothingNode>& nodes) const {
    std::vector<DenseNode> out;
    out.reserve(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const SmoothingNode& node = nodes[i];
      DenseNode dense{node.location.tip, node.rotation, node.length, node.split, node.exact};
      if (!full_pose_)
        dense.rotation = i == 0 ? least_rotation(Vec3::UnitZ(), node.location.axis)
                                : least_rotation(nodes[i - 1].location.axis, node.location.axis) *
                                      out.back().rotation;
      out.push_back(dense);
    }
    return out;
  }

  std::vector<Row> rows() const {
    std::vector<Row> out;
    for (std::size_t i = 1; i + 1 < nodes_.size();) {
      // A curve has to come out of a straight leg: its first corners are gentle ones.
      if (!is_dense(i, i == 1 ? kMostBulge : kMostEndBulge)) {
        ++i;
        continue;
      }
      std::size_t end = i;
      while (end + 2 < nodes_.size() && is_dense(end + 1)) ++end;
      std::size_t last = end;
      if (end + 2 < nodes_.size())
        while (last > i && !is_dense(last, kMostEndBulge)) --last;
      if (last - i + 1 >= kFewest) out.push_back({i, last});
      i = end + 1;
    }
    return out;
  }

  /// The middle of the leg that ends at node `index`, or the end of the cut that it comes from or
  /// leads to.
  Joint row_end(std::size_t index) const {
    Joint joint;
    joint.index = index;
    if (index == 1 || index + 1 == nodes_.size()) {
      joint.index = index == 1 ? 0 : index;
      joint.node = nodes_[joint.index];
      return joint;
    }
    const SmoothingNode& a = nodes_[index - 1];
    const SmoothingNode& b = nodes_[index];
    joint.between = true;
    joint.node.place = place_between(reference_, a.place, b.place, 0.5);
    joint.node.location = {0.5 * (a.location.tip + b.location.tip),
                           great_circle(a.location.axis, b.location.axis, 0.5)};
    joint.node.rotation = a.rotation.slerp(0.5, b.rotation);
    joint.node.length = 0.5 * (a.length + b.length);
    joint.node.keep = true;
    const std::vector<DenseNode> ends = dense_nodes({a, b});
    PathLeg leg;
    leg.turn = rotation_vector(ends[0].rotation, ends[1].rotation);
    const CornerPath straight(
        {{ends[0].tip, ends[0].rotation, true}, {ends[1].tip, ends[1].rotation, true}}, {leg}, {},
        corner_);
    joint.like = straight.derivatives(0, 0.5 * straight.length(0));
    return joint;
  }

  struct Part {
    Joint from, to;
    Row inside;
  };

  /// Cuts a row into parts; their joints are like the curve of the nodes around them.
  std::vector<Part> split(const Row& row) const {
    std::vector<Part> parts;
    Part part;
    part.from = row_end(row.first);
    part.inside.first = row.first;
    const std::size_t count = row.last - row.first + 1;
    const std::size_t pieces = (count + kMost - 1) / kMost;
    for (std::size_t k = 1; k < pieces; ++k) {
      const std::size_t index = row.first + count * k / pieces;
      auto joint = joint_at(index);
      if (!joint) continue;
      part.to = *joint;
      part.inside.last = index - 1;
      parts.push_back(part);
      part.from = std::move(*joint);
      part.inside.first = index + 1;
    }
    part.to = row_end(row.last + 1);
    part.inside.last = row.last;
    parts.push_back(std::move(part));
    return parts;
  }

  std::vector<DenseRun> solve(const Row& row) const {
    if (row.last < row.first + kFewest) return {};
    const std::vector<Part> parts = split(row);
    std::vector<std::optional<DenseRun>> found(parts.size());
    tbb::parallel_for(std::size_t{0}, parts.size(),
                      [&](std::size_t i) { found[i] = fit(parts[i]); });
    const bool complete =
        std::all_of(found.begin(), found.end(), [](const auto& f) { return f.has_value(); });
    std::vector<DenseRun> all;
    if (complete) {
      for (std::size_t i = 0; i < found.size(); ++i) {
        found[i]->joined = i > 0;
        all.push_back(std::move(*found[i]));
      }
      return all;
    }
    // Corners between the parts, or in the middle of the only one.
    const std::size_t middle = row.first + (row.last - row.first) / 2;
    std::vector<Row> apart;
    if (parts.size() == 1)
      apart = {{row.first, middle - 1}, {middle + 1, row.last}};
    else
      for (const Part& part : parts) apart.push_back(part.inside);
    for (const Row& r : apart)
      for (DenseRun& run : solve(r)) all.push_back(std::move(run));
    return all;
  }

  std::optional<Joint> joint_at(std::size_t index) const {
    std::vector<SmoothingNode> around(
        nodes_.begin() + static_cast<std::ptrdiff_t>(index - kAround),
        nodes_.begin() + static_cast<std::ptrdiff_t>(index + kAround + 1));
    around[kAround].split = true;
    const auto fit = fit_dense(dense_nodes(around), {}, {}, fit_);
    if (!fit) return {};
    const auto end = std::find(fit->ends.begin(), fit->ends.end(), kAround);
    const auto span = static_cast<std::size_t>(end - fit->ends.begin());
    Joint joint;
    joint.node = nodes_[index];
    joint.node.keep = true;
    joint.index = index;
    joint.like = fit->curve.derivatives(span, fit->curve.length(span));
    return joint;
  }

  std::optional<DenseRun> fit(const Part& part) const {
    std::vector<SmoothingNode> nodes = {part.from.node};
    nodes.insert(nodes.end(), nodes_.begin() + static_cast<std::ptrdiff_t>(part.inside.first),
                 nodes_.begin() + static_cast<std::ptrdiff_t>(part.inside.last + 1));
    nodes.push_back(part.to.node);
    const std::vector<DenseNode> dense = dense_nodes(nodes);
    auto found =
        fit_dense(dense, in_frame(part.from, dense.front()), in_frame(part.to, dense.back()), fit_);
    if (!found) return {};
    DenseRun run{part.from.node, part.to.node, 0, 0, 0, false, std::move(*found)};
    run.before = part.from.index;
    run.inside = part.inside.first;
    run.after = part.inside.last + (part.to.between ? 1 : 2);
    return run;
  }

  /// What a joint is like, seen from a frame that is turned about the tool against its own.
  std::optional<PoseDerivatives> in_frame(const Joint& joint, const DenseNode& node) const {
    if (!joint.like || full_pose_) return joint.like;
    const auto quaternion = [](const Eigen::Vector4d& q) {
      return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    };
    PoseDerivatives like = *joint.like;
    const Eigen::Quaterniond between = quaternion(like.rotation[0]).conjugate() * node.rotation;
    const Eigen::Quaterniond twist =
        Eigen::Quaterniond(between.w(), 0.0, 0.0, between.z()).normalized();
    for (Eigen::Vector4d& q : like.rotation) {
      const Eigen::Quaterniond turned = quaternion(q) * twist;
      q << turned.w(), turned.vec();
    }
    return like;
  }

  const ReferencePath& reference_;
  const std::vector<SmoothingNode>& nodes_;
  bool full_pose_;
  CornerSettings corner_;
  DenseSettings fit_;
};

}  // namespace

Eigen::Quaterniond least_rotation(const Vec3& from, const Vec3& to) {
  const double angle = angle_between(from, to);
  Vec3 normal = from.cross(to);
  // The plane that great_circle() takes.
  if (normal.norm() < 1e-12) normal = from.unitOrthogonal();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, normal.normalized()));
}

Vec3 rotation_vector(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  const Eigen::AngleAxisd turn(from.conjugate() * to);
  double angle = turn.angle();
  if (angle > EIGEN_PI) angle -= 2.0 * EIGEN_PI;
  return angle * turn.axis();
}

std::vector<DenseRun> dense_runs(const ReferencePath& reference,
                                 const std::vector<SmoothingNode>& nodes,
                                 const SmoothingSettings& settings) {
  return DenseRunFinder(reference, nodes, settings).run();
}

}  // namespace smoothpost
