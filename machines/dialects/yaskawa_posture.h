#pragma once

#include <array>
#include <optional>

#include "machines/dialects/rapid_text.h"

namespace smoothpost::yaskawa_jbi {

/// RCONF: which joints bring the arm to a Cartesian position, as [Yaskawa] 4.4 has it.
struct Posture {
  bool no_flip = false;             ///< axis 5 below 0
  bool lower = false;               ///< the elbow's second branch (SixR bit 1)
  bool rear = false;                ///< the wrist centre behind axis 1 (SixR bit 0)
  std::array<bool, 3> turned = {};  ///< axes 4, 6 and 1 (R, T, S) outside (−180°, 180°]
  bool operator==(const Posture&) const = default;
};

/// Postures of an arm, and back.
class Postures {
 public:
  /// Whether the arm of `machine` has the closed form that postures need: exists().
  explicit Postures(const MachineDefinition& machine);
  bool exists() const { return arm_.has_value(); }

  /// The posture of joints (machine-file order). Nothing where a printed digit could change it:
  /// axis 5 or the turn of an axis within 0.01 deg of where it changes, or beyond ±360 deg.
  /// @pre exists()
  std::optional<Posture> of(const JointVector& joints) const;

  /// The six joints A1 to A6 of posture `posture` that bring the flange to X_MF.
  /// Nothing when the pose is out of reach, singular, or no solution has that posture.
  /// Guarantee (test): of() of what comes back is the posture, and its flange is at X_MF.
  /// @pre exists()
  std::optional<std::array<double, 6>> joints(const Pose& flange, const Posture& posture) const;

 private:
  rapid::RobotAxes axes_;
  std::optional<SixR> arm_;
  Pose flange_to_tip_ = Pose::Identity();  ///< X_FT of the chain's own tool
};

}  // namespace smoothpost::yaskawa_jbi
