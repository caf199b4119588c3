#include "machines/definition/machine.h"

#include <algorithm>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

template <class Property>
JointVector per_axis(const MachineDefinition& machine, Property property) {
  JointVector values(machine.size());
  for (int i = 0; i < machine.size(); ++i)
    values[i] = property(machine.axes[static_cast<std::size_t>(i)]);
  return values;
}

template <class Predicate>
int index_where(const std::vector<AxisDefinition>& axes, Predicate predicate) {
  const auto found = std::find_if(axes.begin(), axes.end(), predicate);
  return found != axes.end() ? static_cast<int>(found - axes.begin()) : -1;
}

}  // namespace

double PowerTable::at(double tip_speed) const {
  const auto above = std::upper_bound(speed.begin(), speed.end(), tip_speed);
  if (above == speed.begin()) return percent.front();
  if (above == speed.end()) return percent.back();
  const auto i = static_cast<std::size_t>(above - speed.begin());
  const double t = (tip_speed - speed[i - 1]) / (speed[i] - speed[i - 1]);
  return percent[i - 1] + t * (percent[i] - percent[i - 1]);
}

int MachineDefinition::axis_by_letter(char letter) const {
  return index_where(axes, [&](const AxisDefinition& axis) { return axis.letter == letter; });
}

int MachineDefinition::axis_by_name(const std::string& axis_name) const {
  return index_where(axes, [&](const AxisDefinition& axis) { return axis.name == axis_name; });
}

bool MachineDefinition::has_event(const std::string& event) const {
  return std::any_of(process.events.begin(), process.events.end(),
                     [&](const EventWords& words) { return words.event == event; });
}

ScrewChain chain_of(const MachineDefinition& machine, double tool_length) {
  ScrewChain chain;
  for (const auto& axis : machine.axes) chain.joints.push_back(axis.joint);
  chain.workpiece_home = machine.workpiece.frame;
  chain.tool_home = Pose::Identity();
  chain.tool_home.translation() = machine.tool.tip - tool_length * machine.tool.axis;
  chain.tool_axis = machine.tool.axis;
  return chain;
}

JointLimits limits_of(const MachineDefinition& machine) {
  require(machine.size() <= kMaxJoints, "a machine has at most kMaxJoints axes");
  using Axis = AxisDefinition;
  JointLimits limits;
  limits.lower = per_axis(machine, [](const Axis& axis) { return axis.joint.lower; });
  limits.upper = per_axis(machine, [](const Axis& axis) { return axis.joint.upper; });
  limits.velocity = per_axis(machine, [](const Axis& axis) { return axis.velocity; });
  limits.acceleration = per_axis(machine, [](const Axis& axis) { return axis.acceleration; });
  limits.jerk = per_axis(machine, [](const Axis& axis) { return axis.jerk; });
  return limits;
}

JointVector home_of(const MachineDefinition& machine) {
  require(machine.size() <= kMaxJoints, "a machine has at most kMaxJoints axes");
  return per_axis(machine, [](const AxisDefinition& axis) { return axis.joint.home; });
}

}  // namespace smoothpost
