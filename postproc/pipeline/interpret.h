#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/cl/reader.h"
#include "formats/nc/interpreter.h"
#include "kernels/core/result.h"
#include "postproc/pipeline/reference_path.h"

namespace smoothpost {

/// What is known of the input besides its text.
struct InputSettings {
  std::string file_name;
  std::optional<MachineDefinition> machine;  ///< the input was posted for it
  std::optional<ProcessTable> process;       ///< in place of the machine's
  std::map<int, double> tool_lengths;        ///< mm, by tool number
  std::map<int, double> tool_diameters;      ///< mm, by tool number
  std::map<std::string, int> tool_numbers;   ///< of tools that the input calls by a name
  std::map<int, nc::WorkOffset> work_offsets;
  std::optional<nc::InputDialect> dialect;  ///< nothing: found out when only one fits the text
  /// fanuc, haas: mm or deg that one unit of a number without point is; nothing: refused
  std::optional<double> integer_unit;
  std::vector<std::string> subroutine_folders;  ///< where NC text may find files of subroutines
  std::optional<std::uint64_t> run_budget;      ///< nothing: InterpreterSettings::run_budget
  std::optional<int> call_depth;                ///< nothing: InterpreterSettings::call_depth
  cl::ReaderSettings cl;  ///< of CL data; its process table is taken from the members above
};

/// The name of --input-dialect, and the dialect of that name.
std::string dialect_name(nc::InputDialect dialect);
std::optional<nc::InputDialect> input_dialect(std::string_view name);

/// A file that the input calls, by its content.
struct InputFile {
  std::string name;  ///< without its folder
  std::string sha256;
  std::string path;  ///< with it; not part of the report, which is the same on every machine
};

/// The input as a tool path in the part, with the frames that its words were read in.
struct InterpretedInput {
  ToolPath path;
  ReferencePath::Frames frames;
  std::vector<std::string> assumes;  ///< what the reading took for granted, for the certificate
  std::string reference;             ///< how the input is interpolated, for the certificate
  std::string dialect;               ///< of NC text: linuxcnc, fanuc ...
  std::size_t lines = 0;
  std::vector<InputFile> files;  ///< of subroutines that were read, in the order of their calls
  bool uses_tools = false;       ///< a tool was changed or compensated
  int system = 1;                ///< work system of the first motion, 1..9 for G54..G59.3
};

/// Reads NC text (a text with BEGIN PGM at its head by interpret_heidenhain, unless
/// settings.dialect says a dialect): parse, modal interpretation, then the input machine's
/// kinematics.
///  - The way from the unknown position before the program to the first known position, and the way
///  over
///    positions of the input machine (G53, G28, G30), have no meaning on another machine: such
///    segments are marked `replanned` (at the end of a program they are left out: the end template
///    takes over).
///  - W is the program's coordinate system at its first motion.
Result<InterpretedInput> interpret_nc(std::string text, const InputSettings& settings);

/// Reads a conversational program of Heidenhain controls; points and events as for NC text.
Result<InterpretedInput> interpret_heidenhain(std::string text, const InputSettings& settings);

/// Reads CL data (APT, NX CLSF): tip and tool axis in the part, the way to the first position and
/// events as for NC text. W is the frame of the coordinates.
Result<InterpretedInput> interpret_cl(std::string text, const InputSettings& settings);

/// Reads CSV cutter locations.
Result<InterpretedInput> interpret_csv(std::string text, const InputSettings& settings);

}  // namespace smoothpost
