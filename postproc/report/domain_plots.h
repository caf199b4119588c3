#pragma once

#include <string_view>
#include <vector>

#include "postproc/report/report_plots.h"

namespace smoothpost {

/// The fields of lead and tilt of a JSON report, key `domain_maps` (docs/report.md): a list of
///   {"input_line": n, "lead_deg": [columns], "tilt_deg": [rows], "free": [[row of 0 or 1], ...],
///    "programmed": [lead, tilt], "chosen": [lead, tilt]}.
/// At most 24 of them, of at most 181 by 181 values, and as many as 400 kB hold. Nothing when there
/// are none; what is malformed is left out.
std::vector<NamedPlot> domain_plots(std::string_view report);

}  // namespace smoothpost
