#pragma once

#include <map>
#include <string>
#include <string_view>

#include "machines/dialects/dialect.h"

namespace smoothpost::krl {

/// `value` with at most `decimals` decimals.
std::string decimal(double value, int decimals);

/// Decimals that keep six digits of a small number and three decimals of a large one.
int decimals_of(double value);

/// The largest of 1, 1.6, 2.5, 4, 6.3 times a power of ten that is at most `distance` (mm), from
/// 0.001 on; 0 below. A few values are enough, and a program has fewer words.
double blend_distance(double distance);

bool is_arm_axis(const std::string& name);
bool is_external_axis(const std::string& name);

/// The text of a .src file while it is made: lines, variables that hold until they are set again,
/// targets in the digits of the machine file.
class ProgramText {
 public:
  explicit ProgramText(const MachineDefinition& machine);

  void reserve(std::size_t characters) { text_.reserve(characters); }
  void line(std::string_view line);
  std::uint32_t lines() const { return lines_; }
  std::string take() { return std::move(text_); }

  /// A line `variable`=`value`, unless it says what the last one said.
  void set(const char* variable, const std::string& value);
  /// $VEL.ORI1 and $VEL.ORI2, deg/s.
  void set_orientation_speed(double value);
  /// BAS(#VEL_PTP,percent)
  void set_joint_percent(double percent);
  /// What a variable was set to last; empty: nothing, or forgotten.
  std::string last(const char* variable) const;
  /// Every variable is stated again when it is next set.
  void forget() { printed_.clear(); }

  /// X to C of a pose. A keeps its last value where it is not unique.
  std::string pose(const Pose& pose);
  std::string joint(int j, double value) const;
  /// {..} of a pose and of the external axes at `joints`.
  std::string target(const Pose& pose, const JointVector& joints);

 private:
  const MachineDefinition& machine_;
  int angle_digits_ = 5;
  double held_a_ = 0.0;
  std::map<std::string, std::string> printed_;
  std::uint32_t lines_ = 0;
  std::string text_;
};

}  // namespace smoothpost::krl
