#include "machines/dialects/tool_words.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"

namespace smoothpost::gcode {

namespace {

constexpr std::string_view kTipLetters = "XYZ";

bool is_rotary(const MachineDefinition& machine, int j) {
  return machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
}

}  // namespace

MachineProgram along_machine_axes(const MachineProgram& program) {
  MachineProgram out = program;
  Pose turn = Pose::Identity();
  turn.linear() = program.part.linear();
  out.part.linear() = Mat3::Identity();
  for (auto& move : out.moves) move.tool = turn * move.tool;
  return out;
}

bool is_turned(const MachineProgram& program) {
  constexpr double kLeast = 1e-9;  // rad
  if (rotation_log(program.part.linear()).norm() < kLeast) return false;
  return std::any_of(program.moves.begin(), program.moves.end(), [](const MachineMove& m) {
    return m.interpolation == MoveInterpolation::tool;
  });
}

std::optional<int> tool_number(const MachineAction& action, int most) {
  if (action.kind != MachineAction::Kind::event || action.event.name != event_name::kToolChange)
    return std::nullopt;
  for (const auto& [name, value] : action.event.parameters) {
    const auto number = whole_number(value);
    if (name == "tool" && number && *number >= 1.0 && *number <= most &&
        *number == std::floor(*number))
      return static_cast<int>(*number);
  }
  return std::nullopt;
}

std::vector<ProgramTool> tools_of(const MachineProgram& program, int most) {
  std::vector<ProgramTool> tools;
  int number = 1;
  auto action = program.actions.begin();
  for (std::size_t i = 0; i < program.moves.size(); ++i) {
    for (; action != program.actions.end() && action->before <= i; ++action)
      number = tool_number(*action, most).value_or(number);
    if (program.moves[i].interpolation != MoveInterpolation::tool) continue;
    const bool known = std::any_of(tools.begin(), tools.end(), [number](const ProgramTool& tool) {
      return tool.number == number;
    });
    if (!known) tools.push_back({number, program.moves[i].tool_length});
  }
  return tools;
}

ToolWords::ToolWords(const MachineDefinition& machine, const MachineProgram& program,
                     AxisWords& words)
    : machine_(machine), words_(words), chain_(chain_of(machine)) {
  chain_.workpiece_home = program.part;
  inverse_ = Inverse::from(chain_);
  joints_ = JointVector::Zero(machine.size());
}

double ToolWords::printed_length(double mm) const {
  const double scale = words_.length_scale();
  return rounded_decimal(mm * scale, machine_.dialect.digits_length) / scale;
}

double ToolWords::printed_angle(double angle) const {
  return rounded_decimal(degrees_from_radians(angle), machine_.dialect.digits_angle);
}

void ToolWords::stand(const MachineMove& move) {
  const CutterLocation there = forward_location(chain_, move.to);
  tip_ = there.tip - move.tool_length * there.axis;
  axis_ = there.axis;
  joints_ = move.to;
}

std::string ToolWords::tip(const MachineMove& move, double& way) {
  std::string text;
  const Vec3 to = move.tool.translation();
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string letter(1, kTipLetters[k]);
    words_.put(text, letter, letter + words_.length(to[static_cast<Eigen::Index>(k)]));
  }
  const Vec3 printed = to.unaryExpr([this](double v) { return printed_length(v); });
  way = (printed - tip_).norm() * words_.length_scale();
  tip_ = printed;
  return text;
}

ToolWords::Printed ToolWords::positions(const MachineMove& move) {
  Printed out;
  out.text = tip(move, out.way);
  Pose holder = move.tool;
  holder.translation() += move.tool_length * (holder.linear() * machine_.tool.axis);
  const auto solved = inverse_ ? inverse_->nearest(holder, move.to) : std::nullopt;
  const JointVector to = solved.value_or(move.to);
  double square = 0.0;
  for (int j = 0; j < machine_.size(); ++j) {
    if (!is_rotary(machine_, j)) continue;
    const std::string letter(1, machine_.axes[static_cast<std::size_t>(j)].letter);
    words_.put(out.text, letter, words_.joint(j, to[j]));
    square += std::pow(printed_angle(to[j]) - printed_angle(joints_[j]), 2);
  }
  if (!(out.way > 0.0)) out.way = std::sqrt(square);
  if (out.text.empty()) out.text = " X" + words_.length(move.tool.translation().x());
  joints_ = to;
  axis_ = move.tool.linear() * machine_.tool.axis;
  return out;
}

ToolWords::Printed ToolWords::vector(const MachineMove& move,
                                     const std::array<const char*, 3>& names, int decimals) {
  Printed out;
  out.text = tip(move, out.way);
  const Vec3 axis = (move.tool.linear() * machine_.tool.axis).normalized();
  std::string words;
  for (std::size_t k = 0; k < 3; ++k) {
    words += (k > 0 ? " " : "");
    words += names[k] + words_.number(axis[static_cast<Eigen::Index>(k)], decimals);
  }
  words_.put(out.text, names[0], words);
  if (!(out.way > 0.0)) out.way = degrees_from_radians(angle_between(axis_, axis));
  if (out.text.empty()) out.text = " X" + words_.length(move.tool.translation().x());
  joints_ = move.to;
  axis_ = axis;
  return out;
}

ToolFollowing::ToolFollowing(const MachineDefinition& machine)
    : machine_(machine), chain_(chain_of(machine)) {
  chain_.workpiece_home = Pose::Identity();
  joints_ = last_joints_ = JointVector::Zero(machine.size());
}

void ToolFollowing::begin(bool by_vector) {
  by_vector_ = by_vector;
  tip_named_ = 0;
  rotary_named_ = 0;
  vector_named_ = false;
}

bool ToolFollowing::name_vector(const Vec3& vector) {
  constexpr double kShortest = 0.5;
  if (vector.norm() < kShortest) return false;
  vector_ = vector.normalized();
  vector_named_ = true;
  return true;
}

bool ToolFollowing::is_complete() const {
  if (tip_named_ != 7U) return false;
  if (by_vector_) return vector_named_;
  for (int j = 0; j < machine_.size(); ++j)
    if (is_rotary(machine_, j) && !(rotary_named_ >> j & 1U)) return false;
  return true;
}

Vec3 ToolFollowing::axis() const {
  return by_vector_ ? vector_ : forward_location(chain_, joints_).axis;
}

Pose ToolFollowing::pose() const {
  Pose pose = Pose::Identity();
  pose.translation() = tip_;
  pose.linear() =
      by_vector_
          ? Eigen::Quaterniond::FromTwoVectors(machine_.tool.axis, vector_).toRotationMatrix()
          : Mat3(forward(chain_, joints_).linear());
  return pose;
}

void ToolFollowing::stand(const JointVector& joints, const std::optional<Vec3>& tip) {
  joints_ = last_joints_ = joints;
  last_tip_ = tip;
  last_axis_ = forward_location(chain_, joints).axis;
}

std::optional<ToolFollowing::Way> ToolFollowing::arrive() {
  constexpr double kNoLength = 1e-9;  // mm
  std::optional<Way> way;
  if (last_tip_) {
    way = Way{};
    const double length = (tip_ - *last_tip_).norm();
    if (length >= kNoLength)
      way->mm = length;
    else
      way->degrees = degrees_from_radians(by_vector_ ? angle_between(last_axis_, axis())
                                                     : (joints_ - last_joints_).norm());
  }
  last_tip_ = tip_;
  last_axis_ = axis();
  last_joints_ = joints_;
  return way;
}

}  // namespace smoothpost::gcode
