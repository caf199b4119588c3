#include "machines/dialects/krl.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/event_text.h"
#include "machines/dialects/zyx_angles.h"

namespace smoothpost::krl {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr double kFirstPercent = 10.0;  // of $VEL_AXIS, from wherever the robot stands
constexpr double kLinkPercent = 100.0;
constexpr double kLinkSpeed = 0.25;         // m/s, of links whose tip goes straight
constexpr double kLeastOrientation = 60.0;  // deg/s
constexpr double kNoLength = 1e-6;          // mm: a move that only turns
constexpr std::size_t kMostTriggers = 8;
constexpr double kMetresPerMillimetre = 1e-3;

bool is_arm_axis(const std::string& name) {
  return name.size() == 2 && name[0] == 'A' && name[1] >= '1' && name[1] <= '6';
}
bool is_external_axis(const std::string& name) {
  return name.size() == 2 && name[0] == 'E' && name[1] >= '1' && name[1] <= '6';
}

// Decimals that keep six digits of a small number and three decimals of a large one.
int decimals_of(double value) {
  if (value <= 0.0) return 3;
  return std::clamp(5 - static_cast<int>(std::floor(std::log10(value))), 3, 9);
}

std::string decimal(double value, int decimals) {
  std::string out;
  append_decimal(out, value, decimals);
  return out;
}

class Emitter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : machine_(machine), program_(program), chain_(chain_of(machine, program.tool_length)) {
    chain_.workpiece_home = program.part;
    angle_digits_ = std::max(5, machine.dialect.digits_angle);
    out_.move_lines.reserve(program.moves.size());
    out_.text.reserve(96 * program.moves.size() + 4096);
  }

  Result<EmittedProgram> run() {
    check_machine();
    if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
    find_orientation_limit();
    header();
    std::size_t action = 0;
    for (std::size_t i = 0; i <= program_.moves.size(); ++i) {
      const std::size_t first = action;
      while (action < program_.actions.size() && program_.actions[action].before == i) ++action;
      print_actions(first, action, i < program_.moves.size());
      if (i < program_.moves.size()) print_move(program_.moves[i]);
    }
    for (const auto& line : machine_.dialect.end) put_line(line);
    put_line("END");
    out_.line_count = line_;
    if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
    return Result<EmittedProgram>(std::move(out_), std::move(diagnostics_));
  }

 private:
  void error(const char* code, std::string text) {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    diagnostics_.push_back(std::move(d));
  }

  void check_machine() {
    bool part_moves = false;
    for (const auto& axis : machine_.axes) {
      part_moves = part_moves || axis.joint.side == ChainSide::workpiece;
      if (!is_arm_axis(axis.name) && !is_external_axis(axis.name))
        error("PR202", "axis " + axis.name + " of machine " + machine_.name +
                           " has no name in KRL: the arm's axes are A1 to A6, the others E1 to E6");
    }
    const bool poses = std::any_of(
        program_.moves.begin(), program_.moves.end(),
        [](const MachineMove& m) { return m.interpolation == MoveInterpolation::tool; });
    if (part_moves && poses)
      error("PR203",
            "machine " + machine_.name +
                " moves the part by an axis: LIN in a moving $BASE is not written by this version");
  }

  void header() {
    put_line("&ACCESS RVP");
    put_line("&REL 1");
    put_line("DEF smoothpost( )");
    if (!program_.certified)
      put_line("; NOT CERTIFIED. Written with --force: read the report before you run it");
    put_line("DECL REAL SP_LINK");
    put_line(";FOLD INI");
    put_line("GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM( )");
    put_line("INTERRUPT ON 3");
    put_line("BAS(#INITMOV,0)");
    put_line(";ENDFOLD (INI)");
    for (const auto& line : program_.title) put_line("; " + plain_text(line, kMaxComment));
    for (const auto& line : machine_.dialect.start) put_line(line);
    put_line("; speed of links on a straight line, m/s");
    put_line("$ADVANCE=3");
    modal_words();
    if (!program_.certified) put_line("HALT");
  }

  // Everything that motions rely on; printed again at each label.
  void modal_words() {
    put_line("$BASE={" + pose_text(program_.part, machine_.dialect.digits_length) + "}");
    put_line("$TOOL={" +
             pose_text(tool_frame(machine_, program_.tool_length), machine_.dialect.digits_length) +
             "}");
    put_line("SP_LINK=" + decimal(kLinkSpeed, 3));
    put_line("$IPO_MODE=#BASE");
    put_line("$ORI_TYPE=#VAR");
    if (blends()) {
      put_line("$APO.CDIS=" +
               decimal(machine_.tolerance.tip * machine_.tolerance.budget.controller, 5));
      put_line("$APO.CORI=" + decimal(degrees_from_radians(machine_.tolerance.axis *
                                                           machine_.tolerance.budget.controller),
                                      5));
    }
    printed_cp_.clear();
    printed_orientation_.clear();
    printed_percent_.clear();
  }

  bool blends() const { return machine_.dialect.path_mode == "blend"; }

  // $VEL.ORI1 and ORI2 of moves along a line: above what any of them needs, so that $VEL.CP
  // decides on their time.
  void find_orientation_limit() {
    double fastest = kLeastOrientation;
    Pose from = Pose::Identity();
    bool known = false;
    for (const auto& move : program_.moves) {
      const Pose to = pose_after(move);
      if (known && move.interpolation == MoveInterpolation::tool && move.duration > 0.0)
        fastest = std::max(fastest, degrees_from_radians(turn(from, to)) / move.duration);
      from = to;
      known = true;
    }
    orientation_limit_ = std::ceil(1.05 * fastest);
  }

  static double turn(const Pose& from, const Pose& to) {
    return rotation_log(from.linear().transpose() * to.linear()).norm();
  }

  Pose pose_after(const MachineMove& move) const {
    return move.interpolation == MoveInterpolation::tool ? move.tool : forward(chain_, move.to);
  }

  void put_line(std::string_view line) {
    out_.text += line;
    out_.text += '\n';
    ++line_;
  }

  void set(const char* variable, std::string value, std::string& printed) {
    if (value == printed) return;
    put_line(std::string(variable) + "=" + value);
    printed = std::move(value);
  }

  void set_orientation(double degrees_per_second) {
    const std::string value = decimal(degrees_per_second, decimals_of(degrees_per_second));
    if (value == printed_orientation_) return;
    put_line("$VEL.ORI1=" + value);
    put_line("$VEL.ORI2=" + value);
    printed_orientation_ = value;
  }

  // Events on the fly become triggers of the next motion unless the robot waits behind them.
  void print_actions(std::size_t first, std::size_t last, bool motion_follows) {
    std::vector<std::string> triggers;
    for (std::size_t i = first; i < last; ++i) {
      const auto& action = program_.actions[i];
      if (action.kind == MachineAction::Kind::comment) {
        put_line("; " + plain_text(action.text, kMaxComment));
      } else if (action.kind == MachineAction::Kind::cut_label) {
        put_line("; " + plain_text(action.text, kMaxComment));
        modal_words();
      } else if (action.kind == MachineAction::Kind::dwell) {
        wait(action.seconds);
      } else if (const auto event = event_text(machine_, action, diagnostics_)) {
        if (event->is_comment) {
          put_line("; " + plain_text(event->text, kMaxComment));
        } else if (motion_follows && event->on_the_fly && event->dwell == 0.0 &&
                   !waits_behind(i + 1, last) && triggers.size() < kMostTriggers) {
          triggers.push_back(event->text);
        } else {
          put_line(event->text);
          if (event->dwell > 0.0) wait(event->dwell);
        }
      }
    }
    pending_triggers_ = std::move(triggers);
  }

  // Whether one of the actions stops the robot: a dwell, an event that is not on the fly.
  bool waits_behind(std::size_t first, std::size_t last) const {
    for (std::size_t i = first; i < last; ++i) {
      const auto& action = program_.actions[i];
      if (action.kind == MachineAction::Kind::dwell) return true;
      if (action.kind != MachineAction::Kind::event) continue;
      for (const auto& row : machine_.process.events)
        if (row.event == action.event.name && (!row.on_the_fly || row.dwell > 0.0)) return true;
    }
    return false;
  }

  void wait(double seconds) { put_line("WAIT SEC " + decimal(seconds, 4)); }

  void print_move(const MachineMove& move) {
    const bool tool = move.interpolation == MoveInterpolation::tool;
    if (tool)
      print_line_speed(move);
    else
      print_joint_speed(move);
    for (const auto& text : pending_triggers_)
      put_line("TRIGGER WHEN DISTANCE=0 DELAY=0 DO " + text);
    pending_triggers_.clear();
    put_line(tool ? line_text(move) : joints_text(move));
    out_.move_lines.push_back(line_);
    last_pose_ = pose_after(move);
    last_place_ = tool ? printed(move.tool) : Vec3(last_pose_.translation());
    last_joints_ = move.to;
    started_ = true;
  }

  Vec3 printed(const Pose& pose) const {
    const int digits = machine_.dialect.digits_length;
    return pose.translation().unaryExpr([digits](double v) { return rounded_decimal(v, digits); });
  }

  void print_line_speed(const MachineMove& move) {
    if (move.rapid || move.duration <= 0.0 || !started_) {
      set("$VEL.CP", "SP_LINK", printed_cp_);
      return set_orientation(orientation_limit_);
    }
    const double length = (printed(move.tool) - last_place_).norm();
    const double degrees = degrees_from_radians(turn(last_pose_, move.tool));
    if (length < kNoLength) {
      if (degrees > 0.0) set_orientation(degrees / move.duration);
      if (printed_cp_.empty() || printed_cp_ == "SP_LINK")
        set("$VEL.CP", decimal(kLinkSpeed, 3), printed_cp_);
      return;
    }
    const double speed = length / move.duration * kMetresPerMillimetre;
    set("$VEL.CP", decimal(speed, decimals_of(speed)), printed_cp_);
    set_orientation(orientation_limit_);
  }

  // PTP has no time: the share of the axes' speed with which the slowest takes the planned one.
  void print_joint_speed(const MachineMove& move) {
    double percent = started_ ? kLinkPercent : kFirstPercent;
    if (started_ && !move.rapid && move.duration > 0.0) {
      double needed = 0.0;
      for (int j = 0; j < machine_.size(); ++j) {
        const double speed = std::abs(move.to[j] - last_joints_[j]) / move.duration;
        needed = std::max(needed, speed / machine_.axes[static_cast<std::size_t>(j)].velocity);
      }
      percent = std::clamp(std::floor(100.0 * needed), 1.0, kLinkPercent);
    }
    const std::string value = decimal(percent, 0);
    if (value == printed_percent_) return;
    put_line("BAS(#VEL_PTP," + value + ")");
    printed_percent_ = value;
  }

  std::string joints_text(const MachineMove& move) const {
    std::string text = "PTP {";
    std::string turns = "000000";
    bool first = true;
    for (int j = 0; j < machine_.size(); ++j) {
      const auto& name = machine_.axes[static_cast<std::size_t>(j)].name;
      if (is_arm_axis(name) && move.to[j] < 0.0)
        turns[static_cast<std::size_t>('6' - name[1])] = '1';
      if (!(move.joints >> j & 1U)) continue;
      text += (first ? "" : ",") + joint_text(j, move.to[j]);
      first = false;
    }
    return text + "} ; T 'B" + turns + "'";
  }

  std::string joint_text(int j, double value) const {
    const auto& axis = machine_.axes[static_cast<std::size_t>(j)];
    std::string text = axis.name + " ";
    if (axis.joint.kind == JointKind::rotary)
      append_decimal(text, degrees_from_radians(value), machine_.dialect.digits_angle);
    else
      append_decimal(text, value, machine_.dialect.digits_length);
    return text;
  }

  std::string line_text(const MachineMove& move) {
    std::string text = "LIN {" + pose_text(move.tool, machine_.dialect.digits_length);
    for (int j = 0; j < machine_.size(); ++j)
      if (is_external_axis(machine_.axes[static_cast<std::size_t>(j)].name))
        text += "," + joint_text(j, move.to[j]);
    text += "}";
    if (blends()) text += " C_DIS";
    return text;
  }

  std::string pose_text(const Pose& pose, int digits) {
    std::string text;
    const std::array<const char*, 3> names = {"X ", ",Y ", ",Z "};
    for (std::size_t i = 0; i < 3; ++i) {
      text += names[i];
      append_decimal(text, pose.translation()[static_cast<Eigen::Index>(i)], digits);
    }
    const ZyxAngles angles = zyx_angles(pose.linear(), held_a_);
    held_a_ = angles.z;
    text += ",A " + decimal(degrees_from_radians(angles.z), angle_digits_);
    text += ",B " + decimal(degrees_from_radians(angles.y), angle_digits_);
    text += ",C " + decimal(degrees_from_radians(angles.x), angle_digits_);
    return text;
  }

  const MachineDefinition& machine_;
  const MachineProgram& program_;
  ScrewChain chain_;
  int angle_digits_ = 5;
  double orientation_limit_ = 0.0;
  double held_a_ = 0.0;
  bool started_ = false;
  Pose last_pose_ = Pose::Identity();
  Vec3 last_place_ = Vec3::Zero();  // its tip, as printed
  JointVector last_joints_;
  std::string printed_cp_;
  std::string printed_orientation_;
  std::string printed_percent_;
  std::vector<std::string> pending_triggers_;
  std::uint32_t line_ = 0;
  EmittedProgram out_;
  Diagnostics diagnostics_;
};

}  // namespace

Pose tool_frame(const MachineDefinition& machine, double tool_length) {
  Pose tool = Pose::Identity();
  tool.translation() = machine.tool.tip - tool_length * machine.tool.axis;
  return machine.tool.flange.inverse() * tool;
}

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

const Dialect kDialect = {
    "krl",
    "KUKA KRL (KSS 8), LIN in the part's frame and PTP, exact stop or C_DIS",
    "LIN: tip linear, rotation in proportion ($ORI_TYPE=#VAR, set in the program), taken as one "
    "about "
    "a fixed axis with an allowance of the square of its angle by 8 for the control's own swivel "
    "and "
    "turn; PTP: all axes together (synchronous), path between its ends not certified: only the box "
    "of "
    "joint positions",
    ToolTurn::slerp,
    false,
    &emit,
    &read_back,
    "$BASE and $TOOL are those that the program sets itself, and no other frame is active"};

}  // namespace smoothpost::krl
