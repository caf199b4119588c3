#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/nc/program.h"
#include "kernels/core/canonical_motion.h"
#include "kernels/core/process.h"
#include "kernels/core/result.h"

namespace smoothpost::nc {

/// A work offset: what a controller adds to programmed words. mm and rad; `rotation` is about Z.
struct WorkOffset {
  AxisWords words{};
  double rotation = 0.0;
};

/// What the interpreter must know of the input's controller and machine.
struct InterpreterSettings {
  bool inch_default = false;    ///< unit before the first G20/G21
  bool execute_deleted = true;  ///< lines with / run (block delete switch off)
  AxisMask axes = 0x1ff;        ///< axis words that the input machine has; others are refused
  bool any_axis_needs_machine = false;     ///< rotary words are refused: no input machine was named
  std::map<int, double> tool_lengths;      ///< mm, by tool number
  std::map<int, WorkOffset> work_offsets;  ///< by system 1..9 (G54..G59.3); absent: 0
  AxisWords home{};      ///< where the axes stand before the program; also G28/G30
  ProcessTable process;  ///< words <-> events of the input machine
  bool has_tcp = true;   ///< M428/M429 are known (linuxcnc)
  /// fanuc and haas: mm or degrees that one unit of a number without decimal point stands for: 1
  /// (calculator type) or 0.001 (least increment; a tenth of it in inch for lengths). Unset: such
  /// numbers are refused, but 0.
  std::optional<double> integer_increment;
};

struct InterpretationSummary {
  bool uses_tcp = false;
  bool uses_rotary = false;
  bool ended = false;             ///< M2, M30 or a second %
  std::vector<int> tools;         ///< tool numbers that were changed to, in order
  std::vector<int> work_systems;  ///< systems used by motions, in order of first use
};

/// Runs the program through the modal state of its dialect (Program::dialect) and calls `sink` for
/// every motion, dwell, event and comment in the order in which that controller would act. Errors
/// are collected: reading goes on after a bad block so that one run names every problem, but then
/// the result has no value and what `sink` got is not a program.
///
/// A tool axis by vector (fanuc G43.5, siemens A3= B3= C3=) arrives as
/// CanonicalMotion::axis_vector; the A B C bits of its unknown_start and unknown_end then say
/// whether start_axis and end_axis are unknown.
Result<InterpretationSummary> interpret(const Program& program, const InterpreterSettings& settings,
                                        CanonicalSink& sink);

}  // namespace smoothpost::nc
