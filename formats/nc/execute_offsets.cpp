#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1u << axis); }

/// G54 is 1, G59.3 is 9.
int system_of(GCode code) {
  if (code == 5000) return 0;  // G500 of siemens: no offset
  return code <= 590 ? (code - 540) / 10 + 1 : 6 + (code - 590);
}

}  // namespace

void Executor::work_system(const BlockWords& block) {
  const int system = system_of(block.code(GGroup::work_system));
  const auto pending = pending_offsets_.find(system);
  if (modal_.swivelled && (system != coordinates_.system() || pending != pending_offsets_.end())) {
    log_.error("NC245",
               "another work system in the plane of CYCLE800 is not read; write CYCLE800() before",
               at(block, GGroup::work_system));
    return;
  }
  if (pending != pending_offsets_.end()) {
    coordinates_.set_offset(system, pending->second);
    pending_offsets_.erase(pending);
    offset_dirty_ = true;
  }
  if (system == coordinates_.system()) return;
  coordinates_.select_system(system);
  modal_.polar.lost = modal_.polar.set;
  offset_dirty_ = true;
}

void Executor::announce_offset(std::uint32_t line) {
  offset_dirty_ = false;
  const int system = coordinates_.system();
  if (!systems_used_[static_cast<std::size_t>(system)]) {
    systems_used_[static_cast<std::size_t>(system)] = true;
    summary_.work_systems.push_back(system);
  }
  sink_.work_offset(coordinates_.origin(), coordinates_.rotation(), system, line);
}

void Executor::non_modal(const BlockWords& block, const BlockPlan& plan) {
  switch (block.code(GGroup::non_modal)) {
    case 100:
      if (block['L'] != 2.0 && block['L'] != 20.0) return set_tool_data(block);
      return set_work_offset(block, plan);
    case 280:
      return go_home(block, plan, first_home_);
    case 300:
      return go_home(block, plan, second_home_);
    case 281:
      return store_home(first_home_);
    case 301:
      return store_home(second_home_);
    case 520:
    case 920:
    case 921:
    case 922:
    case 923:
      return shift_zero(block, plan);
    case 580:
    case 590:
      return shift_axes(block, plan);
    case 1100:
    case 1110:
    case 1120:
      return set_pole(block, plan);
    default:
      return;  // G4 and G53 act elsewhere
  }
}

/// A rapid through the programmed words, then a rapid of these axes (of all when none is
/// programmed) to the home position.
void Executor::go_home(const BlockWords& block, const BlockPlan& plan, HomePosition& home) {
  motion_.kind = MotionKind::rapid;
  if (plan.axes != 0) {
    begin_motion(block, plan);
    motion_.machine_position = true;
    motion_.end = target(block, plan.axes);
    motion_.unknown_end = unknown_at_target(block, plan.axes);
    finish_motion();
  }
  const AxisMask moved = plan.axes != 0 ? plan.axes : settings_.axes;
  begin_motion(block, plan);
  motion_.machine_position = true;
  // With an XY rotation the controller takes the programmed words' coordinates of the home
  // position.
  AxisWords home_world;
  for (std::size_t i = 0; i < home_world.size(); ++i) {
    home_world[i] = home.machine[i] - coordinates_.tool()[i];
  }
  const AxisWords home_program = coordinates_.program_from_world(home_world);
  AxisWords program = coordinates_.program_from_world(motion_.start);
  motion_.end = motion_.start;
  motion_.unknown_end = coordinates_.unknown_after(moved & home.known);
  for (std::size_t i = 0; i < program.size(); ++i) {
    if ((moved & bit(i)) == 0) continue;
    program[i] = home_program[i];
    motion_.end[i] = home_world[i];
    if ((home.known & bit(i)) == 0) {
      motion_.unknown_end = static_cast<AxisMask>(motion_.unknown_end | bit(i));
    }
  }
  if (coordinates_.rotated()) motion_.end = coordinates_.world_from_program(program);
  finish_motion();
}

void Executor::store_home(HomePosition& home) const {
  for (std::size_t i = 0; i < home.machine.size(); ++i) {
    home.machine[i] = coordinates_.world()[i] + coordinates_.tool()[i];
  }
  home.known = static_cast<AxisMask>(~coordinates_.unknown() & 0x1ff);
}

void Executor::set_work_offset(const BlockWords& block, const BlockPlan& plan) {
  const int number = static_cast<int>(std::lround(block['P']));
  const int system = number == 0 ? coordinates_.system() : number;
  WorkOffset offset = coordinates_.offset(system);
  if (block['L'] == 20.0) {
    warn_unknown(block, plan.axes);
    // The programmed words become the coordinates of the present point in that system.
    Coordinates there = coordinates_;
    there.select_system(system);
    AxisWords program = there.program_from_world(coordinates_.world());
    for (std::size_t i = 0; i < program.size(); ++i) {
      if ((plan.axes & bit(i)) != 0) program[i] = word_value(block, i);
    }
    const AxisWords reached = there.world_from_program(program);
    for (std::size_t i = 0; i < program.size(); ++i) {
      offset.words[i] += coordinates_.world()[i] - reached[i];
    }
  } else {
    for (std::size_t i = 0; i < offset.words.size(); ++i) {
      if ((plan.axes & bit(i)) != 0) offset.words[i] = word_value(block, i);
    }
    if (block.has('R')) offset.rotation = radians_from_degrees(block['R']);
  }
  coordinates_.set_offset(system, offset);
  if (system == coordinates_.system()) offset_dirty_ = true;
}

void Executor::shift_zero(const BlockWords& block, const BlockPlan& plan) {
  if (plan.whole_comment) return;
  AxisWords shift = coordinates_.shift();
  switch (block.code(GGroup::non_modal)) {
    case 520:
      for (std::size_t i = 0; i < shift.size(); ++i) {
        if ((plan.axes & bit(i)) != 0) shift[i] = word_value(block, i);
      }
      break;
    case 920: {
      warn_unknown(block, plan.axes);
      const AxisWords program = coordinates_.program_from_world(coordinates_.world());
      for (std::size_t i = 0; i < shift.size(); ++i) {
        if ((plan.axes & bit(i)) != 0) shift[i] += program[i] - word_value(block, i);
      }
      break;
    }
    case 923:
      shift = coordinates_.stored_shift();
      break;
    default:
      shift = {};
      break;
  }
  const GCode code = block.code(GGroup::non_modal);
  coordinates_.set_shift(shift);
  coordinates_.set_shift_active(code == 520 || code == 920 || code == 923);
  if (code == 520 || code == 920 || code == 921) coordinates_.store_shift();
  offset_dirty_ = true;
}

void Executor::warn_unknown(const BlockWords& block, AxisMask words) {
  const auto fresh = static_cast<AxisMask>(words & coordinates_.unknown() & ~unknown_told_);
  if (fresh == 0) return;
  unknown_told_ = static_cast<AxisMask>(unknown_told_ | fresh);
  std::string letters;
  for (std::size_t i = 0; i < kAxisLetters.size(); ++i) {
    if ((fresh & bit(i)) != 0) letters += std::string(letters.empty() ? "" : " ") + kAxisLetters[i];
  }
  log_.warning("NC228",
               g_code_text(block.code(GGroup::non_modal)) + " sets the zero of " + letters +
                   " at a place that the program does not give: the axis is taken to stand at the "
                   "input machine's home position; move there by a program word before",
               at(block, GGroup::non_modal));
}

}  // namespace smoothpost::nc
