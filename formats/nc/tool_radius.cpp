#include "formats/nc/tool_radius.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr double kNoMove = 1e-9;                 // mm
constexpr double kMostRadiusError = 0.01;        // units of the program: start and end of an arc
constexpr double kMostSweepMillimetre = 0.0254;  // rad: how much an arc may grow at its end
constexpr double kMostSweepInch = 0.001;
constexpr double kTangentEntry = 1e-6;  // least cosine at the end of an arc onto the contour

Vec2 unit_of(const Vec2& v) {
  const double length = v.norm();
  return length > 0.0 ? Vec2(v / length) : Vec2(0.0, 0.0);
}

/// Length of the way over X, Y and Z.
double way_of(const CanonicalMotion& m) {
  const Vec3 start(m.start[0], m.start[1], m.start[2]);
  const Vec3 step = Vec3(m.end[0], m.end[1], m.end[2]) - start;
  if (!m.is_arc) return step.norm();
  const double climb = step.dot(m.arc.normal);
  const Vec3 spoke = start - m.arc.centre;
  const double radius = (spoke - spoke.dot(m.arc.normal) * m.arc.normal).norm();
  return std::hypot(radius * m.arc.sweep, climb);
}

std::string length_text(double millimetres) { return decimal_text(millimetres, 4) + " mm"; }

}  // namespace

void RadiusCompensation::begin(const RadiusSettings& settings) {
  settings_ = settings;
  plane_ = plane_axes(settings.plane);
  on_ = true;
  failed_ = false;
}

void RadiusCompensation::end() {
  if (held_ && settle(beside(held_->end, settings_.tool))) beside_contour_ = true;
  held_.reset();
  waiting_.clear();
  on_ = false;
}

bool RadiusCompensation::fail(const std::string& text, const CanonicalMotion& motion) {
  if (!failed_) problem_(text, motion);
  failed_ = true;
  return false;
}

Vec2 RadiusCompensation::in_plane(const AxisWords& words) const {
  return {words[plane_.first], words[plane_.second]};
}

void RadiusCompensation::motion(const CanonicalMotion& motion) {
  if (shifts()) return follow_contour(motion);
  if (beside_contour_) return leave(motion);
  sink_.motion(motion);
}

/// The motion behind the compensation.
void RadiusCompensation::leave(const CanonicalMotion& motion) {
  beside_contour_ = false;
  if (motion.is_arc) {
    fail("the motion behind G40 is an arc: write a straight one", motion);
    return;
  }
  if (motion.tcp) {
    fail("the motion behind G40 stands in tool-centre-point mode: write one before M428", motion);
    return;
  }
  const double speed = motion.duration > 0.0 ? way_of(motion) / motion.duration : 0.0;
  CanonicalMotion out = motion;
  out.start[plane_.first] = stands_.x();
  out.start[plane_.second] = stands_.y();
  if (motion.kind == MotionKind::feed && way_of(out) > kNoMove) {
    if (!(speed > 0.0)) {
      fail("the motion behind G40 feeds to where the contour ended: write one with a way", motion);
      return;
    }
    out.duration = way_of(out) / speed;
  }
  sink_.motion(out);
}

RadiusCompensation::Element RadiusCompensation::element_of(const CanonicalMotion& motion) const {
  Element out;
  out.motion = motion;
  out.speed = motion.duration > 0.0 ? way_of(motion) / motion.duration : 0.0;
  out.begin.corner = in_plane(motion.start);
  out.end.corner = in_plane(motion.end);
  out.way = out.end.corner - out.begin.corner;
  if (!motion.is_arc) {
    out.begin.direction = out.end.direction = unit_of(out.way);
    return out;
  }
  const auto at = [&](std::size_t axis) { return motion.arc.centre[static_cast<int>(axis)]; };
  const double turn = motion.arc.sweep * motion.arc.normal[static_cast<int>(plane_.third)];
  out.sweep = std::abs(turn);
  out.further_turns = std::max(0, static_cast<int>(std::ceil(out.sweep / (2 * kPi) - 1e-6)) - 1);
  for (OffsetCurve* curve : {&out.begin, &out.end}) {
    curve->is_arc = true;
    curve->counter_clockwise = turn > 0.0;
    curve->centre = {at(plane_.first), at(plane_.second)};
    const Vec2 spoke = unit_of(curve->corner - curve->centre);
    curve->direction = turn > 0.0 ? left_of(spoke) : Vec2(-left_of(spoke));
    curve->radius = (curve->corner - curve->centre).norm() +
                    (is_tool_inside(*curve, settings_.tool) ? -1.0 : 1.0) * settings_.tool.radius;
  }
  return out;
}

void RadiusCompensation::follow_contour(const CanonicalMotion& motion) {
  if (failed_) return;
  const auto third = static_cast<int>(plane_.third);
  constexpr AxisMask kLinear = 7;
  const AxisMask plane = static_cast<AxisMask>((1u << plane_.first) | (1u << plane_.second));
  if (motion.machine_position || motion.tcp || (motion.programmed & ~kLinear) != 0) {
    fail("only X, Y and Z move under it, outside of tool-centre-point mode and machine coordinates",
         motion);
  } else if (motion.is_arc && std::abs(motion.arc.normal[third]) < 1.0 - 1e-12) {
    fail("an arc outside of its plane", motion);
  } else if ((motion.unknown_start & plane) != 0) {
    fail("the program has not given where the tool stands in the plane", motion);
  }
  if (failed_) return;
  Element next = element_of(motion);
  const bool moves = motion.is_arc || next.way.norm() > kNoMove;
  if (!held_) {
    if (!enter(next, motion)) return;
  } else if (!moves) {
    return call([this, motion, speed = next.speed](const Vec2& end) { send(motion, end, speed); });
  } else if (next.begin.is_arc && std::min(next.begin.radius, next.end.radius) <= kNoMove) {
    fail("the tool, radius " + length_text(settings_.tool.radius) +
             ", does not fit into the arc; take a smaller tool",
         motion);
    return;
  } else if (!join(next)) {
    return;
  }
  held_ = std::move(next);
}

/// The way onto the contour.
bool RadiusCompensation::enter(Element& element, const CanonicalMotion& motion) {
  centre_ = element.begin.corner;
  if (!beside_contour_) stands_ = centre_;
  beside_contour_ = false;
  if (motion.is_arc) return enter_by_arc(element, motion);
  const double way = element.way.norm();
  if (way > settings_.tool.radius) return true;
  return fail("the first motion, " + length_text(way) + " long, is not longer than the radius, " +
                  length_text(settings_.tool.radius) + "; begin further away",
              motion);
}

/// The centre of the arc lies on the spoke of the contour's end, as far from the start as from the
/// end beside the contour.
bool RadiusCompensation::enter_by_arc(Element& element, const CanonicalMotion& motion) {
  if (settings_.straight_entry)
    return fail("the first motion of a lathe tool is an arc: write a straight one", motion);
  if (std::min(element.begin.radius, element.end.radius) <= kNoMove)
    return fail("the tool does not fit into the first arc; take a smaller tool", motion);
  OffsetCurve& end = element.end;
  const Vec2 place = beside(end, settings_.tool);
  const Vec2 spoke = unit_of(end.centre - end.corner);
  const Vec2 chord = centre_ - place;
  const double along = chord.dot(spoke);
  if (along < kTangentEntry * chord.norm() || along <= 0.0)
    return fail("no arc of this sense leads from here onto the contour; write a straight motion",
                motion);
  end.radius = chord.squaredNorm() / (2.0 * along);
  end.centre = place + end.radius * spoke;
  if (!is_tool_inside(end, settings_.tool) && end.radius <= settings_.tool.radius)
    return fail("the arc onto the contour has the radius " + length_text(end.radius) +
                    ", not above that of the tool, " + length_text(settings_.tool.radius),
                motion);
  return true;
}

/// Makes the element that waits end where the next one begins, and sends it.
bool RadiusCompensation::join(const Element& next) {
  const OffsetCurve& before = held_->end;
  const Corner corner = corner_between(before, next.begin, settings_.tool);
  if (corner == Corner::inside) {
    const auto meeting = inside_corner(before, next.begin, settings_.tool);
    if (!meeting) return fail("the tool does not fit into the corner here", next.motion);
    return settle(*meeting);
  }
  if (!settle(beside(before, settings_.tool))) return false;
  if (corner == Corner::outside) round_corner(next);
  return true;
}

void RadiusCompensation::round_corner(const Element& next) {
  CanonicalMotion out = next.motion;
  out.end = out.start;
  out.is_arc = out.kind == MotionKind::feed;
  const Vec2 end = beside(next.begin, settings_.tool);
  if (out.is_arc) {
    for (int i = 0; i < 3; ++i) out.arc.centre[i] = out.start[static_cast<std::size_t>(i)];
    out.arc.normal = Vec3::Unit(static_cast<int>(plane_.third));
    const bool left = settings_.tool.left;
    out.arc.sweep = turn_between(next.begin.corner, centre_, end, !left) * (left ? -1.0 : 1.0);
    out.arc.centre[static_cast<int>(plane_.first)] += settings_.shift.x();
    out.arc.centre[static_cast<int>(plane_.second)] += settings_.shift.y();
  }
  send(out, end, next.speed);
}

/// Sends the element that waits, with its end, and what waits behind it.
bool RadiusCompensation::settle(const Vec2& end) {
  if (failed_) return false;
  CanonicalMotion out = held_->motion;
  if (!out.is_arc) {
    if ((end - centre_).dot(held_->way) < -kNoMove)
      return fail("the tool does not fit into the corner at the end of this motion", out);
  } else {
    const OffsetCurve& arc = held_->end;
    const double off =
        std::abs((end - arc.centre).norm() - (beside(arc, settings_.tool) - arc.centre).norm());
    const double sweep = 2.0 * kPi * held_->further_turns +
                         turn_between(arc.centre, centre_, end, arc.counter_clockwise);
    const double more = settings_.unit == 1.0 ? kMostSweepMillimetre : kMostSweepInch;
    if (off > kMostRadiusError * settings_.unit || sweep > held_->sweep + more)
      return fail("the tool does not fit into the corner at the end of this arc", out);
    out.arc.sweep = std::copysign(sweep, out.arc.sweep);
    out.arc.centre[static_cast<int>(plane_.first)] = arc.centre.x() + settings_.shift.x();
    out.arc.centre[static_cast<int>(plane_.second)] = arc.centre.y() + settings_.shift.y();
  }
  send(out, end, held_->speed);
  held_.reset();
  const auto waiting = std::move(waiting_);
  waiting_.clear();
  for (const auto& what : waiting) what(end);
  return true;
}

/// Sends `motion` from where the tool stands to beside the contour.
void RadiusCompensation::send(CanonicalMotion motion, const Vec2& end, double speed) {
  motion.start[plane_.first] = stands_.x();
  motion.start[plane_.second] = stands_.y();
  centre_ = end;
  stands_ = end + settings_.shift;
  motion.end[plane_.first] = stands_.x();
  motion.end[plane_.second] = stands_.y();
  motion.duration = speed > 0.0 ? way_of(motion) / speed : 0.0;
  sink_.motion(motion);
}

void RadiusCompensation::call(std::function<void(const Vec2&)> what) {
  if (held_) {
    waiting_.push_back(std::move(what));
  } else {
    what(centre_);
  }
}

void RadiusCompensation::dwell(double seconds, std::uint32_t line) {
  call([this, seconds, line](const Vec2&) { sink_.dwell(seconds, line); });
}

void RadiusCompensation::event(const ProcessEvent& event) {
  call([this, event](const Vec2&) { sink_.event(event); });
}

void RadiusCompensation::comment(std::string_view text, std::uint32_t line) {
  if (!held_) return sink_.comment(text, line);
  call([this, text = std::string(text), line](const Vec2&) { sink_.comment(text, line); });
}

void RadiusCompensation::tool_length(double length, int tool, std::uint32_t line) {
  call([this, length, tool, line](const Vec2&) { sink_.tool_length(length, tool, line); });
}

void RadiusCompensation::work_offset(const Vec3& origin, double rotation, int system,
                                     std::uint32_t line) {
  call([this, origin, rotation, system, line](const Vec2&) {
    sink_.work_offset(origin, rotation, system, line);
  });
}

void RadiusCompensation::program_end(std::uint32_t line) {
  end();
  sink_.program_end(line);
}

}  // namespace smoothpost::nc
