#include <algorithm>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"
#include "formats/nc/plane.h"
#include "kernels/core/units.h"

// Canned cycles: what a block says of its holes, and the motions that they stand for.
namespace smoothpost::nc {
namespace {

constexpr AxisMask kLinearAxes = 7;
// How far above the last depth LinuxCNC begins the next peck; controls of the Fanuc family keep it
// in a parameter.
constexpr double kPeckClearance = 0.254;
constexpr double kFreeMotions = 16.0;  // of a block; what is more costs of the budget
constexpr double kNoMove = 1e-9;       // mm; less comes from turning to and fro
constexpr unsigned kWarnPeck = 6;      // behind the ones of execute_dialects.cpp

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1u << axis); }
bool is_whole(double value) { return std::abs(value - std::round(value)) <= 1e-4; }
bool needs_dwell(GCode code) { return code == 820 || code == 860 || code == 890; }
bool taps(GCode code) { return code == 740 || code == 840; }

}  // namespace

/// Takes the words of the block into the cycle's memory; what is missing or wrong, or empty.
std::string Executor::remember_cycle(const BlockWords& block, GCode code, std::size_t normal) {
  CycleMemory& memory = modal_.cycle;
  const auto take = [&](char letter, std::optional<double>& to) {
    if (block.has(letter)) to = block[letter];
  };
  const char depth = kAxisLetters[normal];
  take(depth, memory.bottom);
  take('R', memory.retract);
  take('Q', memory.peck);
  if (block.has('P')) {
    const bool milliseconds =
        !is_linuxcnc() &&
        !reader_.has_point(block.piece[static_cast<std::size_t>(letter_index('P'))]);
    memory.dwell = block['P'] * (milliseconds ? 1e-3 : 1.0);
  }
  if (code == 870) {
    const PlaneAxes plane = plane_axes(modal_.plane);
    take(plane.first_centre, memory.shift_first);
    take(plane.second_centre, memory.shift_second);
    take(plane.wrong_centre, memory.middle);
  }
  if (!memory.bottom) return std::string("the depth ") + depth + " is missing";
  if (!memory.retract) return "R, the height over the hole, is missing";
  if (code == 730 || code == 830) {
    if (!memory.peck) return "Q, the depth of a peck, is missing";
    if (!(*memory.peck > 0.0)) return "Q, the depth of a peck, is not above 0";
  }
  if (memory.dwell.value_or(0.0) < 0.0) return "P, the seconds to wait, is below 0";
  if (is_linuxcnc() && needs_dwell(code) && !memory.dwell) {
    return "P, the seconds to wait, is missing";
  }
  if (code == 870 && !(memory.shift_first && memory.shift_second && memory.middle)) {
    return "I J K, the shift beside the hole and the height of the step, are missing";
  }
  return {};
}

/// How often the hole is made, 0 only in the Fanuc family; -1: told that the word is wrong.
long Executor::cycle_repeats(const BlockWords& block) {
  const bool fanuc = !is_linuxcnc();
  const char letter = fanuc && block.has('K') ? 'K' : 'L';
  if (!block.has(letter)) return 1;
  const double count = block[letter];
  const double least = fanuc ? 0.0 : 1.0;
  if (is_whole(count) && count >= least - 1e-4 && count < 1e9) return std::lround(count);
  log_.error("NC260",
             joined({std::string_view(&letter, 1), shortest_text(count),
                     ": the repeats of a cycle are a whole number from ", fanuc ? "0" : "1"}),
             at(block, letter));
  return -1;
}

void Executor::cycle(const BlockWords& block, const BlockPlan& plan, GCode before) {
  const GCode code = plan.motion;
  const PlaneAxes plane = plane_axes(modal_.plane);
  const TextPlace place = at(block, GGroup::motion);
  const auto refuse = [&](const char* error_code, const std::string& why) {
    log_.error(error_code, g_code_text(code) + ": " + why, place);
  };
  if ((plan.axes & ~kLinearAxes) != 0) {
    return refuse("NC260", "a cycle has no words of rotary or further axes; position them before");
  }
  const bool continues = is_cycle(before);
  if (continues && is_linuxcnc() && modal_.cycle.incremental != modal_.incremental) {
    return refuse("NC261",
                  "the series goes on in another distance mode (G90, G91), where the height that "
                  "it returns to is not stated; write G80 before");
  }
  const AxisWords here = coordinates_.program_from_world(coordinates_.world());
  const double level = continues ? modal_.cycle.level : here[plane.third];
  // LinuxCNC keeps the words of one and the same cycle, the Fanuc family those of all.
  if (is_linuxcnc() ? before != code : !continues) modal_.cycle = {};
  modal_.cycle.level = level;
  modal_.cycle.incremental = modal_.incremental;
  if (plan.axes == 0 && is_linuxcnc()) {
    return refuse("NC260", "the axis words are missing; write the place of the hole");
  }
  const long repeats = cycle_repeats(block);
  const std::string missing = remember_cycle(block, code, plane.third);
  if (repeats < 0) return;
  if (plan.axes == 0 || repeats == 0) return;  // Fanuc: only the words are kept
  if (!missing.empty()) return refuse("NC260", missing);
  if (modal_.inverse_time) return refuse("NC261", "no cycle in inverse time mode; write G94");
  if (!is_linuxcnc() && modal_.tcp) {
    return refuse("NC261", "no cycle in tool-centre-point mode; end it before");
  }
  if (is_linuxcnc() && taps(code) && modal_.plane != 170) {
    return refuse("NC261",
                  "outside of G17 LinuxCNC 2.9 moves along wrong axes in this cycle; write the "
                  "moves out");
  }
  const bool turns = modal_.spindle == 3 || modal_.spindle == 4;
  if ((code == 840 && modal_.spindle != 3) || (code == 740 && modal_.spindle != 4) ||
      ((code == 860 || code == 870) && !turns)) {
    return refuse("NC261", std::string("the spindle does not turn as the cycle needs it; write ") +
                               (code == 740 ? "M4" : "M3") + " before");
  }
  if ((coordinates_.unknown() & bit(plane.third)) != 0) {
    return refuse("NC261", std::string("where ") + kAxisLetters[plane.third] +
                               " stands is not known: the program has not given it; move there "
                               "before");
  }
  if (!feed_given(block, plan)) return;

  const CycleMemory& memory = modal_.cycle;
  CycleHole hole;
  hole.code = code;
  const double base = modal_.incremental ? level : 0.0;
  hole.retract = base + *memory.retract * modal_.unit;
  hole.bottom = (modal_.incremental ? hole.retract : 0.0) + *memory.bottom * modal_.unit;
  if (!std::isfinite(hole.retract) || !std::isfinite(hole.bottom)) {
    return refuse("NC260", "R or the depth is no position of a machine");
  }
  if (hole.retract < hole.bottom) {
    return refuse("NC260", "R, " + shortest_text(hole.retract) + " mm, is below the bottom, " +
                               shortest_text(hole.bottom) + " mm; write R above the depth");
  }
  hole.clear = modal_.retract_to_old ? std::max(level, hole.retract) : hole.retract;
  hole.peck = memory.peck.value_or(0.0) * modal_.unit;
  hole.dwell = memory.dwell.value_or(0.0);
  hole.clearance = kPeckClearance;
  if (code == 870) {
    hole.middle = (modal_.incremental ? hole.bottom : 0.0) + *memory.middle * modal_.unit;
  }
  // Infinitely many pecks are as refused as too many.
  const double motions =
      static_cast<double>(repeats) * (3.0 * peck_count(hole) + (code == 870 ? 12.0 : 5.0)) -
      kFreeMotions;
  const auto cost =
      motions < 1e18 ? static_cast<std::uint64_t>(std::max(0.0, motions)) : ~std::uint64_t{0};
  if (!spend(cost, place)) return;
  if (!is_linuxcnc() && (code == 730 || code == 830)) {
    warn_once(kWarnPeck,
              "the clearance of pecks (d) is a parameter of the control; 0.254 mm is taken", block,
              block.first_piece);
  }

  AxisWords program = here;
  // LinuxCNC goes to R on its own when the series began below it; else it rises on the way.
  const double under = is_linuxcnc() ? level : program[plane.third];
  if (under < hole.retract) {
    program[plane.third] = hole.retract;
    cycle_move(block, plan, MotionKind::rapid, program);
  }
  for (long i = 0; i < repeats; ++i) {
    for (const std::size_t axis : {plane.first, plane.second}) {
      if ((plan.axes & bit(axis)) == 0) continue;
      const double value = word_value(block, axis);
      program[axis] = modal_.incremental ? program[axis] + value : value;
    }
    program[plane.third] =
        modal_.retract_to_old ? hole.clear : std::max(program[plane.third], hole.retract);
    cycle_move(block, plan, MotionKind::rapid, program);
    program[plane.third] = hole.retract;
    cycle_move(block, plan, MotionKind::rapid, program);
    drill(block, plan, hole);
    program = coordinates_.program_from_world(coordinates_.world());
    program[plane.third] = hole.clear;
  }
}

void Executor::drill(const BlockWords& block, const BlockPlan& plan, const CycleHole& hole) {
  using Kind = CycleStep::Kind;
  const PlaneAxes plane = plane_axes(modal_.plane);
  const AxisWords centre = coordinates_.program_from_world(coordinates_.world());
  AxisWords program = centre;
  for (const CycleStep& step : cycle_steps(hole)) {
    switch (step.kind) {
      case Kind::rapid:
      case Kind::feed:
        program[plane.third] = step.value;
        cycle_move(block, plan, step.kind == Kind::feed ? MotionKind::feed : MotionKind::rapid,
                   program);
        break;
      case Kind::aside:
        program[plane.first] = centre[plane.first] + *modal_.cycle.shift_first * modal_.unit;
        program[plane.second] = centre[plane.second] + *modal_.cycle.shift_second * modal_.unit;
        cycle_move(block, plan, MotionKind::rapid, program);
        break;
      case Kind::centre:
        program[plane.first] = centre[plane.first];
        program[plane.second] = centre[plane.second];
        cycle_move(block, plan, MotionKind::rapid, program);
        break;
      case Kind::dwell:
        if (step.value > 0.0) sink_.dwell(step.value, block.input_line);
        break;
      case Kind::spindle_stop:
        act_on_m(5, block);
        break;
      case Kind::spindle_orient:
        act_on_m(19, block);
        break;
      case Kind::spindle_back:
        act_on_m(modal_.spindle == 3 ? 4 : 3, block);
        break;
      case Kind::spindle_on:
        act_on_m(modal_.spindle, block);
        break;
    }
  }
}

/// One straight motion of a cycle to a place in program coordinates.
void Executor::cycle_move(const BlockWords& block, const BlockPlan& plan, MotionKind kind,
                          const AxisWords& program) {
  begin_motion(block, plan);
  motion_.kind = kind;
  motion_.end = motion_.start;
  const AxisWords here = coordinates_.program_from_world(motion_.start);
  const AxisWords there = coordinates_.world_from_program(program);
  for (std::size_t i = 0; i < 3; ++i) {
    // What stays where it is keeps its digits.
    if (program[i] != here[i] || coordinates_.rotated()) motion_.end[i] = there[i];
  }
  const AxisMask written = modal_.incremental ? 0 : plan.axes;
  const AxisMask known = bit(plane_axes(modal_.plane).third);
  motion_.unknown_end = coordinates_.unknown_after(static_cast<AxisMask>(written | known));
  bool stays = motion_.unknown_end == motion_.unknown_start;
  for (std::size_t i = 0; i < 3; ++i) {
    stays = stays && std::abs(program[i] - here[i]) < kNoMove;
  }
  if (stays) return;
  if (kind == MotionKind::feed) {
    double squares = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      squares += (motion_.end[i] - motion_.start[i]) * (motion_.end[i] - motion_.start[i]);
    }
    motion_.duration = duration_of(motion_, std::sqrt(squares), block);
  }
  finish_motion();
}

}  // namespace smoothpost::nc
