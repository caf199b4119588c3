#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/cl/reader.h"
#include "formats/nc/interpreter.h"
#include "kernels/core/result.h"
#include "machines/definition/machine.h"
#include "machines/definition/machine_file.h"
#include "postproc/pipeline/hash.h"
#include "postproc/pipeline/options.h"

namespace smoothpost {

struct LoadedMachine {
  MachineDefinition definition;
  std::string path;
  std::string text;
  std::vector<FileHash> files;  ///< the machine file and the meshes of its bodies
};

/// Folders that machine names are searched in, in order: --machine-path, $SMOOTHPOST_MACHINES, the
/// installed share/smoothpost/machines and the source tree's machines/ beside the library.
std::vector<std::string> machine_folders(const Options& options);

/// The file of a machine that is given by name or file; empty when no folder has that name.
std::string machine_file_of(const std::string& name_or_file, const Options& options);

/// A machine by name or file, with `overrides` applied.
Result<LoadedMachine> load_machine(const std::string& name_or_file, const Options& options,
                                   const std::vector<MachineOverride>& overrides);

/// --set and the options that are short for it (--tip-tolerance, --smoothing ...), as overrides.
Result<std::vector<MachineOverride>> overrides_of(const Options& options);

/// "G54=1,2,3[,a,b,c]" for every entry; mm and degrees, `a b c` turn about X, Y, Z in the order
/// Rz·Ry·Rx.
struct OffsetOption {
  int system = 1;
  Vec3 position = Vec3::Zero();
  Vec3 turn = Vec3::Zero();  ///< rad
};
Result<std::vector<OffsetOption>> read_offsets(const std::vector<std::string>& texts,
                                               const std::string& option);

/// Tools of the input: lengths and diameters (mm) by number, and the numbers of tools that it calls
/// by a name.
struct ToolTable {
  std::map<int, double> lengths;
  std::map<int, double> diameters;
  std::map<std::string, int> numbers;
};

/// --tool N=length, N=length,diameter or NAME:N=length, repeated. US143.
Result<ToolTable> read_tools(const std::vector<std::string>& texts);

/// --input-unit, --input-feed, --cl-frames, --cl-circles. US162 to US165.
Result<cl::ReaderSettings> read_cl_options(const Options& options);

/// How far an NC program may run beyond its own text; nothing: the interpreter's defaults.
struct RunBounds {
  std::optional<std::uint64_t> run_budget;
  std::optional<int> call_depth;
};
/// --run-budget (0 to 1e12), --call-depth (0 to 1000). US172.
Result<RunBounds> read_run_bounds(const Options& options);

/// A finite decimal number; nothing for anything else.
std::optional<double> read_number(std::string_view text);

Diagnostic usage_error(const char* code, std::string text);

/// US121: no output dialect of that name, with the nearest one.
Diagnostic no_dialect(const std::string& name);

}  // namespace smoothpost
