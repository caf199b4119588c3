#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/diagnostic.h"
#include "postproc/pipeline/hash.h"
#include "postproc/report/report_page.h"

// The report page of a run and its plots as files.
namespace smoothpost {

/// What a page shows besides conversion and machine; see PageInput.
struct PageParts {
  Pose placement = Pose::Identity();
  const InterpretedInput* input = nullptr;
  const TriangleMesh* part = nullptr;
  double tool_length = 0.0;
  std::string_view input_text = {};
  std::string_view program_text = {};  ///< empty: that of the conversion
};

/// The page of a conversion; `report` is its JSON report. `machine` may be null: nothing is drawn.
ReportPage page_of(const Conversion& conversion, const ReportContext& context,
                   const MachineDefinition* machine, const PageParts& parts,
                   std::string_view report);

/// Writes every plot as <name>.svg into a folder, which is made when it does not exist. Fails with
/// US131. `written` gets what was written.
Diagnostics write_plots(const std::string& folder, const std::vector<NamedPlot>& plots,
                        std::vector<FileHash>& written);

}  // namespace smoothpost
