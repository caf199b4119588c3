#include "postproc/pipeline/verify.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/units.h"
#include "kernels/kinematics/bent_motion.h"
#include "kernels/spline/bent_move.h"
#include "postproc/pipeline/tool_motion.h"
#include "postproc/pipeline/worst.h"

namespace smoothpost {

namespace {

constexpr double kMostSteps = 512.0, kMostBentSteps = 8192.0;  // of a block, and of a polynomial
constexpr double kPrintedRotation = 1e-4;  // deg, that a printed orientation may be off

bool is_rotary(const AxisDefinition& axis) { return axis.joint.kind == JointKind::rotary; }
double display_scale(const AxisDefinition& axis) {
  return is_rotary(axis) ? kDegreesPerRadian : 1.0;
}
std::string unit_of(const AxisDefinition& axis) { return is_rotary(axis) ? "deg" : "mm"; }

std::string source_name(LimitSource source) {
  switch (source) {
    case LimitSource::datasheet:
      return "datasheet";
    case LimitSource::measured:
      return "measured";
    case LimitSource::assumed:
      return "assumed";
  }
  return "assumed";
}

bool has_beam(const MachineDefinition& machine) {
  return machine.has_event(event_name::kBeamOn) || machine.has_event(event_name::kPierce);
}

/// Time at the end of each move, s: printed durations, rapids at the velocity limits.
std::vector<double> move_times(const ReadBack& read, const MachineDefinition& machine) {
  std::vector<double> times;
  times.reserve(read.moves.size());
  double time = 0.0;
  JointVector from;
  std::size_t event = 0;
  for (std::size_t i = 0; i < read.moves.size(); ++i) {
    for (; event < read.events.size() && read.events[event].before <= i; ++event)
      time += read.events[event].seconds;
    const auto& move = read.moves[i];
    double step = move.duration;
    if (move.rapid && from.size() > 0)
      for (int j = 0; j < machine.size(); ++j)
        step = std::max(step, std::abs(move.to[j] - from[j]) /
                                  machine.axes[static_cast<std::size_t>(j)].velocity);
    time += step;
    times.push_back(time);
    from = move.to;
  }
  return times;
}

void check_axes(const ReadBack& read, const MachineDefinition& machine,
                const std::vector<double>& times, Verification& out) {
  Checks velocity;
  for (int j = 0; j < machine.size(); ++j) {
    const AxisDefinition& axis = machine.axes[static_cast<std::size_t>(j)];
    const double scale = display_scale(axis);
    Worst share, speed;
    AxisSummary summary;
    summary.name = axis.name;
    summary.unit = unit_of(axis);
    bool first = true;
    JointVector from;
    const double mid = 0.5 * (axis.joint.lower + axis.joint.upper);
    const double half = 0.5 * (axis.joint.upper - axis.joint.lower);
    for (std::size_t i = 0; i < read.moves.size(); ++i) {
      const ReadBackMove& move = read.moves[i];
      if (move.known >> j & 1U) {
        const double q = move.to[j];
        // A step of a bent move: h²/8·|q''| off the straight way is 4/h times that in q'.
        const double off = move.deviation.size() > 0 ? move.deviation[j] : 0.0;
        const double bent = std::max(0.0, off - move.spread);
        share.see((std::abs(q - mid) + off) / half, move.line, times[i]);
        const double low = (q - off) * scale, high = (q + off) * scale;
        summary.position_low = first ? low : std::min(summary.position_low, low);
        summary.position_high = first ? high : std::max(summary.position_high, high);
        first = false;
        if (!move.rapid && move.duration > 0.0 && from.size() > 0)
          speed.see((std::abs(q - from[j]) + 4.0 * bent) / move.duration * scale, move.line,
                    times[i]);
      }
      from = move.to;
    }
    summary.peak_velocity = speed.value();
    summary.limit_velocity = axis.velocity * scale;
    summary.limit_acceleration = axis.acceleration * scale;
    summary.limit_jerk = axis.jerk * scale;
    summary.source = source_name(axis.source);
    Check position = share.check("position_limit." + axis.name, 1.0, "share of range");
    position.ok = position.value <= 1.0 + 1e-12;
    out.checks.push_back(position);
    Check v =
        speed.check("velocity_limit." + axis.name, summary.limit_velocity, summary.unit + "/s");
    v.planned = true;
    velocity.push_back(v);
    out.axes.push_back(std::move(summary));
  }
  out.checks.insert(out.checks.end(), velocity.begin(), velocity.end());
}

Check rule(std::string name, double value, std::string unit, std::uint32_t line, std::string note) {
  Check c;
  c.name = std::move(name);
  c.value = value;
  c.limit = 0.0;
  c.unit = std::move(unit);
  c.ok = value <= 0.0;
  c.output_line = line;
  c.note = c.ok ? "" : std::move(note);
  return c;
}

void check_beam(const ReadBack& read, Checks& checks) {
  double rapids = 0.0, ends = 0.0, dwells = 0.0;
  std::uint32_t rapid_line = 0, end_line = 0, dwell_line = 0;
  bool beam = false, moved_since_on = true;
  std::size_t event = 0;
  const auto take_events = [&](std::size_t before) {
    for (; event < read.events.size() && read.events[event].before <= before; ++event) {
      const ReadBackEvent& e = read.events[event];
      if (e.beam && !beam) moved_since_on = false;
      beam = e.beam;
      // A dwell between beam on and the first motion is the pierce.
      const bool waits =
          e.name == "dwell" || e.name == event_name::kStop || e.name == event_name::kOptionalStop;
      const bool pierce = e.name == "dwell" && !moved_since_on;
      if (waits && beam && !pierce) {
        dwells += e.name == "dwell" ? e.seconds : 1.0;
        if (dwell_line == 0) dwell_line = e.line;
      }
    }
  };
  for (std::size_t i = 0; i < read.moves.size(); ++i) {
    take_events(i);
    const ReadBackMove& move = read.moves[i];
    if (move.beam && move.rapid) {
      ++rapids;
      if (rapid_line == 0) rapid_line = move.line;
    }
    if (i == 0 && move.beam) {
      ++ends;
      end_line = move.line;
    }
    moved_since_on = true;
  }
  take_events(read.moves.size());
  if (beam) {
    ++ends;
    end_line = read.last_line;
  }
  checks.push_back(rule("beam_off_in_rapid", rapids, "moves", rapid_line,
                        "the beam is on during a rapid move: turn it off before"));
  checks.push_back(rule("beam_off_at_start_and_end", ends, "ends", end_line,
                        "the beam is on before the first or after the last motion"));
  checks.push_back(rule("beam_dwell", dwells, "s", dwell_line,
                        "the beam is on while the machine waits, and this is no pierce"));
}

}  // namespace

Verification verify_machine(const ReadBack& read, const MachineDefinition& machine) {
  Verification out;
  const std::vector<double> times = move_times(read, machine);
  out.scheduled_time = times.empty() ? 0.0 : times.back();
  check_axes(read, machine, times, out);
  if (has_beam(machine)) check_beam(read, out.checks);
  if (machine.dialect.offset_guard)
    out.checks.push_back(rule("offset_guard", read.offset_guard ? 0.0 : 1.0, "missing", 0,
                              "the guard against live offsets is missing or was changed"));
  out.checks.push_back(
      rule("exact_path", read.exact_path ? 0.0 : 1.0, "missing", 0,
           "the controller may blend between blocks by an amount without a bound: set "
           "dialect.path_mode = \"exact\""));
  return out;
}

namespace {

class DeviationCheck {
 public:
  DeviationCheck(const ReadBack& read, const MachineDefinition& machine,
                 const DeviationInput& input)
      : read_(read), machine_(machine), in_(input), times_(move_times(read, machine)) {
    if (in_.orientation) orientation_.emplace(machine, *in_.orientation);
  }

  Checks run(const Progress& progress) {
    Checks checks;
    check_map();
    if (broken_.empty()) {
      for (std::size_t i = 0; i < read_.moves.size(); ++i) {
        if (in_.map[i].role == MoveRole::path) {
          compare_block(i);
        }
        compare_joints(i);
        if (i % 4096 == 0 &&
            !progress("verify", static_cast<double>(i) / static_cast<double>(read_.moves.size()))) {
          broken(read_.moves[i].line, "cancelled before the whole program was compared");
          break;
        }
      }
      checks.push_back(tip_.check("tip_deviation", machine_.tolerance.tip, "mm"));
      add_axis_checks(checks);
      if (in_.whole_rotation)
        checks.push_back(rotation_.check("rotation_deviation",
                                         degrees_from_radians(machine_.tolerance.axis), "deg"));
      add_round_trip(checks);
      if (has_beam(machine_)) {
        compare_beam();
        checks.push_back(event_position_check());
        checks.push_back(rule("beam_as_programmed", wrong_beam_, "moves", wrong_beam_line_,
                              "the beam is on where the input has it off, or off where it is on"));
      }
    }
    if (has_beam(machine_)) check_beam_in_links(checks);
    if (broken_.empty()) check_low_links(checks);
    Check complete;
    complete.name = "path_complete";
    complete.unit = "faults";
    complete.ok = broken_.empty();
    complete.value = broken_.empty() ? 0.0 : 1.0;
    complete.note = broken_;
    complete.output_line = broken_line_;
    checks.push_back(complete);
    return checks;
  }

 private:
  void add_axis_checks(Checks& checks) const {
    const bool all_free = orientation_ && in_.orientation->free && !axis_.seen();
    if (!all_free)
      checks.push_back(
          axis_.check("axis_deviation", degrees_from_radians(machine_.tolerance.axis), "deg"));
    if (orientation_) {
      const Checks of_beam = orientation_->checks();
      checks.insert(checks.end(), of_beam.begin(), of_beam.end());
    }
    if (!machine_.standoff.axis.empty())
      checks.push_back(standoff_.check("standoff_deviation", machine_.tolerance.tip, "mm"));
  }

  // Every motion of the text is one entry of the map, in order, and the entries of the input's
  // segments follow each other without a gap from the first to the last.
  void check_map() {
    if (read_.moves.size() != in_.map.size())
      return broken(0, "the program has " + std::to_string(read_.moves.size()) +
                           " motions, planned were " + std::to_string(in_.map.size()));
    if (!in_.map.empty() && in_.map.front().role == MoveRole::path)
      return broken(in_.map.front().output_line, "the way to the first point is missing");
    std::size_t segment = 0;
    double share = 1.0;
    for (std::size_t i = 0; i < in_.map.size(); ++i) {
      const LineMapEntry& e = in_.map[i];
      if (read_.moves[i].line != e.output_line)
        return broken(read_.moves[i].line, "a motion stands on another line than planned");
      if (e.role != MoveRole::path) continue;
      while (share == 1.0 && segment + 1 < e.segment &&
             in_.reference.path().points[segment + 1].replanned)
        ++segment;
      const bool next = share == 1.0 && e.from_segment == segment + 1 && e.from_share == 0.0;
      const bool goes_on = e.from_segment == segment && e.from_share == share;
      if (!next && !goes_on)
        return broken(e.output_line, "a part of the tool path is missing or doubled");
      if (e.segment < e.from_segment ||
          (e.segment == e.from_segment && !(e.to_share > e.from_share)))
        return broken(e.output_line, "a block goes backwards");
      for (std::uint32_t k = e.from_segment; k <= e.segment; ++k)
        if (in_.reference.path().points[k].replanned)
          return broken(e.output_line, "a block passes over a link");
      segment = e.segment;
      share = e.to_share;
    }
    while (share == 1.0 && segment < in_.reference.segments() &&
           in_.reference.path().points[segment + 1].replanned)
      ++segment;
    if (segment != in_.reference.segments() || share != 1.0)
      broken(0, "the end of the tool path is missing");
  }

  // The latency of an event at the programmed feed may be the tolerance exactly.
  Check event_position_check() const {
    Check c = event_.check("event_position", machine_.tolerance.event, "mm");
    c.ok = std::isfinite(c.value) && c.value <= c.limit * (1.0 + 1e-6);
    return c;
  }

  void broken(std::uint32_t line, std::string why) {
    broken_ = std::move(why);
    broken_line_ = line;
  }

  /// The part of a block, t0 to t1 of its own parameter, that stands for a part of one segment.
  struct Piece {
    std::uint32_t segment = 0;
    double from = 0.0, to = 1.0;
    double t0 = 0.0, t1 = 1.0;
  };

  // A block in the place of several segments is paired with them by tip length.
  std::vector<Piece> pieces_of(const LineMapEntry& e) const {
    if (e.from_segment == e.segment) return {{e.segment, e.from_share, e.to_share, 0.0, 1.0}};
    std::vector<Piece> pieces;
    double length = 0.0;
    for (std::uint32_t k = e.from_segment; k <= e.segment; ++k) {
      Piece piece{k, k == e.from_segment ? e.from_share : 0.0, k == e.segment ? e.to_share : 1.0};
      piece.t0 = length;
      length += in_.reference.length(k) * (piece.to - piece.from);
      piece.t1 = length;
      pieces.push_back(piece);
    }
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      // Where only the axis turns there is no length: each segment has as much of the block.
      const bool none = length <= 0.0;
      pieces[k].t0 = none ? static_cast<double>(k) / static_cast<double>(pieces.size())
                          : pieces[k].t0 / length;
      pieces[k].t1 = none ? static_cast<double>(k + 1) / static_cast<double>(pieces.size())
                          : pieces[k].t1 / length;
    }
    return pieces;
  }

  void compare_block(std::size_t i) {
    const double tool_length = in_.reference.path().points[in_.map[i].segment].tool_length;
    const ReadBackMove& move = read_.moves[i];
    const bool by_tool = move.interpolation == MoveInterpolation::tool;
    const Pose start = by_tool ? start_pose(i, tool_length) : Pose::Identity();
    const JointVector& from = read_.moves[i - 1].to;
    const BentMove joints{from, move.to, move.bend, move.arc};
    // In the part: two unit directions, each by as much.
    const double spread = by_tool ? 0.0 : std::sqrt(2.0) * arc_spread(joints);
    auto own = by_tool ? tool_motion_bound(start, move.tool, in_.turn, in_.chain.tool_axis)
                       : joint_motion_bound(joints);
    if (!by_tool) own.tip += tool_length * own.axis;
    const double allowance = by_tool ? turn_allowance(start, move.tool, in_.turn) : 0.0;
    for (const Piece& piece : pieces_of(in_.map[i])) {
      const double span = piece.to - piece.from;
      const double part = piece.t1 - piece.t0;
      const auto input = in_.reference.second_derivative_bound(piece.segment);
      const double tip_bend = part * part * own.tip + span * span * input.tip;
      const double axis_bend = part * part * own.axis + span * span * input.axis;
      const double most = joints.is_straight() ? kMostSteps : kMostBentSteps;
      const int steps = std::max(steps_for(tip_bend, axis_bend, most), orientation_steps(piece));
      if (orientation_) orientation_->begin();
      const double h2 = 1.0 / (8.0 * steps * steps);
      for (int k = 0; k <= steps; ++k) {
        const double share = static_cast<double>(k) / steps;
        const double t = piece.t0 + share * part;
        const Pose pose = by_tool ? tool_motion(start, move.tool, t, in_.turn, in_.chain.tool_axis)
                                  : tip_pose(in_.chain, joints_at(joints, t), tool_length);
        const double s = piece.from + share * span;
        compare_pose_at(i, pose, {piece.segment, s},
                        {h2 * tip_bend + spread, h2 * axis_bend + allowance});
      }
    }
  }

  SecondDerivativeBound joint_motion_bound(const BentMove& joints) const {
    if (joints.is_straight()) return second_derivative_bound(in_.chain, joints.from, joints.to);
    const BendBounds bounds = bend_bounds(joints);
    return bent_motion_bound(
        in_.chain, {joints_at(joints, 0.5), rates_at(joints, 0.5), bounds.rate, bounds.second});
  }

  int orientation_steps(const Piece& piece) const {
    if (!orientation_ || !orientation_->covers(piece.segment)) return 1;
    return orientation_->least_steps(in_.reference.length(piece.segment) * (piece.to - piece.from));
  }

  /// What may be added between samples: of the tip (mm) and of the axis (chord).
  struct Allowance {
    double tip = 0.0;
    double axis = 0.0;
  };

  void compare_pose_at(std::size_t i, const Pose& pose, const PathPlace& place,
                       const Allowance& allowance) {
    const CutterLocation wanted = in_.reference.at(place.segment, place.s);
    const Vec3 axis = pose.linear() * in_.chain.tool_axis;
    const std::uint32_t line = in_.reference.path().points[place.segment].line;
    const double roundings_tip = in_.rounding.empty() ? 0.0 : in_.rounding[i].tip;
    const double roundings_axis = in_.rounding.empty() ? 0.0 : in_.rounding[i].rotation;
    const Vec3 off = pose.translation() - wanted.tip;
    tip_.see(off.norm() + allowance.tip + roundings_tip, read_.moves[i].line, times_[i], line);
    standoff_.see(std::abs(off.dot(axis)) + allowance.tip + roundings_tip, read_.moves[i].line,
                  times_[i], line);
    const double rest = allowance.axis + roundings_axis;
    if (orientation_ && orientation_->covers(place.segment))
      orientation_->see({place, axis, rest, wanted_beam(i), line, read_.moves[i].line, times_[i]});
    if (!orientation_ || !orientation_->frees(place.segment))
      axis_.see(degrees_from_radians(
                    2.0 * std::asin(std::min(1.0, 0.5 * ((axis - wanted.axis).norm() + rest)))),
                read_.moves[i].line, times_[i], line);
    if (!in_.whole_rotation) return;
    const Mat3 tool = pose.linear() * *in_.whole_rotation;
    const double angle =
        Eigen::Quaterniond(tool).angularDistance(in_.reference.rotation_at(place.segment, place.s));
    rotation_.see(degrees_from_radians(angle + allowance.axis + roundings_axis),
                  read_.moves[i].line, times_[i], line);
  }

  // Where the tool stands before a tool move.
  Pose start_pose(std::size_t i, double tool_length) const {
    const ReadBackMove& before = read_.moves[i - 1];
    return before.interpolation == MoveInterpolation::tool
               ? before.tool
               : tip_pose(in_.chain, before.to, tool_length);
  }

  bool wanted_beam(std::size_t i) const {
    return in_.reference.path().points[in_.map[i].segment].beam;
  }

  double tip_length(std::size_t i) const {
    const LineMapEntry& e = in_.map[i];
    double length = 0.0;
    for (std::uint32_t k = e.from_segment; k <= e.segment; ++k)
      length += in_.reference.length(k) *
                ((k == e.segment ? e.to_share : 1.0) - (k == e.from_segment ? e.from_share : 0.0));
    return length;
  }

  bool is_path(std::size_t i) const {
    return i < read_.moves.size() && in_.map[i].role == MoveRole::path;
  }

  // Every command that changes the beam takes effect between the command and its latency later, at
  // the planned speed; a stretch on which the beam is not as the input has it is its lead.
  void compare_beam() {
    bool beam = false;
    std::size_t event = 0;
    for (std::size_t i = 0; i < read_.moves.size(); ++i) {
      for (; event < read_.events.size() && read_.events[event].before <= i; ++event) {
        const ReadBackEvent& e = read_.events[event];
        if (e.beam != beam) beam_command(event, i);
        beam = e.beam;
      }
      if (!is_path(i) || read_.moves[i].beam == wanted_beam(i)) continue;
      double length = 0.0;
      const std::size_t begin = i;
      const bool on = read_.moves[i].beam;
      for (; is_path(i) && read_.moves[i].beam == on && wanted_beam(i) != on; ++i)
        length += tip_length(i);
      --i;
      // A lead ends where the input changes the beam, or with the run.
      const bool is_lead = is_path(i + 1) ? wanted_beam(i + 1) == on : !on;
      if (is_lead && length <= machine_.tolerance.event) continue;
      wrong_beam_ += static_cast<double>(i - begin + 1);
      if (wrong_beam_line_ == 0) wrong_beam_line_ = read_.moves[begin].line;
    }
  }

  double latency_of(const std::string& event) const {
    for (const auto& row : machine_.process.events)
      if (row.event == event) return row.latency;
    return 0.0;
  }

  void beam_command(std::size_t event, std::size_t i) {
    const ReadBackEvent& e = read_.events[event];
    double lead = 0.0;
    for (std::size_t k = i; is_path(k) && read_.moves[k].beam != wanted_beam(k); ++k)
      lead += tip_length(k);
    double left = latency_of(e.name);
    // The tool stands still meanwhile.
    for (std::size_t k = event + 1; k < read_.events.size() && read_.events[k].before == i; ++k)
      left -= read_.events[k].seconds;
    double way = 0.0;
    for (std::size_t k = i; is_path(k) && left > 0.0; ++k) {
      const double time = read_.moves[k].duration;
      way += tip_length(k) * (time > left ? left / time : 1.0);
      left -= time;
    }
    event_.see(std::max(lead, std::abs(way - lead)), e.line, i < times_.size() ? times_[i] : 0.0);
  }

  // So many that the allowance between samples is at most a fiftieth of the tolerance.
  int steps_for(double tip_bend, double axis_bend, double most) const {
    const double share = std::max(tip_bend / (0.02 * 8.0 * machine_.tolerance.tip),
                                  axis_bend / (0.02 * 8.0 * machine_.tolerance.axis));
    return static_cast<int>(std::clamp(std::ceil(std::sqrt(share)), 2.0, most));
  }

  void compare_joints(std::size_t i) {
    const MachineMove& planned = in_.planned.moves[i];
    if (planned.interpolation == MoveInterpolation::tool) compare_pose(i, planned);
    const JointArc &arc = planned.arc, &got = read_.moves[i].arc;
    if (arc.turn != got.turn || arc.first != got.first || arc.second != got.second)
      return broken(read_.moves[i].line, "an arc is in another plane or sense than planned");
    for (int j = 0; j < machine_.size(); ++j) {
      if (!(planned.joints >> j & 1U)) continue;
      double off = std::abs(planned.to[j] - read_.moves[i].to[j]);
      for (Eigen::Index k = 0; k < 4; ++k)
        off = std::max(off,
                       std::abs(bend_of(planned.bend, j, k) - bend_of(read_.moves[i].bend, j, k)));
      if (arc.turn != 0 && j == arc.first)
        off = std::max(off, std::abs(arc.centre_first - got.centre_first));
      if (arc.turn != 0 && j == arc.second)
        off = std::max(off, std::abs(arc.centre_second - got.centre_second));
      joints_[static_cast<std::size_t>(j)].see(
          off * display_scale(machine_.axes[static_cast<std::size_t>(j)]), read_.moves[i].line,
          times_[i], planned.input_line);
    }
  }

  static double bend_of(const JointBend& bend, int j, Eigen::Index k) {
    return bend.rows() > 0 ? bend(j, k) : 0.0;
  }

  void compare_pose(std::size_t i, const MachineMove& planned) {
    const Pose& got = read_.moves[i].tool;
    pose_tip_.see((got.translation() - planned.tool.translation()).norm(), read_.moves[i].line,
                  times_[i], planned.input_line);
    const Mat3 turn = got.linear() * planned.tool.linear().transpose();
    const double angle = in_.turn == ToolTurn::great_circle
                             ? angle_between(got.linear() * in_.chain.tool_axis,
                                             planned.tool.linear() * in_.chain.tool_axis)
                             : rotation_log(turn).norm();
    pose_turn_.see(degrees_from_radians(angle), read_.moves[i].line, times_[i], planned.input_line);
    has_poses_ = true;
  }

  void add_round_trip(Checks& checks) const {
    if (has_poses_) {
      const bool inch = machine_.dialect.units == "inch";
      const double half_digit = 0.5 * std::pow(10.0, -machine_.dialect.digits_length) *
                                (inch ? kMillimetresPerInch : 1.0);
      // Frames that the program states are printed too: as much again, and what they turn.
      checks.push_back(pose_tip_.check("round_trip.tip", 4.0 * half_digit, "mm"));
      checks.push_back(pose_turn_.check("round_trip.rotation", kPrintedRotation, "deg"));
    }
    for (int j = 0; j < machine_.size(); ++j) {
      const auto& axis = machine_.axes[static_cast<std::size_t>(j)];
      const bool inch = machine_.dialect.units == "inch";
      const int digits =
          is_rotary(axis) ? machine_.dialect.digits_angle : machine_.dialect.digits_length;
      const double unit = is_rotary(axis) || !inch ? 1.0 : kMillimetresPerInch;
      const double half_digit = 0.5 * std::pow(10.0, -digits) * unit;
      checks.push_back(joints_[static_cast<std::size_t>(j)].check(
          "round_trip." + axis.name, half_digit * (1.0 + 1e-4), unit_of(axis)));
    }
  }

  bool over_plane(std::size_t i, int retract) const {
    const auto& joint = machine_.axes[static_cast<std::size_t>(retract)].joint;
    const double q = read_.moves[i].to[retract];
    const double half_digit = 0.5 * std::pow(10.0, -machine_.dialect.digits_length) *
                              (machine_.dialect.units == "inch" ? kMillimetresPerInch : 1.0);
    return machine_.links.retract >= 0.5 * (joint.lower + joint.upper)
               ? q >= machine_.links.retract - half_digit
               : q <= machine_.links.retract + half_digit;
  }

  // A rapid of several axes on a machine whose axes do not arrive together: its way is not known.
  bool wanders(std::size_t i) const {
    if (machine_.links.rapid != RapidMotion::independent || !read_.moves[i].rapid) return false;
    int moving = 0;
    for (int j = 0; j < machine_.size(); ++j)
      if (read_.moves[i].to[j] != read_.moves[i - 1].to[j]) ++moving;
    return moving > 1;
  }

  // Links between two cuts that do not go over the retract plane, from the text: without the way
  // along the tool axis at either end they have to pass clear of the part's box.
  void check_low_links(Checks& checks) const {
    const int retract = machine_.axis_by_name(machine_.links.retract_axis);
    if (!in_.part || retract < 0) return;
    double least = INFINITY;
    std::uint32_t line = 0;
    for (std::size_t i = 0; i + 1 < read_.moves.size(); ++i) {
      if (in_.map[i].role != MoveRole::path || in_.map[i + 1].role != MoveRole::link) continue;
      std::size_t end = i + 1;
      bool plane = false;
      bool unknown = false;
      for (; end < read_.moves.size() && in_.map[end].role == MoveRole::link; ++end) {
        plane = over_plane(end, retract) || plane;
        unknown = wanders(end) || unknown;
      }
      if (plane || end == read_.moves.size()) continue;
      std::vector<LinkEnd> waypoints;
      for (std::size_t k = i + 1; k + 1 < end; ++k)
        waypoints.push_back({read_.moves[k].to, in_.planned.moves[k].tool_length});
      const double height = unknown ? -INFINITY : proven_height(in_.chain, waypoints, *in_.part);
      if (height >= least) continue;
      least = height;
      line = read_.moves[i + 1].line;
    }
    if (least == INFINITY) return;
    Check c;
    c.name = "link_clearance";
    c.unit = "mm";
    c.value = least;
    c.limit = 0.5 * machine_.links.clearance;
    c.ok = c.value >= c.limit;
    if (least == -INFINITY)
      c.note = "a rapid of several axes that need not arrive together passes the part low";
    c.output_line = line;
    checks.push_back(c);
  }

  void check_beam_in_links(Checks& checks) const {
    double count = 0.0;
    std::uint32_t line = 0;
    for (std::size_t i = 0; i < std::min(read_.moves.size(), in_.map.size()); ++i)
      if (in_.map[i].role == MoveRole::link && read_.moves[i].beam) {
        ++count;
        if (line == 0) line = read_.moves[i].line;
      }
    checks.push_back(rule("beam_off_in_link", count, "moves", line,
                          "the beam is on during a link between cuts"));
  }

  const ReadBack& read_;
  const MachineDefinition& machine_;
  const DeviationInput& in_;
  std::vector<double> times_;
  Worst tip_, axis_, standoff_, rotation_, event_, pose_tip_, pose_turn_;
  std::optional<OrientationCheck> orientation_;
  bool has_poses_ = false;
  std::array<Worst, kMaxJoints> joints_;
  double wrong_beam_ = 0.0;
  std::uint32_t wrong_beam_line_ = 0;
  std::string broken_;
  std::uint32_t broken_line_ = 0;
};

}  // namespace

Checks verify_deviation(const ReadBack& read, const MachineDefinition& machine,
                        const DeviationInput& input, const Progress& progress) {
  return DeviationCheck(read, machine, input).run(progress);
}

std::vector<CutterLocation> beam_locations(const ReadBack& read, const ScrewChain& chain) {
  std::vector<CutterLocation> locations;
  for (std::size_t i = 1; i < read.moves.size(); ++i) {
    if (!read.moves[i].beam) continue;
    const JointVector& from = read.moves[i - 1].to;
    for (const double t : {0.0, 0.5, 1.0})
      if (t > 0.0 || !read.moves[i - 1].beam)
        locations.push_back(forward_location(chain, from + t * (read.moves[i].to - from)));
  }
  return locations;
}

}  // namespace smoothpost
