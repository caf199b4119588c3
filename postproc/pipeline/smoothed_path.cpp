#include "postproc/pipeline/smoothed_path.h"

#include <algorithm>
#include <cmath>

#include "kernels/smooth/merge_points.h"
#include "postproc/pipeline/dense_runs.h"

namespace smoothpost {

namespace {

constexpr double kNoMotion = 1e-9;     // mm
constexpr double kNoTurn = 1e-10;      // rad
constexpr double kLongestArc = 2.0;    // rad of sweep in one leg
constexpr double kSameFeed = 1e-6;     // of the feed
constexpr double kNearFeed = 0.05;     // of the feed: on one span of a curve the least one counts
constexpr int kMostPieces = 256;       // of a curve
constexpr double kFitShare = 0.5;      // of the merge share, for legs in place of curves
constexpr int kCertificateSteps = 24;  // on each side of a corner

// The matrix of a unit quaternion is quadratic in it: the same form with two factors.
Mat3 rotation_form(const Eigen::Vector4d& p, const Eigen::Vector4d& q) {
  const Vec3 a = p.tail<3>(), b = q.tail<3>();
  return (p[0] * q[0] - a.dot(b)) * Mat3::Identity() + a * b.transpose() + b * a.transpose() +
         cross_matrix(Vec3(p[0] * b + q[0] * a));
}

MatrixJet rotation_jet(const std::array<Eigen::Vector4d, 4>& q) {
  MatrixJet out;
  for (std::size_t r = 0; r < 4; ++r) {
    out[r].setZero();
    for (std::size_t s = 0; s <= r; ++s) out[r] += kLeibniz[r][s] * rotation_form(q[s], q[r - s]);
  }
  return out;
}

}  // namespace

SmoothedPath::SmoothedPath(const ReferencePath& reference) : reference_(reference) {
  legs_.push_back({{0, 1.0}, {0, 1.0}, -1, 0, -1});
  for (std::uint32_t k = 1; k <= reference.segments(); ++k)
    legs_.push_back({{k, 0.0}, {k, 1.0}, -1, 0, -1});
}

CornerSettings corner_settings(const SmoothingSettings& from) {
  CornerSettings settings;
  settings.kind = from.kind;
  settings.shape = from.shape;
  settings.paper_shape = from.paper_shape;
  settings.ramp_c1 = from.ramp_c1;
  settings.tip_tolerance = from.corner_tip;
  settings.rotation_tolerance = from.corner_axis;
  if (!from.whole_rotation) settings.tool_axis = Vec3::UnitZ();
  return settings;
}

/// Makes the legs of one path.
class PathSmoother {
 public:
  PathSmoother(SmoothedPath& out, const ReferencePath& reference, const std::vector<Cut>& cuts,
               const SmoothingSettings& settings)
      : out_(out),
        reference_(reference),
        path_(reference.path()),
        cuts_(cuts),
        settings_(settings) {}

  void run() {
    mark_exact();
    out_.legs_.push_back({{0, 1.0}, {0, 1.0}, -1, 0, -1});
    auto cut = cuts_.begin();
    for (std::uint32_t k = 1; k <= reference_.segments();) {
      while (cut != cuts_.end() && (cut->omitted || cut->last < k)) ++cut;
      if (cut == cuts_.end() || k < cut->first) {
        out_.legs_.push_back({{k, 0.0}, {k, 1.0}, -1, 0, -1});
        ++k;
        continue;
      }
      smooth(cut->first, cut->last);
      k = cut->last + 1;
    }
  }

 private:
  using Node = SmoothingNode;

  void mark_exact() {
    exact_.assign(path_.points.size(), false);
    for (const PathEvent& e : path_.events)
      if (e.kind != PathEvent::Kind::comment) exact_[e.point] = true;
    for (std::size_t k = 1; k + 1 < path_.points.size(); ++k) {
      const PathPoint& here = path_.points[k];
      const PathPoint& next = path_.points[k + 1];
      if (here.beam != next.beam || here.kind != next.kind || here.tool != next.tool ||
          here.tool_length != next.tool_length)
        exact_[k] = true;
    }
  }

  void smooth(std::uint32_t first, std::uint32_t last) {
    nodes_.clear();
    arcs_.clear();
    Node start = node_at({first, 0.0});
    start.place = {first - 1, 1.0};
    start.exact = start.keep = true;
    nodes_.push_back(start);
    for (std::uint32_t k = first; k <= last; ++k) add_segment(k);
    nodes_.back().exact = nodes_.back().keep = true;
    drop_repeated();
    for (std::size_t i = 1; i + 1 < nodes_.size(); ++i) {
      Node& node = nodes_[i];
      node.split = node.exact;
      if (node.place.s < 1.0) continue;
      const double change = feed_change(node.place.segment, nodes_[i + 1].place.segment);
      if (change > kSameFeed) node.keep = true;
      if (change > kNearFeed) node.split = true;
    }
    std::vector<DenseRun> curves;
    if (settings_.fit_dense) curves = dense_runs(reference_, nodes_, settings_);
    std::size_t next = 0;
    const Node* behind = nullptr;
    for (DenseRun& run : curves) {
      if (!run.joined) blend(behind, next, run.before, &run.begin);
      add_curve(run);
      next = run.after;
      behind = &run.end;
    }
    blend(behind, next, nodes_.size(), nullptr);
  }

  // Nodes that repeat their neighbour; of a kept one's repetitions the kept one stays.
  void drop_repeated() {
    std::vector<Node> kept;
    kept.reserve(nodes_.size());
    for (Node& node : nodes_) {
      if (!kept.empty() && stands_still(kept.back(), node) && !(kept.back().keep && node.keep)) {
        ++out_.merged_points_;
        if (!node.keep) continue;
        kept.pop_back();
      }
      kept.push_back(std::move(node));
    }
    nodes_ = std::move(kept);
  }

  // Corners from the end of a curve (or the cut's start) to the start of one (or the cut's end).
  // Legs that go straight into a curve stay as they are: the curve has their direction.
  void blend(const Node* behind, std::size_t first, std::size_t last, const Node* before) {
    part_.clear();
    if (behind) part_.push_back(*behind);
    part_.insert(part_.end(), nodes_.begin() + static_cast<std::ptrdiff_t>(first),
                 nodes_.begin() + static_cast<std::ptrdiff_t>(last));
    if (before) part_.push_back(*before);
    if (part_.size() < 2) return;
    if (behind) part_[1].keep = true;
    if (before) part_[part_.size() - 2].keep = true;
    part_.front().keep = part_.back().keep = true;
    merge();
    make_runs();
  }

  void add_curve(DenseRun& run) {
    PathPlace from = run.begin.place;
    for (std::uint32_t span = 0; span < run.fit.ends.size(); ++span) {
      const bool last = span + 1 == run.fit.ends.size();
      const PathPlace to = last ? run.end.place : nodes_[run.inside + run.fit.ends[span] - 1].place;
      out_.legs_.push_back({from, to, -1, span, static_cast<std::int32_t>(out_.curves_.size())});
      from = to;
    }
    // A middle of a leg is no point of the input; a joint was counted before.
    out_.fitted_points_ += static_cast<std::uint32_t>(run.after - run.inside) +
                           (run.inside > run.before && !run.joined ? 1 : 0);
    out_.curves_.push_back(std::move(run.fit.curve));
  }

  double feed_change(std::uint32_t before, std::uint32_t after) const {
    const double a = reference_.feed(before);
    const double b = reference_.feed(after);
    return a == b ? 0.0 : std::abs(a - b) / std::max(a, b);
  }

  Node node_at(const PathPlace& place) const {
    Node node;
    node.place = place;
    node.location = reference_.at(place.segment, place.s);
    if (path_.full_pose) node.rotation = reference_.rotation_at(place.segment, place.s);
    return node;
  }

  void push(Node node, double length) {
    Node& last = nodes_.back();
    node.length = last.length + length;
    // A turn in place has no length to be paired by: it stays a leg of its own.
    const bool turns = (last.location.axis - node.location.axis).norm() > kNoTurn ||
                       last.rotation.angularDistance(node.rotation) > kNoTurn;
    if (length < kNoMotion && turns) last.keep = node.keep = true;
    nodes_.push_back(std::move(node));
  }

  void add_segment(std::uint32_t k) {
    const PathPoint& to = path_.points[k];
    const bool exact = exact_[k];
    if (is_line(to)) {
      Node node = node_at({k, 1.0});
      node.exact = exact;
      node.keep = exact;
      return push(std::move(node), reference_.length(k));
    }
    if (to.is_arc && add_arcs(k)) {
      nodes_.back().exact = exact;
      return;
    }
    add_chords(k);
    nodes_.back().exact = exact;
    nodes_.back().keep = nodes_.back().keep || exact;
  }

  static bool is_line(const PathPoint& to) {
    return !to.is_arc && (to.interpolation == PathInterpolation::great_circle ||
                          to.interpolation == PathInterpolation::slerp);
  }

  // A curve as equal shares of straight legs, so many that it stays within its tolerance.
  void add_chords(std::uint32_t k) {
    int pieces = 1;
    while (pieces < kMostPieces && !chords_fit(k, pieces)) pieces *= 2;
    for (int i = 1; i <= pieces; ++i) {
      Node node = node_at({k, i == pieces ? 1.0 : static_cast<double>(i) / pieces});
      node.keep = pieces > 1;
      push(std::move(node), reference_.length(k) / pieces);
    }
  }

  bool chords_fit(std::uint32_t k, int pieces) const {
    CutterLocation from = reference_.at(k, 0.0);
    for (int i = 1; i <= pieces; ++i) {
      const CutterLocation to = reference_.at(k, static_cast<double>(i) / pieces);
      for (const double t : {0.25, 0.5, 0.75})
        if (!fits(reference_.at(k, (i - 1 + t) / pieces),
                  {from.tip + t * (to.tip - from.tip), great_circle(from.axis, to.axis, t)}))
          return false;
      from = to;
    }
    return true;
  }

  bool fits(const CutterLocation& wanted, const CutterLocation& got) const {
    return (wanted.tip - got.tip).norm() <= kFitShare * settings_.merge_tip &&
           (wanted.axis - got.axis).norm() <= kFitShare * settings_.merge_axis;
  }

  // An arc or helix as legs on circles through their own ends. False: it is no such curve here.
  bool add_arcs(std::uint32_t k) {
    const ArcGeometry& whole = path_.arcs[static_cast<std::size_t>(path_.points[k].arc)];
    const int pieces =
        std::max(1, static_cast<int>(std::ceil(std::abs(whole.sweep) / kLongestArc)));
    std::vector<ArcGeometry> made;
    std::vector<Node> ends;
    CutterLocation from = reference_.at(k, 0.0);
    for (int i = 1; i <= pieces; ++i) {
      const double s0 = static_cast<double>(i - 1) / pieces;
      const double s1 = i == pieces ? 1.0 : static_cast<double>(i) / pieces;
      ends.push_back(node_at({k, s1}));
      const auto arc = arc_between(k, s0, s1, whole.sweep / pieces, from, ends.back().location);
      if (!arc) return false;
      made.push_back(*arc);
      from = ends.back().location;
    }
    for (std::size_t i = 0; i < ends.size(); ++i) {
      ends[i].keep = true;
      ends[i].arc = static_cast<std::int32_t>(arcs_.size());
      arcs_.push_back(made[i]);
      nodes_.back().keep = true;
      const ArcGeometry& arc = made[i];
      const Vec3 chord = ends[i].location.tip - nodes_.back().location.tip;
      const double radius = arc.normal.cross(nodes_.back().location.tip - arc.centre).norm();
      push(std::move(ends[i]), std::hypot(radius * arc.sweep, arc.normal.dot(chord)));
    }
    return true;
  }

  std::optional<ArcGeometry> arc_between(std::uint32_t k, double s0, double s1, double sweep,
                                         const CutterLocation& from,
                                         const CutterLocation& to) const {
    ArcGeometry arc;
    arc.normal =
        reference_.part_direction(path_.arcs[static_cast<std::size_t>(path_.points[k].arc)].normal);
    arc.sweep = sweep;
    const Vec3 whole_chord = to.tip - from.tip;
    const Vec3 chord = whole_chord - arc.normal * arc.normal.dot(whole_chord);
    if (std::abs(std::sin(0.5 * sweep)) < 1e-6 || chord.norm() < kNoMotion) return {};
    arc.centre = from.tip + 0.5 * chord + arc.normal.cross(chord) / (2.0 * std::tan(0.5 * sweep));
    const Vec3 spoke = from.tip - arc.centre;
    for (const double t : {0.2, 0.4, 0.6, 0.8}) {
      const Vec3 tip = arc.centre + rotation_about(arc.normal, t * sweep) * spoke +
                       t * arc.normal * arc.normal.dot(whole_chord);
      if (!fits(reference_.at(k, s0 + t * (s1 - s0)), {tip, great_circle(from.axis, to.axis, t)}))
        return {};
    }
    return arc;
  }

  void merge() {
    std::vector<MergePoint> points;
    points.reserve(part_.size());
    for (const Node& node : part_)
      points.push_back(
          {node.location.tip, node.location.axis, node.rotation, node.length, node.keep});
    MergeSettings settings;
    settings.tip_tolerance = (1.0 - kFitShare) * settings_.merge_tip;
    settings.axis_tolerance = (1.0 - kFitShare) * settings_.merge_axis;
    settings.whole_rotation = path_.full_pose;
    std::vector<Node> kept;
    for (const std::uint32_t i : merge_points(points, settings)) kept.push_back(part_[i]);
    out_.merged_points_ += static_cast<std::uint32_t>(part_.size() - kept.size());
    part_ = std::move(kept);
  }

  static bool stands_still(const Node& a, const Node& b) {
    return b.arc < 0 && (a.location.tip - b.location.tip).norm() < kNoMotion &&
           (a.location.axis - b.location.axis).norm() < kNoTurn &&
           a.rotation.angularDistance(b.rotation) < kNoTurn;
  }
  bool stands_still(std::size_t node) const { return stands_still(part_[node - 1], part_[node]); }

  // One CornerPath for each stretch without a leg on which nothing moves.
  void make_runs() {
    for (std::size_t i = 1; i < part_.size();) {
      if (stands_still(i)) {
        out_.legs_.push_back({part_[i - 1].place, part_[i].place, -1, 0, -1});
        ++i;
        continue;
      }
      std::size_t end = i;
      while (end < part_.size() && !stands_still(end)) ++end;
      make_run(i - 1, end - 1);
      i = end;
    }
  }

  void make_run(std::size_t first, std::size_t last) {
    std::vector<PathNode> nodes;
    std::vector<PathLeg> legs;
    PathNode node;
    node.tip = part_[first].location.tip;
    node.rotation = path_.full_pose ? part_[first].rotation
                                    : least_rotation(Vec3::UnitZ(), part_[first].location.axis);
    nodes.push_back(node);
    out_.first_leg_.push_back(static_cast<std::uint32_t>(out_.legs_.size()));
    for (std::size_t i = first + 1; i <= last; ++i) {
      PathLeg leg;
      leg.arc = part_[i].arc;
      const Eigen::Quaterniond before = node.rotation;
      node.tip = part_[i].location.tip;
      node.exact = part_[i].exact;
      node.rotation =
          path_.full_pose
              ? part_[i].rotation
              : least_rotation(part_[i - 1].location.axis, part_[i].location.axis) * before;
      leg.turn = rotation_vector(before, node.rotation);
      nodes.push_back(node);
      legs.push_back(leg);
      out_.legs_.push_back({part_[i - 1].place, part_[i].place,
                            static_cast<std::int32_t>(out_.runs_.size()),
                            static_cast<std::uint32_t>(legs.size() - 1), -1});
    }
    out_.runs_.emplace_back(std::move(nodes), std::move(legs), arcs_, corner_settings(settings_));
  }

  SmoothedPath& out_;
  const ReferencePath& reference_;
  const ToolPath& path_;
  const std::vector<Cut>& cuts_;
  const SmoothingSettings& settings_;
  std::vector<bool> exact_;
  std::vector<Node> nodes_;  ///< of the cut
  std::vector<Node> part_;   ///< of it, between curves
  std::vector<ArcGeometry> arcs_;
};

SmoothedPath::SmoothedPath(const ReferencePath& reference, const std::vector<Cut>& cuts,
                           const SmoothingSettings& settings)
    : reference_(reference) {
  PathSmoother(*this, reference, cuts, settings).run();
}

const PathPoint& SmoothedPath::point(std::size_t leg) const {
  return reference_.path().points[legs_[leg].to.segment];
}

CutterLocation SmoothedPath::at(std::size_t leg, double s) const {
  const Leg& l = legs_[leg];
  if (l.curve >= 0) {
    const PoseCurve& curve = curves_[static_cast<std::size_t>(l.curve)];
    const Pose pose = curve.at(l.index, s * curve.length(l.index));
    return {pose.translation(), pose.linear().col(2)};
  }
  if (l.run >= 0) {
    const CornerPath& run = runs_[static_cast<std::size_t>(l.run)];
    const Pose pose = run.at(l.index, s * run.length(l.index));
    return {pose.translation(), pose.linear().col(2)};
  }
  if (leg == 0) return reference_.path().points[0].location;
  const PathPlace at = place(leg, s);
  return reference_.at(at.segment, at.s);
}

Mat3 SmoothedPath::rotation_at(std::size_t leg, double s) const {
  const Leg& l = legs_[leg];
  if (l.curve >= 0) {
    const PoseCurve& curve = curves_[static_cast<std::size_t>(l.curve)];
    return curve.at(l.index, s * curve.length(l.index)).linear();
  }
  if (l.run >= 0) {
    const CornerPath& run = runs_[static_cast<std::size_t>(l.run)];
    return run.at(l.index, s * run.length(l.index)).linear();
  }
  if (leg == 0) return reference_.path().points[0].rotation.toRotationMatrix();
  const PathPlace at = place(leg, s);
  return reference_.rotation_at(at.segment, at.s).toRotationMatrix();
}

std::optional<PoseJet> SmoothedPath::jet(std::size_t leg, double s) const {
  const Leg& l = legs_[leg];
  if (l.run < 0 && l.curve < 0) return {};
  const double length = this->length(leg);
  PoseDerivatives d =
      l.curve >= 0 ? curves_[static_cast<std::size_t>(l.curve)].derivatives(l.index, s * length)
                   : runs_[static_cast<std::size_t>(l.run)].derivatives(l.index, s * length);
  double scale = 1.0;
  PoseJet jet;
  for (std::size_t r = 0; r < 4; ++r, scale *= length) {
    jet.tip.col(static_cast<Eigen::Index>(r)) = scale * d.tip[r];
    d.rotation[r] *= scale;
  }
  jet.rotation = rotation_jet(d.rotation);
  return jet;
}

PathPlace SmoothedPath::place(std::size_t leg, double s) const {
  const Leg& l = legs_[leg];
  if (leg == 0 || s >= 1.0) return l.to;
  return place_between(reference_, l.from, l.to, s);
}

double SmoothedPath::length(std::size_t leg) const {
  const Leg& l = legs_[leg];
  if (l.curve >= 0) return curves_[static_cast<std::size_t>(l.curve)].length(l.index);
  if (l.run >= 0) return runs_[static_cast<std::size_t>(l.run)].length(l.index);
  return leg == 0 ? 0.0 : reference_.length(l.to.segment);
}

double SmoothedPath::feed(std::size_t leg) const {
  const Leg& l = legs_[leg];
  double least = reference_.feed(l.to.segment);
  if (l.curve >= 0)
    for (std::uint32_t k = l.from.segment + (l.from.s < 1.0 ? 0 : 1); k < l.to.segment; ++k)
      if (const double feed = reference_.feed(k); feed > 0.0)
        least = least > 0.0 ? std::min(least, feed) : feed;
  return least;
}

std::vector<double> SmoothedPath::breaks(std::size_t leg) const {
  const Leg& l = legs_[leg];
  if (l.run < 0) return {0.0, 1.0};
  const CornerPath& run = runs_[static_cast<std::size_t>(l.run)];
  std::vector<double> shares = run.breaks(l.index);
  for (double& x : shares) x /= run.length(l.index);
  shares.back() = 1.0;
  return shares;
}

SecondDerivativeBound SmoothedPath::second_derivative_bound(std::size_t leg, double from,
                                                            double to) const {
  const Leg& l = legs_[leg];
  if (l.run < 0 && l.curve < 0) return reference_.second_derivative_bound(l.to.segment);
  const double length = this->length(leg);
  const CornerPath::Bend bend =
      l.curve >= 0
          ? curves_[static_cast<std::size_t>(l.curve)].bend_bound(l.index)
          : runs_[static_cast<std::size_t>(l.run)].bend_bound(l.index, from * length, to * length);
  SecondDerivativeBound bound;
  bound.tip = bend.tip * length * length;
  bound.axis = bend.axis * length * length;
  return bound;
}

std::vector<SmoothedCorner> SmoothedPath::corners() const {
  std::vector<SmoothedCorner> all;
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const CornerPath& run = runs_[r];
    for (std::size_t i = 1; i < run.legs(); ++i) {
      const Corner& c = run.corners()[i];
      // Nodes inside a segment are ours: its parts go on as one curve.
      if (legs_[first_leg_[r] + i - 1].to.s < 1.0) continue;
      if (c.half_width > 0.0 || c.rotation_half_width > 0.0 || c.stop)
        all.push_back(measure(run, first_leg_[r], i));
    }
  }
  return all;
}

SmoothedCorner SmoothedPath::measure(const CornerPath& run, std::size_t first_leg,
                                     std::size_t node) const {
  const Corner& c = run.corners()[node];
  const std::size_t after = first_leg + node;  // the leg behind the node; node − 1 is before it
  SmoothedCorner out;
  out.input_line = point(after - 1).line;
  out.turn = c.turn;
  out.method = c.stop ? "stop" : c.blend.is_acr() ? "acr" : "ramp";
  if (c.blend.is_acr())
    out.shape = c.blend.shape();
  else
    out.c1 = c.blend.c1();
  out.half_width = c.half_width;
  out.rotation_half_width = c.rotation_half_width;
  out.stop = c.stop;
  const double extent = std::max(c.half_width * c.blend.reach(),
                                 c.rotation_half_width * run.rotation_blend().reach());
  for (int i = -kCertificateSteps; i <= kCertificateSteps; ++i) {
    const double x = extent * i / kCertificateSteps;
    const std::size_t leg = i < 0 ? after - 1 : after;
    const double length = run.length(leg - first_leg);
    const double s = std::clamp((i < 0 ? length + x : x) / length, 0.0, 1.0);
    const PathPlace on = place(leg, s);
    const CutterLocation wanted = reference_.at(on.segment, on.s);
    const CutterLocation got = at(leg, s);
    out.tip_deviation = std::max(out.tip_deviation, (got.tip - wanted.tip).norm());
    out.axis_deviation = std::max(out.axis_deviation, angle_between(got.axis, wanted.axis));
    if (full_pose())
      out.rotation_deviation = std::max(
          out.rotation_deviation, reference_.rotation_at(on.segment, on.s)
                                      .angularDistance(Eigen::Quaterniond(rotation_at(leg, s))));
  }
  const PathPoint& segment = point(after);
  const double length = reference_.length(legs_[after].to.segment);
  if (segment.duration > 0.0 && !c.stop)
    out.speed = length / segment.duration * run.derivatives(node, 0.0).tip[1].norm();
  return out;
}

}  // namespace smoothpost
