#pragma once

#include <array>
#include <optional>
#include <string>

#include "kernels/kinematics/screw_chain.h"
#include "machines/dialects/program_printer.h"
#include "machines/dialects/program_reading.h"
#include "machines/dialects/rapid_text.h"

// Printing and reading of arm programs: joint moves, straight moves of the tool in the part's
// frame, frames that the program states itself.
namespace smoothpost::robot {

class RobotPrinter : public ProgramPrinter {
 protected:
  /// `least_radius`: mm; corners that may be rounded by less stay exact.
  RobotPrinter(const MachineDefinition& machine, const MachineProgram& program,
               const char* language, double least_radius);

  /// PR202: axes are not A1 to A6 (and E1 to E6); PR203: path mode spline, tool moves on a machine
  /// whose part moves, a first move that does not name every axis.
  void check() override;

  const rapid::RobotAxes& axes() const { return axes_; }
  Pose tool() const;

  /// The way of a tool move from where the program stands.
  struct Leg {
    double length = 0.0;  ///< mm, between the printed tips
    double turn = 0.0;    ///< rad
    bool moves_tip() const { return length >= 1e-6; }
  };
  Leg leg_to(const MachineMove& move) const { return leg(pose_, move); }
  /// Says that the program stands at the end of `move`. print_move() ends with it.
  void arrive(const MachineMove& move);
  bool has_started() const { return started_; }

  /// Share of the axes' speed (the machine file's) at which the slowest axis takes the planned time
  /// from where the program stands, rounded down to `decimals` of a percent, in [least, 99.99]:
  /// percent. For controls whose joint moves have no time.   @pre has_started()
  double joint_percent(const MachineMove& move, int decimals) const;

  /// Whether the control may round the corner behind move i: a blend of the least radius or more
  /// was planned, a tool move follows, both have a length, and only comments and taken actions are
  /// between them.
  bool may_round(std::size_t i) const;
  bool has_blend(const MachineMove& move) const { return move.blend >= least_radius_; }

  /// PR222, when `action` is to act on the fly and the corner where it stands would be rounded were
  /// it not for it: the robot stops for it, because of `reason`.
  void warn_on_the_fly(const std::string& words, const MachineAction& action, const char* reason);
  void warn(const char* code, std::uint32_t input_line, std::string text);

 private:
  Pose pose_after(const MachineMove& move) const;
  Vec3 printed(const Pose& pose) const;
  Leg leg(const Pose& from, const MachineMove& move) const;

  const char* language_;
  double least_radius_;
  rapid::RobotAxes axes_;
  ScrewChain chain_;
  bool started_ = false;
  Pose pose_ = Pose::Identity();
  JointVector joints_;
};

class RobotReading : public ProgramReading {
 protected:
  /// `frame_code`: of errors about frames and tools.
  RobotReading(const MachineDefinition& machine, const std::string& file, const char* code,
               const char* frame_code);

  const rapid::RobotAxes& axes() const { return axes_; }
  double tool_length() const { return tool_length_; }

  /// Frames that the text states; the same one again is no change. The tool may be longer or
  /// shorter than the machine file's along its axis, nothing else.
  void set_part(TextPlace at, const Pose& part);
  void set_tool(TextPlace at, const Pose& tool);
  bool has_frames() const { return result.part && result.tool_frame; }

  /// A joint move to joints(), which set_joint() has set. Without seconds it is a rapid.
  void add_joint_move(TextPlace at, std::optional<double> seconds);

  /// How long a joint move to joints() takes at that share of the axes' speed (the machine file's);
  /// nothing when it is not known where it starts.
  std::optional<double> seconds_at(double percent) const;

  /// How long a straight move takes: that many seconds, or the longer of way and turn. A rapid has
  /// neither.
  struct LineSpeed {
    std::optional<double> seconds;
    double tip = 0.0;   ///< mm/s
    double turn = 0.0;  ///< rad/s
  };
  void add_line_move(TextPlace at, const Pose& tool, const LineSpeed& speed, double blend);

  /// What runs ahead of the motion needs a robot that stands.
  void needs_stop(TextPlace at);

 private:
  const char* frame_code_;
  rapid::RobotAxes axes_;
  double tool_length_ = 0.0;
  std::optional<Pose> pose_;
  std::optional<JointVector> stands_;  ///< the joints where the last joint move ended
};

}  // namespace smoothpost::robot
