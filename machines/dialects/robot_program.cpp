#include "machines/dialects/robot_program.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/tool_frame.h"

namespace smoothpost::robot {

RobotPrinter::RobotPrinter(const MachineDefinition& machine, const MachineProgram& program,
                           const char* language, double least_radius)
    : ProgramPrinter(machine, program),
      language_(language),
      least_radius_(least_radius),
      axes_(rapid::robot_axes(machine)),
      chain_(chain_of(machine, program.tool_length)) {
  chain_.workpiece_home = program.part;
}

void RobotPrinter::check() {
  for (const auto& name : axes_.unnamed)
    refuse("PR202", "axis " + name + " of machine " + machine().name + " has no place in " +
                        language_ + ": the arm's axes are A1 to A6, the others E1 to E6");
  if (axes_.unnamed.empty() && !axes_.has_arm())
    refuse("PR202", "machine " + machine().name + " has not all of the axes A1 to A6 of an arm");
  if (machine().dialect.path_mode == "spline")
    refuse("PR203", "dialect " + machine().dialect.name +
                        " has no path_mode \"spline\": write path_mode = \"exact\" or \"blend\"");
  const bool part_moves =
      std::any_of(machine().axes.begin(), machine().axes.end(),
                  [](const AxisDefinition& a) { return a.joint.side == ChainSide::workpiece; });
  if (part_moves && has_poses())
    refuse("PR203", "machine " + machine().name +
                        " moves the part by an axis: straight moves in a moving frame are not "
                        "written by this version");
  if (program().moves.empty()) return;
  const JointMask all = (JointMask{1} << machine().size()) - 1U;
  const MachineMove& first = move(0);
  if (is_tool(first) || (first.joints & all) != all)
    refuse("PR203", "the first motion has to be one in joints that names every axis",
           first.input_line);
}

Pose RobotPrinter::tool() const { return tool_frame(machine(), program().tool_length); }

Pose RobotPrinter::pose_after(const MachineMove& move) const {
  return is_tool(move) ? move.tool : forward(chain_, move.to);
}

Vec3 RobotPrinter::printed(const Pose& pose) const {
  const int digits = machine().dialect.digits_length;
  return pose.translation().unaryExpr([digits](double v) { return rounded_decimal(v, digits); });
}

RobotPrinter::Leg RobotPrinter::leg(const Pose& from, const MachineMove& move) const {
  return {(printed(move.tool) - printed(from)).norm(),
          rotation_log(from.linear().transpose() * move.tool.linear()).norm()};
}

void RobotPrinter::arrive(const MachineMove& move) {
  pose_ = pose_after(move);
  joints_ = move.to;
  started_ = true;
}

double RobotPrinter::joint_percent(const MachineMove& move, int decimals) const {
  constexpr double kMost = 99.99;
  constexpr double kNoise = 1e-9;
  const double scale = std::pow(10.0, decimals);
  double needed = 0.0;
  for (int j = 0; j < machine().size(); ++j) {
    const double speed = std::abs(move.to[j] - joints_[j]) / move.duration;
    needed = std::max(needed, speed / machine().axes[static_cast<std::size_t>(j)].velocity);
  }
  return std::clamp(std::floor(100.0 * needed * scale + kNoise) / scale, 1.0 / scale, kMost);
}

bool RobotPrinter::may_round(std::size_t i) const {
  if (!has_blend(move(i)) || i == 0 || i + 1 == program().moves.size()) return false;
  if (!is_tool(move(i)) || !is_tool(move(i + 1)) || move(i).rapid || move(i + 1).rapid)
    return false;
  if (!leg(pose_after(move(i - 1)), move(i)).moves_tip() ||
      !leg(pose_after(move(i)), move(i + 1)).moves_tip())
    return false;
  const auto [first, last] = actions_before(i + 1);
  for (std::size_t k = first; k < last; ++k)
    if (!is_taken(k) && program().actions[k].kind != MachineAction::Kind::comment) return false;
  return true;
}

void RobotPrinter::warn(const char* code, std::uint32_t input_line, std::string text) {
  Diagnostic d;
  d.code = code;
  d.severity = Severity::warning;
  d.where.line = static_cast<int>(input_line);
  d.text = std::move(text);
  diagnostics().push_back(std::move(d));
}

void RobotPrinter::warn_on_the_fly(const std::string& words, const MachineAction& action,
                                   const char* reason) {
  constexpr std::size_t kLongest = 64;
  const auto& rows = machine().process.events;
  const bool on_the_fly = std::any_of(rows.begin(), rows.end(), [&](const EventWords& e) {
    return e.event == action.event.name && e.on_the_fly;
  });
  const std::size_t before = action.before;
  if (!on_the_fly || before == 0 || before >= program().moves.size() ||
      !has_blend(move(before - 1)))
    return;
  warn("PR222", action.input_line,
       "event " + action.event.name + " (" + words.substr(0, kLongest) +
           ") is to act on the fly and the robot stops for it: " + reason);
}

RobotReading::RobotReading(const MachineDefinition& machine, const std::string& file,
                           const char* code, const char* frame_code)
    : ProgramReading(machine, file, code),
      frame_code_(frame_code),
      axes_(rapid::robot_axes(machine)) {
  result.exact_path = true;  // every rounding has its distance in the text
  if (!axes_.has_arm() || !axes_.unnamed.empty())
    error({1, 1}, "machine " + machine.name + " is no arm with axes A1 to A6 and E1 to E6");
}

void RobotReading::set_part(TextPlace at, const Pose& part) {
  if (result.part && !result.part->isApprox(part, 1e-12))
    return error(at, frame_code_, "the part's frame changes within the program");
  result.part = part;
}

void RobotReading::set_tool(TextPlace at, const Pose& tool) {
  if (result.tool_frame && !result.tool_frame->isApprox(tool, 1e-12))
    return error(at, frame_code_, "the tool changes within the program");
  result.tool_frame = tool;
  const Pose in_machine = machine().tool.flange * tool;
  const Vec3 shift = machine().tool.tip - in_machine.translation();
  tool_length_ = shift.dot(machine().tool.axis);
  const double aside = (shift - tool_length_ * machine().tool.axis).norm();
  constexpr double kMostAside = 1e-3;  // mm
  if (aside > kMostAside || rotation_log(in_machine.linear()).norm() > radians_from_degrees(1e-4))
    error(at, frame_code_,
          "the tool is not that of machine " + machine().name +
              ": [tool] tip_mm, axis and flange of the machine file give another frame");
}

std::optional<double> RobotReading::seconds_at(double percent) const {
  if (!stands_ || !all_known()) return std::nullopt;
  double seconds = 0.0;
  for (int j = 0; j < machine().size(); ++j)
    seconds = std::max(seconds, std::abs(joints()[j] - (*stands_)[j]) /
                                    machine().axes[static_cast<std::size_t>(j)].velocity);
  return seconds * 100.0 / percent;
}

void RobotReading::add_joint_move(TextPlace at, std::optional<double> seconds) {
  if (has_ended()) error(at, "a motion stands behind the last lines of the machine file");
  ReadBackMove move = new_move(at);
  move.rapid = !seconds;
  move.duration = seconds.value_or(0.0);
  move.to = joints();
  move.known = known();
  pose_.reset();
  stands_.reset();
  if (all_known()) stands_ = joints();
  if (all_known() && has_frames()) {
    ScrewChain chain = chain_of(machine(), tool_length_);
    chain.workpiece_home = *result.part;
    pose_ = forward(chain, joints());
  }
  if (!result.moves.empty() && result.moves.back().blend > 0.0)
    error(at, "a corner towards a joint move is rounded: its way is not known");
  result.moves.push_back(std::move(move));
}

void RobotReading::add_line_move(TextPlace at, const Pose& tool, const LineSpeed& speed,
                                 double blend) {
  if (has_ended()) error(at, "a motion stands behind the last lines of the machine file");
  if (!has_frames())
    return error(at, "a straight motion stands before the part's frame and the tool are set");
  if (!pose_) return error(at, "the first motion has to be one in joints that names every axis");
  ReadBackMove move = new_move(at);
  move.interpolation = MoveInterpolation::tool;
  move.tool = tool;
  move.blend = blend;
  move.rapid = !speed.seconds && !(speed.tip > 0.0) && !(speed.turn > 0.0);
  const double length = (tool.translation() - pose_->translation()).norm();
  const double turn = rotation_log(pose_->linear().transpose() * tool.linear()).norm();
  if (speed.seconds) move.duration = *speed.seconds;
  if (speed.tip > 0.0) move.duration = length / speed.tip;
  if (speed.turn > 0.0) move.duration = std::max(move.duration, turn / speed.turn);
  for (const int j : axes_.arm)
    if (j >= 0) forget_joint(j);
  for (const int j : axes_.external)
    if (j >= 0) move.to[j] = joints()[j];
  move.known = known();
  stands_.reset();
  pose_ = tool;
  result.moves.push_back(std::move(move));
}

void RobotReading::needs_stop(TextPlace at) {
  if (!result.moves.empty() && result.moves.back().blend > 0.0)
    error(at, "this statement acts before the robot is through the corner in front of it");
}

}  // namespace smoothpost::robot
