#include "formats/nc/parameters.h"

#include <utility>

#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

constexpr int kProbe = 5061, kLastProbe = 5070, kInput = 5399;
constexpr int kHome = 5161, kSecondHome = 5181, kShiftActive = 5210, kShift = 5211;
constexpr int kSystem = 5220, kFirstOffset = 5221, kLastOffset = 5390, kOffsetStep = 20;
constexpr int kTool = 5400, kToolOffset = 5401, kToolDiameter = 5410, kLastToolData = 5413;
constexpr int kPosition = 5420, kLastPosition = 5428;

bool is_rotary(std::size_t axis) { return axis >= 3 && axis < 6; }

bool is_system(int index) {
  return (index >= kHome && index <= kLastOffset) || (index >= kTool && index <= kLastPosition);
}

/// Values of the running controller, which are not read here.
bool is_of_controller(std::string_view name) {
  return name.starts_with("_hal[") || name.starts_with("_ini[") || name == "_vminor" ||
         name == "_task" || name == "_remap_level" || name == "_feed_override" ||
         name == "_speed_override" || name == "_adaptive_feed" || name == "_feed_hold" ||
         name == "_selected_pocket" || name == "_current_pocket";
}

constexpr std::string_view kComputed[] = {"_metric",
                                          "_imperial",
                                          "_absolute",
                                          "_incremental",
                                          "_inverse_time",
                                          "_plane",
                                          "_coord_system",
                                          "_current_tool",
                                          "_selected_tool",
                                          "_motion_mode",
                                          "_units_per_minute",
                                          "_units_per_rev",
                                          "_line",
                                          "_call_level",
                                          "_value",
                                          "_value_returned",
                                          "_feed",
                                          "_rpm",
                                          "_spindle_on",
                                          "_spindle_cw",
                                          "_mist",
                                          "_flood",
                                          "_ccomp",
                                          "_tool_offset",
                                          "_retract_r_plane",
                                          "_retract_old_z",
                                          "_ijk_absolute_mode",
                                          "_lathe_diameter_mode",
                                          "_lathe_radius_mode",
                                          "_spindle_css_mode",
                                          "_spindle_rpm_mode",
                                          "_vmajor"};

/// `_x` or `_abs_x`: the axis, and whether it counts in machine coordinates.
std::optional<std::pair<std::size_t, bool>> position_name(std::string_view name) {
  const bool machine = name.starts_with("_abs_");
  const std::size_t prefix = machine ? 5 : 1;
  if (name.size() != prefix + 1 || name[0] != '_') return {};
  const std::size_t axis = kAxisLetters.find(static_cast<char>(name[prefix] - 32));
  if (axis == std::string_view::npos) return {};
  return std::pair{axis, machine};
}

bool is_read_only(std::string_view name) {
  for (const std::string_view computed : kComputed) {
    if (computed == name) return true;
  }
  return position_name(name).has_value() || is_of_controller(name);
}

}  // namespace

double Parameters::length_in(double unit, std::size_t axis, double value) const {
  return is_rotary(axis) ? degrees_from_radians(value) : value / unit;
}

ParameterValue Parameters::position(std::size_t axis, const std::string& name, bool machine) const {
  const Coordinates& coordinates = state_.coordinates;
  if (state_.modal.radius_compensation != 400) {
    return {0.0, name +
                     " is a position of the tool's centre under cutter radius compensation, which "
                     "the next motion changes; write G40 before"};
  }
  if (((coordinates.unknown() >> axis) & 1) != 0) {
    return {0.0, name +
                     " is a position that the program has not given yet; move there by a program "
                     "word before"};
  }
  const AxisWords words =
      machine ? coordinates.world() : coordinates.program_from_world(coordinates.world());
  const double tool = machine ? coordinates.tool()[axis] : 0.0;
  return {length_in(state_.modal.unit, axis, words[axis] + tool), {}};
}

double Parameters::system_value(int index) const {
  const double unit = settings_.inch_default ? kMillimetresPerInch : 1.0;
  const Coordinates& coordinates = state_.coordinates;
  const auto axis = [&](int first) { return static_cast<std::size_t>(index - first); };
  if (index == kTool) return state_.modal.spindle_tool;
  if (index >= kFirstOffset && index <= kLastOffset) {
    const int system = (index - kFirstOffset) / kOffsetStep + 1;
    const auto place = static_cast<std::size_t>((index - kFirstOffset) % kOffsetStep);
    if (system > kWorkSystems || place > kAxisWords) return 0.0;
    const WorkOffset& offset = coordinates.offset(system);
    if (place == kAxisWords) return degrees_from_radians(offset.rotation);
    return length_in(unit, place, offset.words[place]);
  }
  if (index == kSystem) return coordinates.system();
  if (index >= kShift && index < kShift + kAxisWords) {
    return length_in(unit, axis(kShift), coordinates.stored_shift()[axis(kShift)]);
  }
  if (index == kShiftActive) return coordinates.shift_active() ? 1.0 : 0.0;
  for (const auto& [first, home] :
       {std::pair{kHome, &state_.first_home}, std::pair{kSecondHome, &state_.second_home}}) {
    if (index >= first && index < first + kAxisWords) {
      return length_in(unit, axis(first), home->machine[axis(first)]);
    }
  }
  return 0.0;
}

/// #5401 to #5413: the tool table's row of the tool in the spindle.
ParameterValue Parameters::tool_value(int index) const {
  const auto found = state_.tools.find(state_.modal.spindle_tool);
  const ToolData data = found == state_.tools.end() ? ToolData{} : found->second;
  const double unit = settings_.inch_default ? kMillimetresPerInch : 1.0;
  std::optional<double> value;
  switch (index) {
    case kToolOffset + 2:
      if (data.length) value = *data.length / unit;
      break;
    case kToolDiameter:
      if (data.radius) value = 2.0 * *data.radius / unit;
      break;
    case kToolDiameter + 1:
      value = data.front_angle;
      break;
    case kToolDiameter + 2:
      value = data.back_angle;
      break;
    case kLastToolData:
      if (data.orientation) value = *data.orientation;
      break;
    default:
      if (data.length) value = 0.0;  // tools are known along their axis only
      break;
  }
  if (value) return {*value, {}};
  return {0.0, "#" + std::to_string(index) +
                   " is a value of the controller's tool table, which is not known here"};
}

double Parameters::value_of(int index) const {
  const auto found = numbers_.find(index);
  return found == numbers_.end() ? 0.0 : found->second;
}

ParameterValue Parameters::numbered(int index) const {
  const std::string name = "#" + std::to_string(index);
  if (index >= kPosition && index <= kLastPosition) {
    return position(static_cast<std::size_t>(index - kPosition), name, false);
  }
  if (index >= kToolOffset && index <= kLastToolData) return tool_value(index);
  if (is_system(index)) return {system_value(index), {}};
  const bool measured = (index >= kProbe && index <= kLastProbe) || index == kInput;
  if (measured && numbers_.count(index) == 0) {
    return {0.0, name + " is a result of probing or of an input (M66), which is not known here"};
  }
  return {value_of(index), {}};
}

std::optional<double> Parameters::computed(std::string_view name) const {
  const ModalState& modal = state_.modal;
  const auto flag = [](bool set) { return std::optional<double>(set ? 1.0 : 0.0); };
  if (name == "_metric") return flag(modal.unit == 1.0);
  if (name == "_imperial") return flag(modal.unit != 1.0);
  if (name == "_absolute") return flag(!modal.incremental);
  if (name == "_incremental") return flag(modal.incremental);
  if (name == "_inverse_time") return flag(modal.inverse_time);
  if (name == "_units_per_minute") return flag(!modal.inverse_time && !modal.per_turn);
  if (name == "_units_per_rev") return flag(modal.per_turn);
  if (name == "_plane") return modal.plane;
  if (name == "_motion_mode") return modal.motion < 0 ? 800.0 : modal.motion;
  if (name == "_current_tool") return modal.spindle_tool;
  if (name == "_selected_tool") return modal.words.tool;
  if (name == "_line") return static_cast<double>(state_.place.next);
  if (name == "_call_level") return state_.place.call_level;
  if (name == "_value") return result_.value_or(0.0);
  if (name == "_value_returned") return flag(result_.has_value());
  if (name == "_feed")
    return modal.linear_feed * (modal.per_turn ? 1.0 : kSecondsPerMinute) / modal.unit;
  if (name == "_rpm") return modal.words.speed;
  if (name == "_spindle_on") return flag(modal.spindle == 3 || modal.spindle == 4);
  if (name == "_spindle_cw") return flag(modal.spindle == 3);
  if (name == "_mist") return flag(modal.mist);
  if (name == "_flood") return flag(modal.flood);
  if (name == "_tool_offset") {
    return flag(modal.length_tool != 0 || state_.coordinates.tool()[2] != 0.0);
  }
  if (name == "_retract_r_plane") return flag(!modal.retract_to_old);
  if (name == "_retract_old_z") return flag(modal.retract_to_old);
  if (name == "_ijk_absolute_mode") return flag(modal.arc_absolute);
  if (name == "_lathe_diameter_mode") return flag(modal.diameter);
  if (name == "_lathe_radius_mode") return flag(!modal.diameter);
  if (name == "_spindle_rpm_mode") return 1.0;
  if (name == "_ccomp") return modal.radius_compensation;
  if (name == "_spindle_css_mode") return 0.0;
  if (name == "_vmajor") return 2.9;
  if (name == "_coord_system") {
    const int system = state_.coordinates.system();
    return system <= 6 ? 530.0 + 10.0 * system : 584.0 + system;
  }
  return {};
}

ParameterValue Parameters::named(std::string_view name) const {
  const std::string text = "#<" + std::string(name) + ">";
  if (const auto axis = position_name(name)) return position(axis->first, text, axis->second);
  if (const auto value = computed(name)) return {*value, {}};
  if (is_of_controller(name)) {
    return {0.0, text + " is a value of the running controller, which is not known here"};
  }
  const Names& names = name.starts_with('_') ? globals_ : names_.back();
  const auto found = names.find(std::string(name));
  if (found != names.end()) return {found->second, {}};
  return {0.0, "the parameter " + text + " has no value here"};
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
  const double value = assignment.value.value;
  if (assignment.index != 0) {
    numbers_[assignment.index] = value;
  } else if (assignment.name.starts_with('_')) {
    globals_[assignment.name] = value;
  } else {
    names_.back()[assignment.name] = value;
  }
}

/// Positions as program words, in the units of the probing block.
void Parameters::set_probed() {
  const Coordinates& coordinates = state_.coordinates;
  const AxisWords words = coordinates.program_from_world(coordinates.world());
  for (std::size_t i = 0; i < words.size(); ++i) {
    const int index = kProbe + static_cast<int>(i);
    if (((coordinates.unknown() >> i) & 1) != 0) {
      numbers_.erase(index);
    } else {
      numbers_[index] = length_in(state_.modal.unit, i, words[i]);
    }
  }
  numbers_[kLastProbe] = 0.0;
}

void Parameters::enter(const CallScope& scope) {
  Saved saved;
  saved.own_numbers = scope.kind == CallScope::Kind::subroutine;
  if (saved.own_numbers) {
    for (std::size_t i = 0; i < kMostArguments; ++i) {
      const int index = static_cast<int>(i) + 1;
      saved.values[i] = value_of(index);
      numbers_[index] = 0.0;
    }
    for (const auto& [index, value] : scope.arguments) numbers_[index] = value;
  }
  saved_.push_back(saved);
  names_.emplace_back();
}

void Parameters::leave() {
  const Saved saved = saved_.back();
  saved_.pop_back();
  names_.pop_back();
  if (!saved.own_numbers) return;
  for (std::size_t i = 0; i < kMostArguments; ++i) {
    numbers_[static_cast<int>(i) + 1] = saved.values[i];
  }
}

}  // namespace smoothpost::nc
