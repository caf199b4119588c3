#pragma once

#include "postproc/jobs/job.h"

namespace smoothpost {

/// machines list | show NAME | validate FILE | test-program NAME | import FILE (import_command.h) |
/// fit MEASURED.csv (fit_command.h): what machine files there are, one
/// in words, one checked, and a slow program that proves one on its machine (--tool N=length, -o).
JobResult run_machines_command(const Options& options);

/// formats: input formats and output dialects of this version.
JobResult run_formats_command(const Options& options);

}  // namespace smoothpost
