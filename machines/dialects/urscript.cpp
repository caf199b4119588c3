#include "machines/dialects/urscript.h"

#include <algorithm>
#include <cmath>

#include "machines/dialects/robot_program.h"

namespace smoothpost::urscript {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr double kMetresPerMillimetre = 1e-3;
constexpr int kTurnDigits = 8;  // of a rotation vector, rad: 3e-7 deg
constexpr int kFrameDigits = 9;
constexpr int kTimeDigits = 6;
constexpr int kMostDigits = 9;
constexpr const char* kFirst = ", a=0.5, v=0.2)";  // rad/s2, rad/s: from wherever the robot stands
constexpr const char* kJoint = ", a=1.4, v=1.05)";
constexpr const char* kLine = ", a=1.2, v=0.25)";  // m/s2, m/s
constexpr double kLeastRadius = 0.1;               // mm
constexpr double kProcessAcceleration = 1.2;       // m/s2, of movep
constexpr const char* kServo = ", lookahead_time=0.03, gain=2000)";
constexpr double kLeastServoTime = 0.002;  // s, a cycle of the e-Series
constexpr const char* kServoName = "urscript_servoj";

class Emitter : public robot::RobotPrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : RobotPrinter(machine, program, "URScript", kLeastRadius),
        stream_(machine.dialect.name == kServoName) {}

 private:
  void check() override {
    RobotPrinter::check();
    for (const int j : axes().external)
      if (j >= 0)
        refuse("PR203", "axis " + machine().axes[static_cast<std::size_t>(j)].name +
                            ": URScript moves the six axes of the arm only");
    if (stream_ && has_poses())
      refuse("PR203", "servoj has joints only: write dialect.mode = \"joint\"");
  }

  // ---- literals

  int length_digits() const { return std::min(kMostDigits, machine().dialect.digits_length + 3); }
  int angle_digits() const { return std::min(kMostDigits, machine().dialect.digits_angle + 2); }

  static std::string pose_text(const Pose& pose, int length, int turn) {
    const Vec3 w = rotation_log(pose.linear());
    std::string text = "p[";
    for (int i = 0; i < 3; ++i)
      text += decimal_text(pose.translation()[i] * kMetresPerMillimetre, length) + ", ";
    for (int i = 0; i < 3; ++i) text += (i > 0 ? ", " : "") + decimal_text(w[i], turn);
    return text + "]";
  }

  std::string joints_text(const JointVector& joints) const {
    std::string text = "[";
    for (std::size_t i = 0; i < 6; ++i)
      text += (i > 0 ? ", " : "") + decimal_text(joints[axes().arm[i]], angle_digits());
    return text + "]";
  }

  static std::string time_text(double seconds) {
    const double least = std::pow(10.0, -kTimeDigits);
    return ", t=" + decimal_text(std::max(seconds, least), kTimeDigits) + ")";
  }

  // ---- lines

  void statement_line(const std::string& text) { line("  " + text); }

  void head() override {
    line("def smoothpost():");
    if (!program().certified)
      comment("NOT CERTIFIED. Written with --force: read the report before you run it");
    for (const auto& title : program().title) comment(title);
    comment("m, rad, m/s, m/s2, s; p[x, y, z, rx, ry, rz] with a rotation vector");
    for (const auto& own : machine().dialect.start) statement_line(own);
    statement_line("sp_part = " + pose_text(program().part, kFrameDigits, kFrameDigits));
    statement_line("set_tcp(" + pose_text(tool(), kFrameDigits, kFrameDigits) + ")");
    if (stream_) {
      statement_line("def sp_hold(q):");
      statement_line(std::string("  servoj(q, t=0.2") + kServo);
      statement_line("  stopj(10)");
      statement_line("end");
    }
    if (machine().tool.load) {
      const LoadData& load = *machine().tool.load;
      std::string text = "set_payload(" + decimal_text(load.mass, 4) + ", [";
      for (int i = 0; i < 3; ++i)
        text += (i > 0 ? ", " : "") + decimal_text(load.centre[i] * kMetresPerMillimetre, 6);
      statement_line(text + "])");
    }
    if (!program().certified)
      statement_line("popup(\"NOT CERTIFIED: read the report\", blocking=True)");
  }

  void foot() override {
    hold();
    for (const auto& own : machine().dialect.end) statement_line(own);
    line("end");
  }

  void comment(const std::string& text) override {
    statement_line("# " + plain_text(text, kMaxComment));
  }
  void label(const std::string& text) override { comment(text); }
  void dwell(double seconds) override {
    hold();
    statement_line("sleep(" + decimal_text(seconds, 4) + ")");
  }

  // The stream ends where its last target is.
  void hold() {
    if (!target_.empty()) statement_line("sp_hold(" + target_ + ")");
    target_.clear();
  }

  void statement(const std::string& words, const MachineAction& action) override {
    warn_on_the_fly(words, action,
                    "URScript runs a statement when the motion in front of it has ended");
    hold();
    statement_line(words);
  }

  // ---- motions

  void print_move(std::size_t i) override {
    const MachineMove& m = move(i);
    const bool streamed = stream_ && has_started() && !m.rapid && m.duration > 0.0;
    if (streamed) {
      target_ = joints_text(m.to);
      statement_line("servoj(" + target_ + ", t=" +
                     decimal_text(std::max(m.duration, kLeastServoTime), kTimeDigits) + kServo);
    } else {
      hold();
      statement_line(is_tool(m) ? line_text(i) : joint_text(m));
    }
    arrive(m);
    rounded_ = is_tool(m) && may_round(i);
  }

  std::string joint_text(const MachineMove& m) const {
    const std::string head = "movej(" + joints_text(m.to);
    if (!has_started()) return head + kFirst;
    return m.rapid || m.duration <= 0.0 ? head + kJoint : head + time_text(m.duration);
  }

  // Only movep rounds, and only between two of them.
  std::string line_text(std::size_t i) {
    const MachineMove& m = move(i);
    const std::string pose =
        "(pose_trans(sp_part, " + pose_text(m.tool, length_digits(), kTurnDigits) + ")";
    if (m.rapid || m.duration <= 0.0) return "movel" + pose + kLine;
    const Leg leg = leg_to(m);
    const bool rounds = may_round(i);
    if (!rounds && !rounded_) return "movel" + pose + time_text(m.duration);
    const double speed = leg.length / m.duration * kMetresPerMillimetre;
    const double radius = rounds ? rapid::blend_radius(m.blend) * kMetresPerMillimetre : 0.0;
    return "movep" + pose + ", a=" + decimal_text(kProcessAcceleration, 1) +
           ", v=" + decimal_text(speed, decimals_for(speed, 7, 6, kMostDigits)) +
           ", r=" + decimal_text(radius, 8) + ")";
  }

  bool rounded_ = false;  // the corner where the robot is
  const bool stream_;
  std::string target_;  // of the last servoj, until it is held
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

const Dialect kDialect = {
    "urscript",
    "URScript (Universal Robots), movej, movel and movep in the part's frame",
    "movel and movep: tip linear, rotation about one fixed axis in proportion; a blend leaves that "
    "way within its radius of the corner only; movej: all joints linear",
    ToolTurn::slerp,
    true,
    &emit,
    &read_back,
    "tool (set_tcp) and part's frame are those of the program itself"};

const Dialect kServoDialect = {
    kServoName,
    "URScript (Universal Robots), joints as a stream of servoj",
    "servoj: all joints linear from target to target in their times, taken as if the control's "
    "filter (lookahead_time 0.03 s, gain 2000) left them nowhere; movej: all joints linear",
    ToolTurn::none,
    true,
    &emit,
    &read_back,
    "tool (set_tcp) and part's frame are those of the program itself; the control follows the "
    "targets of servoj: how far its filter lags behind them and rounds them off is not known here, "
    "and has to be measured on the robot"};

}  // namespace smoothpost::urscript
