#include "postproc/pipeline/machine_program.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "kernels/core/process.h"
#include "kernels/core/units.h"
#include "postproc/pipeline/event_latency.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kSlowestRotaryFeed = 30.0 * kRadiansPerDegree;  // rad/s, turning without a feed

// The retract position of the machine file, or further out where the path itself goes further
// out: a link over the plane never runs below the highest place of the path.
double retract_beyond(const MachineDefinition& machine, const std::vector<JointSample>& samples) {
  const int axis = machine.axis_by_name(machine.links.retract_axis);
  double position = machine.links.retract;
  if (axis < 0) return position;
  const auto& joint = machine.axes[static_cast<std::size_t>(axis)].joint;
  const bool upwards = position >= 0.5 * (joint.lower + joint.upper);
  for (const auto& sample : samples)
    position = upwards ? std::max(position, sample.q[axis]) : std::min(position, sample.q[axis]);
  return position;
}

class Builder {
 public:
  Builder(const ProgramInput& input, const std::vector<JointSample>& samples)
      : in_(input),
        path_(input.reference.path()),
        machine_(input.machine),
        samples_(samples),
        links_(input.machine, input.chain, retract_beyond(input.machine, samples), input.part) {
    for (int j = 0; j < machine_.size(); ++j) {
      all_ |= 1U << j;
      if (machine_.axes[static_cast<std::size_t>(j)].joint.redundant) redundant_ |= 1U << j;
    }
    out_.moves.reserve(samples.size() + 16);
  }

  BuiltProgram run() {
    std::size_t end = 0;  // sample behind the last run
    while (end < samples_.size()) {
      const std::size_t begin = end++;
      while (end < samples_.size() && !path_.points[samples_[end].segment].replanned) ++end;
      run_of(begin, end);
    }
    const Link home = links_.last(link_end(samples_.size() - 1));
    if (home.cramped) cramped_.push_back(path_.points.back().line);
    append(home.away, link_end(samples_.size() - 1).tool_length);
    emit_until(path_.points.size());
    compensate_latency(out_, machine_, in_.turn, &in_.reference);
    return {std::move(out_), std::move(cramped_)};
  }

 private:
  // Samples begin .. end-1; the first is where the run starts.
  void run_of(std::size_t begin, std::size_t end) {
    const std::size_t start_point = samples_[begin].segment;
    Link link;
    if (begin == 0) {
      link = links_.first(link_end(begin));
    } else {
      link = links_.between(link_end(begin - 1), link_end(begin), changes_tool(start_point));
      append(link.away, link_end(begin - 1).tool_length);
    }
    if (link.cramped) cramped_.push_back(path_.points[start_point].line);
    const double tool_length = link_end(begin).tool_length;
    if (end > begin + 1) label(samples_[begin + 1].segment);
    append(link.approach, tool_length, 0, link.retracted);
    const std::vector<PathEvent> restated = states_to_restate(start_point);
    emit_until(start_point);
    for (const PathEvent& event : restated) emit(event);
    append(link.approach, tool_length, link.retracted);
    emit_at(start_point, true);
    for (std::size_t i = begin + 1; i < end; ++i) {
      const PathPoint& point = path_.points[samples_[i].segment];
      follow(i, point);
      if (samples_[i].s == 1.0) emit_at(samples_[i].segment, i + 1 < end);
    }
  }

  LinkEnd link_end(std::size_t sample) const {
    return {samples_[sample].q, path_.points[samples_[sample].segment].tool_length};
  }

  void append(const std::vector<MachineMove>& moves, double tool_length, std::size_t from = 0,
              std::size_t to = static_cast<std::size_t>(-1)) {
    for (std::size_t i = from; i < std::min(to, moves.size()); ++i) push(moves[i], tool_length);
  }

  void push(MachineMove move, double tool_length) {
    move.tool_length = tool_length;
    if (in_.turn != ToolTurn::none) move.tool = tip_pose(in_.chain, move.to, tool_length);
    out_.moves.push_back(std::move(move));
  }

  void label(std::uint32_t segment) {
    const auto cut = std::find_if(in_.cuts.begin(), in_.cuts.end(), [segment](const Cut& c) {
      return c.first <= segment && segment <= c.last;
    });
    MachineAction action;
    action.kind = MachineAction::Kind::cut_label;
    action.before = out_.moves.size();
    action.input_line = path_.points[segment].line;
    if (cut != in_.cuts.end()) {
      action.text = "CUT " + std::to_string(cut->number) +
                    (cut->after_rewind ? " goes on after a rewind" : "");
    } else {
      action.text = "PATH";
    }
    action.text += " from input line " + std::to_string(action.input_line) + tool_text(segment);
    out_.actions.push_back(std::move(action));
  }

  std::string tool_text(std::uint32_t segment) const {
    const std::int32_t tool = path_.points[segment].tool;
    return tool > 0 ? " with tool " + std::to_string(tool) : "";
  }

  bool is_tool_change(const PathEvent& e) const {
    return e.kind == PathEvent::Kind::process && e.event.name == event_name::kToolChange;
  }

  bool changes_tool(std::size_t before_point) const {
    for (std::size_t i = next_event_; i < path_.events.size(); ++i) {
      if (path_.events[i].point > before_point) break;
      if (is_tool_change(path_.events[i])) return true;
    }
    return false;
  }

  // States that are on and that no event of this link sets anew, in the order they came on.
  std::vector<PathEvent> states_to_restate(std::size_t start_point) const {
    std::vector<std::string> set_here;
    const auto& events = path_.events;
    for (std::size_t i = next_event_; i < events.size() && events[i].point <= start_point; ++i)
      if (events[i].kind == PathEvent::Kind::process)
        set_here.push_back(state_group(events[i].event.name));
    std::vector<PathEvent> restated;
    for (const auto& [group, event] : states_)
      if (group != "tool" && std::find(set_here.begin(), set_here.end(), group) == set_here.end())
        restated.push_back(event);
    std::stable_sort(restated.begin(), restated.end(), [](const PathEvent& a, const PathEvent& b) {
      return a.point != b.point ? a.point < b.point : a.line < b.line;
    });
    return restated;
  }

  // Events before `point`, and those at it that stand before the run's start in the input.
  void emit_until(std::size_t point) {
    const auto& events = path_.events;
    while (next_event_ < events.size() &&
           (events[next_event_].point < point ||
            (events[next_event_].point == point && events[next_event_].before_start)))
      emit(events[next_event_++]);
  }

  // Events at `point`; at the end of a run those from a tool change on wait for the link.
  void emit_at(std::size_t point, bool inside) {
    const auto& events = path_.events;
    while (next_event_ < events.size() && events[next_event_].point <= point) {
      if (!inside && is_tool_change(events[next_event_])) return;
      emit(events[next_event_++]);
    }
  }

  void emit(const PathEvent& e) {
    MachineAction action;
    action.before = out_.moves.size();
    action.kind = e.kind == PathEvent::Kind::process ? MachineAction::Kind::event
                  : e.kind == PathEvent::Kind::dwell ? MachineAction::Kind::dwell
                                                     : MachineAction::Kind::comment;
    action.event = e.event;
    action.seconds = e.seconds;
    action.text = e.text;
    action.input_line = e.line;
    out_.actions.push_back(std::move(action));
    if (e.kind != PathEvent::Kind::process) return;
    const std::string group = state_group(e.event.name);
    if (group.empty()) return;
    if (ends_state(e.event.name))
      states_.erase(group);
    else
      states_.insert_or_assign(group, e);
  }

  void follow(std::size_t i, const PathPoint& point) {
    const JointSample& to = samples_[i];
    MachineMove move;
    move.to = to.q;
    const bool by_tool = in_.turn != ToolTurn::none && !to.by_joints;
    move.joints = by_tool ? redundant_ : all_;
    if (by_tool) move.interpolation = MoveInterpolation::tool;
    move.rapid = point.kind == MotionKind::rapid && machine_.links.rapid == RapidMotion::linear;
    move.role = MoveRole::path;
    move.input_line = point.line;
    move.segment = to.segment;
    const PathPlace from = start_place(samples_[i - 1]);
    move.from_segment = from.segment;
    move.from_share = from.s;
    move.to_share = to.s;
    move.stretch = to.stretch;
    move.stretch_time = to.stretch_time;
    if (to.time > 0.0)
      move.duration = to.time;
    else if (!move.rapid)
      move.duration = block_time(by_tool ? tool_travel(samples_[i - 1].q, move, point.tool_length)
                                         : JointVector((move.to - samples_[i - 1].q).cwiseAbs()),
                                 move, point);
    push(std::move(move), point.tool_length);
  }

  // The end of a segment is the start of the next.
  static PathPlace start_place(const JointSample& sample) {
    if (sample.s == 1.0) return {sample.segment + 1, 0.0};
    return {sample.segment, sample.s};
  }

  // Of the input's way that a move takes the place of, s.
  double programmed_time(const MachineMove& move) const {
    double time = 0.0;
    for (std::uint32_t k = move.from_segment; k <= move.segment; ++k)
      time += path_.points[k].duration * ((k == move.segment ? move.to_share : 1.0) -
                                          (k == move.from_segment ? move.from_share : 0.0));
    return time;
  }

  // The fastest that each joint goes on a tool move, as the way that it would go at that rate.
  JointVector tool_travel(const JointVector& from, const MachineMove& move,
                          double tool_length) const {
    constexpr int kSteps = 32;        // near a pole the joints turn unevenly
    constexpr double kBetween = 1.1;  // between the steps it may be a little faster
    const Pose start = tip_pose(in_.chain, from, tool_length);
    const Pose end = tip_pose(in_.chain, move.to, tool_length);
    JointVector travel = (move.to - from).cwiseAbs();
    JointVector last = from;
    for (int k = 1; k <= kSteps; ++k) {
      const Pose at =
          tool_motion(start, end, static_cast<double>(k) / kSteps, in_.turn, in_.chain.tool_axis);
      const auto q = in_.inverse->nearest(holder_pose(in_.chain, at, tool_length), last);
      if (!q) return travel;
      travel = travel.cwiseMax(kSteps * kBetween * (*q - last).cwiseAbs());
      last = *q;
    }
    return travel;
  }

  // `travel`: of each joint, absolute.
  double block_time(const JointVector& travel, const MachineMove& move,
                    const PathPoint& point) const {
    double time = programmed_time(move);
    for (int j = 0; j < machine_.size(); ++j) {
      const auto& axis = machine_.axes[static_cast<std::size_t>(j)];
      const double step = travel[j];
      const double share = machine_.tolerance.limit_share *
                           (axis.source == LimitSource::assumed ? kAssumedShare : 1.0);
      time = std::max(time, step / (axis.velocity * share));
      // A feed that turns the tool in place and says no time: a moderate rate.
      if (point.duration == 0.0 && point.kind == MotionKind::feed &&
          axis.joint.kind == JointKind::rotary)
        time = std::max(time, step / kSlowestRotaryFeed);
    }
    return std::max(time, machine_.cycle.min_block);
  }

  const ProgramInput& in_;
  const ToolPath& path_;
  const MachineDefinition& machine_;
  const std::vector<JointSample>& samples_;
  LinkPlanner links_;
  JointMask all_ = 0;
  JointMask redundant_ = 0;
  std::size_t next_event_ = 0;
  std::map<std::string, PathEvent> states_;
  std::vector<std::uint32_t> cramped_;
  MachineProgram out_;
};

}  // namespace

BuiltProgram build_program(const ProgramInput& input, const std::vector<JointSample>& samples) {
  return Builder(input, samples).run();
}

}  // namespace smoothpost
