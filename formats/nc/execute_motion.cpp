#include <algorithm>
#include <cmath>

#include "formats/nc/arc.h"
#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"
#include "formats/nc/plane.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr AxisMask kRotaryAxes = 0x38;
constexpr double kNoMove = 1e-7;  // mm or rad; smaller displacements have no length for the feed

// LinuxCNC's tolerances, by the active unit, in mm.
constexpr double kCentreToleranceMillimetre = 0.0282843;
constexpr double kCentreToleranceInch = 0.0028284 * kMillimetresPerInch;
constexpr double kCentreToleranceSiemens = 0.01;  // default of CIRCLE_ERROR_LIMIT_CONST
constexpr double kRadiusTolerance = 0.00005 * kMillimetresPerInch;

bool is_rotary(std::size_t axis) { return axis >= 3 && axis < 6; }

double length(const AxisWords& start, const AxisWords& end, std::size_t first) {
  const double a = end[first] - start[first];
  const double b = end[first + 1] - start[first + 1];
  const double c = end[first + 2] - start[first + 2];
  return std::sqrt(a * a + b * b + c * c);
}

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1u << axis); }

}  // namespace

double Executor::word_value(const BlockWords& block, std::size_t axis) const {
  const double value = block[kAxisLetters[axis]];
  return is_rotary(axis) ? radians_from_degrees(value) : value * modal_.unit;
}

/// The words of `axes` that are positions, not distances.
AxisMask Executor::absolute_axes(const BlockWords& block, AxisMask axes) const {
  if ((block.absolute | block.incremental) == 0) return modal_.incremental ? 0 : axes;
  const AxisMask base = modal_.incremental ? 0 : axes;
  const AxisMask set = axis_mask(block.absolute);
  const AxisMask cleared = axis_mask(block.incremental);
  return static_cast<AxisMask>((base | set) & ~cleared & axes);
}

AxisWords Executor::target(const BlockWords& block, AxisMask axes) const {
  const AxisMask absolute = absolute_axes(block, axes);
  if (!coordinates_.rotated()) {
    AxisWords world = coordinates_.world();
    const AxisWords& origin = coordinates_.offset(coordinates_.system()).words;
    const AxisWords& shift = coordinates_.shift();
    const AxisWords& frame = coordinates_.frame_shift();
    for (std::size_t i = 0; i < world.size(); ++i) {
      if ((axes & bit(i)) == 0) continue;
      const double value = word_value(block, i);
      world[i] =
          (absolute & bit(i)) == 0 ? world[i] + value : value + (frame[i] + shift[i]) + origin[i];
    }
    turn_by_sense(block, world);
    return world;
  }
  AxisWords program = coordinates_.program_from_world(coordinates_.world());
  for (std::size_t i = 0; i < program.size(); ++i) {
    if ((axes & bit(i)) == 0) continue;
    const double value = word_value(block, i);
    program[i] = (absolute & bit(i)) == 0 ? program[i] + value : value;
  }
  AxisWords world = coordinates_.world_from_program(program);
  turn_by_sense(block, world);
  return world;
}

AxisWords Executor::machine_target(const BlockWords& block, AxisMask axes) const {
  AxisWords world = coordinates_.world();
  for (std::size_t i = 0; i < world.size(); ++i) {
    if ((axes & bit(i)) == 0) continue;
    // G53 of siemens keeps the tool's length: the tip goes to the place.
    world[i] = word_value(block, i) - (is_siemens() ? 0.0 : coordinates_.tool()[i]);
  }
  return world;
}

/// In the plane of CYCLE800 the bits of X Y Z are those of the plane's axes, so that a position
/// that two blocks give is known; finish_motion() hands on those of the world's.
AxisMask Executor::unknown_at_target(const BlockWords& block, AxisMask axes) const {
  if (modal_.swivelled) {
    return static_cast<AxisMask>(coordinates_.unknown() & ~absolute_axes(block, axes));
  }
  return coordinates_.unknown_after(absolute_axes(block, axes));
}

void Executor::begin_motion(const BlockWords& block, const BlockPlan& plan) {
  motion_.is_arc = false;
  motion_.tcp = modal_.tcp || modal_.swivelled;
  motion_.machine_position = false;
  motion_.unknown_start = coordinates_.unknown();
  motion_.programmed = plan.axes;
  motion_.line = block.input_line;
  motion_.duration = 0.0;
  motion_.pitch = 0.0;
  motion_.probe = false;
  motion_.start = coordinates_.world();
  motion_.column = reader_.input_place(block, block.first_piece).column;
  motion_.axis_vector = modal_.swivelled;
  if (modal_.swivelled) motion_.start_axis = motion_.end_axis = modal_.axis;
  summary_.uses_tcp = summary_.uses_tcp || motion_.tcp;
  summary_.uses_rotary = summary_.uses_rotary || (plan.axes & kRotaryAxes) != 0;
}

void Executor::finish_motion() {
  if (offset_dirty_) announce_offset(motion_.line);
  const bool by_turn = modal_.per_turn && motion_.kind == MotionKind::feed;
  if (by_turn && motion_.pitch == 0.0) motion_.pitch = modal_.linear_feed;
  const AxisMask unknown = motion_.unknown_end;
  if (modal_.swivelled && motion_.axis_vector) {
    const auto in_world = [](AxisMask bits) {
      constexpr AxisMask kLinear = 7;
      return static_cast<AxisMask>(((bits & kLinear) != 0 ? bits | kLinear : bits) & ~kRotaryAxes);
    };
    motion_.unknown_start = in_world(motion_.unknown_start);
    motion_.unknown_end = in_world(motion_.unknown_end);
  }
  sink_.motion(motion_);
  coordinates_.move_to(motion_.end, unknown);
  // Where the rotary axes are is the machine's affair then.
  if (motion_.axis_vector) coordinates_.forget(kRotaryAxes);
}

/// Seconds of a feed motion: G93 gives the time; else F is the speed of XYZ when one of them moves,
/// else of UVW, else of ABC.
double Executor::duration_of(const CanonicalMotion& motion, double xyz_length,
                             const BlockWords& block) const {
  const double uvw = length(motion.start, motion.end, 6);
  const double abc = length(motion.start, motion.end, 3);
  const bool turns = motion.axis_vector && motion.start_axis.dot(motion.end_axis) < 1.0 - 1e-14;
  if (xyz_length < kNoMove && uvw < kNoMove && abc < kNoMove && !turns) return 0.0;
  if (modal_.inverse_time) return kSecondsPerMinute / block['F'];
  const double turns_per_second = modal_.words.speed / kSecondsPerMinute;
  const double linear_speed = modal_.linear_feed * (modal_.per_turn ? turns_per_second : 1.0);
  const double angular_speed = modal_.angular_feed * (modal_.per_turn ? turns_per_second : 1.0);
  if (xyz_length >= kNoMove) return xyz_length / linear_speed;
  if (uvw >= kNoMove) return uvw / linear_speed;
  if (!turns) return abc / angular_speed;
  const double cosine = std::clamp(motion.start_axis.dot(motion.end_axis), -1.0, 1.0);
  return std::acos(cosine) / angular_speed;
}

bool Executor::feed_given(const BlockWords& block, const BlockPlan& plan) {
  const std::string code = g_code_text(plan.motion);
  if (modal_.inverse_time) {
    if (block.has('F') && block['F'] > 0.0) return true;
    log_.error("NC214", code + " in inverse time mode (G93) needs F above 0 in its own block",
               at(block, GGroup::motion));
    return false;
  }
  if (modal_.per_turn && (!is_turning() || !(modal_.words.speed > 0.0))) {
    log_.error("NC213",
               code +
                   " feeds by the turn (G95), but the spindle does not turn; write S "
                   "and M3 or M4 before",
               at(block, GGroup::motion));
    return false;
  }
  if (modal_.linear_feed > 0.0) return true;
  log_.error("NC213",
             code + " with zero feed: F was not given" +
                 (block.has('F') ? " above 0" : " (after G93 and G95 a new F is needed)") +
                 "; write F before or in this block",
             at(block, GGroup::motion));
  return false;
}

void Executor::change_mode(GCode mode, const BlockWords& block) {
  if (!control_points_.empty() && mode != 52) end_spline(block, mode == kSplineEnd);
  const bool fanuc = !is_linuxcnc() && !is_siemens();
  if (mode == kSplineEnd) mode = 800;
  modal_.motion = mode == 800 && fanuc ? modal_.base_motion : mode;
  if (mode >= 0 && mode <= 30) modal_.base_motion = mode;
}

/// A motion that stands for several.
void Executor::expanded_motion(const BlockWords& block, const BlockPlan& plan, GCode before) {
  if (radius_.stands_beside())
    return error("NC264",
                 "the first motion behind G40 is a cycle, spline, thread or probing motion; write "
                 "G0 or G1 before",
                 block, block.first_piece);
  if (is_cycle(plan.motion)) return cycle(block, plan, before);
  if (is_synchronised(plan.motion)) return synchronised(block, plan);
  if (is_probe(plan.motion)) return probe(block, plan);
  if (is_spline(plan.motion)) spline(block, plan, before);
}

void Executor::motion(const BlockWords& block, const BlockPlan& plan) {
  const GCode mode = block.code(GGroup::motion);
  const GCode before = modal_.motion;
  if (mode != kNoCode) change_mode(mode, block);
  if (plan.motion > 30 && !is_named_motion(plan.motion)) {
    return expanded_motion(block, plan, before);
  }
  if (plan.motion == kNoCode || plan.motion == kRefusedMotion) return;
  if (modal_.swivelled && ((plan.axes & kRotaryAxes) != 0 || plan.vector != 0)) {
    log_.error(
        "NC245",
        "rotary words or a tool axis in the plane of CYCLE800: the tool would leave it; write "
        "CYCLE800() before",
        at(block, GGroup::motion));
    return;
  }
  const bool feeds = plan.motion != 0;
  const bool arc_motion = plan.motion == 20 || plan.motion == 30;
  if (feeds && !feed_given(block, plan)) {
    coordinates_.move_to(target(block, plan.axes), unknown_at_target(block, plan.axes));
    return;
  }
  if (arc_motion) {
    arc(block, plan);
  } else if (is_named_motion(plan.motion)) {
    named_motion(block, plan);
  } else if (plan.axes != 0 || plan.vector != 0) {
    straight(block, plan);
  }
}

void Executor::straight(const BlockWords& block, const BlockPlan& plan) {
  begin_motion(block, plan);
  motion_.kind = plan.motion == 0 ? MotionKind::rapid : MotionKind::feed;
  const GCode code = block.code(GGroup::non_modal);
  if (code == 530 || code == 1530 || block.says(SiemensWord::supa)) {
    motion_.machine_position = true;
    if (modal_.swivelled) motion_.tcp = motion_.axis_vector = false;
    motion_.end = machine_target(block, plan.axes);
    motion_.unknown_end = static_cast<AxisMask>(coordinates_.unknown() & ~plan.axes);
  } else {
    motion_.end = target(block, plan.axes);
    motion_.unknown_end = unknown_at_target(block, plan.axes);
  }
  if (!is_linuxcnc() && modal_.tcp) turn_axis(block, plan);
  if (motion_.kind == MotionKind::feed) {
    motion_.duration = duration_of(motion_, length(motion_.start, motion_.end, 0), block);
  }
  finish_motion();
  // Where it stands in the plane is the machine's affair then.
  if (motion_.machine_position && modal_.swivelled) coordinates_.forget(kRotaryAxes | 7);
}

/// What is wrong with the words of a G2 or G3 block; empty: nothing.
std::string Executor::arc_form(const BlockWords& block, const BlockPlan& plan) const {
  const PlaneAxes plane = plane_axes(modal_.plane);
  // Under G43.5 I J K are refused on arcs, so they are centres here.
  const bool centre_form = block.has('I') || block.has('J') || block.has('K');
  const char radius = is_siemens() ? kCircleRadius : 'R';
  const bool in_plane = (plan.axes & (bit(plane.first) | bit(plane.second))) != 0;
  if (block.has(radius) && centre_form) {
    return "both " + address_text(radius) + " and I J K are given";
  }
  if (block.has(plane.wrong_centre)) {
    return std::string(1, plane.wrong_centre) + " has no meaning in the plane " + plane.name;
  }
  if (is_siemens() && block.has(kArcAngle)) {
    if (!(block[kArcAngle] > 0.0) || block[kArcAngle] >= 360.0) {
      return "AR, the angle of the arc, is above 0 and below 360 degrees";
    }
    if (block.has(radius) || block.has(kCircleTurns)) return "AR stands without CR and TURN";
    if (centre_form == in_plane) return "AR needs the end or the centre, not both";
    return {};
  }
  if (!block.has(radius) && !centre_form) {
    return "neither " + address_text(radius) + " nor I J K is given";
  }
  if (centre_form && modal_.arc_absolute &&
      !(block.has(plane.first_centre) && block.has(plane.second_centre))) {
    return std::string("absolute centres (G90.1) need both ") + plane.first_centre + " and " +
           plane.second_centre;
  }
  if (!centre_form && !in_plane) {
    return std::string("an arc by radius needs an end in the plane ") + plane.name;
  }
  return {};
}

/// The centre that I J K say, in program coordinates.
PlanePoint Executor::arc_centre(const BlockWords& block, const ArcWords& words) const {
  const PlaneAxes plane = plane_axes(modal_.plane);
  const auto component = [&](char letter, double start) {
    const bool absolute = modal_.arc_absolute || (block.absolute & letter_bit(letter)) != 0;
    const double value = block.has(letter) ? block[letter] * modal_.unit : 0.0;
    return value + (absolute ? 0.0 : start);
  };
  return {component(plane.first_centre, words.start.first),
          component(plane.second_centre, words.start.second)};
}

void Executor::arc(const BlockWords& block, const BlockPlan& plan) {
  const PlaneAxes plane = plane_axes(modal_.plane);
  const std::string code = g_code_text(plan.motion);
  begin_motion(block, plan);
  motion_.kind = MotionKind::feed;
  motion_.is_arc = true;
  motion_.end = target(block, plan.axes);
  motion_.unknown_end = unknown_at_target(block, plan.axes);
  const AxisWords start = coordinates_.program_from_world(motion_.start);
  const AxisWords end = coordinates_.program_from_world(motion_.end);
  if (!is_linuxcnc() && modal_.tcp) turn_axis(block, plan);
  const std::string problem = arc_form(block, plan);
  if (!problem.empty()) {
    log_.error("NC220", code + ": " + problem + "; let the CAM post write one centre form",
               at(block, GGroup::motion));
    coordinates_.move_to(motion_.end, motion_.unknown_end);
    return;
  }
  ArcWords words;
  words.start = {start[plane.first], start[plane.second]};
  words.end = {end[plane.first], end[plane.second]};
  words.clockwise = plan.motion == 20;
  words.turns = block.has('P') ? static_cast<int>(std::lround(block['P'])) : 1;
  if (block.has(kCircleTurns)) words.turns = 1 + static_cast<int>(std::lround(block[kCircleTurns]));
  words.centre_tolerance = modal_.unit == 1.0 ? kCentreToleranceMillimetre : kCentreToleranceInch;
  if (is_siemens()) words.centre_tolerance = kCentreToleranceSiemens;
  words.radius_tolerance = kRadiusTolerance;
  const char radius = is_siemens() ? kCircleRadius : 'R';
  PlaneArc found;
  if (is_siemens() && block.has(kArcAngle)) {
    found = arc_by_angle(block, words);
  } else if (block.has(radius)) {
    found = arc_by_radius(words, block[radius] * modal_.unit);
  } else {
    found = arc_by_centre(words, arc_centre(block, words));
  }
  if (!found.problem.empty()) {
    log_.error("NC221", code + ": " + found.problem, at(block, GGroup::motion));
    coordinates_.move_to(motion_.end, motion_.unknown_end);
    return;
  }
  finish_arc(block, found);
}

/// Hands on an arc of the plane from the motion's start to its end.
void Executor::finish_arc(const BlockWords& block, const PlaneArc& found) {
  const PlaneAxes plane = plane_axes(modal_.plane);
  const AxisWords start = coordinates_.program_from_world(motion_.start);
  const AxisWords end = coordinates_.program_from_world(motion_.end);
  Vec3 centre(start[0], start[1], start[2]);
  centre[static_cast<Eigen::Index>(plane.first)] = found.centre.first;
  centre[static_cast<Eigen::Index>(plane.second)] = found.centre.second;
  Vec3 normal = Vec3::Zero();
  normal[static_cast<Eigen::Index>(plane.third)] = 1.0;
  const std::optional<PlaneScale> scale = plane_scale(coordinates_, modal_.plane);
  if (!scale) {
    log_.error("NC245",
               "an arc whose plane the frame stretches unequally or bends is no arc any more; let "
               "the CAM post write without SCALE",
               at(block, GGroup::motion));
    coordinates_.move_to(motion_.end, motion_.unknown_end);
    return;
  }
  motion_.arc.centre = coordinates_.world_from_program(centre);
  motion_.arc.normal = coordinates_.world_normal(normal);
  motion_.arc.sweep = found.sweep;
  const double climb = scale->along * (end[plane.third] - start[plane.third]);
  const double round = scale->within * found.radius * found.sweep;
  motion_.duration = duration_of(motion_, std::hypot(round, climb), block);
  finish_motion();
}

}  // namespace smoothpost::nc
