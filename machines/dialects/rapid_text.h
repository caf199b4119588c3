#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/kinematics/six_r.h"
#include "machines/definition/machine.h"

// Literals of RAPID.
namespace smoothpost::rapid {

/// `value` with at most `decimals` decimals.
std::string decimal(double value, int decimals);

/// Which axis of the machine file is which of the controller's; −1: none.
struct RobotAxes {
  std::array<int, 6> arm = {-1, -1, -1, -1, -1, -1};       ///< A1 to A6
  std::array<int, 6> external = {-1, -1, -1, -1, -1, -1};  ///< E1 to E6: eax_a to eax_f
  std::vector<std::string> unnamed;                        ///< axes with other names
  bool has_arm() const;
};
RobotAxes robot_axes(const MachineDefinition& machine);

/// The closed form of the six axes of the arm, whatever external axes there are; nothing when the
/// machine has none or its arm is of another kind.
std::optional<SixR> arm_form(const MachineDefinition& machine, const RobotAxes& axes);

/// A unit quaternion, w first and not negative, rounded to `decimals` and normalised again.
/// Guarantees (tests): length 1 within 1e-8 and the rotation within 1e-5 deg from 8 decimals on.
std::array<double, 4> printed_quaternion(const Mat3& rotation, int decimals);

/// [x,y,z],[w,x,y,z]
std::string pose_text(const Pose& pose, int digits, int quaternion_decimals);

/// [eax_a,...,eax_f]; axes that the machine has not are 9E9.
std::string external_text(const MachineDefinition& machine, const RobotAxes& axes,
                          const JointVector& joints);

/// [rax_1,...,rax_6]
std::string arm_text(const MachineDefinition& machine, const RobotAxes& axes,
                     const JointVector& joints);

/// Radius of the zone for a blend of `blend` mm: the largest of 1, 1.6, 2.5, 4, 6.3 times a power
/// of ten that is not above it, from 0.001 on; 0 below. So a program has few zones.
double blend_radius(double blend);

/// Speed that is printed for `speed` (mm/s or deg/s): four digits, not above speed · (1 + 2e-5).
double printed_speed(double speed);

/// Configuration data [cf1,cf4,cf6,cfx] of an arm: cf1, cf4, cf6 are floor(angle / 90 deg) of axes
/// 1, 4 and 6 (an angle within 1e-9 deg below a multiple counts as that multiple);
///   cfx = 4·(wrist centre behind axis 1) + 2·(wrist centre behind the lower arm) + (axis 5 < 0),
/// behind as SixR has it: bits 0 and 1 of its branch, for an arm whose axis 2 leans forward in its
/// positive sense. cfx is 0 for an arm without that geometry.
class ArmConfiguration {
 public:
  explicit ArmConfiguration(const MachineDefinition& machine);
  std::array<int, 4> at(const JointVector& joints) const;
  std::string text(const JointVector& joints) const;

 private:
  RobotAxes axes_;
  std::optional<SixR> arm_;
};

/// `SetDO name,value` and its kin as a signal that a trigger can set.
struct Signal {
  std::string option;  ///< DOp, GOp or AOp
  std::string name;
  std::string value;  ///< a number, as written
};
std::optional<Signal> signal_of(std::string_view statement);

/// Gives texts names: prefix1, prefix2, ... in the order of their first use.
class NamedTexts {
 public:
  explicit NamedTexts(std::string prefix) : prefix_(std::move(prefix)) {}
  std::string name_of(const std::string& text);
  /// Name and text of each, in that order.
  const std::vector<std::pair<std::string, std::string>>& all() const { return all_; }

 private:
  std::string prefix_;
  std::map<std::string, std::size_t> known_;
  std::vector<std::pair<std::string, std::string>> all_;
};

}  // namespace smoothpost::rapid
