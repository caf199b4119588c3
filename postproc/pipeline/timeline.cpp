#include "postproc/pipeline/timeline.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/process.h"
#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kNearEnd = 0.1;  // of a cycle

constexpr int kMillimetreDecimals = 7, kDegreeDecimals = 8, kMostDecimals = 9;
constexpr double kRoundingShare = 0.05;  // of the jerk limit
constexpr double kSameTime = 1e-9;       // s
constexpr double kSameCycle = 1e-6;      // of a cycle

double whole_cycles(double duration, double cycle) {
  return cycle * std::ceil(duration / cycle - kSameCycle);
}

class TimelineBuilder {
 public:
  explicit TimelineBuilder(const TimelineInput& input)
      : in_(input), limits_(feed_limits(input.machine)) {
    out_.laws = input.schedule.stretches;
    out_.cycle = input.machine.cycle.time;
    for (ScheduledStretch& law : out_.laws) onto_cycles(law);
  }

  Timeline run() {
    const JointMask all = (1U << in_.machine.size()) - 1U;
    JointMask known = 0;
    std::size_t action = 0;
    for (std::size_t i = 0; i < in_.program.moves.size(); ++i) {
      const MachineMove& move = in_.program.moves[i];
      for (; action < in_.program.actions.size() && in_.program.actions[action].before <= i;
           ++action)
        act(in_.program.actions[action], known == all);
      const JointVector from = at_;
      if (known == 0) at_ = move.to;
      for (int j = 0; j < in_.machine.size(); ++j)
        if (move.interpolation == MoveInterpolation::tool || (move.joints >> j & 1U))
          at_[j] = move.to[j];
      const bool started = known == all;
      known |= move.interpolation == MoveInterpolation::tool ? all : move.joints;
      if (started) add(move, from, i);
    }
    for (; action < in_.program.actions.size(); ++action)
      act(in_.program.actions[action], known == all);
    return std::move(out_);
  }

 private:
  void act(const MachineAction& action, bool started) {
    double seconds = action.kind == MachineAction::Kind::dwell ? action.seconds : 0.0;
    if (action.kind == MachineAction::Kind::event) {
      if (action.event.name == event_name::kBeamOn || action.event.name == event_name::kPierce)
        beam_ = true;
      if (action.event.name == event_name::kBeamOff) beam_ = false;
      for (const EventWords& row : in_.machine.process.events)
        if (row.event == action.event.name) seconds = row.dwell;
    }
    if (!started || !(seconds > 0.0)) return;
    TimelineItem item;
    item.duration = seconds;
    item.stand = at_;
    item.line = action.input_line;
    push(std::move(item));
  }

  // Slower by less than a cycle, so that the law ends on one.
  void onto_cycles(ScheduledStretch& law) const {
    const double duration = law.duration();
    if (duration > 0.0) law.slowing *= whole_cycles(duration, out_.cycle) / duration;
  }

  void push(TimelineItem item) {
    if (item.law < 0) item.duration = whole_cycles(item.duration, out_.cycle);
    item.start = out_.duration();
    item.beam = beam_;
    out_.items.push_back(std::move(item));
  }

  void add(const MachineMove& move, const JointVector& from, std::size_t index) {
    TimelineItem item;
    item.move = static_cast<std::int64_t>(index);
    item.line = move.input_line;
    if (move.role == MoveRole::path) item.segment = move.segment;
    if (move.stretch >= 0) {
      const auto k = static_cast<std::size_t>(move.stretch);
      const double slower = out_.laws[k].slowing / in_.schedule.stretches[k].slowing;
      item.law = move.stretch;
      item.from = move.stretch == stretch_ ? reached_ : 0.0;
      // What the last move's time misses the law's end by would shift everything behind it.
      const double end = out_.laws[k].duration();
      const double reached = slower * move.stretch_time;
      reached_ = reached > end - kNearEnd * out_.cycle ? end : reached;
      item.duration = std::max(0.0, reached_ - item.from);
      stretch_ = move.stretch;
      return push(std::move(item));
    }
    ScheduledStretch law = straight(move, from);
    if (!(law.duration() > 0.0)) {
      item.stand = at_;
      item.duration = move.duration;
      if (item.duration > 0.0) push(std::move(item));
      return;
    }
    item.law = static_cast<std::int32_t>(out_.laws.size());
    onto_cycles(law);
    item.duration = law.duration();
    out_.laws.push_back(std::move(law));
    push(std::move(item));
  }

  // From rest to rest, straight in the joints or by the tool.
  ScheduledStretch straight(const MachineMove& move, const JointVector& from) const {
    ScheduledStretch law;
    JointStretch& joints = law.joints;
    const double way = (at_ - from).norm();
    if (!(way > 1e-9)) return law;
    const int n = in_.machine.size();
    const JointVector to = at_;
    const Pose start = tip_pose(in_.chain, from, move.tool_length);
    const bool by_tool = move.interpolation == MoveInterpolation::tool;
    const auto value = [&](double s) {
      const double t = s / way;
      PathValue v(n + 3);
      JointVector q = from + t * (to - from);
      if (by_tool) {
        const Pose tip = tool_motion(start, move.tool, t, in_.turn, in_.chain.tool_axis);
        q = in_.inverse.nearest(holder_pose(in_.chain, tip, move.tool_length), q).value_or(q);
      }
      v.head(n) = q;
      v.tail<3>() = tip_pose(in_.chain, q, move.tool_length).translation();
      return v;
    };
    joints.joints = n;
    if (!joints.path.append(value, 0.0, way, {})) return law;
    joints.breaks = {0.0, way};
    joints.sub_end = {static_cast<std::uint32_t>(joints.path.pieces())};
    joints.feed = {std::numeric_limits<double>::infinity()};
    joints.rate = {move.rapid || !(move.duration > 0.0) ? joints.feed[0] : way / move.duration};
    joints.line = {move.input_line};
    FeedPath path;
    path.breaks = joints.breaks;
    path.feed = joints.feed;
    path.rate = joints.rate;
    path.jet = [&joints](std::size_t piece, double s) { return joints.jet(piece, s); };
    law.profile = schedule_feed(path, limits_, {}, {}, {}, {}).profile;
    return law;
  }

  const TimelineInput& in_;
  FeedLimits limits_;
  JointVector at_;
  bool beam_ = false;
  std::int32_t stretch_ = -1;
  double reached_ = 0.0;  ///< time of stretch_
  Timeline out_;
};

void append_row(std::string& text, const MachineDefinition& machine, const JointVector& q) {
  for (int j = 0; j < machine.size(); ++j) {
    const AxisDefinition& axis = machine.axes[static_cast<std::size_t>(j)];
    text += ',';
    append_decimal(text, axis.joint.kind == JointKind::rotary ? degrees_from_radians(q[j]) : q[j],
                   stream_decimals(axis, machine.cycle.time));
  }
}

}  // namespace

ScheduledStretch::Motion Timeline::at(const TimelineItem& item, double time) const {
  if (item.law >= 0)
    return laws[static_cast<std::size_t>(item.law)].at(item.from + time - item.start);
  const JointVector none = JointVector::Zero(item.stand.size());
  return {item.stand, none, none, none};
}

std::size_t Timeline::item_at(double time, std::size_t from) const {
  while (from + 1 < items.size() && items[from + 1].start <= time + kSameTime) ++from;
  return from;
}

int stream_decimals(const AxisDefinition& axis, double cycle) {
  const bool rotary = axis.joint.kind == JointKind::rotary;
  const double limit = axis.jerk * (rotary ? kDegreesPerRadian : 1.0) * cycle * cycle * cycle;
  int decimals = rotary ? kDegreeDecimals : kMillimetreDecimals;
  while (decimals < kMostDecimals && 4.0 * std::pow(10.0, -decimals) > kRoundingShare * limit)
    ++decimals;
  return decimals;
}

Timeline timeline_of(const TimelineInput& input) { return TimelineBuilder(input).run(); }

std::string trajectory_csv(const Timeline& timeline, const MachineDefinition& machine,
                           const ScrewChain& chain, double tool_length) {
  std::string text = "t_s";
  for (const auto& axis : machine.axes)
    text += "," + axis.name + (axis.joint.kind == JointKind::rotary ? "_deg" : "_mm");
  text += ",x_mm,y_mm,z_mm,i,j,k,beam\n";
  if (timeline.items.empty()) return text;
  const auto cycles = static_cast<long long>(std::llround(timeline.duration() / timeline.cycle));
  std::size_t at = 0;
  for (long long k = 0; k <= cycles; ++k) {
    const double t = static_cast<double>(k) * timeline.cycle;
    at = timeline.item_at(t, at);
    const JointVector q = timeline.at(timeline.items[at], t).position;
    append_decimal(text, t, 6);
    append_row(text, machine, q);
    const CutterLocation holder = forward_location(chain, q);
    const Vec3 tip = holder.tip - tool_length * holder.axis;
    for (int i = 0; i < 3; ++i) append_decimal(text += ',', tip[i], 6);
    for (int i = 0; i < 3; ++i) append_decimal(text += ',', holder.axis[i], 9);
    // In force when the cycle behind the row ends.
    const double last = t + (1.0 - kSameCycle) * timeline.cycle - kSameTime;
    text += k < cycles && timeline.items[timeline.item_at(last, at)].beam ? ",1\n" : ",0\n";
  }
  return text;
}

}  // namespace smoothpost
