#pragma once

#include "postproc/jobs/job.h"

namespace smoothpost {

/// machines import FILE [LIMITS.yaml] [WORD=VALUE ...] [-o machine.toml]: a URDF, a LinuxCNC INI or
/// a machine of FreeCAD as a machine file, checked as `machines validate` does; without -o it goes
/// to standard output. US170: words that are not understood, a file of another kind; MF2xx.
/// @pre options.arguments[0] is "import"
JobResult run_import_command(const Options& options);

}  // namespace smoothpost
