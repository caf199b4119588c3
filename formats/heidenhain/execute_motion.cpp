#include <algorithm>
#include <cmath>

#include "formats/heidenhain/executor.h"
#include "kernels/core/units.h"

// Straight motion.
namespace smoothpost::conversational {
namespace {

constexpr AxisMask kXyz = 0x7;
constexpr AxisMask kRotary = 0x38;
constexpr double kNoMove = 1e-9;       // mm or rad
constexpr double kTenthsOfInch = 0.1;  // F of a program in inch is in 0.1 inch/min

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1U << axis); }
bool is_angle(std::size_t axis) { return axis >= 3 && axis < 6; }

double distance(const AxisWords& a, const AxisWords& b, std::size_t first) {
  return std::hypot(a[first] - b[first], a[first + 1] - b[first + 1], a[first + 2] - b[first + 2]);
}

Vec3 xyz(const AxisWords& words) { return {words[0], words[1], words[2]}; }

}  // namespace

void Executor::line(Scanner& scanner, bool vector) {
  const auto read = words(scanner);
  if (!read) return;
  const bool other = read->polar_radius || read->polar_angle || read->clockwise;
  if (other) return error("NC404", "PR, PA and DR have no meaning in L: write LP, C or CP", 0);
  if (read->tool_words != 0 && !vector)
    return error("NC413", "TX TY TZ stand in LN blocks only", 0);
  if (read->normal && radius_delta_)
    return error("NC413",
                 "LN with NX NY NZ and DR of TOOL CALL is a correction of the tool's shape, which "
                 "is not read: let the CAM post write the path of the tool that is mounted",
                 0);
  line_to(*read);
}

/// LP: radius and angle about CC.
void Executor::polar_line(Scanner& scanner) {
  auto read = words(scanner);
  if (!read) return;
  if ((read->axes() & 3) != 0 || read->clockwise || read->tool_words != 0)
    return error("NC404", "LP takes PR, PA and Z", 0);
  const auto end = polar_end(*read);
  if (!end) return;
  read->value[0] = end->first / unit_;
  read->value[1] = end->second / unit_;
  read->absolute = static_cast<AxisMask>(read->absolute | 3);
  line_to(*read);
}

/// The point of polar words in the working plane; a word that is not written keeps its value.
std::optional<nc::PlanePoint> Executor::polar_end(const MotionWords& words) {
  if (pole_known_ != 3) {
    error("NC410", "the pole is not known: write CC X Y before", 0);
    return {};
  }
  if ((coordinates_.unknown() & 3) != 0) {
    error("NC410", "polar words start where X and Y are unknown: write a position before", 0);
    return {};
  }
  const AxisWords here = coordinates_.program_from_world(coordinates_.world());
  const double x = here[0] - pole_.x();
  const double y = here[1] - pole_.y();
  double radius = std::hypot(x, y);
  double angle = std::atan2(y, x);
  if (words.polar_radius)
    radius = unit_ * *words.polar_radius + (words.radius_incremental ? radius : 0.0);
  if (words.polar_angle)
    angle = radians_from_degrees(*words.polar_angle) + (words.angle_incremental ? angle : 0.0);
  return nc::PlanePoint{pole_.x() + radius * std::cos(angle), pole_.y() + radius * std::sin(angle)};
}

void Executor::line_to(const MotionWords& words) {
  const bool moves = words.axes() != 0 || words.tool_words != 0;
  const bool holds = moves && has_corners_ && corner_follows();
  const bool late = std::any_of(words.m.begin(), words.m.end(), [](int m) { return acts_late(m); });
  if ((held_ && !words.m.empty()) || (holds && late)) {
    error("NC411", "M functions in a line beside RND or CHF: write them in a block of their own",
          0);
    held_.reset();
    return;
  }
  apply_functions(words, false);
  if (words.has(91)) {
    machine_line(words);
  } else if (moves) {
    CanonicalMotion motion = begin_motion(words);
    motion.end = target(words);
    motion.unknown_end = unknown_at(words);
    if (set_axis(words, motion) &&
        set_speed(words, motion, distance(motion.start, motion.end, 0))) {
      if (held_) send_held(&motion);
      if (holds) {
        hold(motion);
      } else {
        send(motion);
      }
    } else {
      held_.reset();
      coordinates_.move_to(motion.end, motion.unknown_end);
    }
  } else if (words.feed) {
    feed_ = words.feed;
  }
  apply_functions(words, true);
}

/// A place of the machine (M91). Where it lies in the program's coordinates is not known.
void Executor::machine_line(const MotionWords& words) {
  if (words.incremental != 0 || words.tool_words != 0)
    return error("NC404", "M91 with incremental words or vectors", 0);
  CanonicalMotion motion = begin_motion(words);
  motion.machine_position = true;
  motion.axis_vector = motion.tcp = false;
  motion.end = motion.start;
  for (std::size_t i = 0; i < motion.end.size(); ++i)
    if ((words.axes() & bit(i)) != 0)
      motion.end[i] = is_angle(i) ? radians_from_degrees(words.value[i]) : words.value[i] * unit_;
  motion.unknown_end = static_cast<AxisMask>(motion.unknown_start & ~words.axes());
  if (!set_speed(words, motion, distance(motion.start, motion.end, 0))) return;
  send(motion);
  coordinates_.forget(tcp_ || tilted_ ? kXyz | kRotary : words.axes());
  if ((words.axes() & kRotary) != 0) {
    rotary_named_ = static_cast<AxisMask>(rotary_named_ | (words.axes() & kRotary));
    by_vector_ = stale_plane_ = false;
    axis_.setZero();
  }
}

CanonicalMotion Executor::begin_motion(const MotionWords& words) {
  CanonicalMotion motion;
  motion.tcp = tcp_ || tilted_;
  motion.programmed = words.axes();
  if (spatial_words()) motion.programmed = static_cast<AxisMask>(motion.programmed & ~kRotary);
  const nc::TextPlace place = source_.place(0);
  motion.line = place.line;
  motion.column = place.column;
  motion.start = motion.end = coordinates_.world();
  motion.unknown_start = motion.unknown_end = coordinates_.unknown();
  motion.start_axis = motion.end_axis = axis_;
  return motion;
}

/// World coordinates of the programmed end; words that are not written stay.
AxisWords Executor::target(const MotionWords& words) const {
  const AxisWords& world = coordinates_.world();
  AxisWords program = coordinates_.program_from_world(world);
  for (std::size_t i = 0; i < program.size(); ++i) {
    if ((words.axes() & bit(i)) == 0 || (is_angle(i) && spatial_words())) continue;
    const double value =
        is_angle(i) ? radians_from_degrees(words.value[i]) : words.value[i] * unit_;
    if ((words.incremental & bit(i)) != 0) {
      program[i] += value;
    } else if (is_angle(i) && nearest_turn_ && (coordinates_.unknown() & bit(i)) == 0) {
      program[i] += std::remainder(value - program[i], 2.0 * kPi);
    } else {
      program[i] = value;
    }
  }
  AxisWords end = coordinates_.world_from_program(program);
  for (std::size_t i = 0; i < end.size(); ++i) {
    const bool turned = i < 3 && coordinates_.rotated();
    if ((words.axes() & bit(i)) == 0 && !turned) end[i] = world[i];
  }
  return end;
}

AxisMask Executor::unknown_at(const MotionWords& words) const {
  AxisMask absolute = words.absolute;
  if (spatial_words()) absolute = static_cast<AxisMask>(absolute & ~kRotary);
  return coordinates_.unknown_after(absolute);
}

/// The tool axis at both ends, where it goes by vectors.
bool Executor::set_axis(const MotionWords& words, CanonicalMotion& motion) {
  const bool rotary = (words.axes() & kRotary) != 0;
  if (stale_plane_ && !rotary) {
    error("NC417",
          "the rotary axes stand where the tilted plane left them (PLANE RESET STAY): write PLANE "
          "RESET TURN, or their positions",
          0);
    stale_plane_ = false;
    return false;
  }
  stale_plane_ = false;
  if (tilted_ && (rotary || words.tool_words != 0)) {
    error("NC417", "rotary words and vectors in a tilted plane are not read; write PLANE RESET", 0);
    return false;
  }
  std::optional<Vec3> axis;
  if (words.tool_words != 0) {
    if (!tcp_) {
      error("NC413", "LN with TX TY TZ outside of M128 and FUNCTION TCPM", 0);
      return false;
    }
    const double length = words.tool.norm();
    if (words.tool_words != 7 || length < 1e-6) {
      error("NC413", "TX TY TZ have to be three and not all 0", 0);
      return false;
    }
    axis = coordinates_.world_direction(words.tool / length);
  } else if (rotary && spatial_words()) {
    axis = spatial_axis(words);
  } else if (rotary) {
    rotary_named_ = static_cast<AxisMask>(rotary_named_ | (words.axes() & kRotary));
    by_vector_ = false;
    axis_.setZero();
  }
  if (axis) {
    by_vector_ = true;
    if (!great_circles_ && !tilted_ && (told_ & path_of_vectors) == 0) {
      told_ |= path_of_vectors;
      summary_.assumes.push_back(
          "the program does not say PATHCTRL VECTOR: between vectors (or spatial angles) the tool "
          "axis is read on great circles");
    }
  }
  if (by_vector_ && motion.tcp) {
    motion.axis_vector = true;
    motion.start_axis = axis_;
    motion.end_axis = axis ? *axis : axis_;
    const auto unknown = [](AxisMask mask, const Vec3& of) {
      return static_cast<AxisMask>((mask & ~kRotary) | (of.isZero(0.0) ? kRotary : 0));
    };
    motion.unknown_start = unknown(motion.unknown_start, motion.start_axis);
    motion.unknown_end = unknown(motion.unknown_end, motion.end_axis);
  } else if (motion.tcp && great_circles_) {
    // Between positions of the rotary axes that the program has named.
    motion.axis_vector = true;
    motion.start_axis = motion.end_axis = Vec3::Zero();
    const auto other = static_cast<AxisMask>(kRotary & ~rotary_named_);
    motion.unknown_start = static_cast<AxisMask>(motion.unknown_start & ~other);
    motion.unknown_end = static_cast<AxisMask>(motion.unknown_end & ~other);
  } else {
    motion.start_axis = motion.end_axis = Vec3::UnitZ();
  }
  return true;
}

/// Rapid or feed, and the time that F gives: F is the speed of X Y Z when one of them moves, else
/// of the rotary axes in degrees, else of U V W.
bool Executor::set_speed(const MotionWords& words, CanonicalMotion& motion, double xyz_length) {
  if (words.feed) feed_ = words.feed;
  motion.kind = words.rapid ? MotionKind::rapid : MotionKind::feed;
  if (words.rapid) return true;
  if (!feed_) {
    error("NC409", "a feed motion without feed: write F or FMAX", 0);
    return false;
  }
  motion.duration = xyz_length / length_speed(*feed_);
  if (xyz_length >= kNoMove) return true;
  const double angular = radians_from_degrees(*feed_) / kSecondsPerMinute;
  const double uvw = distance(motion.start, motion.end, 6);
  double turn = distance(motion.start, motion.end, 3);
  if (motion.axis_vector && !motion.end_axis.isZero(0.0) && !motion.start_axis.isZero(0.0))
    turn = std::acos(std::clamp(motion.start_axis.dot(motion.end_axis), -1.0, 1.0));
  motion.duration = turn >= kNoMove ? turn / angular : uvw / length_speed(*feed_);
  return true;
}

/// F as written, in mm/s.
double Executor::length_speed(double feed) const {
  const double unit = unit_ == 1.0 ? 1.0 : kTenthsOfInch * unit_;
  return feed * unit / kSecondsPerMinute;
}

void Executor::send(const CanonicalMotion& motion) {
  if (!offset_told_ && !motion.machine_position) {
    sink_.work_offset(coordinates_.origin(), coordinates_.rotation(), coordinates_.system(),
                      motion.line);
    offset_told_ = true;
  }
  const Vec3 start = xyz(coordinates_.program_from_world(motion.start));
  const Vec3 end = xyz(coordinates_.program_from_world(motion.end));
  Vec3 way = end - start;
  way.z() = 0.0;
  if (way.norm() > kNoMove) way_ = way.normalized();
  sink_.motion(motion);
  coordinates_.move_to(motion.end, motion.unknown_end);
  if (!motion.axis_vector || motion.end_axis.isZero(0.0)) return;
  axis_ = motion.end_axis;
  coordinates_.forget(kRotary);
}

}  // namespace smoothpost::conversational
