#include "machines/dialects/krl_line.h"

namespace smoothpost::krl {

namespace {

constexpr double kLeastLength = 0.01;  // mm, of a LIN with events on the way
constexpr double kLargestTurn = 3.0;   // rad
constexpr double kOffWay = 1e-6;       // mm
constexpr double kOffTurn = 1e-8;      // rad, mm of external axes

bool runs(const MachineMove& move) {
  return move.interpolation == MoveInterpolation::tool && move.role == MoveRole::path &&
         !move.rapid && !move.spline && move.duration > 0.0;
}

// An event that was put early by its latency.
bool is_early(const MachineDefinition& machine, const MachineAction& action) {
  if (action.kind != MachineAction::Kind::event) return false;
  for (const auto& row : machine.process.events)
    if (row.event == action.event.name)
      return row.on_the_fly && row.dwell == 0.0 && row.latency > 0.0;
  return false;
}

double time_of(const MachineProgram& program, std::size_t first, std::size_t last) {
  double time = 0.0;
  for (std::size_t i = first; i <= last; ++i) time += program.moves[i].duration;
  return time;
}

bool is_straight(const MachineProgram& program, const LineStart& start, std::size_t last) {
  const MachineMove& end = program.moves[last];
  if ((end.tool.translation() - start.pose.translation()).norm() < kLeastLength) return false;
  if (rotation_log(end.tool.linear() * start.pose.linear().transpose()).norm() > kLargestTurn)
    return false;
  const double whole = time_of(program, start.move, last);
  double time = 0.0;
  for (std::size_t i = start.move; i < last; ++i) {
    const MachineMove& move = program.moves[i];
    time += move.duration;
    const double share = time / whole;
    const Pose at = line_pose(start.pose, end.tool, share);
    if ((at.translation() - move.tool.translation()).norm() > kOffWay) return false;
    if (rotation_log(at.linear().transpose() * move.tool.linear()).norm() > kOffTurn) return false;
    for (Eigen::Index j = 0; j < end.to.size(); ++j) {
      const double linear = start.joints[j] + share * (end.to[j] - start.joints[j]);
      if ((end.joints >> j & 1U) && std::abs(linear - move.to[j]) > kOffTurn) return false;
    }
  }
  return true;
}

}  // namespace

Pose line_pose(const Pose& from, const Pose& to, double t) {
  Pose pose = from;
  pose.translation() = from.translation() + t * (to.translation() - from.translation());
  const Vec3 turn = rotation_log(to.linear() * from.linear().transpose());
  pose.linear() = rotation_exp(t * turn) * from.linear();
  return pose;
}

JoinedLine joined_line(const MachineDefinition& machine, const MachineProgram& program,
                       const LineStart& start) {
  JoinedLine line;
  line.last = start.move;
  std::size_t action = start.action;
  while (line.last + 1 < program.moves.size()) {
    const MachineMove& here = program.moves[line.last];
    const std::size_t next = line.last + 1;
    if (!runs(here) || !runs(program.moves[next]) ||
        here.tool_length != program.moves[next].tool_length ||
        here.joints != program.moves[next].joints)
      break;
    std::vector<LineEvent> events;
    bool possible = true;
    for (; action < program.actions.size() && program.actions[action].before == next; ++action) {
      if (program.actions[action].kind == MachineAction::Kind::comment) continue;
      possible = possible && is_early(machine, program.actions[action]);
      events.push_back({action, time_of(program, start.move, line.last)});
    }
    if (!possible || events.empty() ||
        start.triggers + line.events.size() + events.size() > kMostTriggers ||
        !is_straight(program, start, next))
      break;
    line.events.insert(line.events.end(), events.begin(), events.end());
    line.last = next;
  }
  const double whole = time_of(program, start.move, line.last);
  for (LineEvent& event : line.events) event.share /= whole;
  return line;
}

}  // namespace smoothpost::krl
