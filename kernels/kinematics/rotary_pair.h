#pragma once

#include <array>
#include <optional>

#include "kernels/kinematics/screw_chain.h"

namespace smoothpost {

/// The solutions of one cutter location: at most two branches (index = branch, stable per chain).
struct RotaryPairSolutions {
  std::array<JointVector, 2> q;
  std::array<bool, 2> valid{false, false};
  bool at_pole = false;  ///< the tool axis is parallel to the first rotary: its angle is free and was held
};

/// Universal closed form for chains with two free rotaries and three free linears, in any order and
/// direction, with any number of held (redundant) joints.
class RotaryPair {
 public:
  /// Nothing when the chain is not of this kind (count of free joints, dependent linears).
  static std::optional<RotaryPair> from(const ScrewChain& chain);

  /// Joint values that bring the tool to `location`; held joints and, at the pole, the first rotary take
  /// their value from `held`. Rotary angles are in (−π, π] (no turns, no limits applied).
  /// @pre held.size() == number of joints
  RotaryPairSolutions solve(const CutterLocation& location, const JointVector& held) const;

  /// Joint index of the rotary next to the workpiece end of the chain: the one that is free at the pole.
  int first_rotary() const { return first_; }
  int second_rotary() const { return second_; }
  const ScrewChain& chain() const { return chain_; }

 private:
  ScrewChain chain_;
  int first_ = 0;
  int second_ = 0;
};

}  // namespace smoothpost
