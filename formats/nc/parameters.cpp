#include "formats/nc/parameters.h"

#include <utility>

#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr int kHome = 5161, kSecondHome = 5181, kShiftActive = 5210, kShift = 5211;
constexpr int kSystem = 5220, kFirstOffset = 5221, kLastOffset = 5390, kOffsetStep = 20;
constexpr int kTool = 5400, kToolOffset = 5401, kLastToolData = 5413;
constexpr int kPosition = 5420, kLastPosition = 5428;

bool is_rotary(std::size_t axis) { return axis >= 3 && axis < 6; }

bool is_system(int index) {
  return (index >= kHome && index <= kLastOffset) || (index >= kTool && index <= kLastPosition);
}

/// Named values that the controller computes; the ones that are not read here have no value.
bool is_predefined(std::string_view name) {
  return name.starts_with("_hal[") || name.starts_with("_ini[") || name == "_vmajor" ||
         name == "_vminor" || name == "_line" || name == "_task" || name == "_call_level" ||
         name == "_remap_level" || name == "_feed" || name == "_rpm" || name == "_value" ||
         name == "_value_returned" || name == "_ccomp" || name == "_spindle_on" ||
         name == "_mist" || name == "_flood" || name == "_feed_override" ||
         name == "_speed_override" || name == "_adaptive_feed" || name == "_feed_hold" ||
         name == "_spindle_css_mode" || name == "_ijk_absolute_mode" ||
         name == "_lathe_diameter_mode" || name == "_lathe_radius_mode" ||
         name == "_selected_pocket" || name == "_current_pocket" || name == "_tool_offset";
}

constexpr std::string_view kComputed[] = {"_metric",        "_imperial",     "_absolute",
                                          "_incremental",   "_inverse_time", "_units_per_minute",
                                          "_plane",         "_coord_system", "_current_tool",
                                          "_selected_tool", "_motion_mode"};

int axis_of(std::string_view name) {
  if (name.size() != 2 || name[0] != '_') return -1;
  const char letter = static_cast<char>(name[1] - 32);
  const std::size_t axis = kAxisLetters.find(letter);
  return axis == std::string_view::npos ? -1 : static_cast<int>(axis);
}

bool is_read_only(std::string_view name) {
  for (const std::string_view computed : kComputed) {
    if (computed == name) return true;
  }
  return axis_of(name) >= 0 || is_predefined(name);
}

}  // namespace

double Parameters::length_in(double unit, std::size_t axis, double value) const {
  return is_rotary(axis) ? degrees_from_radians(value) : value / unit;
}

double Parameters::position(std::size_t axis) const {
  const AxisWords program = coordinates_.program_from_world(coordinates_.world());
  return length_in(modal_.unit, axis, program[axis]);
}

double Parameters::system_value(int index) const {
  const double unit = settings_.inch_default ? kMillimetresPerInch : 1.0;
  const auto axis = [&](int first) { return static_cast<std::size_t>(index - first); };
  if (index >= kPosition) return position(axis(kPosition));
  if (index == kTool) return modal_.spindle_tool;
  if (index >= kToolOffset && index < kToolOffset + kAxisWords) {
    return length_in(unit, axis(kToolOffset), coordinates_.tool()[axis(kToolOffset)]);
  }
  if (index >= kFirstOffset && index <= kLastOffset) {
    const int system = (index - kFirstOffset) / kOffsetStep + 1;
    const auto place = static_cast<std::size_t>((index - kFirstOffset) % kOffsetStep);
    if (system > kWorkSystems || place > kAxisWords) return 0.0;
    const WorkOffset& offset = coordinates_.offset(system);
    if (place == kAxisWords) return degrees_from_radians(offset.rotation);
    return length_in(unit, place, offset.words[place]);
  }
  if (index == kSystem) return coordinates_.system();
  if (index >= kShift && index < kShift + kAxisWords) {
    return length_in(unit, axis(kShift), coordinates_.stored_shift()[axis(kShift)]);
  }
  if (index == kShiftActive) return coordinates_.shift_active() ? 1.0 : 0.0;
  for (const auto& [first, home] : {std::pair{kHome, &first_}, std::pair{kSecondHome, &second_}}) {
    if (index >= first && index < first + kAxisWords) {
      return length_in(unit, axis(first), home->machine[axis(first)]);
    }
  }
  return 0.0;
}

ParameterValue Parameters::numbered(int index) const {
  if (is_system(index)) {
    const bool position = index >= kPosition && index < kPosition + kAxisWords;
    if (position && ((coordinates_.unknown() >> (index - kPosition)) & 1) != 0) {
      return {0.0, "#" + std::to_string(index) +
                       " is a position that the program has not given yet; move there by a "
                       "program word before"};
    }
    if (index > kToolOffset + kAxisWords - 1 && index <= kLastToolData) {
      return {0.0, "#" + std::to_string(index) +
                       " is a value of the controller's tool table, which is not known here"};
    }
    return {system_value(index), {}};
  }
  const auto found = numbers_.find(index);
  return {found == numbers_.end() ? 0.0 : found->second, {}};
}

ParameterValue Parameters::named(std::string_view name) const {
  if (const int axis = axis_of(name); axis >= 0) return numbered(kPosition + axis);
  const bool inch = modal_.unit != 1.0;
  if (name == "_metric") return {inch ? 0.0 : 1.0, {}};
  if (name == "_imperial") return {inch ? 1.0 : 0.0, {}};
  if (name == "_absolute") return {modal_.incremental ? 0.0 : 1.0, {}};
  if (name == "_incremental") return {modal_.incremental ? 1.0 : 0.0, {}};
  if (name == "_inverse_time") return {modal_.inverse_time ? 1.0 : 0.0, {}};
  if (name == "_units_per_minute") return {modal_.inverse_time ? 0.0 : 1.0, {}};
  if (name == "_plane") return {static_cast<double>(modal_.plane), {}};
  if (name == "_motion_mode") {
    return {modal_.motion < 0 ? 800.0 : static_cast<double>(modal_.motion), {}};
  }
  if (name == "_current_tool") return {static_cast<double>(modal_.spindle_tool), {}};
  if (name == "_selected_tool") return {static_cast<double>(modal_.words.tool), {}};
  if (name == "_coord_system") {
    const int system = coordinates_.system();
    return {system <= 6 ? 530.0 + 10.0 * system : 584.0 + system, {}};
  }
  if (is_predefined(name)) {
    return {0.0, "#<" + std::string(name) +
                     "> is a value of the running controller, which is not "
                     "known here"};
  }
  const auto found = names_.find(std::string(name));
  if (found != names_.end()) return {found->second, {}};
  return {0.0, "the parameter #<" + std::string(name) + "> has no value here"};
}

std::string Parameters::refusal(const EvaluatedAssignment& assignment) const {
  if (assignment.index == 0) {
    if (!is_read_only(assignment.name)) return {};
    return "#<" + assignment.name + "> can only be read";
  }
  if (!is_system(assignment.index)) return {};
  const std::string name = "#" + std::to_string(assignment.index);
  if (assignment.index >= kTool) return name + " can only be read";
  return name +
         " is a stored position or offset and can only be read in this version; write G10 "
         "L2, G28.1, G52 or G92";
}

void Parameters::assign(const EvaluatedAssignment& assignment) {
  if (assignment.index == 0) {
    names_[assignment.name] = assignment.value.value;
  } else {
    numbers_[assignment.index] = assignment.value.value;
  }
}

}  // namespace smoothpost::nc
