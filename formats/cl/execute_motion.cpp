#include <cmath>

#include "formats/cl/executor.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::cl {
namespace {

constexpr AxisMask kXyz = 0x7;
constexpr AxisMask kRotary = 0x38;
constexpr double kShortestAxis = 1e-6;
constexpr double kLongestAxis = 1e6;
constexpr double kSlowest = 1e-9;     // mm/s
constexpr double kUnitLength = 1e-3;  // an axis further from length 1 is worth a warning
constexpr double kSamePlace = 1e-9;

AxisWords words_of(const Vec3& tip) { return {tip.x(), tip.y(), tip.z()}; }

}  // namespace

Vec3 Executor::point(std::size_t first) const {
  const Vec3 written(numbers_[first], numbers_[first + 1], numbers_[first + 2]);
  const double unit = unit_.value_or(1.0);
  if (!move_points_) return unit * written;
  return unit * (frame_rotation_ * written + frame_origin_);
}

Vec3 Executor::direction(std::size_t first) const {
  const Vec3 written(numbers_[first], numbers_[first + 1], numbers_[first + 2]);
  return move_points_ ? Vec3(frame_rotation_ * written) : written;
}

/// Three values as a direction, unit.
std::optional<Vec3> Executor::unit_direction(std::size_t first, const char* what, TextPlace place) {
  const Vec3 vector = direction(first);
  const double length = vector.norm();
  if (vector.allFinite() && length > kShortestAxis && length < kLongestAxis)
    return Vec3(vector / length);
  error("CL113", std::string(what) + " of length 0 (or above 1000000)", place);
  return {};
}

/// The tool axis at `first` among the values, unit.
std::optional<Vec3> Executor::tool_axis(const Statement& statement, std::size_t first) {
  const TextPlace place = statement.items[first].place;
  const auto axis = unit_direction(first, "a tool axis", place);
  if (!axis) return {};
  const double length = direction(first).norm();
  if (std::abs(length - 1.0) > kUnitLength && once(long_axis))
    log_.warning("CL165",
                 "a tool axis of length " + nc::decimal_text(length, 4) +
                     " (the first of them); its direction is taken",
                 place);
  return axis;
}

/// x,y,z or x,y,z,i,j,k of GOTO, FROM or a line of values.
std::optional<Executor::Position> Executor::target(const Statement& statement) {
  if (!read_numbers(statement, {3, 6}, "x,y,z or x,y,z,i,j,k")) return {};
  if (!length_unit(statement.place)) return {};
  Position end = position_;
  if (arc_) end.axis = arc_->end_axis;
  end.tip = point(0);
  if (!in_range(end.tip, statement.items.front().place)) return {};
  if (count_ == 3) return end;
  if (locked_axis_) {
    error("CL116", "i,j,k after MULTAX/OFF, which locks the tool axis; write MULTAX/ON before",
          statement.items[3].place);
    return {};
  }
  const auto axis = tool_axis(statement, 3);
  if (!axis) return {};
  end.axis = *axis;
  return end;
}

void Executor::go_to(const Statement& statement) {
  const auto end = target(statement);
  if (!end) return lose(statement);
  forward_.reset();
  if (circle_) return arc_point(*end, statement.place);
  if (cycle_refused_) return reach(*end);
  if (cycle_) return hole(*end, statement.place);
  const MotionKind kind = rapid_ ? MotionKind::rapid : MotionKind::feed;
  rapid_ = false;
  line_to(*end, kind, {}, statement.place);
}

/// Where the tool stands; no motion of the text, so the way there is a rapid.
void Executor::from(const Statement& statement) {
  circle_without_end(statement.place);
  const auto end = target(statement);
  if (!end) return lose(statement);
  if (known_) {
    const bool same = (end->tip - position_.tip).norm() < kSamePlace &&
                      (end->axis - position_.axis).norm() < kSamePlace;
    if (same) return;
    if (!doubtful_)
      log_.warning("CL161",
                   "FROM names another place than the last motion; the way there is read as a "
                   "rapid",
                   statement.place);
  }
  line_to(*end, MotionKind::rapid, {}, statement.place);
}

/// GODLTA/dx,dy,dz[,i,j,k], or GODLTA/d along the tool axis.
void Executor::go_delta(const Statement& statement) {
  circle_without_end(statement.place);
  if (!read_numbers(statement, {1, 3, 6}, "dx,dy,dz or d along the tool axis"))
    return lose(statement);
  if (!length_unit(statement.place)) return lose(statement);
  if (!known_) {
    error("CL125", "GODLTA before the position is known; write FROM or GOTO before",
          statement.place);
    return lose(statement);
  }
  if (cycle_) {
    error("CL131", "GODLTA in a cycle; write the holes as GOTO, or CYCLE/OFF before",
          statement.place);
    return lose(statement);
  }
  Position end = position_;
  const double unit = unit_.value_or(1.0);
  end.tip += count_ == 1 ? Vec3(unit * numbers_[0] * position_.axis) : Vec3(unit * direction(0));
  if (!in_range(end.tip, statement.place)) return lose(statement);
  if (count_ == 6) {
    const auto axis = tool_axis(statement, 3);
    if (!axis) return lose(statement);
    end.axis = *axis;
  }
  const MotionKind kind = rapid_ ? MotionKind::rapid : MotionKind::feed;
  rapid_ = false;
  const bool doubtful = doubtful_;
  line_to(end, kind, {}, statement.place);
  doubtful_ = doubtful;
}

/// The feed in mm/s: `own`, else that of FEDRAT.
std::optional<double> Executor::speed(std::optional<Feed> own, TextPlace place) {
  const std::optional<Feed> feed = own ? own : feed_;
  if (!feed) {
    if (once(no_feed))
      error("CL114",
            "a feed motion without feed: no FEDRAT stands before; say --input-feed in mm/min, or "
            "write RAPID before it",
            place);
    return {};
  }
  if (!own && !feed_given_ && once(feed_assumed))
    summary_.assumes.push_back("the feed is " +
                               nc::decimal_text(feed->value * kSecondsPerMinute, 4) +
                               " mm/min: the user's word, the text does not say it");
  if (!feed->per_revolution) return feed->value;
  const double speed = spindle_on_ ? feed->value * rpm_ / kSecondsPerMinute : 0.0;
  if (speed > kSlowest) return speed;
  error("CL115", "a feed by revolution while the spindle does not turn (SPINDL)", place);
  return {};
}

CanonicalMotion Executor::begin_motion(const Position& end, TextPlace place) const {
  CanonicalMotion motion;
  motion.tcp = motion.axis_vector = true;
  motion.programmed = kXyz;
  motion.line = place.line;
  motion.column = place.column;
  if (known_) {
    motion.start = words_of(position_.tip);
    motion.start_axis = position_.axis;
  } else {
    motion.unknown_start = kXyz | kRotary;
    motion.start_axis = Vec3::Zero();
  }
  motion.end = words_of(end.tip);
  motion.end_axis = end.axis;
  return motion;
}

/// A straight motion; the first one of a text, from nowhere, is a rapid.
void Executor::line_to(const Position& end, MotionKind kind, std::optional<Feed> own,
                       TextPlace place) {
  CanonicalMotion motion = begin_motion(end, place);
  motion.kind = known_ ? kind : MotionKind::rapid;
  if (motion.kind == MotionKind::feed) {
    const auto feed = speed(own, place);
    if (feed) motion.duration = (end.tip - position_.tip).norm() / *feed;
  }
  if (described_tool_ >= 0 && motion.kind == MotionKind::feed && once(tool_not_loaded))
    log_.warning("CL168",
                 "TOOLNO names tool " + std::to_string(described_tool_) +
                     " and no LOADTL loads it: no tool change is read",
                 place);
  sink_.motion(motion);
  reach(end);
}

void Executor::reach(const Position& end) {
  position_ = end;
  known_ = true;
  doubtful_ = false;
}

/// After a statement that could not be read.
void Executor::lose(const Statement& statement) {
  switch (statement.word()) {
    case Word::go_to:
    case Word::from:
    case Word::godlta:
    case Word::circle:
    case Word::tlon:
      known_ = doubtful_ = true;
      circle_.reset();
      rapid_ = false;
      break;
    case Word::cycle:
      cycle_refused_ = true;
      break;
    default:
      if (statement.kind == Statement::Kind::values) doubtful_ = true;
      break;
  }
}

}  // namespace smoothpost::cl
