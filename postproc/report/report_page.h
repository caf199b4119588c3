#pragma once

#include <string>
#include <vector>

#include "postproc/report/report_plots.h"
#include "postproc/report/scene_data.h"

namespace smoothpost {

struct ReportPage {
  std::string html;
  std::vector<NamedPlot> plots;  ///< the same pictures as in the page
};

/// The report page (docs/report.md): one file for the engineer who has to decide whether the
/// program runs. It needs no other file and no network, and forbids itself both (Content-Security
/// -Policy); verdict, tables and plots are there with scripts off.
///
/// Guarantees (tests): the same input gives the same bytes; nothing of the input becomes markup or
/// script; every check, diagnostic and axis of the conversion stands in it.
/// Units: mm, deg, s. Cost: some µs a block and a cycle of the timeline, at most 150,000 cycles;
/// about 1 kB a block while it runs; the page stays below 5 MB whatever the program.
ReportPage report_page(const PageInput& in, const SceneSettings& settings = {});

}  // namespace smoothpost
