#pragma once

#include <string>
#include <string_view>
#include <unordered_map>

#include "formats/nc/coordinates.h"
#include "formats/nc/expression.h"
#include "formats/nc/interpreter.h"
#include "formats/nc/modal_state.h"

namespace smoothpost::nc {

/// What system parameters tell of; it outlives the parameters.
struct ControllerState {
  const Coordinates& coordinates;
  const ModalState& modal;
  const HomePosition& first_home;
  const HomePosition& second_home;
};

/// The parameters of one run of a program: what it assigned, and LinuxCNC's system parameters,
/// computed from the modal state when they are asked for.
///
/// Lengths of #5161 to #5390 and of #5401 to #5409 are in the machine's unit
/// (InterpreterSettings::inch_default), #5420 to #5428 in the program's; angles in degrees.
class Parameters final : public ParameterValues {
 public:
  Parameters(const InterpreterSettings& settings, ControllerState state)
      : settings_(settings),
        coordinates_(state.coordinates),
        modal_(state.modal),
        first_(state.first_home),
        second_(state.second_home) {}

  ParameterValue numbered(int index) const override;
  ParameterValue named(std::string_view name) const override;

  /// Why `#index` or `#<name>` cannot be assigned; empty: it can.
  std::string refusal(const EvaluatedAssignment& assignment) const;
  void assign(const EvaluatedAssignment& assignment);

 private:
  double system_value(int index) const;
  double length_in(double unit, std::size_t axis, double value) const;
  double position(std::size_t axis) const;

  const InterpreterSettings& settings_;
  const Coordinates& coordinates_;
  const ModalState& modal_;
  const HomePosition& first_;
  const HomePosition& second_;
  std::unordered_map<int, double> numbers_;
  std::unordered_map<std::string, double> names_;
};

}  // namespace smoothpost::nc
