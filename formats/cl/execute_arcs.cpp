#include <algorithm>
#include <cmath>

#include "formats/cl/executor.h"
#include "formats/cl/nx_circles.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::cl {
namespace {

constexpr double kInPlane = 0.01;            // mm
constexpr double kAlongTangent = 0.9961947;  // cos 5°
constexpr const char* kTlonForm = "TLON,GOFWD/(CIRCLE/x,y,z,r),ON,(LINE/x1,y1,z1,x2,y2,z2)";

bool is_word(const Item& item, std::string_view upper_case) {
  return item.kind == Item::Kind::word && same_word(item.text, upper_case);
}

}  // namespace

/// CIRCLE/x,y,z,i,j,k[,r[,tolerances and tool of NX]]: the circle of the GOTO that follows.
void Executor::begin_circle(const Statement& statement) {
  circle_without_end(statement.place);
  const auto fail = [&](const char* code, std::string text, TextPlace place) {
    error(code, std::move(text), place);
    lose(statement);
  };
  for (const Item& item : statement.items)
    if (is_word(item, "TIMES"))
      return fail("CL150",
                  "a helix of several turns (TIMES) is not read; let the CAM system write one turn "
                  "an arc",
                  item.place);
  if (!read_numbers(statement, {6, 7, 8, 9, 10, 11}, "CIRCLE/x,y,z,i,j,k[,r[,...]]"))
    return lose(statement);
  if (!length_unit(statement.place)) return lose(statement);
  if (rapid_) return fail("CL120", "a rapid on an arc; write FEDRAT before it", statement.place);
  if (cycle_) return fail("CL120", "an arc in a cycle; write CYCLE/OFF before", statement.place);
  if (!known_)
    return fail("CL125", "an arc before the position is known; write GOTO before", statement.place);
  Circle circle;
  circle.centre = point(0);
  if (!in_range(circle.centre, statement.items.front().place)) return lose(statement);
  const auto normal = unit_direction(3, "an axis of a circle", statement.items[3].place);
  if (!normal) return lose(statement);
  circle.normal = *normal;
  if (count_ >= 7) {
    circle.radius = unit_.value_or(1.0) * numbers_[6];
    if (!(circle.radius > 0.0))
      return fail("CL121", "the radius of a circle has to be above 0", statement.items[6].place);
  }
  if (count_ >= kNxCircleValues) {
    const auto right_hand = nx_right_hand(statement.place);
    if (!right_hand) return lose(statement);
    circle.right_hand = *right_hand;
  }
  circle_ = circle;
  circle_place_ = statement.place;
}

/// The sense of CIRCLE in the NX form, decided once for a text.
std::optional<bool> Executor::nx_right_hand(TextPlace place) {
  if (nx_right_hand_) return nx_right_hand_;
  if (settings_.nx_circles != NxCircleSense::by_tangents) {
    nx_right_hand_ = settings_.nx_circles == NxCircleSense::counter_clockwise;
    return nx_right_hand_;
  }
  const TangentVotes votes = count_tangents(text_);
  if (votes.right_hand > 0 && votes.left_hand > 0) {
    error("CL122",
          "the sense of CIRCLE about its axis cannot be told: " + std::to_string(votes.right_hand) +
              " ends of arcs go on straight counter-clockwise and " +
              std::to_string(votes.left_hand) + " clockwise; say --cl-circles ccw or cw",
          place);
    return {};
  }
  nx_right_hand_ = votes.right_hand > 0;
  const std::string sense = *nx_right_hand_ ? "counter-clockwise" : "clockwise";
  const std::size_t ends = std::max(votes.right_hand, votes.left_hand);
  std::string text = "CIRCLE of the NX form is read as " + sense + " about its axis, ";
  text += ends > 0 ? "as the straight motions at " + std::to_string(ends) + " ends of arcs say"
                   : "as the manual of NX says";
  log_.note("CL167", text + " (--cl-circles says another)", place);
  summary_.assumes.push_back(std::move(text));
  return nx_right_hand_;
}

void Executor::circle_without_end(TextPlace place) {
  if (!circle_) return;
  circle_.reset();
  error("CL120",
        "the CIRCLE of line " + std::to_string(circle_place_.line) +
            " is not followed by the GOTO to its end",
        place);
  doubtful_ = true;
}

/// GOTO behind CIRCLE, or a further point of it in a line of values.
void Executor::arc_point(const Position& point, TextPlace place) {
  if (!arc_) {
    arc_ = OpenArc{ArcPath(*circle_, position_.tip), position_.axis, place};
    circle_.reset();
  }
  const std::string problem = doubtful_ ? std::string() : arc_->path.add(point.tip);
  if (doubtful_ || !problem.empty()) {
    if (!problem.empty()) error("CL121", "CIRCLE: " + problem, place);
    arc_.reset();
    reach(point);
    doubtful_ = !problem.empty();
    return;
  }
  arc_->end_axis = point.axis;
  arc_->place = place;
}

/// A line that begins with a number: a further point of the arc (Creo).
void Executor::arc_values(const Statement& statement) {
  if (!arc_) {
    if (!doubtful_)
      error("CL124",
            "a line of values without a word; only the points of an arc stand so, behind CIRCLE "
            "and GOTO",
            statement.place);
    return;
  }
  const auto end = target(statement);
  if (!end) {
    arc_.reset();
    return lose(statement);
  }
  arc_point(*end, statement.place);
}

void Executor::finish_arc() {
  if (!arc_) return;
  const OpenArc arc = *arc_;
  arc_.reset();
  const Circle& circle = arc.path.circle();
  const Vec3& start = arc.path.start();
  const Position end{arc.path.end(), arc.end_axis};
  CanonicalMotion motion = begin_motion(end, arc.place);
  motion.kind = MotionKind::feed;
  motion.is_arc = true;
  motion.arc.normal = circle.normal;
  motion.arc.centre = circle.centre + circle.normal * circle.normal.dot(start - circle.centre);
  motion.arc.sweep = circle.right_hand ? arc.path.sweep() : -arc.path.sweep();
  const double radius = 0.5 * (radius_at(circle, start) + radius_at(circle, end.tip));
  const double rise = circle.normal.dot(end.tip - start);
  if (const auto feed = speed({}, arc.place))
    motion.duration = std::hypot(radius * motion.arc.sweep, rise) / *feed;
  sink_.motion(motion);
  reach(end);
}

// ---- CATIA
// ---------------------------------------------------------------------------------------

/// INDIRV/i,j,k: the direction in which the next TLON starts.
void Executor::forward_direction(const Statement& statement) {
  if (!read_numbers(statement, {3}, "INDIRV/i,j,k")) return;
  forward_ = unit_direction(0, "a direction", statement.place);
}

std::optional<Executor::TlonArc> Executor::read_tlon(const Statement& statement) {
  const std::span<const Item> items = statement.items;
  std::size_t at = 0;
  const auto fail = [&]() -> std::optional<TlonArc> {
    const bool behind = at >= items.size();
    error("CL123",
          (behind ? std::string("the statement ends too early")
                  : quoted(items[at].text) + " is not expected here") +
              "; read is " + kTlonForm + ", with 2,INTOF, before (LINE or without",
          behind ? statement.place : items[at].place);
    return {};
  };
  const auto is = [&](Item::Kind kind) { return at < items.size() && items[at].kind == kind; };
  const auto take = [&](Item::Kind kind) { return is(kind) && ++at > 0; };
  const auto take_word = [&](std::string_view word) {
    return is(Item::Kind::word) && same_word(items[at].text, word) && ++at > 0;
  };
  const auto take_numbers = [&] {
    const std::size_t begin = at;
    while (is(Item::Kind::number)) ++at;
    numbers_from(items.subspan(begin, at - begin), kTlonForm);
  };
  const auto open = [&](std::string_view word) {
    return take(Item::Kind::open) && take_word(word) && take(Item::Kind::slash);
  };

  TlonArc arc;
  if (!(take_word("GOFWD") && take(Item::Kind::slash) && open("CIRCLE"))) return fail();
  take_numbers();
  if (!(count_ == 4 || count_ == 7) || !take(Item::Kind::close)) return fail();
  arc.circle.centre = point(0);
  arc.plane_given = count_ == 7;
  if (!in_range(arc.circle.centre, statement.place)) return {};
  if (arc.plane_given) {
    const auto normal = unit_direction(3, "an axis of a circle", statement.place);
    if (!normal) return {};
    arc.circle.normal = *normal;
  }
  arc.circle.radius = unit_.value_or(1.0) * numbers_[count_ - 1];
  if (!take_word("ON")) return fail();
  if (take(Item::Kind::number) && !take_word("INTOF")) return fail();
  if (!open("LINE")) return fail();
  take_numbers();
  if (count_ != 6 || !take(Item::Kind::close) || at != items.size()) return fail();
  arc.end = point(3);
  if (!(arc.circle.radius > 0.0)) {
    error("CL121", "the radius of a circle has to be above 0", statement.place);
    return {};
  }
  return arc;
}

/// A circle without axis lies normal to Z or, when it does not fit so, to the tool axis. What is
/// wrong with it, or nothing.
std::string Executor::choose_plane(TlonArc& arc) const {
  const Vec3& start = position_.tip;
  if (arc.plane_given) return {};
  const Vec3 z = move_points_ ? Vec3(frame_rotation_.col(2)) : Vec3(Vec3::UnitZ());
  for (const Vec3& normal : {z, position_.axis}) {
    arc.circle.normal = normal;
    const bool flat = std::abs(normal.dot(start - arc.circle.centre)) < kInPlane &&
                      std::abs(normal.dot(arc.end - arc.circle.centre)) < kInPlane;
    if (flat && off_circle(arc.circle, start, arc.end).empty()) return {};
  }
  arc.circle.normal = z;
  return off_circle(arc.circle, start, arc.end);
}

/// TLON,GOFWD/(CIRCLE/...),ON,(LINE/...): an arc to the second point of the line.
void Executor::tlon(const Statement& statement) {
  circle_without_end(statement.place);
  const auto forward = forward_;
  forward_.reset();
  const auto fail = [&](const char* code, std::string text) {
    error(code, std::move(text), statement.place);
    lose(statement);
  };
  if (!length_unit(statement.place)) return lose(statement);
  auto arc = read_tlon(statement);
  if (!arc) return lose(statement);
  if (!in_range(arc->end, statement.place)) return lose(statement);
  if (rapid_) return fail("CL120", "a rapid on an arc; write FEDRAT before it");
  if (cycle_) return fail("CL120", "an arc in a cycle; write CYCLE/OFF before");
  if (!known_) return fail("CL125", "an arc before the position is known; write GOTO before");
  const Position end{arc->end, position_.axis};
  if (doubtful_) return reach(end);
  if (!forward) return fail("CL123", "TLON without INDIRV before it, which gives its direction");
  const std::string problem = choose_plane(*arc);
  if (!problem.empty()) return fail("CL121", "TLON: " + problem);
  if (!off_circle(arc->circle, position_.tip, position_.tip).empty())
    return fail("CL121", "TLON: " + off_circle(arc->circle, position_.tip, position_.tip));
  const double along = tangent_at(arc->circle, position_.tip).dot(*forward);
  if (std::abs(along) < kAlongTangent) {
    const double angle = std::acos(std::min(1.0, std::abs(along)));
    return fail("CL123", "INDIRV is " + nc::decimal_text(degrees_from_radians(angle), 1) +
                             " degrees off the circle's tangent at the start; limit 5 degrees");
  }
  arc->circle.right_hand = along > 0.0;
  circle_ = arc->circle;
  arc_point(end, statement.place);
  finish_arc();
}

}  // namespace smoothpost::cl
