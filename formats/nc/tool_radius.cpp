#include "formats/nc/tool_radius.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr double kNoMove = 1e-9;      // mm
constexpr double kStraightOn = 1e-6;  // rad: two elements that join without a corner
constexpr double kSlack = 1e-6;       // mm

Vec3 xyz(const AxisWords& words) { return {words[0], words[1], words[2]}; }

void set_xy(AxisWords& words, const Vec3& point) {
  words[0] = point.x();
  words[1] = point.y();
}

Vec3 flat(Vec3 point) {
  point.z() = 0.0;
  return point;
}

Vec3 left_of(const Vec3& direction) { return {-direction.y(), direction.x(), 0.0}; }

double cross(const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Counter-clockwise about +Z.
bool turns_left(const CanonicalMotion& arc) { return arc.arc.sweep * arc.arc.normal.z() > 0.0; }

/// Direction of a motion at a point of it, unit; zero when it has none.
Vec3 direction_at(const CanonicalMotion& motion, const Vec3& point) {
  Vec3 way = flat(xyz(motion.end) - xyz(motion.start));
  if (motion.is_arc) {
    const Vec3 spoke = flat(point - motion.arc.centre);
    way = turns_left(motion) ? left_of(spoke) : Vec3(-left_of(spoke));
  }
  const double length = way.norm();
  return length < kNoMove ? Vec3(Vec3::Zero()) : Vec3(way / length);
}

/// Length of the way over X, Y and Z.
double way_of(const CanonicalMotion& motion) {
  const Vec3 step = xyz(motion.end) - xyz(motion.start);
  if (!motion.is_arc) return step.norm();
  const double radius = flat(xyz(motion.start) - motion.arc.centre).norm();
  return std::hypot(radius * motion.arc.sweep, step.z());
}

/// Where an element meets a line or circle: the candidates.
std::vector<Vec3> line_circle(const Vec3& point, const Vec3& direction, const Vec3& centre,
                              double radius) {
  const Vec3 to = flat(centre - point);
  const double along = to.dot(direction);
  const double off = cross(direction, to);
  const double rest = radius * radius - off * off;
  if (rest < 0.0) return {};
  const double half = std::sqrt(rest);
  return {point + (along - half) * direction, point + (along + half) * direction};
}

std::vector<Vec3> circle_circle(const Vec3& c1, double r1, const Vec3& c2, double r2) {
  const Vec3 between = flat(c2 - c1);
  const double d = between.norm();
  if (d < kNoMove || d > r1 + r2 || d < std::abs(r1 - r2)) return {};
  const Vec3 u = between / d;
  const double along = (d * d + r1 * r1 - r2 * r2) / (2.0 * d);
  const double off = std::sqrt(std::max(0.0, r1 * r1 - along * along));
  return {c1 + along * u + off * left_of(u), c1 + along * u - off * left_of(u)};
}

std::vector<Vec3> meetings(const CanonicalMotion& a, const CanonicalMotion& b) {
  const double ra = flat(xyz(a.end) - a.arc.centre).norm();
  const double rb = flat(xyz(b.start) - b.arc.centre).norm();
  const Vec3 pa = flat(xyz(a.end));
  const Vec3 pb = flat(xyz(b.start));
  if (a.is_arc && b.is_arc) return circle_circle(flat(a.arc.centre), ra, flat(b.arc.centre), rb);
  if (a.is_arc) return line_circle(pb, direction_at(b, pb), flat(a.arc.centre), ra);
  if (b.is_arc) return line_circle(pa, direction_at(a, pa), flat(b.arc.centre), rb);
  const Vec3 u = direction_at(a, pa);
  const Vec3 v = direction_at(b, pb);
  const double turn = cross(u, v);
  if (std::abs(turn) < kStraightOn) return {};
  return {pa + cross(pb - pa, v) / turn * u};
}

/// The sweep of an arc about its centre from one point to another, in its own sense, below 2π.
double sweep_between(const CanonicalMotion& arc, const Vec3& from, const Vec3& to) {
  const Vec3 a = flat(from - arc.arc.centre);
  const Vec3 b = flat(to - arc.arc.centre);
  double angle = std::atan2(cross(a, b), a.dot(b));
  if (!turns_left(arc)) angle = -angle;
  if (angle < 0.0) angle += 2.0 * kPi;
  return std::copysign(angle, arc.arc.sweep);
}

}  // namespace

void RadiusCompensation::begin(double radius, bool left) {
  on_ = radius > 0.0;
  radius_ = radius;
  left_ = left;
  failed_ = false;
}

void RadiusCompensation::end() {
  if (!on_) return;
  behind_ = behind_ || held_;
  if (held_) centre_ = xyz(held_->motion.end);
  flush();
  on_ = false;
}

void RadiusCompensation::fail(const std::string& text, const CanonicalMotion& motion) {
  if (!failed_) problem_(text, motion);
  failed_ = true;
}

void RadiusCompensation::motion(const CanonicalMotion& motion) {
  if (on_) return add(motion);
  if (!behind_) return sink_.motion(motion);
  CanonicalMotion out = motion;
  const bool moves = flat(xyz(motion.end) - xyz(motion.start)).norm() > kNoMove;
  const double speed = motion.duration > 0.0 ? way_of(motion) / motion.duration : 0.0;
  set_xy(out.start, centre_);
  if (!moves) {
    set_xy(out.end, centre_);
  } else {
    behind_ = false;
    if (motion.is_arc) return fail("the motion behind G40 is an arc: write a straight one", motion);
    if (speed > 0.0) out.duration = way_of(out) / speed;
  }
  sink_.motion(out);
}

void RadiusCompensation::add(const CanonicalMotion& motion) {
  if (failed_) return;
  if (motion.machine_position || motion.tcp)
    return fail("a motion in machine coordinates or tool-centre-point mode", motion);
  if (motion.is_arc && std::abs(motion.arc.normal.z()) < 1.0 - 1e-12)
    return fail("an arc outside of the XY plane", motion);
  if ((motion.unknown_start & 3) != 0)
    return fail("where X and Y stand is not known before", motion);
  const bool moves = motion.is_arc || flat(xyz(motion.end) - xyz(motion.start)).norm() > kNoMove;
  CanonicalMotion now = motion;
  if (behind_) set_xy(now.start, centre_);
  if (behind_ && !moves) set_xy(now.end, centre_);
  behind_ = behind_ && !moves;
  if (!moves) return move_along(now);
  if (held_) {
    follow(now);
  } else {
    first(now);
  }
}

/// The element beside the contour: a line or arc of which both ends are shifted.
std::optional<CanonicalMotion> RadiusCompensation::beside(const CanonicalMotion& motion) const {
  CanonicalMotion out = motion;
  const double side = left_ ? radius_ : -radius_;
  for (AxisWords* words : {&out.start, &out.end}) {
    const Vec3 point = xyz(words == &out.start ? motion.start : motion.end);
    set_xy(*words, point + side * left_of(direction_at(motion, point)));
  }
  if (motion.is_arc) {
    const bool inside = left_ == turns_left(motion);
    const double least = std::min(flat(xyz(motion.start) - motion.arc.centre).norm(),
                                  flat(xyz(motion.end) - motion.arc.centre).norm());
    if (inside && least <= radius_ + kNoMove) return {};
  }
  return out;
}

/// The way onto the contour: from where the tool stands to the offset of the element's end.
void RadiusCompensation::first(const CanonicalMotion& motion) {
  auto shifted = beside(motion);
  if (!shifted) return fail("the arc's radius is not above the tool's", motion);
  Element next;
  next.corner = xyz(motion.end);
  next.direction = direction_at(motion, next.corner);
  next.speed = motion.duration > 0.0 ? way_of(motion) / motion.duration : 0.0;
  next.motion = *shifted;
  next.motion.start = motion.start;
  const Vec3 start = flat(xyz(motion.start));
  if (motion.is_arc) {
    // Tangent to the offset at its end: the centre lies on the same spoke, as far from both ends.
    const Vec3 end = flat(xyz(shifted->end));
    const Vec3 spoke = flat(motion.arc.centre - next.corner).normalized();
    const Vec3 chord = start - end;
    const double along = chord.dot(spoke);
    if (std::abs(along) < kNoMove) return fail("the way onto the contour is no arc", motion);
    Vec3 centre = end + chord.squaredNorm() / (2.0 * along) * spoke;
    centre.z() = motion.arc.centre.z();
    next.motion.arc.centre = centre;
    next.motion.arc.sweep = sweep_between(next.motion, start, end);
  } else if (flat(next.corner - start).norm() <= radius_) {
    return fail("the way onto the contour, " + decimal_text(flat(next.corner - start).norm(), 4) +
                    " mm, is not longer than the tool's radius, " + decimal_text(radius_, 4) +
                    " mm",
                motion);
  }
  hold(std::move(next));
}

void RadiusCompensation::follow(const CanonicalMotion& motion) {
  auto shifted = beside(motion);
  if (!shifted) return fail("the arc's radius is not above the tool's", motion);
  Element next;
  next.motion = *shifted;
  next.corner = xyz(motion.end);
  next.direction = direction_at(motion, next.corner);
  next.speed = motion.duration > 0.0 ? way_of(motion) / motion.duration : 0.0;
  if (!join(next, direction_at(motion, xyz(motion.start)))) return;
  flush();
  hold(std::move(next));
}

/// Makes the element that waits and the next one meet.
bool RadiusCompensation::join(Element& next, const Vec3& begin_direction) {
  const double turn =
      std::atan2(cross(held_->direction, begin_direction), held_->direction.dot(begin_direction));
  const bool reverses = std::abs(turn) > kPi - kStraightOn;
  if (std::abs(turn) < kStraightOn) {
    set_xy(next.motion.start, xyz(held_->motion.end));
    return true;
  }
  if (reverses || (turn < 0.0) == left_) {  // the tool is outside
    if (next.motion.kind == MotionKind::feed) {
      corner_arc(next);
    } else {
      set_xy(next.motion.start, xyz(held_->motion.end));
    }
    return true;
  }
  const auto found = meetings(held_->motion, next.motion);
  const auto nearest = std::min_element(found.begin(), found.end(), [&](auto& a, auto& b) {
    return flat(a - held_->corner).norm() < flat(b - held_->corner).norm();
  });
  if (nearest == found.end() || !shorten(held_->motion, *nearest) ||
      !start_later(next.motion, *nearest)) {
    fail("the tool does not fit into the corner", next.motion);
    return false;
  }
  for (CanonicalMotion& along : along_) {
    set_xy(along.start, *nearest);
    set_xy(along.end, *nearest);
  }
  return true;
}

/// Round the corner behind the element that waits.
void RadiusCompensation::corner_arc(const Element& next) {
  CanonicalMotion arc = next.motion;
  const AxisWords& from = along_.empty() ? held_->motion.end : along_.back().end;
  const Vec3 to = xyz(next.motion.start);
  arc.start = arc.end = from;
  set_xy(arc.end, to);
  arc.is_arc = true;
  arc.arc.centre = held_->corner;
  arc.arc.centre.z() = from[2];
  arc.arc.normal = Vec3::UnitZ();
  arc.arc.sweep = left_ ? -1.0 : 1.0;
  arc.arc.sweep = sweep_between(arc, xyz(from), to);
  arc.duration = next.speed > 0.0 ? way_of(arc) / next.speed : 0.0;
  call([this, arc] { sink_.motion(arc); });
}

bool RadiusCompensation::shorten(CanonicalMotion& motion, const Vec3& end) const {
  if (motion.is_arc) {
    const double sweep = sweep_between(motion, xyz(motion.start), end);
    if (std::abs(sweep) > std::abs(motion.arc.sweep) + kStraightOn) return false;
    motion.arc.sweep = sweep;
  } else {
    const Vec3 start = flat(xyz(motion.start));
    if ((end - start).dot(flat(xyz(motion.end)) - start) < -kSlack) return false;
  }
  set_xy(motion.end, end);
  return true;
}

bool RadiusCompensation::start_later(CanonicalMotion& motion, const Vec3& start) const {
  if (motion.is_arc) {
    const double sweep = sweep_between(motion, start, xyz(motion.end));
    if (std::abs(sweep) > std::abs(motion.arc.sweep) + kStraightOn) return false;
    motion.arc.sweep = sweep;
  } else {
    const Vec3 end = flat(xyz(motion.end));
    if ((end - start).dot(end - flat(xyz(motion.start))) < -kSlack) return false;
  }
  set_xy(motion.start, start);
  return true;
}

/// Without X and Y the centre stays beside the contour.
void RadiusCompensation::move_along(const CanonicalMotion& motion) {
  if (!held_) return sink_.motion(motion);
  CanonicalMotion out = motion;
  set_xy(out.start, xyz(held_->motion.end));
  set_xy(out.end, xyz(held_->motion.end));
  along_.push_back(out);
  const std::size_t index = along_.size() - 1;
  waiting_.push_back([this, index] { sink_.motion(along_[index]); });
}

void RadiusCompensation::hold(Element next) {
  if (next.speed > 0.0) next.motion.duration = way_of(next.motion) / next.speed;
  held_ = std::move(next);
}

void RadiusCompensation::flush() {
  if (held_) {
    if (held_->speed > 0.0) held_->motion.duration = way_of(held_->motion) / held_->speed;
    sink_.motion(held_->motion);
  }
  held_.reset();
  const auto waiting = std::move(waiting_);
  waiting_.clear();
  for (const auto& what : waiting) what();
  along_.clear();
}

void RadiusCompensation::call(std::function<void()> what) {
  if (held_) {
    waiting_.push_back(std::move(what));
  } else {
    what();
  }
}

void RadiusCompensation::dwell(double seconds, std::uint32_t line) {
  call([this, seconds, line] { sink_.dwell(seconds, line); });
}

void RadiusCompensation::event(const ProcessEvent& event) {
  call([this, event] { sink_.event(event); });
}

void RadiusCompensation::comment(std::string_view text, std::uint32_t line) {
  call([this, text = std::string(text), line] { sink_.comment(text, line); });
}

void RadiusCompensation::tool_length(double length, int tool, std::uint32_t line) {
  call([this, length, tool, line] { sink_.tool_length(length, tool, line); });
}

void RadiusCompensation::work_offset(const Vec3& origin, double rotation, int system,
                                     std::uint32_t line) {
  call([this, origin, rotation, system, line] {
    sink_.work_offset(origin, rotation, system, line);
  });
}

void RadiusCompensation::program_end(std::uint32_t line) {
  end();
  sink_.program_end(line);
}

}  // namespace smoothpost::nc
