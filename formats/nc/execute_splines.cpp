#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

// G5, G5.1 and G5.2 .. G5.3: splines in the XY plane, handed on as straight pieces.
namespace smoothpost::nc {
namespace {

constexpr AxisMask kXy = 3;
constexpr std::size_t kMostPieces = 100'000;  // of one spline
constexpr std::size_t kFreePieces = 16;       // what is more costs of the budget
constexpr double kMostOrder = 20.0;

Vec3 xyz(const AxisWords& words) { return {words[0], words[1], words[2]}; }

}  // namespace

void Executor::spline(const BlockWords& block, const BlockPlan& plan, GCode before) {
  const std::string code = g_code_text(plan.motion);
  const TextPlace place = at(block, GGroup::motion);
  const auto refuse = [&](const std::string& why) {
    log_.error("NC262", code + ": " + why, place);
  };
  const std::optional<Vec3> tangent = before == 50 ? last_tangent_ : std::nullopt;
  last_tangent_.reset();
  if (modal_.plane != 170) return refuse("a spline lies in the XY plane; write G17 before");
  if ((plan.axes & ~kXy) != 0) return refuse("a spline has X and Y words only");
  if ((coordinates_.unknown() & kXy) != 0) {
    return refuse("its start is not known: the program has not given X and Y; move there before");
  }
  if (modal_.per_turn) return refuse("no feed by the turn (G95); write G94 before");
  if (plan.motion == 52) return add_control_point(block, plan);
  if (!feed_given(block, plan)) return;

  const auto offset = [&](char x, char y, double sign) {
    return coordinates_.world_direction(
        Vec3(sign * block[x] * modal_.unit, sign * block[y] * modal_.unit, 0.0));
  };
  const AxisWords target_words = target(block, plan.axes);
  const Vec3 start = xyz(coordinates_.world());
  const Vec3 end = xyz(target_words);
  const bool has_start = block.has('I') && block.has('J');
  if (block.has('I') != block.has('J')) return refuse("I and J stand together");
  ControlNet net{{start, 1.0}};
  if (plan.motion == 51) {
    if (block.has('P') || block.has('Q')) return refuse("P and Q have no meaning here");
    if (!has_start || (block['I'] == 0.0 && block['J'] == 0.0)) {
      return refuse("I and J, the control point from the start, are missing or 0");
    }
    net.push_back({start + offset('I', 'J', 1.0), 1.0});
  } else {
    if (!block.has('P') || !block.has('Q')) {
      return refuse("P and Q, the second control point from the end, are missing");
    }
    if (!has_start && !tangent) {
      return refuse(
          "I and J, the first control point from the start, are missing; only a G5 behind "
          "a G5 goes on without them");
    }
    net.push_back({start + (has_start ? offset('I', 'J', 1.0) : *tangent), 1.0});
    net.push_back({end + offset('P', 'Q', 1.0), 1.0});
    last_tangent_ = offset('P', 'Q', -1.0);
  }
  net.push_back({end, 1.0});
  follow_curves(block, plan, {net});
}

/// What stands between G5.2 and G5.3 may not move the machine or its coordinates.
bool Executor::may_stand_in_spline(const BlockWords& block) {
  const GCode code = block.code(GGroup::non_modal);
  const bool moves =
      (code != kNoCode && code != 40) || block.code(GGroup::work_system) != kNoCode ||
      block.code(GGroup::length_offset) != kNoCode || block.code(GGroup::units) != kNoCode;
  if (!moves) return true;
  stop("NC262", "a spline (G5.2) is open here; write G5.3 before this code",
       reader_.place(block, block.first_piece));
  return false;
}

/// The first G5.2 gives the weight of the present point and the order; each pair of X and Y, on its
/// line or later ones, is a further control point.
void Executor::add_control_point(const BlockWords& block, const BlockPlan& plan) {
  const TextPlace place = at(block, GGroup::motion);
  const auto refuse = [&](const std::string& why) { stop("NC262", "G5.2: " + why, place); };
  const double weight = block.has('P') ? block['P'] : 1.0;
  if (!(weight > 0.0)) return refuse("P, the weight of a point, is not above 0");
  if (modal_.incremental) return refuse("no incremental words; write G90");
  if (modal_.inverse_time) return refuse("no inverse time; write G94");
  const bool first = control_points_.empty();
  if (first) {
    const double order = block.has('L') ? block['L'] : 3.0;
    if (std::abs(order - std::round(order)) > 1e-4 || order < 1.9999 || order > kMostOrder) {
      return refuse("L, the order, is a whole number from 2 to 20");
    }
    spline_order_ = static_cast<std::size_t>(std::lround(order));
    control_points_.push_back({xyz(coordinates_.world()), weight});
  } else if (block.has('L')) {
    return refuse("L, the order, stands on the first line only");
  }
  if (plan.axes == 0 && first) return;
  if (plan.axes != kXy) return refuse("a control point needs X and Y");
  control_points_.push_back({xyz(target(block, plan.axes)), weight});
}

void Executor::end_spline(const BlockWords& block, bool closed) {
  ControlNet net;
  net.swap(control_points_);
  const TextPlace place = at(block, GGroup::motion);
  if (!closed) return stop("NC262", "a spline (G5.2) is open here; write G5.3 before", place);
  if (net.size() < spline_order_) {
    return stop("NC262",
                "the spline has " + std::to_string(net.size()) +
                    " control points; its order needs at least " + std::to_string(spline_order_),
                place);
  }
  BlockPlan plan;
  plan.motion = kSplineEnd;
  plan.axes = kXy;
  if (feed_given(block, plan)) follow_curves(block, plan, bezier_spans(net, spline_order_));
}

/// Straight pieces along the curves; under G93 they share the time by their lengths.
void Executor::follow_curves(const BlockWords& block, const BlockPlan& plan,
                             const std::vector<ControlNet>& curves) {
  std::vector<Vec3> points;
  const TextPlace place = at(block, GGroup::motion);
  for (const ControlNet& curve : curves) {
    const std::vector<Vec3> piece = follow_bezier(curve, kSplineTolerance, kMostPieces);
    if (piece.empty() || !spend(piece.size() - std::min(piece.size(), kFreePieces), place)) {
      if (piece.empty()) {
        stop("NC262",
             "the spline needs more than " + std::to_string(kMostPieces) +
                 " straight pieces to be followed within 0.001 mm; let the CAM post write moves",
             place);
      }
      return;
    }
    points.insert(points.end(), piece.begin(), piece.end());
  }
  double length = 0.0;
  Vec3 last = xyz(coordinates_.world());
  for (const Vec3& point : points) {
    length += (point - last).norm();
    last = point;
  }
  for (const Vec3& point : points) {
    begin_motion(block, plan);
    motion_.kind = MotionKind::feed;
    motion_.end = motion_.start;
    const std::size_t axes = is_siemens() ? 3 : 2;
    for (std::size_t i = 0; i < axes; ++i) motion_.end[i] = point[static_cast<Eigen::Index>(i)];
    motion_.unknown_end = coordinates_.unknown();
    const double part = (point - xyz(motion_.start)).norm();
    if (modal_.inverse_time) {
      motion_.duration = length > 0.0 ? kSecondsPerMinute / block['F'] * part / length : 0.0;
    } else {
      motion_.duration = part / modal_.linear_feed;
    }
    finish_motion();
  }
}

}  // namespace smoothpost::nc
