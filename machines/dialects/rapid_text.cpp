#include "machines/dialects/rapid_text.h"

#include <algorithm>
#include <cmath>

#include "formats/robot/rapid_tokens.h"
#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"

namespace smoothpost::rapid {

namespace {

// Index of a name such as A3, from 0; −1 when it is none of `letter`.
int axis_number(const std::string& name, char letter) {
  const bool fits = name.size() == 2 && name[0] == letter && name[1] >= '1' && name[1] <= '6';
  return fits ? name[1] - '1' : -1;
}

std::string joint_text(const MachineDefinition& machine, int j, double value) {
  if (machine.axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary)
    return decimal(degrees_from_radians(value), machine.dialect.digits_angle);
  return decimal(value, machine.dialect.digits_length);
}

}  // namespace

std::string decimal(double value, int decimals) {
  std::string out;
  append_decimal(out, value, decimals);
  return out;
}

bool RobotAxes::has_arm() const {
  return std::all_of(arm.begin(), arm.end(), [](int j) { return j >= 0; });
}

RobotAxes robot_axes(const MachineDefinition& machine) {
  RobotAxes axes;
  for (int j = 0; j < machine.size(); ++j) {
    const std::string& name = machine.axes[static_cast<std::size_t>(j)].name;
    if (const int n = axis_number(name, 'A'); n >= 0)
      axes.arm[static_cast<std::size_t>(n)] = j;
    else if (const int e = axis_number(name, 'E'); e >= 0)
      axes.external[static_cast<std::size_t>(e)] = j;
    else
      axes.unnamed.push_back(name);
  }
  return axes;
}

std::optional<SixR> arm_form(const MachineDefinition& machine, const RobotAxes& axes) {
  if (!axes.has_arm()) return std::nullopt;
  ScrewChain arm = chain_of(machine);
  const auto joints = arm.joints;
  arm.joints.clear();
  for (const int j : axes.arm) arm.joints.push_back(joints[static_cast<std::size_t>(j)]);
  return SixR::from(arm);
}

std::array<double, 4> printed_quaternion(const Mat3& rotation, int decimals) {
  const Eigen::Quaterniond q(rotation);
  Eigen::Vector4d v(q.w(), q.x(), q.y(), q.z());
  v.normalize();
  if (v[0] < 0.0) v = -v;
  const auto rounded = [decimals](double x) { return rounded_decimal(x, decimals); };
  v = v.unaryExpr(rounded).normalized();
  v = v.unaryExpr(rounded);
  return {v[0], v[1], v[2], v[3]};
}

std::string pose_text(const Pose& pose, int digits, int quaternion_decimals) {
  std::string text = "[";
  for (int i = 0; i < 3; ++i) text += (i > 0 ? "," : "") + decimal(pose.translation()[i], digits);
  text += "],[";
  const auto q = printed_quaternion(pose.linear(), quaternion_decimals);
  for (std::size_t i = 0; i < 4; ++i)
    text += (i > 0 ? "," : "") + decimal(q[i], quaternion_decimals);
  return text + "]";
}

std::string external_text(const MachineDefinition& machine, const RobotAxes& axes,
                          const JointVector& joints) {
  std::string text = "[";
  for (std::size_t i = 0; i < 6; ++i) {
    const int j = axes.external[i];
    if (i > 0) text += ",";
    text += j < 0 ? "9E9" : joint_text(machine, j, joints[j]);
  }
  return text + "]";
}

std::string arm_text(const MachineDefinition& machine, const RobotAxes& axes,
                     const JointVector& joints) {
  std::string text = "[";
  for (std::size_t i = 0; i < 6; ++i)
    text += (i > 0 ? "," : "") + joint_text(machine, axes.arm[i], joints[axes.arm[i]]);
  return text + "]";
}

double blend_radius(double blend) {
  constexpr double kLeast = 1e-3;
  constexpr double kMost = 1e4;
  if (!(blend >= kLeast)) return 0.0;
  double best = kLeast;
  for (int exponent = -3; exponent <= 3; ++exponent)
    for (const double step : {1.0, 1.6, 2.5, 4.0, 6.3}) {
      const double radius = rounded_decimal(step * std::pow(10.0, exponent), 5);
      if (radius <= std::min(blend, kMost)) best = std::max(best, radius);
    }
  return best;
}

double printed_speed(double speed) {
  constexpr double kAbove = 1.0 + 2e-5;
  if (speed <= 0.0) return 0.0;
  const int decimals = std::clamp(3 - static_cast<int>(std::floor(std::log10(speed))), 0, 9);
  const double scale = std::pow(10.0, decimals);
  return rounded_decimal(std::floor(speed * kAbove * scale) / scale, decimals);
}

ArmConfiguration::ArmConfiguration(const MachineDefinition& machine)
    : axes_(robot_axes(machine)), arm_(arm_form(machine, axes_)) {}

std::array<int, 4> ArmConfiguration::at(const JointVector& joints) const {
  constexpr double kQuarter = 90.0;
  constexpr double kNoise = 1e-9;  // deg
  std::array<int, 4> out{};
  const std::array<std::size_t, 3> counted = {0, 3, 5};
  for (std::size_t i = 0; i < 3; ++i) {
    const double degrees = degrees_from_radians(joints[axes_.arm[counted[i]]]);
    out[i] = static_cast<int>(std::floor((degrees + kNoise) / kQuarter));
  }
  if (!arm_) return out;
  JointVector q(6);
  for (int i = 0; i < 6; ++i) q[i] = joints[axes_.arm[static_cast<std::size_t>(i)]];
  const auto branch = static_cast<unsigned>(arm_->branch_of(q));
  const unsigned shoulder = branch & 1U, elbow = branch >> 1U & 1U;
  out[3] = static_cast<int>(4U * shoulder + 2U * elbow) + (q[4] < 0.0 ? 1 : 0);
  return out;
}

std::string ArmConfiguration::text(const JointVector& joints) const {
  std::string text = "[";
  for (const int n : at(joints)) text += (text.size() > 1 ? "," : "") + std::to_string(n);
  return text + "]";
}

std::optional<Signal> signal_of(std::string_view statement) {
  Tokens tokens(statement);
  const Token word = tokens.next(), name = tokens.next(), comma = tokens.next(),
              value = tokens.next();
  Token behind = tokens.next();
  if (behind.is(";")) behind = tokens.next();
  if (name.kind != Token::Kind::word || !comma.is(",") || value.kind != Token::Kind::number ||
      behind.kind != Token::Kind::end)
    return std::nullopt;
  Signal signal{"", std::string(name.source), std::string(value.source)};
  if (word.is("SETDO")) signal.option = "DOp";
  if (word.is("SETGO")) signal.option = "GOp";
  if (word.is("SETAO")) signal.option = "AOp";
  if (signal.option.empty()) return std::nullopt;
  return signal;
}

std::string NamedTexts::name_of(const std::string& text) {
  const auto [at, is_new] = known_.emplace(text, all_.size());
  if (is_new) all_.emplace_back(prefix_ + std::to_string(all_.size() + 1), text);
  return all_[at->second].first;
}

}  // namespace smoothpost::rapid
