#pragma once

#include <array>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "formats/nc/interpreter.h"
#include "formats/nc/parameter_store.h"

namespace smoothpost::nc {

/// The variables of the Fanuc family: #1 to #33 of the present call of G65 (vacant until they are
/// assigned), #100 to #199 and #500 to #999 of the program, which are vacant at its start, and of
/// the system variables the position in program coordinates (#5001 to #5009 and #5041 to #5049)
/// and the modal codes #4001, #4002, #4003, #4005, #4006, #4014.
class MacroVariables final : public ParameterStore {
 public:
  explicit MacroVariables(ControllerState state) : state_(state), locals_(1, vacant()) {}

  ParameterValue numbered(int index) const override;
  ParameterValue named(std::string_view name) const override;
  std::string refusal(const EvaluatedAssignment& assignment) const override;
  void assign(const EvaluatedAssignment& assignment) override;
  void enter(const CallScope& scope) override;
  void leave() override;
  void set_result(std::optional<double>) override {}

 private:
  static constexpr int kLocals = 33;
  using Locals = std::array<double, kLocals + 1>;

  static Locals vacant();
  ParameterValue position(int axis, int index) const;
  ParameterValue modal_code(int index) const;

  ControllerState state_;
  std::vector<Locals> locals_;  ///< one of each call level
  std::vector<bool> shared_;    ///< of each call: it works with the variables of its caller
  std::unordered_map<int, double> numbers_;
};

}  // namespace smoothpost::nc
