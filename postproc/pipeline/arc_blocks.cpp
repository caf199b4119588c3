#include "postproc/pipeline/arc_blocks.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "kernels/spline/bent_move.h"
#include "machines/dialects/arc_text.h"

namespace smoothpost {

namespace {

constexpr std::size_t kLeastMoves = 3;
// Of what the schedule keeps to, below the machine's own limits: where the schedule is at a limit
// the even pace of an arc is a little above it somewhere.
constexpr double kOver = 1.03;

/// Coordinates of a plane's two joints.
using Point = Eigen::Vector2d;

/// The centre from which `a` and `b` are equally far and the others nearly so. Nothing: on one
/// line, or a and b in one point.
std::optional<Point> centre_of(const Point& a, const Point& b, const std::vector<Point>& between) {
  const Point middle = 0.5 * (a + b), half = 0.5 * (b - a);
  const double length = half.norm();
  if (!(length > 0.0)) return std::nullopt;
  const Point normal(-half.y() / length, half.x() / length);
  // |p − m − t n|² = |half|² + t² for a centre m + t n, so that 2 t (p − m)·n = |p − m|² − |half|².
  double top = 0.0, bottom = 0.0;
  for (const Point& p : between) {
    const Point off = p - middle;
    const double factor = 2.0 * off.dot(normal);
    top += factor * (off.squaredNorm() - half.squaredNorm());
    bottom += factor * factor;
  }
  if (!(bottom > 0.0) || !(std::abs(top) <= kMostRadius * bottom)) return std::nullopt;
  return Point(middle + top / bottom * normal);
}

class ArcMaker {
 public:
  ArcMaker(MachineProgram& program, const CurveInput& input)
      : program_(program),
        in_(input),
        runs_(program, input),
        limits_(feed_limits(input.machine)),
        planes_(arc_planes(input.machine)) {
    for (int j = 0; j < input.machine.size(); ++j) {
      const AxisDefinition& axis = input.machine.axes[static_cast<std::size_t>(j)];
      limits_.velocity[j] = std::min(kOver * limits_.velocity[j], axis.velocity);
      limits_.acceleration[j] = std::min(kOver * limits_.acceleration[j], axis.acceleration);
    }
  }

  CurveReport run() {
    return runs_.replace(
        {[this](std::size_t first, std::size_t end) { return holding_arc(first, end).turn != 0; },
         [this](std::size_t first, std::size_t end) {
           MachineMove move = program_.moves[end - 1];
           move.arc = holding_arc(first, end);
           return move;
         },
         [this](std::size_t first, std::size_t end) { return is_worth(first, end); }});
  }

 private:
  const JointVector& start(std::size_t first) const { return program_.moves[first - 1].to; }

  /// The arc that may take the place of moves first to end − 1; turn 0: none.
  JointArc holding_arc(std::size_t first, std::size_t end) const {
    const std::vector<double> paired = runs_.pairing(first, end);
    if (paired.empty() || !has_one_kind(first, end) || !runs_.keeps_time(first, end, paired))
      return {};
    for (const ArcPlane& plane : planes_) {
      if (!others_stand(plane, first, end)) continue;
      const JointArc arc = fitted(plane, first, end);
      if (arc.turn != 0 && holds(arc, first, end, paired)) return arc;
    }
    return {};
  }

  bool has_one_kind(std::size_t first, std::size_t end) const {
    const auto& points = in_.reference.path().points;
    const std::uint32_t from = program_.moves[first].from_segment;
    for (std::uint32_t k = from; k <= program_.moves[end - 1].segment; ++k)
      if (points[k].is_arc != points[from].is_arc) return false;
    return true;
  }

  bool others_stand(const ArcPlane& plane, std::size_t first, std::size_t end) const {
    for (int j = 0; j < in_.machine.size(); ++j) {
      if (j == plane.first || j == plane.second || j == plane.third) continue;
      const double stands = printed_joint(in_.machine, j, start(first)[j]);
      for (std::size_t i = first; i < end; ++i)
        if (printed_joint(in_.machine, j, program_.moves[i].to[j]) != stands) return false;
    }
    return true;
  }

  JointVector middle(std::size_t i) const {
    const BlockRuns::Place& place = runs_.places()[i];
    return runs_.stretch(i).joints.joints_at(0.5 * (place.from + place.to));
  }

  JointArc fitted(const ArcPlane& plane, std::size_t first, std::size_t end) const {
    const auto point = [&plane](const JointVector& q) {
      return Point(q[plane.first], q[plane.second]);
    };
    std::vector<Point> points;
    for (std::size_t i = first; i < end; ++i) {
      points.push_back(point(middle(i)));
      if (i + 1 < end) points.push_back(point(program_.moves[i].to));
    }
    const Point a = point(start(first)), b = point(program_.moves[end - 1].to);
    const auto centre = centre_of(a, b, points);
    if (!centre) return {};
    points.push_back(b);
    double turned = 0.0;
    Point last = a - *centre;
    for (const Point& p : points) {
      const Point now = p - *centre;
      turned += std::atan2(last.x() * now.y() - last.y() * now.x(), last.dot(now));
      last = now;
    }
    if (turned == 0.0 || std::abs(turned) > kMostSweep) return {};
    return {turned > 0.0 ? 1 : -1, plane.first, plane.second, centre->x(), centre->y()};
  }

  bool holds(const JointArc& arc, std::size_t first, std::size_t end,
             const std::vector<double>& paired) const {
    const BentMove run{start(first), program_.moves[end - 1].to, none_, arc};
    const double time = runs_.duration(first, end);
    double before = 0.0;
    for (std::size_t i = first; i < end; ++i) {
      const double now = paired[i - first], between = 0.5 * (before + now);
      if (!runs_.is_near(i, joints_at(run, between), middle(i)) ||
          !runs_.is_near(i, joints_at(run, now), program_.moves[i].to) ||
          !is_slow(run, between, time) || !is_slow(run, now, time))
        return false;
      before = now;
    }
    return is_slow(run, 0.0, time);
  }

  bool is_slow(const BentMove& run, double tau, double time) const {
    return (rates_at(run, tau).cwiseAbs().array() <= limits_.velocity.array() * time).all() &&
           (second_at(run, tau).cwiseAbs().array() <= limits_.acceleration.array() * time * time)
               .all();
  }

  bool is_worth(std::size_t first, std::size_t end) const {
    if (end - first < kLeastMoves) return false;
    const BentMove run{start(first), program_.moves[end - 1].to, none_, holding_arc(first, end)};
    const ArcShape shape = arc_shape(run);
    return shape.from_radius >= kLeastRadius && shape.from_radius <= kMostRadius &&
           std::abs(shape.sweep) >= kLeastSweep &&
           !runs_.is_near(first, joints_at(run, 0.5), 0.5 * (run.from + run.to));
  }

  MachineProgram& program_;
  const CurveInput& in_;
  BlockRuns runs_;
  FeedLimits limits_;
  std::vector<ArcPlane> planes_;
  JointBend none_;
};

}  // namespace

std::string arc_assumption() {
  return "the control goes along the arc of a block at an even pace, other axes of the block in "
         "proportion, keeps both ends, and makes what the radii there differ by good on the way";
}

CurveReport join_into_arcs(MachineProgram& program, const CurveInput& input) {
  return ArcMaker(program, input).run();
}

}  // namespace smoothpost
