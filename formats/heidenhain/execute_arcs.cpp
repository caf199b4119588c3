#include <cmath>

#include "formats/heidenhain/executor.h"
#include "kernels/core/units.h"

// Arcs, and the corners that RND and CHF make.
namespace smoothpost::conversational {
namespace {

constexpr double kCentreTolerance = 0.016;  // mm between the radii at start and end
constexpr double kRadiusTolerance = 0.001;  // mm
constexpr double kStraight = 1e-9;          // mm

Vec3 xyz(const AxisWords& words) { return {words[0], words[1], words[2]}; }

}  // namespace

/// CC X Y: the centre or pole; alone: the present position.
void Executor::pole(Scanner& scanner) {
  const auto read = words(scanner);
  if (!read) return;
  if ((read->axes() & ~AxisMask{3}) != 0 || read->feed || read->rapid || !read->m.empty())
    return error("NC404", "CC takes X and Y", 0);
  const AxisWords here = coordinates_.program_from_world(coordinates_.world());
  for (int i = 0; i < 2; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    const unsigned bit = 1U << i;
    const bool takes_here = read->axes() == 0 || (read->incremental & bit) != 0;
    if (takes_here && (coordinates_.unknown() & bit) != 0)
      return error("NC410", "CC counts from a position that is unknown", 0);
    if (takes_here || (read->absolute & bit) != 0) {
      pole_[i] = (takes_here ? here[axis] : 0.0) + read->value[axis] * unit_;
      pole_known_ |= bit;
    }
  }
}

/// The start of an arc has to be known; a corner before it is none that is read.
bool Executor::arc_start(const MotionWords& words) {
  send_held(nullptr);
  if (words.rapid) {
    error("NC410", "a rapid (FMAX) on an arc is not read; write F", 0);
    return false;
  }
  if (words.tool_words != 0) {
    error("NC404", "TX TY TZ stand in LN blocks only", 0);
    return false;
  }
  if ((coordinates_.unknown() & 3) == 0) return true;
  error("NC410", "the arc starts where X and Y are unknown: write a position before it", 0);
  coordinates_.move_to(target(words), unknown_at(words));
  return false;
}

nc::ArcWords Executor::arc_words(const MotionWords& words, bool clockwise) const {
  const AxisWords start = coordinates_.program_from_world(coordinates_.world());
  const AxisWords end = coordinates_.program_from_world(target(words));
  nc::ArcWords arc;
  arc.start = {start[0], start[1]};
  arc.end = {end[0], end[1]};
  arc.clockwise = clockwise;
  arc.centre_tolerance = kCentreTolerance;
  arc.radius_tolerance = kRadiusTolerance;
  return arc;
}

/// C X Y DR: about CC.
void Executor::circle(Scanner& scanner) {
  const auto read = words(scanner);
  if (!read) return;
  if (!read->clockwise) return error("NC410", "C needs DR+ or DR-", 0);
  if (pole_known_ != 3) return error("NC410", "the centre is not known: write CC X Y before", 0);
  if (!arc_start(*read)) return;
  arc_to(*read, nc::arc_by_centre(arc_words(*read, *read->clockwise), {pole_.x(), pole_.y()}));
}

/// CR X Y R DR: a radius above 0 is less than half a circle.
void Executor::radius_circle(Scanner& scanner) {
  const auto read = words(scanner, true);
  if (!read) return;
  if (!read->clockwise || !read->radius) return error("NC410", "CR needs R and DR+ or DR-", 0);
  if (!arc_start(*read)) return;
  arc_to(*read, nc::arc_by_radius(arc_words(*read, *read->clockwise), *read->radius * unit_));
}

/// CT X Y: goes on along the tangent of the motion before.
void Executor::tangent_circle(Scanner& scanner) {
  const auto read = words(scanner);
  if (!read || !arc_start(*read)) return;
  if (!way_) return error("NC410", "CT needs a motion before it whose tangent it takes", 0);
  nc::ArcWords arc = arc_words(*read, false);
  const Vec3 chord(arc.end.first - arc.start.first, arc.end.second - arc.start.second, 0.0);
  const Vec3 left(-way_->y(), way_->x(), 0.0);
  const double side = chord.dot(left);
  if (std::abs(side) < kStraight)
    return error("NC410", "the end of CT lies on the tangent: write L", 0);
  const double radius = chord.squaredNorm() / (2.0 * side);
  arc.clockwise = radius < 0.0;
  arc_to(*read, nc::arc_by_centre(arc, {arc.start.first + radius * left.x(),
                                        arc.start.second + radius * left.y()}));
}

/// CP PA or IPA: about CC at the present radius; with Z a helix, whose IPA may be many turns.
void Executor::polar_circle(Scanner& scanner) {
  auto read = words(scanner);
  if (!read) return;
  if (!read->clockwise || !read->polar_angle || read->polar_radius || (read->axes() & 3) != 0)
    return error("NC410", "CP needs PA or IPA, DR+ or DR-, and takes Z", 0);
  if (!arc_start(*read)) return;
  const auto end = polar_end(*read);
  if (!end) return;
  read->value[0] = end->first / unit_;
  read->value[1] = end->second / unit_;
  read->absolute = static_cast<AxisMask>(read->absolute | 3);
  nc::PlaneArc arc = nc::arc_by_centre(arc_words(*read, *read->clockwise), {pole_.x(), pole_.y()});
  if (arc.problem.empty() && read->angle_incremental) {
    const double sweep = radians_from_degrees(*read->polar_angle);
    if (sweep == 0.0 || (sweep < 0.0) != *read->clockwise)
      return error("NC410", "the sign of IPA has to be that of DR", 0);
    arc.sweep = sweep;
  }
  arc_to(*read, arc);
}

void Executor::arc_to(const MotionWords& words, const nc::PlaneArc& arc) {
  apply_functions(words, false);
  CanonicalMotion motion = begin_motion(words);
  motion.end = target(words);
  motion.unknown_end = unknown_at(words);
  if (!arc.problem.empty()) {
    error("NC410", arc.problem, 0);
    return coordinates_.move_to(motion.end, motion.unknown_end);
  }
  const AxisWords start = coordinates_.program_from_world(motion.start);
  const AxisWords end = coordinates_.program_from_world(motion.end);
  motion.is_arc = true;
  const Vec3 centre(arc.centre.first, arc.centre.second, start[2]);
  motion.arc.centre = coordinates_.world_from_program(centre);
  motion.arc.normal = coordinates_.world_direction(Vec3::UnitZ());
  motion.arc.sweep = arc.sweep;
  const double length = std::hypot(arc.radius * arc.sweep, end[2] - start[2]);
  if (set_axis(words, motion) && set_speed(words, motion, length)) {
    send(motion);
    const Vec3 spoke = xyz(end) - centre;
    const Vec3 left(-spoke.y(), spoke.x(), 0.0);
    way_ = (arc.sweep > 0.0 ? left : Vec3(-left)).normalized();
  }
  apply_functions(words, true);
}

// ---- corners ------------------------------------------------------------------------------------

/// Whether the next block is RND or CHF.
bool Executor::corner_follows() {
  bool found = false;
  for (std::size_t i = next_; i < source_.size(); ++i) {
    const Statement statement = source_.read(i);
    if (statement.text.empty()) continue;
    Scanner scanner(statement.text);
    found = scanner.sees("RND") || scanner.sees("CHF");
    break;
  }
  source_.read(at_);
  return found;
}

/// RND R.. or CHF ..: what becomes of the corner between the line before and the next one.
void Executor::corner(Scanner& scanner, bool chamfer) {
  const std::size_t offset = scanner.offset();
  scanner.take_byte('R');
  const auto size = value(scanner);
  std::optional<double> feed;
  if (size && scanner.take_byte('F')) feed = value(scanner);
  if (!size || !no_more(scanner)) return held_.reset();
  const char* const name = chamfer ? "CHF" : "RND";
  if (!held_ || held_->corner) {
    error("NC411", std::string(name) + " is read between two lines L only", 0);
    return held_.reset();
  }
  if (!(*size > 0.0 && *size < 1e6) || (feed && !(*feed > 0.0))) {
    error("NC411", std::string(name) + " needs a size above 0", offset);
    return held_.reset();
  }
  held_->corner = true;
  held_->chamfer = chamfer;
  held_->size = *size * unit_;
  held_->feed = feed;
  held_->place = source_.place(0);
}

void Executor::hold(const CanonicalMotion& motion) {
  held_ = Held{};
  held_->motion = motion;
  held_->place = source_.place(0);
  coordinates_.move_to(motion.end, motion.unknown_end);
  if (motion.axis_vector) axis_ = motion.end_axis;
}

/// Sends the line that waits and its corner with `next`, which then begins behind the corner.
void Executor::send_held(CanonicalMotion* next) {
  if (!held_) return;
  const Held held = *held_;
  held_.reset();
  const auto fail = [&](const std::string& problem) {
    log_.error("NC411", (held.chamfer ? "CHF: " : "RND: ") + problem, held.place);
  };
  if (next == nullptr) return fail("a line L has to follow");
  const auto plain = [](const CanonicalMotion& m) {
    return m.kind == MotionKind::feed && (m.programmed & ~AxisMask{7}) == 0 &&
           ((m.unknown_start | m.unknown_end) & 7) == 0 && m.start_axis == m.end_axis;
  };
  if (!plain(held.motion) || !plain(*next))
    return fail("both lines have to be feeds of X and Y between known positions");
  const auto program = [&](const AxisWords& words) {
    return xyz(coordinates_.program_from_world(words));
  };
  const CornerLines lines{program(held.motion.start), program(held.motion.end), program(next->end)};
  const Corner corner =
      held.chamfer ? chamfered_corner(lines, held.size) : rounded_corner(lines, held.size);
  if (!corner.problem.empty()) return fail(corner.problem);
  const auto place = [&](AxisWords words, const Vec3& point) {
    const Vec3 world = coordinates_.world_from_program(point);
    for (std::size_t i = 0; i < 3; ++i) words[i] = world[static_cast<Eigen::Index>(i)];
    return words;
  };
  const auto shorten = [](CanonicalMotion& motion, double share) { motion.duration *= share; };
  CanonicalMotion before = held.motion;
  before.end = place(before.end, corner.begin);
  shorten(before, (corner.begin - lines.start).norm() / (lines.corner - lines.start).norm());
  CanonicalMotion between = held.motion;
  between.line = held.place.line;
  between.column = held.place.column;
  between.start = before.end;
  between.end = place(between.end, corner.end);
  const double speed = length_speed(held.feed ? *held.feed : *feed_);
  double length = (corner.end - corner.begin).norm();
  if (!held.chamfer) {
    between.is_arc = true;
    between.arc.centre = coordinates_.world_from_program(corner.centre);
    between.arc.normal = coordinates_.world_direction(Vec3::UnitZ());
    between.arc.sweep = corner.sweep;
    length = std::abs(corner.sweep) * held.size;
  }
  between.duration = length / speed;
  shorten(*next, (lines.end - corner.end).norm() / (lines.end - lines.corner).norm());
  next->start = between.end;
  send(before);
  send(between);
}

}  // namespace smoothpost::conversational
