#pragma once

#include <string>
#include <vector>

#include "kernels/core/mesh.h"
#include "kernels/core/result.h"
#include "postproc/pipeline/hash.h"
#include "postproc/pipeline/interpret.h"
#include "postproc/pipeline/options.h"

// What the options of a run say about its inputs, and the inputs read by it.
namespace smoothpost {

/// A CAM program and what was read for it, which is told whether or not the program could be read.
struct CamProgram {
  Result<InterpretedInput> input;
  std::string format;           ///< InputFormat::name; empty: not known (US103)
  std::vector<FileHash> files;  ///< the input machine's, the process table's, subroutines'
};

/// Reads a CAM program by --input-format, or by its name's extension, with the options of input:
/// --input-dialect, --integer-unit, --input-machine, --process, --tool, --input-work-offset,
/// --run-budget, --call-depth and those of CL. Subroutines are looked for beside a program that is
/// a file. Fails with what these options and the format fail with, US103, US122, US159.
CamProgram read_cam_program(const Options& options, const std::string& name, std::string bytes);

/// The mesh of an STL file, welded, in mm by --workpiece-unit, with warnings about its surface.
/// Fails with US145 and what read_stl() fails with.
Result<TriangleMesh> read_mesh(const Options& options, const std::string& bytes,
                               const std::string& name);

}  // namespace smoothpost
