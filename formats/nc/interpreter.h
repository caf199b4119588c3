#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/nc/program.h"
#include "kernels/core/canonical_motion.h"
#include "kernels/core/process.h"
#include "kernels/core/result.h"

namespace smoothpost::nc {

class ProgramStream;

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
  std::map<int, double> tool_diameters;    ///< mm, by tool number; for G41 and G42
  std::map<int, WorkOffset> work_offsets;  ///< by system 1..9 (G54..G59.3); absent: 0
  AxisWords home{};      ///< where the axes stand before the program; also G28/G30
  ProcessTable process;  ///< words <-> events of the input machine
  bool has_tcp = true;   ///< M428/M429 are known (linuxcnc)
  /// fanuc and haas: mm or degrees that one unit of a number without decimal point stands for: 1
  /// (calculator type) or 0.001 (least increment; a tenth of it in inch for lengths). Unset: such
  /// numbers are refused, but 0.
  std::optional<double> integer_increment;

  /// Folders with files of subroutines (subroutine_files.h), in the order of the search. None: only
  /// subroutines in the program's own text are called.
  std::vector<std::string> subroutine_folders;
  /// How much a program may run beyond its own length: blocks that loops and calls run again,
  /// motions that cycles and splines stand for, 256 bytes of a block or a file each. What would go
  /// on is refused, so that memory and time stay bounded.
  std::uint64_t run_budget = 1'000'000;
  /// Calls within each other; LinuxCNC allows 9.
  int call_depth = 9;
  /// A machine program: lines of program flow, calls, cycles, splines and G10 L1 are refused.
  bool plain_blocks = false;
};

/// The text of a subroutine's file that the run has read.
struct CalledFile {
  std::string name;  ///< without its folder
  std::string path;  ///< with it
  std::string text;
};

struct InterpretationSummary {
  bool uses_tcp = false;
  bool uses_rotary = false;
  bool ended = false;             ///< M2, M30 or a second %
  std::vector<int> tools;         ///< tool numbers that were changed to, in order
  std::vector<int> work_systems;  ///< systems used by motions, in order of first use
  std::vector<CalledFile> files;  ///< of subroutines, in the order of their first calls
};

/// Runs the program, with its loops and subroutines, through the modal state of its dialect
/// (Program::dialect) and calls `sink` for every motion, dwell, event and comment in the order in
/// which that controller would act. Errors are collected: reading goes on after a bad block so that
/// one run names every problem, but then the result has no value and what `sink` got is not a
/// program. A fault of the program's flow ends the run: what would come next is not known.
///
/// Lines are those of the program; what a subroutine in a file of its own does has the line of its
/// call. Diagnostics name the file and line of the fault. Cycles arrive as rapids, feeds, dwells
/// and spindle events; splines as straight pieces within kSplineTolerance (spline_curve.h).
///
/// A tool axis by vector (fanuc G43.5, siemens A3= B3= C3=) arrives as
/// CanonicalMotion::axis_vector; the A B C bits of its unknown_start and unknown_end then say
/// whether start_axis and end_axis are unknown.
Result<InterpretationSummary> interpret(const Program& program, const InterpreterSettings& settings,
                                        CanonicalSink& sink);

/// The same calls and diagnostics for a program that is parsed while it runs, to its end whatever
/// the run does. @pre the stream stands at its first window (program_stream.h: begins_again)
Result<InterpretationSummary> interpret(ProgramStream& stream, const InterpreterSettings& settings,
                                        CanonicalSink& sink);

}  // namespace smoothpost::nc
