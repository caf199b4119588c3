#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "kernels/kinematics/inverse.h"
#include "machines/dialects/dialect.h"
#include "machines/dialects/gcode_text.h"

// Words of tool moves on machines with two rotary axes.
namespace smoothpost::gcode {

/// The same program with its part's frame along the machine's axes, at the same zero and with every
/// joint 0: what controls need whose work offsets do not rotate. The poses of its moves are turned
/// into it; what is read back from it has that frame as its part.   Cost: a copy.
MachineProgram along_machine_axes(const MachineProgram& program);

/// Whether along_machine_axes() would change a pose.
bool is_turned(const MachineProgram& program);

/// A tool that tool moves are made with.
struct ProgramTool {
  int number = 1;
  double length = 0.0;  ///< mm
};

/// The number that a tool change names, from 1 to `most`; nothing: it is none, or names no such.
std::optional<int> tool_number(const MachineAction& action, int most);

/// The tools of a program's tool moves in the order of their first ones. A number is that of the
/// last tool_number() before, or 1.   Cost: linear in the moves, times the tools.
std::vector<ProgramTool> tools_of(const MachineProgram& program, int most);

/// Prints the words of tool moves: X Y Z of the tip in W, with the positions of the rotary axes or
/// the vector of the tool axis; only what changed, at least one. Follows the program move by move.
class ToolWords {
 public:
  /// All are kept by reference.
  ToolWords(const MachineDefinition& machine, const MachineProgram& program, AxisWords& words);

  struct Printed {
    std::string text;  ///< with a blank in front of each word
    /// Of the printed digits: the tip's way in the program's unit; where the tip stands, how far
    /// the rotary axes (or the vector) turn, deg.
    double way = 0.0;
  };
  /// With the joints that the pose has close to those of the plan: a control that is told them does
  /// not have to choose.
  Printed positions(const MachineMove& move);
  /// With the tool axis behind the addresses `names`, all three or none.
  Printed vector(const MachineMove& move, const std::array<const char*, 3>& names, int decimals);
  /// The program is at the end of a joint move.
  void stand(const MachineMove& move);
  /// Rounded to the digits of the program.
  double printed_length(double mm) const;

 private:
  std::string tip(const MachineMove& move, double& way);
  double printed_angle(double angle) const;

  const MachineDefinition& machine_;
  AxisWords& words_;
  ScrewChain chain_;
  std::optional<Inverse> inverse_;
  JointVector joints_;
  Vec3 tip_ = Vec3::Zero();
  Vec3 axis_ = Vec3::UnitZ();
};

/// What the words of tool moves say, for reading them back: which of them are known, where the tool
/// is and how far it went.
class ToolFollowing {
 public:
  explicit ToolFollowing(const MachineDefinition& machine);

  /// Tool moves begin: nothing is known any more but where the tool stands.
  void begin(bool by_vector);
  void name_tip(int coordinate, double mm) {
    tip_[coordinate] = mm;
    tip_named_ |= 1U << coordinate;
  }
  void name_rotary(int j, double angle) {
    joints_[j] = angle;
    rotary_named_ |= JointMask{1} << j;
  }
  /// False when it is far from unit length.
  bool name_vector(const Vec3& vector);
  /// X Y Z and the tool's axis have been named since begin().
  bool is_complete() const;
  /// X_WT; its rotation about the tool axis is free, and here that of the rotary positions or the
  /// least one.   @pre is_complete()
  Pose pose() const;

  /// A joint move ended at these joints, all known; the tip's place is given when it is known.
  void stand(const JointVector& joints, const std::optional<Vec3>& tip);
  struct Way {
    double mm = 0.0;
    double degrees = 0.0;  ///< of the rotary axes or the vector, where the tip stands
    /// Speed words are over this: the tip's way in the program's unit (`scale` mm), or the turn.
    double in_program(double scale) const { return mm > 0.0 ? mm / scale : degrees; }
  };
  /// Ends a tool move. Nothing when its start is not known.
  std::optional<Way> arrive();

 private:
  Vec3 axis() const;

  const MachineDefinition& machine_;
  ScrewChain chain_;
  bool by_vector_ = false;
  Vec3 tip_ = Vec3::Zero();
  JointVector joints_;
  Vec3 vector_ = Vec3::UnitZ();
  unsigned tip_named_ = 0;
  JointMask rotary_named_ = 0;
  bool vector_named_ = false;
  std::optional<Vec3> last_tip_;
  JointVector last_joints_;
  Vec3 last_axis_ = Vec3::UnitZ();
};

}  // namespace smoothpost::gcode
