#include <array>
#include <cmath>

#include "formats/heidenhain/executor.h"
#include "kernels/core/units.h"

// CYCL DEF: datum, rotation, dwell and drilling.
namespace smoothpost::conversational {
namespace {

constexpr double kLongestDwell = 86400.0;  // s
constexpr double kLargest = 1.0e6;         // mm
constexpr std::uint64_t kFreeSteps = 16;

/// Why a cycle that is known is not read.
const char* refusal(int cycle) {
  switch (cycle) {
    case 8:
    case 11:
    case 26:
      return "mirrors or scales coordinates; let the CAM post write them out";
    case 12:
      return "runs another file; put its blocks into this one";
    case 19:
      return "tilts the working plane by angles whose meaning is set on the machine; write PLANE "
             "SPATIAL";
    default:
      return "is not read (1, 7, 9, 10, 32, 200 and 247 are); let the CAM post write its motions "
             "out";
  }
}

}  // namespace

/// CYCL DEF n.k ..., or CYCL DEF n name with its Q parameters.
void Executor::define_cycle(Scanner& scanner) {
  send_held(nullptr);
  const std::size_t offset = scanner.offset();
  const auto number = scanner.whole();
  if (!number || *number > 9999)
    return error("NC401", "CYCL DEF needs the number of a cycle", offset);
  const int cycle = static_cast<int>(*number);
  int part = 0;
  if (scanner.take_byte('.')) {
    const auto read = scanner.whole();
    if (!read || *read > 99) return error("NC401", "the part of the cycle is a number", offset);
    part = static_cast<int>(*read);
  }
  if (part > 0 && cycle == cycle_ && cycle_refused_) return;
  if (part > 0 && cycle != cycle_)
    return error("NC414",
                 "CYCL DEF " + std::to_string(cycle) + "." + std::to_string(part) +
                     " without CYCL DEF " + std::to_string(cycle) + ".0 before it",
                 offset);
  if (part == 0) {
    cycle_ = cycle;
    cycle_refused_ = false;
  }
  define_part(scanner, cycle, part);
}

void Executor::define_part(Scanner& scanner, int cycle, int part) {
  switch (cycle) {
    case 7:
      if (part > 0) datum_shift(scanner);
      return;
    case 10:
      if (part > 0) datum_rotation(scanner);
      return;
    case 9:
      if (part > 0) dwell_part(scanner);
      return;
    case 1:
      return peck_part(scanner, part);
    case 32:
      return;  // the tolerance changes speed and smoothing
    case 200:
    case 247:
      return parameter_cycle(scanner, cycle);
    default:
      cycle_refused_ = true;
      // Without values cycles 8, 11 and 19 end what they began, and that was refused.
      return error("NC402",
                   "CYCL DEF " + std::to_string(cycle) + " is not read: it " + refusal(cycle), 0);
  }
}

/// Cycle 7: X+10, IX+10, several in one part.
void Executor::datum_shift(Scanner& scanner) {
  if (scanner.peek() == '#')
    return error("NC402", "a line of a datum table (#) is known on the machine only", 0);
  const auto read = words(scanner);
  if (!read) return;
  if (tilted_ || rotation_ != 0.0)
    return error(
        "NC414",
        "a datum shift behind a rotation or in a tilted plane is not read; write it before", 0);
  for (std::size_t i = 0; i < shift_.size(); ++i) {
    const bool absolute = (read->absolute >> i & 1U) != 0;
    if (!absolute && (read->incremental >> i & 1U) == 0) continue;
    const double value =
        i >= 3 && i < 6 ? radians_from_degrees(read->value[i]) : read->value[i] * unit_;
    shift_[i] = value + (absolute ? 0.0 : shift_[i]);
  }
  set_frame(coordinates_.frame_rotation());
}

/// Cycle 10: ROT+30 or IROT+30 about the datum.
void Executor::datum_rotation(Scanner& scanner) {
  const bool incremental = scanner.take("IROT");
  if (!incremental && !scanner.take("ROT"))
    return error("NC401", "ROT is expected", scanner.offset());
  const auto angle = value(scanner);
  if (!angle || !no_more(scanner)) return;
  if (tilted_) return error("NC414", "a rotation in a tilted plane is not read", 0);
  rotation_ = radians_from_degrees(*angle) + (incremental ? rotation_ : 0.0);
  set_frame(rotation_ == 0.0 ? Mat3(Mat3::Identity()) : rotation_about(Vec3::UnitZ(), rotation_));
}

/// Cycle 9: the seconds behind any word.
void Executor::dwell_part(Scanner& scanner) {
  while (!scanner.at_end() && !(scanner.peek() >= '0' && scanner.peek() <= '9') &&
         scanner.peek() != '+' && scanner.peek() != '-' && scanner.peek() != 'Q' &&
         scanner.peek() != ',')
    scanner.take_byte(scanner.peek());
  const auto seconds = value(scanner);
  if (!seconds || !no_more(scanner)) return;
  if (!(*seconds >= 0.0 && *seconds <= kLongestDwell))
    return error("NC414", "a dwell has to be 0 to 86400 s", 0);
  sink_.dwell(*seconds, source_.place(0).line);
}

/// Cycle 1, one value a part: clearance, depth, stroke, dwell, feed.
void Executor::peck_part(Scanner& scanner, int part) {
  if (part == 0) {
    drill_ = DrillCycle{};
    drill_.number = 1;
    drill_defined_ = true;
    return;
  }
  constexpr std::array<std::string_view, 5> kLetters = {"a clearance", "a depth", "a stroke",
                                                        "a dwell", "a feed"};
  if (part > 5) return error("NC414", "cycle 1 has five parts", 0);
  while (!scanner.at_end() && !(scanner.peek() >= '0' && scanner.peek() <= '9') &&
         scanner.peek() != '+' && scanner.peek() != '-' && scanner.peek() != 'Q' &&
         scanner.peek() != '.' && scanner.peek() != ',')
    scanner.take_byte(scanner.peek());
  const auto read = value(scanner);
  if (!read) {
    drill_defined_ = false;
    return;
  }
  if (!no_more(scanner)) return;
  if (std::abs(*read) > kLargest)
    return error(
        "NC414",
        "cycle 1: " + std::string(kLetters[static_cast<std::size_t>(part) - 1]) + " beyond 1000000",
        0);
  switch (part) {
    case 1:
      drill_.clearance = std::abs(*read) * unit_;
      return;
    case 2:
      if (*read >= 0.0) {
        drill_defined_ = false;
        return error("NC414", "cycle 1: a depth is negative: it counts downwards", 0);
      }
      drill_.depth = -*read * unit_;
      return;
    case 3:
      drill_.peck = std::abs(*read) * unit_;
      return;
    case 4:
      drill_.dwell_bottom = std::abs(*read);
      return;
    default:
      drill_.feed = *read;
  }
}

/// Cycles 200 and 247: Q parameters, which keep their values.
void Executor::parameter_cycle(Scanner& scanner, int cycle) {
  while (!scanner.at_end()) {
    const char first = scanner.peek();
    if (first == 'Q') {
      const auto name = Variables::take_name(scanner);
      if (name && scanner.take_byte('=')) {
        const auto read = value(scanner);
        if (!read) {
          cycle_refused_ = true;
          drill_defined_ = false;
          return;
        }
        variables_.set(*name, *read);
        continue;
      }
    }
    scanner.take_byte(first);  // the cycle's name
  }
  const auto parameter = [&](long number) { return variables_.find({0, number}); };
  if (cycle == 247) {
    const auto preset = parameter(339);
    if (!preset || !(*preset >= 1.0 && *preset <= nc::kWorkSystems) ||
        *preset != std::floor(*preset))
      return error("NC414",
                   "CYCL DEF 247 is read for presets Q339 of 1 to 9, which stand for the systems "
                   "G54 to G59.3 of --input-work-offset",
                   0);
    if (tilted_) return error("NC414", "a preset in a tilted plane is not read", 0);
    shift_ = {};
    rotation_ = 0.0;
    coordinates_.select_system(static_cast<int>(*preset));
    return set_frame(Mat3::Identity());
  }
  drill_ = DrillCycle{};
  drill_.number = 200;
  drill_defined_ = false;
  struct Field {
    long number;
    double DrillCycle::*member;
    bool length;
  };
  static constexpr std::array<Field, 8> kFields = {{{200, &DrillCycle::clearance, true},
                                                    {201, &DrillCycle::depth, true},
                                                    {206, &DrillCycle::feed, false},
                                                    {202, &DrillCycle::peck, true},
                                                    {210, &DrillCycle::dwell_top, false},
                                                    {203, &DrillCycle::surface, true},
                                                    {204, &DrillCycle::second_clearance, true},
                                                    {211, &DrillCycle::dwell_bottom, false}}};
  for (const Field& field : kFields) {
    const auto read = parameter(field.number);
    const bool needed = field.number != 210 && field.number != 211;
    if ((!read && needed) || (read && std::abs(*read) > kLargest))
      return error("NC414", "cycle 200 needs Q" + std::to_string(field.number), 0);
    drill_.*field.member = read.value_or(0.0) * (field.length ? unit_ : 1.0);
  }
  if (const auto point = parameter(395); point && *point != 0.0)
    return error("NC402", "cycle 200 with the depth of the full diameter (Q395) is not read", 0);
  if (drill_.depth >= 0.0 || drill_.clearance < 0.0 || drill_.dwell_top < 0.0 ||
      drill_.dwell_bottom < 0.0)
    return error("NC414",
                 "cycle 200: the depth Q201 has to be negative, clearance and dwells 0 or more", 0);
  drill_.depth = -drill_.depth;
  drill_defined_ = true;
}

/// One hole where the tool stands: CYCL CALL or M99.
void Executor::drill(std::size_t offset) {
  send_held(nullptr);
  if (!drill_defined_) return error("NC414", "no cycle is defined that could be called", offset);
  if ((coordinates_.unknown() & 7) != 0)
    return error("NC414", "a cycle is called where the position is unknown", offset);
  const double peck = drill_.peck > 0.0 ? drill_.peck : drill_.depth;
  if (!(peck > 0.0) || !(drill_.feed > 0.0))
    return error("NC414", "the cycle has no depth or no feed", offset);
  DrillCycle cycle = drill_;
  cycle.peck = peck;
  const double strokes = stroke_count(cycle);
  constexpr double kMost = 1.0e9;
  const double cost = 3.0 * std::min(strokes, kMost);
  if (cost > static_cast<double>(kFreeSteps) && !spend(static_cast<std::uint64_t>(cost))) return;
  const double height = coordinates_.program_from_world(coordinates_.world())[2];
  MotionWords words;
  words.absolute = 4;
  for (const CycleStep& step : drill_steps(cycle, height)) {
    words.value[2] = step.height / unit_;
    words.rapid = !step.feed;
    CanonicalMotion motion = begin_motion(words);
    motion.end = target(words);
    motion.unknown_end = unknown_at(words);
    const auto modal = feed_;
    if (step.feed) feed_ = cycle.feed;
    const double length =
        std::hypot(motion.end[0] - motion.start[0], motion.end[1] - motion.start[1],
                   motion.end[2] - motion.start[2]);
    const bool good = set_axis(words, motion) && set_speed(words, motion, length);
    feed_ = modal;
    if (!good) return;
    send(motion);
    if (step.dwell > 0.0) sink_.dwell(step.dwell, motion.line);
  }
}

}  // namespace smoothpost::conversational
