#pragma once

#include "postproc/jobs/job.h"

namespace smoothpost {

/// machines list | show NAME | validate FILE: what machine files there are, one in words, one
/// checked.
JobResult run_machines_command(const Options& options);

/// formats: input formats and output dialects of this version.
JobResult run_formats_command(const Options& options);

}  // namespace smoothpost
