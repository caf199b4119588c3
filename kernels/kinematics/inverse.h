#pragma once

#include <array>
#include <optional>
#include <variant>

#include "kernels/kinematics/rotary_pair.h"
#include "kernels/kinematics/six_r.h"

namespace smoothpost {

/// The inverse solutions of one tool pose; index = branch, stable per chain.
struct InverseSolutions {
  std::array<JointVector, 8> q;
  std::array<bool, 8> valid{};
  int count = 0;  ///< branches of the chain: 2 or 8
};

/// The closed form that a chain has: two rotaries and three linears (RotaryPair), or a six-axis arm
/// with spherical wrist (SixR).
class Inverse {
 public:
  /// Nothing when the chain has neither.   Cost: once per machine.
  static std::optional<Inverse> from(const ScrewChain& chain);

  /// A six-axis arm takes the whole rotation of a pose; the others only its tool axis.
  bool takes_rotation() const { return std::holds_alternative<SixR>(form_); }
  const RotaryPair* rotary_pair() const { return std::get_if<RotaryPair>(&form_); }
  const SixR* six_r() const { return std::get_if<SixR>(&form_); }
  const ScrewChain& chain() const;

  /// All branches for the tool pose `tool` (X_WT); angles in (−π, π], no limits applied. Held
  /// joints and free angles of singular poses take the values of `near`.
  /// @pre near.size() == number of joints   @throws ContractViolation if not.
  InverseSolutions solve(const Pose& tool, const JointVector& near) const;

  /// The solution that the joints come to from `near` by the smallest largest rotary step, each
  /// rotary at its nearest turn; limits are not applied. Nothing when the pose is out of reach.
  /// This is what a controller does that follows a pose. A tie goes to the lower branch.
  /// @pre near.size() == number of joints   @throws ContractViolation if not.
  std::optional<JointVector> nearest(const Pose& tool, const JointVector& near) const;

 private:
  explicit Inverse(std::variant<RotaryPair, SixR> form) : form_(std::move(form)) {}
  std::variant<RotaryPair, SixR> form_;
};

}  // namespace smoothpost
