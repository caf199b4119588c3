#pragma once

#include <string>

#include "kernels/core/mesh.h"
#include "kernels/core/result.h"
#include "postproc/pipeline/finish_path.h"
#include "postproc/pipeline/options.h"

// `smoothpost finish`: its options and the stock's file.
namespace smoothpost {

/// --pitch, --depth, --feed, --rpm, --from, --to, --lead-in, --normal-tolerance, --direction and
/// --tool. The machine's tolerances, mm and rad: smoothing the contours takes half of the tip's,
/// ways between path points a tenth of both. Failures: US166, naming the option, what it is and
/// what is expected.
Result<FinishSettings> read_finish_options(const Options& options, double tip_tolerance,
                                           double axis_tolerance);

/// A mesh as a binary STL file, in mm.
std::string stl_bytes(const TriangleMesh& mesh);

}  // namespace smoothpost
