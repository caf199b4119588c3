#include "formats/nc/macro_variables.h"

#include <limits>

#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr double kVacant = std::numeric_limits<double>::quiet_NaN();
constexpr int kBlockEnd = 5001, kPosition = 5041, kModal = 4001, kLastModal = 4130;
constexpr int kAlarm = 3000, kStop = 3006;

bool is_common(int index) {
  return (index >= 100 && index <= 199) || (index >= 500 && index <= 999);
}

}  // namespace

MacroVariables::Locals MacroVariables::vacant() {
  Locals locals;
  locals.fill(kVacant);
  return locals;
}

ParameterValue MacroVariables::position(int axis, int index) const {
  const Coordinates& coordinates = state_.coordinates;
  if (((coordinates.unknown() >> axis) & 1) != 0) {
    return {0.0, "#" + std::to_string(index) +
                     " is a position that the program has not given yet; move there by a program "
                     "word before"};
  }
  const auto place = static_cast<std::size_t>(axis);
  const double value = coordinates.program_from_world(coordinates.world())[place];
  const bool rotary = axis >= 3 && axis < 6;
  return {rotary ? degrees_from_radians(value) : value / state_.modal.unit, {}};
}

ParameterValue MacroVariables::modal_code(int index) const {
  const ModalState& modal = state_.modal;
  switch (index) {
    case 4001:
      return {modal.motion / 10.0, {}};
    case 4002:
      return {modal.plane / 10.0, {}};
    case 4003:
      return {modal.incremental ? 91.0 : 90.0, {}};
    case 4005:
      return {modal.inverse_time ? 93.0 : 94.0, {}};
    case 4006:
      return {modal.unit != 1.0 ? 20.0 : 21.0, {}};
    case 4014:
      return {53.0 + state_.coordinates.system(), {}};
    default:
      return {0.0, "#" + std::to_string(index) + " is a system variable that is not read"};
  }
}

ParameterValue MacroVariables::numbered(int index) const {
  if (index == 0) return {kVacant, {}};
  if (index <= kLocals) return {locals_.back()[static_cast<std::size_t>(index)], {}};
  if (is_common(index)) {
    const auto found = numbers_.find(index);
    return {found == numbers_.end() ? kVacant : found->second, {}};
  }
  for (const int first : {kBlockEnd, kPosition}) {
    if (index >= first && index < first + kAxisWords) return position(index - first, index);
  }
  if (index >= kModal && index <= kLastModal) return modal_code(index);
  return {0.0,
          "#" + std::to_string(index) + " is a variable of the control, which is not known here"};
}

ParameterValue MacroVariables::named(std::string_view name) const {
  return {0.0, "there are no named variables: #<" + std::string(name) + ">"};
}

std::string MacroVariables::refusal(const EvaluatedAssignment& assignment) const {
  const int index = assignment.index;
  if ((index >= 1 && index <= kLocals) || is_common(index)) return {};
  if (index == kAlarm) return "the program stops here with an alarm (#3000)";
  if (index == kStop) return "the program stops here with a message (#3006); write M0";
  return "#" + std::to_string(index) + " is a variable of the control and is not set here";
}

void MacroVariables::assign(const EvaluatedAssignment& assignment) {
  if (assignment.index <= kLocals) {
    locals_.back()[static_cast<std::size_t>(assignment.index)] = assignment.value.value;
  } else {
    numbers_[assignment.index] = assignment.value.value;
  }
}

void MacroVariables::enter(const CallScope& scope) {
  // A call by M98 works with the variables of its caller.
  Locals locals = scope.kind == CallScope::Kind::macro ? vacant() : locals_.back();
  for (const auto& [index, value] : scope.arguments) {
    locals[static_cast<std::size_t>(index)] = value;
  }
  locals_.push_back(locals);
  shared_.push_back(scope.kind != CallScope::Kind::macro);
}

void MacroVariables::leave() {
  const Locals locals = locals_.back();
  locals_.pop_back();
  if (shared_.back()) locals_.back() = locals;
  shared_.pop_back();
}

}  // namespace smoothpost::nc
