#pragma once

#include "kernels/core/progress.h"
#include "postproc/jobs/job.h"
#include "postproc/pipeline/options.h"

namespace smoothpost {

/// `batch JOBS.toml`: runs every job of the file (batch_file.h) that is not finished yet, each in a
/// process of its own, `jobs` at a time (default: one for each processor), and writes a summary.
///
/// A job is finished when it ended with status 0 before, with the same options and the same
/// version, when every file that it read has the same bytes, and every file that it wrote is there
/// unchanged. What ended otherwise is run again. No job stops another: a process that crashes
/// counts as a job with status 1 (IN103).
///
/// `list`: the text is the jobs' names, one a line. `only`: runs that one job here and now,
/// unless it is finished, and gives its result; other processes, on other machines too, may run
/// other jobs of the file at the same time. Files: <results>/<job>.json, .log and the program;
/// records/<job>.json is what a restart looks at, written last; summary.json, summary.html.
///
/// Status: the worst of the jobs', as status_of() ranks them. Failures: those of
/// read_batch_file(), US104, US183 (jobs), US184 (only), US185 (worker), US190 (cancelled: what
/// runs is stopped, what is finished stays).
JobResult run_batch_command(const Options& options, const Progress& progress);

}  // namespace smoothpost
