#pragma once

#include "postproc/jobs/job.h"

namespace smoothpost {

/// machines fit MEASURED.csv -m MACHINE [fit=A.origin,tool.tip,...] [--tool N=length] [-o FILE]:
/// the parameters of the machine file that fit the readings best (docs/how_to/fit_a_machine.md), as
/// a report, and with -o as the machine file with these numbers and nothing else changed. Without
/// fit= the origins of all rotary axes. US171: words; CSV1xx: the table; KN180 to KN182: readings
/// that do not tell the parameters.
/// @pre options.arguments[0] is "fit"
JobResult run_fit_command(const Options& options);

}  // namespace smoothpost
