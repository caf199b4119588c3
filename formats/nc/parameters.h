#pragma once

#include <string>
#include <string_view>
#include <unordered_map>

#include "formats/nc/flow_words.h"
#include "formats/nc/interpreter.h"
#include "formats/nc/parameter_store.h"

namespace smoothpost::nc {

/// The parameters of LinuxCNC: what the program assigned, and the system parameters, computed from
/// the modal state when they are asked for.
///
/// Lengths of #5161 to #5390 and of #5401 to #5410 are in the machine's unit
/// (InterpreterSettings::inch_default), #5420 to #5428 and named positions in the program's; angles
/// in degrees. #5061 to #5070 are known behind a probing motion only. A subroutine has its own #1
/// to #30 (0 without an argument) and its own names; names that begin with _ are those of the whole
/// program.
class Parameters final : public ParameterStore {
 public:
  Parameters(const InterpreterSettings& settings, ControllerState state)
      : settings_(settings), state_(state), names_(1) {}

  ParameterValue numbered(int index) const override;
  ParameterValue named(std::string_view name) const override;
  std::string refusal(const EvaluatedAssignment& assignment) const override;
  void assign(const EvaluatedAssignment& assignment) override;
  void enter(const CallScope& scope) override;
  void leave() override;
  void set_probed() override;
  void set_result(std::optional<double> value) override { result_ = value; }

 private:
  using Names = std::unordered_map<std::string, double>;
  struct Saved {
    std::array<double, kMostArguments> values{};
    bool own_numbers = false;
  };

  double system_value(int index) const;
  ParameterValue tool_value(int index) const;
  ParameterValue position(std::size_t axis, const std::string& name, bool machine) const;
  std::optional<double> computed(std::string_view name) const;
  double length_in(double unit, std::size_t axis, double value) const;
  double value_of(int index) const;

  const InterpreterSettings& settings_;
  ControllerState state_;
  std::unordered_map<int, double> numbers_;
  Names globals_;
  std::vector<Names> names_;  ///< one of each call level
  std::vector<Saved> saved_;
  std::optional<double> result_;
};

}  // namespace smoothpost::nc
