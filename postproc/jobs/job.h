#pragma once

#include <string>
#include <vector>

#include "kernels/core/diagnostic.h"
#include "kernels/core/progress.h"
#include "postproc/pipeline/hash.h"
#include "postproc/pipeline/options.h"
#include "postproc/report/report_plots.h"

namespace smoothpost {

/// Exit statuses of the tool, fixed: docs/diagnostics.md.
enum class ExitStatus { certified = 0, internal = 1, usage = 2, refused = 3, unreadable = 4 };

/// What a run made. Files named in the options are written already; `program` and `report` are also
/// here.
struct JobResult {
  ExitStatus status = ExitStatus::internal;
  std::string verdict;
  std::string program;           ///< empty unless certified or forced
  std::string program_path;      ///< where it was written; empty: nowhere
  std::string report;            ///< JSON, for convert, check and place
  std::string page;              ///< HTML, likewise, when options.report or options.plots
  std::vector<NamedPlot> plots;  ///< of the page
  std::string line_map;          ///< JSON, for convert
  std::string trajectory;        ///< CSV, when options.trajectory
  std::string text;              ///< for people: place, machines, formats, golden, batch
  std::string summary;           ///< one line: verdict, checks, time
  Diagnostics diagnostics;
  std::vector<FileHash> read;     ///< every file that the run has read, in order
  std::vector<FileHash> written;  ///< and written
};

inline constexpr const char* kVersion = "0.1.0";

/// Runs one command. Never throws for the user's faults; writes files atomically, reports also on
/// refusal, the program only when it is certified or forced.
JobResult run_job(const Options& options, const Progress& progress);

/// The status that the errors among `diagnostics` call for; certified when there is none.
ExitStatus status_of(const Diagnostics& diagnostics);

}  // namespace smoothpost
