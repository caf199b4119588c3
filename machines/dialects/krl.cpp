#include "machines/dialects/krl.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/event_text.h"
#include "machines/dialects/krl_line.h"
#include "machines/dialects/krl_text.h"
#include "machines/dialects/tool_frame.h"

namespace smoothpost::krl {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr double kFirstPercent = 10.0;  // of $VEL_AXIS, from wherever the robot stands
constexpr double kLinkPercent = 100.0;
constexpr double kLinkSpeed = 0.25;         // m/s, of links whose tip goes straight
constexpr double kLeastOrientation = 60.0;  // deg/s
constexpr double kLeastTurnRate = 1e-3;     // deg/s: below it the move stands still
constexpr double kNoLength = 1e-6;          // mm: a move that only turns
constexpr int kLoadDigits = 4;              // of kg, mm and kg m^2
constexpr double kMetresPerMillimetre = 1e-3;
constexpr double kMillisecondsPerSecond = 1e3;
constexpr int kPathDigits = 5;               // of PATH in a TRIGGER, mm
constexpr std::size_t kMostSplPoints = 500;  // of one block: it is computed before it starts

class Emitter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program)
      : machine_(machine),
        program_(program),
        chain_(chain_of(machine, program.tool_length)),
        text_(machine) {
    chain_.workpiece_home = program.part;
    out_.move_lines.reserve(program.moves.size());
    text_.reserve(96 * program.moves.size() + 4096);
  }

  Result<EmittedProgram> run() {
    check_machine();
    if (has_error(diagnostics_)) return Result<EmittedProgram>::failure(std::move(diagnostics_));
    find_orientation_limit();
    header();
    for (std::size_t i = 0; i < program_.moves.size();) {
      print_actions(i, true);
      i = print_motion(i) + 1;
    }
    print_actions(program_.moves.size(), false);
    end_spline();
    for (const auto& line : machine_.dialect.end) text_.line(line);
    text_.line("END");
    out_.line_count = text_.lines();
    out_.text = text_.take();
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
    text_.line("&ACCESS RVP");
    text_.line("&REL 1");
    text_.line("DEF smoothpost( )");
    if (!program_.certified)
      text_.line("; NOT CERTIFIED. Written with --force: read the report before you run it");
    text_.line("DECL REAL SP_LINK");
    text_.line(";FOLD INI");
    text_.line("GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM( )");
    text_.line("INTERRUPT ON 3");
    text_.line("BAS(#INITMOV,0)");
    text_.line(";ENDFOLD (INI)");
    for (const auto& line : program_.title) text_.line("; " + plain_text(line, kMaxComment));
    for (const auto& line : machine_.dialect.start) text_.line(line);
    text_.line("; speed of links on a straight line, m/s");
    text_.line("$ADVANCE=3");
    load_words();
    modal_words();
    if (!program_.certified) text_.line("HALT");
  }

  // What hangs on the flange; without it in the machine file the control keeps its own.
  void load_words() {
    if (!machine_.tool.load) return;
    const LoadData& load = *machine_.tool.load;
    const auto axes = [](const Vec3& v, int digits) {
      return "X " + decimal(v.x(), digits) + ",Y " + decimal(v.y(), digits) + ",Z " +
             decimal(v.z(), digits);
    };
    text_.line("$LOAD.M=" + decimal(load.mass, kLoadDigits));
    text_.line("$LOAD.CM={" + axes(load.centre, kLoadDigits) + ",A 0,B 0,C 0}");
    text_.line("$LOAD.J={" + axes(load.inertia, kLoadDigits) + "}");
  }

  // Everything that motions rely on; printed again at each label.
  void modal_words() {
    text_.line("$BASE={" + text_.pose(program_.part) + "}");
    text_.line("$TOOL={" + text_.pose(tool_frame(machine_, program_.tool_length)) + "}");
    text_.line("SP_LINK=" + decimal(kLinkSpeed, 3));
    text_.line("$IPO_MODE=#BASE");
    text_.line("$ORI_TYPE=#VAR");
    text_.forget();
    if (rounds_)
      text_.set("$APO.CORI", decimal(degrees_from_radians(machine_.tolerance.axis *
                                                          machine_.tolerance.budget.controller),
                                     5));
  }

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
      rounds_ = rounds_ || blend_distance(move.blend) > 0.0;
    }
    orientation_limit_ = std::ceil(1.05 * fastest);
  }

  static double turn(const Pose& from, const Pose& to) {
    return rotation_log(from.linear().transpose() * to.linear()).norm();
  }

  Pose pose_after(const MachineMove& move) const {
    return move.interpolation == MoveInterpolation::tool ? move.tool : forward(chain_, move.to);
  }

  // A line that cannot stand within a SPLINE.
  void statement(std::string_view line) {
    end_spline();
    text_.line(line);
  }

  void comment(const std::string& text) { text_.line("; " + plain_text(text, kMaxComment)); }

  // The actions in front of `move`. Events on the fly become triggers of the next motion unless
  // the robot waits behind them.
  void print_actions(std::size_t move, bool motion_follows) {
    const std::size_t first = action_;
    while (action_ < program_.actions.size() && program_.actions[action_].before <= move) ++action_;
    for (std::size_t i = first; i < action_; ++i) {
      const auto& action = program_.actions[i];
      if (action.kind == MachineAction::Kind::comment) {
        comment(action.text);
      } else if (action.kind == MachineAction::Kind::cut_label) {
        end_spline();
        comment(action.text);
        modal_words();
      } else if (action.kind == MachineAction::Kind::dwell) {
        wait(action.seconds);
      } else if (const auto event = event_text(machine_, action, diagnostics_)) {
        if (event->is_comment) {
          comment(event->text);
        } else if (motion_follows && event->on_the_fly && event->dwell == 0.0 &&
                   !waits_behind(i + 1) && triggers_.size() < kMostTriggers) {
          triggers_.push_back(event->text);
        } else {
          statement(event->text);
          if (event->dwell > 0.0) wait(event->dwell);
        }
      }
    }
  }

  // Whether one of the actions up to action_ stops the robot: a dwell, an event not on the fly.
  bool waits_behind(std::size_t first) const {
    for (std::size_t i = first; i < action_; ++i) {
      const auto& action = program_.actions[i];
      if (action.kind == MachineAction::Kind::dwell) return true;
      if (action.kind != MachineAction::Kind::event) continue;
      for (const auto& row : machine_.process.events)
        if (row.event == action.event.name && (!row.on_the_fly || row.dwell > 0.0)) return true;
    }
    return false;
  }

  void wait(double seconds) { statement("WAIT SEC " + decimal(seconds, 4)); }

  // One motion; returns the last move that it makes.
  std::size_t print_motion(std::size_t first) {
    const MachineMove& move = program_.moves[first];
    std::size_t last = first;
    if (move.interpolation == MoveInterpolation::joints)
      print_joints(move);
    else if (is_spl(move))
      print_spl(move);
    else
      last = print_line(first);
    const MachineMove& end = program_.moves[last];
    out_.move_lines.insert(out_.move_lines.end(), last - first + 1, text_.lines());
    triggers_.clear();
    last_pose_ = pose_after(end);
    last_place_ = end.interpolation == MoveInterpolation::tool ? printed(end.tool)
                                                               : Vec3(last_pose_.translation());
    last_joints_ = end.to;
    started_ = true;
    return last;
  }

  void print_joints(const MachineMove& move) {
    end_spline();
    print_joint_speed(move);
    print_start_triggers("DISTANCE=0");
    text_.line(joints_text(move));
  }

  std::size_t print_line(std::size_t first) {
    end_spline();
    JoinedLine joined{first, {}};
    if (started_)
      joined = joined_line(machine_, program_,
                           {last_pose_, last_joints_, first, action_, triggers_.size()});
    const MachineMove& end = program_.moves[joined.last];
    double time = 0.0;
    for (std::size_t i = first; i <= joined.last; ++i) time += program_.moves[i].duration;
    for (; action_ < program_.actions.size() && program_.actions[action_].before <= joined.last;
         ++action_)
      if (program_.actions[action_].kind == MachineAction::Kind::comment)
        comment(program_.actions[action_].text);
    const double speed = print_line_speed(end, time);
    const double distance = blend_distance(end.blend);
    if (distance > 0.0) text_.set("$APO.CDIS", decimal(distance, 6));
    print_start_triggers("DISTANCE=0");
    for (const LineEvent& event : joined.events) print_early(event, speed, length_to(end));
    text_.line("LIN " + text_.target(end.tool, end.to) + (distance > 0.0 ? " C_DIS" : ""));
    return joined.last;
  }

  void print_start_triggers(const std::string& place) {
    for (const auto& text : triggers_) text_.line("TRIGGER WHEN " + place + " DELAY=0 DO " + text);
  }

  // Back from the end of the LIN: whole milliseconds, and what is left as a way.
  void print_early(const LineEvent& event, double speed, double length) {
    const auto text = event_text(machine_, program_.actions[event.action], diagnostics_);
    if (!text) return;
    const double back = (1.0 - event.share) * length;
    const double in_a_millisecond = speed / kMillisecondsPerSecond;
    const double milliseconds = std::floor(back / in_a_millisecond + 1e-9);
    const std::string rest =
        decimal(-std::max(0.0, back - milliseconds * in_a_millisecond), kPathDigits);
    text_.line("TRIGGER WHEN " + (rest == "0" ? std::string("DISTANCE=1") : "PATH=" + rest) +
               " DELAY=" + decimal(-milliseconds, 0) + " DO " + text->text);
  }

  bool is_spl(const MachineMove& move) const {
    return move.spline && started_ && !move.rapid && move.duration > 0.0 &&
           length_to(move) >= kNoLength;
  }

  void print_spl(const MachineMove& move) {
    const std::string speed = speed_text(length_to(move) / move.duration);
    if (spl_points_ == kMostSplPoints) end_spline();
    if (spl_points_ == 0) {
      text_.set_orientation_speed(orientation_limit_);
      text_.line("SPLINE WITH $VEL.CP=" + speed);
      block_speed_ = speed;
    }
    ++spl_points_;
    print_start_triggers("PATH=0 ONSTART");
    text_.line("SPL " + text_.target(move.tool, move.to) +
               (speed == block_speed_ ? "" : " WITH $VEL.CP=" + speed));
  }

  void end_spline() {
    if (spl_points_ > 0) text_.line("ENDSPLINE");
    spl_points_ = 0;
  }

  Vec3 printed(const Pose& pose) const {
    const int digits = machine_.dialect.digits_length;
    return pose.translation().unaryExpr([digits](double v) { return rounded_decimal(v, digits); });
  }

  double length_to(const MachineMove& move) const {
    return (printed(move.tool) - last_place_).norm();
  }

  // mm/s in m/s
  static std::string speed_text(double speed) {
    const double metres = speed * kMetresPerMillimetre;
    return decimal(metres, decimals_of(metres));
  }

  // Returns the tip's speed as printed, mm/s; 0 when it is not stated.
  double print_line_speed(const MachineMove& move, double time) {
    if (move.rapid || time <= 0.0 || !started_) {
      text_.set("$VEL.CP", "SP_LINK");
      text_.set_orientation_speed(orientation_limit_);
      return 0.0;
    }
    const double length = length_to(move);
    const double degrees = degrees_from_radians(turn(last_pose_, move.tool));
    if (length < kNoLength) {
      const double rate = degrees / time;
      text_.set_orientation_speed(rate >= kLeastTurnRate ? rate : orientation_limit_);
      const std::string last = text_.last("$VEL.CP");
      if (last.empty() || last == "SP_LINK") text_.set("$VEL.CP", decimal(kLinkSpeed, 3));
      return 0.0;
    }
    text_.set("$VEL.CP", speed_text(length / time));
    text_.set_orientation_speed(orientation_limit_);
    const double metres = length / time * kMetresPerMillimetre;
    return rounded_decimal(metres, decimals_of(metres)) / kMetresPerMillimetre;
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
    text_.set_joint_percent(percent);
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
      text += (first ? "" : ",") + text_.joint(j, move.to[j]);
      first = false;
    }
    return text + "} ; T 'B" + turns + "'";
  }

  const MachineDefinition& machine_;
  const MachineProgram& program_;
  ScrewChain chain_;
  ProgramText text_;
  double orientation_limit_ = 0.0;
  bool rounds_ = false;  // some corner is rounded
  bool started_ = false;
  std::size_t action_ = 0;  // the next one to print
  Pose last_pose_ = Pose::Identity();
  Vec3 last_place_ = Vec3::Zero();  // its tip, as printed
  JointVector last_joints_;
  std::vector<std::string> triggers_;  // at the start of the next motion
  std::size_t spl_points_ = 0;         // of the open block
  std::string block_speed_;
  EmittedProgram out_;
  Diagnostics diagnostics_;
};

}  // namespace

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  return Emitter(machine, program).run();
}

const Dialect kDialect = {
    "krl",
    "KUKA KRL (KSS 8), LIN in the part's frame and PTP, exact stop, C_DIS or SPLINE",
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
