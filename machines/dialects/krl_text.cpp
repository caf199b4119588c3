#include "machines/dialects/krl_text.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/zyx_angles.h"

namespace smoothpost::krl {

std::string decimal(double value, int decimals) {
  std::string out;
  append_decimal(out, value, decimals);
  return out;
}

int decimals_of(double value) {
  if (value <= 0.0) return 3;
  return std::clamp(5 - static_cast<int>(std::floor(std::log10(value))), 3, 9);
}

double blend_distance(double distance) {
  constexpr std::array<double, 5> kSteps = {6.3, 4.0, 2.5, 1.6, 1.0};
  constexpr double kRoundOff = 1.0 + 1e-12;
  for (int exponent = 3; exponent >= -3; --exponent)
    for (const double step : kSteps) {
      const double value =
          exponent >= 0 ? step * std::pow(10.0, exponent) : step / std::pow(10.0, -exponent);
      if (value <= distance * kRoundOff) return value;
    }
  return 0.0;
}

bool is_arm_axis(const std::string& name) {
  return name.size() == 2 && name[0] == 'A' && name[1] >= '1' && name[1] <= '6';
}

bool is_external_axis(const std::string& name) {
  return name.size() == 2 && name[0] == 'E' && name[1] >= '1' && name[1] <= '6';
}

ProgramText::ProgramText(const MachineDefinition& machine)
    : machine_(machine), angle_digits_(std::max(5, machine.dialect.digits_angle)) {}

void ProgramText::line(std::string_view line) {
  text_ += line;
  text_ += '\n';
  ++lines_;
}

void ProgramText::set(const char* variable, const std::string& value) {
  std::string& printed = printed_[variable];
  if (value == printed) return;
  line(std::string(variable) + "=" + value);
  printed = value;
}

void ProgramText::set_orientation_speed(double value) {
  const std::string text = decimal(value, decimals_of(value));
  set("$VEL.ORI1", text);
  set("$VEL.ORI2", text);
}

void ProgramText::set_joint_percent(double percent) {
  const std::string text = decimal(percent, 0);
  std::string& printed = printed_["#VEL_PTP"];
  if (text == printed) return;
  line("BAS(#VEL_PTP," + text + ")");
  printed = text;
}

std::string ProgramText::last(const char* variable) const {
  const auto found = printed_.find(variable);
  return found == printed_.end() ? std::string() : found->second;
}

std::string ProgramText::pose(const Pose& pose) {
  std::string text;
  const std::array<const char*, 3> names = {"X ", ",Y ", ",Z "};
  for (std::size_t i = 0; i < 3; ++i) {
    text += names[i];
    append_decimal(text, pose.translation()[static_cast<Eigen::Index>(i)],
                   machine_.dialect.digits_length);
  }
  const ZyxAngles angles = zyx_angles(pose.linear(), held_a_);
  held_a_ = angles.z;
  text += ",A " + decimal(degrees_from_radians(angles.z), angle_digits_);
  text += ",B " + decimal(degrees_from_radians(angles.y), angle_digits_);
  text += ",C " + decimal(degrees_from_radians(angles.x), angle_digits_);
  return text;
}

std::string ProgramText::joint(int j, double value) const {
  const auto& axis = machine_.axes[static_cast<std::size_t>(j)];
  std::string text = axis.name + " ";
  if (axis.joint.kind == JointKind::rotary)
    append_decimal(text, degrees_from_radians(value), machine_.dialect.digits_angle);
  else
    append_decimal(text, value, machine_.dialect.digits_length);
  return text;
}

std::string ProgramText::target(const Pose& pose_there, const JointVector& joints) {
  std::string text = "{" + pose(pose_there);
  for (int j = 0; j < machine_.size(); ++j)
    if (is_external_axis(machine_.axes[static_cast<std::size_t>(j)].name))
      text += "," + joint(j, joints[j]);
  return text + "}";
}

}  // namespace smoothpost::krl
