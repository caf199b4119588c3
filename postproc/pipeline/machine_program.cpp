#include "postproc/pipeline/machine_program.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr double kSlowestRotaryFeed = 30.0 * kRadiansPerDegree;  // rad/s, turning without a feed

class Builder {
 public:
  Builder(const InterpretedInput& input, const MachineDefinition& machine, const ScrewChain& chain,
          const std::vector<JointSample>& samples)
      : input_(input), machine_(machine), chain_(chain), samples_(samples) {
    retract_ = machine.axis_by_name(machine.links.retract_axis);
    if (retract_ >= 0) retract_position_ = retract_beyond_path();
    for (int j = 0; j < machine.size(); ++j) {
      const bool rotary = machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
      (rotary ? rotary_ : linear_) |= 1U << j;
    }
    out_.moves.reserve(samples.size() + 16);
  }

  MachineProgram run() {
    if (retract_ >= 0) add_link(1U << retract_, with_retract(samples_.front().q), true);
    emit_events(0, true);
    arrive(samples_.front().q);
    emit_events(0, false);
    for (std::size_t i = 1; i < samples_.size(); ++i) {
      const JointSample& sample = samples_[i];
      const PathPoint& point = input_.path.points[sample.segment];
      if (point.replanned) {
        depart(samples_[i - 1].q);
        arrive(sample.q);
      } else {
        follow(i, point);
      }
      if (sample.s == 1.0) emit_events(sample.segment, false);
    }
    depart(samples_.back().q);
    const JointVector home = home_of(machine_);
    add_link(rotary_, home, false);
    add_link(linear_ & ~retract_bit(), home, false);
    return std::move(out_);
  }

 private:
  JointMask retract_bit() const { return retract_ < 0 ? 0U : 1U << retract_; }

  // The retract position of the machine file, or further out where the path itself goes further
  // out: a link never runs below the highest place of the path.
  double retract_beyond_path() const {
    const auto& joint = machine_.axes[static_cast<std::size_t>(retract_)].joint;
    const bool upwards = machine_.links.retract >= 0.5 * (joint.lower + joint.upper);
    double position = machine_.links.retract;
    for (const auto& sample : samples_)
      position =
          upwards ? std::max(position, sample.q[retract_]) : std::min(position, sample.q[retract_]);
    return position;
  }

  JointVector with_retract(JointVector q) const {
    if (retract_ >= 0) q[retract_] = retract_position_;
    return q;
  }

  void emit_events(std::size_t point, bool before_start) {
    const auto& events = input_.path.events;
    while (next_event_ < events.size() && events[next_event_].point == point &&
           (!before_start || events[next_event_].before_start)) {
      const PathEvent& e = events[next_event_++];
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
    }
  }

  void add_link(JointMask joints, const JointVector& to, bool machine_coordinates) {
    MachineMove move;
    move.to = to;
    move.joints = joints;
    move.rapid = true;
    move.role = MoveRole::link;
    move.machine_coordinates = machine_coordinates;
    if (joints != 0) out_.moves.push_back(std::move(move));
  }

  // The joints with the tool `clearance` further out along its axis: the rotaries stay, the linears
  // move.
  JointVector clear_of(const JointVector& q) const {
    const Jacobian j = jacobian(chain_, q);
    const Vec3 away = machine_.links.clearance * forward_location(chain_, q).axis;
    Eigen::Matrix3d d;
    std::array<int, 3> column{};
    int n = 0;
    for (int i = 0; i < chain_.size() && n < 3; ++i) {
      const auto& joint = chain_.joints[static_cast<std::size_t>(i)];
      if (joint.kind != JointKind::linear || joint.redundant) continue;
      d.col(n) = j.col(i).tail<3>();
      column[static_cast<std::size_t>(n++)] = i;
    }
    JointVector clear = q;
    if (n < 3) return clear;
    const Vec3 step = d.fullPivLu().solve(away);
    for (int i = 0; i < 3; ++i) clear[column[static_cast<std::size_t>(i)]] += step[i];
    for (const int i : column) {
      const auto& joint = chain_.joints[static_cast<std::size_t>(i)];
      if (clear[i] < joint.lower || clear[i] > joint.upper)
        return q;  // no room: the retract axis alone
    }
    return clear;
  }

  // From the retract position to q: rotaries, the other linears, down the retract axis, along the
  // tool.
  void arrive(const JointVector& q) {
    const JointVector above = clear_of(q);
    add_link(rotary_, above, false);
    add_link(linear_ & ~retract_bit(), above, false);
    add_link(retract_bit(), above, false);
    if ((above - q).norm() > 0.0) add_link(linear_, q, false);
  }

  void depart(const JointVector& q) {
    const JointVector above = clear_of(q);
    if ((above - q).norm() > 0.0) add_link(linear_, above, false);
    if (retract_ >= 0) add_link(retract_bit(), with_retract(above), false);
  }

  void follow(std::size_t i, const PathPoint& point) {
    const JointSample& to = samples_[i];
    MachineMove move;
    move.to = to.q;
    move.joints = rotary_ | linear_;
    move.rapid = point.kind == MotionKind::rapid && machine_.links.rapid == RapidMotion::linear;
    move.input_line = point.line;
    move.segment = to.segment;
    move.from_share = samples_[i - 1].segment == to.segment ? samples_[i - 1].s : 0.0;
    move.to_share = to.s;
    if (!move.rapid) move.duration = block_time(samples_[i - 1].q, move, point);
    out_.moves.push_back(std::move(move));
  }

  double block_time(const JointVector& from, const MachineMove& move,
                    const PathPoint& point) const {
    double time = point.duration * (move.to_share - move.from_share);
    for (int j = 0; j < machine_.size(); ++j) {
      const auto& axis = machine_.axes[static_cast<std::size_t>(j)];
      const double step = std::abs(move.to[j] - from[j]);
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

  const InterpretedInput& input_;
  const MachineDefinition& machine_;
  const ScrewChain& chain_;
  const std::vector<JointSample>& samples_;
  int retract_ = -1;
  double retract_position_ = 0.0;
  JointMask rotary_ = 0;
  JointMask linear_ = 0;
  std::size_t next_event_ = 0;
  MachineProgram out_;
};

}  // namespace

MachineProgram build_program(const InterpretedInput& input, const MachineDefinition& machine,
                             const ScrewChain& chain, const std::vector<JointSample>& samples) {
  return Builder(input, machine, chain, samples).run();
}

}  // namespace smoothpost
